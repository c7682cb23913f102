"""All moulds of a robot: for each segment the parts of both steps and of the caps, put together and flooded."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import degrees
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh import require
from softnlp.model.robot import Robot
from softnlp.model.segments import SegmentedRobot
from softnlp.mould.cap import connector, cup
from softnlp.mould.cores import Core, core_of, lean, lumen_rod
from softnlp.mould.parts import Part
from softnlp.mould.plates import above, channel, plates, vents
from softnlp.mould.shape import shapes_of
from softnlp.mould.shell import body, gate_solid, shell
from softnlp.mould.sizes import CHANNEL, LAND, PULL, SEAT, Sizes, settled
from softnlp.mould.solids import FINE, MIDDLE, bounds, box, cylinder, loft, turned, union, without
from softnlp.scenario.mould import MouldTable as Settings

if TYPE_CHECKING:
    from manifold3d import Manifold

_TOUCH = 1e-4  # parts that are nearer than twice this touch [mm]
_HAIR = 0.01  # of a void outside the body: hairs that roundings leave between faces that touch [mm^3]


@dataclass(frozen=True, eq=False)
class SegmentMould:
    """The moulds of one segment.

    prefix : before the names of its parts, "" of the only one. ends : of "base" and "tip", those that get a cap.
    """

    sizes: Sizes
    prefix: str
    shells: tuple[Part, ...]
    plates: dict[str, Part]
    lumen: Part
    cores: tuple[Core, ...]
    caps: dict[str, Part]

    def step(self, number: int) -> list[Part]:
        """Return the parts that are put together for the first or the second pour."""
        cores = [part for core in self.cores for part in (core.parts if number == 1 else (core.rod,))]
        return [self.plates[f"base-{number}"], *self.shells, self.lumen, *cores, self.plates[f"top-{number}"]]

    @property
    def parts(self) -> list[Part]:
        """Everything that is printed, each once."""
        rods = [core.rod for core in self.cores]
        first = self.step(1)
        return [*first, *rods, self.plates["base-2"], self.plates["top-2"], *self.caps.values()]

    @cached_property
    def threads(self) -> list[Manifold]:
        """The thread on each core."""
        return [turned(core.thread, turn) for core in self.cores for turn in core.turns]

    @cached_property
    def sprues(self) -> tuple[list[Manifold], list[Manifold]]:
        """What fills gate, vents and channel outside the body in either step, and reaches a little into the moulds."""
        sizes = self.sizes
        gate = gate_solid(sizes, _TOUCH) - body(sizes)
        return [gate, above(sizes, vents(sizes, _TOUCH))], [gate, above(sizes, channel(sizes, _TOUCH))]

    @cached_property
    def cast(self) -> Manifold:
        """What the moulds of the second step enclose when nothing was cast before: the whole body as cast."""
        rods = [one for core in self.cores for one in core.rod.every]
        return self._flooded([*self._around(2), *rods, *self._fits], self.sprues[1])

    @cached_property
    def first(self) -> Manifold:
        """The silicone of the first pour.

        Threads are taken out of what was flooded: around a smooth core they touch nothing, and would be voids of voids.
        """
        cores = [one for core in self.cores for part in core.parts for one in part.every]
        return without(self._flooded([*self._around(1), *cores], self.sprues[0]), self.threads)

    def _around(self, number: int) -> list[Manifold]:
        base, top = (self.plates[f"{kind}-{number}"].solid for kind in ("base", "top"))
        held = [base.translate((0.0, 0.0, _TOUCH)), top.translate((0.0, 0.0, -_TOUCH))]
        return [*held, *(part.solid for part in (*self.shells, self.lumen)), *self._joints]

    @cached_property
    def _fits(self) -> list[Manifold]:
        """What closes the holes of the second rods where they fit without play."""
        L = self.sizes.shape.length
        found: list[Manifold] = []
        for core in self.cores:
            for end, low, high in ((0, -LAND, 0.0), (-1, L + CHANNEL, L + CHANNEL + LAND)):
                radius = [float(core.hole.bore[end]) + _TOUCH] * 2
                leant = lean(self.sizes, core.hole) if end == 0 else 0.0
                x = [float(core.hole.circle[end]) + leant * z for z in (low, 0.0)]
                plug = loft([low, high], radius, x, MIDDLE)
                found += [turned(plug, turn) for turn in core.turns]
        return found

    @cached_property
    def _joints(self) -> list[Manifold]:
        """What closes the parting planes where their parts touch: two planes that were turned differ by a rounding."""
        sizes = self.sizes
        sheet = box((0.0, sizes.flange), (-_TOUCH, _TOUCH), (-SEAT, sizes.shape.length + SEAT))
        n, whole = sizes.settings.shell_parts, body(sizes)
        return [turned(sheet, degrees(sizes.lead) + 360.0 * k / n) - whole for k in range(n)]

    def _flooded(self, parts: list[Manifold], sprues: list[Manifold]) -> Manifold:
        """Return the voids between parts that stay between the body's ends; one that is open does not."""
        sizes, margin = self.sizes, 5.0
        reach, high = 2 * sizes.flange, sizes.top_end + PULL + margin
        block = box((-reach, reach), (-reach, reach), (-sizes.stand - margin, high))
        voids = without(block, [*parts, *sprues]).decompose()
        R, L = float(sizes.shape.outer.max()), sizes.shape.length
        region = cylinder(R + _TOUCH, 0.0, L, sides=FINE)
        found = []
        for one in voids:
            (x, y, z), (X, Y, Z) = bounds(one)
            if max(-x, -y, X, Y) < R + _TOUCH and z > 0 and Z < L:
                found.append(one)
            elif 0 < one.volume() < 2 * sizes.shape.volume() and (one - region).volume() < _HAIR:
                found.append(one ^ region)
        return union(found)


