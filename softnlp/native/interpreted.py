"""The kernels of a sweep without machine code: each instruction of a step as one NumPy operation on many poses.

A step of arithmetic alone is the same to the last bit as when it is compiled; maps, which may hold powers and
logarithms, are run by CasADi, whose mathematical library is the one that is called then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.native.kernels import B_ENDS, B_MIDDLE, WIDTH, Kernels, Step

Array = NDArray[np.float64]

_COLUMNS = 256  # poses to a call of a map
_WORTH_NARROWING = 0.8  # part of the poses still under way below which the finished ones are left out


def _where(condition: Array, value: Array, out: Array) -> None:
    """Put the value where the condition is not zero, else zero."""
    out[...] = np.where(condition != 0, value, 0.0)


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
    ca.OP_FLOOR: (np.floor, (0,)),
    ca.OP_LT: (np.less, (0, 1)),
    ca.OP_LE: (np.less_equal, (0, 1)),
    ca.OP_EQ: (np.equal, (0, 1)),
    ca.OP_NE: (np.not_equal, (0, 1)),
    ca.OP_NOT: (np.logical_not, (0,)),
    ca.OP_IF_ELSE_ZERO: (_where, (0, 1)),
    ca.OP_FMIN: (np.fmin, (0, 1)),
    ca.OP_FMAX: (np.fmax, (0, 1)),
}
"""For each instruction: the NumPy operation, and which of its operands it takes."""


class Program:
    """A function of scalars as NumPy operations on registers of (registers, poses)."""

    def __init__(self, function: ca.Function) -> None:
        self._registers = function.sz_w()
        self.rows = int(function.size1_out(0))
        self._work: list[tuple[str, Any]] = []
        nodes = function.instructions_sx() if function.find_functions() else None
        for k in range(function.n_instructions()):
            kind = function.instruction_id(k)
            takes, gives = function.instruction_input(k), function.instruction_output(k)
            if kind == ca.OP_INPUT:
                self._work.append(("input", (gives[0], takes[0], takes[1])))
            elif kind == ca.OP_OUTPUT:
                self._work.append(("output", (gives[1], takes[0])))
            elif kind == ca.OP_CONST:
                self._work.append(("constant", (gives[0], function.instruction_constant(k))))
            elif kind == ca.OP_CALL and nodes is not None:
                self._work.append(("call", (Program(nodes[k].which_function()), takes, gives)))
            else:
                operation, operands = _OPERATIONS[kind]
                self._work.append(("operation", (operation, [takes[i] for i in operands], gives[0])))

    def bound(self, inputs: list[Array], out: Array) -> Callable[[], None]:
        """Return a call that runs the function on arrays of (fields, poses), which are read and written in place."""
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
            elif kind == "call":
                program, takes, gives = what
                given, found = (np.empty((len(rows), out.shape[1])) for rows in (takes, gives))
                calls += [(np.copyto, (given[i], w[register])) for i, register in enumerate(takes)]
                calls.append((program.bound([given], found), ()))
                calls += [(np.copyto, (w[register], found[i])) for i, register in enumerate(gives)]
            else:
                operation, operands, register = what
                calls.append((operation, (*(w[i] for i in operands), w[register])))

        def run() -> None:
            for operation, arguments in calls:
                operation(*arguments)

        return run


class StepProgram:
    """A step of RK4 as NumPy operations, in the order of the compiled one."""

    def __init__(self, step: Step) -> None:
        self._step = step
        self._parts = {name: Program(function) for name, function in step.functions.items()}

    def bound(self, here: Array, data: Array, s: Array, h: Array) -> Callable[[], None]:
        """Return a call that moves the states `here` (rows, poses) from s a step h further, in place."""
        step, parts, width = self._step, self._parts, here.shape[1]
        after, at = np.empty_like(here), np.empty((1, width))
        x, stage, reached, *k = (np.empty((step.integrated, width)) for _ in range(7))
        first = parts["rates"].bound([x, data, at], k[0])
        others = [parts["rates"].bound([stage, data, at], k[j]) for j in (1, 2, 3)]
        begin = parts["begin"].bound([here, data, at], x) if step.begin is not None else None
        end = parts["end"].bound([here, reached, data, s, h], after) if step.end is not None else None

        def run() -> None:
            half = 0.5 * h
            at[:] = s
            if begin is None:
                x[:] = here
            else:
                begin()
            first()
            for j, (by, places) in enumerate(((half, s + half), (half, s + half), (h, s + h))):
                np.add(x, by * k[j], out=stage)
                at[:] = places
                others[j]()
            reached[:] = x + h * (((B_ENDS * k[0] + B_MIDDLE * k[1]) + B_MIDDLE * k[2]) + B_ENDS * k[3])
            if end is None:
                here[:] = reached
            else:
                end()
                here[:] = after

        return run


class Interpreted:
    """Runs kernels without machine code."""

    def __init__(self, kernels: Kernels) -> None:
        self._programs = {name: StepProgram(step) for name, step in kernels.steps.items()}
        self._maps = {name: function.map(_COLUMNS) for name, function in kernels.maps.items()}

    def run(self, step: str, intervals: NDArray[np.int64], data: Array, state: Array) -> Array:
        """Return the states at the tip, see `softnlp.native.shooting.Shooting`."""
        reached = np.array(state)
        each = np.repeat(intervals, WIDTH)
        order = np.argsort(-each, kind="stable")  # the poses under way are always the first ones
        counts, here, given = each[order], np.ascontiguousarray(reached[:, order]), data[:, order]
        width, run, k = 0, None, 0
        with np.errstate(all="ignore"):
            while (under_way := int(np.sum(counts > k))) > 0:
                if run is None or under_way < _WORTH_NARROWING * width:
                    width = under_way
                    now = here[:, :width].copy()
                    s, h = np.empty((1, width)), (1.0 / counts[:width])[None, :]
                    run = self._programs[step].bound(now, given[:, :width], s, h)
                s[:] = k * h
                run()
                here[:, :under_way] = now[:, :under_way]
                k += 1
        reached[:, order] = here
        return reached

    def apply(self, name: str, given: Array) -> Array:
        """Return a map's columns, see `softnlp.native.shooting.Shooting`."""
        poses = given.shape[1]
        whole = padded(given, -poses % _COLUMNS)
        blocks = [self._maps[name](whole[:, first : first + _COLUMNS]) for first in range(0, whole.shape[1], _COLUMNS)]
        none = np.zeros((self._maps[name].size1_out(0), 0))
        return np.hstack([none, *(np.asarray(block) for block in blocks)])[:, :poses]


def padded(columns: Array, more: int) -> Array:
    """Return columns with the last one repeated."""
    return np.hstack([columns, np.repeat(columns[:, -1:], more, axis=1)]) if more else columns
