"""IPOPT has the last word on a single solve: it starts at the solution that was proposed, on the whole program."""

from __future__ import annotations

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


def closed(engine: Engine, proposed: Solution, numerics: Numerics, tip: slice) -> Solution:
    """Return IPOPT's solution from a proposed one, or that where IPOPT takes no part or has solved it already.

    tip : where x holds the tip's position, in lengths of the robot.

    Raises
    ------
    DisputedError
        Where IPOPT ends at no solution, or at one whose tip is further away than the accuracy asked for.
    """
    if numerics.engine != "auto":
        return proposed
    found = confirmed(engine, proposed, engine.closed(proposed), numerics, tip)
    return replace(found, engine_status=proposed.engine_status)


def confirmed(engine: Engine, proposed: Solution, found: Solution, numerics: Numerics, tip: slice) -> Solution:
    """Return what IPOPT found where it confirms a proposed solution. Raises as `closed`."""
    away = float(np.linalg.norm(found.x[tip] - proposed.x[tip]))
    if found.holds(numerics.tolerance) and away <= numerics.accuracy:
        return found
    length = float(np.asarray(engine.problem.units(proposed.x, proposed.p)).ravel()[0]) / MILLIMETRE
    here, there = (", ".join(f"{length * v:.6g}" for v in solution.x[tip]) for solution in (proposed, found))
    raise disputed(f"the tip is at ({here}) mm by Newton's method and at ({there}) mm by IPOPT", found)


def disputed(both: str, found: Solution) -> DisputedError:
    """Return the error of two answers, in words that end with that of IPOPT."""
    said = "" if found.ipopt is None else f" ({found.ipopt.status})"
    return DisputedError(f"{Status.DISPUTED.advice}; {both}{said}, whose largest residual is {found.residual:.2g}")
