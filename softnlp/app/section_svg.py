"""The cross-section of a robot as an SVG drawing that follows the page's colours."""

from __future__ import annotations

from collections.abc import Collection
from html import escape
from math import cos, floor, log10, sin

from softnlp.base.units import MILLIMETRE
from softnlp.figures.section import stretched_radii
from softnlp.figures.style import colour, ink_on
from softnlp.model.robot import Robot

WIDTH, HEIGHT = 316.0, 258.0
"""Of the drawing [px]."""
ALERT = "#E5383B"
"""Of a chamber that breaks a rule: reads on light and dark."""
_CENTRE = (WIDTH / 2, 118.0)
_EXTENT = 98.0  # what of the robot reaches farthest out [px]
_SMALLEST_NUMBER = 5.0  # radius of a bore with room for its number [px]
_MOST_IN_KEY = 6  # sets that the key has room for


def section_svg(robot: Robot, broken: Collection[int] = (), stretch: float = 1.0) -> str:
    """Return the section at a stretch, to scale; text and lines have the colour of the text around it.

    broken : chambers (from 0) with a red ring. Where the section is stretched, the undeformed body is a dotted outline.

    Raises
    ------
    InputError
        When the bores are closed at this stretch.
    """
    radii = stretched_radii(robot, stretch)
    made = stretched_radii(robot, 1.0)
    farthest = max(made.outer, made.chamber_circle + made.chamber, radii.outer, radii.chamber_circle + radii.chamber)
    scale = _EXTENT / farthest
    outer, lumen, circle, thread, bore = (
        r * scale for r in (radii.outer, radii.lumen, radii.chamber_circle, radii.chamber, radii.bore)
    )
    x_0, y_0 = _CENTRE
    parts = [
        f'<path d="{_round(x_0, y_0, outer)} {_round(x_0, y_0, lumen)}" fill="currentColor" fill-opacity="0.09" '
        'fill-rule="evenodd" stroke="currentColor" stroke-width="1.2"/>',
        f'<circle cx="{_n(x_0)}" cy="{_n(y_0)}" r="{_n(circle)}" fill="none" stroke="currentColor" '
        'stroke-opacity="0.45" stroke-width="0.7" stroke-dasharray="8 3 2 3"/>',
    ]
    if stretch != 1.0:
        parts.append(
            f'<circle cx="{_n(x_0)}" cy="{_n(y_0)}" r="{_n(made.outer * scale)}" fill="none" stroke="currentColor" '
            'stroke-opacity="0.6" stroke-width="0.9" stroke-dasharray="1.5 3"/>'
        )
    for n, (theta, chamber_set) in enumerate(zip(robot.chamber_angles(), robot.set_of_chamber, strict=True)):
        centre = (x_0 + circle * cos(theta), y_0 - circle * sin(theta))
        parts += _chamber(n, centre, thread, bore, colour(chamber_set), n in broken)
    parts += _axes(outer)
    parts += _measures(robot, radii.outer, scale, stretch)
    parts += _key(robot)
    words = f"Cross-section of {robot.name} with {robot.chambers} chambers, outer diameter {_mm(2 * radii.outer)}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_n(WIDTH)} {_n(HEIGHT)}" width="100%" role="img" '
        f'aria-label="{escape(words)}" font-family="Roboto, Helvetica, Arial, sans-serif" font-size="11">'
        f"{''.join(parts)}</svg>"
    )


