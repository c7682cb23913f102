"""The energy section: strains from one potential of the whole section, with no coefficient but a factor on the stress.

`softnlp.model.potential` holds the potential. The rod runs along the stretched length of the section without loads,
whose stretch v_3 is found together with its curvature. Numbers or CasADi symbols, SI.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.energies import energy_of, fibre_energy, shear_modulus
from softnlp.model.materials import Material
from softnlp.model.potential import MOST_PASSES, NOTHING, PASSES, Answer, Potential, Pull, Strains, rounded
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.round_chambers import FACTOR, SIZES, chamber_warnings, of_model, radii
from softnlp.model.section import RodSection, Section, SectionRadii, SectionState
from softnlp.model.stretch_curve import (
    BODY,
    BODY_SIZE,
    LINER_SIZE,
    STRETCHES,
    coefficients,
    derived,
    evaluated,
    liner_scale,
    resting,
)

SQUARE, CIRCLE = "rings.square", "rings.circle"
"""Keys of what rings do: lambda T / 2, which is 1 without them, and a(lambda), at `STRETCHES`."""
_CALLED: dict[str, Any] = {"never_inline": True, "is_diff_in": [False], "cse": True}
_THROUGH = [((1 + x) / 2, w / 2) for x, w in zip(*np.polynomial.legendre.leggauss(10), strict=True)]  # of a liner


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

    def potential(self, numbers: Mapping[str, Any], pressures: Any) -> Potential:
        """Return the potential of these numbers, by the keys of `quantities`, at pressures (sets,) [Pa]."""
        robot = self._robot(numbers)
        material, c_m = self._material(numbers), numbers[FACTOR]
        r_co, r_ci = robot.chamber_radius, robot.bore_radius
        r_r, r_i = robot.outer_radius, robot.lumen_radius
        fibre, plane = fibre_energy(material), energy_of(material).density
        body, liner, slip = [], [], []
        A_0 = _area(robot)
        J_0 = _polar_moment(robot)
        rest = shear_modulus(material, 1.0)
        for k, stretch in enumerate(STRETCHES):
            body.append(c_m * fibre(2 / stretch * numbers[SQUARE][k], stretch))
            slip.append(rest / shear_modulus(material, stretch))
        pole = 1 - r_ci**2 / r_co**2
        scale = liner_scale(pole)
        for stretch in scale.stretches():
            through = 0.0
            for part, weight in _THROUGH:
                R2 = r_ci**2 + part * (r_co**2 - r_ci**2)
                hoop2 = (r_co**2 - (r_co**2 - R2) / stretch) / R2
                through += weight * plane(hoop2 + 1 / (stretch**2 * hoop2), stretch)
            liner.append(c_m * ca.pi * (r_co**2 - r_ci**2) * through)
        return Potential(
            body=resting(derived(coefficients(body)), BODY),
            liner=resting(derived(coefficients(liner)), scale),
            arms=coefficients([numbers[CIRCLE][k] for k in range(BODY_SIZE)]),
            slip=coefficients(slip),
            GA=c_m * rest * A_0,
            gyration=ca.sqrt(J_0 / A_0),
            outer=r_r,
            lumen=r_i,
            chamber=r_co,
            pole=pole,
            centres=tuple(robot.chamber_centres()),
            push=tuple(pressures[i] * ca.pi * r_co**2 for i in robot.set_of_chamber),
        )

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
        potential, robot = self.potential(numbers, pressures), self._robot(numbers)
        at = Strains(stretch, 0.0, 0.0)
        tangent = potential.tangent(at, NOTHING)
        if not _is_zero(pressures):
            r = potential.outer
            x, y = ca.vertsplit(_bent(robot.chambers)(ca.vertcat(*(n for n, _ in _curves(potential)), stretch)))
            at, tangent = potential.bent(Strains(stretch, x / r, y / r))
        H = tangent.H
        c_m, A_0 = numbers[FACTOR], _area(robot)
        EI_x, EI_y = H[5] * stretch, H[3] * stretch
        u_1, u_2 = at.b_2 / stretch, -at.b_1 / stretch
        s, t = potential.compliance(stretch)
        a = evaluated(potential.arms, BODY.place(stretch)).value
        material = self._material(numbers)
        answer = potential.answering(at)
        own = [
            *_curves(potential),
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
            chamber_stiffness=c_m * material.tangent_modulus(stretch) * ca.pi * robot.chamber_radius**2,
            own=own,
        )

    def bending_at_rest(self, numbers: Mapping[str, Any]) -> Any:
        """Return that of body and liners in uniaxial stress."""
        robot = self._robot(numbers)
        return numbers[FACTOR] * self._material(numbers).tangent_modulus(1.0) * _polar_moment(robot) / 2

    def _material(self, numbers: Mapping[str, Any]) -> Material:
        constants = {c.name: numbers[f"material.{c.name}"] for c in self.material.law.constants}
        return replace(self.material, constants=constants)

    def strains(self, section: RodSection, own: Sequence[Any], force: Any, moment: Any) -> tuple[Any, Any]:
        """Return the strains whose gradients of U are the force and the moment, per length without loads."""
        potential, pull, at, inverse, change = self._near(own, force, moment, PASSES)
        found = potential.followed(at, inverse, change, potential.gradient(at, pull))
        return _as_strains(potential, found, force, moment)

    def quick_strains(self, section: RodSection, own: Sequence[Any], force: Any, moment: Any) -> tuple[Any, Any]:
        """Return the same with a derivative by the force and the moment alone."""
        potential, pull, at, inverse, change = self._near(own, force, moment, MOST_PASSES)
        units = (potential.GA, potential.GA * potential.outer, potential.GA * potential.outer)
        moves = zip((pull.n, pull.h_1, pull.h_2), units, strict=True)
        off = tuple(unit * rounded(f / unit) - f for f, unit in moves)
        found = potential.followed(at, inverse, change, off)
        return _as_strains(potential, found, force, moment)

    def _near(
        self, own: Sequence[Any], force: Any, moment: Any, passes: int
    ) -> tuple[Potential, Pull, Strains, Any, Any]:
        """Return the potential, the pull, and strains under it as numbers, with H^-1 (6,) and their last change."""
        potential = _known(own, self.robot.chambers)
        pull = Pull(force[2], -moment[1], moment[0], force[0] ** 2 + force[1] ** 2, moment[2] ** 2)
        called = _near(self.robot.chambers, passes)(ca.vertcat(*own, *pull))
        found = [rounded(called[k]) for k in range(_FOUND)]
        r, GA = potential.outer, potential.GA
        inverse = tuple(found[k] / (GA * unit) for k, unit in enumerate((1, r, r, r**2, r**2, r**2)))
        return potential, pull, Strains(found[6], found[7] / r, found[8] / r), inverse, found[9]

    def lengthening(self, own: Sequence[Any], centres: Sequence[tuple[Any, Any]], v: Any, u: Any) -> list[Any]:
        """Return lambda_i over v_3 without loads: the pressures' work goes with the part along e3."""
        potential = _known(own, self.robot.chambers)
        unit = potential.start[0]
        a = evaluated(potential.arms, BODY.place(v[2] * unit)).value
        return [v[2] + a * (u[0] * y - u[1] * x) for x, y in potential.centres]

    def outline(self, numbers: Mapping[str, Any], stretch: Any) -> SectionRadii:
        """Return `softnlp.model.round_chambers.radii` of these numbers."""
        return radii(self._robot(numbers), stretch)

    def warnings_along(self, stretch: float, v: Any, u: Any) -> list[str]:
        """Say where fibres of the body are beyond the stretches at which their law is taken."""
        middle = np.asarray(v)[:, 2] * stretch
        bend = np.hypot(np.asarray(u)[:, 0], np.asarray(u)[:, 1]) * stretch * self.robot.outer_radius * middle**-0.5
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


