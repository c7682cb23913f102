"""Lumen rod, chamber cores with the thread's groove, and the second rods that form the liners.

A core of three parts is a key between two sides: drawn out, the key leaves room for the sides to move in, off the
thread, and to be drawn as well. A pin is turned out of its thread, or drawn straight where it has no groove.
Cores are made at angle 0, with their middle on x, and turned to their chambers.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, degrees, sin
from typing import TYPE_CHECKING

import numpy as np

from softnlp.base.arrays import Array
from softnlp.mould.parts import Part
from softnlp.mould.shape import Hole
from softnlp.mould.sizes import GRIP, KEY_DRAFT, PULL, Sizes
from softnlp.mould.solids import FINE, MIDDLE, box, helix, loft, swept

if TYPE_CHECKING:
    from manifold3d import Manifold

_RAMP = 0.5  # from the ground of a pin's groove to its full thickness: a step would leave a thin edge [mm]
_APART = 1.6  # of the body's length, by which cores are drawn out of it in pictures


@dataclass(frozen=True, eq=False)
class Core:
    """What forms the chambers that are alike. chambers : their numbers from 1. turns : their angles [deg].

    parts : first step; rod : second step; thread : of the first chamber, as it is wound.
    """

    hole: Hole
    chambers: tuple[int, ...]
    turns: tuple[float, ...]
    parts: tuple[Part, ...]
    rod: Part
    thread: Manifold


def axis_of(sizes: Sizes, hole: Hole) -> Array:
    """Return the unit vector along which a core at angle 0 is drawn."""
    way = np.array([float(hole.circle[-1] - hole.circle[0]), 0.0, sizes.shape.length])
    along: Array = way / np.linalg.norm(way)
    return along


def lean(sizes: Sizes, hole: Hole) -> float:
    """Return how far a chamber moves outwards for a rise of 1; its core leans on below the body, not above."""
    return float(hole.circle[-1] - hole.circle[0]) / sizes.shape.length


def lumen_rod(sizes: Sizes) -> Part:
    """Return the rod of the lumen, with shoulders that bear on the plates."""
    shape = sizes.shape
    low, high = sizes.lumen_spigot(0), sizes.lumen_spigot(-1)
    z = [-sizes.foot, 0.0, *shape.z, shape.length, sizes.top_end]
    made = loft(z, [low, low, *shape.lumen, high, high], sides=FINE)
    return Part("lumen-rod", "rod", made, apart=(0.0, 0.0, _APART * shape.length))


def core_of(sizes: Sizes, holes: list[Hole], tag: str) -> Core:
    """Return the core of chambers that are alike. tag : what tells it from others, "" of the only one."""
    hole = holes[0]
    turns = tuple(one.degrees for one in holes)
    profile = _thread_profile(sizes)
    thread = _wound(sizes, hole, profile)
    whole = _loft(sizes, hole, 0.0, sizes.top_end)
    groove = None
    if sizes.depth > 0:
        out = 2.0 * sizes.settings.thread_diameter_mm
        inner = profile[profile[:, 0] < 0]
        side = float(inner[:, 1].max())
        groove = _wound(sizes, hole, np.concatenate([[(out, -side), (out, side)], inner]))
    if sizes.method == "pin":
        grip = _grip(sizes, hole)
        solid = (whole if groove is None else whole - groove) - grip
        parts = [Part(f"core-pin{tag}", "core", solid, turns, apart=(0.0, 0.0, _APART * sizes.shape.length))]
    else:
        parts = _three(sizes, hole, whole, groove, turns, tag)
    chambers = tuple(one.chamber for one in holes)
    return Core(hole, chambers, turns, tuple(parts), _second_rod(sizes, hole, turns, tag), thread)


def _thread_profile(sizes: Sizes) -> Array:
    """Return the thread's section as a hexagon with a corner to the core's axis, outwards and along z."""
    angle = np.pi / 3 * np.arange(6)
    profile: Array = sizes.settings.thread_diameter_mm / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    return profile


def _wound(sizes: Sizes, hole: Hole, profile: Array) -> Manifold:
    """Return a profile along the thread's helix."""
    z = sizes.shape.z

    def radius(at: Array) -> Array:
        found: Array = np.interp(at, z, hole.core)
        return found

    def centre(at: Array) -> Array:
        found: Array = np.interp(at, z, hole.circle)
        return found

    return helix(profile, sizes.thread_ends, sizes.settings.thread_pitch_mm, radius, centre)


