"""Inverse kinematics among obstacles: pressures that reach a target and push no obstacle harder than is allowed.

The search is by sequential quadratic programs in the pressures z [bar]. Every point of it is a pose among obstacles,
followed from the one before; its slopes are those of the solved equations, at the contacts that it has. Of a push that
is limited, (F_max - F) / F_0 + G / L_0 is kept from being negative for each obstacle, with F_0 = EI/L_0^2 and G the
least gap: one number whether it touches or not, so that there is a slope on both sides.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.numerics import Numerics
from softnlp.model.obstacles import Obstacle
from softnlp.model.quantities import Model
from softnlp.model.robot import SELF_INTERSECTION
from softnlp.model.rod import Loads
from softnlp.statics.kept import pose_solver
from softnlp.statics.obstacle_grid import Touched
from softnlp.statics.obstacle_solver import among_obstacles
from softnlp.statics.step import Aimed, Step
from softnlp.studies.inverse_problem import pressure_limits
from softnlp.studies.inverse_solver import InverseKinematics, Reached
from softnlp.studies.targets import Aim, InverseTask, Target, aim_of

Array = NDArray[np.float64]

_MOST, _ENOUGH = 40, 1e-12  # iterations of a search, and the change of a misfit or a pressure that ends it
_DAMPING, _WEAKEST, _STRONGEST = 1e-3, 1e-12, 1e4  # of a step, relative to the slopes
_DIFFERENCE = 1e-6  # of a central difference along a solved slope [bar]
_MET, _LITTLE = 0.1, 1e-6  # of the accuracy: misfit that is enough; and of a misfit: gain that is none
_FARTHEST = 0.25  # [bar] in one step: poses are followed from one to the next
_BREACH = 10.0  # what a limit that is passed counts for in the merit


@dataclass(frozen=True, eq=False)
class _Point:
    """A pose among obstacles and its slopes by z. r, limits : misfit [L_0] and what is kept from being negative."""

    z: Array
    step: Step
    found: Touched
    aimed: Aimed
    r: Array
    limits: Array
    r_slope: Array
    limits_slope: Array

    @property
    def merit(self) -> float:
        """Misfit and what passes a limit, squared."""
        return float(self.r @ self.r + _BREACH * np.sum(np.minimum(self.limits, 0.0) ** 2))


class InverseAmongObstacles:
    """Meets targets of one task among obstacles, one after the other."""

    def __init__(
        self, model: Model, numerics: Numerics, loads: Loads, task: InverseTask, obstacles: Sequence[Obstacle]
    ) -> None:
        quick = numerics.without_ipopt()
        self._free = InverseKinematics(model, quick, loads, task, "newton")
        self._quick = among_obstacles(pose_solver(model, quick), obstacles)
        self._whole = among_obstacles(pose_solver(model, numerics), obstacles)
        self.loads, self.task, self._numerics = loads, task, numerics
        self.limits, _ = pressure_limits(self._quick.poses, task.lower, task.upper)

    def nearest(
        self, target: Target, near: tuple[Reached | None, _Point | None] | None
    ) -> tuple[Step, tuple[Reached | None, _Point | None] | None]:
        """Find the pressure for one target, from the last one where there is one. Never raises for a hard target."""
        began = time.perf_counter()
        aim = aim_of(self.task, target, float(self._quick.poses.model.robot.length))
        last = None if near is None else near[1]
        step, free = self._free.nearest(target, None if near is None else near[0])
        starts = [step.pressure / BAR] + ([last.z] if last is not None else [])
        best: _Point | None = None
        for z in starts:
            begin = self._at(aim, self.limits.clip(np.asarray(z)), last)
            if begin is None:
                begin = self._at(aim, self.limits.lower.copy(), last)
            if begin is None:
                continue
            point = self._searched(aim, begin)
            if best is None or point.merit < best.merit:
                best = point
            if self._meets(aim, best):
                break
        if best is None:
            lost = Step(step.pressure, Status.DIVERGED, Status.DIVERGED.advice, aimed=aim.aimed(None))
            return replace(lost, solve_time=time.perf_counter() - began), (free, None)
        if self._meets(aim, best) and np.sum(self.limits.upper > self.limits.lower) > aim.conditions:
            best = self._least(aim, best)
        answer, _ = self._whole.solve(best.z * BAR, self.loads, best.found)
        seconds = time.perf_counter() - began
        if answer.pose is None:
            return replace(answer, aimed=aim.aimed(None), solve_time=seconds), (free, None)
        answer = replace(answer, aimed=aim.aimed(answer.pose), solve_time=seconds)
        if not self._meets(aim, best):
            answer = replace(answer, status=Status.OUT_OF_REACH, message=self._said(best))
        return answer, (free, best)

    def _said(self, best: _Point) -> str:
        """Say how near the tip comes, and what stands in the way."""
        text = f"{Status.OUT_OF_REACH.advice}; the nearest tip found among the obstacles is"
        if best.aimed.distance is not None:
            text += f" {best.aimed.distance / MILLIMETRE:.4g} mm away"
        if best.aimed.angle is not None:
            text += f" {np.degrees(best.aimed.angle):.4g} degrees off"
        limited = best.step.contacts if best.limits.size else ()  # no limit, nothing in the way by one
        bound = [c.obstacle for c, left in zip(limited, best.limits, strict=True) if left < 1e-6]
        return text + (f", where {', '.join(bound)} may not be pushed harder" if bound else "")

    def _meets(self, aim: Aim, point: _Point) -> bool:
        """Whether a pose is within the accuracy asked for, and passes no limit."""
        accuracy, aimed = self._numerics.accuracy, point.aimed
        off = max((aimed.distance or 0.0) / aim.length, aimed.angle or 0.0)
        return off <= accuracy and bool(np.all(point.limits >= -accuracy))

    def _at(self, aim: Aim, z: Array, near: _Point | None) -> _Point | None:
        """Return the pose at pressures with its slopes; None where there is none that is stable and a body can take."""
        step, found = self._quick.solve(z * BAR, self.loads, None if near is None else near.found)
        if step.pose is None or found is None or step.pose.stable is False:
            return None
        if step.pose.fit.self_intersecting and SELF_INTERSECTION not in self.task.allow:
            return None
        grid, solution = found.grid, found.solution
        assert grid.engine.linear is not None
        r, limits = self._measured(aim, found, solution.x)
        slopes = []
        for k in range(z.size):
            moved = []
            for sign in (1, -1):
                pressure = z * BAR
                pressure[k] += sign * _DIFFERENCE * BAR
                p = grid.problem.pack({**found.values, "pressure": pressure})
                moved.append(np.asarray(grid.problem.residual(solution.x, p)).ravel())
            try:
                change = grid.engine.linear.solve(solution.x, solution.p, (moved[0] - moved[1]) / (2 * _DIFFERENCE))
            except np.linalg.LinAlgError:
                return None
            ahead, behind = (self._measured(aim, found, solution.x + h * change) for h in (_DIFFERENCE, -_DIFFERENCE))
            slopes.append([(a - b) / (2 * _DIFFERENCE) for a, b in zip(ahead, behind, strict=True)])
        by_z = [np.column_stack([slope[i] for slope in slopes]) for i in (0, 1)]
        return _Point(z, step, found, aim.aimed(step.pose), r, limits, *by_z)

    def _measured(self, aim: Aim, found: Touched, x: Array) -> tuple[Array, Array]:
        """Return the misfit and what is kept from being negative at a point of a grid."""
        grid, target = found.grid, aim.target
        tip, (L_0, F_0) = x[grid.tip.start :][:12], found.units
        parts = []
        if target.position is not None:
            parts.append(tip[:3] - target.position / L_0)
        if target.direction is not None:
            axis = tip[9:12] / np.linalg.norm(tip[9:12])
            parts.append(aim.weight * (axis - target.direction))
        most = self.task.contact_force
        if most is None:
            return np.concatenate(parts), np.zeros(0)
        before, pushes = grid.nodes(x), grid.pushes(x)
        left = []
        for j, obstacle in enumerate(grid.case.obstacles):
            alone = np.zeros_like(pushes)
            alone[j] = pushes[j]
            behind, gaps = grid.case.touching.at(before, alone, found.radius, found.numbers)
            force = float(np.linalg.norm((before[12:15, 1:] - behind[12:15, 1:]).sum(axis=1)))
            gap = float(np.min(gaps[j, 1:])) if obstacle.part == "body" else float(gaps[j, -1])
            left.append(most / F_0 - force + max(gap, 0.0))
        return np.concatenate(parts), np.array(left)

    def _searched(self, aim: Aim, here: _Point) -> _Point:
        """Return the nearest pose that passes no limit, from a start."""
        damping = _DAMPING
        for _ in range(_MOST):
            scale = max(float(np.sum(here.r_slope**2)), _ENOUGH)
            weights = np.sqrt(damping * scale) * np.eye(here.z.size)
            move = self._move(here, np.vstack([here.r_slope, weights]), np.append(here.r, np.zeros(here.z.size)), None)
            trial = None if move is None else self._at(aim, self.limits.clip(here.z + move), here)
            if trial is None or trial.merit >= here.merit:
                damping *= 10 if trial is not None else 100
                if damping > _STRONGEST or (move is not None and float(np.max(np.abs(move))) < _ENOUGH):
                    break
                continue
            gained = here.merit - trial.merit
            here, damping = trial, max(damping / 10, _WEAKEST)
            if here.merit < (_MET * self._numerics.accuracy) ** 2 or gained < _LITTLE * here.merit:
                break
        return here

    def _least(self, aim: Aim, here: _Point) -> _Point:
        """Return the smallest pressures that meet a target, from some that do."""
        step = 1.0
        for _ in range(_MOST):
            move = self._move(here, np.eye(here.z.size), here.z, here.r)
            if move is None or float(np.max(np.abs(move))) < self._numerics.accuracy:
                break
            trial = self._at(aim, self.limits.clip(here.z + step * move), here)
            back = None if trial is None else self._searched(aim, trial)
            if back is None or not self._meets(aim, back) or back.z @ back.z >= here.z @ here.z:
                step /= 2
                if step < 1e-2:
                    break
                continue
            here, step = back, min(2 * step, 1.0)
        return here

    def _move(self, here: _Point, A: Array, b: Array, met: Array | None) -> Array | None:
        """Return d of the least |A d + b| within bounds and linearised limits, with met + r_slope d = 0 where given."""
        from scipy.optimize import minimize

        rows: list[dict[str, Any]] = []
        ends = self.limits.lower, self.limits.upper
        if here.limits.size:
            slope, left = here.limits_slope, here.limits
            rows.append({"type": "ineq", "fun": lambda d: left + slope @ d, "jac": lambda d: slope})
        if met is not None:
            rows.append({"type": "eq", "fun": lambda d: met + here.r_slope @ d, "jac": lambda d: here.r_slope})
        found = minimize(
            lambda d: (float(np.sum((A @ d + b) ** 2)) / 2, A.T @ (A @ d + b)),
            np.zeros(here.z.size),
            jac=True,
            method="SLSQP",
            bounds=list(zip(*(np.clip(end - here.z, -_FARTHEST, _FARTHEST) for end in ends), strict=True)),
            constraints=rows,
            options={"ftol": 1e-18, "maxiter": 100},
        )
        return np.asarray(found.x) if np.all(np.isfinite(found.x)) else None
