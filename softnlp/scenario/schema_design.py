"""The tables of a design scenario, in the units of the file."""

from __future__ import annotations

from math import inf
from typing import Annotated, Any

from pydantic import Field, PlainValidator

from softnlp.base.reading import shown
from softnlp.scenario.schema import ContactTable, Count, Label, ScenarioFile, Table, optional_keys, wrong
from softnlp.studies.design_task import OUTPUTS

_RANGE = "{ from = 1.0, to = 2.0 }"
_STEPS = "{ step = 0.2, to = 3.0 }"

RangeOrList = tuple[float, float] | list[float]
"""A pair is a range; a list holds values."""


def _number(value: Any, where: str) -> float:
    """Return a finite number that is not negative."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < inf:
        raise wrong(f"expected numbers of at least 0 in {where}, got {shown(value)}")
    return float(value)


def _ends(value: dict[str, Any], keys: tuple[str, str], form: str) -> tuple[float, float]:
    """Return the two numbers of an inline table."""
    if set(value) != set(keys):
        raise wrong(
            f"expected the keys {keys[0]} and {keys[1]} as in {form}, got {', '.join(map(str, value)) or 'none'}"
        )
    first, last = (_number(value[key], form) for key in keys)
    return first, last


def _size(value: Any) -> RangeOrList:
    """Return the choice of a dimension."""
    if isinstance(value, dict):
        low, high = _ends(value, ("from", "to"), _RANGE)
        if not low < high:
            raise wrong(f"expected from below to, got {low:g} and {high:g}")
        return low, high
    if not isinstance(value, list) or not value:
        raise wrong(f"expected a list of values, or a range as in {_RANGE}, got {shown(value)}")
    return [_number(item, "the list") for item in value]


def _pressure(value: Any) -> float | tuple[str, float, float]:
    """Return the choice of the pressure: a number, ("range", from, to) or ("step", step, to)."""
    if isinstance(value, dict):
        if "step" in value:
            step, highest = _ends(value, ("step", "to"), _STEPS)
            if not 0 < step <= highest:
                raise wrong(f"expected a step above 0 and at most to, got {step:g} and {highest:g}")
            return "step", step, highest
        low, high = _ends({"from": 0.0, **value}, ("from", "to"), _RANGE)
        if not low < high:
            raise wrong(f"expected from below to, got {low:g} and {high:g}")
        return "range", low, high
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < inf:
        raise wrong(f"expected a pressure above 0, a range as in {_RANGE} or steps as in {_STEPS}, got {shown(value)}")
    return float(value)


Size = Annotated[RangeOrList | None, PlainValidator(_size)]
Pressure = Annotated[float | tuple[str, float, float], PlainValidator(_pressure)]
Names = Annotated[list[Label], Field(min_length=1)]
Counts = Annotated[list[Count], Field(min_length=1)]


class RobotChoices(Table):
    """[choices.robot]: whole robots by name, and dimensions as lists or ranges."""

    name: Names | None = None
    outer_diameter_mm: Size = None
    lumen_diameter_mm: Size = None
    chamber_circle_diameter_mm: Size = None
    chamber_diameter_mm: Size = None
    chamber_wall_mm: Size = None
    length_mm: Size = None
    chamber_sets: Counts | None = None
    chambers_per_set: Counts | None = None
    chamber_angle_deg: Size = None


class MaterialChoices(Table):
    """[choices.material]: every name with every model."""

    name: Names | None = None
    model: Names | None = None


class ChoicesTable(Table):
    """[choices]."""

    robot: RobotChoices = RobotChoices()
    material: MaterialChoices = MaterialChoices()


class ActuationTable(Table):
    """[actuation]: one pressure in each of the sets, counted from 1."""

    pressure_bar: Pressure = Field(description="a pressure in bar, a range or steps")
    sets: Counts = Field(default=[1])


class LimitsTable(Table):
    """A requirement."""

    at_least: float | None = None
    at_most: float | None = None


class RequirementsTable(optional_keys(LimitsTable, (output.key for output in OUTPUTS.values()))):  # type: ignore[misc]
    """[requirements]: the names of `softnlp.studies.design_task.OUTPUTS` as they are in files."""


class ObjectiveTable(Table):
    """[objective]: exactly one of maximise, minimise."""

    maximise: str | None = None
    minimise: str | None = None
    starts: Count | None = None
    trials: Count = 500


class DesignFile(ScenarioFile):
    """A whole scenario of `design`."""

    choices: ChoicesTable = ChoicesTable()
    actuation: ActuationTable = Field(description="a table with pressure_bar and sets")
    requirements: RequirementsTable = RequirementsTable()
    objective: ObjectiveTable = Field(description="a table with maximise or minimise")
    contact: ContactTable = ContactTable()
