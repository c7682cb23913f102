"""Inverse kinematics as one nonlinear program: the pressures freed in the rod's own problem, with bounds.

IPOPT with exact second derivatives closes what `softnlp.studies.inverse_solver` proposes, or searches itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import quantity
from softnlp.base.status import Status
from softnlp.base.units import BAR
from softnlp.model.numerics import Numerics
from softnlp.model.rod import Loads
from softnlp.nlp.bounded import Limits
from softnlp.nlp.problem import CompiledProblem, Constraint, compile_problem
from softnlp.nlp.solver import FROM_SOLUTION, Engine, Solution
from softnlp.nlp.transcription import method_named
from softnlp.statics.closing import DisputedError, confirmed
from softnlp.statics.loadcase import load_case
from softnlp.statics.pose_grid import TIP, Solved
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step
from softnlp.studies.targets import Aim, TipPoint

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class InverseProblem:
    """A compiled inverse problem on one grid for targets of one kind."""

    engine: Engine
    meets: bool

    @property
    def problem(self) -> CompiledProblem:
        """The compiled problem; free is "pressure"."""
        return self.engine.problem

    def solve(self, poses: PoseSolver, loads: Loads, aim: Aim, pressure: Array, x: Array) -> Solution:
        """Solve from a pressure (sets,) [Pa] and a pose x of the same grid nearby."""
        values = {k: v for k, v in poses.values(pressure, loads).items() if k != "pressure"}
        if aim.target.position is not None:
            values["target.position"] = aim.target.position
        if aim.target.direction is not None:
            values["target.direction"] = aim.target.direction
            values["target.tangents" if self.meets else "target.weight"] = (
                aim.tangents.ravel(order="F") if self.meets else aim.weight
            )
        start = np.concatenate([self.problem.pack_free({"pressure": pressure}), x])
        return self.engine.solve(self.problem.pack(values), start)


def inverse_problem(
    poses: PoseSolver,
    intervals: int,
    aim: Aim,
    limits: Limits,
    *,
    meets: bool,
    options: Mapping[str, Any] = MappingProxyType({}),
) -> InverseProblem:
    """Compile the problem for targets of the kind of `aim`.

    meets : the target is met, which takes as many sets that may move as it has conditions, with the smallest sum of
    squares of the pressures where there are more. Otherwise the weighed misfit is made smallest. options : of IPOPT.

    Raises
    ------
    IllPosedError
        Where a target that must be met leaves nothing to choose.

    """
    declared = dict(poses.quantities)
    lower, upper = limits.lower, limits.upper
    declared["pressure"] = replace(declared["pressure"], lower=float(lower.min()) * BAR, upper=float(upper.max()) * BAR)
    case = load_case("pose", poses.functions, declared, method_named(poses.numerics.transcription, intervals))
    L_0, axis = case.length_unit, case.outputs["tip_rotation"][:, 2]
    axis = axis / ca.norm_2(axis)
    z = declared["pressure"].symbol / BAR
    extra: list[Any] = []
    constraints: list[Constraint] = []
    misfit: list[ca.MX] = []
    if aim.target.position is not None:
        wanted = quantity("target.position", "m", np.zeros(3))
        off = (case.outputs["tip_position"] - wanted.symbol) / L_0
        extra.append(wanted)
        misfit.append(off)
        if meets:
            constraints.append(Constraint("tip position", off * L_0, unit="m", scale=L_0))
    if aim.target.direction is not None:
        towards = quantity("target.direction", "1", np.array([0.0, 0.0, 1.0]))
        if meets:
            across = quantity("target.tangents", "1", np.eye(3)[:, :2].ravel(order="F"))
            sideways = ca.reshape(across.symbol, 3, 2).T @ (axis - towards.symbol)
            constraints.append(Constraint("tip direction", sideways))
            extra += [towards, across]
        else:
            weight = quantity("target.weight", "1", 1.0)
            misfit.append(weight.symbol * (axis - towards.symbol))
            extra += [towards, weight]
    for k, (low, high) in enumerate(zip(lower, upper, strict=True)):
        if low > lower.min() or high < upper.max():
            constraints.append(Constraint(f"pressure of set {k + 1}", z[k], float(low), float(high), "bar"))
    if np.sum(upper) > limits.largest_sum:
        constraints.append(
            Constraint("last pressure with an equilibrium", ca.sum1(z), -np.inf, limits.largest_sum, "bar")
        )
    objective: ca.MX | None = ca.sumsqr(z) / 2 if meets else ca.sumsqr(ca.vertcat(*misfit)) / 2
    if meets and aim.conditions == moving_sets(limits):
        objective = None
    problem = compile_problem(
        [*declared.values(), *extra], [case], free=["pressure"], constraints=constraints, objective=objective
    )
    return InverseProblem(Engine(problem, options=options), meets)


def moving_sets(limits: Limits) -> int:
    """Return how many sets the bounds let move."""
    return int(np.sum(limits.upper > limits.lower))


def pressure_of(problem: InverseProblem, solution: Solution, limits: Limits) -> Array:
    """Return the pressures (sets,) [Pa] of a solution, within the limits to the last bit: IPOPT relaxes its bounds."""
    return limits.clip(problem.problem.free_values(solution.x)["pressure"] / BAR) * BAR


class Programs:
    """The programs of one task's targets, compiled at first use: IPOPT searches with them, or closes a search.

    numerics : those of the task, whose options IPOPT takes.
    """

    def __init__(self, poses: PoseSolver, loads: Loads, limits: Limits, numerics: Numerics) -> None:
        self._poses, self._loads, self._limits, self._numerics = poses, loads, limits, numerics
        self._kept: dict[tuple[int, bool, bool, bool, bool], InverseProblem] = {}

    def of(self, aim: Aim, intervals: int, *, meets: bool, closing: bool = False) -> InverseProblem:
        """Return the program of targets of a kind on a grid, see `inverse_problem`; closing : from a solution."""
        kind = (intervals, aim.target.position is not None, aim.target.direction is not None, meets, closing)
        if kind not in self._kept:
            options = {**(FROM_SOLUTION if closing else {}), **dict(self._numerics.ipopt)}
            self._kept[kind] = inverse_problem(self._poses, intervals, aim, self._limits, meets=meets, options=options)
        return self._kept[kind]

    def searched(self, aim: Aim, intervals: int, point: TipPoint, *, meets: bool) -> Array | None:
        """Return the pressures (sets,) [Pa] that IPOPT finds from a tip, None where it finds none."""
        program = self.of(aim, intervals, meets=meets)
        solution = program.solve(self._poses, self._loads, aim, point.pressure, point.x)
        if not solution.holds(self._numerics.tolerance):
            return None
        return pressure_of(program, solution, self._limits)

    def closed(self, aim: Aim, solved: Solved, step: Step, *, only_pose: bool, meets: bool) -> Step:
        """Return the step of an answer with IPOPT's word on the program that searches, or `disputed`.

        only_pose : its pose at its pressures is closed, where the answer is the nearest of those that a body can take:
        stability and self-intersection are no rows of the program. So is a target that fewer sets meet than it has
        conditions: its misfit is flat where it is zero.
        """
        engine, proposed, moving = solved.grid.reference, solved.solution, moving_sets(self._limits)
        if only_pose or moving == 0 or (meets and moving < aim.conditions):
            found = engine.closed(proposed)
        else:
            program = self.of(aim, solved.intervals, meets=meets, closing=True)
            found = program.solve(self._poses, self._loads, aim, step.pressure, proposed.x)
            found = replace(found, x=found.x[program.problem.free_size :])
        try:
            found = confirmed(engine, proposed, found, self._numerics, TIP)
        except DisputedError as error:
            return Step(step.pressure, Status.DISPUTED, str(error), iterations=step.iterations, aimed=aim.aimed(None))
        return replace(step, engine=self._numerics.engine, ipopt=found.ipopt)
