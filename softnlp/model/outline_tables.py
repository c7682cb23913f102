"""Robots of any section as the tables [robot], [[chamber]] and [body] of a file, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from softnlp.base.units import DEGREE, MILLIMETRE, tidy
from softnlp.model.outlined import Annulus, Chamber, Form, OutlinedRobot, Sector, Semicircle, outlined_robot
from softnlp.model.plane import Circle, Polygon


def outline_tables(robot: OutlinedRobot) -> dict[str, Any]:
    """Return a robot of any section as the tables `[robot]`, `[[chamber]]` and `[body]` of a scenario."""
    mm, deg = MILLIMETRE, DEGREE
    table: dict[str, Any] = {"name": robot.name, "length_mm": tidy(robot.length, mm)}
    if robot.lumen is not None:
        table["lumen_diameter_mm"] = tidy(robot.lumen_diameter, mm)
    body: dict[str, Any] = {"outline": "circle", "reinforcement": robot.reinforcement}
    if isinstance(robot.surface, Circle):
        table["outer_diameter_mm"] = tidy(robot.outer_diameter, mm)
    else:
        body["outline"] = _corners_table(robot.surface)
    chambers = []
    for chamber in robot.chamber_list:
        form, wall = chamber.form, {"wall_mm": tidy(chamber.wall, mm)}
        own: dict[str, Any]
        if isinstance(form, Circle):
            own = {"x_mm": tidy(form.x, mm), "y_mm": tidy(form.y, mm), "bore_mm": tidy(2 * form.radius, mm)}
        elif isinstance(form, Polygon):
            own = _corners_table(form)
        else:
            keys = next(keys for made, keys in _FORM_KEYS.items() if isinstance(form, made))
            own = {key: tidy(value, deg if key.endswith("_deg") else mm) for key, value in zip(keys, form, strict=True)}
        chambers.append({"set": chamber.set + 1, type(form).__name__.lower(): {**own, **wall}})
    return {"robot": table, "chamber": chambers, "body": body}


_FORM_KEYS: Mapping[type[Sector] | type[Semicircle] | type[Annulus], tuple[str, ...]] = {
    Sector: ("inner_mm", "outer_mm", "from_deg", "to_deg"),
    Semicircle: ("radius_mm", "x_mm", "turn_deg"),
    Annulus: ("inner_mm", "outer_mm"),
}


def _corners_table(polygon: Polygon) -> dict[str, list[float]]:
    x, y = zip(*polygon.corners, strict=True)
    return {"x_mm": [tidy(v, MILLIMETRE) for v in x], "y_mm": [tidy(v, MILLIMETRE) for v in y]}


def robot_of_outlines(tables: Mapping[str, Any]) -> OutlinedRobot:
    """Return the robot of `outline_tables`; KeyError where a number is missing."""
    mm, table, body = MILLIMETRE, tables["robot"], tables["body"]
    chambers = []
    for one in tables["chamber"]:
        (kind,) = set(one) - {"set"}
        own = one[kind]
        form: Form
        if kind == "circle":
            form = Circle(own["x_mm"] * mm, own["y_mm"] * mm, own["bore_mm"] * mm / 2)
        elif kind == "polygon":
            form = _polygon_of(own)
        else:
            made, keys = next((made, keys) for made, keys in _FORM_KEYS.items() if made.__name__.lower() == kind)
            form = made(*(own[key] * (DEGREE if key.endswith("_deg") else mm) for key in keys))
        chambers.append(Chamber(int(one["set"]) - 1, form, own["wall_mm"] * mm))
    round_body = body["outline"] == "circle"
    return outlined_robot(
        str(table["name"]),
        chambers,
        float(table["length_mm"]) * mm,
        outer_diameter=float(table["outer_diameter_mm"]) * mm if round_body else None,
        surface=None if round_body else _polygon_of(body["outline"]),
        lumen_diameter=float(table.get("lumen_diameter_mm", 0.0)) * mm,
        reinforcement=body["reinforcement"],
    )


def _polygon_of(table: Mapping[str, Any]) -> Polygon:
    return Polygon(tuple((x * MILLIMETRE, y * MILLIMETRE) for x, y in zip(table["x_mm"], table["y_mm"], strict=True)))
