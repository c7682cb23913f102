"""How a boundary value problem is solved, as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Numerics:
    """Numerical choices of a run.

    Attributes
    ----------
    transcription
        Multiple shooting with RK4, or Legendre collocation.
    intervals
        Number of intervals on the rod, or None to refine until `accuracy` is met.
    accuracy
        Largest estimated tip position error, as a fraction of the robot's length L_0 [1].
    tolerance
        Largest scaled residual of a step that counts as solved [1].
    """

    transcription: Literal["multiple-shooting", "collocation"] = "multiple-shooting"
    intervals: int | None = None
    accuracy: float = 1e-6
    tolerance: float = 1e-8
