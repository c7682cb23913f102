"""Newton's method on the base moments of many poses at once, judged by the equations of the problem itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.arrays import replaced, some
from softnlp.batch.grids import MOST_INTERVALS, grid_level, whole_groups
from softnlp.batch.predictor import predicted
from softnlp.model.rod import STATE_SIZE
from softnlp.native.kernels import WIDTH
from softnlp.native.shooting import Shooting
from softnlp.statics.loadcase import RodFunctions
from softnlp.statics.reduced import MOMENT, POSITION, ROTATION, STATE, base_state

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_PASSES = 10
_CONVERGED = 1e-11  # scaled residual of the tip
_DIVERGED = 1e3
_SAMPLE = 16  # a pose in so many is solved first, and predicts the others
_MARGIN = 1.05  # on the number of intervals
_RICHARDSON = 16 / 15  # a fourth-order method's error over its change from halving every step


@dataclass(frozen=True, eq=False)
class Batch:
    """Poses of one rod as the shooting takes them, (fields, poses), in the units of the load case.

    data : constants, tip force and tip moment. bend : angle of the unloaded arc [rad].
    """

    data: Array
    bend: Array


@dataclass(frozen=True, eq=False)
class Shot:
    """What came of the poses of a batch; scaled units.

    base : M(0) (3, poses). tip : [p, R, N, M] (18, poses). integrals : chamber lengths, bending angle, backbone length.
    curvature : the largest at a node. residual : the largest of the tip equations and of the full equations between
    nodes. error, turn_error : estimated error of the tip's position and rotation.
    certain : whether no conjugate point and a positive definite tip show that the pose is stable.
    """

    base: Array
    tip: Array
    integrals: Array
    curvature: Array
    residual: Array
    error: Array
    turn_error: Array
    certain: Mask
    intervals: NDArray[np.int64]
    iterations: NDArray[np.int64]

    @property
    def refinement_error(self) -> Array:
        """What refinement holds against the accuracy, as `softnlp.statics.solver` does."""
        return np.maximum(self.error, self.turn_error / 5)


class BatchSolver:
    """Solves batches of one rod; accuracy is of the length, None for a given number of intervals."""

    def __init__(self, functions: RodFunctions, shooting: Shooting, target: float, intervals: int | None) -> None:
        self._constants = functions.field.size1_in(1)
        self._shooting = shooting
        self._target = target
        self._intervals = intervals
        self._chambers = functions.model.chambers

    def solve(self, batch: Batch, features: Array) -> Shot:
        """Solve every pose, on a grid that meets the target; poses that did not converge keep a large residual.

        features : (poses, columns) of what differs between the poses, for the predictor.
        """
        n = batch.data.shape[1]
        sample = np.arange(0, n, _SAMPLE)
        first = self._shoot(batch, sample, np.zeros((3, sample.size)), self._first_grids(batch.bend[sample]))
        solved = first.residual < _CONVERGED * 1e3
        good = sample[solved]
        guess = predicted(features, good, first.base[:, solved])
        grids = self._first_grids(batch.bend)
        if self._intervals is None and good.size:
            # RK4's error is C / K^4; log C is what varies smoothly
            constant = np.log(first.refinement_error[solved] * first.intervals[solved].astype(float) ** 4 + 1e-300)
            expected = np.exp(predicted(features, good, constant[None, :])[0])
            grids = grid_level(_MARGIN * (expected / self._target) ** 0.25)
        shot = self._shoot(batch, np.arange(n), guess, grids)
        if self._intervals is not None:
            return shot
        for _ in range(4):
            error = shot.refinement_error
            coarse = np.flatnonzero((error > self._target) & (shot.intervals < MOST_INTERVALS) & np.isfinite(error))
            if coarse.size == 0:
                break
            wanted = _MARGIN * shot.intervals[coarse] * (error[coarse] / self._target) ** 0.25
            again = self._shoot(
                batch, coarse, shot.base[:, coarse], grid_level(np.maximum(wanted, shot.intervals[coarse]))
            )
            shot = replaced(shot, coarse, again)
        return shot

    def _first_grids(self, bend: Array) -> NDArray[np.int64]:
        """Return the number of intervals of each pose, as far as its unloaded bend tells."""
        if self._intervals is not None:
            return np.full(bend.size, self._intervals, np.int64)
        return grid_level(np.maximum(10.0, 6 * bend))

    def _shoot(self, batch: Batch, poses: NDArray[np.intp], guess: Array, intervals: NDArray[np.int64]) -> Shot:
        """Solve some poses on given grids."""
        slots, counts = whole_groups(intervals)
        data, base = batch.data[:, poses][:, slots], guess[:, slots].copy()
        width = slots.size
        state = np.zeros((4 * STATE + 1, width))
        system = np.zeros((3, 3, width))
        residual, passes = np.full(width, np.inf), np.zeros(width, np.int64)
        active = np.ones(width, bool)
        for _ in range(_PASSES):
            groups = np.flatnonzero(active.reshape(-1, WIDTH).any(axis=1))
            chosen = (groups[:, None] * WIDTH + np.arange(WIDTH)).ravel()
            reached = self._shooting.run("directions", counts[groups], data[:, chosen], base_state(base[:, chosen]))
            off, J = self._tip(reached, data[:, chosen])
            state[:, chosen], system[..., chosen], residual[chosen] = reached, J, np.abs(off).max(axis=0)
            passes[chosen] += active[chosen]
            active &= (residual > _CONVERGED) & (residual < _DIVERGED)  # nan is neither
            if not active.any():
                break
            moving = active[chosen]
            change = _solved(J[..., moving], -off[:, moving])
            base[:, chosen[moving]] += change
        shot = self._judged(data, base, state, system, residual, counts, passes)
        back = np.empty(poses.size, np.intp)
        back[slots] = np.arange(width)  # of the copies that fill a group, the last
        return some(shot, back)

    def _tip(self, reached: Array, data: Array) -> tuple[Array, Array]:
        """Return the tip's moment residual (3, poses) and its derivative by M(0) (3, 3, poses)."""
        off = reached[MOMENT] - data[self._constants + 3 :]
        return off, reached[STATE : 4 * STATE].reshape(3, STATE, -1)[:, MOMENT].transpose(1, 0, 2)

    def _judged(
        self,
        data: Array,
        base: Array,
        state: Array,
        system: Array,
        residual: Array,
        counts: NDArray[np.int64],
        passes: NDArray[np.int64],
    ) -> Shot:
        """Evaluate the full equations, the discretisation error and the stability of converged base moments."""
        width = base.shape[1]
        start = np.zeros((self._chambers + STATE + 4, width))
        start[:STATE] = base_state(base)[:STATE]
        checked = self._shooting.run("check", counts, data, start)
        ends = self._shooting.apply("ends", np.vstack([checked[:STATE], data]))
        tip, off = ends[:STATE_SIZE], ends[STATE_SIZE:]
        residual = np.maximum(residual, np.maximum(checked[STATE], np.abs(off).max(axis=0)))

        fine = self._shooting.run("value", 2 * counts, data, base_state(base)[:STATE])
        tangents = state[STATE : 4 * STATE].reshape(3, STATE, -1)
        moved = np.zeros((4 * STATE + 1, width))
        moved[:STATE] = fine
        with np.errstate(invalid="ignore", over="ignore"):
            correction = _solved(system, -self._tip(moved, data)[0])
            change = fine - state[:STATE] + np.einsum("jfn,jn->fn", tangents, correction)
            U = _turns(state[ROTATION], tangents[:, ROTATION])
            form = np.einsum("kin,kjn->ijn", U, system)
            certain = (state[4 * STATE] > 0) & (_smallest_minor(form + form.transpose(1, 0, 2)) > 0)
        return Shot(
            base=base,
            tip=tip,
            integrals=checked[STATE + 1 : -1],
            curvature=checked[-1],
            residual=residual,
            error=_RICHARDSON * np.sqrt((change[POSITION] ** 2).sum(axis=0)),
            turn_error=_RICHARDSON * np.sqrt((change[ROTATION] ** 2).sum(axis=0) / 2),
            certain=certain,
            intervals=np.repeat(counts, WIDTH),
            iterations=passes,
        )


