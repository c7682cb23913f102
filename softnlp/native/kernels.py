"""What is done to many poses: steps of RK4 in stages that share one function, and maps of columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca

from softnlp.nlp.transcription import RK4

WIDTH = 8
"""Poses that share a number of intervals."""

B_ENDS, B_MIDDLE = RK4.b[0], RK4.b[1]
"""Weights of the first and last, and of the middle stages of RK4."""


@dataclass(frozen=True, eq=False)
class Step:
    """One step of RK4 of what a state holds and of what is integrated beside it.

    rates : (x, data, s) -> dx/ds. begin : (state, data, s) -> x at the step's start, where x is not the state itself.
    end : (state, x, data, s, h) -> the state a step h further, x being integrated over the step; where that is not x.
    """

    rates: ca.Function
    begin: ca.Function | None = None
    end: ca.Function | None = None

    @property
    def integrated(self) -> int:
        """The number of entries of x."""
        return int(self.rates.size1_in(0))

    @property
    def data(self) -> int:
        """The number of data of a pose."""
        return int(self.rates.size1_in(1))

    @property
    def state(self) -> int:
        """The number of entries of the state."""
        return int(self.begin.size1_in(0)) if self.begin is not None else self.integrated

    @property
    def functions(self) -> dict[str, ca.Function]:
        """Those that it is made of, by name."""
        parts = {"rates": self.rates, "begin": self.begin, "end": self.end}
        return {name: function for name, function in parts.items() if function is not None}


@dataclass(frozen=True)
class Newton:
    """How some entries of the state at the base are found from the state at the tip.

    update : the map of [state at the tip, data of the pose's end] -> [size of what is off, changes of the entries].
    first : the entries' first place in the state. kept : how many entries of states on the way are. converged,
    hopeless : sizes at which it ends. most : passes.
    """

    update: str
    first: int
    kept: int
    converged: float
    hopeless: float
    most: int


@dataclass(frozen=True, eq=False)
class Kernels:
    """What is done to many poses.

    steps : by name. maps : by name, functions of one column to another. solved : steps at whose base some entries are
    found by Newton's method.
    """

    steps: Mapping[str, Step]
    maps: Mapping[str, ca.Function]
    solved: Mapping[str, Newton] = field(default_factory=dict)
