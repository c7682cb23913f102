"""IPOPT has the last word on a single solve: it starts at the solution that was proposed, on the whole program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import MILLIMETRE
from softnlp.model.numerics import Numerics
from softnlp.nlp.solver import Engine, Solution

Array = NDArray[np.float64]


class DisputedError(Exception):
    """IPOPT does not confirm a solution; the message says both tips."""


def closed(
    engine: Engine, proposed: Solution, numerics: Numerics, tip: slice, whole: tuple[Engine, Solution] | None = None
) -> Solution:
    """Return IPOPT's solution from a proposed pose, or that where IPOPT takes no part or has solved it already.

    tip : where x holds the tip's position, in lengths of the robot. whole : what else than the pose alone IPOPT solves,
    with the pose at the end of x, and its start. Raises as `close`, where the tip is further away than the accuracy.
    """
    if numerics.engine != "auto":
        return proposed

    def differs(found: Solution) -> str:
        away = float(np.linalg.norm(found.x[tip] - proposed.x[tip]))
        if found.holds(numerics.tolerance) and away <= numerics.accuracy:
            return ""
        units = np.asarray(engine.problem.units(proposed.x, proposed.p)).ravel() / MILLIMETRE
        here, there = (", ".join(f"{units[0] * v:.6g}" for v in solution.x[tip]) for solution in (proposed, found))
        return f"the tip is at ({here}) mm by Newton's method and at ({there}) mm by IPOPT"

    found = close(*(whole or (engine, proposed)), differs)
    return replace(found, engine_status=proposed.engine_status)


def close(engine: Engine, start: Solution, differs: Callable[[Solution], str]) -> Solution:
    """Return IPOPT's solution of a whole program from a proposed one.

    differs : how what IPOPT found differs from what was proposed, in words; none where it confirms it.

    Raises
    ------
    DisputedError
        Where it does not.
    """
    found = engine.closed(start)
    both = differs(found)
    if both:
        said = "" if found.ipopt is None else f" ({found.ipopt.status})"
        raise DisputedError(f"{Status.DISPUTED.advice}; {both}{said}, whose largest residual is {found.residual:.2g}")
    return found
