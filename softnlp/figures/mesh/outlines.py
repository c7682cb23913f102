"""Outlines of a section of any form at a stretch: what figures and solids draw of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softnlp.base.arrays import Array
from softnlp.model.outlined import Area, OutlinedRobot
from softnlp.model.plane import corners_of
from softnlp.model.section import SectionRadii


class Ringed(NamedTuple):
    """An area by its outline (n, 2) and, of an annulus, the one inside it [m]."""

    outer: Array
    inner: Array | None


class Drawn(NamedTuple):
    """A section as it is drawn, in the body frame [m]. threads : without those of a body that is wound as a whole."""

    surface: Array
    lumen: Array | None
    bores: list[Ringed]
    threads: list[Ringed]


def drawn_section(robot: OutlinedRobot, radii: SectionRadii, facets: int, *, threads: bool = True) -> Drawn:
    """Return a robot's section where its body has these radii.

    The surface and the places of chambers shrink by (S2); what a thread encloses stays, and its liner keeps its volume.
    A body that thread is wound around is drawn as cast. facets : sides of a whole circle.
    """
    shrink = float(np.ravel(radii.outer)[0]) / float(robot.outer_radius)
    step = 2 * np.pi / facets
    lumen = None if robot.lumen is None else corners_of(robot.lumen, facets) * shrink
    bores, around = list[Ringed](), list[Ringed]()
    for chamber, area in zip(robot.chamber_list, robot.held, strict=True):
        bore, centre = chamber.bore(step), np.array(area.outer.centre)
        liner = area.area - bore.area
        grown = ((area.area - liner * shrink**2) / bore.area) ** 0.5 if robot.reinforcement == "chamber" else 1.0
        bores.append(_placed(bore, centre, shrink * centre, grown, facets))
        if threads and robot.reinforcement == "chamber":
            around.append(_placed(chamber.threaded(step), centre, shrink * centre, 1.0, facets))
    return Drawn(corners_of(robot.surface, facets) * shrink, lumen, bores, around)


def _placed(area: Area, centre: Array, to: Array, grown: float, facets: int) -> Ringed:
    """Return an area whose centre has moved and whose size has grown."""
    outer = to + grown * (corners_of(area.outer, facets) - centre)
    return Ringed(outer, None if area.inner is None else to + (corners_of(area.inner, facets) - centre) / grown)


def along_outline(outline: Array, count: int) -> Array:
    """Return (count, 2) points at equal distances along a closed outline."""
    closed = np.vstack([outline, outline[:1]])
    far = np.append(0.0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T)))
    at = np.arange(count) / count * far[-1]
    return np.column_stack([np.interp(at, far, closed[:, k]) for k in (0, 1)])
