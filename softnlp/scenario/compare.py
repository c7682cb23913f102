"""From a scenario and a CSV file of measurements to a comparison: what is simulated, and with which variants."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.csv_columns import TIME_COLUMN, Columns
from softnlp.base.errors import InputError, listed, located, nearest
from softnlp.base.ranges import noise_note, unit_note
from softnlp.base.reading import choices, read_text, shown
from softnlp.model.contact_settings import CLOSURES, ContactSettings, ContactTask
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.materials import Material, load_materials
from softnlp.model.outlined import require_round_layout
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.model.segments import require_one_segment
from softnlp.rings import ALL_CONVENTIONS
from softnlp.scenario.data import Scenario, require_no_obstacles
from softnlp.scenario.laboratory import import_notes, laboratory_columns
from softnlp.scenario.measured_rows import (
    ALIASES,
    MEASURED_COLUMNS,
    ORIENTATION_COLUMNS,
    SCALARS,
    RobotRows,
    named_columns,
    near_misses,
    rows_by_robot,
)
from softnlp.scenario.registration import import_settings, registration_of, takes_orientations
from softnlp.statics.kept import pose_solver
from softnlp.studies.check import Check
from softnlp.studies.compare import SHAPES, compare
from softnlp.studies.comparison import Comparison
from softnlp.studies.measurements import Measurements
from softnlp.studies.predicted import free_tips
from softnlp.studies.registration import Registration
from softnlp.studies.tip_checks import frame_checks
from softnlp.studies.variants import NAMED, OWN, Variant, every_variant, named_coefficients
from softnlp.sweep.task import WorkspaceTask

Array = NDArray[np.float64]

STUDIES = ("forward", "blocked-force", "workspace")
_TILT, _BACKBONE, _ELONGATION = (OUTPUTS[name] for name in ("tilt", "backbone_length", "elongation"))
_FORCE_COLUMN = SCALARS["blocked_force"].measured
_OWN = ("p1_bar", *MEASURED_COLUMNS)
ALL = "all"


@dataclass(frozen=True)
class Asked:
    """What the caller names; nothing is what the scenario says. shape : of poses, free or blocked."""

    laws: tuple[str, ...] = ()
    coefficients: tuple[str, ...] = ()
    conventions: tuple[str, ...] = ()
    closures: tuple[str, ...] = ()
    shape: str = "free"


@dataclass(frozen=True, eq=False)
class CompareTask:
    """A comparison that can be run.

    path, text : of the file. columns : of it, under the names that this package has for them; header : under its own.
    rows : of each robot, as `measurements`. time : (rows of the file,) [s], nan where there is none. notes : what is
    not compared, and why. warnings : of readings that count as 0.
    """

    scenario: Scenario
    path: Path
    text: str
    columns: Columns
    header: tuple[str, ...]
    rows: tuple[RobotRows, ...]
    measurements: tuple[Measurements, ...]
    variants: tuple[Variant, ...]
    shape: str
    time: Array
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    registration: Registration | None = None


def compare_task(scenario: Scenario, path: str | PathLike[str], asked: Asked = Asked()) -> CompareTask:
    """Return what is to be compared.

    Raises
    ------
    InputError
        For a study without steps at pressures, a file that does not fit, an unknown name.
    """
    _require_study(scenario)
    if asked.shape not in SHAPES:
        raise InputError(f"expected {choices(SHAPES)}, got {shown(asked.shape)}", key="--shape")
    settings = None if scenario.registration is None else import_settings(scenario.registration)
    file, imported = laboratory_columns(Path(), [str(path)], "tips", (*_OWN, *ALIASES), settings)
    text = read_text(Path(path)) if imported is None else imported.csv()
    columns = named_columns(file)
    notes = [*_notes(columns, scenario), *(() if imported is None else import_notes(imported))]
    compared = [name for name in MEASURED_COLUMNS if name in columns]
    if scenario.contact is None and _FORCE_COLUMN in compared:
        compared.remove(_FORCE_COLUMN)
    if not compared:
        known = ", ".join(MEASURED_COLUMNS)
        why = f" ({notes[0]})" if notes else ""
        raise InputError(
            f"expected a column that study {scenario.study!r} can be compared with, of {known}; it has "
            f"{listed(columns.header)}{why}",
            source=columns.file,
        )
    table, sets = scenario.registration, scenario.robot.chamber_sets
    registration = None if table is None else registration_of(table, sets)
    rows, measurements = _measured(scenario, columns)
    if registration is not None:
        measurements = tuple(replace(m, pressure=registration.ordered(np.asarray(m.pressure))) for m in measurements)
    against_wall = scenario.contact is not None and (
        asked.shape == "blocked" or any(np.isfinite(m.blocked_force).any() for m in measurements)
    )
    if asked.shape == "blocked" and scenario.contact is None:
        raise InputError(f"expected a wall; study {scenario.study!r} of {scenario.path} has none", key="--shape")
    if asked.closures and not against_wall:
        raise InputError("expected only where blocked forces are compared", key="--closure")
    if (
        against_wall
        and asked.shape == "free"
        and any(name in compared for name in MEASURED_COLUMNS if name != _FORCE_COLUMN)
    ):
        notes.append("poses are compared with those of the free robot; --shape blocked takes the blocked ones")
    readings = np.concatenate([of_robot.readings().ravel() for of_robot in rows])
    return CompareTask(
        scenario=scenario,
        path=Path(path),
        text=text,
        columns=columns,
        header=file.header,
        rows=rows,
        measurements=measurements,
        variants=_variants(scenario, asked, against_wall),
        shape=asked.shape,
        time=columns.numbers(TIME_COLUMN, blank=True),
        notes=tuple(notes),
        warnings=(*noise_note(readings), *unit_note(readings)),
        registration=registration,
    )


def run_compare(task: CompareTask, progress: Callable[[int, int], None] | None = None) -> Comparison:
    """Simulate what was measured; `progress` is called with how many solves are done and how many there are."""
    asked = task.scenario
    return compare(
        task.measurements,
        task.variants,
        contact=asked.contact or ContactSettings(),
        loads=asked.loads,
        numerics=asked.numerics,
        shape="blocked" if task.shape == "blocked" else "free",
        together=asked.study == "workspace",
        progress=progress,
        registration=task.registration,
    )


def comparison_checks(task: CompareTask, found: Comparison) -> tuple[Check, ...]:
    """Return the checks of the tips that were measured, by the first variant."""
    checks: list[Check] = []
    fit = () if task.registration is None else task.registration.fit
    variant, asked = found.variants[0], task.scenario
    for o, solved in zip(found.observed, found.simulated[0], strict=True):
        placed, rows = solved.registration or Registration(), o.measured[:, :3].all(axis=1)
        model = Model(o.robot, variant.material, variant.coefficients, variant.conventions)
        poses = pose_solver(model, asked.numerics.without_ipopt())
        checks += frame_checks(
            o.pressure[rows],
            o.values[rows, :3],
            solved.values[rows, :3],
            o.robot,
            placed,
            fit,
            lambda P, loads, poses=poses: free_tips(poses, loads, P),  # type: ignore[misc]
            asked.loads,
        )
    return tuple(checks)


def _require_study(scenario: Scenario) -> None:
    """Refuse a scenario that does not say how a pose at a pressure is solved."""
    source = str(scenario.path)
    with located(source=source):
        require_one_segment(scenario.robot, "a comparison with measurements")
        require_round_layout(scenario.robot, "a comparison with measurements")
        require_no_obstacles(scenario, "a comparison with measurements")
    if scenario.study not in STUDIES:
        raise InputError(f"expected {choices(STUDIES)}, got {scenario.study!r}", source=source, key="study")
    task = scenario.task
    if isinstance(task, WorkspaceTask) and task.vary:
        raise InputError(
            "expected none: a measured row is of one robot under one load", source=source, table="workspace", key="vary"
        )
    if isinstance(task, ContactTask):
        several = {"offsets_mm": task.offsets, "target_force_N": task.target_force}
        key = next((key for key, value in several.items() if value is not None), None)
        if task.constrained or key:
            raise InputError(
                "expected the force at each pressure to compare with", source=source, table="contact", key=key or "mode"
            )


def _notes(columns: Columns, scenario: Scenario) -> list[str]:
    """Say what the file has that is not compared."""
    found = []
    if scenario.contact is None and _FORCE_COLUMN in columns:
        found.append(f"{_FORCE_COLUMN} is not compared: study {scenario.study!r} of {scenario.path} has no wall")
    asked = scenario.registration is not None and takes_orientations(scenario.registration)
    if not asked and any(name in columns for names in ORIENTATION_COLUMNS for name in names):
        found.append("orientations are not compared; [registration] tip_sensor_quat_xyzw says how the sensor lies")
    return found + near_misses(columns, (*MEASURED_COLUMNS, "robot", *sum(ORIENTATION_COLUMNS, ())), "not compared")


def _measured(scenario: Scenario, columns: Columns) -> tuple[tuple[RobotRows, ...], tuple[Measurements, ...]]:
    """Return the rows of each robot and what was measured of it."""
    table = scenario.registration
    oriented = table is not None and takes_orientations(table)
    own: dict[str, Robot] = {scenario.robot.name: scenario.robot}
    rows = tuple(rows_by_robot([columns], own, lambda _, row: scenario.robot))
    measurements = []
    for of_robot in rows:
        seen = of_robot.scalars()
        if _ELONGATION.measured not in columns:
            backbone = of_robot.column(_BACKBONE.measured) * _BACKBONE.scale
            seen["elongation"] = backbone - float(of_robot.robot.length)
        if scenario.contact is None:
            seen["blocked_force"] = np.full(len(of_robot.places), np.nan)
        tip, tilt = of_robot.tip_position(), of_robot.column(_TILT.measured) * _TILT.scale
        measurements.append(
            Measurements(
                of_robot.robot,
                of_robot.pressure(),
                tip_position=tip,
                **seen,
                tilt=tilt,
                label=of_robot.label,
                orientation=of_robot.orientation() if oriented else None,
            )
        )
    kept = [k for k, m in enumerate(measurements) if _has_numbers(m)]
    if not kept:
        raise InputError("expected at least one row with something measured, got blank cells", source=columns.file)
    return tuple(rows[k] for k in kept), tuple(measurements[k] for k in kept)


def _has_numbers(m: Measurements) -> bool:
    parts = (m.tip_position, m.bending_angle, m.elongation, m.tilt, m.blocked_force, m.orientation)
    return any(np.isfinite(part).any() for part in parts if part is not None)


def _variants(scenario: Scenario, asked: Asked, against_wall: bool) -> tuple[Variant, ...]:
    contact = scenario.contact or ContactSettings()
    closures: Sequence[str | None] = [_known(name, CLOSURES, "--closure") for name in dict.fromkeys(asked.closures)]
    conventions = [_conventions(name) for name in dict.fromkeys(asked.conventions)] or [scenario.conventions]
    return every_variant(
        _materials(scenario, asked.laws),
        _coefficients(scenario.coefficients, asked.coefficients),
        conventions,
        (closures or [contact.closure_name]) if against_wall else [None],
    )


def _conventions(name: str) -> Conventions:
    return ALL_CONVENTIONS[_known(name.replace("-", "_"), ALL_CONVENTIONS, "--conventions")]


def _coefficients(given: Coefficients, names: Sequence[str]) -> dict[str, Coefficients]:
    """Return the coefficients that are named, or those of the scenario under the name that they have."""
    if names:
        known = [_known(name, (*NAMED, OWN), "--coefficients") for name in dict.fromkeys(names)]
        return {name: given if name == OWN else named_coefficients(name, given) for name in known}
    named = (name for name in NAMED if vars(named_coefficients(name, given)) == vars(given))
    return {next(named, OWN): given}


def _materials(scenario: Scenario, names: Sequence[str]) -> tuple[Material, ...]:
    """Return the scenario's silicone with each law that is named; "all" are those that its constants are known of."""
    own = scenario.material
    if not names:
        return (own,)
    table = tomllib.loads(scenario.text)["material"]
    known: dict[str, Material] = {own.law.name: own}
    if "constants" not in table and "formula" not in table:
        file = scenario.path.parent / table["file"] if "file" in table else None
        models = load_materials(file)[own.name].chosen(table.get("set")).models
        known = {law: replace(found, density=own.density) for law, found in models.items()} | known
        known = {law: known[law] for law in models}
    wanted = [law for name in names for law in (known if name == ALL else (name,))]
    return tuple(known[_known(law, known, "--law")] for law in dict.fromkeys(wanted))


def _known(name: str, names: Mapping[str, object] | Sequence[str], key: str) -> str:
    if name not in names:
        raise InputError(f"expected {choices(names)}, got {shown(name)}{nearest(name, names)}", key=key)
    return name
