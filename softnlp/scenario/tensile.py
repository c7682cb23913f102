"""A tensile test of a scenario of `identify`: its table, its files as a task in SI units, and the fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainValidator

from softnlp.base.csv_columns import Columns
from softnlp.base.errors import InputError, listed, located, nearest
from softnlp.base.reading import choices, shown
from softnlp.base.statistics import NOTHING
from softnlp.base.units import KILOPASCAL, MEGAPASCAL, MILLIMETRE
from softnlp.model.laws import LAWS, Law
from softnlp.model.materials import Material
from softnlp.scenario.data import Read, Scenario
from softnlp.scenario.laboratory import import_notes, laboratory_columns
from softnlp.scenario.schema import FileName, ImportSettings, Label, Positive, optional_keys, wrong
from softnlp.studies.check import Check
from softnlp.studies.cycles import CYCLES
from softnlp.studies.measurements import TensileTask
from softnlp.studies.plausibility import area_check, divisor_checks, percent_check, stiffness_checks, true_checks

if TYPE_CHECKING:  # imported where needed: to read a scenario takes none of them
    from softnlp.studies.tensile import LawFit, TensileFit

Array = NDArray[np.float64]

_STRETCHES: Mapping[str, tuple[float, float]] = {"stretch": (1, 0), "strain": (1, 1), "strain_percent": (0.01, 1)}
_STRESSES: Mapping[str, float] = {"stress_MPa": MEGAPASCAL, "stress_kPa": KILOPASCAL, "stress_Pa": 1.0}
_SIZES: Mapping[str, tuple[float, float]] = {
    "gauge_length_mm": (0.5, 2000.0),
    **{"width_mm": (0.1, 500.0), "thickness_mm": (0.02, 500.0), "diameter_mm": (0.1, 500.0)},
}
_OWN = (*_STRETCHES, *_STRESSES, "displacement_mm", "force_N")
_OF_IMPORT = (*_SIZES, "area_mm2", "cycle", "stretch")
_ROUNDED = 1e-9  # of a stretch; a point on an end of the range stays


def _cycle(value: Any) -> int | str:
    """Return a loading by its number, or one of the words of an import."""
    if value in CYCLES or (isinstance(value, int) and not isinstance(value, bool) and value > 0):
        return int(value) if isinstance(value, int) else str(value)
    raise wrong(f"expected {choices(CYCLES)} or a number from 1 on, got {shown(value)}")


class DataTable(optional_keys({"import": ImportSettings})):  # type: ignore[misc]
    """What every table with data may hold: one file or several.

    file : CSV with what was measured, or a file as a laboratory wrote it; as in "measured.csv"
    files : several of them; as in ["first.csv", "second.csv"]
    import : settings of a file as a laboratory wrote it; as in { "unit.stress" = "kPa" }
    """

    file: FileName | None = None
    files: Annotated[list[FileName], Field(min_length=1)] | None = None

    def named(self) -> tuple[str, ...]:
        """Return the files that are named; raises `InputError` unless one of the keys is there."""
        if (self.file is None) == (self.files is None):
            raise InputError("expected exactly one of file, files", key="file")
        return (self.file,) if self.file is not None else tuple(self.files or ())


class TensileTable(DataTable):
    """[tensile]: tests of one silicone, and the laws to fit.

    name : of the silicone in the materials file that is written; by default that of [material]; as in "My silicone"
    laws : to fit; by default all; as in ["mooney-rivlin", "yeoh"]
    stress : what stress_MPa means
    gauge_length_mm : of the specimen, for displacement_mm; as in 25.0
    width_mm : of a flat specimen, for force_N; as in 4.0
    thickness_mm : of a flat specimen; as in 2.0
    diameter_mm : of a round specimen; as in 6.0
    area_mm2 : in place of these sizes; as in 8.0
    cycle : of several load cycles: "first loading", the number of a loading, "unloading" or "all";
        by default "first loading"; as in 1
    stretch : only points from the first to the second stretch are fitted; by default all; as in [1.0, 2.0]
    density_kg_m3 : of the silicone; by default that of [material]; as in 1070.0
    """

    name: Label | None = None
    laws: Annotated[list[str], Field(min_length=1)] | None = None
    stress: Literal["engineering", "true"] = "engineering"
    gauge_length_mm: Positive | None = None
    width_mm: Positive | None = None
    thickness_mm: Positive | None = None
    diameter_mm: Positive | None = None
    area_mm2: Positive | None = None
    cycle: Annotated[int | str | None, PlainValidator(_cycle)] = None
    stretch: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None
    density_kg_m3: Positive | None = None


def tensile_task(given: Read, table: TensileTable) -> TensileTask:
    """Return the laws and the points that they are fitted to."""
    files = table.named()
    settings = getattr(table, "import")
    if settings is None and table.cycle is not None:
        settings = {}
    asked = {key: getattr(table, key) for key in _OF_IMPORT if getattr(table, key) is not None}
    every = [laboratory_columns(given.folder, [file], "tensile", _OWN, settings, asked) for file in files]
    parts = [_curve(columns, table, imported is not None) for columns, imported in every]
    imports = tuple(imported for _, imported in every if imported is not None)
    before = given.material if "material" in given.data else None
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
        notes=tuple(note for imported in imports for note in import_notes(imported)),
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


def _curve(columns: Columns, table: TensileTable, imported: bool) -> tuple[Array, Array, tuple[Check, ...]]:
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
        checks = (percent_check(stretch),) if name == "strain_percent" else ()
        checks += true_checks(stretch, stress) if table.stress == "true" else ()
        if "force_N" in columns:
            checks += divisor_checks(columns.numbers("force_N", blank=True), stress)
    else:
        raise InputError(
            f"{columns.file}: expected columns stretch, stress_MPa or displacement_mm, force_N; it has "
            f"{listed(columns.header)}",
            key="file",
        )
    for row in np.flatnonzero(~(stretch > 0))[:1]:
        strain = "; strain goes in a column strain or strain_percent" if name == "stretch" else ""
        raise columns.wrong(int(row), name, f"expected a stretch above 0, got {stretch[row]:g}{strain}")
    stress = stress / stretch if table.stress == "true" and not imported else stress
    return stretch, stress, (*checks, *stiffness_checks(stretch, stress))


def _first(columns: Columns, known: Mapping[str, object]) -> str:
    """Return the first known column that the file has."""
    for name in known:
        if name in columns:
            return name
    first, *others = known
    raise InputError(f"{columns.file}: missing column {first!r} (or {', '.join(others)})", key="file")


def _area(table: TensileTable) -> float:
    """Return the specimen's cross-section before the test [mm^2]."""
    if table.area_mm2 is not None:
        table.refuse(("diameter_mm", "width_mm", "thickness_mm"), "not used beside area_mm2; remove it")
        return table.area_mm2
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


def run_tensile(scenario: Scenario) -> TensileFit:
    """Fit the laws that a tensile test asks for.

    Raises
    ------
    InputError
        As `softnlp.fit_tensile`.
    """
    from softnlp.studies.tensile import fit_tensile

    task = scenario.task
    assert isinstance(task, TensileTask)
    with located(source=str(scenario.path), table="tensile"):
        fit = fit_tensile(
            task.stretch,
            task.stress,
            task.laws,
            name=task.name,
            density=task.density,
            start=task.start,
            numerics=scenario.numerics,
            read=task.checks,
        )
    fits = {name: replace(law, warnings=(*law.warnings, *_further(task, law))) for name, law in fit.fits.items()}
    return replace(fit, fits=fits)


def _further(task: TensileTask, fit: LawFit) -> tuple[str, ...]:
    """Say whether a fitted law is further from the data than the material before."""
    from softnlp.studies.tensile import tensile_misfit

    before = task.before
    was = np.inf if before is None else tensile_misfit(before, task.stretch, task.stress).rmse
    if before is None or not fit.misfit.rmse > was * (1 + NOTHING):
        return ()
    return (f"it is further from the data than {before.name} ({before.law.name}) before, by the rms error",)
