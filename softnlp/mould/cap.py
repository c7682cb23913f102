"""Moulds of the end caps, and the connectors between segments.

A cap is cast in a cup whose rim guides the body: its end stands on the silicone that is not yet cured.
"""

from __future__ import annotations

from math import degrees, pi
from typing import TYPE_CHECKING

import numpy as np

from softnlp.mould.parts import Part
from softnlp.mould.shape import Shape
from softnlp.mould.sizes import Sizes, refuse
from softnlp.mould.solids import FINE, MIDDLE, box, cylinder, loft, turned, union, without

if TYPE_CHECKING:
    from manifold3d import Manifold

FLOOR, GUIDE, PLUG = 3.0, 10.0, 4.0  # of the cup; how far it guides the body, and its pins stand in the body [mm]


def cup(sizes: Sizes, end: str) -> Part:
    """Return the mould of the cap at "base" or "tip"; the cap is from z = -cap to 0, where the body begins.

    It is a cup with a pin for the lumen; at the base it has one for each chamber's tube too.
    """
    settings = sizes.settings
    k = end_index(sizes.shape, end)
    R, r = float(sizes.shape.outer[k]), float(sizes.shape.lumen[k])
    low = -settings.cap_mm
    outside = cylinder(R + max(3.0, settings.minimum_wall_mm), low - FLOOR, GUIDE, sides=FINE)
    made = outside - cylinder(R, low, GUIDE + 1.0, sides=FINE)
    pins = [cylinder(r, low - FLOOR / 2, PLUG, sides=FINE)]
    if end == "base":
        pins += tubes(sizes, low - FLOOR / 2)
    return Part(f"cap-{end}", "cap", union([made, *pins]))


def tubes(sizes: Sizes, low: float) -> list[Manifold]:
    """Return the pins that leave holes for tubes, as seen with the base downwards."""
    k, r = end_index(sizes.shape, "base"), sizes.tube_hole
    way = -1.0 if sizes.shape.flipped else 1.0
    return [
        turned(cylinder(r, low, PLUG, float(hole.circle[k]), sides=MIDDLE), way * hole.degrees)
        for hole in sizes.shape.holes
    ]


def end_index(shape: Shape, end: str) -> int:
    """Return which end of a shape, 0 or -1, is its base or its tip."""
    return -1 if (end == "tip") != shape.flipped else 0


def cap_volume(sizes: Sizes, end: str) -> float:
    """Return the exact volume of a cap [mm^3]."""
    k = end_index(sizes.shape, end)
    section = float(sizes.shape.outer[k] ** 2 - sizes.shape.lumen[k] ** 2)
    if end == "base":
        section -= len(sizes.shape.holes) * sizes.tube_hole**2
    return pi * section * sizes.settings.cap_mm


def finished(sizes: Sizes, end: str) -> Manifold:
    """Return the finished body's end as it stands in the cup, with lumen and bores, GUIDE long."""
    shape = sizes.shape
    k = end_index(shape, end)
    height = GUIDE + 5.0
    way = -1.0 if (end == "base") == shape.flipped else 1.0
    bores = [
        turned(loft([-1.0, height + 1.0], [float(h.bore[k])] * 2, float(h.circle[k])), way * h.degrees)
        for h in shape.holes
    ]
    whole = cylinder(float(shape.outer[k]), 0.0, height, sides=FINE)
    return without(whole, [cylinder(float(shape.lumen[k]), -1.0, height + 1.0, sides=FINE), *bores])


def connector(lower: Sizes, upper: Sizes, length: float, turn: float, number: int, bonded: bool) -> tuple[Part, str]:
    """Return the rigid piece between two segments, and what to know of it.

    length : of it [mm]. turn : of the upper segment's axes against the lower's [rad]. number : of the lower one.
    bonded : whether lines come up through the lower segment.

    It has the lumen, and a hole for a tube to each chamber of the upper segment; where those cannot come up through
    the lower segment as bonded lines, slots on its lower face lead them to the lumen, where there is room.
    """
    least = lower.settings.minimum_wall_mm
    if length < least:
        raise refuse(f"connector {number} is {length:.3g} mm thick, less than minimum_wall_mm = {least:g}")
    a, b = end_index(lower.shape, "tip"), end_index(upper.shape, "base")
    R, Q = float(lower.shape.outer[a]), float(upper.shape.outer[b])
    r = min(float(lower.shape.lumen[a]), float(upper.shape.lumen[b]))
    made = loft([0.0, length], [R, Q], sides=FINE) - cylinder(r, -1.0, length + 1.0, sides=FINE)
    way = -1.0 if upper.shape.flipped else 1.0
    w, places = upper.tube_hole, list[tuple[float, float]]()
    for hole in upper.shape.holes:
        places.append((float(hole.circle[b]), degrees(way * hole.angle + turn)))
    made = without(made, [turned(cylinder(w, -1.0, length + 1.0, x), angle) for x, angle in places])
    if bonded:
        return Part(f"connector-{number}", "connector", made), ""
    turns = np.sort(np.array([angle % 360.0 for _, angle in places]))
    steps = np.diff([*turns, turns[0] + 360.0]) if len(turns) > 1 else np.array([180.0])
    web = 2 * r * np.sin(np.radians(min(float(steps.min()), 180.0)) / 2) - 2 * w
    if web < least or length < 2 * w + least:
        note = f"connector {number}: no room for slots; lead the tubes of segment {number + 1} outside"
        return Part(f"connector-{number}", "connector", made), note
    slots = [turned(box((0.0, x), (-w, w), (-1.0, 2 * w)), angle) for x, angle in places]
    return Part(f"connector-{number}", "connector", without(made, slots)), ""
