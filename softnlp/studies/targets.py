"""Targets of inverse kinematics: the tip by pressures, its misfit to a target, and where the search for one begins."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import BAR
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.nlp.bounded import Limits, Measured
from softnlp.nlp.solver import Solution
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.loadcase import stretch_imbalance, stretch_near
from softnlp.statics.pose_grid import Solved
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Aimed, Pose
from softnlp.studies.derivatives import PoseDerivatives

Array = NDArray[np.float64]

_AXIS = slice(9, 12)  # of a tip state: R e3
_APART = 0.35  # starts differ by at least this part of the bounds in some set
_NEWTON_STEPS = 30
_LOST, _NEAR = 1e4, 1e-7  # scaled residuals: nothing leads back from it; one more step ends at round-off


@dataclass(frozen=True, eq=False)
class Target:
    """Where the tip is to be: position (3,) [m], direction (3,) of its axis, unit; one or both, world frame."""

    position: Array | None
    direction: Array | None


@dataclass(frozen=True, eq=False)
class InverseTask:
    """A path of targets and the bounds of each set's pressure.

    lower, upper : (sets,) [Pa]. length_per_radian : how much of a distance [m] a radian of misfit counts for where
    position and direction cannot both be met. allow : with "self_intersection" in it, shapes that no body can take
    without passing through itself are answers too.
    """

    targets: tuple[Target, ...]
    lower: Array
    upper: Array
    length_per_radian: float
    allow: tuple[str, ...] = ()

    def step_count(self, pressures: int) -> int:
        """Return how many steps the run has: one a target."""
        return len(self.targets)


@dataclass(frozen=True, eq=False)
class TipPoint:
    """The tip at pressures (sets,) [Pa]: state (12,) is p [L_0] and R column by column, slope (12, sets) d state / dP.

    x, dx : the solution on a grid and its derivative; empty for an arc.
    """

    pressure: Array
    state: Array
    slope: Array
    x: Array
    dx: Array


class TipMap(Protocol):
    """What inverse kinematics asks of a model."""

    def at(self, pressure: Array, near: TipPoint | None) -> TipPoint | None:
        """Return the tip at a pressure, from one nearby where there is one; None where it is not found."""
        ...


class ArcMap:
    """The tip of the robot without gravity and tip load, exact."""

    def __init__(self, poses: PoseSolver) -> None:
        self._poses = poses
        functions = poses.functions
        sets = poses.model.robot.chamber_sets
        column, stretch = ca.SX.sym("p", functions.section.size1_in(0)), ca.SX.sym("stretch")
        P = column[:sets]
        _, balance, _ = functions.section(column, stretch)
        self._imbalance = stretch_imbalance(functions)
        tip = functions.arc(column, stretch, 1.0)[:12]
        by_pressure = -ca.jacobian(balance, P) / ca.jacobian(balance, stretch)
        slope = ca.jacobian(tip, P) + ca.jacobian(tip, stretch) @ by_pressure
        self._tip = ca.Function("tip", [column, stretch], [tip, ca.densify(slope)], {"cse": True})

    def at(self, pressure: Array, near: TipPoint | None) -> TipPoint | None:
        """Return the tip of the arc; the stretch is the root next to that of `near`."""
        column = self._poses.column({"pressure": pressure})
        if near is None:
            branch = stretch_on_branch(self._poses.branch, column, pressure)
            if not branch.status.has_solution:
                return None
            stretch = branch.stretch
        else:
            stretch = float(stretch_near(self._imbalance, column, near.x)[0])
            if not (stretch >= 0.5 and abs(float(self._imbalance(column, stretch)[0])) < 1e-9):
                return None
        state, by_pressure = self._tip(column, stretch)
        return TipPoint(pressure, np.asarray(state).ravel(), np.asarray(by_pressure), np.array([stretch]), np.zeros(0))


class GridMap:
    """The tip of the loaded robot on one grid, followed from point to point."""

    def __init__(self, derivatives: PoseDerivatives, intervals: int, loads: Loads) -> None:
        poses = derivatives.poses
        self.intervals = intervals
        self._poses = poses
        self._grid = poses.grid(intervals)
        self._derivatives = derivatives.on_grid(intervals, ("pressure",))
        self._loads = loads

    def at(self, pressure: Array, near: TipPoint | None) -> TipPoint | None:
        """Return the tip of the solution that Newton's method reaches from what `near` predicts, or from the arc."""
        p = self._grid.problem.pack(self._poses.values(pressure, self._loads))
        if near is None:
            branch = stretch_on_branch(self._poses.branch, p, pressure)
            if not branch.status.has_solution:
                return None
            guess = self._poses.arc_guess(self._grid, p, branch.stretch)
        else:
            guess = near.x + near.dx @ (pressure - near.pressure)
        return self._newton(pressure, guess, p)

    def of(self, solved: Solved) -> TipPoint | None:
        """Return the tip of a pose solved on any grid, on this map's grid."""
        pressure = solved.solution.p[: self._poses.model.robot.chamber_sets]
        guess = solved.solution.x if solved.grid is self._grid else self._poses.transfer(solved, self._grid)
        return self._newton(pressure, guess, solved.solution.p)

    def solved(self, point: TipPoint) -> Solved:
        """Return a point as a pose on this grid, not examined, for going on to another grid."""
        p = self._grid.problem.pack(self._poses.values(point.pressure, self._loads))
        solution, nodes = Solution(point.x, p, 0.0, 0, ""), self._grid.nodes(point.x)
        return Solved(
            lambda: self._grid,
            self.intervals,
            solution,
            nodes,
            nodes,
            self._grid.constants(solution),
            0.0,
            0.0,
            stable=True,
        )

    def _newton(self, pressure: Array, x: Array, p: Array) -> TipPoint | None:
        """Take Newton steps, each with the derivatives by pressure; those of the last step belong to the point."""
        residual = self._grid.problem.residual
        for _ in range(_NEWTON_STEPS):
            g = np.asarray(residual(x, p)).ravel()
            size = float(np.max(np.abs(g)))
            if not size < _LOST:
                return None
            try:
                step, dx = self._derivatives.newton(x, p, g)
            except np.linalg.LinAlgError:
                return None
            x = x + step
            if size < _NEAR:  # the step leaves the square of it
                tip = slice(x.size - STATE_SIZE, x.size - STATE_SIZE + 12)
                return TipPoint(pressure, x[tip], dx[tip], x, dx)
        return None


