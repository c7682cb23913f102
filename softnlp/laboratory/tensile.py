"""A tensile test as a machine wrote it: engineering stress over stretch, of the part that is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.units import MEGAPASCAL
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.imported import ANY, Imported, require_possible
from softnlp.laboratory.signals import break_row, enclosed_area, relaxing
from softnlp.laboratory.specimen import ACROSS, ALONG, STRETCH, Curve, curve_of, specimens
from softnlp.laboratory.table import RawTable
from softnlp.studies.check import Check
from softnlp.studies.cycles import CYCLES, Leg, legs
from softnlp.studies.plausibility import LARGEST_STRETCH, curve_checks, stiffness_checks

Array = NDArray[np.float64]

_POSSIBLE = 12.0  # what is stretched further than usual up to here is cut to where robots are; beyond, it is no stretch
_USUAL = (1.0, 2.0)


def import_tensile(tables: Sequence[RawTable], choices: Choices) -> Imported:
    """Return stretch and engineering stress of the specimens of some files, which count as one test.

    Raises
    ------
    AskError
        Where a unit, a size or a column is not known, or the curve cannot be that of a silicone.
    InputError
        For settings that do not fit.
    """
    curves = [tared(curve_of(part, choices), choices) for table in tables for part in specimens(table, choices)]
    parts: list[Curve] = []
    numbers: dict[str, float] = {}
    cycles = 1
    for curve in curves:
        part, found, count = _used(curve, choices)
        numbers |= found if not numbers else {}
        cycles = max(cycles, count)
        parts.append(part)
    whole = np.concatenate([np.column_stack([c.stretch, c.stress]) for c in curves])
    stretch, stress = np.concatenate([part.stretch for part in parts]), np.concatenate([part.stress for part in parts])
    stretch, stress = _cut(stretch, stress, choices)
    if stretch.size < 3:
        raise InputError(f"{stretch.size} points are left, too few for a tensile test")
    checks = [*(check for curve in curves for check in curve.checks), *_cycle_checks(cycles, choices)]
    checks.append(_held_check(parts, choices))
    checks += [*curve_checks(stretch, stress), *stiffness_checks(stretch, stress)]
    require_possible(checks, choices)
    columns = {"stretch": stretch, "stress_MPa": stress / MEGAPASCAL}
    numbers["shear_modulus_MPa"] = next((c.value for c in checks if c.name == "shear modulus of the data"), np.nan)
    path = np.column_stack([whole[:, 0], whole[:, 1] / MEGAPASCAL])
    files = tuple(table.file for table in tables)
    return Imported("tensile", files, columns, tuple(checks), choices, numbers, path)


def _used(curve: Curve, choices: Choices) -> tuple[Curve, dict[str, float], int]:
    """Return the part of a curve that is asked for, what is reported of all of it, and how many loadings it has."""
    every = legs(curve.stretch)
    loadings = [leg for leg in every if leg.rising]
    unloadings = [leg for leg in every if not leg.rising]
    if not loadings:
        raise InputError("the stretch only falls: a test in compression, or extension and force have the other sign")
    asked = choices.get("cycle")
    if asked is None:
        reason = f"{len(loadings)} loadings; the first is that of a new specimen" if len(loadings) > 1 else ""
        asked = choices.take("cycle", CYCLES[0], reason) if reason else CYCLES[0]
    if asked == "all":
        chosen = Leg(0, len(curve.stretch), True)
    elif asked == "first loading":
        chosen = loadings[0]
    elif asked == "unloading" and unloadings:
        chosen = unloadings[0]
    elif isinstance(asked, int) and not isinstance(asked, bool) and 1 <= asked <= len(loadings):
        chosen = loadings[asked - 1]
    else:
        known = f"'first loading', 'unloading', 'all' or 1 to {len(loadings)}"
        raise InputError(
            f"expected {known}, got {shown(asked)}; the test has {len(unloadings)} unloadings", key="cycle"
        )
    numbers = _reported(curve, loadings, unloadings)
    part = curve.kept(slice(chosen.first, chosen.end))
    if not chosen.rising:
        part = part.kept(slice(None, None, -1))
    if asked != "all":
        end = break_row(part.stress)
        if end < len(part.stress):
            numbers["break_at_stretch"] = float(part.stretch[end])
            choices.drop(len(part.stress) - end - 1, "points after the break")
            part = part.kept(slice(0, end + 1))
        choices.drop(len(curve.stretch) - (chosen.end - chosen.first), "rows of other cycles")
    return part, numbers, len(loadings)


def _reported(curve: Curve, loadings: Sequence[Leg], unloadings: Sequence[Leg]) -> dict[str, float]:
    """Return the hysteresis of the first cycle and the loss from the first to the second loading, as parts."""
    found: dict[str, float] = {"loadings": float(len(loadings))}
    work = [enclosed_area(curve.stretch[a:b], curve.stress[a:b]) for a, b, _ in (*loadings[:2], *unloadings[:1])]
    if unloadings and work[0] > 0:
        found["hysteresis"] = 1 - abs(work[-1]) / work[0]
    if len(loadings) > 1 and work[0] > 0:
        found["first_cycle_loss"] = 1 - work[1] / work[0]
    return found


def _cycle_checks(cycles: int, choices: Choices) -> list[Check]:
    """Return the check of a test whose cycles are all taken as one."""
    if choices.used.get("cycle") != "all" or cycles < 2:
        return []
    likely = "loading, unloading and later cycles of one specimen differ; --set cycle='first loading' keeps one"
    return [Check("load cycles taken as one test", cycles, (1, 1), ANY, likely)]


def _held_check(parts: Sequence[Curve], choices: Choices) -> Check:
    """Return the check of rows that are kept though the stretch is held and the stress relaxes."""
    limits = choices.used.get("stretch", (-np.inf, np.inf))
    kept = [part.kept(np.flatnonzero(_within(part.stretch, limits))) for part in parts]
    kept = [part for part in kept if part.stretch.size]
    held = sum(relaxing(part.stretch, part.stress) for part in kept)
    share = held / sum(part.stretch.size for part in kept)
    top = max(float(np.max(part.stretch)) for part in kept)
    likely = (
        f"the stress relaxes while the stretch is held; stretch=[1, {0.995 * top:.4g}] leaves a hold at the end out"
    )
    return Check("share of rows in which the stress relaxes", share, (0, 0.02), ANY, likely)


def _cut(stretch: Array, stress: Array, choices: Choices) -> tuple[Array, Array]:
    """Return the points within the range of stretch that is asked for."""
    limits = choices.numbers("stretch", 2)
    if limits is None and LARGEST_STRETCH[0][1] < np.max(stretch) <= _POSSIBLE and np.min(stretch) < _USUAL[1]:
        reason = f"the test goes to {np.max(stretch):.3g}; robots stretch less, and a law fits the range it is used in"
        limits = choices.take("stretch", list(_USUAL), f"{reason}; stretch=[1, {np.max(stretch):.3g}] takes it all")
    if limits is None:
        return stretch, stress
    kept = _within(stretch, limits)
    choices.drop(int(np.sum(~kept)), f"points outside stretch = {list(limits)}")
    return stretch[kept], stress[kept]


def _within(stretch: Array, limits: Sequence[float]) -> NDArray[np.bool_]:
    kept: NDArray[np.bool_] = (stretch >= limits[0] - 1e-9) & (stretch <= limits[1] + 1e-9)
    return kept


def tared(curve: Curve, choices: Choices) -> Curve:
    """Return a curve without what is to be taken off: a tare of the force, a preload, and the slack of its toe."""
    tare = choices.get("tare")
    stretch, stress = curve.stretch, curve.stress
    if tare == "start":
        stress = stress - stress[0]
    elif isinstance(tare, int | float) and not isinstance(tare, bool):
        stress = stress - _as_stress(curve, float(tare), "tare")
    elif tare is not None:
        raise InputError(f"expected 'start' or a force in N, got {shown(tare)}", key="tare")
    preload = choices.number("preload_N")
    if preload is not None:
        above = np.flatnonzero(stress >= _as_stress(curve, preload, "preload_N"))
        if not above.size:
            raise InputError("no row reaches this force", key="preload_N")
        choices.drop(int(above[0]), "rows before the preload")
        stretch, stress = stretch[above[0] :] / stretch[above[0]], stress[above[0] :]
    toe = choices.get("toe")
    if toe is not None:
        stretch, stress = _without_toe(stretch, stress, toe, choices)
    return replace(curve, stretch=stretch, stress=stress)


def _as_stress(curve: Curve, force: float, key: str) -> float:
    """Return a force [N] over the specimen's area [Pa]."""
    if curve.area is None:
        raise AskError("a force needs the specimen's area: --set area_mm2=…", key=key)
    return force / curve.area


