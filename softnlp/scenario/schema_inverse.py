"""The tables of a scenario of `inverse`, in the units of the file."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field, PlainValidator, TypeAdapter

from softnlp.scenario.schema import MOST_STEPS, Normal, NotNegative, Positive, ScenarioFile, Table, Vector

Rows = Annotated[list[Vector], Field(min_length=1, max_length=MOST_STEPS)]
_STRICT = ConfigDict(strict=True, allow_inf_nan=False)
_BOUNDS = TypeAdapter(Annotated[list[NotNegative], Field(min_length=1)], config=_STRICT)
_PAIRS = TypeAdapter(Annotated[list[list[NotNegative]], Field(min_length=1)], config=_STRICT)


def _bounds(value: Any) -> list[float] | list[list[float]]:
    """Return bounds as they are given: the form is chosen first, so that what is wrong is said of that form alone."""
    pairs = isinstance(value, list) and any(isinstance(item, list) for item in value)
    return (_PAIRS if pairs else _BOUNDS).validate_python(value)


Bounds = Annotated[list[float] | list[list[float]], PlainValidator(_bounds)]
Directions = Annotated[list[Normal], Field(min_length=1, max_length=MOST_STEPS)]


class TargetTable(Table):
    """[target]: where the tip is to be, which way it is to point, or both row by row."""

    tip_position_mm: Rows | None = None
    tip_direction: Directions | None = None
    length_per_radian_mm: Positive | None = None


class BoundsTable(Table):
    """[bounds]: lowest and highest pressure, for all sets or for each."""

    pressure_bar: Bounds = Field(default=[0.0, 1.5])


class InverseFile(ScenarioFile):
    """A whole scenario of `inverse`."""

    target: TargetTable = Field(description="a table with tip_position_mm, tip_direction or both")
    bounds: BoundsTable = BoundsTable()
