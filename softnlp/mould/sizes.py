"""Every size of a mould, settled: what [mould] leaves open is chosen here, and what cannot be moulded is refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import cos, pi, radians, sqrt, tan

import numpy as np

from softnlp.base.errors import InputError
from softnlp.mould.shape import Hole, Shape, distance, waist
from softnlp.mould.solids import MIDDLE, TURN
from softnlp.scenario.mould import MouldTable as Settings

SEAT, GAP, LIP = 4.0, 0.3, 4.0  # how far plates reach into the shell, stand off its end, and overlap its step [mm]
FLOOR, GRIP, PULL = 1.2, 8.0, 6.0  # below sockets; what cores stand out above the plate, and keys above cores [mm]
LAND, CHANNEL = 2.0, 2.0  # where second rods fit without play; depth of the channel above the liners [mm]
LEAST_VENT = 0.3  # narrower ones close as they are printed [mm]
LUER, USUAL_GATE, USUAL_TUBE = 4.3, 4.0, 2.0  # the mouth takes a syringe's tip [mm]
THREE_PART_FROM = 15.0  # outer diameter of the smallest robot of the paper with three-part cores [mm]
KEY_DRAFT, SEAL = 0.003, 0.01  # of a key's narrow sides; of shoulders beyond their sockets' play, at least [mm]
_PLAY = 0.01  # of a side of a core that has moved in [mm]
_ROUND_OFF = 1e-6


def refuse(message: str, key: str | None = None) -> InputError:
    """Return the error of a mould that cannot be made."""
    return InputError(message, table="mould", key=key)


@dataclass(frozen=True, eq=False)
class Sizes:
    """A shape with what a maker chose. method : "three-part" or "pin" [mm everywhere]."""

    shape: Shape
    settings: Settings
    method: str
    note: str = ""

    @cached_property
    def tilted(self) -> bool:
        """Whether chambers lean or widen: their cores are then drawn straight, never turned out."""
        return any(np.ptp(r) > _ROUND_OFF for hole in self.shape.holes for r in (hole.circle, hole.core))

    @cached_property
    def depth(self) -> float:
        """Of the groove: half the thread; none in pins that lean, which cannot be turned out."""
        given = self.settings.groove_depth_mm
        if given is not None:
            return given
        return 0.0 if self.method == "pin" and self.tilted else self.settings.thread_diameter_mm / 2

    @cached_property
    def smooth(self) -> float:
        """By how much what a thread touches stays below its circle, whose chords are inside it."""
        return max(float(hole.core.max()) for hole in self.shape.holes) * (1 - cos(pi / TURN)) + 0.003

    @property
    def inset(self) -> float:
        """How much thicker a core is in radius than the thread's r_co, so that the thread's middle lies there."""
        return self.depth - self.settings.thread_diameter_mm / 2 - (0.0 if self.depth > 0 else self.smooth)

    def fall(self, end: int) -> float:
        """Return how much nearer to the axis leaning cores are at their sockets' ground than at the body's end."""
        if end == -1:
            return 0.0
        rise = max(float(hole.circle[-1] - hole.circle[0]) for hole in self.shape.holes)
        return max(rise, 0.0) / self.shape.length * self.socket

    @cached_property
    def shoulder(self) -> float:
        """By how much the ends of cores are thinner, so that the webs between their sockets can be printed."""
        web = self.settings.minimum_wall_mm + 2 * self.settings.clearance_mm
        needed = [
            (float(a.core[end] + b.core[end]) + 2 * self.inset + web - distance(a, b, end, self.fall(end))) / 2
            for a, b in combinations(self.shape.holes, 2)
            for end in (0, -1)
        ]
        return max([self.settings.shoulder_mm, self._sealing, *needed])

    @property
    def _sealing(self) -> float:
        """The least shoulder that covers its socket's play: keys and grooved pins bear on it with their grounds."""
        ground = self.depth + self.smooth + KEY_DRAFT if self.depth > 0 or self.method == "three-part" else 0.0
        return ground + self.settings.clearance_mm + SEAL

    @cached_property
    def lumen_shoulder(self) -> float:
        """The same of the lumen rod."""
        web = self.settings.minimum_wall_mm + 2 * self.settings.clearance_mm
        s = max(self.settings.shoulder_mm, self.settings.clearance_mm + SEAL)
        for hole in self.shape.holes:
            for end in (0, -1):
                thick = max(float(hole.core[end]) + self.inset - self.shoulder, float(hole.bore[end]))
                s = max(s, thick + float(self.shape.lumen[end]) + web - float(hole.circle[end]) + self.fall(end))
        return s

    def spigot(self, hole: Hole, end: int) -> float:
        """Return the radius of a core's end, 0 or -1."""
        return float(hole.core[end]) + self.inset - self.shoulder

    def lumen_spigot(self, end: int) -> float:
        """Return the radius of the lumen rod's end, 0 or -1."""
        return float(self.shape.lumen[end]) - self.lumen_shoulder

    @property
    def stand(self) -> float:
        """How far a plate reaches from the body's end to its outer face."""
        return SEAT + GAP + self.settings.plate_mm

    @property
    def socket(self) -> float:
        """Depth of the sockets of base plates, and of the core's end in them."""
        return self.stand - max(FLOOR, self.settings.minimum_wall_mm)

    @property
    def foot(self) -> float:
        """Length of the ends that stand in them."""
        return self.socket - GAP

    @property
    def top_end(self) -> float:
        """Height at which cores end."""
        return self.shape.length + self.stand + GRIP

    def boss(self, end: int) -> float:
        """Return the radius of a plate where it is in the shell."""
        return float(self.shape.outer[end]) + LIP

    @cached_property
    def tube(self) -> float:
        """Radius of the shell's outside before its flanges."""
        recess = max(self.boss(0), self.boss(-1)) + self.settings.clearance_mm
        return max(recess, float(self.shape.outer.max())) + self.settings.wall_mm

    @property
    def flange(self) -> float:
        """How far the flanges reach from the axis."""
        return self.tube + self.settings.flange_mm

    @property
    def screw_line(self) -> float:
        """Distance of the clamping screws from the axis."""
        return self.tube + self.settings.flange_mm / 2

    @property
    def head(self) -> float:
        """Radius of a pocket for a screw's head or its nut."""
        return self.settings.screw_mm + 0.3

    @property
    def hole(self) -> float:
        """Radius of a screw's hole."""
        return self.settings.screw_mm / 2 + 0.2

    @cached_property
    def gate(self) -> float:
        """Bore of the pour gate where it meets the silicone."""
        wall = self.wall
        return self.settings.gate_mm or min(USUAL_GATE, round(0.8 * wall, 1))

    @property
    def wall(self) -> float:
        """Silicone between lumen and surface where the gate is, at the lower end."""
        return float(self.shape.outer[0] - self.shape.lumen[0])

    @property
    def gate_height(self) -> float:
        """Of the gate's middle above the body's lower end."""
        return max(self.gate, LUER) / 2 + self.settings.minimum_wall_mm + 0.1

    @property
    def lead(self) -> float:
        """Angle at which the gate, and with it a parting plane, lies [rad]: in the widest gap between chambers."""
        return self.shape.gaps()[0]

    @cached_property
    def key_width(self) -> tuple[float, float]:
        """Width of the key of three-part cores at its lower and upper end."""
        low, high = self.key_room
        ends = 2 * (self.top_end + PULL + self.foot) * tan(radians(self.settings.draft_deg))
        return low, min(high, low + ends)

    @cached_property
    def key_room(self) -> tuple[float, float]:
        """Least and largest width of the key: key and sides are as thick as can be printed, and the sides come off.

        A side moves in by half the key's width w. Its edge, at w/2 from the middle, is then at the distance
        sqrt(r^2 - (w/2)^2) from the axis, which has to be less than that of what the key left, r - ground.
        """
        least = self.settings.minimum_wall_mm
        thick = max(float(hole.core.max()) for hole in self.shape.holes) + self.inset
        facets = thick * (1 - cos(pi / MIDDLE))  # of what the key left
        ground = self.depth + self.smooth + KEY_DRAFT + facets + max(waist(hole) for hole in self.shape.holes)
        off = 2 * sqrt(max(2 * thick * ground - ground**2, 0.0)) + _PLAY
        thin = min(
            min(self.spigot(hole, 0), self.spigot(hole, -1), float(hole.core.min()) + self.inset - self.depth)
            for hole in self.shape.holes
        )
        return max(least, off, min(0.5 * thin, 1.5)), 2 * (0.96 * thin - least)

    @property
    def tube_hole(self) -> float:
        """Radius of the holes for tubes in the base cap."""
        bore = min(float(hole.bore[-1 if self.shape.flipped else 0]) for hole in self.shape.holes)
        given = self.settings.tube_mm
        return min(USUAL_TUBE / 2, bore - 0.2) if given is None else given / 2

    @property
    def thread_ends(self) -> tuple[float, float]:
        """Heights between which the thread is wound."""
        margin = max(
            self.settings.thread_pitch_mm / 2, self.settings.minimum_wall_mm + self.settings.thread_diameter_mm
        )
        return margin, self.shape.length - margin

    def thread_length(self) -> float:
        """Return the length of thread on all cores [mm], by a thousand chords of each cone."""
        low, high = self.thread_ends
        z = np.linspace(low, high, 1001)
        total = 0.0
        for hole in self.shape.holes:
            r = np.interp((z[1:] + z[:-1]) / 2, self.shape.z, hole.core)
            around = 2 * pi * r / self.settings.thread_pitch_mm
            total += float(np.sum(np.sqrt(1 + around**2) * np.diff(z)))
        return total