@dataclass(frozen=True, eq=False)
class Aim:
    """A target in the units of a robot: residuals are in L_0, a radian counts for `weight` of them.

    A direction a that should be t leaves weight (a - t): the chord of the angle, which grows up to the opposite
    direction. tangents : (3, 2) unit vectors across t.
    """

    target: Target
    length: float
    weight: float

    @property
    def tangents(self) -> Array:
        """Two unit vectors across the direction, and across each other, as columns."""
        assert self.target.direction is not None
        across: Array = np.linalg.svd(self.target.direction[None, :])[2][1:].T
        return across

    @property
    def conditions(self) -> int:
        """How many pressures it takes to meet the target."""
        return 3 * (self.target.position is not None) + 2 * (self.target.direction is not None)

    def misfit(self, states: Array) -> Array:
        """Return the residuals (m, ...) of tip states (12, ...)."""
        rows = []
        shape = (3,) + (1,) * (states.ndim - 1)
        if self.target.position is not None:
            rows.append(states[:3] - (self.target.position / self.length).reshape(shape))
        if self.target.direction is not None:
            axis = states[_AXIS] / np.linalg.norm(states[_AXIS], axis=0)  # a grid leaves R e3 a little off unit
            rows.append(self.weight * (axis - self.target.direction.reshape(shape)))
        return np.concatenate(rows)

    def measured(self, point: TipPoint) -> Measured:
        """Return the residuals of a tip; z is the pressure in bar."""
        rows = []
        if self.target.position is not None:
            rows.append(point.slope[:3])
        if self.target.direction is not None:
            size = float(np.linalg.norm(point.state[_AXIS]))
            axis = point.state[_AXIS] / size
            rows.append(self.weight * (np.eye(3) - np.outer(axis, axis)) @ point.slope[_AXIS] / size)
        return Measured(point.pressure / BAR, self.misfit(point.state), np.vstack(rows) * BAR, point)

    def conditioned(self, point: TipPoint) -> Measured:
        """Return as many residuals as there are conditions: a direction counts across itself alone."""
        full = self.measured(point)
        if self.target.direction is None:
            return full
        keep = full.r.size - 3
        B = self.tangents
        r = np.concatenate([full.r[:keep], B.T @ full.r[keep:]])
        return Measured(full.z, r, np.vstack([full.J[:keep], B.T @ full.J[keep:]]), point)

    def aimed(self, pose: Pose | None) -> Aimed:
        """Return how near a pose comes."""
        position, direction = self.target.position, self.target.direction
        if pose is None:
            return Aimed(position, direction)
        axis = pose.tip_rotation[:, 2] / np.linalg.norm(pose.tip_rotation[:, 2])
        distance = None if position is None else float(np.linalg.norm(pose.tip_position - position))
        angle = None
        if direction is not None:
            angle = 2 * float(np.arctan2(np.linalg.norm(axis - direction), np.linalg.norm(axis + direction)))
        return Aimed(position, direction, distance, angle, pose.tip_position, axis)

    def cost(self, aimed: Aimed) -> float:
        """Return the weighed misfit of a pose, in L_0; inf without one."""
        if aimed.tip_position is None:
            return float("inf")
        parts = [0.0]
        if aimed.distance is not None:
            parts.append(aimed.distance / self.length)
        if aimed.angle is not None:
            parts.append(self.weight * 2 * float(np.sin(aimed.angle / 2)))
        return float(np.linalg.norm(parts))


