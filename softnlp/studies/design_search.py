"""Searching more combinations than can be enumerated, by optuna's tree-structured Parzen estimator with one seed."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import Any

from softnlp.base.errors import InputError
from softnlp.studies.design_candidate import Candidate, Workshop

_SEED = 7


def searched(workshop: Workshop) -> Iterator[Candidate]:
    """Yield the candidates of a search, none twice; at most `trials` of the task.

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
    task = workshop.task
    study = optuna.create_study(
        direction="maximize" if task.maximise else "minimize", sampler=optuna.samplers.TPESampler(seed=_SEED)
    )
    met: dict[tuple[int, ...], float] = {}
    worst = 0.0
    for _ in range(task.trials):
        trial = study.ask()
        place = tuple(trial.suggest_categorical(name, list(range(len(values)))) for name, values in task.lists.items())
        if place not in met:
            combination: dict[str, Any] = {
                name: values[k] for k, (name, values) in zip(place, task.lists.items(), strict=True)
            }
            candidate = workshop.candidate(len(met) + 1, combination)
            if candidate.is_feasible and isfinite(candidate.objective):
                value = candidate.objective / task.objective.scale
                worst = min(worst, task.sign * value)
            else:
                value = task.sign * (worst - 1.0)
            met[place] = value
            yield candidate
        study.tell(trial, met[place])