def settled(shape: Shape, settings: Settings) -> Sizes:
    """Return the sizes of a shape's moulds.

    Raises
    ------
    InputError
        For the first of them that cannot be made.
    """
    wide = 2 * float(shape.outer.max()) >= THREE_PART_FROM - _ROUND_OFF
    method, note = settings.core, ""
    if method == "auto":
        method = "three-part" if wide else "pin"
        low, high = Sizes(shape, settings, "three-part").key_room
        if wide and low > high + _ROUND_OFF:
            method, note = "pin", "cores are pins: there is no room for three parts"
    made = Sizes(shape, settings, method, note)
    for error in _refusals(made):
        raise error
    return made


def _refusals(sizes: Sizes) -> Iterator[InputError]:
    """Yield an error for each size that cannot be made."""
    settings, shape, least = sizes.settings, sizes.shape, sizes.settings.minimum_wall_mm
    t, pitch, depth = settings.thread_diameter_mm, settings.thread_pitch_mm, sizes.depth
    for key in ("wall_mm", "plate_mm", "flange_thickness_mm", "cap_mm"):
        if getattr(settings, key) < least:
            yield refuse(f"{getattr(settings, key):g} mm is less than minimum_wall_mm = {least:g}", key)
    yield from _groove(sizes)
    yield from _thread(sizes)
    if depth > 0 and pitch - t < least - _ROUND_OFF:
        yield refuse(
            f"the ridge between turns is {pitch - t:.3g} mm, less than minimum_wall_mm = {least:g}: a pitch of "
            f"at least {least + t:.3g} mm, or groove_depth_mm = 0 to wind on smooth cores",
            "thread_pitch_mm",
        )
    if pitch <= t:
        yield refuse(f"{pitch:g} mm is not more than the thread's {t:g} mm", "thread_pitch_mm")
    if 2 * pitch > shape.length:
        yield refuse(f"{pitch:g} mm leaves no turn on {shape.length:g} mm", "thread_pitch_mm")
    if sizes.gate > sizes.wall + _ROUND_OFF:
        yield refuse(f"a gate of {sizes.gate:g} mm is wider than the wall of silicone, {sizes.wall:.3g} mm", "gate_mm")
    if sizes.gate < least - _ROUND_OFF:
        yield refuse(f"a gate of {sizes.gate:g} mm is less than minimum_wall_mm = {least:g}", "gate_mm")
    if not LEAST_VENT <= settings.vent_mm <= LIP:
        yield refuse(f"expected vents of {LEAST_VENT:g} to {LIP:g} mm, got {settings.vent_mm:g}", "vent_mm")
    if settings.flange_mm < 3 * settings.screw_mm:
        yield refuse(f"{settings.flange_mm:g} mm leaves no room for screws of {settings.screw_mm:g} mm", "flange_mm")
    yield from _rods(sizes)
    yield from _bed(sizes)


