"""The stretch reached continuously from zero pressure, as a number: first guess of the NLP, and where the branch ends.

Along proportional loading, pressures t P, the axial balance gives t as an explicit function of the stretch (the
chambers' force is linear in pressure), so the branch is followed by evaluating, not by solving: Eqs. (10), (21), (23).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_FLOOR, Context
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import BAR
from softnlp.model.quantities import Model, quantities, section_function
from softnlp.model.section import STIFFNESSES
from softnlp.model.stretch_curve import BODY
from softnlp.statics.unloaded_branch import COUPLED, followed, unloaded_function

Array = NDArray[np.float64]

SILICONE = slice(2, 2 + len(STIFFNESSES))
"""Rows of `branch_function` that the silicone gives alone; pressure adds to them and cannot make up for their sign."""
_PRESSURISED = slice(SILICONE.stop, SILICONE.stop + len(STIFFNESSES))

_LARGEST_STRETCH = 10.0
_GRID = 1500
_FIRST_PART = 150  # of the grid, up to a stretch of 1.9
_SECANTS, _ROUNDING = 300, 1e-15
_STUCK, _AT_ROOT = 4, 1e-6  # times that one end moves before the other is halved; excess of what may be a root
_A_HAIR = 1e-9
_ZOOMS, _ZOOM_GRID = 10, 42  # an interval of the first grid is cut 41-fold ten times, which is past round-off


@dataclass(frozen=True)
class BranchPoint:
    """Where the branch from zero pressure stands at one pressure.

    status : solved, no_equilibrium or unstable_material. stretch : lambda, or its value at the end of the branch.
    fraction : the part of the pressure up to which the branch exists (1 when solved). message : one line for a person.
    """

    status: Status
    stretch: float
    fraction: float
    message: str


def branch_function(model: Model) -> ca.Function:
    """Return (quantities, stretch) -> rows that `stretch_on_branch` needs, for symbols in place of the model's numbers.

    Rows: A_0 sigma_e; what balances it at full pressure; the `STIFFNESSES` without pressure, then at full pressure.
    Of a section that is `coupled` it is another function, see `softnlp.statics.unloaded_branch`.
    """
    if model.section.coupled:
        return unloaded_function(model)

    def build(numbers: Mapping[str, Any], stretch: Any) -> Sequence[Any]:
        at_rest, loaded = (model.section.at(numbers, P, stretch) for P in ([0.0] * model.sets, numbers["pressure"]))
        resistance = at_rest.imbalance
        rows = [resistance, resistance - loaded.imbalance, *at_rest.stiffnesses, *loaded.stiffnesses]
        return [ca.vertcat(*rows)]

    return section_function(quantities(model), build)


def stretch_on_branch(function: ca.Function, column: Array, pressures: Array) -> BranchPoint:
    """Return the stretch on the branch from zero pressure, or where and why the branch ends before.

    function : of `branch_function`. column : every quantity in its order, SI, with `pressures` [Pa] in it.
    """
    if function.n_in() == COUPLED:
        return _coupled(function, column, pressures)
    rest = np.asarray(function(column, 1.0))[SILICONE]
    if not np.all(rest > 0):
        message = f"{Status.UNSTABLE_MATERIAL.advice}: the section has no {_lost(rest)} even without any pressure"
        return BranchPoint(Status.UNSTABLE_MATERIAL, 1.0, 0.0, message)
    if not np.any(pressures):
        return BranchPoint(Status.SOLVED, 1.0, 1.0, "no pressure")

    def sample(stretch: Array) -> tuple[Array, Array]:
        """Return the pressure fraction at each stretch, and the stiffnesses there: with pressure, of the silicone."""
        rows = np.asarray(function(column, stretch[None, :]))
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(rows[1] > 0, rows[0] / rows[1], np.inf)
        own = rows[SILICONE]
        return t, np.vstack([own + np.minimum(t, 1.0) * (rows[_PRESSURISED] - own), own])

    def is_lost(stretch: Array) -> NDArray[np.bool_]:
        lost: NDArray[np.bool_] = ~np.all(sample(stretch)[1] > 0, axis=0)
        return lost

    grid = np.linspace(1.0, _LARGEST_STRETCH, _GRID)
    for size in (_FIRST_PART, _GRID):  # most branches arrive early
        t, k = sample(grid[:size])
        lost = ~np.all(k > 0, axis=0)
        falls = np.append(t[1:] < t[:-1] - 1e-13, False)
        events = np.flatnonzero((t >= 1.0) | lost | falls)
        if events.size and events[0] < size - 1:  # the last point does not know whether it falls
            break
    if events.size == 0:
        return _ended(Status.NO_EQUILIBRIUM, grid[-1], float(t[-1]), pressures, "goes beyond any stretch of use")
    j = int(events[0])
    low, high = grid[max(j - 1, 0)], grid[min(j + 1, _GRID - 1)]

    def first_beyond(beyond: Callable[[Array], NDArray[np.bool_]], a: float, b: float) -> float:
        """Return the first stretch in (a, b] where `beyond` holds, which it does at b, to round-off."""
        for _ in range(_ZOOMS):
            inside = np.linspace(a, b, _ZOOM_GRID)
            k = int(np.argmax(np.append(beyond(inside[1:-1]), True))) + 1
            a, b = float(inside[k - 1]), float(inside[k])
        return b

    if falls[j] and t[j] < 1.0 and not lost[j]:
        for _ in range(12):
            fine = np.linspace(low, high, 41)
            values = sample(fine)[0]
            best = int(np.argmax(values))
            low, high = fine[max(best - 1, 0)], fine[min(best + 1, 40)]
        if float(values[best]) < 1.0:
            return _ended(Status.NO_EQUILIBRIUM, fine[best], float(values[best]), pressures, "turns back")
        high = fine[best]
        low = grid[max(j - 1, 0)]
    else:
        high = grid[j]

    def fraction(stretch: float) -> float:
        return float(sample(np.array([stretch]))[0][0])

    root = _crossing(lambda s: fraction(s) - 1.0, low, high) if fraction(high) >= 1.0 else high
    if not is_lost(np.array([root]))[0]:
        return BranchPoint(Status.SOLVED, root, 1.0, "on the branch from zero pressure")
    end = first_beyond(is_lost, low, root)
    beyond = sample(np.array([end * (1 + _A_HAIR)]))[
        1
    ]  # where each that vanishes there is negative, not just the first
    how = f"meets a section whose {_lost(beyond)} loses its sign"
    return _ended(Status.UNSTABLE_MATERIAL, end, fraction(end), pressures, how)


def _coupled(function: ca.Function, column: Array, pressures: Array) -> BranchPoint:
    """Return the same of a section whose curvature is found with its stretch."""
    if not np.any(pressures):
        column = np.concatenate([np.zeros(pressures.size), column[pressures.size :]])
    found = followed(function, column)
    if found is None:
        message = f"{Status.UNSTABLE_MATERIAL.advice}: the section is not stable even without any pressure"
        return BranchPoint(Status.UNSTABLE_MATERIAL, 1.0, 0.0, message)
    strains, fraction = found
    if fraction == 1.0:
        return BranchPoint(Status.SOLVED, float(strains[0]), 1.0, "on the branch from zero pressure")
    if strains[0] >= 0.999 * BODY.high:
        beyond = f"goes beyond a stretch of {BODY.high:g}, up to which the silicone's law is taken,"
        return _ended(Status.NO_EQUILIBRIUM, float(strains[0]), fraction, pressures, beyond)
    how = "meets a section whose stiffness is no longer positive definite"
    return _ended(Status.UNSTABLE_MATERIAL, float(strains[0]), fraction, pressures, how)


def _crossing(excess: Callable[[float], float], a: float, b: float) -> float:
    """Return where a function that is below 0 at a and not at b is 0, to round-off, by the Illinois method.

    Next to a pole one end is so high that the secant stays at the other; the middle is taken then.
    """
    f_a, f_b, side, moved = excess(a), excess(b), 0, 0
    for _ in range(_SECANTS):
        with np.errstate(invalid="ignore", divide="ignore"):
            middle = float(b - np.float64(f_b) * (b - a) / (f_b - f_a))
        if not a <= middle <= b or moved >= _STUCK:  # an end where the function is infinite, or nearly
            middle, moved = (a + b) / 2, 0
        f = excess(middle)
        if f == 0 or b - a <= _ROUNDING or (min(middle - a, b - middle) <= _ROUNDING and abs(f) <= _AT_ROOT):
            return middle
        moved = moved + 1 if side == np.sign(f) else 0
        if f > 0:
            b, f_b, f_a, side = middle, f, f_a / 2 if side > 0 else f_a, 1
        else:
            a, f_a, f_b, side = middle, f, f_b / 2 if side < 0 else f_b, -1
    return b


def _lost(found: Array) -> str:
    """Name the first stiffness that is not positive, of those with pressure and then of those of the silicone alone."""
    which = int(np.argmin(np.ravel(found) > 0))
    return STIFFNESSES[which % len(STIFFNESSES)] + " without the pressure's part" * (which >= len(STIFFNESSES))


def _ended(status: Status, stretch: float, fraction: float, pressures: Array, how: str) -> BranchPoint:
    """Say where the branch ends, with the last pressures that have an equilibrium."""
    down = Context(prec=6, rounding=ROUND_FLOOR)  # rounded up, the pressure would not have an equilibrium
    last = ", ".join(f"{float(down.create_decimal_from_float(fraction * P / BAR)):.6g}" for P in pressures)
    return BranchPoint(
        status,
        float(stretch),
        fraction,
        f"{status.advice}: the branch from zero pressure {how} at a stretch of {stretch:.4g}; "
        f"the last pressure with an equilibrium is {last} bar ({100 * fraction:.4g} % of this one)",
    )