def aim_of(task: InverseTask, target: Target, length: float) -> Aim:
    """Return the aim at a target for a robot of length L_0 [m]."""
    return Aim(target, length, task.length_per_radian / length)


@dataclass(frozen=True, eq=False)
class Table:
    """Tips at pressures spread over the bounds, from which searches begin: (k, sets) [Pa], (12, k)."""

    pressures: Array
    states: Array
    points: tuple[TipPoint | None, ...]

    def starts(self, aim: Aim, limits: Limits, most: int) -> list[int]:
        """Return the entries with the least misfit that are apart from each other, best first."""
        misfit = np.linalg.norm(aim.misfit(self.states), axis=0)
        span = np.maximum((limits.upper - limits.lower) * BAR, 1e-9)
        chosen: list[int] = []
        for k in np.argsort(misfit):
            if not np.isfinite(misfit[k]) or len(chosen) == most:
                break
            if all(np.max(np.abs(self.pressures[k] - self.pressures[j]) / span) > _APART for j in chosen):
                chosen.append(int(k))
        return chosen


def spread(limits: Limits, most: int) -> Array:
    """Return pressures (k, sets) [bar] over the limits: a grid, or a low-discrepancy sequence for many sets."""
    n = limits.lower.size
    moving = limits.upper > limits.lower
    count = int(moving.sum())
    if not count:
        return limits.lower[None, :].copy()
    levels = int(most ** (1 / count) + 1e-9)
    if levels >= 3 or count == 1:
        unit = np.array(list(product(np.linspace(0, 1, max(levels, 2)), repeat=count))).reshape(-1, count)
        unit = _snake(unit, max(levels, 2), count)
    else:
        from scipy.stats import qmc

        drawn = qmc.Sobol(count, seed=3).random_base2(int(np.log2(most)))
        unit = np.vstack([np.zeros((1, count)), np.eye(count), drawn])
    full = np.zeros((len(unit), n))
    full[:, moving] = unit
    z = limits.lower + full * (limits.upper - limits.lower)
    return np.array([limits.clip(row) for row in z])


def _snake(unit: Array, levels: int, count: int) -> Array:
    """Order a grid so that neighbours follow each other."""
    index = np.rint(unit * (levels - 1)).astype(int)
    for axis in range(1, count):
        before = index[:, :axis].sum(axis=1)
        flip = before % 2 == 1
        index[flip, axis] = levels - 1 - index[flip, axis]
    made: Array = index / (levels - 1)
    return made


def tabulated(tips: TipMap, pressures: Array) -> Table:
    """Return the tips at pressures (k, sets) [Pa], each followed from the one before; NaN where there is none."""
    points: list[TipPoint | None] = []
    near: TipPoint | None = None
    for pressure in pressures:
        found = None if near is None else tips.at(pressure, near)
        found = found or tips.at(pressure, None)
        points.append(found)
        near = found or near
    states = np.array([np.full(12, np.nan) if p is None else p.state for p in points]).T
    return Table(pressures, states, tuple(points))
