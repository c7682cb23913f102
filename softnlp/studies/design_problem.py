"""The continuous part of a design as one nonlinear program: free and blocked shape, dimensions and pressure free."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import quantity
from softnlp.base.units import MILLIMETRE
from softnlp.model.body import Body, Segment
from softnlp.model.quantities import Model, with_symbols
from softnlp.model.robot import ROBOTS, SELF_INTERSECTION, Robot
from softnlp.model.rules import rules
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.problem import CompiledProblem
from softnlp.nlp.search import Start
from softnlp.nlp.solver import Engine, Solution
from softnlp.nlp.transcription import MultipleShooting
from softnlp.statics.blocked_grid import transferred
from softnlp.statics.case import case
from softnlp.statics.condensed import CondensedSolver
from softnlp.statics.loadcase import LoadCase
from softnlp.statics.pose import between_nodes
from softnlp.statics.posed import problem
from softnlp.studies.design_evaluate import Evaluation, Evaluator, chamber_gaps, free_outputs, robot_outputs
from softnlp.studies.design_task import OUTPUTS, DesignTask, Range

Array = NDArray[np.float64]

HOLDS = 1e-7
"""Scaled violation of a solved program."""

_PRESSURE = "applied pressure"
_OBJECTIVE_SCALE = "objective scale"
_FOLD_SCALE = "fold scale"
_FOLD = 0.02  # of the determinant of the robot at rest: below it the branch of the blocked shape is about to turn
_TIGHTEST = 0.999  # of what a body can take; an answer at 1 would pass through itself
_SLOPE = 1e-3  # of the scaled stretch balance: the branch from zero pressure ends where it vanishes
_ACTIVE = 1e-6  # a limit is active where its scaled multiplier is above this
_ITERATIONS = 60
_OPTIONS = {"bound_relax_factor": 1e-10, "diverging_iterates_tol": 1e4, "mu_strategy": "adaptive"}


@dataclass(frozen=True)
class Active:
    """A limit that holds the objective back.

    Attributes
    ----------
    name
        Of a choice, an output or a rule of manufacture.
    side
        "lower" or "upper".
    limit
        Its value [SI], nan where it has none of its own.
    rate
        What the objective gains for each unit by which the limit is loosened [SI].
    """

    name: str
    side: str
    limit: float
    rate: float


@dataclass(frozen=True, eq=False)
class Optimum:
    """Where the program ended. dimensions : those chosen, by name. pressure, objective : all SI."""

    solution: Solution
    dimensions: Mapping[str, float]
    pressure: float
    objective: float
    active: tuple[Active, ...]


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """The program of one structure on one grid; material and what is not chosen are fixed values.

    cases : "free", and "blocked" where a force is asked. engine : IPOPT.
    """

    evaluator: Evaluator
    problem: CompiledProblem
    cases: tuple[LoadCase, ...]
    engine: Engine

    def start(self, begun: Evaluation) -> Start:
        """Return where the program begins at a solved design."""
        compiled, objective = self.problem, self.evaluator.task.objective
        values = self.evaluator.values(begun)
        column = self.evaluator.poses.column(values)
        values[_PRESSURE] = begun.pressure
        values[_OBJECTIVE_SCALE] = max(abs(begun.outputs[objective.name]), objective.scale)
        head = compiled.pack_free({q.name: values[q.name] for q in compiled.free})
        known = {q.name: values[q.name] for q in compiled.fixed if q.name in values}
        x, p = (
            np.concatenate([head, *(self._guess(shape, begun, column) for shape in self.cases)]),
            compiled.pack(known),
        )
        if len(self.cases) > 1:
            straight = np.where(np.arange(column.size) < self.evaluator.direction.size, 0.0, column)
            head = np.where([q.name == _PRESSURE for q in compiled.free], 0.0, head)
            rest = np.concatenate([head, *(shape.arc(straight, 1.0) for shape in self.cases)])
            at_start, at_rest = (float(compiled.residual(at, p)[-1]) for at in (x, rest))
            # A start nearer to a fold than designs may be is inside its own limit.
            size = np.copysign(min(abs(at_rest), abs(at_start) / (2 * _FOLD)), at_start)
            p = compiled.pack({**known, _FOLD_SCALE: size})
        return Start(self.engine, p, x)

    def _guess(self, shape: LoadCase, begun: Evaluation, column: Array) -> Array:
        """Return the unknowns of a shape at a solved design; where there is none of it, the arc's."""
        stretch, s, size = begun.outputs["stretch"], shape.transcribed.points, shape.functions.state_size
        free, solver = begun.free, self.evaluator.solver
        if shape.name == "blocked" and begun.blocked and solver:
            return transferred(begun.blocked, shape, solver.equations.shape)
        if shape.name == "free" and s.size and free:
            states = between_nodes(self.evaluator.poses.shape, free.nodes, free.constants, s)[:size]
            return np.concatenate([[stretch], states.T.ravel()])
        return shape.arc(column, stretch)

    def optimum(self, solution: Solution) -> Optimum:
        """Return the design at a solution."""
        found = {name: float(value[0]) for name, value in self.problem.values(solution.x, solution.p).items()}
        scale, ipopt, sign = found[_OBJECTIVE_SCALE], solution.ipopt, self.evaluator.task.sign
        assert ipopt is not None
        return Optimum(
            solution,
            {name: found[f"robot.{name}"] for name in self.evaluator.task.ranges},
            found[_PRESSURE],
            -sign * ipopt.objective * scale,
            # f = -sign objective / scale and df/d(upper) = -lam, so loosening an upper limit gains sign scale lam.
            tuple(self._active(ipopt.rows, ipopt.bounds, sign * scale)) if ipopt.rows.size else (),
        )

    def _active(self, lam_g: Array, lam_x: Array, unit: float) -> Iterator[Active]:
        """Yield the limits with a multiplier, rows first, then bounds of the choices."""
        compiled = self.problem
        for limit, equation in zip(compiled.constraints, compiled.equations[-len(compiled.constraints) :], strict=True):
            for row in equation.rows:
                lam = float(lam_g[row])
                if abs(lam) > _ACTIVE:
                    bound = float((compiled.upper_g if lam > 0 else compiled.lower_g)[row] * limit.scale)
                    value = bound if limit.name in OUTPUTS or limit.unit == "m" else np.nan
                    yield Active(limit.name, _side(lam), value, unit * abs(lam) / limit.scale)
        for q, entry in zip(compiled.free, lam_x, strict=False):
            lam = float(entry)
            if abs(lam) > _ACTIVE:
                name = "pressure" if q.name == _PRESSURE else q.name.removeprefix("robot.")
                yield Active(name, _side(lam), q.upper if lam > 0 else q.lower, unit * abs(lam) / q.scale)


