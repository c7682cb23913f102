"""A scenario file, read and checked, as plain data in SI units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.base.reading import LARGEST_TOML, LONGEST_NAME, one_line, read_text, shown, toml_tables
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE, STANDARD_GRAVITY
from softnlp.batch.plan import Plan
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import COEFFICIENT_SETS, CONVENTIONS, Coefficients, Conventions
from softnlp.model.materials import Material, material_from_table
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import DIMENSIONS, ROBOTS, Robot, Violation, check, violations
from softnlp.model.rod import Loads
from softnlp.scenario.check import first_of, parse
from softnlp.scenario.contact import contact_settings, contact_task
from softnlp.scenario.design import design_task
from softnlp.scenario.identify import Given, identify_task
from softnlp.scenario.inverse import inverse_task
from softnlp.scenario.pressures import PressurePath, pressure_path
from softnlp.scenario.schema import RobotTable, ScenarioFile
from softnlp.scenario.workspace import workspace_task
from softnlp.studies.plausibility import modulus_notes

Array = NDArray[np.float64]
T = TypeVar("T")


class Task(Protocol):
    """What a study is asked beyond the pressures, as frozen data in SI units."""

    def step_count(self, pressures: int) -> int:
        """Return how many steps the run has, for so many pressures of the scenario."""
        ...


@dataclass(frozen=True, eq=False)
class Scenario:
    """Everything that a scenario file asks for, in SI units.

    Attributes
    ----------
    path, text
        The file as it was named, and its content.
    title
        The file's stem when it gives none.
    study
        Which study it is.
    robot, material, coefficients, conventions, loads
        Of its tables, or the defaults.
    pressures
        (steps, sets) gauge [Pa], no steps where the study has none.
    times
        (steps,) [s], or None when the pressures have none.
    numerics
        Of its [solver], or the defaults.
    contact
        The wall, where there may be one, else None.
    task
        What else the study is asked.
    warnings
        Rules of manufacture that the robot breaks with leave, a silicone of an unlikely stiffness, and readings that
        count as 0.
    """

    path: Path
    text: str
    title: str
    study: str
    robot: Robot
    material: Material
    coefficients: Coefficients
    conventions: Conventions
    loads: Loads
    pressures: Array
    times: Array | None
    numerics: Numerics
    contact: ContactSettings | None
    task: Task | None
    warnings: tuple[str, ...]

    @property
    def model(self) -> Model:
        """Its robot, silicone, coefficients and conventions."""
        return Model(self.robot, self.material, self.coefficients, self.conventions)

    @property
    def step_count(self) -> int:
        """How many steps its run has when none is left out."""
        return len(self.pressures) if self.task is None else self.task.step_count(len(self.pressures))


class Read(NamedTuple):
    """What the reader of a study's own tables may use.

    file : the tables as checked. data : as they were parsed. steps : without rows where the study has no [pressure].
    folder : where files that the scenario names are looked for.
    """

    file: Any
    data: dict[str, Any]
    robot: Robot
    material: Material
    steps: PressurePath
    folder: Path


def load_scenario(path: str | PathLike[str]) -> Scenario:
    """Read and check a scenario file; files that it names are looked for in its folder.

    Parameters
    ----------
    path
        A TOML file.

    Returns
    -------
    Scenario
        Checked, in SI units.

    Raises
    ------
    InputError
        On one line, naming the file, the table and the key of the first error and counting the others.
    """
    try:
        text = read_text(Path(path), LARGEST_TOML)
    except InputError as error:
        raise placed(error, fspath(path)) from None
    return scenario_from_text(text, path)


def scenario_from_text(text: str, path: str | PathLike[str]) -> Scenario:
    """Check the text of a scenario; `path` names it in errors, and its folder holds the files that it names.

    Raises
    ------
    InputError
        As `load_scenario`.
    """
    try:
        return _scenario(text, Path(path))
    except InputError as error:
        raise placed(error, fspath(path)) from None


def scenario_of(given: object, study: str | None, function: str) -> Scenario:
    """Return what a function was given, if that is a scenario of its study (None: of any).

    Raises
    ------
    InputError
        Naming the function to use instead.
    """
    wanted = f"{function} takes a scenario" + ("" if study is None else f" of study {study!r}")
    if not isinstance(given, Scenario):
        use = "softnlp.run_sweep solves a plan" if isinstance(given, Plan) else "softnlp.load_scenario reads one"
        raise InputError(f"{wanted}, got a value of type {type(given).__name__}; {use}")
    if study not in (None, given.study):
        raise InputError(
            f"{wanted}, got {given.study!r}; softnlp.run_scenario runs it", source=str(given.path), key="study"
        )
    return given


def robot_of_scenario(path: str | PathLike[str]) -> tuple[Robot, tuple[Violation, ...]]:
    """Return the robot of a scenario file and the rules of manufacture that it breaks, whether allowed or not.

    Raises
    ------
    InputError
        As `load_scenario`, for everything but those rules.
    """
    try:
        file = parse(parse_toml(read_text(Path(path), LARGEST_TOML)))
        robot = _dimensions(file.robot)
        return robot, violations(robot, file.robot.minimum_wall_mm * MILLIMETRE)
    except InputError as error:
        raise placed(error.located(table="robot"), fspath(path)) from None


def _scenario(text: str, path: Path) -> Scenario:
    """Build a scenario; errors do not name the file yet."""
    data = parse_toml(text)
    file = parse(data)
    errors: list[InputError] = []
    made = _attempt(errors, "robot", lambda: _robot(file.robot))
    silicone = data.get("material") or file.material.model_dump(exclude_none=True)
    chosen = _attempt(errors, "material", lambda: material_from_table(silicone, folder=path.parent))
    steps = made and _attempt(errors, "pressure", lambda: _steps(file, made[0].chamber_sets, path.parent))
    contact = task = None
    if (wall := getattr(file, "contact", None)) is not None:
        single = None if made is None or file.study == "design" else made[0]  # a design judges each candidate
        contact = _attempt(errors, "contact", lambda: contact_settings(wall, single))
    if file.study in TASKS and made is not None and chosen is not None and steps is not None:
        table, read_task = TASKS[file.study]
        given = Read(file, data, made[0], chosen, steps, path.parent)
        task = _attempt(errors, table, lambda: read_task(given))
    numerics = _attempt(errors, "solver", lambda: _numerics(file))
    if errors or made is None or chosen is None or steps is None or numerics is None:
        raise first_of(errors)
    robot, warnings = made
    return Scenario(
        path=path,
        text=text,
        title=file.title or path.stem,
        study=file.study,
        robot=robot,
        material=chosen,
        coefficients=_coefficients(file),
        conventions=CONVENTIONS[file.corrections.conventions],
        loads=_loads(file),
        pressures=steps.pressures,
        times=steps.times,
        numerics=numerics,
        contact=contact,
        task=task,
        warnings=(*warnings, *_material_notes(file.study, chosen), *steps.notes),
    )


def _material_notes(study: str, chosen: Material) -> tuple[str, ...]:
    """Return what is unlikely of the silicone; where constants are to be found those given only begin the search."""
    return () if study == "identify" else modulus_notes(chosen.name, float(chosen.shear_modulus(1.0)))


def _numerics(file: ScenarioFile) -> Numerics:
    """Return the choices of [solver]."""
    solver, options = file.solver, cast(Any, file.solver.ipopt)
    return Numerics(**{**dict(solver), "ipopt": options.model_dump(exclude_unset=True)})


def _steps(file: ScenarioFile, sets: int, folder: Path) -> PressurePath:
    """Return the pressures of a study that has them, else none."""
    table = getattr(file, "pressure", None)
    return PressurePath(np.zeros((0, sets)), None) if table is None else pressure_path(table, sets, folder)


def _attempt(errors: list[InputError], table: str, build: Callable[[], T]) -> T | None:
    """Return what is built, or None with the error added to the others."""
    try:
        return build()
    except InputError as error:
        errors.append(error.located(table=table) if error.source is None else _quoted(error, table))
        return None


def _quoted(error: InputError, table: str) -> InputError:
    """Quote an error that names another file, as one of the key that names that file."""
    return type(error)(str(error), table=table, key="file")


def placed(error: InputError, source: str) -> InputError:
    """Return an error that names the file; whatever it quotes stays printable and on the same line."""
    table = error.table and one_line(error.table, LONGEST_NAME)
    key = error.key and one_line(error.key, LONGEST_NAME)
    return type(error)(one_line(error.message), source=one_line(source), table=table, key=key)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a scenario; raises `InputError` where the text is empty or not TOML."""
    if not text.strip():
        raise InputError("expected a scenario, got an empty file")
    return toml_tables(text)


