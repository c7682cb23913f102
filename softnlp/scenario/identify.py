"""Identification from measurements of robots: the tables, their files as a task in SI units, and the study."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from softnlp.base.columns import OUTPUTS
from softnlp.base.csv_columns import Columns
from softnlp.base.errors import InputError, listed, located, of_table
from softnlp.base.ranges import noise_note, unit_note
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material
from softnlp.model.robot import Robot
from softnlp.scenario.blocked_force import SEVERAL
from softnlp.scenario.data import Read, Scenario
from softnlp.scenario.dynamic import DynamicPressureTable, DynamicTable
from softnlp.scenario.laboratory import import_notes, laboratory_columns
from softnlp.scenario.measured_rows import (
    ALIASES,
    ORIENTATION_COLUMNS,
    SCALARS,
    TIP_COLUMNS,
    RobotRows,
    named_columns,
    near_misses,
    rows_by_robot,
)
from softnlp.scenario.motion import MotionTask, motion_task, run_motion
from softnlp.scenario.registration import import_settings, registration_of, takes_orientations
from softnlp.scenario.schema import (
    ContactTable,
    MaterialTable,
    Positive,
    RegistrationTable,
    RobotTable,
    ScenarioFile,
    optional_keys,
)
from softnlp.scenario.tensile import DataTable, TensileTable, run_tensile, tensile_task
from softnlp.studies.identified import free_constants
from softnlp.studies.measurements import OBSERVABLES, Measurements, RobotTask, TensileTask, checked_measurements
from softnlp.studies.registration import Registration

_MEASURED = (*TIP_COLUMNS, *(output.measured for output in SCALARS.values()))
_OWN = ("p1_bar", *_MEASURED, *ALIASES)
_KNOWN = (
    *_MEASURED,
    "robot",
    "weight",
    *sum(ORIENTATION_COLUMNS, ()),
    *(f"sigma_{OUTPUTS[name].key}" for name in OBSERVABLES),
)

if TYPE_CHECKING:  # imported where needed: to read a scenario takes none of them
    from softnlp.studies.identified import Identified
    from softnlp.studies.identify_motion import MotionFit
    from softnlp.studies.tensile import TensileFit

Array = NDArray[np.float64]
Progress = Callable[[int, float], None]

UNUSED_BY_TENSILE = (
    "pressure",
    "dynamic",
    "robots",
    "sigma",
    "contact",
    "gravity",
    "tip_load",
    "stiffening",
    "corrections",
    "registration",
)


class MeasurementsTable(DataTable):
    """[measurements]: of one robot or several, and the constants to identify.

    free : the constants to find: k_e, k_b, k_a, k_i, phi, k_c (c_m with "energy"), and constants of the law; with
        [dynamic] damping_s, lag_s, modulus_factor; as in ["k_e", "k_b"]
    bounds : lowest and highest, by name; as in { k_e = [0.0, 5.0] }
    """

    free: Annotated[list[str], Field(min_length=1)] = Field(
        description="a list of k_e, k_b, k_a, k_i, phi, k_c and constants of the material, or of damping_s, lag_s"
    )
    bounds: dict[str, Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(default_factory=dict)


def _sigma_keys() -> Iterator[str]:
    for name in OBSERVABLES:
        yield OUTPUTS[name].key
        if name not in ("tip_position", "orientation"):
            yield f"{name}_percent"


class SigmaTable(optional_keys(dict.fromkeys(_sigma_keys(), Positive))):  # type: ignore[misc]
    """[sigma]: the standard deviation of each observable, absolute or in percent of each number."""


class IdentifyFile(ScenarioFile):
    """A whole scenario of `identify`. A tensile test has no robot; measurements may name theirs row by row."""

    robot: RobotTable = RobotTable(name="D25L60")
    material: MaterialTable = MaterialTable(name="Ecoflex 00-50", model="mooney-rivlin")
    robots: dict[str, RobotTable] = Field(default_factory=dict)
    tensile: TensileTable | None = None
    measurements: MeasurementsTable | None = None
    sigma: SigmaTable = SigmaTable()
    contact: ContactTable = ContactTable()
    registration: RegistrationTable = RegistrationTable()
    pressure: DynamicPressureTable | None = None
    dynamic: DynamicTable | None = None


def identify_task(given: Read) -> TensileTask | RobotTask | MotionTask:
    """Return what is to be identified.

    Raises
    ------
    InputError
        With table and key, for tables that do not go together and files that do not fit.
    """
    file: IdentifyFile = given.file
    tensile, measured = file.tensile, file.measurements
    if file.pressure is not None and file.dynamic is None:
        raise InputError("not used but with [dynamic], for a tip over time; remove it", table="pressure")
    if tensile is not None and measured is None:
        for name in file.written(UNUSED_BY_TENSILE):
            raise InputError("this table is not used by a tensile test; remove it", table=name)
        other = sorted(file.solver.model_fields_set - {"engine", "ipopt"})
        file.solver.refuse(other, "not used by a tensile test; remove it", "solver")
        with of_table("tensile"):
            return tensile_task(given, tensile)
    if measured is None or tensile is not None:
        got = "neither" if measured is None else "both"
        raise InputError(f"expected a table [tensile] or a table [measurements], got {got}", table="measurements")
    if "material" not in given.data:
        raise InputError("missing; expected a table with name and model", table="material")
    if file.dynamic is not None:
        with of_table("measurements"):
            return motion_task(given, measured)
    wall = file.contact
    wall.refuse(SEVERAL, "not used by study 'identify'; the wall stands at offset_mm", "contact")
    if wall.mode != "blocked" or wall.closure == "weighted":
        key = "mode" if wall.mode != "blocked" else "closure"
        raise InputError("expected a wall and the closure free, compliant or rigid", table="contact", key=key)
    with of_table("measurements"):
        return _robots(given, measured)


def _robots(given: Read, table: MeasurementsTable) -> RobotTask:
    registration = given.file.registration
    settings, by_base = getattr(table, "import"), import_settings(registration)
    if by_base is not None:
        settings = {**by_base, **(settings or {})}
    files = table.named()
    groups = [files] if settings is not None else [(file,) for file in files]
    every = [laboratory_columns(given.folder, group, "tips", _OWN, settings) for group in groups]
    tables = [named_columns(columns) for columns, _ in every]
    told = tuple(note for _, imported in every if imported is not None for note in import_notes(imported))
    own = {}
    for name, described in given.file.robots.items():
        with located(table=f"robots.{name}"):
            own[name] = described.made()[0]
    header = tuple(dict.fromkeys(name for columns in tables for name in columns.header))
    misses = tuple(f"{c.file}: {words}" for c in tables for words in near_misses(c, _KNOWN, "not read"))
    for columns in tables:
        if "robot" not in columns and "robot" not in given.data:
            raise InputError(f"{columns.file}: expected a column robot, or a table [robot] for every row", key="file")
    if not any(name in header for name in _MEASURED):
        why = f" ({misses[0]})" if misses else ""
        raise InputError(f"expected a column of {', '.join(_MEASURED)}; it has {listed(header)}{why}", key="file")

    def unnamed(columns: Columns, row: int) -> Robot:
        if "robot" in given.data:
            return given.robot
        raise columns.wrong(row, "robot", "expected a name, or a table [robot] for rows without one")

    made, cells, readings = [], [], []
    for rows in rows_by_robot(tables, own, unnamed):
        readings.append(rows.readings().ravel())
        placed = registration_of(registration, rows.robot.chamber_sets)
        made.append(_measurements(rows, given.file.sigma, placed, takes_orientations(registration)))
        cells.append(tuple(tuple(_cell(c, k, column) for column in header) for c, k in rows.places))
    free, bounds = _free(table, given.material)
    pressed = np.concatenate(readings)
    notes = (*told, *misses, *noise_note(pressed), *unit_note(pressed))
    unused = any(c in header for names in ORIENTATION_COLUMNS for c in names)
    if unused and all(m.orientation is None for m in made):
        notes = (
            *notes,
            f"orientations are not fitted; [sigma] {OUTPUTS['orientation'].key}, their noise, makes them count",
        )
    sets = made[0].robot.chamber_sets
    return RobotTask(tuple(made), free, bounds, header, tuple(cells), notes, registration_of(registration, sets))


def _cell(columns: Columns, row: int, name: str) -> str:
    return columns.rows[row][columns.header.index(name)].strip() if name in columns else ""


def _measurements(
    rows: RobotRows, sigmas: SigmaTable, registration: Registration | None, oriented: bool
) -> Measurements:
    """Return the measurements of one robot; orientations count where they are asked for, or their noise is stated."""
    pressure, seen = rows.pressure(), rows.scalars()
    if registration is not None:
        pressure = registration.ordered(pressure)
    sigma: dict[str, Array] = {}
    for key in OBSERVABLES:
        name, unit = OUTPUTS[key].key, OUTPUTS[key].scale
        per_row = rows.column(f"sigma_{name}") * unit
        percent = getattr(sigmas, f"{key}_percent", None)
        absolute = getattr(sigmas, name)
        if percent is not None and absolute is not None:
            raise InputError(f"expected one of {name}, {key}_percent", table="sigma", key=name)
        general = np.nan if absolute is None else absolute * unit
        if percent is not None:
            general = percent / 100 * np.abs(seen[key])
        values = np.where(np.isnan(per_row), general, per_row)
        if not np.all(np.isnan(values)):
            sigma[key] = values
    weight = rows.column("weight")
    weight = np.where(np.isnan(weight), 1.0, weight)
    tip = rows.tip_position()
    made = Measurements(rows.robot, pressure, tip_position=tip, **seen, sigma=sigma, weight=weight, label=rows.label)
    if oriented or "orientation" in sigma:
        made = replace(made, orientation=rows.orientation())
    try:
        checked_measurements(made)
    except InputError as error:
        raise InputError(f"{rows.label}: {error}", table="measurements", key="file") from None
    return made


def _free(table: MeasurementsTable, material: Material) -> tuple[tuple[str, ...], dict[str, tuple[float, float]]]:
    """Return the names of the constants and their bounds in SI; a material's constant may carry its unit."""
    by_file_key = {c.file_key: c for c in material.law.constants}
    scales = {c.name: c.scale for c in material.law.constants}

    def plain(name: str) -> str:
        return by_file_key[name].name if name in by_file_key else name

    free = tuple(plain(name) for name in table.free)
    bounds = {}
    for name, (low, high) in table.bounds.items():
        scale = scales.get(plain(name), 1.0)
        bounds[plain(name)] = (low * scale, high * scale)
    free_constants(free, material, Coefficients(), bounds)
    return free, bounds


def run_identify(scenario: Scenario, progress: Progress | None = None) -> Identified | TensileFit | MotionFit:
    """Identify what a scenario asks for, from a tensile test, which has no progress, from robots, or from a motion."""
    if isinstance(scenario.task, MotionTask):
        return run_motion(scenario, progress)
    return run_tensile(scenario) if isinstance(scenario.task, TensileTask) else run_robots(scenario, progress)


def run_robots(scenario: Scenario, progress: Progress | None = None) -> Identified:
    """Identify constants from the measurements of robots; `progress` is that of `softnlp.identify`.

    Raises
    ------
    InputError
        As `softnlp.identify`.
    """
    from softnlp.studies.identify import identify

    task = scenario.task
    assert isinstance(task, RobotTask)
    with located(source=str(scenario.path), table="measurements"):
        found = identify(
            task.measurements,
            scenario.material,
            task.free,
            bounds=task.bounds,
            contact=scenario.contact or ContactSettings(),
            progress=progress,
            registration=task.registration,
            **scenario.settings,
        )
    return replace(found, warnings=(*task.notes, *found.warnings))
