"""The continuous part of a design as one nonlinear program: free and blocked shape, dimensions and pressure free."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import quantity
from softnlp.base.units import MILLIMETRE
from softnlp.model.quantities import with_symbols
from softnlp.model.robot import SELF_INTERSECTION, Robot
from softnlp.model.rules import rules
from softnlp.nlp.optimality import Bounds, slopes
from softnlp.nlp.problem import CompiledProblem, Constraint, compile_problem
from softnlp.nlp.transcription import MultipleShooting
from softnlp.statics.condensed import CondensedSolver
from softnlp.statics.loadcase import LoadCase, blocked_case, load_case
from softnlp.statics.unloaded import unloaded_case
from softnlp.studies.design_evaluate import Evaluator, chamber_gaps, free_outputs, robot_outputs
from softnlp.studies.design_task import OUTPUTS, DesignTask, Range

Array = NDArray[np.float64]

PRESSURE = "applied pressure"
OBJECTIVE_SCALE = "objective scale"
FOLD_SCALE = "fold scale"
FOLD = 0.02  # of the determinant of the robot at rest: below it the branch of the blocked shape is about to turn
_ITERATIONS = 60
_TIGHTEST = 0.999  # of what a body can take; an answer at 1 would pass through itself
_SLOPE = 1e-3  # of the scaled stretch balance: the branch from zero pressure ends where it vanishes


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """The compiled program of one structure on one grid; material and what is not chosen are fixed values.

    cases : "free", and "blocked" where a force is asked. limits : of its inequality rows,
    each with the constraint that it is of.
    guard : (x, p) -> the determinant of the blocked tip equations, over a fixed value; it keeps
    its sign on the branch. options : of IPOPT, which have the last word.
    """

    problem: CompiledProblem
    cases: tuple[LoadCase, ...]
    limits: tuple[tuple[int, Constraint], ...]
    guard: ca.Function | None
    options: Mapping[str, Any]

    @property
    def lower(self) -> Array:
        """Lower limits of every row; the guard is the last one."""
        return np.append(self.problem.lower_g, [FOLD] * (self.guard is not None))

    @property
    def upper(self) -> Array:
        """Upper limits of every row."""
        return np.append(self.problem.upper_g, [np.inf] * (self.guard is not None))

    @property
    def bounds(self) -> Bounds:
        """Bounds of the choices, the states and every row."""
        return Bounds(self.problem.lower_x, self.problem.upper_x, self.lower, self.upper)

    @cached_property
    def slopes(self) -> ca.Function:
        """What the KKT error is judged by, the guard's row included."""
        nlp = dict(self.problem.nlp)
        if self.guard is not None:
            nlp["g"] = ca.vertcat(nlp["g"], self.guard(nlp["x"], nlp["p"]))
        return slopes(nlp)

    @cached_property
    def solver(self) -> ca.Function:
        """IPOPT with the exact Hessian of all but the guard; multipliers are kept."""
        nlp: dict[str, Any] = dict(self.problem.nlp)
        x, p, f, g = (nlp[key] for key in "xpfg")
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.numel() + (self.guard is not None))
        weighed = lam_f * f + ca.dot(lam_g[: g.numel()], g)
        hessian = ca.triu(ca.hessian(weighed, x)[0])
        J = ca.jacobian(g, x)
        if self.guard is not None:
            size = self.guard(x, p)
            J, g = ca.vertcat(J, ca.jacobian(size, x)), ca.vertcat(g, size)
        nlp["g"] = g
        options: dict[str, Any] = {
            "jac_g": ca.Function("jac_g", [x, p], [g, J]),
            "hess_lag": ca.Function("hess_lag", [x, p, lam_f, lam_g], [hessian]),
            "print_time": False,
            "show_eval_warnings": False,
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "tol": 1e-9,
                "constr_viol_tol": 1e-9,
                "acceptable_iter": 0,
                "diverging_iterates_tol": 1e4,
                "bound_relax_factor": 1e-10,
                "nlp_scaling_method": "none",
                "mu_strategy": "adaptive",
                "max_iter": _ITERATIONS,
                "max_wall_time": 60.0,
                **self.options,
            },
        }
        return ca.nlpsol("design", "ipopt", nlp, options)


