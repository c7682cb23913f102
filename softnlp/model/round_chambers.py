"""The paper's section, round with reinforced chambers: Eqs. (10) to (12), (19) to (24) and (S2) to (S6).

Pure functions of numbers or CasADi symbols. The stretch is a given here: `imbalance` is the residual whose root it is.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.robot import DIMENSIONS, LOWERABLE_RULES, Robot, check, touching_stretch
from softnlp.model.section import Section, SectionRadii, SectionState

SIZES = tuple(d.field for d in DIMENSIONS if d.scale is not None)
"""Dimensions that are numbers of a section, the length among them."""
_COEFFICIENT_NAMES = {
    "elongation": "stiffening.elongation",
    "bending": "stiffening.bending",
    "area": "corrections.area",
    "inertia": "corrections.inertia",
    "bore_fraction": "corrections.bore_fraction",
}
_ROUNDING = 1e-9  # of a stretch that is found by iterations
FACTOR = "corrections.modulus_factor"
OF_COEFFICIENTS = {**_COEFFICIENT_NAMES, "modulus_factor": FACTOR}
"""Keys of coefficients, of which a section has its own."""


@dataclass(frozen=True, eq=False)
class RoundState(SectionState):
    """A section at one stretch and set of pressures. SI units, body frame (S1 is +x), N chambers.

    Beside what every section has,
    outer_radius, lumen_radius, chamber_circle_radius : r_r, r_i, r_cp [m], shrunk by lambda^-1/2 (S2).
    chamber_radius, bore_radius : r_co, which the thread keeps, and r_ci of Eq. (22) [m].
    area : A = A_0 / lambda [m^2]; reference_area : A_0 (S6).
    pressure_area : the area A_c that pressure acts on in a chamber [m^2].
    engineering_stress : sigma_e [Pa].
    """

    outer_radius: Any
    lumen_radius: Any
    chamber_circle_radius: Any
    chamber_radius: Any
    bore_radius: Any
    area: Any
    reference_area: Any
    pressure_area: Any
    engineering_stress: Any


def radii(robot: Robot, stretch: Any) -> SectionRadii:
    """Return the deformed radii at a stretch, for numbers or arrays, (S2) and Eq. (22)."""
    shrink, r_co = stretch**-0.5, robot.chamber_radius
    return SectionRadii(
        outer=robot.outer_radius * shrink,
        lumen=robot.lumen_radius * shrink,
        chamber_circle=robot.chamber_circle_radius * shrink,
        chamber=r_co,
        bore=(r_co**2 - (r_co**2 - robot.bore_radius**2) / stretch) ** 0.5,
    )


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
) -> RoundState:
    """Return the section at a stretch, Eqs. (10) to (12), (19), (21) to (24), (S2) to (S6).

    `set_pressures` is indexable by set, one gauge pressure each [Pa]. Nothing is raised: a section past its
    limits shows as a stiffness that is not positive. The imbalance is A_0 sigma_e - F_P +- k_e F_P (lambda - 1), where
    the stiffening force opposes the pressure unless the conventions say as printed.
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
    EA = E_t * A + coefficients.elongation * F_P
    sigma = material.engineering_stress(stretch)
    sign = 1 if conventions.stiffening_opposes_pressure else -1
    return RoundState(
        imbalance=A_0 * sigma - F_P + sign * coefficients.elongation * F_P * (stretch - 1),
        line_density=material.density * A,
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
        engineering_stress=sigma,
        tangent_modulus=E_t,
        axial_stiffness=EA,
        shear_stiffness=G * A,
        bending_stiffness=(E_t * I_x + k_b * chamber_terms[0], E_t * I_y + k_b * chamber_terms[1]),
        torsional_stiffness=G * J_z,
        chamber_stiffness=E_t * pi * r_co**2,
    )


def with_numbers(
    robot: Robot, material: Material, coefficients: Coefficients, numbers: Mapping[str, Any]
) -> tuple[Robot, Material, Coefficients]:
    """Return the same with other numbers or symbols, by the keys of its section's `quantities`."""
    constants = {c.name: numbers[f"material.{c.name}"] for c in material.law.constants}
    return (
        replace(robot, **{name: numbers[f"robot.{name}"] for name in SIZES if f"robot.{name}" in numbers}),
        replace(material, constants=constants, density=numbers["material.density"]),
        replace(coefficients, **{field: numbers[name] for field, name in OF_COEFFICIENTS.items() if name in numbers}),
    )


