"""Solving the continuous part of a design: from several consistent starts by IPOPT, judged by a solve of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.quantities import Model
from softnlp.nlp.optimality import not_optimal
from softnlp.nlp.search import minima, spread
from softnlp.statics.pose_grid import next_size
from softnlp.studies.design_evaluate import Evaluation, Evaluator, broken_rules, unmet
from softnlp.studies.design_problem import HOLDS, Active, DesignProblem, Optimum, design_problem
from softnlp.studies.design_task import OUTPUTS, Range

Array = NDArray[np.float64]

AGREES = 1e-3
"""Part of the objective by which the program and the solve that follows it may differ; beyond it they are not on the
same branch. From a tenth of it the program is solved again on a finer grid."""

_COARSEST, _FINEST = 15, 80  # intervals of the program
_TRIES = 300  # points among which starts are looked for
_HALVINGS = 4
_LOOKS = 32  # points whose free shape is looked at for starts that meet what is asked of it
_SAME, _CLOSE = 1e-6, 1e-5  # parts of the objective: ends that are one optimum, and starts that agree on it


@dataclass(frozen=True, eq=False)
class Outcome:
    """What was found of a candidate.

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
        self._compiled: dict[tuple[int, bytes], DesignProblem] = {}

    def problem(self, begun: Evaluation, intervals: int) -> DesignProblem:
        """Return the program for a design on a grid, compiled at first use for all that bend in the same plane."""
        plane = self.evaluator.plane(begun)
        key = (intervals, b"" if plane is None else np.round(plane, 12).tobytes())
        if key not in self._compiled:
            self._compiled[key] = design_problem(self.evaluator, intervals, plane)
        return self._compiled[key]

    def optima(self, begun: Sequence[Evaluation], intervals: int) -> list[Optimum]:
        """Return where the program ends from solved designs, as `minima`."""
        posed = [self.problem(e, intervals) for e in begun]
        ends = minima([p.start(e) for p, e in zip(posed, begun, strict=True)], HOLDS)
        return [p.optimum(solution) for p, solution in zip(2 * posed, ends, strict=False)]

    def best(self, model: Model, pressure: float | Range) -> Outcome:
        """Return the best design that any start leads to, solved again to the accuracy of the setting.

        pressure : fixed [Pa], or the task's range.
        """
        begun = list(self._starts(model, pressure))
        if not begun:
            return Outcome(None, ("no start has an equilibrium",))
        intervals = max(self._intervals(e) for e in begun)
        optima = self.optima(begun, intervals)
        outcome = self._best_of(model, optima, intervals)
        return replace(outcome, starts=len(begun), iterations=sum(o.solution.iterations for o in optima))

    def _best_of(self, model: Model, optima: Sequence[Optimum], intervals: int) -> Outcome:
        """Return the best optimum that is confirmed, else the best one and why it is not, else the nearest design."""
        task = self.evaluator.task
        order = sorted((o for o in optima if o.solution.holds(HOLDS)), key=lambda o: -task.sign * o.objective)
        tried: list[Optimum] = []
        refused: list[Outcome] = []
        for optimum in order:
            if any(_agree(optimum, other, _SAME) for other in tried):
                continue
            tried.append(optimum)
            found, final, used = self._confirmed(model, optimum, intervals)
            missing = [*unmet(found, task), *broken_rules(found.model.robot, task)]
            reasons = self._disagreement(found, final) or tuple(dict.fromkeys(missing))
            if not reasons:
                close = sum(_agree(o, optimum, _CLOSE) for o in order)
                end = final.solution
                if end.optimal:
                    return Outcome(found, (), final.active, close, intervals=used, optimal=True)
                # Elsewhere multipliers say nothing.
                doubt = (not_optimal(end.kkt, end.engine_status),)
                return Outcome(found, (), (), close, intervals=used, optimal=False, doubt=doubt)
            refused.append(Outcome(found, reasons, intervals=intervals))
        return refused[0] if refused else replace(self._nearest(model, optima), intervals=intervals)

    def _confirmed(self, model: Model, optimum: Optimum, intervals: int) -> tuple[Evaluation, Optimum, int]:
        """Solve an optimum again to the accuracy of the setting; on a finer grid where the program's was too coarse."""
        found = self._at_optimum(model, optimum)
        right = not unmet(found, self.evaluator.task) and not self._disagreement(found, optimum, AGREES / 10)
        if not found.outputs or right or 2 * intervals > _FINEST:
            return found, optimum, intervals
        finer = self.optima([found], 2 * intervals)[-1]
        if not finer.solution.holds(HOLDS):
            return found, optimum, intervals
        return self._confirmed(model, finer, 2 * intervals)

    def _at_optimum(self, model: Model, optimum: Optimum) -> Evaluation:
        return self.evaluator.full(_at(model, optimum.dimensions), optimum.pressure)

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

    def _nearest(self, model: Model, optima: Sequence[Optimum]) -> Outcome:
        """Return the design that misses least where no start led to a feasible one, and what it misses."""
        reached = [o for o in optima if np.isfinite(o.solution.residual)]
        if not reached:
            return Outcome(None, (f"the optimisation failed: {optima[0].solution.engine_status}",), failed=True)
        nearest = min(reached, key=lambda o: o.solution.residual)
        found = self._at_optimum(model, nearest)
        reasons = tuple(unmet(found, self.evaluator.task)) + tuple(broken_rules(found.model.robot, self.evaluator.task))
        if not reasons:
            return Outcome(None, (f"the optimisation did not converge: {nearest.solution.engine_status}",), failed=True)
        return Outcome(found, ("no design meets everything; the nearest misses " + "; ".join(dict.fromkeys(reasons)),))

    def _intervals(self, begun: Evaluation) -> int:
        """Return a grid for the program that is fine enough for the curl of a start."""
        poses = self.evaluator.poses.with_model(begun.model)
        coarse = poses.first_intervals(poses.column(self.evaluator.values(begun)), begun.outputs["stretch"])
        return min(max(next_size(coarse), _COARSEST), _FINEST)

    def _starts(self, model: Model, pressure: float | Range) -> Iterator[Evaluation]:
        """Yield solved designs to start from: those of a low-discrepancy sequence that can be made come first.

        Of these, those come first whose free shape meets what is asked of it.
        """
        task = self.evaluator.task
        box = dict(task.ranges) | ({"pressure": pressure} if isinstance(pressure, Range) else {})
        lower, upper = (np.array([getattr(r, side) for r in box.values()]) for side in ("lower", "upper"))
        fixed = {} if isinstance(pressure, Range) else {"pressure": pressure}
        points = [dict(zip(box, map(float, row), strict=True)) | fixed for row in spread(lower, upper, _TRIES)]
        made = (point for point in points if not broken_rules(_at(model, point).robot, task))
        # An arc is all that the program needs where nothing else is solved.
        arcs = self.evaluator.solver is None and not self.evaluator.setting.loads.act
        look = self.evaluator.free if arcs else self.evaluator.full
        wanted = task.first_guesses
        meeting: list[dict[str, float]] = []
        others: list[dict[str, float]] = []
        for point in islice(made, _LOOKS):
            looked = self.evaluator.free(_at(model, point), point["pressure"])
            (others if unmet(looked, task) else meeting).append(point)
            if len(meeting) == wanted:
                break
        chosen = [*meeting, *others, *points][: wanted if meeting or others else min(wanted, 2)]
        for point in chosen:
            levels = [point["pressure"] / 2**k for k in range(1 if fixed else _HALVINGS)]
            solved = (begun for P in levels if (begun := look(_at(model, point), P)).outputs)
            yield from islice(solved, 1)


def _agree(one: Optimum, other: Optimum, within: float) -> bool:
    """Whether two objectives are the same to a part of the other."""
    return abs(one.objective - other.objective) <= within * abs(other.objective)


def _at(model: Model, values: Mapping[str, float]) -> Model:
    """Return the model with continuous choices in place."""
    dimensions: dict[str, Any] = {name: value for name, value in values.items() if name != "pressure"}
    return replace(model, robot=replace(model.robot, **dimensions)) if dimensions else model
