"""Inverse kinematics as one nonlinear program: the pressures freed in the rod's own problem, with bounds.

The reference for `softnlp.studies.inverse`: IPOPT with exact second derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import quantity
from softnlp.base.units import BAR
from softnlp.model.rod import Loads
from softnlp.nlp.bounded import Limits
from softnlp.nlp.problem import CompiledProblem, Constraint, compile_problem
from softnlp.nlp.solver import Engine, Solution
from softnlp.nlp.transcription import method_named
from softnlp.statics.loadcase import load_case
from softnlp.statics.solver import PoseSolver
from softnlp.studies.aiming import Aim

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


def inverse_problem(poses: PoseSolver, intervals: int, aim: Aim, limits: Limits, *, meets: bool) -> InverseProblem:
    """Compile the problem for targets of the kind of `aim`.

    meets : the target is met, with the smallest sum of squares of the pressures, which takes more sets than the target
    has conditions. Otherwise the weighed misfit is made smallest.

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
    objective = ca.sumsqr(z) / 2 if meets else ca.sumsqr(ca.vertcat(*misfit)) / 2
    problem = compile_problem(
        [*declared.values(), *extra], [case], free=["pressure"], constraints=constraints, objective=objective
    )
    return InverseProblem(Engine(problem), meets)


def pressure_of(problem: InverseProblem, solution: Solution, limits: Limits) -> Array:
    """Return the pressures (sets,) [Pa] of a solution, within the limits to the last bit: IPOPT relaxes its bounds."""
    return limits.clip(problem.problem.free_values(solution.x)["pressure"] / BAR) * BAR
