"""Dimensions of a manipulator, its chamber layout, what can be made, and the library of robots (model section 1)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, pi
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any

import casadi as ca

from softnlp.base.errors import RobotError, first_of, nearest
from softnlp.base.ranges import SIZE
from softnlp.base.reading import choices, did_you_mean, shown
from softnlp.base.rich import rich_html
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.model.rules import ALLOWABLE as ALLOWABLE
from softnlp.model.rules import LOWERABLE_RULES as LOWERABLE_RULES
from softnlp.model.rules import ROUND_OFF as ROUND_OFF
from softnlp.model.rules import RULES, broken, in_mm, neighbours, rules
from softnlp.model.rules import SELF_INTERSECTION as SELF_INTERSECTION
from softnlp.model.rules import Violation as Violation

MINIMUM_WALL = 0.8e-3  # delta_s of Eq. (1) [m]
USUAL_SIZES = (1e-3, 1.0)  # of a soft robot's length and diameter [m]
LENGTH_LIMITS = (SIZE.low * MILLIMETRE, SIZE.high * MILLIMETRE)  # [m]
LARGEST = 1e300  # beyond it, an int may not even have a float
MOST_CHAMBERS = 1000


@dataclass(frozen=True)
class Dimension:
    """One numeric dimension of a robot.

    field : name of the `Robot` field. file_key : its key in a scenario, with the unit. scale : SI per file unit;
    None for a count, which is an int in both.
    """

    field: str
    file_key: str
    scale: float | None


DIMENSIONS: tuple[Dimension, ...] = (
    Dimension("outer_diameter", "outer_diameter_mm", MILLIMETRE),
    Dimension("lumen_diameter", "lumen_diameter_mm", MILLIMETRE),
    Dimension("chamber_circle_diameter", "chamber_circle_diameter_mm", MILLIMETRE),
    Dimension("chamber_diameter", "chamber_diameter_mm", MILLIMETRE),
    Dimension("chamber_wall", "chamber_wall_mm", MILLIMETRE),
    Dimension("length", "length_mm", MILLIMETRE),
    Dimension("chamber_sets", "chamber_sets", None),
    Dimension("chambers_per_set", "chambers_per_set", None),
    Dimension("chamber_angle", "chamber_angle_deg", DEGREE),
)


@dataclass(frozen=True, eq=False)
class Robot:
    """A round body with a central lumen and N straight reinforced chambers on a circle.

    Dimensions are numbers or CasADi symbols, counts are ints. The chamber angles are measured from +x in the plane of
    the section; +z is the axis, from base to tip.

    Attributes
    ----------
    name
        Shown in every result.
    outer_diameter, lumen_diameter, chamber_circle_diameter, chamber_diameter
        D_r, D_i, D_cp of the chambers' centres, D_c of the bore; each a number [m].
    chamber_wall
        delta_c, silicone between bore and thread, a number [m].
    length
        L_0, unpressurised, a number [m].
    chamber_sets, chambers_per_set
        n1, with one pressure each, and n2.
    chamber_angle
        alpha_1, between neighbours of one set, a number [rad].
    """

    name: str
    outer_diameter: Any
    lumen_diameter: Any
    chamber_circle_diameter: Any
    chamber_diameter: Any
    chamber_wall: Any
    length: Any
    chamber_sets: int
    chambers_per_set: int
    chamber_angle: Any

    _repr_html_ = rich_html

    @property
    def chambers(self) -> int:
        """Number of chambers N = n1 n2."""
        return self.chamber_sets * self.chambers_per_set

    @property
    def parts(self) -> Mapping[str, Robot]:
        """The robots that it is made of by what messages call them; itself under ""."""
        return {"": self}

    @property
    def notes(self) -> list[str]:
        """What to know of it beside the rules of manufacture."""
        return []

    @property
    def outer_radius(self) -> Any:
        """r_r0, a number [m]."""
        return self.outer_diameter / 2

    @property
    def lumen_radius(self) -> Any:
        """r_i0, a number [m]."""
        return self.lumen_diameter / 2

    @property
    def chamber_circle_radius(self) -> Any:
        """r_cp of the unstretched section, a number [m]."""
        return self.chamber_circle_diameter / 2

    @property
    def bore_radius(self) -> Any:
        """r_ci0, inner radius of a chamber at zero pressure, a number [m]."""
        return self.chamber_diameter / 2

    @property
    def chamber_radius(self) -> Any:
        """r_co = D_c/2 + delta_c, radius of the thread, a number [m]; it never grows."""
        return self.chamber_diameter / 2 + self.chamber_wall

    @property
    def outer_wall(self) -> Any:
        """delta_r, silicone left between thread and surface, from Eq. (1), a number [m]."""
        return (self.outer_diameter - self.lumen_diameter - 2 * self.chamber_diameter) / 4 - self.chamber_wall

    @property
    def side_walls(self) -> tuple[Any, Any]:
        """Silicone between the threads and the surface, and between them and the lumen, numbers [m]."""
        r_cp, r_co = self.chamber_circle_radius, self.chamber_radius
        return self.outer_radius - r_cp - r_co, r_cp - r_co - self.lumen_radius

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """Set of each chamber, both counted from 0; N entries."""
        return tuple(n // self.chambers_per_set for n in range(self.chambers))

    def chamber_angles(self) -> list[Any]:
        """Return the angle theta_n of each chamber from +x, set by set, (S1).

        Returns
        -------
        list
            (N,) angles [rad].
        """
        n2, alpha_1 = self.chambers_per_set, self.chamber_angle
        beta = 2 * pi / self.chamber_sets - n2 * alpha_1
        theta_1 = -alpha_1 * (n2 - 1) / 2
        return [theta_1 + alpha_1 * n + beta * (n // n2) for n in range(self.chambers)]

    def chamber_centres(self) -> list[tuple[Any, Any]]:
        """Return the undeformed centre of each chamber in the body frame, d_i = r_cp [cos, sin].

        Returns
        -------
        list
            (N, 2) pairs x, y [m].
        """
        r_cp = self.chamber_circle_radius
        return [(r_cp * ca.cos(theta), r_cp * ca.sin(theta)) for theta in self.chamber_angles()]

    def manufacture(self, minimum_wall: float, walls: Mapping[str, bool]) -> tuple[Violation, ...]:
        """Return the rules of manufacture that it breaks, as `violations`.

        Parameters
        ----------
        minimum_wall
            delta_s [m].
        walls
            As of `softnlp.model.rules.rules`.

        Returns
        -------
        tuple
            At most one entry a rule.
        """
        require_dimensions(self)
        return broken(rules(self, minimum_wall, walls))


def _library() -> dict[str, Robot]:
    """Build the robots of the paper's tables; columns in mm and degrees."""
    #          D_r  D_i  D_cp  D_c  delta_c alpha_1
    body = {
        "D25": (25.0, 9.0, 17.0, 4.5, 0.5, 50.0),
        "D20": (20.0, 7.2, 13.6, 3.6, 0.5, 50.0),
        "D15": (15.0, 5.4, 10.2, 2.5, 0.5, 56.0),
        "D10": (10.0, 3.0, 6.5, 1.5, 0.5, 60.0),
        "laparoscope": (11.4, 4.7, 8.05, 1.5, 0.4, 40.0),
    }
    named = [(f"{d}L{length}", d, float(length), 2) for d in ("D25", "D20", "D15", "D10") for length in (40, 60)]
    named += [(f"laparoscope-{3 * n2}", "laparoscope", 45.0, n2) for n2 in (1, 2, 3)]
    robots = {}
    for name, key, length, n2 in named:
        *widths, alpha_1 = body[key]
        d_r, d_i, d_cp, d_c, delta_c, l_0 = (x * MILLIMETRE for x in (*widths, length))
        robots[name] = Robot(name, d_r, d_i, d_cp, d_c, delta_c, l_0, 3, n2, alpha_1 * DEGREE)
    return robots


