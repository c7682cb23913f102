"""Solving the continuous part of a design: from several consistent starts by IPOPT, judged by a solve of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.quantities import Model
from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.optimality import OPTIMAL, kkt_error, not_optimal
from softnlp.nlp.solver import violation
from softnlp.statics.loadcase import LoadCase
from softnlp.statics.pose import between_nodes, shape_function
from softnlp.statics.pose_grid import next_size
from softnlp.statics.wall import Situation
from softnlp.studies.design_evaluate import Evaluation, Evaluator, broken_rules, unmet
from softnlp.studies.design_problem import FOLD, FOLD_SCALE, OBJECTIVE_SCALE, PRESSURE, DesignProblem, design_problem
from softnlp.studies.design_task import OUTPUTS, Range

Array = NDArray[np.float64]

AGREES = 1e-3
"""Part of the objective by which the program and the solve that follows it may differ; beyond it they are not on the
same branch. From a tenth of it the program is solved again on a finer grid."""

_COARSEST, _FINEST = 15, 80  # intervals of the program
_HOLDS = 1e-7  # scaled violation of a solved program
_ACTIVE = 1e-6  # a limit is active where its scaled multiplier is above this
_TRIES = 300  # points among which starts are looked for
_HALVINGS = 4
_LOOKS = 32  # points whose free shape is looked at for starts that meet what is asked of it
_STEPS = 15
_SMALL = 1e-3  # a scaled choice below this moves by parts of this
_NEAR = 0.2  # part by which a choice may move in one step of the slow way


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
    """Where the program ended from one start.

    x : of the program. values : the continuous choices, and "pressure", SI. objective : SI. violation : largest scaled
    one, evaluated again. kkt : as of `softnlp.nlp.solver.Solution`. engine_status : IPOPT's own word, for information.
    """

    x: Array
    values: dict[str, float]
    objective: float
    violation: float
    active: tuple[Active, ...]
    iterations: int
    engine_status: str
    kkt: float = np.inf

    @property
    def holds(self) -> bool:
        """Whether every equation and limit holds."""
        return self.violation <= _HOLDS


@dataclass(frozen=True, eq=False)
class Optimised:
    """The continuous part of a candidate.

    found : the design, solved again to the accuracy of the setting; None where nothing was. reasons : why it is not
    feasible, none where it is. agreeing, starts : how many of how many starts ended there. failed : a solver gave up.
    optimal : whether the first-order conditions hold there; None where nothing was optimised. doubt : why not.
    """

    found: Evaluation | None
    reasons: tuple[str, ...]
    active: tuple[Active, ...] = ()
    agreeing: int = 0
    starts: int = 0
    iterations: int = 0
    intervals: int = 0
    failed: bool = False
    optimal: bool | None = None
    doubt: tuple[str, ...] = ()


class Optimiser:
    """Optimises designs of one structure; what is compiled is kept between them."""

    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator
        self._shape = shape_function(evaluator.functions)
        self._compiled: dict[tuple[int, bytes], DesignProblem] = {}

    def problem(self, intervals: int, plane: Array | None = None) -> DesignProblem:
        """Return the compiled program on a grid and in a plane of symmetry, building it at first use."""
        key = (intervals, b"" if plane is None else np.round(plane, 12).tobytes())
        if key not in self._compiled:
            self._compiled[key] = design_problem(self.evaluator, intervals, plane)
        return self._compiled[key]

    def best(self, model: Model, pressure: float | Range) -> Optimised:
        """Return the best design that any start leads to, solved again to the accuracy of the setting.

        pressure : fixed [Pa], or the task's range.
        """
        begun = [e for e in self._starts(model, pressure) if e.outputs]
        if not begun:
            return Optimised(None, ("no start has an equilibrium",))
        intervals = max(self._intervals(e) for e in begun)
        optima = [self.optimise(e, intervals) for e in begun]
        if not any(o.holds for o in optima):
            optima += [self._stepwise(e, intervals) for e in begun]
        spent = sum(o.iterations for o in optima)
        task, sign = self.evaluator.task, self.evaluator.task.sign
        order = sorted((o for o in optima if o.holds), key=lambda o: -sign * o.objective)
        refused: list[tuple[Evaluation, tuple[str, ...]]] = []
        tried: list[float] = []
        for optimum in order:
            if any(abs(optimum.objective - other) <= 1e-6 * abs(other) for other in tried):
                continue
            tried.append(optimum.objective)
            found, final, used = self._confirmed(model, optimum, intervals)
            missing = [*unmet(found, task), *broken_rules(found.model.robot, task)]
            reasons = self._disagreement(found, final) or tuple(dict.fromkeys(missing))
            if not reasons:
                close = [o for o in order if abs(o.objective - optimum.objective) <= 1e-5 * abs(optimum.objective)]
                optimal = final.kkt <= OPTIMAL
                doubt = () if optimal else (not_optimal(final.kkt, final.engine_status),)
                active = final.active if optimal else ()  # elsewhere multipliers say nothing
                done = Optimised(found, (), active, len(close), len(begun), spent, used)
                return replace(done, optimal=optimal, doubt=doubt)
            refused.append((found, reasons))
        if refused:
            found, reasons = refused[0]
            return Optimised(found, reasons, (), 0, len(begun), spent, intervals)
        return replace(self._nearest(model, optima), starts=len(begun), iterations=spent, intervals=intervals)

    def optimise(self, start: Evaluation, intervals: int) -> Optimum:
        """Solve the program from a solved design."""
        posed = self.problem(intervals, self._plane(start))
        return self._solved(posed, *self.start(start, posed), start.pressure, np.inf)

    def _stepwise(self, start: Evaluation, intervals: int) -> Optimum:
        """Solve the program again and again with the choices kept near the last answer: slower, and more robust."""
        posed = self.problem(intervals, self._plane(start))
        x, p, scale = self.start(start, posed)
        n, near, spent = posed.problem.free_size, _NEAR, 0
        for _ in range(_STEPS):
            found = self._solved(posed, x, p, scale, start.pressure, near)
            spent += found.iterations
            if found.holds:
                moved = np.abs(found.x[:n] - x[:n]) / np.maximum(np.abs(x[:n]), _SMALL)
                if np.all(moved < 0.99 * near):  # no bound that is not the task's holds it
                    return replace(found, iterations=spent)
                x = found.x
            else:
                near /= 2
        return replace(found, violation=np.inf, iterations=spent)

    def _solved(self, posed: DesignProblem, x: Array, p: Array, scale: float, pressure: float, near: float) -> Optimum:
        """Solve the program from x with the choices within a part `near` of where they are."""
        problem, task = posed.problem, self.evaluator.task
        lower, upper = problem.lower_x.copy(), problem.upper_x.copy()
        if np.isfinite(near):
            n = problem.free_size
            room = near * np.maximum(np.abs(x[:n]), _SMALL)
            lower[:n], upper[:n] = np.maximum(lower[:n], x[:n] - room), np.minimum(upper[:n], x[:n] + room)
        try:
            result = posed.solver(x0=x, p=p, lbx=lower, ubx=upper, lbg=posed.lower, ubg=posed.upper)
        except RuntimeError as error:  # IPOPT met a number that is not finite
            return Optimum(x, {}, np.nan, np.inf, (), 0, str(error).splitlines()[-1])
        stats, begun = posed.solver.stats(), x
        x, lam_x, lam_g = (np.asarray(result[key], dtype=float).ravel() for key in ("x", "lam_x", "lam_g"))
        values = {name.removeprefix("robot."): float(v[0]) for name, v in problem.free_values(x).items()}
        values["pressure"] = values.pop(PRESSURE, pressure)
        return Optimum(
            x=x,
            values=values,
            objective=-task.sign * float(result["f"]) * scale,
            violation=violation(problem, x, p),
            active=tuple(self._active(posed, lam_g, lam_x, scale)),
            iterations=int(stats["iter_count"]),
            engine_status=str(stats["return_status"]),
            kkt=kkt_error(posed.slopes, posed.bounds, p, begun, x, lam_x, lam_g),
        )

    def start(self, begun: Evaluation, posed: DesignProblem) -> tuple[Array, Array, float]:
        """Return x, p and the objective's scale of a program at a solved design."""
        evaluator, problem = self.evaluator, posed.problem
        solver = evaluator.solver
        P = begun.pressure * evaluator.direction
        poses = evaluator.poses.with_model(begun.model)
        values = poses.values(P, evaluator.setting.loads)
        column = poses.column(values)
        if solver is not None:
            pressed = np.array([float(P[k] > 0) for k in begun.model.robot.set_of_chamber])
            situation = Situation(P, evaluator.setting.loads, begun.wall)
            values = solver.with_model(begun.model).values(situation, pressed, np.zeros(0))
        objective = evaluator.task.objective
        scale = max(abs(begun.outputs[objective.name]), objective.scale)
        values |= {PRESSURE: begun.pressure, OBJECTIVE_SCALE: scale}
        fixed = {q.name for q in problem.fixed}
        p = problem.pack({name: value for name, value in values.items() if name in fixed})
        head = problem.pack_free({q.name: values[q.name] for q in problem.free})
        x = np.concatenate([head, *(self._guess(case, begun, column) for case in posed.cases)])
        if posed.guard is not None:
            at_start, at_rest = float(posed.guard(x, p)), float(posed.guard(self._at_rest(posed, column), p))
            # A start nearer to a fold than designs may be is inside its own limit.
            size = np.copysign(min(abs(at_rest), abs(at_start) / (2 * FOLD)), at_start)
            p = problem.pack({**{n: v for n, v in values.items() if n in fixed}, FOLD_SCALE: size})
        return x, p, scale

    def _at_rest(self, posed: DesignProblem, column: Array) -> Array:
        """Return x of the straight robot without pressure or wall force."""
        head = posed.problem.pack_free({q.name: 0.0 if q.name == PRESSURE else q.nominal for q in posed.problem.free})
        none = np.where(np.arange(column.size) < len(self.evaluator.direction), 0.0, column)
        return np.concatenate([head, *(case.arc(none, 1.0) for case in posed.cases)])

    def _plane(self, begun: Evaluation) -> Array | None:
        """Return the normal of the plane that the blocked shape of a design keeps to."""
        solver, P = self.evaluator.solver, begun.pressure * self.evaluator.direction
        if solver is None:
            return None
        return solver.with_model(begun.model).plane(Situation(P, self.evaluator.setting.loads, begun.wall))

    def _guess(self, case: LoadCase, begun: Evaluation, column: Array) -> Array:
        """Return the unknowns of a case at a solved design; where there is none of the case, the arc's."""
        stretch, s = begun.outputs["stretch"], case.transcribed.points
        functions, free, blocked = case.functions, begun.free, begun.blocked
        if s.size and case.name == "blocked" and blocked is not None:
            nodes = blocked.grid.nodes(blocked.solution.x)
            states = between_nodes(self._shape, nodes, blocked.constants, s)[: functions.state_size]
            return np.concatenate([[stretch], states.T.ravel(), blocked.grid.tip_forces(blocked.solution.x)])
        if s.size and case.name == "free" and free is not None:
            states = between_nodes(self.evaluator.poses.shape, free.nodes, free.constants, s)[:STATE_SIZE]
            return np.concatenate([[stretch], states.T.ravel()])
        return case.arc(column, stretch)

    def _active(self, posed: DesignProblem, lam_g: Array, lam_x: Array, scale: float) -> Iterator[Active]:
        """Yield the limits with a multiplier, rows first, then bounds of the choices."""
        problem = posed.problem
        # f = -sign objective / scale and df/d(upper) = -lam, so loosening an upper limit gains sign scale lam.
        sign = self.evaluator.task.sign
        for row, limit in posed.limits:
            lam = float(lam_g[row])
            if abs(lam) > _ACTIVE:
                bound = (posed.upper if lam > 0 else posed.lower)[row] * limit.scale
                has_limit = limit.name in OUTPUTS or limit.unit == "m"
                yield Active(
                    limit.name,
                    "upper" if lam > 0 else "lower",
                    float(bound) if has_limit else np.nan,
                    sign * scale * abs(lam) / limit.scale,
                )
        for q, lam in zip(problem.free, lam_x, strict=False):
            if abs(lam) > _ACTIVE:
                name = "pressure" if q.name == PRESSURE else q.name.removeprefix("robot.")
                bound = q.upper if lam > 0 else q.lower
                yield Active(name, "upper" if lam > 0 else "lower", bound, sign * scale * abs(float(lam)) / q.scale)

    def _confirmed(self, model: Model, optimum: Optimum, intervals: int) -> tuple[Evaluation, Optimum, int]:
        """Solve an optimum again to the accuracy of the setting; on a finer grid where the program's was too coarse."""
        task = self.evaluator.task
        while True:
            found = self.evaluator.full(_at(model, optimum.values), optimum.values["pressure"])
            right = not unmet(found, task) and not self._disagreement(found, optimum, AGREES / 10)
            if not found.outputs or right or 2 * intervals > _FINEST:
                return found, optimum, intervals
            intervals *= 2
            finer = self.optimise(found, intervals)
            if not finer.holds:
                finer = self._stepwise(found, intervals)
            if not finer.holds:
                return found, optimum, intervals // 2
            optimum = finer

    def _disagreement(self, found: Evaluation, optimum: Optimum, within: float = AGREES) -> tuple[str, ...]:
        """Say where the program's answer is not the one followed from zero pressure."""
        name = self.evaluator.task.objective.name
        if not found.outputs:
            return (f"the optimum found is not on the branch from zero pressure: {found.message}",)
        exact = found.outputs[name]
        if abs(exact - optimum.objective) <= within * max(abs(exact), 1e-3 * OUTPUTS[name].scale):
            return ()
        return (
            f"the optimum found is not on the branch from zero pressure: {OUTPUTS[name].key} is "
            f"{optimum.objective / OUTPUTS[name].scale:.5g} there and {exact / OUTPUTS[name].scale:.5g} on the branch",
        )

    def _nearest(self, model: Model, optima: list[Optimum]) -> Optimised:
        """Return the design that misses least where no start led to a feasible one, and what it misses."""
        reached = [o for o in optima if np.isfinite(o.violation)]
        if not reached:
            return Optimised(None, (f"the optimisation failed: {optima[0].engine_status}",), failed=True)
        nearest = min(reached, key=lambda o: o.violation)
        found = self.evaluator.full(_at(model, nearest.values), nearest.values["pressure"])
        reasons = tuple(unmet(found, self.evaluator.task)) + tuple(broken_rules(found.model.robot, self.evaluator.task))
        if not reasons:
            return Optimised(None, (f"the optimisation did not converge: {nearest.engine_status}",), failed=True)
        return Optimised(
            found, ("no design meets everything; the nearest misses " + "; ".join(dict.fromkeys(reasons)),)
        )

    def _intervals(self, begun: Evaluation) -> int:
        """Return a grid for the program that is fine enough for the curl of a start."""
        poses = self.evaluator.poses.with_model(begun.model)
        column = poses.column(poses.values(begun.pressure * self.evaluator.direction, self.evaluator.setting.loads))
        coarse = poses.first_intervals(column, begun.outputs["stretch"])
        return min(max(next_size(coarse), _COARSEST), _FINEST)

    def _starts(self, model: Model, pressure: float | Range) -> Iterator[Evaluation]:
        """Yield solved designs to start from: those of a low-discrepancy sequence that can be made come first.

        Of these, those come first whose free shape meets what is asked of it.
        """
        task = self.evaluator.task
        box = dict(task.ranges) | ({"pressure": pressure} if isinstance(pressure, Range) else {})
        points = [dict(zip(box, point, strict=True)) for point in spread(list(box.values()), _TRIES)]
        made = (q for q in points if not broken_rules(_at(model, q).robot, task))
        # An arc is all that the program needs where nothing else is solved.
        arcs = self.evaluator.solver is None and not self.evaluator.setting.loads.act
        look = self.evaluator.free if arcs else self.evaluator.full
        wanted = task.first_guesses
        fixed = pressure if not isinstance(pressure, Range) else 0.0
        meeting: list[dict[str, float]] = []
        others: list[dict[str, float]] = []
        for point, _ in zip(made, range(_LOOKS), strict=False):
            looked = self.evaluator.free(_at(model, point), float(point.get("pressure", fixed)))
            (others if unmet(looked, task) else meeting).append(point)
            if len(meeting) == wanted:
                break
        chosen = [*meeting, *others, *points][: wanted if meeting or others else min(wanted, 2)]
        for point in chosen:
            P = point.get("pressure", fixed)
            for _ in range(_HALVINGS if isinstance(pressure, Range) else 1):
                begun = look(_at(model, point), float(P))
                if begun.outputs:
                    break
                P = P / 2
            yield begun


def _at(model: Model, values: Mapping[str, Any]) -> Model:
    """Return the model with continuous choices in place."""
    dimensions = {name: value for name, value in values.items() if name != "pressure"}
    return replace(model, robot=replace(model.robot, **dimensions)) if dimensions else model


def spread(box: list[Range], count: int) -> Array:
    """Return points of a low-discrepancy sequence in a box, (count, d); the first is its middle.

    The additive recurrence with the powers of the root of g^(d+1) = g + 1, always the same.
    """
    d = len(box)
    g = 2.0
    for _ in range(64):
        g = (1 + g) ** (1 / (d + 1))
    step = g ** -np.arange(1, d + 1)
    unit = (0.5 + np.arange(count)[:, None] * step) % 1.0
    lower, upper = (np.array([getattr(r, side) for r in box]) for side in ("lower", "upper"))
    points: Array = lower + unit * (upper - lower)
    return points