def _side(multiplier: float) -> str:
    return "upper" if multiplier > 0 else "lower"


def design_problem(evaluator: Evaluator, intervals: int, plane: Array | None) -> DesignProblem:
    """Pose and compile the program for the structure of an evaluator.

    Free are the task's ranges. The rules of manufacture and the requirements are inequalities; where the branch of the
    stretch ends, contact that pulls, and folds of the blocked shape are excluded by inequalities too.

    plane : of symmetry, as for `CondensedSolver`, in which the blocked shape folds.
    """
    task, setting = evaluator.task, evaluator.setting
    body = _body(evaluator.poses.model)
    ranges = {f"robot.{name}": values for name, values in task.ranges.items()}
    declared = body.quantities | {
        key: replace(
            body.quantities[key], scale=(values.lower + values.upper) / 2, lower=values.lower, upper=values.upper
        )
        for key, values in ranges.items()
    }
    limits = task.pressure if isinstance(task.pressure, Range) else Range(0.0, np.inf)
    applied = quantity(_PRESSURE, "Pa", 1e5, scale=1e5, lower=limits.lower, upper=limits.upper)
    scale, fold = quantity(_OBJECTIVE_SCALE, "1", 1.0), quantity(_FOLD_SCALE, "1", 1.0)
    robot = with_symbols(body.models[0], {key: q.symbol for key, q in declared.items()}).robot
    given: dict[str, Any] = {key: declared[key] for key in ranges}
    given["pressure"] = applied.symbol * ca.DM(evaluator.direction)

    method = MultipleShooting(intervals)
    free = case("free", body, given=given, method=method if setting.loads.act else None)
    assert isinstance(free, LoadCase)
    outputs = {**robot_outputs(robot), **free_outputs(free.outputs, robot.length), "pressure": applied.symbol}
    outputs["chamber_gap"] = ca.vertcat(*chamber_gaps(robot, free.outputs["stretch"]))
    cases, rows = [free], [*_rules(robot, task), *_on_the_branch(free)]
    if task.needs_force:
        given["contact.free_lengths"] = free.outputs["chamber_lengths"]
        blocked = case("blocked", body, given=given, wall=setting.contact.closure, method=method)
        assert isinstance(blocked, LoadCase)
        cases.append(blocked)
        outputs["blocked_force"] = blocked.outputs["tip_forces"][0]
        rows += _against_the_wall(blocked, plane, fold.symbol)
    rows += [*_bodies(free, robot, task.allow), *_required(outputs, evaluator)]

    chosen = [*ranges, *[_PRESSURE] * isinstance(task.pressure, Range)]
    moved = [q.symbol for q in (*declared.values(), applied) if q.name in chosen]
    unknown = ca.vertcat(*moved, *(symbol for shape in cases for symbol in shape.symbols))
    compiled = problem(
        cases,
        given=[applied, scale, *[fold] * task.needs_force],
        free=chosen,
        constraints=_together([row for row in rows if ca.depends_on(row.expression, unknown)]),
        objective=-task.sign * outputs[task.objective.name] / scale.symbol,
    ).compiled
    options = {**_OPTIONS, **dict(setting.numerics.ipopt)}
    engine = Engine(compiled, ipopt_only=True, max_iterations=_ITERATIONS, tolerance=1e-9, options=options)
    return DesignProblem(evaluator, compiled, tuple(cases), engine)