def _loft(sizes: Sizes, hole: Hole, less: float, top: float) -> Manifold:
    """Return a core without groove. less : by how much it is thinner between the plates. top : where it ends.

    A thinner one is a key, which is everywhere a little wider above.
    """
    shape = sizes.shape
    low, high = sizes.spigot(hole, 0), sizes.spigot(hole, -1)
    core = hole.core if less == 0 else np.minimum.accumulate(hole.core[::-1])[::-1]
    tapered = KEY_DRAFT * (1 - shape.z / shape.length) if less > 0 else 0.0
    z, r, x = [*shape.z], [*(core + sizes.inset - less - tapered)], [*hole.circle]
    if sizes.method == "pin" and sizes.depth > 0:  # nothing below the groove may be thicker than its ground
        start = sizes.thread_ends[0] + sizes.settings.thread_diameter_mm / 2 + sizes.smooth
        ground = r[0] - sizes.depth - sizes.smooth
        z, r, x = [0.0, start, start + _RAMP, *z[1:]], [ground, ground, r[0], *r[1:]], [x[0]] * 3 + x[1:]
    z = [-sizes.foot, 0.0, *z, shape.length, top]
    r = [low, low, *r, high, high]
    x = [hole.circle[0] + z[0] * lean(sizes, hole), hole.circle[0], *x, *[hole.circle[-1]] * 2]
    return loft(z, r, x, MIDDLE)


def _grip(sizes: Sizes, hole: Hole) -> Manifold:
    """Return what is cut off a pin above the plate, so that two flats are left to turn it by."""
    r, x = sizes.spigot(hole, -1), float(hole.circle[-1])
    half = max(0.7 * r, sizes.settings.minimum_wall_mm / 2)
    heights = (sizes.top_end - GRIP + 2.0, sizes.top_end + 1.0)
    return box((x - 2 * r, x + 2 * r), (half, half + r), heights) + box(
        (x - 2 * r, x + 2 * r), (-half - r, -half), heights
    )


def _three(
    sizes: Sizes, hole: Hole, whole: Manifold, groove: Manifold | None, turns: tuple[float, ...], tag: str
) -> list[Part]:
    """Return key and sides of a core, cut by two planes that stand on the radius through it."""
    shape, top = sizes.shape, sizes.top_end + PULL
    low, high = sizes.key_width
    bottom = -sizes.foot
    reach = 4 * float(hole.core.max())
    rings = []
    for z in (bottom, 0.0, shape.length, top):
        half = (low + (high - low) * (z - bottom) / (top - bottom)) / 2
        x = float(np.interp(z, shape.z, hole.circle)) + min(z, 0.0) * lean(sizes, hole)
        rings.append([(x - reach, -half, z), (x + reach, -half, z), (x + reach, half, z), (x - reach, half, z)])
    slab = swept(np.array(rings))
    key = _loft(sizes, hole, sizes.depth + sizes.smooth, top) ^ slab
    grooved = whole if groove is None else whole - groove
    sides = sorted((grooved - slab).decompose(), key=lambda one: one.bounding_box()[4])
    draft = atan2((high - low) / 2, top - bottom)
    L = shape.length
    made = [Part(f"core-key{tag}", "key", key, turns, (0.0, -cos(draft), -sin(draft)), (0.0, 0.0, 2 * _APART * L))]
    for name, side, way in (("a", sides[0], 1.0), ("b", sides[-1], -1.0)):
        flat = (0.0, way * cos(draft), sin(draft))
        made.append(Part(f"core-side-{name}{tag}", "core", side, turns, flat, (0.0, -3.0 * way, _APART * L)))
    return made


def _second_rod(sizes: Sizes, hole: Hole, turns: tuple[float, ...], tag: str) -> Part:
    """Return the rod that forms the bore in the second step, of one thickness beyond the body's ends."""
    shape = sizes.shape
    z = [-sizes.socket, *shape.z, sizes.top_end]
    r = [hole.bore[0], *hole.bore, hole.bore[-1]]
    x = [hole.circle[0] + z[0] * lean(sizes, hole), *hole.circle, hole.circle[-1]]
    made = loft(z, r, x, MIDDLE)
    return Part(f"liner-rod{tag}", "rod", made, turns, apart=(0.0, 0.0, _APART * shape.length))


def moved_in(sizes: Sizes, part: Part) -> tuple[float, float, float]:
    """Return how a side of a core moves off its thread once the key is out; nothing for other parts."""
    if not part.name.startswith("core-side"):
        return (0.0, 0.0, 0.0)
    return (0.0, (1.0 if part.apart[1] < 0 else -1.0) * sizes.key_width[0] / 2, 0.0)


def screw_angle(sizes: Sizes, drawn: float) -> float:
    """Return by how much a grooved pin turns while it is drawn so far [deg]."""
    return degrees(2 * np.pi * drawn / sizes.settings.thread_pitch_mm)