def scale_bar(width: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is no longer than a third of a width."""
    third = width / 3
    power: float = 10.0 ** floor(log10(third))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= third * (1 + 1e-12))


def _chamber(n: int, centre: tuple[float, float], thread: float, bore: float, fill: str, broken: bool) -> list[str]:
    """Draw the reinforced wall, its thread, the bore and the chamber's number."""
    at = f'cx="{_n(centre[0])}" cy="{_n(centre[1])}"'
    parts = [
        f'<circle {at} r="{_n(thread)}" fill="{fill}" fill-opacity="0.3"/>',
        f'<circle class="thread" {at} r="{_n(thread)}" fill="none" stroke="currentColor" stroke-width="1" '
        'stroke-dasharray="2.4 1.6"/>',
        f'<circle class="bore" {at} r="{_n(bore)}" fill="{fill}"/>',
    ]
    if broken:
        parts.append(
            f'<circle class="broken" {at} r="{_n(thread + 1)}" fill="none" stroke="{ALERT}" stroke-width="2.4"/>'
        )
    if bore >= _SMALLEST_NUMBER:
        size = min(12.0, 1.1 * bore)
        parts.append(
            f'<text x="{_n(centre[0])}" y="{_n(centre[1] + 0.36 * size)}" font-size="{_n(size)}" font-weight="bold" '
            f'text-anchor="middle" fill="{ink_on(fill)}">{n + 1}</text>'
        )
    return parts


def _axes(outer: float) -> list[str]:
    """Draw the body axes outside the body: x to the right, y up."""
    x_0, y_0 = _CENTRE
    from_x, from_y, reach = x_0 + outer, y_0 - outer, 9.0
    return [
        f'<path d="M{_n(from_x)} {_n(y_0)}h{reach}m-4 -2.5l4 2.5l-4 2.5M{_n(x_0)} {_n(from_y)}v-{reach}'
        'm-2.5 4l2.5 -4l2.5 4" fill="none" stroke="currentColor" stroke-width="0.9"/>',
        f'<text x="{_n(from_x + reach + 4)}" y="{_n(y_0 + 3.5)}" fill="currentColor">x</text>',
        f'<text x="{_n(x_0 + 6)}" y="{_n(from_y - 3)}" fill="currentColor">y</text>',
    ]


def _measures(robot: Robot, outer: float, scale: float, stretch: float) -> list[str]:
    """Draw the outer diameter below the section and a bar of round length in the corner."""
    x_0, y = _CENTRE[0], _CENTRE[1] + _EXTENT + 14
    left, right = x_0 - outer * scale, x_0 + outer * scale
    letter, index = ("D", "r") if stretch == 1.0 else ("2r", "r")
    bar = scale_bar(2 * _EXTENT / scale / MILLIMETRE)
    length, low = bar * MILLIMETRE * scale, HEIGHT - 4
    return [
        f'<path d="M{_n(left)} {_n(y - 4)}v8M{_n(right)} {_n(y - 4)}v8M{_n(left)} {_n(y)}H{_n(right)}" fill="none" '
        'stroke="currentColor" stroke-width="0.8"/>',
        f'<text x="{_n(x_0)}" y="{_n(y + 14)}" text-anchor="middle" fill="currentColor">'
        f'{letter}<tspan font-size="8" dy="2">{index}</tspan><tspan dy="-2"> {_mm(2 * outer)}</tspan></text>',
        f'<path d="M4 {_n(low - 4)}v4H{_n(4 + length)}v-4" fill="none" stroke="currentColor" stroke-width="1.4"/>',
        f'<text x="4" y="{_n(low - 8)}" fill="currentColor">{bar:g} mm</text>',
    ]


def _key(robot: Robot) -> list[str]:
    """Name the sets by their colours, in the upper left corner."""
    if robot.chamber_sets > _MOST_IN_KEY:
        return []
    parts = []
    for k in range(robot.chamber_sets):
        y = 9.0 + 15 * k
        parts.append(
            f'<circle cx="8" cy="{_n(y)}" r="4.5" fill="{colour(k)}"/>'
            f'<text x="17" y="{_n(y + 3.8)}" fill="currentColor">set {k + 1}</text>'
        )
    return parts


def _round(x: float, y: float, r: float) -> str:
    """Return a circle as a path, so that one can be cut out of another."""
    return f"M{_n(x - r)} {_n(y)}a{_n(r)} {_n(r)} 0 1 0 {_n(2 * r)} 0a{_n(r)} {_n(r)} 0 1 0 {_n(-2 * r)} 0z"


def _n(value: float) -> str:
    return f"{round(value, 3):g}"


def _mm(length: float) -> str:
    return f"{length / MILLIMETRE:.4g} mm"