def _robot(table: RobotTable) -> tuple[Robot, tuple[str, ...]]:
    """Return the robot and its warnings."""
    robot = _dimensions(table)
    try:
        return robot, check(robot, allow=table.allow, minimum_wall=table.minimum_wall_mm * MILLIMETRE)
    except InputError as error:
        file_keys = {d.field: d.file_key for d in DIMENSIONS}
        raise type(error)(error.message, key=file_keys.get(error.key or "", error.key)) from None


def _dimensions(table: RobotTable) -> Robot:
    """Return the robot of the table, whether it can be made or not."""
    given: dict[str, Any] = {}
    for dimension in DIMENSIONS:
        value = getattr(table, dimension.file_key)
        if value is not None:
            given[dimension.field] = value if dimension.scale is None else value * dimension.scale
    missing = [d.file_key for d in DIMENSIONS if d.field not in given]
    if table.name is not None and table.name in ROBOTS:
        changed = any(getattr(ROBOTS[table.name], key) != value for key, value in given.items())
        return replace(ROBOTS[table.name], **given, name=f"{table.name} (modified)" if changed else table.name)
    if not missing:
        return Robot(name=table.name or "robot", **given)
    if table.name is not None:
        full = f" (missing: {', '.join(missing)})" if given else ""
        raise InputError(
            f"expected a robot of the library, or every dimension in full{full}, got {shown(table.name)}"
            f"{nearest(table.name, ROBOTS)}",
            key="name",
        )
    if given:
        raise InputError("missing; without a name every dimension is needed", key=", ".join(missing))
    raise InputError("missing; expected a robot of the library, or every dimension in full", key="name")


