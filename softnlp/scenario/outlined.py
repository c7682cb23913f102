"""[[chamber]] and [body]: chambers and bodies of any outline beside [robot], and the robot that they make."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Protocol

from pydantic import Field, PlainValidator, create_model, model_validator

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.units import MILLIMETRE
from softnlp.model.outline_tables import robot_of_outlines
from softnlp.model.outlined import Reinforcement
from softnlp.model.robot import ROBOTS, Robot, check
from softnlp.model.round_layout import as_round
from softnlp.scenario.schema import RobotTable, ScenarioFile
from softnlp.scenario.values import Count, NotNegative, Positive, Table, is_number, wrong
from softnlp.scenario.varying import Varying

MOST_CHAMBERS, MOST_CORNERS = 60, 200
_LAYOUT = (
    *("chamber_circle_diameter_mm", "chamber_diameter_mm", "chamber_wall_mm"),
    *("chamber_sets", "chambers_per_set", "chamber_angle_deg"),
)
_FORMS = ("circle", "sector", "semicircle", "annulus", "polygon")


class CircleTable(Table):
    """circle of a [[chamber]]: its centre, the diameter of its bore, and its wall."""

    x_mm: float
    y_mm: float
    bore_mm: Positive
    wall_mm: NotNegative = 0.0


class SectorTable(Table):
    """sector of a [[chamber]]: between two radii and two angles about the axis."""

    inner_mm: NotNegative
    outer_mm: Positive
    from_deg: float
    to_deg: float
    wall_mm: NotNegative = 0.0


class SemicircleTable(Table):
    """semicircle of a [[chamber]]: the half disc at x above x_mm, about that point, then turned about the axis."""

    radius_mm: Positive
    x_mm: float = 0.0
    turn_deg: float = 0.0
    wall_mm: NotNegative = 0.0


class AnnulusTable(Table):
    """annulus of a [[chamber]]: between two radii, all around the axis."""

    inner_mm: Positive
    outer_mm: Positive
    wall_mm: NotNegative = 0.0


Corners = Annotated[list[float], Field(min_length=3, max_length=MOST_CORNERS)]


class PolygonTable(Table):
    """polygon of a [[chamber]]: its corners once around."""

    x_mm: Corners
    y_mm: Corners
    wall_mm: NotNegative = 0.0

    @model_validator(mode="after")
    def _same(self) -> PolygonTable:
        _pairs(self.x_mm, self.y_mm)
        return self


class ChamberTable(Table):
    """[[chamber]]: one chamber, in place of the round layout of [robot].

    set : whose pressure it has, counted from 1; as in 1
    circle : round; as in { x_mm = 8.5, y_mm = 0.0, bore_mm = 4.5, wall_mm = 0.5 }
    sector : as in { inner_mm = 5.0, outer_mm = 8.0, from_deg = -45.0, to_deg = 45.0, wall_mm = 0.5 }
    semicircle : as in { radius_mm = 7.0, x_mm = 1.0, turn_deg = 0.0, wall_mm = 0.5 }
    annulus : as in { inner_mm = 5.0, outer_mm = 8.0, wall_mm = 0.5 }
    polygon : as in { x_mm = [5.0, 9.0, 9.0, 5.0], y_mm = [-3.0, -3.0, 3.0, 3.0], wall_mm = 0.5 }
    """

    set: Count
    circle: CircleTable | None = None
    sector: SectorTable | None = None
    semicircle: SemicircleTable | None = None
    annulus: AnnulusTable | None = None
    polygon: PolygonTable | None = None


def _outline(value: Any) -> Any:
    """Return "circle", or the corners of another outline."""
    if value == "circle":
        return value
    if not isinstance(value, dict):
        raise wrong(f"expected 'circle' or {{x_mm = [...], y_mm = [...]}}, got {shown(value)}")
    for key in value:
        if key not in ("x_mm", "y_mm"):
            raise wrong(f"unknown key {shown(key)}; expected {{x_mm = [...], y_mm = [...]}}")
    x, y = (value.get(key) for key in ("x_mm", "y_mm"))
    for key, found in (("x_mm", x), ("y_mm", y)):
        if not isinstance(found, list) or not 3 <= len(found) <= MOST_CORNERS or not all(map(is_number, found)):
            raise wrong(f"expected {key} with a list of 3 to {MOST_CORNERS} numbers, got {shown(found)}")
    _pairs(x, y)
    return value


def _pairs(x: Any, y: Any) -> None:
    if len(x) != len(y):
        raise wrong(f"expected as many numbers in y_mm as in x_mm, {len(x)}, got {len(y)}")


class BodyTable(Table):
    """[body]: the outline of the body, and where the thread is.

    outline : of the body, where it is not the circle of outer_diameter_mm; as in "circle"
    reinforcement : thread around each chamber, or around the body
    """

    outline: Annotated[Any, PlainValidator(_outline)] = "circle"
    reinforcement: Reinforcement = "chamber"


class Described(Protocol):
    """A file, or a [[segment]] of one."""

    robot: RobotTable
    chamber: list[ChamberTable]
    body: BodyTable


Chambers = Annotated[list[ChamberTable], Field(max_length=MOST_CHAMBERS)]


@cache
def of_outlines(schema: type[ScenarioFile]) -> type[ScenarioFile]:
    """Return the same tables with [[chamber]] and [body] beside [robot]."""
    fields: dict[str, Any] = {"chamber": (Chambers, Field(default=[])), "body": (BodyTable, BodyTable())}
    return create_model(schema.__name__, __base__=schema, **fields)


def outlines_given(tables: Any) -> bool:
    """Whether a file or a segment has more than [robot] for its section."""
    return bool({"chamber", "body"} & set(getattr(tables, "model_fields_set", ())))


def outlined(tables: Described, conventions: str) -> Robot:
    """Return the robot of [robot] with [[chamber]] and [body], whether it can be made or not.

    Circles that make a round layout are one, with every other conventions than "energy".

    Raises
    ------
    InputError
        For what makes no robot; its table and key are those of the file.
    """
    table, given = tables.robot, tables.chamber
    for key in ("outer_diameter_mm", "lumen_diameter_mm"):
        if isinstance(getattr(table, key), Varying):
            raise InputError("expected one number: [[chamber]] and [body] do not vary along s", table="robot", key=key)
    if not given:
        layout = table.described()
        if table.along:
            raise InputError("expected a section that does not vary along s", table="body")
        sizes = {"bore_mm": layout.chamber_diameter / MILLIMETRE, "wall_mm": layout.chamber_wall / MILLIMETRE}
        chambers = [
            {"set": s + 1, "circle": {"x_mm": float(x) / MILLIMETRE, "y_mm": float(y) / MILLIMETRE, **sizes}}
            for s, (x, y) in zip(layout.set_of_chamber, layout.chamber_centres(), strict=True)
        ]
    else:
        _check_forms(given, tables.body.reinforcement)
        chambers = [one.model_dump(exclude_none=True) for one in given]
    file = {"robot": _sizes(table, tables.body), "chamber": chambers, "body": tables.body.model_dump()}
    try:
        made = robot_of_outlines(file)
    except InputError as error:
        of_body = error.key == "outline"
        raise InputError(
            error.message, table="body" if of_body else "chamber", key=error.key if of_body else None
        ) from None
    if conventions == "energy":
        return made
    if (round_layout := as_round(made)) is None:
        text = 'other chambers than a round layout of equal ones need [corrections] conventions = "energy"'
        raise InputError(text, table="chamber" if given else "body")
    return round_layout


def made(tables: Described, conventions: str) -> tuple[Robot, tuple[str, ...]]:
    """Return the robot and its warnings; raises `InputError` as `outlined`, and where it cannot be made."""
    robot, table = outlined(tables, conventions), tables.robot
    try:
        notes = check(robot, allow=table.allow, minimum_wall=table.minimum_wall_mm * MILLIMETRE)
    except InputError as error:
        place = {"length": "length_mm", "lumen_diameter": "lumen_diameter_mm", "outer_diameter": "outer_diameter_mm"}
        key = place.get(error.key or "", error.key)
        table_name = "robot" if key or not tables.chamber else "chamber"
        raise type(error)(error.message, table=table_name, key=key, every=error.every) from None
    unused = table.written(_LAYOUT) if tables.chamber else []
    said = [f"[robot] {', '.join(unused)}: not used, as [[chamber]] says where the chambers are"] if unused else []
    return robot, (*notes, *said)


def _check_forms(given: list[ChamberTable], reinforcement: str) -> None:
    """Raise `InputError` for a chamber without a form or with two, or without a wall inside its thread."""
    for number, table in enumerate(given, start=1):
        written = table.written(_FORMS)
        if len(written) != 1:
            got = "none" if not written else " and ".join(written)
            raise InputError(f"item {number}: expected one of {', '.join(_FORMS)}, got {got}", table="chamber")
        if reinforcement == "chamber" and getattr(table, written[0]).wall_mm == 0:
            text = f"item {number}: expected silicone between bore and thread, a wall above 0 mm"
            raise InputError(text, table="chamber", key=f"{written[0]}.wall_mm")


def _sizes(table: RobotTable, body: BodyTable) -> dict[str, Any]:
    """Return the keys of [robot] that count, those of a robot of the library where the file has none."""
    known = ROBOTS.get(table.name or "")
    keys = ["outer_diameter_mm", "lumen_diameter_mm", "length_mm"]
    if body.outline != "circle":
        table.refuse(keys[:1], "not used with an outline of [body]", table="robot")
        keys = keys[1:]
    found: dict[str, Any] = {"name": table.name or "robot"}
    for key in keys:
        value: Any = getattr(table, key)
        if value is None and known is not None:
            value = getattr(known, key.removesuffix("_mm")) / MILLIMETRE
        if value is not None:
            found[key] = value
        elif key != "lumen_diameter_mm":
            raise InputError("missing; expected a length in mm, or the name of a robot", table="robot", key=key)
    return found
