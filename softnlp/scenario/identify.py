"""The tables of a scenario of `identify` with the files that they name, in SI units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.csv_columns import Columns, read_columns
from softnlp.base.errors import InputError, listed, located, nearest
from softnlp.base.ranges import noise_note
from softnlp.base.reading import shown
from softnlp.base.units import KILOPASCAL, MEGAPASCAL, MILLIMETRE
from softnlp.model.conventions import Coefficients
from softnlp.model.laws import LAWS, Law
from softnlp.model.materials import Material
from softnlp.model.robot import Robot
from softnlp.scenario.measured_rows import RobotRows, rows_by_robot
from softnlp.scenario.schema import ContactTable, RobotTable
from softnlp.scenario.schema_identify import IdentifyFile, MeasurementsTable, SigmaTable, TensileTable
from softnlp.studies.identified import free_constants
from softnlp.studies.measurements import OBSERVABLES, Measurements, RobotTask, TensileTask, checked_measurements
from softnlp.studies.plausibility import Check, area_check

Array = NDArray[np.float64]
T = TypeVar("T")
RobotMaker = Callable[[RobotTable], Robot]

UNUSED_BY_TENSILE = ("robots", "sigma", "contact", "gravity", "tip_load", "stiffening", "corrections")
_UNUSED_CONTACT = ("offsets_mm", "offset_ramp", "target_force_N")
_STRETCHES: Mapping[str, tuple[float, float]] = {"stretch": (1, 0), "strain": (1, 1), "strain_percent": (0.01, 1)}
_STRESSES: Mapping[str, float] = {"stress_MPa": MEGAPASCAL, "stress_kPa": KILOPASCAL, "stress_Pa": 1.0}
_SIZES: Mapping[str, tuple[float, float]] = {
    "gauge_length_mm": (0.5, 2000.0),
    **{"width_mm": (0.1, 500.0), "thickness_mm": (0.02, 500.0), "diameter_mm": (0.1, 500.0)},
}
_ROUNDED = 1e-9  # of a stretch; a point on an end of the range stays


class Given(NamedTuple):
    """What the reader takes: the checked tables, those that were written, [robot], [material], folder, robot maker."""

    file: IdentifyFile
    written: Mapping[str, Any]
    robot: Robot
    material: Material
    folder: Path
    make_robot: RobotMaker


def identify_task(given: Given) -> TensileTask | RobotTask:
    """Return what is to be identified.

    Raises
    ------
    InputError
        With table and key, for tables that do not go together and files that do not fit.
    """
    file = given.file
    tensile, measured = file.tensile, file.measurements
    if tensile is not None and measured is None:
        for name in UNUSED_BY_TENSILE:
            if name in given.written:
                raise InputError("this table is not used by a tensile test; remove it", table=name)
        for key in sorted(file.solver.model_fields_set - {"engine", "ipopt"}):
            raise InputError("not used by a tensile test; remove it", table="solver", key=key)
        with located(table="tensile"):
            return _tensile(given, tensile)
    if measured is None or tensile is not None:
        got = "neither" if measured is None else "both"
        raise InputError(f"expected a table [tensile] or a table [measurements], got {got}", table="measurements")
    if "material" not in given.written:
        raise InputError("missing; expected a table with name and model", table="material")
    _refuse_contact(file.contact)
    with located(table="measurements"):
        return _robots(given, measured)


def _refuse_contact(table: ContactTable) -> None:
    """Refuse what means nothing to a measured blocked force."""
    for key in _UNUSED_CONTACT:
        if getattr(table, key) is not None:
            raise InputError("not used by study 'identify'; the wall stands at offset_mm", table="contact", key=key)
    if table.mode != "blocked" or table.closure == "weighted":
        key = "mode" if table.mode != "blocked" else "closure"
        raise InputError("expected a wall and the closure free, compliant or rigid", table="contact", key=key)


def _files(table: TensileTable | MeasurementsTable) -> tuple[str, ...]:
    if (table.file is None) == (table.files is None):
        raise InputError("expected exactly one of file, files", key="file")
    return (table.file,) if table.file is not None else tuple(table.files or ())


# --- tensile tests ----------------------------------------------------------------------------------------------------


def _tensile(given: Given, table: TensileTable) -> TensileTask:
    files = _files(table)
    parts = [_curve(read_columns(given.folder, file), table) for file in files]
    before = given.material if "material" in given.written else None
    laws = _laws(table, before)
    stretch, stress = (np.concatenate(column) for column in zip(*(part[:2] for part in parts), strict=True))
    kept = _kept(table, stretch, laws)
    return TensileTask(
        stretch=stretch[kept],
        stress=stress[kept],
        file_of_point=np.repeat(np.arange(len(files)), [len(part[0]) for part in parts])[kept],
        files=files,
        laws=laws,
        name=table.name or (before.name if before is not None else "My silicone"),
        density=table.density_kg_m3 or float(given.material.density),
        start=None if before is None else {k: float(v) for k, v in before.constants.items()},
        before=before,
        stretch_range=None if table.stretch is None else (table.stretch[0], table.stretch[1]),
        dropped=int(np.sum(~kept)),
        checks=tuple(dict.fromkeys(check for part in parts for check in part[2])),
    )


def _kept(table: TensileTable, stretch: Array, laws: Sequence[Law]) -> NDArray[np.bool_]:
    """Return which points the laws are fitted to: those within the key stretch."""
    kept = np.ones(stretch.size, bool)
    if table.stretch is None:
        return kept
    low, high = table.stretch
    if not high > max(low, 1):
        raise InputError(
            f"expected [lowest, highest], the highest above the lowest and 1, got {table.stretch}", key="stretch"
        )
    kept = (stretch >= low - _ROUNDED) & (stretch <= high + _ROUNDED)
    need = max(laws, key=lambda law: len(law.constants))
    if np.sum(kept) < len(need.constants) or not np.any(stretch[kept] > 1 + 1e-6):
        raise InputError(
            f"leaves {np.sum(kept)} of {stretch.size} points, too few for law {need.name!r} with {len(need.constants)} "
            f"constants; the data go from {np.min(stretch):.4g} to {np.max(stretch):.4g}",
            key="stretch",
        )
    return kept


def _laws(table: TensileTable, before: Material | None) -> tuple[Law, ...]:
    """Return the laws that are named; by default every built-in one and a law of the scenario's own."""
    known = dict(LAWS)
    if before is not None:
        known[before.law.name] = before.law
    for name in table.laws or ():
        if name not in known:
            raise InputError(f"unknown law {shown(name)}{nearest(name, known)}", key="laws")
    return tuple(known[name] for name in dict.fromkeys(table.laws or known))