def _coefficients(file: ScenarioFile) -> Coefficients:
    """Take the coefficients of the named set, and the file's own where it gives them."""
    given = {
        "elongation": file.stiffening.elongation,
        "bending": file.stiffening.bending,
        "area": file.corrections.area,
        "inertia": file.corrections.inertia,
        "bore_fraction": file.corrections.bore_fraction,
    }
    if (wall := getattr(file, "contact", None)) is not None:
        given["chamber_reaction"] = wall.chamber_reaction
    own: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    return replace(COEFFICIENT_SETS[file.stiffening.set], **own)


def _loads(file: ScenarioFile) -> Loads:
    """Return tip load and gravity."""
    f_x, f_y, f_z = file.tip_load.force_N
    m_x, m_y, m_z = (component * NEWTON_MILLIMETRE for component in file.tip_load.moment_Nmm)
    g_x, g_y, g_z = (component * STANDARD_GRAVITY for component in file.gravity.direction)
    return Loads(tip_force=(float(f_x), float(f_y), float(f_z)), tip_moment=(m_x, m_y, m_z), gravity=(g_x, g_y, g_z))


def _contact_task(given: Read) -> Task:
    return contact_task(given.file.contact, given.steps.pressures)


def _workspace_task(given: Read) -> Task:
    return workspace_task(given.file, given.robot, given.material, given.steps.pressures)


def _inverse_task(given: Read) -> Task:
    task = inverse_task(given.file.target, given.file.bounds, given.robot)
    return replace(task, allow=tuple(given.file.robot.allow))


def _identify_task(given: Read) -> Task:
    return identify_task(
        Given(given.file, given.data, given.robot, given.material, given.folder, lambda table: _robot(table)[0])
    )


def _design_task(given: Read) -> Task:
    return design_task(given.file, given.data, given.robot, given.material, given.folder)


TASKS: Mapping[str, tuple[str, Callable[[Read], Task]]] = {
    "blocked-force": ("contact", _contact_task),
    "workspace": ("workspace", _workspace_task),
    "inverse": ("target", _inverse_task),
    "identify": ("measurements", _identify_task),
    "design": ("choices", _design_task),
}
"""For each study with tables of its own: the table that its errors are about, and what reads them."""
