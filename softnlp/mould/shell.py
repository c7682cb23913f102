"""The outer shell: parts around the body that meet in planes through its axis, with flanges, screws, pins and a gate.

Each part has a flat back on which it is printed, and no face that overhangs by more than 45 degrees but for the seats
of screws. In each parting plane one part has register pins, the other their holes.
"""

from __future__ import annotations

from math import cos, degrees, pi, radians, sin, tan
from typing import TYPE_CHECKING

import numpy as np

from softnlp.base.arrays import Array
from softnlp.figures.mesh.rings import circle
from softnlp.mould.parts import Part
from softnlp.mould.sizes import LIP, LUER, SEAT, Sizes
from softnlp.mould.solids import FINE, along_x, along_y, cylinder, hull, loft, prism, turned, without

if TYPE_CHECKING:
    from manifold3d import Manifold

PIN_RADIUS, PIN_HEIGHT, PIN_DEPTH = 2.0, 2.5, 2.8  # of register pins, and of their holes [mm]
_LEAD = {2: 8.0, 3: 32.0}  # draft of register pins at least: one part of three leaves at 30 degrees to them [deg]
_APART = 30.0


def body(sizes: Sizes) -> Manifold:
    """Return what the shell is the outside of."""
    return loft(sizes.shape.z, sizes.shape.outer, sides=FINE)


def backs(sizes: Sizes) -> list[float]:
    """Return the direction of the middle of each part [rad]; the gate is between the last and the first."""
    n = sizes.settings.shell_parts
    return [sizes.lead + pi / n + 2 * pi * k / n for k in range(n)]


def back_depth(sizes: Sizes) -> float:
    """Return how far the flat backs are from the axis."""
    return -float(_corners(sizes)[:, 1].min())


def _corners(sizes: Sizes) -> Array:
    """Return the corners of a part's section whose middle is at -y."""
    half, thick = pi / sizes.settings.shell_parts, sizes.settings.flange_thickness_mm
    R, F = sizes.tube, sizes.flange
    corners = [(0.0, 0.0)]
    for side in (-1, 1):
        u = (side * sin(half), -cos(half))
        inwards = (-side * cos(half), -sin(half))
        corners += [(F * u[0], F * u[1]), (F * u[0] + thick * inwards[0], F * u[1] + thick * inwards[1])]
    back = max(R, -min(y for _, y in corners))
    edge = max(x for x, y in corners)
    level = min(y for x, y in corners if x > 0)
    flat = max(edge - (back + level), R / 2)  # 45 degrees from the flange's edge to the back
    return np.array([*corners, (-flat, -back), (flat, -back)])


def gate_solid(sizes: Sizes, extra: float = 0.0) -> Manifold:
    """Return the channel of the gate, from within the body to beyond the flange. extra : on its radius."""
    R, F = float(sizes.shape.outer[0]), sizes.flange
    g, mouth = sizes.gate / 2, max(sizes.gate, LUER) / 2
    at = [R - 0.6 * sizes.wall, R + LIP, F - 6.0, F + 1.0]
    radius = [g, g, 0.94 * mouth if mouth > g else g, mouth]
    channel = along_x(at, [r + extra for r in radius], sizes.gate_height)
    return turned(channel, degrees(sizes.lead))


def rows(sizes: Sizes) -> tuple[list[float], list[float]]:
    """Return the heights of the screws and of the register pins in each parting plane."""
    L, low = sizes.shape.length, sizes.gate_height + max(sizes.gate, LUER) / 2 + sizes.settings.minimum_wall_mm
    first, last = low + sizes.hole + 0.2, L + SEAT - sizes.head - 2.0
    screws = [first, last] if last - first < 45 else [first, (first + last) / 2, last]
    if last - first < 2 * (sizes.hole + 1.0):
        screws = [last]
    pins = [first + (last - first) * part for part in ((1 / 3, 2 / 3) if len(screws) == 2 else (1 / 4, 3 / 4))]
    if last - first < 4 * sizes.hole + 8 * PIN_RADIUS:  # short bodies
        pins = [(first + last) / 2] if last - first > 2 * (sizes.hole + PIN_RADIUS + 1.0) else []
    return screws, pins


def _pin(sizes: Sizes, z: float, play: float) -> Manifold:
    """Return a register pin, or with play its hole, that stands out of a parting plane at angle 0."""
    draft = max(sizes.settings.draft_deg, _LEAD[sizes.settings.shell_parts])
    height = PIN_HEIGHT if play == 0 else PIN_DEPTH
    at = [-0.5 if play == 0 else -0.1, 0.0, height]
    r = [PIN_RADIUS + play, PIN_RADIUS + play, PIN_RADIUS + play - height * tan(radians(draft))]
    return along_y(at, r, sizes.screw_line, z)


def shell(sizes: Sizes) -> list[Part]:
    """Return the parts of the shell, around z from the gate."""
    L, settings, c = sizes.shape.length, sizes.settings, sizes.settings.clearance_mm
    low, high = -SEAT, L + SEAT
    n = settings.shell_parts
    block = prism(hull([_corners(sizes)]), low, high)
    outer = sizes.shape.outer
    inside = [
        loft([-1.0, *sizes.shape.z, L + 1.0], [outer[0], *outer, outer[-1]], sides=FINE),
        cylinder(sizes.boss(0) + c, low - 1.0, 0.0, sides=FINE),
        cylinder(sizes.boss(-1) + c, L, high + 1.0, sides=FINE),
        gate_solid(sizes),
    ]
    screws, pins = rows(sizes)
    thick, reach = settings.flange_thickness_mm, 4 * sizes.flange
    holes: list[Manifold] = []
    for z in screws:
        holes.append(along_y([-reach, reach], [sizes.hole] * 2, sizes.screw_line, z))
        for side in (-1, 1):
            ends = sorted([side * thick, side * reach])
            holes.append(along_y(ends, [sizes.head] * 2, sizes.screw_line, z))
    planes = [degrees(sizes.lead) + 360.0 * k / n for k in range(n)]
    inside += [turned(hole, plane) for hole in holes for plane in planes]
    parts = []
    for k, back in enumerate(backs(sizes)):
        made = without(turned(block, degrees(back) + 90.0), inside)
        own, other = planes[k] + 360.0 / n, planes[k]
        for z in pins:
            made = made + turned(_pin(sizes, z, 0.0), own)
            made = made - turned(_pin(sizes, z, max(c, 0.05)), other)
        towards = (cos(back), sin(back), 0.0)
        apart = (_APART * towards[0], _APART * towards[1], 0.0)
        parts.append(Part(f"shell-{k + 1}", "shell", made, down=towards, apart=apart))
    return parts


def plate_outline(sizes: Sizes, end: int) -> tuple[list[Array], list[tuple[float, float]]]:
    """Return the outlines whose hull is a plate's rim, and the places of the tie rods beside the shell."""
    far = back_depth(sizes) + sizes.hole + 0.5
    ties = [(far * cos(back), far * sin(back)) for back in backs(sizes)]
    rims = [np.array(tie) + (sizes.hole + 3.0) * circle(48) for tie in ties]
    return [*rims, (sizes.boss(end) + 2.0) * circle(FINE)], ties
