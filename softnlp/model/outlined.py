"""Robots of any section: chambers and body by their outlines, in the place that a `Robot` of round chambers has.

What only a layout of equal round chambers has is nan, so that nothing takes it for a number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import atan2, isfinite, nan, pi
from typing import Any, Literal, NamedTuple

from softnlp.base.errors import InputError, RobotError
from softnlp.base.reading import shown
from softnlp.base.units import MILLIMETRE
from softnlp.model.plane import (
    STEP,
    Circle,
    Outline,
    Polygon,
    arc_corners,
    gap,
    is_simple,
    not_an_outline,
    reach,
    room,
    turned,
    widened,
)
from softnlp.model.robot import LENGTH_LIMITS, Robot, is_number
from softnlp.model.rules import ROUND_OFF, Violation, in_mm

Reinforcement = Literal["chamber", "body"]
_UNIT = Circle(0.0, 0.0, 1.0)


class Sector(NamedTuple):
    """A bore between two radii and two angles about the axis [m, rad]."""

    inner: float
    outer: float
    start: float
    end: float


class Semicircle(NamedTuple):
    """A half disc at x > offset about (offset, 0), then turned about the axis [m, rad]."""

    radius: float
    offset: float
    turn: float


class Annulus(NamedTuple):
    """A bore between two radii all around the axis [m]."""

    inner: float
    outer: float


Form = Circle | Sector | Semicircle | Annulus | Polygon


class Area(NamedTuple):
    """An area inside one outline and, of an annulus, outside another."""

    outer: Outline
    inner: Outline | None = None

    @property
    def area(self) -> float:
        """Enclosed [m^2]."""
        return self.outer.area - (0.0 if self.inner is None else self.inner.area)


class Region(NamedTuple):
    """Silicone in one piece: inside one outline and outside others. chambers : which of these, None for the lumen."""

    outer: Outline
    holes: tuple[Outline, ...]
    chambers: tuple[int | None, ...]


@dataclass(frozen=True)
class Chamber:
    """One chamber.

    Attributes
    ----------
    set
        Whose pressure it has, from 0.
    form
        Of its bore.
    wall
        Silicone between bore and thread; of a body with the thread around it, what has to stay around the bore [m].
    """

    set: int
    form: Form
    wall: float

    def bore(self, step: float = STEP) -> Area:
        """Return what is open as cast; step : of arcs that become polygons [rad]."""
        form = self.form
        if isinstance(form, Sector):
            outer = arc_corners(form.outer, form.start, form.end, step)
            inner = arc_corners(form.inner, form.end, form.start, step) if form.inner > 0 else [(0.0, 0.0)]
            return Area(Polygon((*outer, *inner)))
        if isinstance(form, Semicircle):
            half = [(form.offset + x, y) for x, y in arc_corners(form.radius, -pi / 2, pi / 2, step)]
            return Area(turned(half, form.turn))
        if isinstance(form, Annulus):
            return Area(Circle(0.0, 0.0, form.outer), Circle(0.0, 0.0, form.inner))
        return Area(form)

    def threaded(self, step: float = STEP) -> Area:
        """Return what the thread at the far side of the wall encloses."""
        bore = self.bore(step)
        inner = None if bore.inner is None else widened(bore.inner, -self.wall)
        return Area(widened(bore.outer, self.wall, step), inner)


@dataclass(frozen=True, eq=False)
class OutlinedRobot(Robot):
    """A body of any outline with chambers of any outline; made by `outlined_robot`.

    Attributes
    ----------
    name
        Shown in every result.
    outer_diameter
        Of the circle about the axis that the body fits in, a number [m].
    lumen_diameter
        D_i, 0 without a lumen, a number [m].
    chamber_circle_diameter, chamber_diameter, chamber_wall
        Not a number: those of a round layout [m].
    length
        L_0, unpressurised, a number [m].
    chamber_sets
        With one pressure each.
    chambers_per_set, chamber_angle
        0 and not a number: those of a round layout [rad].
    chamber_list
        (N,) chambers.
    surface
        The body's outline.
    reinforcement
        Whether thread is wound around each chamber or around the body.
    """

    chamber_list: tuple[Chamber, ...] = ()
    surface: Outline = _UNIT
    reinforcement: Reinforcement = "chamber"

    @property
    def chambers(self) -> int:
        """Number of chambers N."""
        return len(self.chamber_list)

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """Set of each chamber, both counted from 0; N entries."""
        return tuple(chamber.set for chamber in self.chamber_list)

    @property
    def lumen(self) -> Circle | None:
        """The central hole."""
        return Circle(0.0, 0.0, float(self.lumen_radius)) if self.lumen_diameter > 0 else None

    @cached_property
    def held(self) -> tuple[Area, ...]:
        """What each chamber takes from the body: what its thread encloses, or its bore in a body that is wound."""
        by_chamber = self.reinforcement == "chamber"
        return tuple(c.threaded() if by_chamber else c.bore() for c in self.chamber_list)

    @cached_property
    def silicone(self) -> tuple[Region, ...]:
        """The silicone outside threads, or of a wound body outside bores: parts that annuli keep apart, inner first."""
        rings = sorted((n for n, area in enumerate(self.held) if area.inner is not None), key=lambda n: self._inner(n))
        found, left = list[Region](), {n: area.outer for n, area in enumerate(self.held) if n not in rings}
        core: tuple[Outline, int | None] | None = None if self.lumen is None else (self.lumen, None)
        for n in (*rings, None):
            edge = self.surface if n is None else self.held[n].inner
            assert edge is not None
            inside = {k: outline for k, outline in left.items() if n is None or room(outline, edge) > 0}
            left = {k: outline for k, outline in left.items() if k not in inside}
            holes = [*inside.values(), *([core[0]] if core else [])]
            found.append(Region(edge, tuple(holes), (*inside, *([core[1]] if core else []))))
            core = None if n is None else (self.held[n].outer, n)
        return tuple(found)

    def _inner(self, n: int) -> float:
        inner = self.held[n].inner
        return 0.0 if inner is None else reach(inner)

    @property
    def shape(self) -> tuple[object, ...]:
        """What the section is, but for its silicone: equal of equal sections."""
        return self.chamber_list, self.surface, self.reinforcement, float(self.lumen_diameter)

    def chamber_centres(self) -> list[tuple[Any, Any]]:
        """Return the centroid of what each thread encloses, or of each bore.

        Returns
        -------
        list
            (N, 2) pairs x, y [m].
        """
        return [area.outer.centre for area in self.held]

    def chamber_angles(self) -> list[Any]:
        """Return the angle of each centroid from +x.

        Returns
        -------
        list
            (N,) angles [rad].
        """
        return [atan2(y, x) for x, y in self.chamber_centres()]

    def manufacture(self, minimum_wall: float, walls: Mapping[str, bool]) -> tuple[Violation, ...]:
        """Return what cannot be made: chambers out of the body, that overlap, or with too little silicone beside them.

        Parameters
        ----------
        minimum_wall
            delta_s, the least between a bore and the surface or the lumen [m].
        walls
            Not used: of searches over round chambers.

        Returns
        -------
        tuple
            At most one entry a rule.
        """
        self._require_sizes()
        every = [c.threaded() for c in self.chamber_list]
        outside, thin = list[tuple[int, str]](), list[tuple[int, str]]()
        for n, (chamber, area) in enumerate(zip(self.chamber_list, every, strict=True)):
            bore, number = chamber.bore(), n + 1
            free = _rounded(room(area.outer, self.surface))
            if free < -ROUND_OFF:
                outside.append((n, f"chamber {number} with its wall reaches {in_mm(-free)} out of the body"))
            elif (wall := _rounded(room(bore.outer, self.surface))) < minimum_wall - ROUND_OFF:
                thin.append((n, f"the wall between chamber {number} and the surface is {in_mm(wall)}"))
            if self.lumen is None:
                continue
            beside = _rounded(gap(area.outer, self.lumen) if area.inner is None else room(self.lumen, area.inner))
            if beside < -ROUND_OFF:
                outside.append((n, f"chamber {number} with its wall reaches {in_mm(-beside)} into the lumen"))
            elif beside + chamber.wall < minimum_wall - ROUND_OFF:
                thin.append((n, f"the wall between chamber {number} and the lumen is {in_mm(beside + chamber.wall)}"))
        pairs = [(_apart(every[i], every[j]), i, j) for i, j in combinations(range(len(every)), 2)]
        overlap = [pair for pair in pairs if pair[0] < -ROUND_OFF]
        found = list[Violation]()
        if thin:
            words = f"{' and '.join(text for _, text in thin)}, less than the minimum {in_mm(minimum_wall)}"
            found.append(Violation("wall_thickness", words, True, tuple(sorted({n for n, _ in thin}))))
        if overlap:
            least, i, j = min(overlap)
            more = f" (and {len(overlap) - 1} more pairs)" if len(overlap) > 1 else ""
            words = f"chambers {i + 1} and {j + 1} with their walls overlap by {in_mm(-least)}{more}"
            both = tuple(sorted({n for _, *two in overlap for n in two}))
            found.append(Violation("chamber_overlap", words, False, both))
        if outside:
            words = " and ".join(text for _, text in outside)
            found.append(Violation("chambers_inside_wall", words, False, tuple(sorted({n for n, _ in outside}))))
        if not found:
            self.require_room()
        return tuple(found)

    def require_room(self) -> None:
        """Raise `RobotError` where thread leaves silicone no room when it is stretched, or a chamber has none."""
        wound = self.reinforcement == "body"
        for part in self.silicone:
            last = part.outer is self.surface
            if last is wound and not (part.holes if wound else None in part.chambers):
                raise RobotError(
                    "thread leaves the silicone inside an annulus no room when it is stretched; give the body a lumen, "
                    'or wind it as a whole: [body] reinforcement = "body"'
                )
            if wound and not last and any(n is not None for n in part.chambers):
                raise RobotError("a chamber inside an annulus has no thread in a body that is wound as a whole")

    def _require_sizes(self) -> None:
        """Raise `RobotError` for what is no section at all."""
        low, high = LENGTH_LIMITS
        for key, least in (("length", low), ("outer_diameter", low), ("lumen_diameter", 0.0)):
            value = getattr(self, key)
            if not is_number(value) or not isfinite(value) or not least <= value <= high:
                words = f"between {least / MILLIMETRE:g} mm and {high / MILLIMETRE:g} mm"
                raise RobotError(f"expected a length {words}, got {shown(value)}", key=key)
        if self.lumen is not None and (space := room(self.lumen, self.surface)) <= ROUND_OFF:
            text = f"expected a lumen inside the body, got {in_mm(self.lumen_diameter)}, {in_mm(-space)} too much"
            raise RobotError(text, key="lumen_diameter")


def outlined_robot(
    name: str,
    chambers: Sequence[Chamber],
    length: float,
    *,
    outer_diameter: float | None = None,
    surface: Outline | None = None,
    lumen_diameter: float = 0.0,
    reinforcement: Reinforcement = "chamber",
) -> OutlinedRobot:
    """Return a robot of any section, which studies take with the energy section.

    Parameters
    ----------
    name
        Shown in every result.
    chambers
        At least one; their sets are counted from 0 without a gap.
    length
        L_0, unpressurised [m].
    outer_diameter
        Of a round body [m].
    surface
        The outline of another one, in place of the diameter.
    lumen_diameter
        D_i of the central hole; 0 for none [m].
    reinforcement
        "chamber": thread around each chamber, at the far side of its wall. "body": around the body.

    Returns
    -------
    OutlinedRobot
        Not checked yet by the rules of manufacture: studies do.

    Raises
    ------
    RobotError
        For what is no outline, and for sets that are not counted from 0.
    """
    if not chambers:
        raise RobotError("expected at least one chamber", key="chamber")
    sets = {chamber.set for chamber in chambers}
    if sets != set(range(len(sets))):
        missing = next(k for k in range(len(sets)) if k not in sets)
        raise RobotError(f"expected sets from 1 on without a gap, got none with set = {missing + 1}", key="set")
    if (outer_diameter is None) == (surface is None):
        raise RobotError("expected either the diameter of a round body or its outline", key="outline")
    body = surface if surface is not None else Circle(0.0, 0.0, float(outer_diameter or 0.0) / 2)
    if isinstance(body, Polygon) and (words := not_an_outline(body)):
        raise RobotError(words, key="outline")
    for number, chamber in enumerate(chambers, start=1):
        if words := _unfit(chamber):
            raise RobotError(f"chamber {number}: {words}", key="chamber")
    return OutlinedRobot(
        name, 2 * reach(body), lumen_diameter, nan, nan, nan, length, len(sets), 0, nan,
        tuple(chambers), body, reinforcement,
    )  # fmt: skip


def _unfit(chamber: Chamber) -> str:
    """Return what is wrong with a chamber by itself, "" where nothing is."""
    form = chamber.form
    if isinstance(form, Annulus | Sector) and not 0 <= form.inner < form.outer:
        return f"expected an inner radius below the outer one {in_mm(form.outer)}, got {in_mm(form.inner)}"
    if isinstance(form, Sector) and not 0 < form.end - form.start < 2 * pi:
        return "expected a sector of less than 360 degrees that goes from a smaller angle to a larger one"
    if isinstance(form, Annulus) and form.inner - chamber.wall <= 0:
        return f"expected a wall thinner than the inner radius {in_mm(form.inner)}, got {in_mm(chamber.wall)}"
    bore = chamber.bore().outer
    if isinstance(bore, Polygon) and (words := not_an_outline(bore)):
        return words
    area = chamber.threaded().outer
    if isinstance(area, Polygon) and not is_simple(area):
        return f"a wall of {in_mm(chamber.wall)} does not fit around this outline: a recess is too narrow"
    return ""


def _apart(a: Area, b: Area) -> float:
    """Return the gap between two chambers, one of which may be inside the other, an annulus [m]."""
    found = gap(a.outer, b.outer)
    for ring, other in ((a, b), (b, a)):
        if ring.inner is not None:
            found = max(found, room(other.outer, ring.inner))
    return _rounded(found)


def _rounded(distance: float) -> float:
    """Return a distance to what arcs are known to that became polygons [m]."""
    return round(distance, 6)


def require_round_layout(robot: Robot, what: str) -> None:
    """Raise `InputError` for a robot whose section is given by outlines. what : takes none of these."""
    if isinstance(robot, OutlinedRobot):
        raise InputError(f"{what} takes a round layout of chambers so far, not [[chamber]]")
