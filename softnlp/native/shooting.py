"""Shooting over many poses: the same kernels as machine code, or interpreted where there is none."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from softnlp.native.interpreted import Interpreted
from softnlp.native.ir import llvm_text
from softnlp.native.ir_functions import LANES, LIBRARY
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
        self._kept = {name: newton.kept for name, newton in kernels.solved.items()}
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

    def solve_one(
        self, step: str, intervals: int, data: Array, base: Array, end: Array
    ) -> tuple[int, Array, Array, Array]:
        """Return Newton's passes, 0 where it fails, the base and the tip of one pose, and its states behind intervals.

        data, base, end : (fields,), see `softnlp.native.kernels.Newton`. The states are (intervals, entries kept).
        """
        path = np.empty((intervals, self._kept[step]))
        counts, passes = np.array([intervals], np.int64), np.empty(1, np.int64)
        begin, reached = _side_by_side(base), np.empty((base.size, LANES))
        self._code.call(
            f"solve_{step}", LANES, counts, _side_by_side(data), begin, _side_by_side(end), reached, path, passes
        )
        return int(passes[0]), begin[:, 0], reached[:, 0], path

    def run_each(self, step: str, intervals: int, data: Array, state: Array) -> Array:
        """Return the states (fields, n) of n poses on one grid; data, state : (fields, n), any number of them."""
        n = state.shape[1]
        given, reached = _whole(data), _whole(state)
        counts = np.full(-(-n // WIDTH), intervals, np.int64)
        self._code.call(f"shoot_{step}", given.shape[1], counts, given, reached)
        return reached[:, :n]

    def apply_one(self, name: str, given: Array) -> Array:
        """Return what a map gives of one column (fields,)."""
        found = np.empty((self._rows[name], LANES))
        self._code.call(f"apply_{name}", LANES, _side_by_side(given), found)
        column: Array = found[:, 0]
        return column

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns, see `Shooting`."""
        poses = given.shape[1]
        whole = _whole(given)
        found = np.empty((self._rows[name], whole.shape[1]))
        if poses:
            self._code.call(f"apply_{name}", whole.shape[1], whole, found)
        return found[:, :poses]


def _whole(columns: Array) -> Array:
    """Return a copy of columns with the last one repeated, as many as whole instructions take."""
    rows, n = columns.shape
    found = np.empty((rows, n + -n % LANES))
    found[:, :n] = columns
    if n:
        found[:, n:] = columns[:, -1:]
    return found


def _side_by_side(column: Array) -> Array:
    """Return a column as often as one instruction takes it."""
    columns = np.empty((column.size, LANES))
    columns[:] = column[:, None]
    return columns


def shooting(kernels: Kernels) -> Shooting:
    """Return the kernels as machine code where it is to be had, else interpreted ones; their numbers are the same.

    Compiling takes a quarter of a second, which a dozen poses pay for.
    """
    text = llvm_text(kernels) if can_compile() else None
    return Interpreted(kernels) if text is None else Compiled(compiled(text, LIBRARY), kernels)
