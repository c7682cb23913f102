"""The kernels of a sweep where there is no compiler: each instruction of a step as one NumPy operation on many poses.

A step of arithmetic alone is the same to the last bit as when it is compiled; maps, which may hold powers and
logarithms, are run by CasADi, whose mathematical library is the compiler's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.batch.csource import WIDTH, Kernels

Array = NDArray[np.float64]

_COLUMNS = 256  # poses to a call of a map
_WORTH_NARROWING = 0.8  # part of the poses still under way below which the finished ones are left out

_OPERATIONS: dict[int, tuple[Callable[..., Any], tuple[int, ...]]] = {
    ca.OP_ASSIGN: (np.positive, (0,)),
    ca.OP_ADD: (np.add, (0, 1)),
    ca.OP_SUB: (np.subtract, (0, 1)),
    ca.OP_MUL: (np.multiply, (0, 1)),
    ca.OP_DIV: (np.divide, (0, 1)),
    ca.OP_NEG: (np.negative, (0,)),
    ca.OP_SQ: (np.multiply, (0, 0)),
    ca.OP_TWICE: (np.add, (0, 0)),
    ca.OP_INV: (np.reciprocal, (0,)),
    ca.OP_SQRT: (np.sqrt, (0,)),
    ca.OP_FABS: (np.absolute, (0,)),
    ca.OP_FMIN: (np.fmin, (0, 1)),
    ca.OP_FMAX: (np.fmax, (0, 1)),
}
"""For each instruction: the NumPy operation, and which of its operands it takes."""


class Program:
    """A step (state, data, s, h) -> state as NumPy operations on registers of (registers, poses)."""

    def __init__(self, step: ca.Function) -> None:
        self._registers = step.sz_w()
        self._work: list[tuple[str, Any]] = []
        for k in range(step.n_instructions()):
            kind = step.instruction_id(k)
            takes, gives = step.instruction_input(k), step.instruction_output(k)
            if kind == ca.OP_INPUT:
                self._work.append(("input", (gives[0], takes[0], takes[1])))
            elif kind == ca.OP_OUTPUT:
                self._work.append(("output", (gives[1], takes[0])))
            elif kind == ca.OP_CONST:
                self._work.append(("constant", (gives[0], step.instruction_constant(k))))
            else:
                function, operands = _OPERATIONS[kind]
                self._work.append(("operation", (function, [takes[i] for i in operands], gives[0])))

    def bound(self, inputs: list[Array], out: Array) -> Callable[[], None]:
        """Return a call that runs the step on arrays of (fields, poses), which are read and written in place."""
        w = np.empty((self._registers, out.shape[1]))
        calls: list[tuple[Callable[..., Any], tuple[Any, ...]]] = []
        for kind, what in self._work:
            if kind == "input":
                register, argument, row = what
                calls.append((np.copyto, (w[register], inputs[argument][row])))
            elif kind == "output":
                row, register = what
                calls.append((np.copyto, (out[row], w[register])))
            elif kind == "constant":
                register, value = what
                calls.append((np.copyto, (w[register], value)))
            else:
                function, operands, register = what
                calls.append((function, (*(w[i] for i in operands), w[register])))

        def run() -> None:
            for function, arguments in calls:
                function(*arguments)

        return run


class Interpreted:
    """Runs kernels without a compiler."""

    def __init__(self, kernels: Kernels) -> None:
        self._programs = {name: Program(step) for name, step in kernels.steps.items()}
        self._maps = {name: function.map(_COLUMNS) for name, function in kernels.maps.items()}

    def run(self, step: str, intervals: NDArray[np.int64], data: Array, state: Array) -> Array:
        """Return the states at the tip, see `softnlp.batch.shooting.Shooting`."""
        reached = np.array(state)
        each = np.repeat(intervals, WIDTH)
        order = np.argsort(-each, kind="stable")  # the poses under way are always the first ones
        counts, here, given = each[order], np.ascontiguousarray(reached[:, order]), data[:, order]
        width, run, k = 0, None, 0
        with np.errstate(all="ignore"):
            while (under_way := int(np.sum(counts > k))) > 0:
                if run is None or under_way < _WORTH_NARROWING * width:
                    width = under_way
                    now, after = here[:, :width].copy(), np.empty((here.shape[0], width))
                    s, h = np.empty((1, width)), (1.0 / counts[:width])[None, :]
                    run = self._programs[step].bound([now, given[:, :width], s, h], after)
                s[:] = k * h
                run()
                now[:] = after
                here[:, :under_way] = now[:, :under_way]
                k += 1
        reached[:, order] = here
        return reached

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns, see `softnlp.batch.shooting.Shooting`."""
        poses = given.shape[1]
        whole = padded(given, -poses % _COLUMNS)
        blocks = [self._maps[name](whole[:, first : first + _COLUMNS]) for first in range(0, whole.shape[1], _COLUMNS)]
        none = np.zeros((self._maps[name].size1_out(0), 0))
        return np.hstack([none, *(np.asarray(block) for block in blocks)])[:, :poses]


def padded(columns: Array, more: int) -> Array:
    """Return columns with the last one repeated."""
    return np.hstack([columns, np.repeat(columns[:, -1:], more, axis=1)]) if more else columns
