"""Shooting over many poses: the same kernels compiled, or interpreted where there is no compiler."""

from __future__ import annotations

import ctypes
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.compiled import library
from softnlp.batch.csource import WIDTH, Kernels, c_source
from softnlp.batch.interpreted import Interpreted, padded

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


class Shooting(Protocol):
    """Runs `softnlp.batch.csource.Kernels`."""

    def run(self, step: str, intervals: Counts, data: Array, state: Array) -> Array:
        """Return the states at the tip.

        intervals : one entry for each group of `WIDTH` poses. data, state : (fields, poses), of whole groups.
        """
        ...

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns for those given, (fields, poses)."""
        ...


class Compiled:
    """Kernels in a library of `softnlp.batch.compiled`."""

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
        whole = np.ascontiguousarray(padded(given, -poses % WIDTH))
        found = np.empty((self._rows[name], whole.shape[1]))
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in (whole, found)]
        getattr(self._code, f"apply_{name}")(ctypes.c_longlong(whole.shape[1]), *pointers)
        return found[:, :poses]


def shooting(kernels: Kernels, *, build: bool) -> Shooting:
    """Return the compiled kernels where they are to be had, else the interpreted ones; their numbers are the same.

    build : whether compiling is worth the second that it takes; what was compiled before is used in any case.
    """
    source = c_source(kernels)
    code = None if source is None else library(source, build=build)
    return Interpreted(kernels) if code is None else Compiled(code, kernels)
