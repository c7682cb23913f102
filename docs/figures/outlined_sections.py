"""Sections of other outlines than round chambers on a circle, and what thread does to each of them."""

from __future__ import annotations

from math import pi, radians

from softnlp.figures.outlined import draw_outlined
from softnlp.figures.style import in_own_style, new_figure
from softnlp.model.outlined import Annulus, Chamber, Sector, Semicircle, outlined_robot
from softnlp.model.plane import Circle, Polygon

mm = 1e-3
BOX = Polygon(((-9 * mm, -6 * mm), (9 * mm, -6 * mm), (9 * mm, 6 * mm), (-9 * mm, 6 * mm)))


def sections():
    """Return the drawn robots by title."""
    half = Chamber(0, Semicircle(7 * mm, 1 * mm, 0.0), 0.5 * mm)
    sectors = [
        Chamber(k, Sector(4.5 * mm, 8 * mm, radians(120 * k - 45), radians(120 * k + 45)), 0.5 * mm) for k in range(3)
    ]
    slots = [
        Chamber(k, Polygon(tuple((x + s * 4.4 * mm, y) for x, y in square)), 0.5 * mm)
        for k, s in enumerate((1, -1))
        for square in [[(-2.5 * mm, -3.5 * mm), (2.5 * mm, -3.5 * mm), (2.5 * mm, 3.5 * mm), (-2.5 * mm, 3.5 * mm)]]
    ]
    halves = [Chamber(k, Semicircle(7 * mm, 1 * mm, k * pi), 0.5 * mm) for k in (0, 1)]
    own = [Chamber(0, Circle(4 * mm, 0.0, 3 * mm), 0.6 * mm), Chamber(1, Circle(-5 * mm, 2 * mm, 1.5 * mm), 0.5 * mm)]
    ring = Chamber(0, Annulus(5 * mm, 8 * mm), 0.5 * mm)
    round_body = {"outer_diameter": 20 * mm}
    return {
        "semicircle": outlined_robot("", [half], 60 * mm, **round_body),
        "sectors": outlined_robot("", sectors, 60 * mm, **round_body, lumen_diameter=5 * mm),
        "annulus": outlined_robot("", [ring], 60 * mm, **round_body, lumen_diameter=6 * mm),
        "circles": outlined_robot("", own, 60 * mm, **round_body),
        "polygons": outlined_robot("", slots, 60 * mm, surface=BOX),
        "wound body": outlined_robot("", halves, 60 * mm, **round_body, reinforcement="body"),
    }


@in_own_style
def figure():
    """Draw them side by side."""
    found = sections()
    made = new_figure(9.6, 6.9, "Sections", "dashed: thread")
    for k, (title, robot) in enumerate(found.items()):
        column, row = k % 3, k // 3
        axes = made.add_axes((column / 3, 0.455 * (1 - row) + 0.01, 1 / 3, 0.44))
        draw_outlined(axes, robot, 1.0, title, set())
    return made