def _curve(columns: Columns, table: TensileTable) -> tuple[Array, Array, tuple[Check, ...]]:
    """Return stretch and engineering stress [Pa] of one file, with the checks of its specimen."""
    checks: tuple[Check, ...] = ()
    named = "stretch" in columns or "stress_MPa" in columns
    if not named and "displacement_mm" in columns and "force_N" in columns:
        name = "displacement_mm"
        stretch = 1 + columns.numbers(name) / _size(table, "gauge_length_mm")
        area = _area(table)
        stress, checks = columns.numbers("force_N") / (area * MILLIMETRE**2), (area_check(area),)
        if table.stress == "true":
            raise InputError("expected 'engineering': force over the specimen's size is no true stress", key="stress")
    elif named or any(name in columns for name in (*_STRETCHES, *_STRESSES)):
        name, of_stress = _first(columns, _STRETCHES), _first(columns, _STRESSES)
        factor, zero = _STRETCHES[name]
        stretch, stress = zero + factor * columns.numbers(name), columns.numbers(of_stress) * _STRESSES[of_stress]
    else:
        raise InputError(
            f"{columns.file}: expected columns stretch, stress_MPa or displacement_mm, force_N; it has "
            f"{listed(columns.header)}",
            key="file",
        )
    for row in np.flatnonzero(~(stretch > 0))[:1]:
        strain = "; strain goes in a column strain or strain_percent" if name == "stretch" else ""
        raise columns.wrong(int(row), name, f"expected a stretch above 0, got {stretch[row]:g}{strain}")
    return stretch, stress / stretch if table.stress == "true" else stress, checks


