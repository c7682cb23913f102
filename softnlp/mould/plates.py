"""Base and top plates: they close the body's ends and hold rods and cores at both ends, in either step.

Shoulders of cores bear flat on a plate and close the socket's play. Second rods have none: at the silicone their hole
is as wide as they are, to be reamed. They are pushed into silicone, which leaves their sockets by a hole below.
Plates are printed with the face to the silicone upwards.
"""

from __future__ import annotations

from math import degrees, pi
from typing import TYPE_CHECKING

from softnlp.mould.cores import Core, lean
from softnlp.mould.parts import Part
from softnlp.mould.shape import Shape
from softnlp.mould.shell import plate_outline
from softnlp.mould.sizes import CHANNEL, GAP, LAND, LIP, SEAT, Sizes
from softnlp.mould.solids import FINE, MIDDLE, box, cylinder, hull, loft, prism, turned, union, without

if TYPE_CHECKING:
    from manifold3d import Manifold

VENT_DEPTH, NOTCH, RISER = 0.4, 2.0, 1.1  # of vents; width of the notches beside the channel, radius of their holes
WEEP = 0.6  # radius of the hole below a second rod, half the rod's where that is less [mm]
_MOST_VENTS, _APART = 6, 25.0


def vent_angles(shape: Shape) -> list[float]:
    """Return where the top plates have vents [rad]: between chambers, or around where there is one chamber."""
    gaps = shape.gaps()[:_MOST_VENTS]
    return gaps if len(gaps) > 2 else [gaps[0] + 2 * pi * k / 3 for k in range(3)]


def plates(sizes: Sizes, cores: list[Core]) -> dict[str, Part]:
    """Return the four plates by name: base-1 and top-1 of the first step, base-2 and top-2 of the second."""
    L, depth, c = sizes.shape.length, sizes.socket, sizes.settings.clearance_mm
    low, high = L, L + sizes.stand + 1.0
    lumen = [
        cylinder(sizes.lumen_spigot(0) + c, -depth, 1.0, sides=FINE),
        cylinder(sizes.lumen_spigot(-1) + c, low - 1.0, high, sides=FINE),
    ]
    sockets: tuple[list[Manifold], ...] = ([], [], [], [])
    for core in cores:
        hole = core.hole
        x, top = float(hole.circle[0]), float(hole.circle[-1])
        fitting = float(hole.bore[0]), float(hole.bore[-1])
        leant = lean(sizes, hole)
        first = loft([-depth, 1.0], [sizes.spigot(hole, 0) + c] * 2, [x - depth * leant, x + leant], MIDDLE)
        second = cylinder(sizes.spigot(hole, -1) + c, low - 1.0, high, top, sides=MIDDLE)
        below = [-depth, -LAND, -LAND, 0.0, 1.0]
        leaning = [x + leant * z for z in below]
        weep = cylinder(min(WEEP, fitting[0] / 2), -sizes.stand - 1.0, 1.0 - depth, x - depth * leant)
        rod = loft(below, [fitting[0] + c] * 2 + [fitting[0]] * 3, leaning, MIDDLE) + weep
        over = low + CHANNEL + LAND
        guide = loft([low - 1.0, over, over, high], [fitting[1]] * 2 + [fitting[1] + c] * 2, top, MIDDLE)
        for kind, one in zip(sockets, (first, second, rod, guide), strict=True):
            kind += [turned(one, turn) for turn in core.turns]
    base, top_plate = _blank(sizes, 0), _blank(sizes, -1)
    made = {
        "base-1": without(base, [lumen[0], *sockets[0]]),
        "top-1": without(top_plate, [lumen[1], *sockets[1], vents(sizes)]),
        "base-2": without(base, [lumen[0], *sockets[2]]),
        "top-2": without(top_plate, [lumen[1], *sockets[3], channel(sizes)]),
    }
    found = {}
    for name, solid in made.items():
        up = 1.0 if name.startswith("top") else -1.0
        apart = (0.0, 0.0, up * _APART if up < 0 else 0.75 * sizes.shape.length)
        found[name] = Part(name, "plate", solid, down=(0.0, 0.0, up), apart=apart)
    return found


