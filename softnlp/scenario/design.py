"""The tables of a design scenario as a `DesignTask` in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError, nearest
from softnlp.base.reading import shown
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.materials import Material, material
from softnlp.model.robot import DIMENSIONS, ROBOTS, Robot
from softnlp.scenario.contact import contact_settings
from softnlp.scenario.schema import RobotTable, ScenarioFile
from softnlp.scenario.schema_design import ActuationTable, DesignFile, MaterialChoices, RequirementsTable, RobotChoices
from softnlp.studies.design_task import OUTPUTS, DesignTask, Limits, PressureSteps, Range, Setting, check_task

_BY_FILE_KEY = {output.key: output for output in OUTPUTS.values()}
_OTHER_STUDY = ("mode", "offsets_mm", "offset_ramp", "target_force_N")


def design_task(file: ScenarioFile, data: Mapping[str, Any], robot: Robot, base: Material, folder: Path) -> DesignTask:
    """Return what a scenario asks of a design.

    file : the tables as checked. data : as they were parsed. robot, base : of [robot] and [material]. folder : where a
    materials file that the scenario names is looked for.

    Raises
    ------
    InputError
        With table and key, for the first thing that is not right.
    """
    assert isinstance(file, DesignFile)
    for key in _OTHER_STUDY:
        if key in file.contact.model_fields_set:
            raise InputError("expected only with study 'blocked-force'", table="contact", key=key)
    choices: dict[str, Range | Sequence[Any]] = {
        **_robot_choices(file.choices.robot, file.robot),
        **_materials(file.choices.material, data["material"], folder),
    }
    objective = {"maximise": file.objective.maximise, "minimise": file.objective.minimise}
    task = DesignTask(
        choices=choices,
        pressure=_pressure(file.actuation),
        sets=tuple(number - 1 for number in file.actuation.sets),
        requirements=_requirements(file.requirements),
        **{way: _output(way, key) for way, key in objective.items() if key is not None},
        allow=tuple(file.robot.allow),
        minimum_wall=file.robot.minimum_wall_mm * MILLIMETRE,
        starts=file.objective.starts,
        trials=file.objective.trials,
    )
    try:
        check_task(task, Setting(robot, base, contact=contact_settings(file.contact)))
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
        own = [d.file_key for d in DIMENSIONS if getattr(base, d.file_key) is not None]
        if own:
            raise InputError(
                f"expected [robot] with a name alone where whole robots are chosen, got {own[0]} there; put it in "
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
        value = getattr(table, dimension.file_key)
        if value is None:
            continue
        scale = dimension.scale or 1
        if isinstance(value, tuple):
            choices[dimension.field] = Range(value[0] * scale, value[1] * scale)
        else:
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
                made = material(name, model, file=file)
            except InputError as error:
                key = f"material.{error.key}" if error.key in ("name", "model") else "material"
                raise InputError(error.message, table="choices", key=key) from None
            found.append(made if density is None else replace(made, density=float(density)))
    return {"material": found}


def _pressure(table: ActuationTable) -> float | Range | PressureSteps:
    """Return the pressure in Pa."""
    value = table.pressure_bar
    if not isinstance(value, tuple):
        return value * BAR
    kind, low, high = value
    return PressureSteps(low * BAR, high * BAR) if kind == "step" else Range(low * BAR, high * BAR)


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


def _in_file_words(error: InputError) -> InputError:
    """Return an error of `check_task` with the table and the key of the file."""
    head, _, name = (error.key or "").partition(".")
    if head == "choices":
        key = next((d.file_key for d in DIMENSIONS if d.field == name), name)
        return InputError(error.message, table="choices", key=f"robot.{key}" if name else None)
    if head == "requirements":
        return InputError(error.message, table="requirements", key=OUTPUTS[name].key)
    if head == "allow":
        return InputError(error.message, table="robot", key="allow")
    if head == "closure":
        return InputError(error.message, table="contact", key="closure")
    if head == "sets":
        return InputError("expected different sets of the robot, counted from 1", table="actuation", key="sets")
    if head == "pressure":
        return InputError(error.message, table="actuation", key="pressure_bar")
    return InputError(error.message, table="objective", key=None if head == "objective" else head)
