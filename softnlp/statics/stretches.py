"""The stretch of many poses at once, where the branch from zero pressure is plain to see.

Where every chamber has the same bore the balance of Eq. (10) depends on the sum of the pressures alone, and solved for
that sum it is a curve over the stretch. Up to the first stretch where the curve turns or the unpressurised section
loses a stiffness (pressure only adds to them) a root is on the branch; beyond it `softnlp.statics.branch` decides. All
poses of other sections, see `softnlp.model.section.Section.by_sum`, are left to the single solver.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import BAR
from softnlp.model.stretch_curve import BODY
from softnlp.native.shooting import Shooting
from softnlp.statics.branch import SILICONE, branch_function
from softnlp.statics.loadcase import RodFunctions
from softnlp.statics.unloaded_branch import REST, step_function

Array = NDArray[np.float64]

_LARGEST = {True: 10.0, False: 3.0}
_SAMPLES = {True: 1800, False: 100}  # of a curve that all poses share, and of a pose's own
_NEWTON_STEPS = 8
_PARTS, _NEAR = 6, 1e-3  # of the pressure of a section that bends with it; how near the strains are on the way


def stretch_maps(functions: RodFunctions) -> dict[str, ca.Function]:
    """Return the maps of [every quantity, stretch] that `Stretches` needs, and the section itself.

    branch : rows of `softnlp.statics.branch.branch_function`. balance : the scaled imbalance and its slope. section :
    the constants of the load case, the imbalance, the units of length and force.
    """
    size = functions.section.size1_in(0)
    column, stretch = ca.SX.sym("column", size), ca.SX.sym("stretch")
    given = ca.vertcat(column, stretch)
    constants, balance, units = functions.section(column, stretch)
    branch = branch_function(functions.model)
    coupled = functions.model.section.coupled
    found = {
        "branch": given if coupled else branch(column, stretch),
        "balance": ca.vertcat(balance, ca.jacobian(balance, stretch)),
        "section": ca.vertcat(constants, balance, units),
    }
    maps = {name: ca.Function(name, [given], [ca.densify(rows)], {"cse": True}) for name, rows in found.items()}
    if coupled:
        del maps["balance"]
        maps["branch"] = step_function(branch)
    return maps


class Stretches:
    """Finds stretches of poses given as columns of every quantity (see `softnlp.model.quantities`), SI.

    shared : whether the poses differ in pressure and loads only, so that one curve serves all.
    """

    def __init__(self, functions: RodFunctions, shooting: Shooting, *, shared: bool) -> None:
        self._shooting = shooting
        model = functions.model
        self._shared = shared
        self._sets = model.sets
        self._by_sum = model.section.by_sum
        self._coupled = model.section.coupled
        self._grid = np.linspace(1.0, _LARGEST[shared], _SAMPLES[shared])
        self._curve: tuple[Array, Array] | None = None

    def find(self, columns: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the stretch of each pose, and whether it is on the branch for certain; NaN where it is not."""
        if self._coupled:
            return self._followed(columns)
        start = self.starts(columns)
        stretch, known = np.full(start.size, np.nan), np.isfinite(start)
        known[known] = self._polish(columns[:, known], start, known)
        stretch[known] = start[known]
        stretch[known & (columns[: self._sets].sum(axis=0) == 0)] = 1.0
        return stretch, known

    def starts(self, columns: Array) -> Array:
        """Return stretches (poses,) between two samples of the curve, NaN beyond it: where Newton's method begins."""
        total = columns[: self._sets].sum(axis=0)
        if not self._by_sum:
            return np.full(total.size, np.nan)
        if self._shared:
            if self._curve is None:
                sums, safe = self._sampled(columns[:, :1])
                self._curve = sums[0, : safe[0]], self._grid[: safe[0]]
            start: Array = np.interp(total, *self._curve, right=np.nan)
            return start
        sums, safe = self._sampled(columns)
        beyond = np.arange(self._grid.size) >= safe[:, None]
        above = np.argmax((sums >= total[:, None]) | beyond, axis=1)
        inside = above < safe
        k = np.clip(above, 1, None)
        poses = np.arange(total.size)
        low, high = sums[poses, k - 1], sums[poses, k]
        part = np.where(inside, (total - low) / (high - low), np.nan)
        between: Array = self._grid[k - 1] + part * (self._grid[k] - self._grid[k - 1])
        return between

    def _followed(self, columns: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the same of sections that bend with the pressure: followed in equal parts of it."""
        n = columns.shape[1]
        strains = np.repeat(np.array(REST)[:, None], n, axis=1)
        known, slope = np.ones(n, bool), np.zeros((3, n))
        with np.errstate(all="ignore"):
            for part in range(_PARTS + 1):
                strains = strains + slope / _PARTS
                fraction = np.full((1, n), part / _PARTS)
                for _ in range(_NEWTON_STEPS):
                    rows = self._shooting.apply("branch", np.vstack([columns, strains, fraction]))
                    strains = strains + rows[:3]
                    moved = np.abs(rows[:3]).max(axis=0)
                    if not np.any(moved > (1e-13 if part == _PARTS else _NEAR)):
                        break
                slope = rows[3:6]
                known &= (moved < (1e-11 if part == _PARTS else _NEAR)) & (rows[6] > 0) & (strains[0] <= BODY.high)
        return np.where(known, strains[0], np.nan), known

    def _sampled(self, columns: Array) -> tuple[Array, NDArray[np.intp]]:
        """Return the sum of pressures on the grid of stretches (poses, samples), and how many samples are safe."""
        n, samples = columns.shape[1], self._grid.size
        unit = columns.copy()
        unit[: self._sets] = 0.0
        unit[0] = BAR
        every = np.vstack([np.repeat(unit, samples, axis=1), np.tile(self._grid, n)])
        rows = self._shooting.apply("branch", every).reshape(-1, n, samples)
        driven = rows[1] > 0
        sums = np.where(driven, rows[0] / np.where(driven, rows[1], 1.0), np.nan) * BAR
        sums[:, 0] = 0.0
        good = np.isfinite(sums) & np.all(rows[SILICONE] > 0, axis=0)
        good[:, 1:] &= np.diff(sums, axis=1) > 0
        return sums, np.where(good.all(axis=1), samples, np.argmin(good, axis=1))

    def _polish(self, columns: Array, start: Array, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Take Newton steps in place on `start[known]`; return which of them converged on a rising curve."""
        found = start[known]
        for _ in range(_NEWTON_STEPS):
            balance, slope = self._shooting.apply("balance", np.vstack([columns, found]))
            change = -balance / slope
            found = found + change
            if not np.any(np.abs(change) > 1e-14):
                break
        start[known] = found
        done: NDArray[np.bool_] = np.abs(change) <= 1e-12
        return done