def _blank(sizes: Sizes, end: int) -> Manifold:
    """Return a plate without sockets: a rim with holes for tie rods, and a boss that fits the shell."""
    outlines, ties = plate_outline(sizes, end)
    L, r = sizes.shape.length, sizes.boss(end)
    rim, boss = (-sizes.stand, -SEAT - GAP), (-SEAT - GAP - 0.5, 0.0)
    if end == -1:
        rim, boss = (L - rim[1], L - rim[0]), (L - boss[1], L - boss[0])
    low, high = rim
    holes = [cylinder(sizes.hole, low - 1.0, high + 1.0, x, y) for x, y in ties]
    return without(prism(hull(outlines), low, high), holes) + cylinder(r, *boss, sides=FINE)


def vents(sizes: Sizes, extra: float = 0.0) -> Manifold:
    """Return the vents of the first top plate: shallow grooves at the body's edge that end in holes.

    extra : by which they are larger all around.
    """
    R, L, w = float(sizes.shape.outer[-1]), sizes.shape.length, sizes.settings.vent_mm
    near = [float(h.circle[-1]) + sizes.spigot(h, -1) + sizes.settings.clearance_mm for h in sizes.shape.holes]
    start = max(R - w, min(R - 0.3, max(near) + sizes.settings.minimum_wall_mm))
    r = min(max(w / 2, 0.5), LIP / 2 - sizes.settings.minimum_wall_mm)
    half = w / 2 + extra
    groove = box((start - extra, R + LIP / 2), (-half, half), (L - 1.0, L + VENT_DEPTH + extra))
    one = groove + cylinder(r + extra, L - 1.0, L + sizes.stand + 1.0, R + LIP / 2)
    return union([turned(one, degrees(angle)) for angle in vent_angles(sizes.shape)])


def channel(sizes: Sizes, extra: float = 0.0) -> Manifold:
    """Return the ring above the liners, and holes through which it is filled and the air leaves.

    extra : by which they are larger all around.
    """
    R, L = float(sizes.shape.outer[-1]), sizes.shape.length
    least, c = sizes.settings.minimum_wall_mm, sizes.settings.clearance_mm
    inner = min(float(h.circle[-1] - h.core[-1]) for h in sizes.shape.holes)
    inner = max(inner, sizes.lumen_spigot(-1) + c + least)
    outer = min(max(float(h.circle[-1] + h.core[-1]) for h in sizes.shape.holes), R - 0.1)
    top = L + CHANNEL + extra
    ring = cylinder(outer + extra, L - 1.0, top, sides=FINE) - cylinder(inner - extra, L - 2.0, top + 1.0, sides=FINE)
    middle, half = (inner + outer) / 2, NOTCH / 2 + extra
    notch = box((middle, R + LIP / 2), (-half, half), (L - 1.0, top))
    riser = cylinder(RISER + extra, L - 1.0, L + sizes.stand + 1.0, R + LIP / 2)
    every = sorted(vent_angles(sizes.shape))
    angles = every[:: max(len(every) // 3, 1)][:3]
    return union([ring, *(turned(notch + riser, degrees(angle)) for angle in angles)])


def above(sizes: Sizes, cut: Manifold) -> Manifold:
    """Return what of vents or channel is above the body's end and in the plate: the silicone to cut off."""
    reach, L = 2 * sizes.flange, sizes.shape.length
    return cut ^ box((-reach, reach), (-reach, reach), (L, L + sizes.stand))


def tie_places(sizes: Sizes) -> list[tuple[float, float]]:
    """Return the places of the tie rods."""
    return plate_outline(sizes, 0)[1]