ROBOTS: Mapping[str, Robot] = MappingProxyType(_library())
"""The robots of the paper by name, read-only."""


def robot(name: str, *, allow: Collection[str] = (), **overrides: Any) -> Robot:
    """Return a robot of the library, with single dimensions replaced.

    Parameters
    ----------
    name
        One of `ROBOTS`.
    allow
        Rules of `check` that may be broken.
    overrides
        `Robot` fields in SI (m, rad), numbers or symbols; a changed robot is renamed "NAME (modified)".

    Returns
    -------
    Robot
        Checked, where every dimension is a number.

    Raises
    ------
    RobotError
        When the name or a dimension is unknown, or when every dimension is a number and the robot cannot be made.
    """
    if name not in ROBOTS:
        raise RobotError(f"expected a robot of the library, got {shown(name)}{nearest(str(name), ROBOTS)}", key="name")
    known = [d.field for d in DIMENSIONS]
    for key in overrides:
        if key not in known:
            raise RobotError(f"unknown dimension{nearest(key, known)}", key=key)
    original = ROBOTS[name]
    changed = any(not is_number(v) or v != getattr(original, key) for key, v in overrides.items())
    made = replace(original, **overrides, name=f"{name} (modified)") if changed else original
    if all(is_number(getattr(made, key)) for key in known):
        check(made, allow=allow)
    return made


