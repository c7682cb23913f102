"""What is drawn and listed of a motion: where the tip moves, pressures and energies over time."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, nan

import numpy as np

from softnlp.base.columns import MM
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.statics.step import Step

QUANTITIES = {
    "tip": ("Where the tip moves", f"tip moved by [{MM}]"),
    "pressure": ("Pressures in the chambers and at the regulators", "pressure [bar]"),
    "energy": ("Energies and works", "energy [mJ]"),
}
"""What can be drawn: words and axis."""
_ENERGIES = ("kinetic", "elastic", "gravity", "pressure_work", "load_work", "dissipated", "numerical")
_FEW = 3  # sets of which a table shows the pressures
_COUNTS = 1e-4  # of the largest energy: what is drawn


def curves(steps: Sequence[Step], quantity: str) -> dict[str, list[float]]:
    """Return what is drawn of steps by name, nan where one has no solution."""
    if quantity == "tip":
        places = _tips(steps)
        known = np.isfinite(places[:, 0])
        moved = (places - places[known.argmax()]) / MILLIMETRE if known.any() else places
        return {axis: moved[:, k].tolist() for k, axis in enumerate("xyz")}
    if quantity == "pressure":
        chambers = np.array([step.pressure for step in steps]) / BAR
        given = [step.pressure if step.moving is None else step.moving.regulator for step in steps]
        regulators = np.array(given) / BAR
        found = {f"set {k + 1}": chambers[:, k].tolist() for k in range(chambers.shape[1])}
        apart = [k for k in range(chambers.shape[1]) if np.abs(regulators[:, k] - chambers[:, k]).max() > 1e-6]
        return found | {f"set {k + 1}, regulator": regulators[:, k].tolist() for k in apart}
    every = {
        name: [nan if step.moving is None else 1e3 * float(step.moving.energy[name]) for step in steps]
        for name in _ENERGIES
    }
    sizes = {name: float(np.nanmax(np.abs(values), initial=0.0)) for name, values in every.items()}
    largest = max(sizes.values())
    return {n.replace("_", " "): values for n, values in every.items() if sizes[n] > _COUNTS * largest}


def table_rows(steps: Sequence[Step]) -> tuple[list[str], list[list[float | str | None]]]:
    """Return header and rows of a table: the time, the pressures in the chambers, where the tip is, what failed."""
    failed = any(not step.status.has_solution for step in steps)
    sets = (
        len(steps[0].pressure) if steps and len(steps[0].pressure) <= _FEW else 0
    )  # more are too wide: the CSV has them
    pressures = [f"p{k + 1} [bar]" if k == 0 else f"p{k + 1}" for k in range(sets)]
    header = ["t [s]", *pressures, f"tip x [{MM}]", "y", "z", *["status"] * failed]
    rows: list[list[float | str | None]] = []
    for step, place in zip(steps, _tips(steps) / MILLIMETRE, strict=True):
        bars = [round(float(p) / BAR, 4) for p in step.pressure[:sets]]
        tip = [round(float(x), 3) + 0.0 if isfinite(x) else None for x in place]
        time = None if step.time is None else round(step.time, 6)
        rows.append([time, *bars, *tip, *[str(step.status)] * failed])
    return header, rows


def _tips(steps: Sequence[Step]) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.array([(nan, nan, nan) if step.pose is None else step.pose.tip_position for step in steps]).reshape(-1, 3)
