"""The paper's section with bonded lines: straight chambers of later segments that pass through it under pressure.

A line is a chamber like the section's own: it takes silicone away, its pressure acts on its bore, its thread keeps its
radius. So all that `softnlp.model.round_chambers` sums over chambers is summed over both kinds.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot
from typing import Any

import casadi as ca

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.robot import Robot
from softnlp.model.round_chambers import RoundChambers, RoundState, with_numbers
from softnlp.model.rules import ROUND_OFF, in_mm
from softnlp.model.section import Section, SectionRadii

_SIZES = ("chamber_circle_diameter", "chamber_diameter", "chamber_wall", "chamber_angle")
PREFIX = "lines."
"""Before the numbers of lines: "lines.2.chamber_diameter" is that of segment 2."""


@dataclass(frozen=True, eq=False)
class Lines:
    """The lines of one later segment. number : of it, from 1. turn : of its body axes against these, about e3 [rad]."""

    number: int
    robot: Robot
    turn: float

    @property
    def keys(self) -> dict[str, str]:
        """What says of the robot where its chambers are, and under which key."""
        return {name: f"{PREFIX}{self.number}.{name}" for name in _SIZES}


@dataclass(frozen=True, eq=False)
class _Bore:
    """A chamber at a stretch: its centre, radii and area under pressure P. inertia : of what P acts on."""

    P: Any
    d: tuple[Any, Any]
    r_0: Any
    r_ci: Any
    r_co: Any
    A_c: Any
    inertia: tuple[Any, Any]


@dataclass(frozen=True, eq=False)
class LinedChambers(Section):
    """Round chambers and lines as a `softnlp.model.section.Section`.

    Attributes
    ----------
    robot, material, coefficients, conventions
        As `RoundChambers`.
    lines
        Of each later segment, in order.
    """

    robot: Robot
    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION
    lines: Sequence[Lines] = ()

    @property
    def own(self) -> RoundChambers:
        """The section without lines."""
        return RoundChambers(self.robot, self.material, self.coefficients, self.conventions)

    @property
    def kind(self) -> Hashable:
        """That of its own, and the layout of the lines."""
        lines = ((line.robot.chamber_sets, line.robot.chambers_per_set, line.turn) for line in self.lines)
        return self.own.kind, tuple(lines)

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """Its own chambers first, then the lines, whose sets are counted on."""
        found, sets = list(self.robot.set_of_chamber), self.robot.chamber_sets
        for line in self.lines:
            found += [sets + one for one in line.robot.set_of_chamber]
            sets += line.robot.chamber_sets
        return tuple(found)

    def check(self, numbers: Mapping[str, Any] | None = None) -> None:
        """Raise as `RoundChambers.check`."""
        self.own.check(numbers)

    def quantities(self) -> list[Quantity]:
        """Return those of `RoundChambers`, and the sizes of the lines."""
        lines = [
            quantity(key, "rad" if name == "chamber_angle" else "m", float(getattr(line.robot, name)), lower=0.0)
            for line in self.lines
            for name, key in line.keys.items()
        ]
        return [*self.own.quantities(), *lines]

    def at(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> RoundState:
        """Return `softnlp.model.round_chambers.deform` with the sums over chambers and lines."""
        pi, conventions = ca.pi, self.conventions
        robot, material, coefficients = with_numbers(self.robot, self.material, self.coefficients, numbers)
        k_e, k_b, k_i = coefficients.elongation, coefficients.bending, coefficients.inertia
        own_sets, t_f = robot.chamber_sets, conventions.fibre_thickness
        bare = self.own.at(numbers, [pressures[j] for j in range(own_sets)], stretch)
        lines = self._bores(numbers, pressures, stretch)
        chambers = [
            self._bore(pressures[j], centre, robot, stretch, coefficients.bore_fraction)
            for j, centre in zip(robot.set_of_chamber, robot.chamber_centres(), strict=True)
        ]
        every, N = [*chambers, *lines], len(chambers) + len(lines)

        def fibre(b: _Bore, k: int) -> Any:
            r_f = b.r_co + t_f
            return pi * (r_f**3 * t_f + 2 * r_f * t_f * b.d[k] ** 2)

        bores = sum(b.r_0**2 + (b.r_co + t_f) ** 2 - b.r_co**2 for b in lines)
        A_0 = bare.reference_area - coefficients.area * pi * bores
        F_P = bare.pressure_force + sum(b.P * b.A_c for b in lines)
        sigma, E_t = bare.engineering_stress, bare.tangent_modulus
        sign = 1 if conventions.stiffening_opposes_pressure else -1
        mean = sum(b.P for b in every) / N
        own_mean = sum(b.P for b in chambers) / len(chambers)
        bending = []
        for k, bare_EI in zip((1, 0), bare.bending_stiffness, strict=True):
            silicone = k_i * sum(pi * (b.r_ci**4 / 4 + b.r_ci**2 * b.d[k] ** 2) + fibre(b, k) for b in lines)
            weighed = [(mean if conventions.mean_pressure else b.P) * b.inertia[1 - k] for b in every]
            before = [(own_mean if conventions.mean_pressure else b.P) * b.inertia[1 - k] for b in chambers]
            bending.append(bare_EI - E_t * silicone + k_b * (sum(weighed) - sum(before)))
        J_z = sum(
            pi * (b.r_ci**4 / 2 + b.r_ci**2 * (b.d[0] ** 2 + b.d[1] ** 2)) + fibre(b, 0) + fibre(b, 1) for b in lines
        )
        G = material.shear_modulus(stretch)
        M_x, M_y = bare.pressure_moment
        return replace(
            bare,
            imbalance=A_0 * sigma - F_P + sign * k_e * F_P * (stretch - 1),
            line_density=material.density * A_0 / stretch,
            area=A_0 / stretch,
            reference_area=A_0,
            pressure_force=F_P,
            pressure_moment=(
                M_x + sum(b.P * b.A_c * b.d[1] for b in lines),
                M_y - sum(b.P * b.A_c * b.d[0] for b in lines),
            ),
            axial_stiffness=E_t * A_0 / stretch + k_e * F_P,
            shear_stiffness=G * A_0 / stretch,
            bending_stiffness=(bending[0], bending[1]),
            torsional_stiffness=bare.torsional_stiffness - G * J_z,
            centres=tuple(b.d for b in every),
        )

    def _bores(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> list[_Bore]:
        """Return the lines at a stretch."""
        found, sets = [], self.robot.chamber_sets
        for line in self.lines:
            robot = replace(line.robot, **{name: numbers[key] for name, key in line.keys.items()})
            c, s = ca.cos(line.turn), ca.sin(line.turn)
            phi = numbers["corrections.bore_fraction"]
            for j, (x, y) in zip(robot.set_of_chamber, robot.chamber_centres(), strict=True):
                turned = (c * x - s * y, s * x + c * y)
                found.append(self._bore(pressures[sets + j], turned, robot, stretch, phi))
            sets += robot.chamber_sets
        return found

    @staticmethod
    def _bore(P: Any, centre: tuple[Any, Any], robot: Robot, stretch: Any, phi: Any) -> _Bore:
        """Return a chamber of a robot at a stretch, Eq. (22) and (S2)."""
        r_0, r_co = robot.bore_radius, robot.chamber_radius
        r_ci = ca.sqrt(r_co**2 - (r_co**2 - r_0**2) / stretch)
        r_p, shrink = r_ci + phi * (r_co - r_ci), 1 / ca.sqrt(stretch)
        d_x, d_y = (x * shrink for x in centre)
        inertia = tuple(ca.pi * (r_p**4 / 4 + r_p**2 * d**2) for d in (d_y, d_x))
        return _Bore(P, (d_x, d_y), r_0, r_ci, r_co, ca.pi * r_p**2, (inertia[0], inertia[1]))

    def outline(self, numbers: Mapping[str, Any], stretch: Any) -> SectionRadii:
        """Return that of its own."""
        return self.own.outline(numbers, stretch)

    def warnings(self, stretch: float) -> list[str]:
        """Return those of its own."""
        return self.own.warnings(stretch)

    @property
    def notes(self) -> list[str]:
        """Where the lines cannot be: in another chamber, the lumen or outside the body."""
        own = [(float(x), float(y), self.robot.chamber_radius, "a chamber") for x, y in self.robot.chamber_centres()]
        found = []
        for line in self.lines:
            c, s = float(ca.cos(line.turn)), float(ca.sin(line.turn))
            what, r = f"the lines of segment {line.number}", line.robot.chamber_radius
            places = [
                (c * float(x) - s * float(y), s * float(x) + c * float(y)) for x, y in line.robot.chamber_centres()
            ]
            for x, y in places:
                hit = [name for X, Y, R, name in own if hypot(x - X, y - Y) < r + R - ROUND_OFF]
                if hypot(x, y) + r > self.robot.outer_radius + ROUND_OFF:
                    hit.append(f"the outside, {in_mm(self.robot.outer_diameter)} wide")
                if hypot(x, y) - r < self.robot.lumen_radius - ROUND_OFF:
                    hit.append("the lumen")
                if hit:
                    found.append(f"{what} overlap {hit[0]}; turn_deg of a segment turns it against the one before")
                    break
            own += [(x, y, r, what) for x, y in places]
        return found
