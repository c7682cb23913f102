"""The energy section: strains from one potential of the whole section, with no coefficient but a factor on the stress.

`softnlp.model.potential` holds the potential. The rod runs along the stretched length of the section without loads,
whose stretch v_3 is found together with its curvature. Numbers or CasADi symbols, SI.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.energies import energy_of, fibre_energy, shear_modulus
from softnlp.model.energy_numbers import FOUND, as_strains, bent, curves, known, near_strains
from softnlp.model.materials import Material
from softnlp.model.potential import MOST_PASSES, NOTHING, PASSES, Potential, Pull, Strains, rounded
from softnlp.model.quadrature import Layout
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.round_chambers import FACTOR, SIZES, chamber_warnings, of_model, radii
from softnlp.model.section import RodSection, Section, SectionRadii, SectionState
from softnlp.model.stretch_curve import (
    BODY,
    BODY_SIZE,
    STRETCHES,
    coefficients,
    derived,
    evaluated,
    liner_scale,
    resting,
)

SQUARE, CIRCLE = "rings.square", "rings.circle"
"""Keys of what rings do: lambda T / 2, which is 1 without them, and a(lambda), at `STRETCHES`."""
_THROUGH = [((1 + x) / 2, w / 2) for x, w in zip(*np.polynomial.legendre.leggauss(10), strict=True)]  # of a liner


@dataclass(frozen=True, eq=False)
class Geometry:
    """The sizes of a section that its potential takes, N chambers with K kinds of liners; see `Potential`.

    liners : (K,) annuli of each, as of `EnergySection._liner`. pressed : (N,) what a chamber's volume grows by [m^2].
    """

    outer: Any
    lumen: Any
    chamber: Any
    liners: tuple[tuple[tuple[Any, Any, Any], ...], ...]
    poles: tuple[Any, ...]
    centres: tuple[tuple[Any, Any], ...]
    pressed: tuple[Any, ...]


@dataclass(frozen=True, eq=False)
class EnergySection(Section):
    """Round chambers whose forces are the gradients of one potential, as a `softnlp.model.section.Section`.

    Attributes
    ----------
    robot, material, coefficients
        As of `softnlp.model.round_chambers.RoundChambers`; of the coefficients `modulus_factor` alone counts.
    conventions
        Whose `rings` say what the rings of thread do; without it the body is in uniaxial stress.
    """

    robot: Robot
    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions | None = None

    @property
    def kind(self) -> Hashable:
        """The number of sets and of chambers in each, and the law."""
        robot, law = self.robot, self.material.law
        chambers = (robot.chamber_sets, robot.chambers_per_set)
        return chambers, (law.name, law.constants, law.formula, law.modulus)

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """As `Robot.set_of_chamber`."""
        return self.robot.set_of_chamber

    @property
    def coupled(self) -> bool:
        """Yes: a chamber on one side stretches and bends."""
        return True

    @property
    def splits_pressure(self) -> bool:
        """No: n and m are the gradients of the potential, which has the pressure in it."""
        return False

    def check(self, numbers: Mapping[str, Any] | None = None) -> None:
        """Raise `RobotError` where the robot, or one of these numbers, cannot be made."""
        check(self.robot if numbers is None else self._robot(numbers), allow=LOWERABLE_RULES)

    def _robot(self, numbers: Mapping[str, Any]) -> Robot:
        return replace(self.robot, **{name: numbers[f"robot.{name}"] for name in SIZES})

    @cached_property
    def _rings(self) -> tuple[Any, Any]:
        """The values at `SQUARE` and `CIRCLE`."""
        rings = None if self.conventions is None else self.conventions.rings
        if rings is None:
            return np.ones(BODY_SIZE), np.array(STRETCHES) ** -0.5
        square, circle = rings(self.robot, STRETCHES)
        return np.asarray(square, float), np.asarray(circle, float)

    def quantities(self) -> list[Quantity]:
        """Return the numbers of robot and material, "corrections.modulus_factor" and those of rings."""
        square, circle = self._rings
        factor = float(self.coefficients.modulus_factor)
        return [
            *of_model(self.robot, self.material),
            quantity(FACTOR, "1", factor, lower=0.0),
            quantity(SQUARE, "1", square),
            quantity(CIRCLE, "1", circle),
        ]

    @property
    def layout(self) -> Layout:
        """What of it is built into its equations."""
        return Layout((0,) * self.robot.chambers)

    def areas(self, numbers: Mapping[str, Any]) -> tuple[Any, Any]:
        """Return A_0 [m^2] and J_0 [m^4] of body and liners."""
        return _area(self._robot(numbers)), _polar_moment(self._robot(numbers))

    def geometry(self, numbers: Mapping[str, Any]) -> Geometry:
        """Return the sizes that its potential takes."""
        robot = self._robot(numbers)
        r_co, r_ci = robot.chamber_radius, robot.bore_radius
        return Geometry(
            outer=robot.outer_radius,
            lumen=robot.lumen_radius,
            chamber=r_co,
            liners=(((r_co, r_ci, r_co),),),
            poles=(1 - r_ci**2 / r_co**2,),
            centres=tuple(robot.chamber_centres()),
            pressed=(ca.pi * r_co**2,) * robot.chambers,
        )

    def potential(self, numbers: Mapping[str, Any], pressures: Any) -> Potential:
        """Return the potential of these numbers, by the keys of `quantities`, at pressures (sets,) [Pa]."""
        material, c_m, sizes = self._material(numbers), numbers[FACTOR], self.geometry(numbers)
        fibre = fibre_energy(material)
        body, slip = [], []
        A_0, J_0 = self.areas(numbers)
        rest = shear_modulus(material, 1.0)
        for k, stretch in enumerate(STRETCHES):
            body.append(c_m * fibre(2 / stretch * numbers[SQUARE][k], stretch))
            slip.append(rest / shear_modulus(material, stretch))
        return Potential(
            body=resting(derived(coefficients(body)), BODY),
            liners=tuple(self._liner(c_m, material, *of) for of in zip(sizes.liners, sizes.poles, strict=True)),
            arms=coefficients([numbers[CIRCLE][k] for k in range(BODY_SIZE)]),
            slip=coefficients(slip),
            GA=c_m * rest * A_0,
            gyration=ca.sqrt(J_0 / A_0),
            outer=sizes.outer,
            lumen=sizes.lumen,
            chamber=sizes.chamber,
            poles=sizes.poles,
            centres=sizes.centres,
            push=tuple(pressures[i] * A for i, A in zip(self.set_of_chamber, sizes.pressed, strict=True)),
            layout=self.layout,
        )

    def _liner(self, c_m: Any, material: Material, layers: Sequence[tuple[Any, Any, Any]], pole: Any) -> Any:
        """Return the curve of a liner's energy. layers : (radius that is held, from, to) of each of its annuli [m]."""
        plane, values = energy_of(material).density, []
        scale = liner_scale(pole)
        for stretch in scale.stretches():
            energy = 0.0
            for held, first, last in layers:
                through = 0.0
                for part, weight in _THROUGH:
                    R2 = first**2 + part * (last**2 - first**2)
                    hoop2 = (held**2 - (held**2 - R2) / stretch) / R2
                    through += weight * plane(hoop2 + 1 / (stretch**2 * hoop2), stretch)
                energy += c_m * ca.pi * (last**2 - first**2) * through
            values.append(energy)
        return resting(derived(coefficients(values)), scale)

    def unloaded(self, numbers: Mapping[str, Any], pressures: Any, strains: Any) -> tuple[Sequence[Any], Sequence[Any]]:
        """Return the gradient (3,) of U at v_3 and r_r b (3,) [N], and its second derivatives (6,), without a load."""
        potential = self.potential(numbers, pressures)
        r = potential.outer
        at = Strains(strains[0], strains[1] / r, strains[2] / r)
        g, H = potential.tangent(at, NOTHING)
        scaled = (H[0], H[1] / r, H[2] / r, H[3] / r**2, H[4] / r**2, H[5] / r**2)
        return (g[0], g[1] / r, g[2] / r), scaled

    def at(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> SectionState:
        """Return the section at v_3 = stretch, bent as far as the pressures bend it there."""
        potential = self.potential(numbers, pressures)
        at = Strains(stretch, 0.0, 0.0)
        tangent = potential.tangent(at, NOTHING)
        if not _is_zero(pressures):
            r = potential.outer
            x, y = ca.vertsplit(bent(self.layout)(ca.vertcat(*(n for n, _ in curves(potential)), stretch)))
            at, tangent = potential.bent(Strains(stretch, x / r, y / r))
        H = tangent.H
        c_m, A_0 = numbers[FACTOR], self.areas(numbers)[0]
        EI_x, EI_y = H[5] * stretch, H[3] * stretch
        u_1, u_2 = at.b_2 / stretch, -at.b_1 / stretch
        s, t = potential.compliance(stretch)
        a = 1.0 if self.layout.held else evaluated(potential.arms, BODY.place(stretch)).value
        material = self._material(numbers)
        answer = potential.answering(at)
        own = [
            *curves(potential),
            (at.v, "1"),
            (at.b_1, "1/m"),
            (at.b_2, "1/m"),
            *((c * potential.GA, "1") for c in answer.compliance),
            *((t, "N") for t in answer.third),
        ]
        return SectionState(
            imbalance=tangent.g[0],
            line_density=numbers["material.density"] * A_0 / stretch,
            tangent_modulus=c_m * material.tangent_modulus(stretch),
            axial_stiffness=H[0] * stretch,
            shear_stiffness=stretch / s,
            bending_stiffness=(EI_x, EI_y),
            torsional_stiffness=stretch / t,
            pressure_force=0.0,
            pressure_moment=(EI_x * u_1, EI_y * u_2),
            centres=tuple((x * a, y * a) for x, y in potential.centres),
            chamber_stiffness=c_m * material.tangent_modulus(stretch) * ca.pi * potential.chamber**2,
            own=own,
        )

    def bending_at_rest(self, numbers: Mapping[str, Any]) -> Any:
        """Return that of body and liners in uniaxial stress."""
        return numbers[FACTOR] * self._material(numbers).tangent_modulus(1.0) * self.areas(numbers)[1] / 2

    def _material(self, numbers: Mapping[str, Any]) -> Material:
        constants = {c.name: numbers[f"material.{c.name}"] for c in self.material.law.constants}
        return replace(self.material, constants=constants)

    def strains(self, section: RodSection, own: Sequence[Any], force: Any, moment: Any) -> tuple[Any, Any]:
        """Return the strains whose gradients of U are the force and the moment, per length without loads."""
        potential, pull, at, inverse, change = self._near(own, force, moment, PASSES)
        found = potential.followed(at, inverse, change, potential.gradient(at, pull))
        return as_strains(potential, found, force, moment)

    def quick_strains(self, section: RodSection, own: Sequence[Any], force: Any, moment: Any) -> tuple[Any, Any]:
        """Return the same with a derivative by the force and the moment alone."""
        potential, pull, at, inverse, change = self._near(own, force, moment, MOST_PASSES)
        units = (potential.GA, potential.GA * potential.outer, potential.GA * potential.outer)
        moves = zip((pull.n, pull.h_1, pull.h_2), units, strict=True)
        off = tuple(unit * rounded(f / unit) - f for f, unit in moves)
        found = potential.followed(at, inverse, change, off)
        return as_strains(potential, found, force, moment)

    def _near(
        self, own: Sequence[Any], force: Any, moment: Any, passes: int
    ) -> tuple[Potential, Pull, Strains, Any, Any]:
        """Return the potential, the pull, and strains under it as numbers, with H^-1 (6,) and their last change."""
        potential = known(own, self.layout)
        pull = Pull(force[2], -moment[1], moment[0], force[0] ** 2 + force[1] ** 2, moment[2] ** 2)
        called = near_strains(self.layout, passes)(ca.vertcat(*own, *pull))
        found = [rounded(called[k]) for k in range(FOUND)]
        r, GA = potential.outer, potential.GA
        inverse = tuple(found[k] / (GA * unit) for k, unit in enumerate((1, r, r, r**2, r**2, r**2)))
        return potential, pull, Strains(found[6], found[7] / r, found[8] / r), inverse, found[9]

    def lengthening(self, own: Sequence[Any], centres: Sequence[tuple[Any, Any]], v: Any, u: Any) -> list[Any]:
        """Return lambda_i over v_3 without loads: the pressures' work goes with the part along e3."""
        potential = known(own, self.layout)
        unit = potential.start[0]
        a = 1.0 if potential.layout.held else evaluated(potential.arms, BODY.place(v[2] * unit)).value
        return [v[2] + a * (u[0] * y - u[1] * x) for x, y in potential.centres]

    def outline(self, numbers: Mapping[str, Any], stretch: Any) -> SectionRadii:
        """Return `softnlp.model.round_chambers.radii` of these numbers."""
        return radii(self._robot(numbers), stretch)

    def warnings_along(self, stretch: float, v: Any, u: Any) -> list[str]:
        """Say where fibres of the body are beyond the stretches at which their law is taken."""
        middle = np.asarray(v)[:, 2] * stretch
        bend = np.hypot(np.asarray(u)[:, 0], np.asarray(u)[:, 1]) * stretch * self.robot.outer_radius
        bend = bend if self.layout.held else bend * middle**-0.5
        low, high = float((middle - bend).min()), float((middle + bend).max())
        if BODY.low <= low and high <= BODY.high:
            return []
        return [
            f"fibres of the body are at stretches from {low:.3g} to {high:.3g}; outside {BODY.low:g} to {BODY.high:g} "
            "the law is taken to second order"
        ]

    def warnings(self, stretch: float) -> list[str]:
        """Say where the silicone was not fitted, and where neighbouring chambers touch."""
        return chamber_warnings(self.robot, self.material, stretch)


def _area(robot: Robot) -> Any:
    """Return A_0 of body and liners [m^2]."""
    return ca.pi * (robot.outer_radius**2 - robot.lumen_radius**2 - robot.chambers * robot.bore_radius**2)


def _polar_moment(robot: Robot) -> Any:
    """Return J_0 of body and liners [m^4]."""
    bore = robot.bore_radius**4 / 2 + robot.bore_radius**2 * robot.chamber_circle_radius**2
    return ca.pi * ((robot.outer_radius**4 - robot.lumen_radius**4) / 2 - robot.chambers * bore)


def _is_zero(pressures: Any) -> bool:
    """Whether pressures are numbers, and all zero."""
    every = [pressures[k] for k in range(len(pressures))] if isinstance(pressures, (list, tuple, np.ndarray)) else [1.0]
    return all(isinstance(P, (int, float)) and P == 0 for P in every)