def _groove(sizes: Sizes) -> Iterator[InputError]:
    least, depth = sizes.settings.minimum_wall_mm, sizes.depth
    thin = min(float(hole.core.min()) for hole in sizes.shape.holes)
    if depth >= thin:
        yield refuse(f"a groove of {depth:g} mm is deeper than the core, {thin:.3g} mm in radius", "groove_depth_mm")
    thin += sizes.inset
    if sizes.method == "pin" and 2 * (thin - depth) < least:
        left = f"{2 * (thin - depth):.3g} mm"
        yield refuse(f"a groove of {depth:g} mm leaves {left} of the core, less than {least:g} mm", "groove_depth_mm")
    if depth > sizes.settings.thread_diameter_mm + _ROUND_OFF:
        yield refuse(f"a groove of {depth:g} mm is deeper than the thread is thick", "groove_depth_mm")
    if depth > 0 and sizes.method == "pin" and sizes.tilted:
        yield refuse(
            "pins that lean or widen cannot be turned out of a groove: 0, or three-part cores", "groove_depth_mm"
        )


def _thread(sizes: Sizes) -> Iterator[InputError]:
    """Yield why a thread would not be inside the silicone; its middle is at the circle of the core."""
    shape, half = sizes.shape, sizes.settings.thread_diameter_mm / 2

    def bare(where: str, room: float) -> Iterator[InputError]:
        if room < half - _ROUND_OFF:
            beside = f"there are {max(room, 0.0):.3g} mm beside its middle"
            yield refuse(f"a thread of {2 * half:g} mm would lie bare {where}: {beside}", "thread_diameter_mm")

    for hole in shape.holes:
        yield from bare(f"in the bore of chamber {hole.chamber}", float(np.min(hole.core - hole.bore)))
        yield from bare("in the lumen", float(np.min(hole.circle - hole.core - shape.lumen)))
        yield from bare("at the surface", float(np.min(shape.outer - hole.circle - hole.core)))
    for a, b in combinations(shape.holes, 2):
        for end in (0, -1):
            room = (distance(a, b, end) - float(a.core[end] + b.core[end])) / 2
            yield from bare(f"between chambers {a.chamber} and {b.chamber}", room)