def cross(a: Array, b: Array) -> Array:
    """Return a x b of columns (3, poses), without the care that `numpy.cross` takes of every other shape."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _solved(J: Array, right: Array) -> Array:
    """Return x with J x = right for many 3x3 systems, (3, poses), by Cramer's rule; not finite where singular."""
    a, b, c = J[:, 0], J[:, 1], J[:, 2]
    normal = cross(b, c)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = 1.0 / (a * normal).sum(axis=0)
        x = np.stack(
            [
                (right * normal).sum(axis=0) * inverse,
                (right * cross(c, a)).sum(axis=0) * inverse,
                (right * cross(a, b)).sum(axis=0) * inverse,
            ]
        )
    return x


def _turns(R: Array, V: Array) -> Array:
    """Return the world rotation vectors by each direction, (3, direction, poses), from dR (direction, 9, poses)."""
    R_ = R.reshape(3, 3, -1)  # column, row
    W = np.einsum("jcan,cbn->jabn", V.reshape(3, 3, 3, -1), R_)
    return np.stack([W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]])


def _smallest_minor(S: Array) -> Array:
    """Return the least leading minor of symmetric matrices (3, 3, poses)."""
    second = S[0, 0] * S[1, 1] - S[0, 1] ** 2
    third = (S[0] * cross(S[1], S[2])).sum(axis=0)
    least: Array = np.minimum(S[0, 0], np.minimum(second, third))
    return least
