"""How a boundary value problem is solved, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from softnlp.base.errors import InputError
from softnlp.model.ipopt_options import checked_options

EngineName = Literal["auto", "ipopt", "newton"]
Transcribing = Literal["multiple-shooting", "collocation"]


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
    engine
        "auto": Newton's method proposes and IPOPT, started there on the whole program, closes. "ipopt": each solve
        along a path is one of IPOPT. "newton": without IPOPT.
    ipopt
        Options of IPOPT by name, of `softnlp.model.ipopt_options`; none with the engine "newton".
    """

    transcription: Transcribing = "multiple-shooting"
    intervals: int | None = None
    accuracy: float = 1e-6
    tolerance: float = 1e-8
    engine: EngineName = "auto"
    ipopt: Mapping[str, Any] | tuple[tuple[str, Any], ...] = ()

    def __post_init__(self) -> None:
        """Put the options in order.

        Raises
        ------
        InputError
            For an option that is not known or takes another value, and for options of an engine that does not run.
        """
        options = checked_options(dict(self.ipopt))
        if options and self.engine == "newton":
            raise InputError("not used with the engine 'newton'", key="ipopt")
        object.__setattr__(self, "ipopt", options)

    def without_ipopt(self) -> Numerics:
        """Return the same choices with Newton's method alone, for the many solves within a search.

        Returns
        -------
        Numerics
            Without options of IPOPT.
        """
        return replace(self, engine="newton", ipopt=())
