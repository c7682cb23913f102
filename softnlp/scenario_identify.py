"""The tables of a scenario of `identify` with the files that they name, in SI units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from softnlp.columns import Columns, read_columns
from softnlp.conventions import Coefficients
from softnlp.errors import InputError, listed, nearest
from softnlp.laws import LAWS, Law
from softnlp.materials import Material
from softnlp.measured_rows import SCALARS, RobotRows, rows_by_robot
from softnlp.ranges import noise_note
from softnlp.reading import shown
from softnlp.robot import Robot
from softnlp.scenario_schema import ContactTable, RobotTable
from softnlp.schema_identify import IdentifyFile, MeasurementsTable, SigmaTable, TensileTable
from softnlp.studies.free_constants import free_constants
from softnlp.studies.identify_task import RobotTask, TensileTask
from softnlp.studies.measurements import Measurements, checked_measurements
from softnlp.units import MEGAPASCAL, MILLIMETRE

Array = NDArray[np.float64]
T = TypeVar("T")
RobotMaker = Callable[[RobotTable], Robot]

FILE_KEYS: Mapping[str, tuple[str, float]] = {"tip_position": ("tip_position_mm", MILLIMETRE), **SCALARS}
"""What an observable is called in files, and its unit there."""

UNUSED_BY_TENSILE = ("robots", "sigma", "contact", "gravity", "tip_load", "stiffening", "corrections", "solver")
_UNUSED_CONTACT = ("offsets_mm", "offset_ramp", "target_force_N")


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
        return _located("tensile", lambda: _tensile(given, tensile))
    if measured is None or tensile is not None:
        got = "neither" if measured is None else "both"
        raise InputError(f"expected a table [tensile] or a table [measurements], got {got}", table="measurements")
    if "material" not in given.written:
        raise InputError("missing; expected a table with name and model", table="material")
    _refuse_contact(file.contact)
    return _located("measurements", lambda: _robots(given, measured))


def _located(table: str, build: Callable[[], T]) -> T:
    try:
        return build()
    except InputError as error:
        raise error.located(table=table) from None


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
    return TensileTask(
        stretch=np.concatenate([stretch for stretch, _ in parts]),
        stress=np.concatenate([stress for _, stress in parts]),
        file_of_point=np.repeat(np.arange(len(files)), [len(stretch) for stretch, _ in parts]),
        files=files,
        laws=_laws(table, before),
        name=table.name or (before.name if before is not None else "My silicone"),
        density=table.density_kg_m3 or float(given.material.density),
        start=None if before is None else {k: float(v) for k, v in before.constants.items()},
        before=before,
    )


def _laws(table: TensileTable, before: Material | None) -> tuple[Law, ...]:
    """Return the laws that are named; by default every built-in one and a law of the scenario's own."""
    known = dict(LAWS)
    if before is not None:
        known[before.law.name] = before.law
    for name in table.laws or ():
        if name not in known:
            raise InputError(f"unknown law {shown(name)}{nearest(name, known)}", key="laws")
    return tuple(known[name] for name in dict.fromkeys(table.laws or known))


def _curve(columns: Columns, table: TensileTable) -> tuple[Array, Array]:
    """Return stretch and engineering stress [Pa] of one file."""
    if "stretch" in columns or "stress_MPa" in columns:
        for name in ("stretch", "stress_MPa"):
            if name not in columns:
                raise InputError(f"{columns.file}: missing column {name!r}", key="file")
        stretch, stress = columns.numbers("stretch"), columns.numbers("stress_MPa") * MEGAPASCAL
    elif "displacement_mm" in columns and "force_N" in columns:
        if table.gauge_length_mm is None:
            raise InputError("missing; displacement_mm needs the length that was stretched", key="gauge_length_mm")
        stretch = 1 + columns.numbers("displacement_mm") / table.gauge_length_mm
        stress = columns.numbers("force_N") / _area(table)
        if table.stress == "true":
            raise InputError("expected 'engineering': force over the specimen's size is no true stress", key="stress")
    else:
        raise InputError(
            f"{columns.file}: expected columns stretch, stress_MPa or displacement_mm, force_N; it has "
            f"{listed(columns.header)}",
            key="file",
        )
    for row in np.flatnonzero(~(stretch > 0))[:1]:
        raise columns.wrong(int(row), columns.header[0], f"expected a stretch above 0, got {stretch[row]:g}")
    return stretch, stress / stretch if table.stress == "true" else stress


def _area(table: TensileTable) -> float:
    """Return the specimen's cross-section before the test [m^2]."""
    flat = [table.width_mm, table.thickness_mm]
    if (table.diameter_mm is None) == (flat == [None, None]):
        raise InputError("expected either diameter_mm, or width_mm and thickness_mm", key="diameter_mm")
    if table.diameter_mm is not None:
        return float(np.pi / 4 * (table.diameter_mm * MILLIMETRE) ** 2)
    for key, value in (("width_mm", table.width_mm), ("thickness_mm", table.thickness_mm)):
        if value is None:
            raise InputError("missing; expected width_mm and thickness_mm", key=key)
    assert table.width_mm is not None
    assert table.thickness_mm is not None
    return table.width_mm * table.thickness_mm * MILLIMETRE**2


# --- measurements of robots -------------------------------------------------------------------------------------------


def _robots(given: Given, table: MeasurementsTable) -> RobotTask:
    tables = [read_columns(given.folder, file) for file in _files(table)]
    own = {name: _located(f"robots.{name}", partial(given.make_robot, t)) for name, t in given.file.robots.items()}
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
    for key, (name, unit) in FILE_KEYS.items():
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