_FOUND = 10
"""Numbers of what `_refine` takes and returns."""


def _as_strains(potential: Potential, at: Strains, force: Any, moment: Any) -> tuple[Any, Any]:
    """Return v and u per length without loads."""
    s, t = potential.compliance(at.v)
    unit = potential.start[0]
    v = ca.vertcat(force[0] * s, force[1] * s, at.v)
    return v / unit, ca.vertcat(at.b_2, -at.b_1, moment[2] * t) / unit


def _sizes(chambers: int) -> tuple[int, ...]:
    """Return how many numbers the parts of `SectionState.own` have."""
    n, N = BODY_SIZE, chambers
    return (n - 1, LINER_SIZE - 1, n, n, 1, 1, 1, 1, 1, 1, 2 * N, N, 3, 6, 10)


def _known(own: Sequence[Any], chambers: int) -> Potential:
    """Return the potential that `EnergySection.at` put into the constants of the rod."""
    parts, start = [], 0
    for size in _sizes(chambers):
        parts.append(own[start : start + size])
        start += size
    body, liner, arms, slip = (ca.vertcat(*part) for part in parts[:4])
    GA, gyration, outer, lumen, chamber, pole = (part[0] for part in parts[4:10])
    flat, push, unbent, compliance, third = parts[10:]
    return Potential(
        body, liner, arms, slip, GA, gyration, outer, lumen, chamber, pole,
        centres=tuple(zip(flat[::2], flat[1::2], strict=True)),
        push=tuple(push),
        start=(unbent[0], unbent[1], unbent[2]),
        answer=Answer(tuple(c / GA for c in compliance), tuple(third)),
    )  # fmt: skip