def violations(
    robot: Robot, minimum_wall: float = MINIMUM_WALL, walls: Mapping[str, bool] = MappingProxyType({})
) -> tuple[Violation, ...]:
    """Return every rule of manufacture that a robot of numbers breaks, at most one entry a rule.

    minimum_wall, walls : as of `rules`.

    Raises
    ------
    RobotError
        When a dimension is a symbol, not finite, not positive or so far off that no robot is described.
    """
    return robot.manufacture(minimum_wall, walls)


def check(robot: Robot, *, allow: Collection[str] = (), minimum_wall: float = MINIMUM_WALL) -> tuple[str, ...]:
    """Refuse a robot that cannot be made.

    Parameters
    ----------
    robot : every dimension a number.
    allow : names of `ALLOWABLE`; rules among `LOWERABLE_RULES` become warnings.
    minimum_wall : delta_s of Eq. (1) [m].

    Returns
    -------
    One warning for each allowed rule that the robot breaks, and for a size that is likely in another unit.

    Raises
    ------
    RobotError
        Naming the first rule that is broken and not allowed, with its numbers; or an unknown name in `allow`.
    """
    for rule in allow:
        if rule not in ALLOWABLE:
            reason = "which can never be lowered" if rule in RULES else "no such rule"
            hint = "" if rule in RULES else did_you_mean(str(rule), ALLOWABLE)
            raise RobotError(f"expected {choices(ALLOWABLE)}, got {shown(rule)}, {reason}{hint}", key="allow")
    if "" not in robot.parts:
        every = {part: _checked(part, one, allow, minimum_wall) for part, one in robot.parts.items()}
        return (*(f"{part}: {note}" for part, notes in every.items() for note in notes), *robot.notes)
    found = violations(robot, minimum_wall)
    refused = [v for v in found if v.rule not in allow]
    if refused:
        hints = [f'; allow = ["{v.rule}"] lowers this to a warning' if v.lowerable else "" for v in refused]
        told = [f"{v.rule}: {v.message}{hint}{metres_hint(robot)}" for v, hint in zip(refused, hints, strict=True)]
        raise first_of([RobotError(words) for words in told])
    return (*(f"{v.rule}: {v.message}" for v in found), *size_notes(robot))