def _without_toe(stretch: Array, stress: Array, toe: object, choices: Choices) -> tuple[Array, Array]:
    """Return a curve from where its first straight part meets zero stress, which becomes stretch 1."""
    if toe == "auto":
        top = float(np.max(stress))
        straight = np.flatnonzero((stress > 0.05 * top) & (stress < 0.25 * top))
        if straight.size < 3:
            raise InputError("too few points between 5 and 25 % of the largest stress", key="toe")
        slope, offset = np.polyfit(stretch[straight], stress[straight], 1)
        begins = float(-offset / slope)
    elif isinstance(toe, int | float) and not isinstance(toe, bool) and toe > 0:
        begins = float(toe)
    else:
        raise InputError(f"expected 'auto' or the stretch at which the specimen is taut, got {shown(toe)}", key="toe")
    kept = stretch >= begins
    choices.drop(int(np.sum(~kept)), "rows of the toe")
    return stretch[kept] / begins, stress[kept]


def is_tensile(table: RawTable) -> bool:
    """Whether a table is of a testing machine: a stretch and a stress, or an extension and a force."""
    pressure = any(unit is not None and unit.kind == "pressure" for unit in table.units)  # perhaps a stress P
    return bool(table.named(ALONG) and table.named(ACROSS, r"rate|cell")) or bool(table.named(STRETCH) and pressure)
