"""[contact] as the blocked-force tab edits it: keys that do not go together never stay together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import BAR
from softnlp.statics.step import Step

Table = dict[str, Any]
Array = NDArray[np.float64]

CLOSURES: Mapping[str, str] = {
    "compliant": "chambers give way by k_c, one constant for all robots; within 6.5 % on the mean at 1.5 bar",
    "free": "no chamber constraint, a lower bound: forces come out 20 to 60 % low",
    "rigid": "chambers keep their free length, an upper bound: forces come out 3 to 5 times high",
    "weighted": "the paper's least squares, to compare with it: the force depends on the weights",
}
WEIGHTS: Mapping[str, tuple[str, str]] = {
    "weight_force_per_N": ("Weight of force, W_n", "1/N"),
    "weight_moment_per_Nmm": ("Weight of moment, W_m", "1/(N mm)"),
    "weight_length_per_mm": ("Weight of length, W_L", "1/mm"),
    "weight_position_per_mm": ("Weight of position, W_h", "1/mm"),
}
_OF_A_WALL = ("offset_mm", "offsets_mm", "offset_ramp", "wall_point_mm", "wall_normal", "target_force_N", "tip_cap_mm")
_OF_A_FORCE = ("offsets_mm", "offset_ramp", "target_force_N", "weight_sensitivity")


def with_closure(table: Table, closure: str) -> Table:
    """Return the table under another closure, without the weights where they mean nothing."""
    kept = {key: v for key, v in table.items() if closure == "weighted" or not key.startswith("weight_")}
    return _with(kept, "closure", closure, "compliant")


def with_mode(table: Table, mode: str) -> Table:
    """Return the table in another mode: where only the chambers are held there is no wall, and they are held."""
    if mode == "constrained":
        table = {key: value for key, value in table.items() if key not in (*_OF_A_WALL, "weight_sensitivity")}
        if table.get("closure") == "free":
            table = with_closure(table, "compliant")
    return _with(table, "mode", mode, "blocked")


def with_wall(table: Table, anywhere: bool) -> Table:
    """Return the table with a wall by point and normal, at first where the offset had it, or with an offset.

    The normal is that of a wall which the unbent tip, at x = 0, is not behind.
    """
    plain = {key: v for key, v in table.items() if key not in ("offset_mm", "wall_point_mm", "wall_normal")}
    if not anywhere:
        return plain
    offset = table.get("offset_mm", 0.0)
    return {**plain, "wall_point_mm": [offset, 0.0, 0.0], "wall_normal": [-1.0 if offset > 0 else 1.0, 0.0, 0.0]}


def of_a_curve(table: Table) -> Table:
    """Return the table that asks for the force at each pressure."""
    return {key: value for key, value in table.items() if key not in _OF_A_FORCE}


def of_a_target(table: Table, force: float) -> Table:
    """Return the table that asks for the pressure of a force [N]."""
    return {**of_a_curve(table), "target_force_N": force}


def rising(pressure: Array, steps: int) -> list[list[float]]:
    """Return rows [bar] that rise together from zero to a pressure (sets,) [Pa]."""
    return [[float(f"{p / BAR * k / (steps - 1):.12g}") for p in pressure] for k in range(steps)]


def pushing(pressure: Array, highest_bar: float) -> list[list[float]]:
    """Return the row [bar] that bounds the search for a force: the highest in the sets with pressure, or the first."""
    sets = pressure > 0 if np.any(pressure > 0) else np.arange(len(pressure)) == 0
    return [[highest_bar if pushes else 0.0 for pushes in sets]]


def force_points(steps: tuple[Step, ...] | list[Step]) -> tuple[list[float], list[float]]:
    """Return the largest pressure [bar] and the wall's force [N] of each step, nan where it has no solution."""
    bars = [float(step.pressure.max()) / BAR for step in steps]
    forces = [step.contact.force if step.status.has_solution and step.contact else float("nan") for step in steps]
    return bars, forces


def _with(table: Table, key: str, value: Any, default: Any) -> Table:
    """Return the table with a key, which the default does not need."""
    rest = {k: v for k, v in table.items() if k != key}
    return rest if value == default else {**rest, key: value}
