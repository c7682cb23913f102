"""The linearised intervals of multiple shooting in machine code, all of them side by side.

Where position and chamber lengths enter no rate, an interval passes them on as they are; the other fifteen entries of
the state, and the stretch by way of the constants, are the directions along which a step of RK4 is differentiated. A
load that depends on the position leaves the intervals to the virtual machine.
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import STATE_SIZE
from softnlp.native.kernels import Kernels, Step
from softnlp.native.shooting import Compiled, shooting
from softnlp.statics.loadcase import RodFunctions
from softnlp.statics.reduced import function

Array = NDArray[np.float64]

_MOVING = slice(3, STATE_SIZE)  # rotation, force, moment
_TOGETHER, _BLOCKS = 4, 4  # directions to a block, the last of the last one that of the stretch: more compile longer
_WORTH_COMPILING = 2500  # intervals, which the virtual machine takes some 0.05 ms each for


class Tangents:
    """Differentiates the intervals of one kind of rod; compiled when they have cost as much as compiling does."""

    def __init__(self, functions: RodFunctions) -> None:
        self._functions = functions
        self._asked = 0
        self._code: Compiled | None = None
        size = functions.state_size
        needed = np.unique(functions.field.jac_sparsity(0, 0).get_triplet()[1])
        self._possible = functions.by_machine and bool(np.all(np.isin(needed, np.arange(size)[_MOVING])))
        self._passed_on = np.eye(size)
        start = np.zeros((_TOGETHER * _BLOCKS, size))
        start[:-1] = self._passed_on[_MOVING]
        self._start = start.reshape(_BLOCKS, _TOGETHER * size).T
        self._passed_on[_MOVING] = 0.0

    def ready(self, intervals: int) -> bool:
        """Whether machine code differentiates so many intervals; they count towards compiling it."""
        if self._possible and self._asked <= _WORTH_COMPILING:
            self._asked += intervals
            if self._asked > _WORTH_COMPILING:
                code = shooting(Kernels({"tangents": _step(self._functions)}, {}))
                self._code = code if isinstance(code, Compiled) else None
        return self._code is not None

    def maps(self, nodes: Array, constants: Array, slope: Array, h: float | Array) -> tuple[Array, Array]:
        """Return what each interval does to a change of its first node, and of the stretch: (K, nx, nx), (K, nx).

        nodes : (nx, K). slope : of the constants along the stretch. h : the length of an interval, or of each (K,).
        """
        assert self._code is not None
        size, K = nodes.shape
        state = np.empty((size * (1 + _TOGETHER), _BLOCKS, K))
        state[:size], state[size:] = nodes[:, None], self._start[:, :, None]
        data = np.zeros((2 * constants.size + 1, _BLOCKS, K))
        data[: constants.size], data[-1] = constants[:, None, None], h
        data[constants.size : -1, -1] = slope[:, None]
        moved = self._code.run_each("tangents", 1, data.reshape(len(data), -1), state.reshape(len(state), -1))[size:]
        directions = moved.reshape(_TOGETHER, size, _BLOCKS, K).transpose(3, 1, 2, 0).reshape(K, size, -1)
        maps = np.empty((K, size, size))
        maps[:] = self._passed_on
        maps[:, :, _MOVING] += directions[:, :, :-1]
        return maps, directions[:, :, -1]


def _step(functions: RodFunctions) -> Step:
    """Return the step of a state and a block of directions, the last of which may be that of the stretch."""
    size, nc = functions.state_size, functions.field.size1_in(1)
    every, data, s = ca.SX.sym("x", size * (1 + _TOGETHER)), ca.SX.sym("data", 2 * nc + 1), ca.SX.sym("s")
    x, V = every[:size], ca.reshape(every[size:], size, _TOGETHER)
    c, slope, h = data[:nc], data[nc : 2 * nc], data[2 * nc]
    moves = ca.vertcat(V, ca.horzcat(ca.SX(nc, _TOGETHER - 1), slope))
    rates = functions.field(x, c)
    along = ca.jtimes(rates, ca.vertcat(x, c), moves)
    return Step(function("tangents", [every, data, s], h * ca.vertcat(rates, ca.vec(along))))


@lru_cache(maxsize=16)
def tangents(functions: RodFunctions) -> Tangents:
    """Return what differentiates the intervals of a rod, the same for all its grids."""
    return Tangents(functions)