@dataclass(frozen=True, eq=False)
class Moulds:
    """Everything to print for a robot. notes : what a maker should know."""

    robot: Robot
    settings: Settings
    segments: tuple[SegmentMould, ...]
    connectors: tuple[Part, ...]
    notes: tuple[str, ...]

    @property
    def parts(self) -> list[Part]:
        """Every part once, under the name of its file."""
        own = [
            replace(part, name=f"{segment.prefix}{part.name}") for segment in self.segments for part in segment.parts
        ]
        return [*own, *self.connectors]


def sizes_of(robot: Robot, settings: Settings) -> list[Sizes]:
    """Return the sizes of the moulds of each segment; raises `InputError` for what cannot be moulded."""
    shapes = shapes_of(robot, settings.shrinkage_percent)
    found = []
    for k, shape in enumerate(shapes):
        try:
            found.append(settled(shape, settings))
        except InputError as error:
            where = f"segment {k + 1}: " if len(shapes) > 1 else ""
            raise InputError(f"{where}{error.message}", table=error.table, key=error.key) from None
    return found


def moulds(robot: Robot, settings: Settings | None = None) -> Moulds:
    """Return the moulds of a robot.

    Raises
    ------
    InputError
        Without the extra `mesh`, and for what cannot be moulded.
    """
    require(MIDDLE)
    chosen = settings or Settings()
    sizes = sizes_of(robot, chosen)
    joints, notes = list[Part](), [one.note for one in sizes if one.note]
    joined = set[int]()
    if isinstance(robot, SegmentedRobot):
        for k, (below, above_it) in enumerate(zip(robot.segments[:-1], robot.segments[1:], strict=True)):
            if below.connector > 0:
                length, bonded = below.connector / MILLIMETRE, below.lines == "bonded"
                part, note = connector(sizes[k], sizes[k + 1], length, above_it.turn, k + 1, bonded)
                joints.append(part)
                joined.add(k)
                notes += [note] if note else []
    made = []
    for k, one in enumerate(sizes):
        ends = ([] if k - 1 in joined else ["base"]) + ([] if k in joined else ["tip"])
        made.append(_segment(one, f"segment-{k + 1}-" if len(sizes) > 1 else "", ends))
    flipped = [k + 1 for k, one in enumerate(sizes) if one.shape.flipped]
    if flipped:
        which = f"segments {', '.join(map(str, flipped))}" if len(sizes) > 1 else "the body"
        notes.append(f"{which} narrows towards the tip, so it is cast tip down")
    return Moulds(robot, chosen, tuple(made), tuple(joints), tuple(notes))


def _segment(sizes: Sizes, prefix: str, ends: list[str]) -> SegmentMould:
    """Return the moulds of a segment; chambers that are alike have one core."""
    groups: dict[tuple[float, ...], list[int]] = {}
    for n, hole in enumerate(sizes.shape.holes):
        groups.setdefault(hole.alike, []).append(n)
    cores = [
        core_of(sizes, [sizes.shape.holes[n] for n in alike], f"-{k + 1}" if len(groups) > 1 else "")
        for k, alike in enumerate(groups.values())
    ]
    caps = {end: cup(sizes, end) for end in ends}
    return SegmentMould(sizes, prefix, tuple(shell(sizes)), plates(sizes, cores), lumen_rod(sizes), tuple(cores), caps)


def lead_degrees(sizes: Sizes) -> float:
    """Return the direction of the gate [deg]."""
    return degrees(sizes.lead)