def design_problem(evaluator: Evaluator, intervals: int, plane: Array | None) -> DesignProblem:
    """Pose and compile the program for the structure of an evaluator.

    Free are the task's ranges. The rules of manufacture and the requirements are inequalities; where the branch of the
    stretch ends, contact that pulls, and folds of the blocked shape are excluded by inequalities too.

    plane : of symmetry, as for `CondensedSolver`, in which the blocked shape folds.
    """
    task, functions = evaluator.task, evaluator.functions
    declared = functions.declared(evaluator.poses.model)
    free_lengths = declared.pop("contact.free_lengths", None)
    for name, values in task.ranges.items():
        key = f"robot.{name}"
        declared[key] = replace(declared[key], lower=values.lower, upper=values.upper)
    limits = task.pressure if isinstance(task.pressure, Range) else Range(0.0, np.inf)
    applied = quantity(PRESSURE, "Pa", 1e5, scale=1e5, lower=limits.lower, upper=limits.upper)
    pressed = applied.symbol * ca.DM(evaluator.direction)
    given = {**declared, "pressure": replace(declared["pressure"], symbol=pressed)}
    declared.pop("pressure")

    method = MultipleShooting(intervals)
    # The closed form takes the functions with chamber lengths in the state as well as those without.
    if evaluator.setting.loads.act:
        free_case = load_case("free", evaluator.poses.functions, given, method)
    else:
        free_case = unloaded_case("free", functions, given)
    cases: list[LoadCase] = [free_case]
    robot = with_symbols(functions.model, {name: q.symbol for name, q in given.items()}).robot
    outputs = {**robot_outputs(robot), **free_outputs(free_case.outputs, robot.length), "pressure": applied.symbol}
    outputs["chamber_gap"] = ca.vertcat(*chamber_gaps(robot, free_case.outputs["stretch"]))
    if free_lengths is not None:
        blocked = blocked_case("blocked", functions, given, free_case, method)
        column = ca.vertcat(*(q.symbol for q in blocked.given.values()))
        size = CondensedSolver(functions, method, plane).determinant_expression(ca.vertcat(*blocked.symbols), column)
        fold = declared[FOLD_SCALE] = quantity(FOLD_SCALE, "1", 1.0)
        cases.append(replace(blocked, outputs={**blocked.outputs, "determinant": size / fold.symbol}))
        outputs["blocked_force"] = blocked.outputs["tip_forces"][0]

    chosen = [f"robot.{name}" for name in task.ranges] + [PRESSURE] * isinstance(task.pressure, Range)
    moved = ca.vertcat(*(q.symbol for q in [*declared.values(), applied] if q.name in chosen))
    unknown = ca.vertcat(moved, *(symbol for case in cases for symbol in case.symbols))
    rows = [*_rules(robot, task), *_guards(cases), *_bodies(cases[0], robot, task.allow)]
    rows += _required(outputs, evaluator)
    constraints = [row for row in rows if ca.depends_on(row.expression, unknown)]
    scale = quantity(OBJECTIVE_SCALE, "1", 1.0)
    problem = compile_problem(
        [*declared.values(), applied, scale],
        cases,
        free=chosen,
        constraints=constraints,
        objective=-task.sign * outputs[task.objective.name] / scale.symbol,
    )
    guard = _guard(problem) if len(cases) > 1 else None
    sides = [c for c in constraints for _ in range(c.expression.numel())]
    first = problem.lower_g.size - len(sides)
    if guard is not None:
        sides.append(Constraint("fold of the blocked shape", ca.MX(), FOLD, np.inf))
    sided = tuple(enumerate(sides, start=first))
    return DesignProblem(problem, tuple(cases), sided, guard, dict(evaluator.setting.numerics.ipopt))


def _guard(problem: CompiledProblem) -> ca.Function:
    """Return the blocked tip equations' determinant over its value at the start, by (x, p)."""
    x, p = (problem.nlp[key] for key in "xp")
    return ca.Function("guard", [x, p], [problem.outputs.call({"x": x, "p": p})["blocked_determinant"]])


def _rules(robot: Robot, task: DesignTask) -> Iterator[Constraint]:
    """Yield the rules of manufacture as inequalities; those of numbers only are checked elsewhere."""
    for rule in rules(robot, task.minimum_wall, task.walls):
        if rule.name not in task.allow:
            yield Constraint(rule.row, ca.MX(rule.value), rule.least, np.inf, "m", MILLIMETRE)


def _bodies(free: LoadCase, robot: Robot, allow: tuple[str, ...]) -> Iterator[Constraint]:
    """Yield what keeps a free shape possible as a body: exact for the arc without loads, in the mean for another.

    Its curvature times outer radius (S2) stays below 1, and an arc below a whole turn.
    """
    if SELF_INTERSECTION in allow:
        return
    angle, stretch = free.outputs["bending_angle"], free.outputs["stretch"]
    tightness = angle * robot.outer_radius / (robot.length * stretch**1.5)
    yield Constraint(SELF_INTERSECTION, tightness, -np.inf, _TIGHTEST)
    if free.transcribed.points.size == 0:
        yield Constraint(SELF_INTERSECTION, angle / (2 * np.pi), -np.inf, _TIGHTEST)


def _guards(cases: list[LoadCase]) -> Iterator[Constraint]:
    """Yield what keeps the program on the branch that begins at zero pressure, as far as inequalities can."""
    free = cases[0]
    slope = ca.jacobian(free.residuals[0], free.symbols[0])
    yield Constraint("end of the stretch's branch", slope, _SLOPE, np.inf)
    yield Constraint("stiffness that loses its sign", free.constants[:5], 0.0, np.inf)
    if len(cases) > 1:
        F_b = cases[1].outputs["tip_forces"][0] / cases[1].force_unit
        yield Constraint("contact", F_b, 0.0, np.inf)


def _required(outputs: Mapping[str, Any], evaluator: Evaluator) -> Iterator[Constraint]:
    """Yield the requirements, each over its limit's size."""
    for name, limits in evaluator.task.requirements.items():
        finite = [abs(v) for v in (limits.lower, limits.upper) if np.isfinite(v)]
        scale = max([*finite, 1e-3 * OUTPUTS[name].scale])
        yield Constraint(name, ca.MX(outputs[name]), limits.lower, limits.upper, name, scale)