def _first(columns: Columns, known: Mapping[str, object]) -> str:
    """Return the first known column that the file has."""
    for name in known:
        if name in columns:
            return name
    first, *others = known
    raise InputError(f"{columns.file}: missing column {first!r} (or {', '.join(others)})", key="file")


def _area(table: TensileTable) -> float:
    """Return the specimen's cross-section before the test [mm^2]."""
    if (table.diameter_mm is None) == (table.width_mm is None and table.thickness_mm is None):
        raise InputError("expected either diameter_mm, or width_mm and thickness_mm", key="diameter_mm")
    if table.diameter_mm is not None:
        return float(np.pi / 4 * _size(table, "diameter_mm") ** 2)
    return _size(table, "width_mm") * _size(table, "thickness_mm")


def _size(table: TensileTable, key: str) -> float:
    """Return a size of the specimen [mm]."""
    value, (low, high) = getattr(table, key), _SIZES[key]
    if value is None:
        what = "displacement_mm needs the length that was stretched" if key == "gauge_length_mm" else "force_N needs it"
        raise InputError(f"missing; {what}", key=key)
    if not low <= value <= high:
        unit = "m" if value < low else "micrometres"
        raise InputError(f"expected {low:g} to {high:g} mm, got {value:g}; it looks like {unit}", key=key)
    return float(value)


# --- measurements of robots -------------------------------------------------------------------------------------------


def _robots(given: Given, table: MeasurementsTable) -> RobotTask:
    tables = [read_columns(given.folder, file) for file in _files(table)]
    own = {}
    for name, described in given.file.robots.items():
        with located(table=f"robots.{name}"):
            own[name] = given.make_robot(described)
    header = tuple(dict.fromkeys(name for columns in tables for name in columns.header))
    for columns in tables:
        if "robot" not in columns and "robot" not in given.written:
            raise InputError(f"{columns.file}: expected a column robot, or a table [robot] for every row", key="file")

    def unnamed(columns: Columns, row: int) -> Robot:
        if "robot" in given.written:
            return given.robot
        raise columns.wrong(row, "robot", "expected a name, or a table [robot] for rows without one")

    made, cells, readings = [], [], []
    for rows in rows_by_robot(tables, own, unnamed):
        readings.append(rows.readings().ravel())
        made.append(_measurements(rows, given.file.sigma))
        cells.append(tuple(tuple(_cell(c, k, column) for column in header) for c, k in rows.places))
    free, bounds = _free(table, given.material)
    return RobotTask(tuple(made), free, bounds, header, tuple(cells), noise_note(np.concatenate(readings)))


def _cell(columns: Columns, row: int, name: str) -> str:
    return columns.rows[row][columns.header.index(name)].strip() if name in columns else ""


def _measurements(rows: RobotRows, sigmas: SigmaTable) -> Measurements:
    """Return the measurements of one robot."""
    pressure = rows.pressure()
    seen = rows.scalars()
    count = len(pressure)
    sigma: dict[str, Array] = {}
    for key in OBSERVABLES:
        name, unit = OUTPUTS[key].key, OUTPUTS[key].scale
        measured = seen.get(key, np.full(count, np.nan))
        per_row = rows.column(f"sigma_{name}") * unit
        percent = getattr(sigmas, f"{key}_percent", None)
        absolute = getattr(sigmas, name)
        if percent is not None and absolute is not None:
            raise InputError(f"expected one of {name}, {key}_percent", table="sigma", key=name)
        general = np.full(count, np.nan)
        if absolute is not None:
            general = np.full(count, absolute * unit)
        elif percent is not None:
            general = percent / 100 * np.abs(measured)
        values = np.where(np.isnan(per_row), general, per_row)
        if not np.all(np.isnan(values)):
            sigma[key] = values
    weight = rows.column("weight")
    made = Measurements(
        rows.robot,
        pressure,
        tip_position=rows.tip_position(),
        **seen,
        sigma=sigma,
        weight=np.where(np.isnan(weight), 1.0, weight),
        label=rows.label,
    )
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
