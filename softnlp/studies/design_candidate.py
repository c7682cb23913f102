"""One candidate of a design: checked, brought to its pressure or optimised, and judged."""

from __future__ import annotations

import time
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.model.contact_settings import require_in_front
from softnlp.model.materials import Material
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.statics.step import Step
from softnlp.studies.design_evaluate import Evaluation, Evaluator, broken_rules, missed, unmet
from softnlp.studies.design_optimise import Optimiser, Outcome
from softnlp.studies.design_problem import Active
from softnlp.studies.design_task import SIZES, DesignTask, PressureSteps, Range, Setting, with_choices

_FAILED = (Status.DIVERGED, Status.INACCURATE)
_LEVELS = 32  # pressures at which a free pressure is looked at before it is optimised


@dataclass(frozen=True, eq=False)
class Candidate:
    """One combination of the discrete choices, with the continuous ones and the pressure found for it.

    Attributes
    ----------
    number
        From 1.
    choices
        By name, whole robots and silicones by their `Robot` and `Material`; numbers [SI].
    robot, material
        With the choices in them.
    status
        "feasible", "infeasible", or "failed" where a solver gave up.
    reasons
        Why it is not feasible.
    outputs
        By name, numbers [SI] of the design chosen or, where none is feasible, of the one that misses least; may be
        empty.
    objective
        The output asked for [SI], nan where there is none.
    active
        Limits that hold the objective back, of continuous choices.
    agreeing, starts
        How many of how many first guesses led here.
    optimal
        Whether the first-order conditions of the best choice hold at its continuous choices, evaluated again; None
        where nothing continuous was chosen or nothing was found. A candidate that is feasible but not optimal says
        so in `warnings`.
    iterations, intervals
        Of the optimisation, and of the grid it was solved again on.
    warnings
        Of the robot and of the step.
    step
        Of the free or blocked shape.
    solve_time
        Of the whole candidate [s].
    """

    number: int
    choices: Mapping[str, Any]
    robot: Robot
    material: Material
    status: Literal["feasible", "infeasible", "failed"]
    reasons: tuple[str, ...]
    outputs: Mapping[str, float]
    objective: float
    active: tuple[Active, ...] = ()
    agreeing: int = 0
    starts: int = 0
    optimal: bool | None = None
    iterations: int = 0
    intervals: int | None = None
    warnings: tuple[str, ...] = ()
    step: Step | None = None
    solve_time: float = 0.0

    @property
    def is_feasible(self) -> bool:
        """Whether it meets everything."""
        return self.status == "feasible"


