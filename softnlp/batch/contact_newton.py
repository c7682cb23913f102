"""Newton's method on blocked poses, many at once: each is followed from zero pressure with the wall in place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.arrays import replaced, some
from softnlp.batch.grids import MOST_INTERVALS, grid_level, whole_groups
from softnlp.batch.reduced_contact import UNKNOWN
from softnlp.native.kernels import WIDTH
from softnlp.native.shooting import Shooting
from softnlp.statics.condensed import plane_directions
from softnlp.statics.loadcase import RodFunctions, whole_weight
from softnlp.statics.reduced import MOMENT, POSITION, ROTATION, STATE

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PATH = np.linspace(0, 1, 9)
"""Parts of the pressure at which a path from zero is solved."""

_PASSES = 8
_CONVERGED, _ON_THE_WAY = 1e-11, 1e-7
_DIVERGED = 1e4
_LARGEST_JUMP = 0.1  # of a tip coordinate or direction cosine, from where the path was expected
_PATH_INTERVALS = 10
_RICHARDSON = 16 / 15


@dataclass(frozen=True, eq=False)
class Stage:
    """Blocked poses at one part of their pressure, scaled units, (fields, poses).

    constants : c. given : what the loads take at the tip, the dead force first, SI. units : length and force.
    """

    constants: Array
    given: Array
    units: Array


@dataclass(frozen=True, eq=False)
class BlockedShot:
    """What came of blocked poses; scaled units.

    unknowns : N_0, M(0), y. state : [p, R, m, chamber lengths] at the tip. integrals : bending angle and backbone.
    curvature : the largest at a node.
    determinant : of the tip equations. error : estimated error of the tip's position; worst_error : also of rotation
    and forces, as refinement holds them against the accuracy.
    """

    unknowns: Array
    state: Array
    integrals: Array
    curvature: Array
    residual: Array
    determinant: Array
    error: Array
    worst_error: Array
    intervals: NDArray[np.int64]
    iterations: NDArray[np.int64]


class ContactBatch:
    """Solves blocked poses of one rod against one wall, in the plane of a unit normal or in space (None)."""

    def __init__(self, functions: RodFunctions, shooting: Shooting, plane: Array | None) -> None:
        self._constants = functions.field.size1_in(1)
        self._chambers = functions.model.chambers
        self._forces = functions.tip_unknowns
        self._rows = 6 + self._forces
        self._inside = np.eye(self._rows) if plane is None else plane_directions(plane, self._rows)[0]
        self._shooting = shooting

    def follow(
        self, stage_at: Callable[[int, NDArray[np.intp]], Stage], first: NDArray[np.intp], target: float
    ) -> tuple[BlockedShot, Mask]:
        """Follow each pose along `PATH` to its end, where its grid is refined to the target.

        stage_at : the stage of some poses at a point of the path. first : (poses,) the point where each makes contact
        for good. Returns the poses and whether each was followed without a turn or a jump.
        """
        n = first.size
        size = STATE + self._chambers
        before: list[tuple[Array, Array]] = []
        unknowns, tips = np.zeros((self._rows, n)), np.zeros((12, n))
        sign, held = np.zeros(n), np.ones(n, bool)
        spent = np.zeros(n, np.int64)
        last = len(PATH) - 1
        for j in range(int(first.min(initial=last)), last + 1):
            on = np.flatnonzero(held & (first <= j))
            if on.size == 0:
                continue
            stage = stage_at(j, on)
            guess, expected = self._expected(stage, unknowns[:, on], tips[:, on], before, on, j - first[on])
            grids = np.full(on.size, _PATH_INTERVALS, np.int64)
            tolerance = _ON_THE_WAY if j < last else _CONVERGED
            shot = self._shoot(stage, guess, grids, tolerance, judge=False)
            tip = shot.state[:12]
            new = first[on] == j
            sign[on[new]] = np.sign(shot.determinant[new])
            good = (shot.residual <= 10 * tolerance) & (shot.determinant * sign[on] > 0)
            with np.errstate(invalid="ignore"):
                good &= new | (np.abs(tip - expected).max(axis=0) <= _LARGEST_JUMP)
            held[on[~good]] = False
            before = [*before[-1:], (unknowns.copy(), tips.copy())]
            unknowns[:, on], tips[:, on] = shot.unknowns, tip
            spent[on] += shot.iterations
        return self._refined(stage_at(last, np.arange(n)), unknowns, held, sign, spent, target, size)

    def _expected(
        self,
        stage: Stage,
        unknowns: Array,
        tips: Array,
        before: list[tuple[Array, Array]],
        on: NDArray[np.intp],
        done: NDArray[np.intp],
    ) -> tuple[Array, Array]:
        """Return the first guess and the expected tip: without force where contact begins, else along the secant."""
        guess, tip = unknowns.copy(), tips.copy()
        new = done == 0
        guess[:3, new] = (stage.given[:3] / stage.units[1] + whole_weight(stage.constants))[:, new]
        guess[3:6, new] = 0.0
        guess[6:, new] = 0.0
        if before:
            along = done >= 2
            was, tip_was = before[-1]
            guess[:, along] += unknowns[:, along] - was[:, on[along]]
            tip[:, along] += tips[:, along] - tip_was[:, on[along]]
        return guess, tip

    def _refined(
        self, stage: Stage, unknowns: Array, held: Mask, sign: Array, spent: NDArray[np.int64], target: float, size: int
    ) -> tuple[BlockedShot, Mask]:
        """Judge the end of the paths, on grids that meet the target."""
        n = held.size
        shot = self._shoot(stage, unknowns, np.full(n, _PATH_INTERVALS, np.int64), _CONVERGED, judge=True)
        for _ in range(5):
            error = shot.worst_error
            coarse = np.flatnonzero(held & (error > target) & (shot.intervals < MOST_INTERVALS) & np.isfinite(error))
            if coarse.size == 0:
                break
            wanted = 1.05 * shot.intervals[coarse] * (error[coarse] / target) ** 0.25
            grids = grid_level(np.maximum(wanted, shot.intervals[coarse] + 1.0))
            again = self._shoot(some(stage, coarse), shot.unknowns[:, coarse], grids, _CONVERGED, judge=True)
            shot = replaced(shot, coarse, again)
        good = held & (shot.determinant * sign > 0)
        return replace(shot, iterations=shot.iterations + spent), good

    def _shoot(
        self, stage: Stage, guess: Array, intervals: NDArray[np.int64], tolerance: float, *, judge: bool
    ) -> BlockedShot:
        """Solve poses on given grids; without `judge` the estimates and integrals are left out."""
        slots, counts = whole_groups(intervals)
        here = some(stage, slots)
        unknowns = guess[:, slots].copy()
        width, size = slots.size, STATE + self._chambers
        every = np.zeros((size * (UNKNOWN + 1), width))
        residual, passes = np.full(width, np.inf), np.zeros(width, np.int64)
        system = np.zeros((width, self._rows, self._rows))
        active = np.ones(width, bool)
        for _ in range(_PASSES):
            groups = np.flatnonzero(active.reshape(-1, WIDTH).any(axis=1))
            chosen = (groups[:, None] * WIDTH + np.arange(WIDTH)).ravel()
            data = np.vstack([here.constants[:, chosen], unknowns[:3, chosen]])
            reached = self._shooting.run("contact_directions", counts[groups], data, self.start(unknowns[:, chosen]))
            off, M = self._tip(reached, data, some(here, chosen), unknowns[6:, chosen])
            every[:, chosen], system[chosen], residual[chosen] = reached, M, np.abs(off).max(axis=0)
            passes[chosen] += active[chosen]
            active &= (residual > tolerance) & (residual < _DIVERGED)  # nan is neither
            if not active.any():
                break
            moving = active[chosen]
            unknowns[:, chosen[moving]] += self._step(M[moving], -off[:, moving])
        with np.errstate(invalid="ignore", over="ignore"):
            determinant = np.linalg.det(self._inside.T @ system @ self._inside)
        shot = BlockedShot(
            unknowns=unknowns,
            state=every[:size],
            integrals=np.zeros((2, width)),
            curvature=np.full(width, np.nan),
            residual=residual,
            determinant=determinant,
            error=np.full(width, np.nan),
            worst_error=np.full(width, np.nan),
            intervals=np.repeat(counts, WIDTH),
            iterations=passes,
        )
        if judge:
            shot = self._judged(shot, here, counts, every, system)
        back = np.empty(intervals.size, np.intp)
        back[slots] = np.arange(width)
        return some(shot, back)

    def _judged(
        self, shot: BlockedShot, stage: Stage, counts: NDArray[np.int64], every: Array, system: Array
    ) -> BlockedShot:
        """Evaluate the full equations between nodes and at the tip, and estimate the discretisation error."""
        size, width = STATE + self._chambers, shot.residual.size
        data = np.vstack([stage.constants, shot.unknowns[:3]])
        start = np.zeros((size + 4, width))
        start[:size] = self.start(shot.unknowns)[:size]
        checked = self._shooting.run("contact_check", counts, data, start)
        fine = self._shooting.run("contact_value", 2 * counts, data, start[:size])
        moved = every.copy()
        moved[:size] = checked[:size]
        off = self._tip(moved, data, stage, shot.unknowns[6:])[0]
        moved[:size] = fine
        with np.errstate(invalid="ignore", over="ignore"):
            correction = self._step(system, -self._tip(moved, data, stage, shot.unknowns[6:])[0])
            tangents = every[size:].reshape(UNKNOWN, size, -1)
            change = fine - every[:size] + np.einsum("jfn,jn->fn", tangents, correction[:UNKNOWN])
            position = _RICHARDSON * np.sqrt((change[POSITION] ** 2).sum(axis=0))
            turn = _RICHARDSON * np.sqrt((change[ROTATION] ** 2).sum(axis=0) / 2)
            forces = _RICHARDSON * np.abs(correction[UNKNOWN:]) / np.maximum(1.0, np.abs(shot.unknowns[UNKNOWN:]))
        return BlockedShot(
            unknowns=shot.unknowns,
            state=checked[:size],
            integrals=checked[size + 1 : -1],
            curvature=checked[-1],
            residual=np.maximum(shot.residual, np.maximum(checked[size], np.abs(off).max(axis=0))),
            determinant=shot.determinant,
            error=position,
            worst_error=np.maximum(position, np.maximum(turn, forces.max(axis=0)) / 5),
            intervals=shot.intervals,
            iterations=shot.iterations,
        )

    def start(self, unknowns: Array) -> Array:
        """Return the state at the base with its derivatives by N_0 and M(0)."""
        size = STATE + self._chambers
        state = np.zeros((size * (UNKNOWN + 1), unknowns.shape[1]))
        state[[3, 7, 11]] = 1.0
        state[MOMENT] = unknowns[3:6]
        for j in range(3):
            state[size * (j + 4) + MOMENT.start + j] = 1.0
        return state

    def _tip(self, reached: Array, data: Array, stage: Stage, y: Array) -> tuple[Array, Array]:
        """Return the tip residual (rows, poses) and its derivative by the unknowns (poses, rows, rows)."""
        given = np.vstack([reached, data, y, stage.given, stage.units])
        found = self._shooting.apply("contact_tip", given)
        slopes = found[self._rows :].reshape(self._rows, self._rows, -1)  # column, row, pose
        return found[: self._rows], slopes.transpose(2, 1, 0)

    def _step(self, system: Array, right: Array) -> Array:
        """Return the change of the unknowns (rows, poses); not finite where a system is singular."""
        inside = self._inside
        small, wanted = inside.T @ system @ inside, (inside.T @ right).T[..., None]
        try:
            found = np.linalg.solve(small, wanted)
        except np.linalg.LinAlgError:
            singular = np.linalg.det(small) == 0
            small[singular] = np.eye(small.shape[-1])
            found = np.linalg.solve(small, wanted)
            found[singular] = np.nan
        step: Array = inside @ found[..., 0].T
        return step
