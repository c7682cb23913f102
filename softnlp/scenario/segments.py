"""[[segment]]: the tables of several segments in place of [robot] and [material], and the robot that they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, create_model

from softnlp.base.errors import InputError, of_table
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.model.body import Segment
from softnlp.model.materials import Material, material_from_table
from softnlp.model.robot import Robot
from softnlp.model.segments import SegmentedRobot, segmented_robot
from softnlp.scenario.outlined import BodyTable, Chambers, outlines_given
from softnlp.scenario.outlined import made as made_outlined
from softnlp.scenario.schema import MaterialTable, NotNegative, RobotTable, ScenarioFile, Table, wrong

OF_SEGMENTS = ("forward", "blocked-force", "inverse", "workspace", "dynamic", "trajectory")
"""The studies that take segments, and dimensions that vary along s."""
MOST_SEGMENTS = 20


class SegmentTable(Table):
    """One [[segment]], base first."""

    robot: RobotTable = Field(description="a table [segment.robot] with name or every dimension")
    material: MaterialTable = Field(description="a table [segment.material] with name and model")
    chamber: Chambers = Field(default=[])
    body: BodyTable = BodyTable()
    connector_mm: NotNegative = 0.0
    lines: Literal["none", "slack", "bonded"] = "none"
    turn_deg: float = 0.0


def _beside(value: Any) -> Any:
    """Refuse what stands beside segments."""
    raise wrong("expected either [[segment]] or [robot] and [material], got both")


@cache
def of_segments(schema: type[ScenarioFile]) -> type[ScenarioFile]:
    """Return the same tables with [[segment]] in place of [robot] and [material]."""
    refused = Annotated[Any, PlainValidator(_beside)]
    segments = Annotated[list[SegmentTable], Field(min_length=1, max_length=MOST_SEGMENTS)]
    fields: dict[str, Any] = {"robot": (refused, None), "material": (refused, None), "segment": (segments, ...)}
    return create_model(schema.__name__, __base__=schema, **fields)


def allowed(file: Any) -> tuple[str, ...]:
    """Return the rules that a file's robot, or any of its segments, may break."""
    tables = getattr(file, "segment", None) or [file]
    return tuple(dict.fromkeys(rule for table in tables for rule in table.robot.allow))


def of_segment(number: int, error: InputError) -> InputError:
    """Return an error with the name of a segment, from 0, before its table and key: segment.2.robot.length_mm."""
    parts = ["segment", str(number + 1), *(part for part in (error.table, error.key) if part)]
    return type(error)(error.message, source=error.source, key=".".join(parts))


def read_segments(
    tables: Sequence[SegmentTable],
    data: Sequence[Mapping[str, Any]],
    folder: Path,
    errors: list[InputError],
    conventions: str,
) -> tuple[Robot, Material, tuple[str, ...]] | None:
    """Return the robot of segments, its silicone and its warnings; None with what is wrong added to the errors.

    tables, data : as checked and as they were parsed. folder : where files of silicones are looked for. One uniform
    segment without a connector is a robot like any other.
    """
    segments, warnings = list[Segment](), list[str]()
    for k, (table, given) in enumerate(zip(tables, data, strict=True)):
        try:
            with of_table("robot"):
                outlined = outlines_given(table)
                robot, notes = made_outlined(table, conventions) if outlined else table.robot.made()
            with of_table("material"):
                silicone = material_from_table(dict(given["material"]), folder=folder)
        except InputError as error:
            errors.append(of_segment(k, error))
            continue
        warnings += [f"segment {k + 1}: {note}" for note in notes]
        segments.append(
            Segment(
                robot,
                silicone,
                along={} if outlined else table.robot.along,
                connector=table.connector_mm * MILLIMETRE,
                lines=table.lines,
                turn=table.turn_deg * DEGREE,
            )
        )
    if len(segments) < len(tables):
        return None
    first = segments[0]
    if len(segments) == 1 and not (first.along or first.connector or first.turn):
        return first.robot, first.material, tuple(warnings)
    made: SegmentedRobot = segmented_robot(segments)
    return made, made.material, (*warnings, *made.notes)
