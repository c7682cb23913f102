"""Design: the tables of a scenario, what they ask, checked and in SI units, and the study."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator

from softnlp.base.errors import InputError, nearest
from softnlp.base.reading import shown
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.materials import Material, material
from softnlp.model.robot import DIMENSIONS, ROBOTS
from softnlp.scenario.blocked_force import SEVERAL, contact_settings
from softnlp.scenario.data import Read, Scenario, scenario_of
from softnlp.scenario.schema import ContactTable, Count, Label, RobotTable, ScenarioFile, Table, optional_keys, wrong
from softnlp.studies.design_task import OUTPUTS, DesignTask, Limits, PressureSteps, Range, Setting, check_task

if TYPE_CHECKING:  # imported where needed: to read a scenario takes none of them
    from softnlp.studies.design import Design
    from softnlp.studies.design_candidate import Candidate

    Progress = Callable[[int, Candidate], None]

_BY_FILE_KEY = {output.key: output for output in OUTPUTS.values()}
_RANGE = "{ from = 1.0, to = 2.0 }"
_STEPS = "{ step = 0.2, to = 3.0 }"


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


def _size(value: Any) -> Range | list[float]:
    """Return the choice of a dimension, in the unit of the file."""
    if isinstance(value, dict):
        return _range(value)
    if not isinstance(value, list) or not value:
        raise wrong(f"expected a list of values, or a range as in {_RANGE}, got {shown(value)}")
    return [_number(item, "the list") for item in value]


def _range(value: dict[str, Any], scale: float = 1.0) -> Range:
    low, high = _ends(value, ("from", "to"), _RANGE)
    if not low < high:
        raise wrong(f"expected from below to, got {low:g} and {high:g}")
    return Range(low * scale, high * scale)


def _pressure(value: Any) -> float | Range | PressureSteps:
    """Return the choice of the pressure [Pa]."""
    if isinstance(value, dict) and "step" in value:
        step, highest = _ends(value, ("step", "to"), _STEPS)
        if not 0 < step <= highest:
            raise wrong(f"expected a step above 0 and at most to, got {step:g} and {highest:g}")
        return PressureSteps(step * BAR, highest * BAR)
    if isinstance(value, dict):
        return _range({"from": 0.0, **value}, BAR)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < inf:
        raise wrong(f"expected a pressure above 0, a range as in {_RANGE} or steps as in {_STEPS}, got {shown(value)}")
    return float(value) * BAR


Size = Annotated[Range | list[float], PlainValidator(_size)]
Pressure = Annotated[float | Range | PressureSteps, PlainValidator(_pressure)]
Names = Annotated[list[Label], Field(min_length=1)]
Counts = Annotated[list[Count], Field(min_length=1)]


_SIZES = {d.file_key: Counts if d.scale is None else Size for d in DIMENSIONS}


class RobotChoices(optional_keys({"name": Names, **_SIZES})):  # type: ignore[misc]
    """[choices.robot]: whole robots by name, and dimensions as lists or ranges.

    name : whole robots of the library, in place of dimensions; as in ["D25L60", "D20L60"]
    """


class MaterialChoices(Table):
    """[choices.material]: every name with every model.

    name : silicones; as in ["Ecoflex 00-50", "Ecoflex 00-30"]
    model : laws; as in ["mooney-rivlin", "yeoh"]
    """

    name: Names | None = None
    model: Names | None = None


class ChoicesTable(Table):
    """[choices]: what a design may choose."""

    robot: RobotChoices = RobotChoices()
    material: MaterialChoices = MaterialChoices()


class ActuationTable(Table):
    """[actuation]: one pressure in each of the sets, counted from 1.

    pressure_bar : a number, a range { from = 0.0, to = 1.0 }, or the lowest step that suffices; as in 0.8
    sets : that get the pressure, counted from 1
    """

    pressure_bar: Pressure = Field(description="a pressure in bar, a range or steps")
    sets: Counts = Field(default=[1])


class LimitsTable(Table):
    """A requirement.

    at_least : the lowest that will do; as in 1.0
    at_most : the highest that will do; as in 2.0
    """

    at_least: float | None = None
    at_most: float | None = None


class RequirementsTable(optional_keys(dict.fromkeys(_BY_FILE_KEY, LimitsTable))):  # type: ignore[misc]
    """[requirements]: what a design must meet, at_least or at_most, of `softnlp.studies.design_task.OUTPUTS`."""


class ObjectiveTable(Table):
    """[objective]: exactly one of maximise, minimise.

    maximise : an output of the list of [requirements]; as in "stretch"
    minimise : or this; as in "pressure_bar"
    starts : first guesses of each optimisation; by default 4, or 2 for one free number; as in 4
    trials : of the search, where there are more than 5000 combinations
    """

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


def design_task(given: Read) -> DesignTask:
    """Return what a scenario asks of a design.

    Raises
    ------
    InputError
        With table and key, for the first thing that is not right.
    """
    file: DesignFile = given.file
    file.contact.refuse(("mode", *SEVERAL), "expected only with study 'blocked-force'", "contact")
    choices: dict[str, Range | Sequence[Any]] = {
        **_robot_choices(file.choices.robot, file.robot),
        **_materials(file.choices.material, given.data["material"], given.folder),
    }
    objective = {"maximise": file.objective.maximise, "minimise": file.objective.minimise}
    task = DesignTask(
        choices=choices,
        pressure=file.actuation.pressure_bar,
        sets=tuple(number - 1 for number in file.actuation.sets),
        requirements=_requirements(file.requirements),
        **{way: _output(way, key) for way, key in objective.items() if key is not None},
        allow=tuple(file.robot.allow),
        minimum_wall=file.robot.minimum_wall_mm * MILLIMETRE,
        starts=file.objective.starts,
        trials=file.objective.trials,
    )
    try:
        check_task(task, Setting(given.robot, given.material, contact=contact_settings(file.contact)))
    except InputError as error:
        raise _in_file_words(error) from None
    return task


def _output(way: str, key: str) -> str:
    """Return the name of the output that a file calls `key`."""
    if key not in _BY_FILE_KEY:
        raise InputError(f"unknown output {shown(key)}{nearest(key, _BY_FILE_KEY)}", table="objective", key=way)
    return _BY_FILE_KEY[key].name


def _robot_choices(table: RobotChoices, base: RobotTable) -> dict[str, Range | Sequence[Any]]:
    """Return the choices of whole robots and of dimensions."""
    choices: dict[str, Range | Sequence[Any]] = {}
    if table.name is not None:
        for own in base.written(_SIZES):
            raise InputError(
                f"expected [robot] with a name alone where whole robots are chosen, got {own} there; put it in "
                "[choices.robot]",
                table="choices",
                key="robot.name",
            )
        for name in table.name:
            if name not in ROBOTS:
                problem = f"expected robots of the library, got {shown(name)}{nearest(name, ROBOTS)}"
                raise InputError(problem, table="choices", key="robot.name")
        choices["robot"] = [ROBOTS[name] for name in table.name]
    for dimension in DIMENSIONS:
        value, scale = getattr(table, dimension.file_key), dimension.scale or 1
        if isinstance(value, Range):
            choices[dimension.field] = Range(value.lower * scale, value.upper * scale)
        elif value is not None:
            choices[dimension.field] = [item * scale for item in value]
    return choices


def _materials(table: MaterialChoices, base: Mapping[str, Any], folder: Path) -> dict[str, Sequence[Material]]:
    """Return every silicone named with every model named, those of [material] where none is."""
    if table.name is None and table.model is None:
        return {}
    names, models = table.name or [base["name"]], table.model or [base["model"]]
    file = folder / base["file"] if "file" in base else None
    density = base.get("density_kg_m3")
    found = []
    for name in names:
        for model in models:
            try:
                made = material(name, model, set=base.get("set"), file=file)
            except InputError as error:
                key = f"material.{error.key}" if error.key in ("name", "model") else "material"
                raise InputError(error.message, table="choices", key=key) from None
            found.append(made if density is None else replace(made, density=float(density)))
    return {"material": found}


def _requirements(table: RequirementsTable) -> dict[str, Limits]:
    """Return the requirements by name."""
    found = {}
    for key, output in _BY_FILE_KEY.items():
        limits = getattr(table, key)
        if limits is None:
            continue
        given = {"lower": limits.at_least, "upper": limits.at_most}
        found[output.name] = Limits(**{side: v * output.scale for side, v in given.items() if v is not None})
    return found


_ELSEWHERE = {"allow": ("robot", "allow"), "closure": ("contact", "closure"), "pressure": ("actuation", "pressure_bar")}


def _in_file_words(error: InputError) -> InputError:
    """Return an error of `check_task` with the table and the key of the file."""
    head, _, name = (error.key or "").partition(".")
    if head == "sets":
        return InputError("expected different sets of the robot, counted from 1", table="actuation", key="sets")
    table, key = _ELSEWHERE.get(head, ("objective", None if head == "objective" else head))
    if head == "choices":
        of_robot = next((d.file_key for d in DIMENSIONS if d.field == name), name)
        table, key = head, f"robot.{of_robot}" if name else None
    elif head == "requirements":
        table, key = head, OUTPUTS[name].key
    return InputError(error.message, table=table, key=key)


def run_design(scenario: Scenario, progress: Progress | None = None, workers: int = 1) -> Design:
    """Run a scenario of study "design".

    Parameters
    ----------
    scenario
        Of `softnlp.load_scenario`, of study "design".
    progress, workers
        As `softnlp.design`.

    Returns
    -------
    Design
        As `softnlp.design`.

    Raises
    ------
    InputError
        For anything but such a scenario, and as `softnlp.design`.
    """
    from softnlp.studies.design import design

    task = scenario_of(scenario, "design", "softnlp.run_design").task
    assert isinstance(task, DesignTask)
    return design(
        scenario.robot,
        scenario.material,
        task,
        contact=scenario.contact or ContactSettings(),
        title=scenario.title,
        workers=workers,
        progress=progress,
        **scenario.settings,
    )


def finished_design(scenario: Scenario, candidates: Sequence[Candidate]) -> Design:
    """Return the design of a scenario that was stopped after some candidates."""
    from softnlp.studies.design import finished

    so_far = design_so_far(scenario, candidates)
    return finished(so_far.setting, so_far.task, candidates, scenario.title)


def design_so_far(scenario: Scenario, candidates: Sequence[Candidate]) -> Design:
    """Return the design of the candidates that have come, while others are at work; nothing is solved for it."""
    from softnlp.studies.design import Design

    assert isinstance(scenario.task, DesignTask)
    contact = scenario.contact or ContactSettings()
    setting = Setting(scenario.robot, scenario.material, contact=contact, **scenario.settings)
    return Design(setting, scenario.task, tuple(sorted(candidates, key=lambda c: c.number)), scenario.title)
