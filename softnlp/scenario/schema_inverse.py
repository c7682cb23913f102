"""The tables of a scenario of `inverse`, in the units of the file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from softnlp.scenario.schema import MOST_STEPS, Normal, NotNegative, Positive, ScenarioFile, Table, Vector

Rows = Annotated[list[Vector], Field(min_length=1, max_length=MOST_STEPS)]
Bounds = Annotated[list[NotNegative | list[NotNegative]], Field(min_length=1)]
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