def _body(model: Model) -> Body:
    """Return a body of the kind of a model that can be made, whatever the numbers: each of them is given later."""
    counts = {name: getattr(model.robot, name) for name in ("chamber_sets", "chambers_per_set")}
    made = replace(ROBOTS["D25L60"], **counts)
    return Body([Segment(made, model.material)], model.coefficients, model.conventions)


def _together(rows: list[Constraint]) -> list[Constraint]:
    """Return the constraints with those of one name as one, such as a rule that holds between several chambers."""
    found: dict[str, Constraint] = {}
    for row in rows:
        if (before := found.get(row.name)) is None:
            found[row.name] = row
        else:
            lower, upper = (
                np.append(np.broadcast_to(a, before.expression.numel()), b)
                for a, b in ((before.lower, row.lower), (before.upper, row.upper))
            )
            both = ca.vertcat(before.expression, row.expression)
            found[row.name] = replace(before, expression=both, lower=lower, upper=upper)
    return list(found.values())


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
    turns = [angle / (2 * np.pi)] if free.transcribed.points.size == 0 else []
    yield Constraint(SELF_INTERSECTION, ca.vertcat(tightness, *turns), -np.inf, _TIGHTEST)


def _on_the_branch(free: LoadCase) -> Iterator[Constraint]:
    """Yield what keeps the program on the stretch's branch from zero pressure, as far as inequalities can."""
    slope = ca.jacobian(free.residuals[0], free.symbols[0])
    yield Constraint("end of the stretch's branch", slope, _SLOPE, np.inf)
    yield Constraint("stiffness that loses its sign", free.constants[:5], 0.0, np.inf)


def _against_the_wall(blocked: LoadCase, plane: Array | None, fold: ca.MX) -> Iterator[Constraint]:
    """Yield what keeps the blocked shape on its branch: it pushes, and the tip equations' determinant keeps its sign.

    The derivatives of the determinant are second ones of the rod already.
    """
    assert isinstance(blocked.method, MultipleShooting)
    yield Constraint("contact", blocked.outputs["tip_forces"][0] / blocked.force_unit, 0.0, np.inf)
    solver = CondensedSolver(blocked.functions, blocked.method, plane)
    size = solver.determinant_expression(ca.vertcat(*blocked.symbols), blocked.column)
    yield Constraint("fold of the blocked shape", size / fold, _FOLD, np.inf, in_hessian=False)


def _required(outputs: Mapping[str, Any], evaluator: Evaluator) -> Iterator[Constraint]:
    """Yield the requirements, each over its limit's size."""
    for name, limits in evaluator.task.requirements.items():
        finite = [abs(v) for v in (limits.lower, limits.upper) if np.isfinite(v)]
        scale = max([*finite, 1e-3 * OUTPUTS[name].scale])
        yield Constraint(name, ca.MX(outputs[name]), limits.lower, limits.upper, name, scale)
