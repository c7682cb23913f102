"""Design: of all combinations and dimensions that may be chosen, those that meet the requirements, and the best."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from math import isfinite, prod
from typing import Any

from softnlp.base.errors import InputError
from softnlp.base.processes import require_workers, worker_pool
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.statics.wall import checked_contact
from softnlp.studies.design_candidate import Candidate, CandidateEvaluator
from softnlp.studies.design_evaluate import Evaluator
from softnlp.studies.design_task import MOST_ENUMERATED, DesignTask, Setting, check_task, with_choices
from softnlp.studies.forward import checked_loads

Progress = Callable[[int, Candidate], None]
_SEED = 7  # of a search


@dataclass(frozen=True, eq=False)
class Design:
    """A finished design study: what was asked, and every candidate in the order of the combinations.

    Attributes
    ----------
    setting
        What no choice changed.
    task
        Choices, requirements, what is best.
    candidates
        All of them, feasible or not.
    title
        Kept with the results.
    free_closure_force
        Blocked force of the best candidate by the closure `free` [N], where a force was asked for by another one and
        can
        be found.
    """

    setting: Setting
    task: DesignTask
    candidates: tuple[Candidate, ...]
    title: str = ""
    free_closure_force: float | None = None

    @property
    def feasible(self) -> tuple[Candidate, ...]:
        """The candidates that meet everything, best first."""
        sign = self.task.sign
        return tuple(sorted((c for c in self.candidates if c.is_feasible), key=lambda c: -sign * c.objective))

    @property
    def best(self) -> Candidate | None:
        """The best feasible candidate, or None."""
        return next(iter(self.feasible), None)


def design(
    robot: Robot,
    material: Material,
    task: DesignTask,
    *,
    loads: Loads = Loads(),
    contact: ContactSettings = ContactSettings(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    title: str = "",
    workers: int = 1,
    progress: Progress | None = None,
) -> Design:
    """Find the design that meets every requirement and maximises or minimises an output.

    Every combination of the discrete choices is a candidate. In each, what is a range is optimised as one nonlinear
    program with exact derivatives from several starts, and the answer solved again to the accuracy of `numerics`. More
    combinations than `MOST_ENUMERATED` are searched by optuna instead.

    Parameters
    ----------
    robot, material
        What choices do not change.
    task
        Choices, requirements, what is best.
    loads
        As `softnlp.forward`.
    contact
        As `softnlp.blocked_force`.
    coefficients, conventions, numerics, title
        As `softnlp.forward`.
    workers
        Processes, which do not run a script again.
    progress
        Called with the number done and each candidate as it is done; what it raises ends the study.

    Returns
    -------
    Design
        Every candidate; `best` is None where none is feasible.

    Raises
    ------
    InputError
        For a task or a number of workers that cannot be meant, or a search without optuna.
    """
    require_workers(workers)
    setting = Setting(
        robot, material, coefficients, conventions, checked_loads(loads), checked_contact(contact), numerics
    )
    check_task(task, setting)
    done: list[Candidate] = []
    for candidate in _candidates(setting, task, workers):
        done.append(candidate)
        if progress is not None:
            progress(len(done), candidate)
    return finished(setting, task, done, title)


def finished(setting: Setting, task: DesignTask, candidates: Sequence[Candidate], title: str = "") -> Design:
    """Return the design of the candidates that are done, in the order of their numbers."""
    done = Design(setting, task, tuple(sorted(candidates, key=lambda c: c.number)), title)
    best = done.best
    if best is None or not task.needs_force or setting.contact.closure == "free":
        return done
    other = replace(setting, contact=replace(setting.contact, closure="free"))
    model = Model(best.robot, best.material, setting.coefficients, setting.conventions)
    force = Evaluator(other, task, model).full(model, best.outputs["pressure"]).outputs.get("blocked_force")
    return replace(done, free_closure_force=force)


def _candidates(setting: Setting, task: DesignTask, workers: int) -> Iterator[Candidate]:
    """Yield every candidate as it is done."""
    evaluator = CandidateEvaluator(setting, task)
    if prod(len(values) for values in task.lists.values()) > MOST_ENUMERATED:
        yield from searched(evaluator)
        return
    every = list(enumerate(task.combinations(), start=1))
    if workers > 1:
        yield from _in_processes(setting, task, every, workers)
        return
    for number, combination in every:
        yield evaluator.candidate(number, combination)


def searched(evaluator: CandidateEvaluator) -> Iterator[Candidate]:
    """Yield the candidates of a search by optuna's tree-structured Parzen estimator; none twice, at most `trials`.

    A candidate that is not feasible counts as worse than every feasible one that was met before it.

    Raises
    ------
    InputError
        Where optuna is not installed.
    """
    try:
        import optuna
    except ImportError:
        raise InputError(
            "so many combinations are searched by optuna, which is not installed: pip install 'softnlp[design]', or "
            "list fewer values",
            key="choices",
        ) from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    task = evaluator.task
    study = optuna.create_study(
        direction="maximize" if task.maximise else "minimize", sampler=optuna.samplers.TPESampler(seed=_SEED)
    )
    met: dict[tuple[int, ...], float] = {}
    worst = 0.0
    for _ in range(task.trials):
        trial = study.ask()
        place = tuple(trial.suggest_categorical(name, list(range(len(values)))) for name, values in task.lists.items())
        if place not in met:
            combination = {name: values[k] for k, (name, values) in zip(place, task.lists.items(), strict=True)}
            candidate = evaluator.candidate(len(met) + 1, combination)
            if candidate.is_feasible and isfinite(candidate.objective):
                value = candidate.objective / task.objective.scale
                worst = min(worst, task.sign * value)
            else:
                value = task.sign * (worst - 1.0)
            met[place] = value
            yield candidate
        study.tell(trial, met[place])


def _in_processes(
    setting: Setting, task: DesignTask, every: Sequence[tuple[int, Mapping[str, Any]]], workers: int
) -> Iterator[Candidate]:
    """Yield candidates as processes finish them; those that share what is compiled are begun one after another."""

    def kind(pair: tuple[int, Mapping[str, Any]]) -> tuple[int, int, str]:
        robot, material = with_choices(setting, pair[1])
        return robot.chamber_sets, robot.chambers_per_set, material.law.name

    pool = worker_pool(min(workers, len(every), os.cpu_count() or 1), _Worker.begin, setting, task)
    try:
        for done in as_completed([pool.submit(_Worker.candidate, *pair) for pair in sorted(every, key=kind)]):
            yield done.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


class _Worker:
    """What a worker keeps between two candidates: an evaluator, whose programs are compiled once a structure."""

    evaluator: CandidateEvaluator

    @classmethod
    def begin(cls, setting: Setting, task: DesignTask) -> None:
        """Keep what was asked."""
        cls.evaluator = CandidateEvaluator(setting, task)

    @classmethod
    def candidate(cls, number: int, combination: Mapping[str, Any]) -> Candidate:
        """Return a candidate of the evaluator."""
        return cls.evaluator.candidate(number, combination)
