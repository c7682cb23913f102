"""The stretched cross-section: Eqs. (10) to (12), (19) to (24) and (S2) to (S6) of the paper.

Pure functions of numbers or CasADi symbols. The stretch is a given here: `stretch_balance` is the residual whose root
it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.robot import Robot


@dataclass(frozen=True, eq=False)
class Section:
    """A section at one stretch and set of pressures. SI units, body frame (S1 is +x), N chambers.

    stretch : lambda [-].
    outer_radius, lumen_radius, chamber_circle_radius : r_r, r_i, r_cp [m], shrunk by lambda^-1/2 (S2).
    chamber_radius, bore_radius : r_co, which the thread keeps, and r_ci of Eq. (22) [m].
    centres : N pairs (d_ix, d_iy) [m].
    area : A = A_0 / lambda [m^2]; reference_area : A_0 (S6).
    pressure_area : the area A_c that pressure acts on in a chamber [m^2].
    pressure_force : F_P = sum P_i A_c [N]; pressure_moment : (x, y) of sum d_i x P_i A_c e3 [N m].
    tangent_modulus : E_t of Eq. (24) [Pa]; engineering_stress : sigma_e [Pa].
    axial_stiffness : EA of Eq. (11) [N]; shear_stiffness : GA [N].
    bending_stiffness : (EI_x, EI_y) of Eq. (12) [N m^2]; torsional_stiffness : GJ [N m^2].
    """

    stretch: Any
    outer_radius: Any
    lumen_radius: Any
    chamber_circle_radius: Any
    chamber_radius: Any
    bore_radius: Any
    centres: tuple[tuple[Any, Any], ...]
    area: Any
    reference_area: Any
    pressure_area: Any
    pressure_force: Any
    pressure_moment: tuple[Any, Any]
    engineering_stress: Any
    tangent_modulus: Any
    axial_stiffness: Any
    shear_stiffness: Any
    bending_stiffness: tuple[Any, Any]
    torsional_stiffness: Any


def reference_area(robot: Robot, coefficients: Coefficients, conventions: Conventions) -> Any:
    """Return the silicone's area A_0 before pressure, (S6), times k_a [m^2]."""
    N, t_f = robot.chambers, conventions.fibre_thickness
    r_r, r_i, r_ci, r_co = robot.outer_radius, robot.lumen_radius, robot.bore_radius, robot.chamber_radius
    fibre = N * ((r_co + t_f) ** 2 - r_co**2)
    return coefficients.area * ca.pi * (r_r**2 - r_i**2 - N * r_ci**2 - fibre)


def deform(
    robot: Robot,
    material: Material,
    set_pressures: Any,
    stretch: Any,
    coefficients: Coefficients,
    conventions: Conventions = REPRODUCTION,
) -> Section:
    """Return the section at a stretch, Eqs. (11), (12), (22), (24), (S2) to (S6).

    `set_pressures` is indexable by set, one gauge pressure each [Pa]. Nothing is raised: a section past its
    limits shows as a stiffness that is not positive.
    """
    k_b, k_i, phi = coefficients.bending, coefficients.inertia, coefficients.bore_fraction
    N, t_f, pi = robot.chambers, conventions.fibre_thickness, ca.pi
    P = [set_pressures[i] for i in robot.set_of_chamber]

    shrink = 1 / ca.sqrt(stretch)
    r_r, r_i, r_cp = (r * shrink for r in (robot.outer_radius, robot.lumen_radius, robot.chamber_circle_radius))
    d = tuple((x * shrink, y * shrink) for x, y in robot.chamber_centres())
    r_co = robot.chamber_radius
    r_ci = ca.sqrt(r_co**2 - (r_co**2 - robot.bore_radius**2) / stretch)
    A_0 = reference_area(robot, coefficients, conventions)
    A = A_0 / stretch

    def inertia(r: Any, offset: Any) -> Any:
        return pi * (r**4 / 4 + r**2 * offset**2)

    r_f = r_co + t_f
    ring = pi * (r_r**4 - r_i**4) / 4
    I_x, I_y = (
        k_i * (ring - sum(inertia(r_ci, d_i[k]) + pi * (r_f**3 * t_f + 2 * r_f * t_f * d_i[k] ** 2) for d_i in d))
        for k in (1, 0)
    )
    J_z = (
        pi * (r_r**4 - r_i**4) / 2
        - N * pi * (r_ci**4 / 2 + r_ci**2 * r_cp**2)
        - N * pi * (2 * r_f**3 * t_f + 2 * r_f * t_f * r_cp**2)
    )

    r_p = r_ci + phi * (r_co - r_ci)
    A_c = pi * r_p**2
    F_P = A_c * sum(P)
    M_P = (A_c * sum(P_i * d_i[1] for P_i, d_i in zip(P, d, strict=True)),
           -A_c * sum(P_i * d_i[0] for P_i, d_i in zip(P, d, strict=True)))  # fmt: skip

    Pbar = sum(P) / N
    chamber_terms = []
    for k in (1, 0):
        I_c = [inertia(r_p, d_i[k]) for d_i in d]
        if conventions.mean_pressure:
            chamber_terms.append(Pbar * sum(I_c))
        else:
            chamber_terms.append(sum(P_i * I_i for P_i, I_i in zip(P, I_c, strict=True)))

    E_t = material.tangent_modulus(stretch)
    G = material.shear_modulus(stretch)
    return Section(
        stretch=stretch,
        outer_radius=r_r,
        lumen_radius=r_i,
        chamber_circle_radius=r_cp,
        chamber_radius=r_co,
        bore_radius=r_ci,
        centres=d,
        area=A,
        reference_area=A_0,
        pressure_area=A_c,
        pressure_force=F_P,
        pressure_moment=M_P,
        engineering_stress=material.engineering_stress(stretch),
        tangent_modulus=E_t,
        axial_stiffness=E_t * A + coefficients.elongation * F_P,
        shear_stiffness=G * A,
        bending_stiffness=(E_t * I_x + k_b * chamber_terms[0], E_t * I_y + k_b * chamber_terms[1]),
        torsional_stiffness=G * J_z,
    )


STIFFNESSES = ("E_t", "EA", "EI_x", "EI_y", "GA", "GJ")
"""What the section gives the rod; where one of them is not positive there is no pose."""


def stiffnesses(section: Section) -> list[Any]:
    """Return the stiffnesses of a section in the order of `STIFFNESSES`."""
    return [
        section.tangent_modulus,
        section.axial_stiffness,
        *section.bending_stiffness,
        section.shear_stiffness,
        section.torsional_stiffness,
    ]


def stretch_balance(section: Section, coefficients: Coefficients, conventions: Conventions = REPRODUCTION) -> Any:
    """Return the axial imbalance A_0 sigma_e - F_P +- k_e F_P (lambda - 1) [N], Eqs. (10), (19), (21), (23).

    Zero at equilibrium. The stiffening force opposes the pressure unless the conventions say as printed.
    """
    sign = 1 if conventions.stiffening_opposes_pressure else -1
    F_P = section.pressure_force
    return (
        section.reference_area * section.engineering_stress
        - F_P
        + sign * coefficients.elongation * F_P * (section.stretch - 1)
    )