def of_model(robot: Robot, material: Material) -> list[Quantity]:
    """Return the numbers of a robot and its silicone as quantities."""
    declared = []
    for name in SIZES:
        value = float(getattr(robot, name))
        unit = "rad" if name == "chamber_angle" else "m"
        declared.append(quantity(f"robot.{name}", unit, value, scale=max(abs(value), 1e-4), lower=0.0))
    return [*declared, *of_silicone(material)]


def of_silicone(material: Material) -> list[Quantity]:
    """Return the numbers of a silicone as quantities."""
    declared = []
    for constant in material.law.constants:
        value = float(material.constants[constant.name])
        unit = "Pa" if constant.unit == "MPa" else constant.unit
        declared.append(quantity(f"material.{constant.name}", unit, value, scale=abs(value) or 1.0))
    declared.append(quantity("material.density", "kg/m^3", float(material.density), scale=1e3, lower=0.0))
    return declared


def fitted_warnings(material: Material, stretch: float) -> list[str]:
    """Say where the silicone was not fitted."""
    low, high = material.fitted_stretch
    if low - _ROUNDING <= stretch <= high:
        return []
    return [f"stretch {stretch:.3f} is outside {low:g} to {high:g}, where {material.name} was fitted"]


def chamber_warnings(robot: Robot, material: Material, stretch: float) -> list[str]:
    """Say where the silicone was not fitted, and where neighbouring chambers touch."""
    found = fitted_warnings(material, stretch)
    limit = touching_stretch(robot)
    if stretch > limit:
        found.append(f"stretch {stretch:.3f} is above {limit:.3f}, where neighbouring reinforced chambers touch")
    return found


@dataclass(frozen=True, eq=False)
class RoundChambers(Section):
    """The paper's section as a `softnlp.model.section.Section`.

    Attributes
    ----------
    robot, material
        Of the segment.
    coefficients, conventions
        As `softnlp.forward`.
    """

    robot: Robot
    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION

    @property
    def kind(self) -> Hashable:
        """The number of sets and of chambers in each, the law, the conventions."""
        robot, law = self.robot, self.material.law
        chambers = (robot.chamber_sets, robot.chambers_per_set)
        return chambers, (law.name, law.constants, law.formula, law.modulus), self.conventions

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """As `Robot.set_of_chamber`."""
        return self.robot.set_of_chamber

    @property
    def by_sum(self) -> bool:
        """Whether no coefficient is negative: every chamber has the same bore."""
        return bool(min(self.coefficients.elongation, self.coefficients.bending) >= 0)

    def check(self, numbers: Mapping[str, Any] | None = None) -> None:
        """Raise `RobotError` where the robot, or one of these numbers, cannot be made."""
        check(self.robot if numbers is None else self._robot(numbers), allow=LOWERABLE_RULES)

    def _robot(self, numbers: Mapping[str, Any]) -> Robot:
        return replace(self.robot, **{name: numbers[f"robot.{name}"] for name in SIZES})

    def quantities(self) -> list[Quantity]:
        """Return the numbers of robot, material and coefficients.

        "robot.<dimension>" (m or rad), "material.<constant>", "material.density", "stiffening.elongation",
        "stiffening.bending", "corrections.area", "corrections.inertia", "corrections.bore_fraction".
        """
        declared = of_model(self.robot, self.material)
        for field, name in _COEFFICIENT_NAMES.items():
            declared.append(quantity(name, "1", float(getattr(self.coefficients, field)), lower=0.0))
        return declared

    def at(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> RoundState:
        """Return `deform` of these numbers."""
        robot, material, coefficients = with_numbers(self.robot, self.material, self.coefficients, numbers)
        return deform(robot, material, pressures, stretch, coefficients, self.conventions)

    def outline(self, numbers: Mapping[str, Any], stretch: Any) -> SectionRadii:
        """Return `radii` of these numbers."""
        return radii(self._robot(numbers), stretch)

    def warnings(self, stretch: float) -> list[str]:
        """Say where the silicone was not fitted, and where neighbouring chambers touch."""
        return chamber_warnings(self.robot, self.material, stretch)