def _curves(potential: Potential) -> list[tuple[Any, str]]:
    """Return what does not depend on the stretch, as numbers with the names of their units."""
    return [
        *((potential.body[k], "Pa") for k in range(BODY_SIZE - 1)),
        *((potential.liner[k], "N") for k in range(LINER_SIZE - 1)),
        *((potential.arms[k], "1") for k in range(BODY_SIZE)),
        *((potential.slip[k], "1") for k in range(BODY_SIZE)),
        (potential.GA, "N"),
        (potential.gyration, "m"),
        (potential.outer, "m"),
        (potential.lumen, "m"),
        (potential.chamber, "m"),
        (potential.pole, "1"),
        *((x, "m") for centre in potential.centres for x in centre),
        *((push, "N") for push in potential.push),
    ]


@lru_cache(maxsize=8)
def _bent(chambers: int) -> ca.Function:
    """Return [curves, stretch] -> bending near to that without moments [1]."""
    size = sum(_sizes(chambers)[:-3])
    given = ca.SX.sym("given", size + 1)
    potential = _known([*(given[k] for k in range(size)), *[0.0] * sum(_sizes(chambers)[-3:])], chambers)
    at = potential.unbent(given[size])
    found = ca.vertcat(at.b_1 * potential.outer, at.b_2 * potential.outer)
    return ca.Function("bent", [given], [found], _CALLED)


@lru_cache(maxsize=8)
def _refine(chambers: int) -> ca.Function:
    """Return [own numbers, pull, found] -> found, which is [GA H^-1 in (v, r b), strains (v, r b), last change]."""
    sizes = (sum(_sizes(chambers)), len(Pull._fields), _FOUND)
    given = [ca.SX.sym(name, size) for name, size in zip(("own", "pull", "at"), sizes, strict=True)]
    own, pull, at = ([part[k] for k in range(part.numel())] for part in given)
    potential = _known(own, chambers)
    r = potential.outer
    found, inverse, change = potential.refined(Strains(at[6], at[7] / r, at[8] / r), Pull(*pull))
    scaled = [c * potential.GA * unit for c, unit in zip(inverse, (1, r, r, r**2, r**2, r**2), strict=True)]
    rows = ca.vertcat(*scaled, found.v, found.b_1 * r, found.b_2 * r, change)
    return ca.Function("refine", [ca.vertcat(*given)], [rows], _CALLED)


@lru_cache(maxsize=8)
def _near(chambers: int, passes: int) -> ca.Function:
    """Return [own numbers, pull] -> found, see `_refine`; called where it is used, as it is long."""
    own = ca.SX.sym("own", sum(_sizes(chambers)))
    pull = ca.SX.sym("pull", len(Pull._fields))
    potential = _known([own[k] for k in range(own.numel())], chambers)
    at = potential.started(Pull(*(pull[k] for k in range(pull.numel()))))
    r = potential.outer
    found = ca.vertcat(ca.SX.zeros(6), at.v, at.b_1 * r, at.b_2 * r, 1.0)
    for _ in range(passes):
        found = _refine(chambers)(ca.vertcat(own, pull, found))
    return ca.Function(f"near_{passes}", [ca.vertcat(own, pull)], [found], _CALLED)


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