class CandidateEvaluator:
    """Evaluates candidates one after another; what is compiled for one structure (chambers, law) is kept."""

    def __init__(self, setting: Setting, task: DesignTask) -> None:
        self.setting = setting
        self.task = task
        self._made: dict[Hashable, Optimiser] = {}

    def optimiser(self, model: Model) -> Optimiser:
        """Return what is compiled for the kind of a model."""
        if model.kind not in self._made:
            self._made[model.kind] = Optimiser(Evaluator(self.setting, self.task, model))
        return self._made[model.kind]

    def candidate(self, number: int, combination: Mapping[str, Any]) -> Candidate:
        """Return a combination's candidate; never raises for one that cannot be made or solved."""
        began = time.perf_counter()
        robot, material = with_choices(self.setting, combination)
        model = Model(robot, material, self.setting.coefficients, self.setting.conventions)
        if self.task.ranges:
            found = self._optimised(model)
        elif reasons := broken_rules(robot, self.task):
            found = Outcome(None, tuple(reasons))
        elif isinstance(self.task.pressure, Range):
            found = self._at_free_pressure(model, self.task.pressure)
        else:
            found = self._at_pressure(model)
        found = self._in_front(model, found)
        made = _candidate(number, combination, model, found, self.task)
        return replace(made, solve_time=time.perf_counter() - began)

    def _in_front(self, model: Model, found: Outcome) -> Outcome:
        """Return what was found, with a reason where the unbent tip starts behind a wall given by a point."""
        robot = found.found.model.robot if found.found else model.robot
        try:
            require_in_front(self.setting.contact, [float(robot.length)] * self.task.needs_force)
        except InputError as error:
            return replace(found, reasons=(*found.reasons, error.message))
        return found

    def _at_pressure(self, model: Model) -> Outcome:
        """Judge a candidate of numbers at its pressure, or at the lowest step that meets everything."""
        evaluator = self.optimiser(model).evaluator
        if not isinstance(self.task.pressure, PressureSteps):
            found = evaluator.full(model, float(self.task.pressure))  # type: ignore[arg-type]
            return Outcome(found, tuple(unmet(found, self.task)))
        nearest: tuple[float, Evaluation] | None = None
        ended = ""
        for pressure in self.task.pressure.values():
            found = evaluator.free(model, pressure)
            if not found.outputs:
                ended = f"; from {pressure / 1e5:.4g} bar {found.status.value}: {found.message}"
                break
            if not unmet(found, self.task):
                found = evaluator.full(model, pressure)
                if not (reasons := unmet(found, self.task)):
                    return Outcome(found, ())
                if not found.outputs:
                    ended = f"; at {pressure / 1e5:.4g} bar {reasons[0]}"
                    continue
            off = sum(part for _, _, part in missed(found.outputs, self.task.requirements))
            if nearest is None or off < nearest[0]:
                nearest = off, found
        if nearest is None:
            return Outcome(None, (f"no step of the pressure has a solution{ended}",))
        missing = "; ".join(unmet(nearest[1], self.task))
        return Outcome(nearest[1], (f"no step of the pressure meets everything; nearest is {missing}{ended}",))

    def _at_free_pressure(self, model: Model, pressure: Range) -> Outcome:
        """Optimise the pressure alone, unless one requirement is missed at every pressure."""
        optimiser = self.optimiser(model)
        least = max(pressure.lower, pressure.upper / _LEVELS)  # not zero, where nothing bends
        looked = [optimiser.evaluator.free(model, float(P)) for P in np.linspace(least, pressure.upper, _LEVELS)]
        missing = [
            (e, {name: off for name, _, off in missed(e.outputs, self.task.requirements)}) for e in looked if e.outputs
        ]
        if missing and set.intersection(*(set(names) for _, names in missing)):
            nearest = min(missing, key=lambda found: sum(found[1].values()))[0]
            reasons = "; ".join(unmet(nearest, self.task))
            return Outcome(nearest, (f"no pressure meets everything; nearest is {reasons}",))
        return optimiser.best(model, pressure)

    def _optimised(self, model: Model) -> Outcome:
        """Optimise the dimensions, at the lowest step of the pressure where it comes in steps."""
        robot = model.robot
        if (robot.chambers_per_set - 1) * float(robot.chamber_angle) >= 2 * np.pi / robot.chamber_sets:
            return Outcome(None, ("sets that interleave cannot be optimised; choose a smaller chamber_angle",))
        pressure = self.task.pressure
        found = Outcome(None, ("there is no step of the pressure",))
        for P in pressure.values() if isinstance(pressure, PressureSteps) else [pressure]:
            found = self.optimiser(model).best(model, P)
            if not found.reasons:
                break
        return found


def _candidate(
    number: int, combination: Mapping[str, Any], model: Model, found: Outcome, task: DesignTask
) -> Candidate:
    """Put what was found of a combination together."""
    evaluation = found.found
    outputs = dict(evaluation.outputs) if evaluation else {}
    choices = dict(combination)
    robot = model.robot
    if evaluation is not None and task.ranges:
        robot = evaluation.model.robot
        robot = replace(robot, name=robot.name if robot.name.endswith("(modified)") else f"{robot.name} (modified)")
        choices |= {name: float(getattr(robot, name)) for name in SIZES if name in task.ranges}
    if evaluation is not None and not isinstance(task.pressure, int | float):
        choices["pressure"] = evaluation.pressure
    failed = found.failed or (evaluation is not None and evaluation.status in _FAILED)
    step = evaluation.step if evaluation else None
    return Candidate(
        number=number,
        choices=choices,
        robot=robot,
        material=model.material,
        status="feasible" if not found.reasons else "failed" if failed else "infeasible",
        reasons=found.reasons,
        outputs=outputs,
        objective=outputs.get(task.objective.name, float("nan")),
        active=found.active,
        agreeing=found.agreeing,
        starts=found.starts,
        optimal=found.optimal,
        iterations=found.iterations,
        intervals=found.intervals or (step.intervals if step else None),
        warnings=(*found.doubt, *(step.warnings if step else ())),
        step=step,
    )