def _rods(sizes: Sizes) -> Iterator[InputError]:
    """Yield what is wrong with rods, cores and the webs between their sockets."""
    settings, shape, least = sizes.settings, sizes.shape, sizes.settings.minimum_wall_mm

    def thin(what: str, radius: float, key: str | None = None) -> Iterator[InputError]:
        if 2 * radius < least - _ROUND_OFF:
            size = f"{2 * radius:.3g} mm thick" if radius > 0 else "thinner than nothing"
            yield refuse(f"{what} would be {size}, less than minimum_wall_mm = {least:g}", key)

    for end in (0, -1):
        yield from thin("the ends of the lumen rod", sizes.lumen_spigot(end), "shoulder_mm")
        for hole in shape.holes:
            yield from thin(f"the second rod of chamber {hole.chamber}", float(hole.bore[end]))
            yield from thin(f"the ends of the core of chamber {hole.chamber}", sizes.spigot(hole, end), "shoulder_mm")
        for a, b in combinations(shape.holes, 2):
            web = distance(a, b, end, sizes.fall(end)) - float(a.bore[end] + b.bore[end]) - 2 * settings.clearance_mm
            if web < least - _ROUND_OFF:
                yield refuse(f"between the rods of chambers {a.chamber} and {b.chamber} plates would be {web:.3g} mm")
    yield from thin("the pins for tubes", sizes.tube_hole, "tube_mm")
    if sizes.tube_hole > min(float(hole.bore.min()) for hole in shape.holes):
        yield refuse(f"tubes of {2 * sizes.tube_hole:g} mm are wider than the bores", "tube_mm")
    narrow = [hole.chamber for hole in shape.holes if waist(hole) > _ROUND_OFF]
    if sizes.method == "pin" and narrow:
        yield refuse(f"the pin of chamber {narrow[0]} could not be drawn: it is wider below a narrower place", "core")
    low, high = sizes.key_room
    if sizes.method == "three-part" and low > high + _ROUND_OFF:
        yield refuse(f"the sides of three-part cores would be less than {least:g} mm thick: use core = 'pin'", "core")


def _bed(sizes: Sizes) -> Iterator[InputError]:
    height = sizes.top_end + sizes.foot + (PULL if sizes.method == "three-part" else 0.0)
    largest = max(sizes.settings.bed_mm)
    if height > largest:
        yield refuse(f"cores {height:.4g} mm long do not fit a bed of {largest:g} mm: shorter segments", "bed_mm")
