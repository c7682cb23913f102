"""Shooting over many poses: the same kernels compiled, or interpreted where there is no compiler."""

from __future__ import annotations

import ctypes
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from softnlp.workspace.compiled import library
from softnlp.workspace.csource import WIDTH, Kernels, c_source

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

_COLUMNS = 256  # poses to a call of an interpreted step


class Shooting(Protocol):
    """Runs `softnlp.workspace.csource.Kernels`."""

    def run(self, step: str, intervals: Counts, data: Array, state: Array) -> Array:
        """Return the states at the tip.

        intervals : one entry for each group of `WIDTH` poses. data, state : (fields, poses), of whole groups.
        """
        ...

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns for those given, (fields, poses)."""
        ...


class Compiled:
    """Kernels in a library of `softnlp.workspace.compiled`."""

    def __init__(self, code: ctypes.CDLL, kernels: Kernels) -> None:
        self._code = code
        self._rows = {name: function.size1_out(0) for name, function in kernels.maps.items()}

    def run(self, step: str, intervals: Counts, data: Array, state: Array) -> Array:
        """Return the states at the tip, see `Shooting`."""
        reached = np.array(state, order="C")
        given = np.ascontiguousarray(data)
        counts = np.ascontiguousarray(intervals, dtype=np.int64)
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in (counts, given, reached)]
        getattr(self._code, f"shoot_{step}")(ctypes.c_longlong(state.shape[1]), *pointers)
        return reached

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns, see `Shooting`."""
        poses = given.shape[1]
        padded = np.ascontiguousarray(given if poses % WIDTH == 0 else _padded(given, -poses % WIDTH))
        found = np.empty((self._rows[name], padded.shape[1]))
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in (padded, found)]
        getattr(self._code, f"apply_{name}")(ctypes.c_longlong(padded.shape[1]), *pointers)
        return found[:, :poses]


class Interpreted:
    """Kernels run by CasADi, a block of poses at a time."""

    def __init__(self, kernels: Kernels) -> None:
        self._steps = {name: step.map(_COLUMNS) for name, step in kernels.steps.items()}
        self._maps = {name: function.map(_COLUMNS) for name, function in kernels.maps.items()}

    def run(self, step: str, intervals: Counts, data: Array, state: Array) -> Array:
        """Return the states at the tip, see `Shooting`."""
        advance = self._steps[step]
        reached = np.array(state)
        each = np.repeat(intervals, WIDTH)
        for K in np.unique(intervals):
            columns = np.flatnonzero(each == K)
            for first in range(0, columns.size, _COLUMNS):
                chosen = columns[first : first + _COLUMNS]
                padded = np.resize(chosen, _COLUMNS)
                here, given, h = reached[:, padded], data[:, padded], np.full((1, _COLUMNS), 1.0 / K)
                for k in range(int(K)):
                    here = advance(here, given, np.full((1, _COLUMNS), k * (1.0 / K)), h)
                reached[:, chosen] = np.asarray(here)[:, : chosen.size]
        return reached

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns, see `Shooting`."""
        poses = given.shape[1]
        padded = _padded(given, -poses % _COLUMNS)
        blocks = [
            self._maps[name](padded[:, first : first + _COLUMNS]) for first in range(0, padded.shape[1], _COLUMNS)
        ]
        return np.hstack([np.asarray(block) for block in blocks])[:, :poses]


def _padded(columns: Array, more: int) -> Array:
    """Return columns with the last one repeated."""
    return np.hstack([columns, np.repeat(columns[:, -1:], more, axis=1)])


def shooting(kernels: Kernels, *, build: bool) -> Shooting:
    """Return the compiled kernels where they are to be had, else the interpreted ones; their numbers are the same.

    build : whether compiling is worth the second that it takes; what was compiled before is used in any case.
    """
    source = c_source(kernels)
    code = None if source is None else library(source, build=build)
    return Interpreted(kernels) if code is None else Compiled(code, kernels)