def _checked(part: str, robot: Robot, allow: Collection[str], minimum_wall: float) -> tuple[str, ...]:
    """Return what `check` does of a part of a robot; its errors name the part."""
    try:
        return check(robot, allow=allow, minimum_wall=minimum_wall)
    except RobotError as error:
        raise RobotError(f"{part}: {error.message}", key=error.key) from None


def metres_hint(robot: Robot) -> str:
    """Return what to say of a diameter of a robot that is a thousandth of a usual one, "" of others."""
    low, high = USUAL_SIZES
    size = float(robot.outer_diameter)
    if size >= low or not low <= 1000 * size <= high:
        return ""
    return f"; an outer diameter of {in_mm(size)} looks like metres: {in_mm(1000 * size)}"


def size_notes(robot: Robot) -> tuple[str, ...]:
    """Return a warning for each size that no soft robot has, which is likely one in another unit."""
    low, high = USUAL_SIZES
    return tuple(
        f"{name.replace('_', ' ')} {in_mm(value)} is outside {in_mm(low)} to {in_mm(high)}: check its unit, mm in files"
        for name in ("outer_diameter", "length")
        if not low <= (value := float(getattr(robot, name))) <= high
    )


@lru_cache(maxsize=64)
def touching_stretch(robot: Robot) -> float:
    """Return the stretch above which neighbouring reinforced chambers touch; infinite for a single chamber.

    The chamber circle shrinks as lambda^-1/2 (S2) while r_co stays, so chord / sqrt(lambda) = 2 r_co. Below 1 the
    chambers overlap as they are.
    """
    require_dimensions(robot)
    chords = [chord for chord, _, _ in neighbours(robot)]
    return float((min(chords) / (2 * robot.chamber_radius)) ** 2) if chords else inf


def is_number(value: Any) -> bool:
    """Whether a dimension is a plain number, of Python or NumPy (bools are not)."""
    return not isinstance(value, bool) and isinstance(value, Real)


def require_dimensions(robot: Robot) -> None:
    """Raise RobotError for the first dimension that is not a possible number."""
    for dimension in DIMENSIONS:
        key = dimension.field
        value = getattr(robot, key)
        if not is_number(value):
            raise RobotError(f"expected a number, got {type(value).__name__}", key=key)
        if dimension.scale is None:
            if not isinstance(value, Integral) or not 1 <= int(value) <= MOST_CHAMBERS:
                raise RobotError(f"expected a whole number from 1 to {MOST_CHAMBERS}, got {shown(value)}", key=key)
        elif not abs(value) < LARGEST:
            raise RobotError(f"expected a finite number, got {shown(value)}", key=key)
        elif key == "chamber_angle":
            _require_angle(robot)
        elif not LENGTH_LIMITS[0] <= value <= LENGTH_LIMITS[1]:
            low, high = (limit / MILLIMETRE for limit in LENGTH_LIMITS)
            raise RobotError(
                f"expected a length between {low:g} mm and {high:g} mm, got {value / MILLIMETRE:g} mm"
                f"{SIZE.small(value / MILLIMETRE)}",
                key=key,
            )
    if robot.chambers > MOST_CHAMBERS:
        raise RobotError(
            f"expected at most {MOST_CHAMBERS} chambers, got {robot.chamber_sets} x {robot.chambers_per_set}",
            key="chamber_sets",
        )
    if robot.lumen_radius >= robot.outer_radius - ROUND_OFF:
        raise RobotError(
            f"expected less than the outer diameter {in_mm(robot.outer_diameter)}, got {in_mm(robot.lumen_diameter)}",
            key="lumen_diameter",
        )


def _require_angle(robot: Robot) -> None:
    """Raise RobotError when alpha_1 puts the chambers of a set nowhere, or on top of one another."""
    alone = robot.chambers_per_set == 1
    if not (0 <= robot.chamber_angle <= 2 * pi) or (robot.chamber_angle == 0 and not alone):
        raise RobotError(
            f"expected an angle above 0 and up to 360 degrees, got {robot.chamber_angle / DEGREE:g} degrees",
            key="chamber_angle",
        )
