"""Comparisons made up without a solve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softnlp import COEFFICIENT_SETS, ContactSettings, material, robot
from softnlp.base.status import Status
from softnlp.studies.comparison import Comparison, Solved
from softnlp.studies.measurements import Observed
from softnlp.studies.variants import every_variant

ECOFLEX = material("Ecoflex 00-50")


def made_up(
    values: np.ndarray,
    simulated: np.ndarray,
    robots: int = 1,
    pressure: np.ndarray | None = None,
    laws: Sequence[str] = ("mooney-rivlin",),
) -> Comparison:
    """Return a comparison of rows (M, 7) dealt out to robots; simulated : (variants, M, 7). pressure : (M, 3) [Pa]."""
    P = np.zeros((len(values), 3)) if pressure is None else pressure
    values, simulated = (np.concatenate([v, np.full((*v.shape[:-1], 1), np.nan)], axis=-1) for v in (values, simulated))
    unseen = np.zeros((len(values), 9)), np.full(len(values), np.nan)
    parts = [np.arange(k, len(values), robots) for k in range(robots)]
    observed = tuple(
        Observed(robot("D25L60"), f"robot {k + 1}", P[r], values[r], *(u[r] for u in unseen))
        for k, r in enumerate(parts)
    )
    solved = []
    for each in simulated:
        each = np.where(np.isfinite(values), each, np.nan)
        status = [Status.SOLVED if np.isfinite(row).any() else Status.FOLD for row in each]
        solved.append(tuple(Solved(each[r], tuple(status[k] for k in r), ("",) * len(r)) for r in parts))
    sets = {f"set {k + 1}": COEFFICIENT_SETS["reproduction"] for k in range(len(simulated) // len(laws))}
    variants = every_variant([material("Ecoflex 00-50", law) for law in laws], sets)
    return Comparison(observed, variants, tuple(solved), ContactSettings(), "free")
