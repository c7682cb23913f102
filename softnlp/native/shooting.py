"""Shooting over many poses: the same kernels as machine code, or interpreted where there is none."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from softnlp.native.interpreted import Interpreted, padded
from softnlp.native.ir import LANES, LIBRARY, llvm_text
from softnlp.native.jit import Machine, can_compile, compiled
from softnlp.native.kernels import WIDTH, Kernels

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


class Shooting(Protocol):
    """Runs `softnlp.native.kernels.Kernels`."""

    def run(self, step: str, intervals: Counts, data: Array, state: Array) -> Array:
        """Return the states at the tip.

        intervals : one entry for each group of `WIDTH` poses. data, state : (fields, poses), of whole groups.
        """
        ...

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns for those given, (fields, poses)."""
        ...


class Compiled:
    """Kernels as machine code."""

    def __init__(self, code: Machine, kernels: Kernels) -> None:
        self._code = code
        self._rows = {name: function.size1_out(0) for name, function in kernels.maps.items()}

    def run(self, step: str, intervals: Counts, data: Array, state: Array) -> Array:
        """Return the states at the tip, see `Shooting`."""
        reached = np.array(state, order="C")
        counts = np.ascontiguousarray(intervals, dtype=np.int64)
        if state.shape[1]:
            self._code.call(f"shoot_{step}", state.shape[1], counts, np.ascontiguousarray(data), reached)
        return reached

    def run_one(self, step: str, intervals: int, data: Array, state: Array) -> Array:
        """Return the state at the tip of one pose; data, state : (fields,)."""
        reached = _side_by_side(state)
        self._code.call(f"shoot_{step}", LANES, np.array([intervals], np.int64), _side_by_side(data), reached)
        found: Array = reached[:, 0]
        return found

    def trace_one(self, step: str, intervals: int, data: Array, state: Array) -> Array:
        """Return the states (intervals + 1, fields) of one pose from base to tip; data, state : (fields,)."""
        reached = _side_by_side(state)
        path = np.empty((intervals + 1, *reached.shape))
        path[0] = reached
        counts = np.array([intervals], np.int64)
        self._code.call(f"trace_{step}", LANES, counts, _side_by_side(data), reached, path[1:])
        found: Array = path[:, :, 0]
        return found

    def run_each(self, step: str, intervals: int, data: Array, state: Array) -> Array:
        """Return the states (fields, n) of n poses on one grid; data, state : (fields, n), any number of them."""
        n = state.shape[1]
        given, reached = (np.array(padded(part, -n % LANES), order="C") for part in (data, state))
        counts = np.full(-(-n // WIDTH), intervals, np.int64)
        self._code.call(f"shoot_{step}", given.shape[1], counts, given, reached)
        return reached[:, :n]

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns, see `Shooting`."""
        poses = given.shape[1]
        whole = np.ascontiguousarray(padded(given, -poses % LANES))
        found = np.empty((self._rows[name], whole.shape[1]))
        if poses:
            self._code.call(f"apply_{name}", whole.shape[1], whole, found)
        return found[:, :poses]


def _side_by_side(column: Array) -> Array:
    """Return a column as often as one instruction takes it."""
    return np.repeat(column[:, None], LANES, axis=1)


def shooting(kernels: Kernels) -> Shooting:
    """Return the kernels as machine code where it is to be had, else interpreted ones; their numbers are the same.

    Compiling takes a quarter of a second, which a dozen poses pay for.
    """
    text = llvm_text(kernels) if can_compile() else None
    return Interpreted(kernels) if text is None else Compiled(compiled(text, LIBRARY), kernels)
