"""The energy section of chambers and bodies of any outline: the same potential, its sums over points of the section.

A chamber's volume is what its thread encloses times its length, less its liner, so that its pressure works on the area
that the thread encloses, at the centroid of that. Thread around the body encloses bores and silicone together: what of
it each chamber's pressure works on is found with the plane section, see `softnlp.rings.outlined`.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import nan, pi, sqrt
from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.cubature import LINER_DEGREE, Points, moment_rule, points_over
from softnlp.model.energy_section import CIRCLE, SQUARE, EnergySection, Geometry
from softnlp.model.materials import Material
from softnlp.model.outlined import Annulus, OutlinedRobot
from softnlp.model.plane import Circle, Outline
from softnlp.model.quadrature import Layout
from softnlp.model.robot import LOWERABLE_RULES, check
from softnlp.model.round_chambers import FACTOR, fitted_warnings, of_silicone
from softnlp.model.round_layout import turned_round
from softnlp.model.section import SectionRadii


@dataclass(frozen=True, eq=False)
class OutlinedSection(EnergySection):
    """Chambers and a body of any outline, as a `softnlp.model.section.Section`.

    Attributes
    ----------
    robot
        Whose sizes are numbers; only its length is a quantity.
    material, coefficients, conventions
        As of `EnergySection`.
    """

    robot: OutlinedRobot
    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions | None = None

    def __post_init__(self) -> None:
        if self.conventions is None or not self.conventions.energy:
            raise InputError('chambers given by [[chamber]] need conventions = "energy"', key="conventions")

    @property
    def kind(self) -> Hashable:
        """The shape, and the law."""
        law = self.material.law
        return self.robot.shape, (law.name, law.constants, law.formula, law.modulus)

    def check(self, numbers: Mapping[str, Any] | None = None) -> None:
        """Raise `RobotError` where the robot cannot be made."""
        check(self.robot, allow=LOWERABLE_RULES)

    def quantities(self) -> list[Quantity]:
        """Return the length, the numbers of the material, "corrections.modulus_factor" and those of rings."""
        square, circle = self._rings
        length = float(self.robot.length)
        return [
            quantity("robot.length", "m", length, scale=length, lower=0.0),
            *of_silicone(self.material),
            quantity(FACTOR, "1", float(self.coefficients.modulus_factor), lower=0.0),
            quantity(SQUARE, "1", square),
            quantity(CIRCLE, "1", circle),
        ]

    @cached_property
    def _round(self) -> bool:
        """Whether its chambers are those of a round layout, turned or not: sums over discs do then."""
        return turned_round(self.robot) is not None

    @property
    def _wound(self) -> bool:
        return self.robot.reinforcement == "body"

    @cached_property
    def layout(self) -> Layout:
        """What of it is built into its equations."""
        robot, r_r = self.robot, float(self.robot.outer_radius)
        if self._round:
            return Layout((0,) * robot.chambers)
        points = [p for part in robot.silicone for p in points_over((part.outer,), part.holes)]
        body = _scaled(points, r_r, r_r**2)
        if self._wound:
            return Layout((-1,) * robot.chambers, body, (), held=True)
        kinds = list(self._kinds)
        spread = []
        for n in (self._of_kind(kind) for kind in kinds):
            bore, area = robot.chamber_list[n].bore(), robot.held[n]
            rings = [(area.outer, bore.outer), *([(bore.inner, area.inner)] if area.inner and bore.inner else [])]
            found = [] if isinstance(robot.chamber_list[n].form, Circle) else rings
            layers = [p for outer, inner in found for p in points_over((outer,), (inner,), LINER_DEGREE)]
            spread.append(_scaled(layers, r_r, sum(w for *_, w in layers)))
        return Layout(tuple(kinds.index(self._key(n)) for n in range(robot.chambers)), body, tuple(spread))

    def _key(self, n: int) -> Hashable:
        """Return what chambers of one kind of liner have in common."""
        chamber = self.robot.chamber_list[n]
        return (chamber.form.radius, chamber.wall) if isinstance(chamber.form, Circle) else n

    @property
    def _kinds(self) -> dict[Hashable, None]:
        return dict.fromkeys(self._key(n) for n in range(self.robot.chambers))

    def _of_kind(self, kind: Hashable) -> int:
        return next(n for n in range(self.robot.chambers) if self._key(n) == kind)

    @cached_property
    def _areas(self) -> tuple[float, float]:
        robot = self.robot
        parts: list[tuple[Outline, int]] = [(robot.surface, 1)]
        for chamber in robot.chamber_list:
            bore = chamber.bore()
            parts += [(bore.outer, -1), *([] if bore.inner is None else [(bore.inner, 1)])]
        parts += [] if robot.lumen is None else [(robot.lumen, -1)]
        moments = np.zeros(4)
        for outline, sign in parts:
            (x, y), weight = moment_rule(outline, 2)[0].T, sign * moment_rule(outline, 2)[1]
            moments += [weight.sum(), weight @ x, weight @ y, weight @ (x**2 + y**2)]
        A, S_x, S_y, J = moments
        return float(A), float(J - (S_x**2 + S_y**2) / A)

    def areas(self, numbers: Mapping[str, Any]) -> tuple[Any, Any]:
        """Return A_0 [m^2] and J_0 about the centroid [m^4] of body and liners."""
        return self._areas

    @cached_property
    def _geometry(self) -> Geometry:
        robot = self.robot
        enclosed = tuple(area.area for area in robot.held)
        sizes = {"outer": float(robot.outer_radius), "lumen": float(robot.lumen_radius)}
        sizes["chamber"] = sqrt(enclosed[0] / pi)
        if self._wound:
            if self.conventions is None or self.conventions.pressed is None:
                raise InputError("thread around the body needs the energy section with rings", key="reinforcement")
            pressed, centres = self.conventions.pressed(robot)
            at = tuple((float(x), float(y)) for x, y in centres)
            return Geometry(**sizes, liners=(), poles=(), centres=at, pressed=tuple(float(A) for A in pressed))
        liners, poles = [], []
        for n in map(self._of_kind, self._kinds):
            chamber = robot.chamber_list[n]
            form, wall, bore = chamber.form, chamber.wall, chamber.bore().area
            r_co, r_ci = sqrt(enclosed[n] / pi), sqrt(bore / pi)
            layers = [(r_co, r_ci, r_co)]
            if isinstance(form, Annulus):
                out, within = form.outer + wall, form.inner - wall
                layers = [(out, form.outer, out), (within, within, form.inner)]
            liners.append(tuple(layers))
            poles.append(1 - bore / enclosed[n])
        centres = tuple((float(x), float(y)) for x, y in robot.chamber_centres())
        return Geometry(**sizes, liners=tuple(liners), poles=tuple(poles), centres=centres, pressed=enclosed)

    def geometry(self, numbers: Mapping[str, Any]) -> Geometry:
        """Return the sizes that its potential takes."""
        return self._geometry

    def outline(self, numbers: Mapping[str, Any], stretch: Any) -> SectionRadii:
        """Return the radius that the body fits in, and the lumen's; the others are not a number."""
        shrink = stretch**0 if self._wound else stretch**-0.5
        none = shrink * nan
        return SectionRadii(self.robot.outer_radius * shrink, self.robot.lumen_radius * shrink, none, none, none)

    def warnings(self, stretch: float) -> list[str]:
        """Say where the silicone was not fitted."""
        return fitted_warnings(self.material, stretch)


def _scaled(points: Sequence[tuple[float, float, float]], length: float, weight: float) -> Points:
    """Return points in a unit of length and one of weight."""
    return tuple((x / length, y / length, w / weight) for x, y, w in points)
