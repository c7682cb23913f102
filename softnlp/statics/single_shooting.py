"""One pose by single shooting in machine code: the base moment by Newton's method, judged as the whole problem is.

The unknowns are the three entries of M(0), see `softnlp.statics.reduced`. What is found is a solution of the
multiple-shooting equations of all states, which are evaluated again; where it does not converge, or is not stable for
certain, nothing is returned and the general solver has its turn.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.quantities import LOADS
from softnlp.model.rod import STATE_SIZE
from softnlp.native.kernels import Kernels, Step
from softnlp.native.shooting import Compiled, shooting
from softnlp.statics.loadcase import RodFunctions, whole_weight
from softnlp.statics.reduced import MOMENT, POSITION, ROTATION, STATE, base_state, function, reduced_rod
from softnlp.statics.stretches import Stretches, stretch_maps

Array = NDArray[np.float64]

_PASSES = 8
_CONVERGED = 1e-11  # scaled residual of the tip
_DIVERGED = 1e3
_RICHARDSON = 16 / 15  # a fourth-order method's error over its change from halving every step
_SUBSTEPS = 4  # between nodes
_MOST_CURVES = 4

_BASE = base_state(np.zeros((3, 1)))[:, 0]


@dataclass(frozen=True, eq=False)
class AtStretch:
    """A rod at its stretch: constants c of the load case, scaled imbalance of the stretch, units (L_0, EI / L_0^2).

    arc_tip : (3,) of the circular arc without loads, scaled.
    """

    stretch: float
    constants: Array
    imbalance: float
    length_unit: float
    force_unit: float
    arc_tip: Array


@dataclass(frozen=True, eq=False)
class Shot:
    """A converged, stable pose on a grid, in scaled units.

    nodes : (18, K + 1). gaps : (18,) largest errors of the equations between nodes. tip : (2, 3) of force and moment
    at the tip. integrals : chamber lengths (N), bending angle, backbone length. error, rotation_error : estimated, see
    `softnlp.statics.pose_grid.Solved`. passes : of Newton's method.
    """

    nodes: Array
    gaps: Array
    tip: Array
    integrals: Array
    error: float
    rotation_error: float
    passes: int


class SingleShooting:
    """Finds poses of one kind of rod under dead loads; the curve of the stretch is kept for the numbers used last."""

    def __init__(self, functions: RodFunctions, code: Compiled) -> None:
        self._functions = functions
        self._code = code
        self._curves: OrderedDict[bytes, Stretches] = OrderedDict()
        start, self._where = 0, dict[str, slice]()
        for name, q in functions.declared().items():
            self._where[name] = slice(start, start + q.size)
            start += q.size

    def dead_loads(self, column: Array) -> Array:
        """Return tip force, tip moment and gravity (9,) in a column of every quantity [SI]."""
        return np.concatenate([column[self._where[name]] for name in LOADS])

    def loads(self, column: Array, at: AtStretch) -> tuple[Array, Array]:
        """Return the scaled tip force and moment (3,)."""
        force, moment = (column[self._where[name]] for name in LOADS[:2])
        return force / at.force_unit, moment / (at.force_unit * at.length_unit)

    def at_stretch(self, column: Array) -> AtStretch | None:
        """Return the rod at the stretch of a column of every quantity [SI]; None where that is not plain to see."""
        others = column.copy()
        for name in ("pressure", *LOADS):
            others[self._where[name]] = 0.0
        key = others.tobytes()
        curve = self._curves.pop(key, None) or Stretches(self._functions, self._code, shared=True)
        self._curves[key] = curve
        if len(self._curves) > _MOST_CURVES:
            self._curves.popitem(last=False)
        stretch, known = curve.find(column[:, None])
        if not known[0]:
            return None
        found = self._code.apply("section", np.append(column, stretch)[:, None])[:, 0]
        imbalance, length_unit, force_unit = (float(v) for v in found[-6:-3])
        return AtStretch(float(stretch[0]), found[:-6], imbalance, length_unit, force_unit, found[-3:])

    def shoot(self, at: AtStretch, force: Array, moment: Array, intervals: int, start: Array) -> Shot | None:
        """Return the pose on a grid that Newton's method reaches from a base moment (3,); scaled loads (3,)."""
        data = np.concatenate([at.constants, force, moment])
        state = _BASE.copy()
        state[MOMENT] = start
        passes = 0
        while True:
            path = self._code.trace_one("directions", intervals, data, state)
            reached = path[-1]
            off = reached[MOMENT] - moment
            size = float(np.abs(off).max())
            passes += 1
            if not size < _DIVERGED or (size > _CONVERGED and passes == _PASSES):
                return None
            tangents = reached[STATE : 4 * STATE].reshape(3, STATE)
            J = tangents[:, MOMENT].T
            if size <= _CONVERGED:
                break
            state[MOMENT] -= np.linalg.solve(J, off)
        if not (reached[4 * STATE] > 0 and _pushes_back(reached[ROTATION], tangents[:, ROTATION], J)):
            return None
        s = np.arange(intervals + 1) / intervals
        nodes = np.empty((STATE_SIZE, intervals + 1))
        nodes[:12], nodes[15:] = path[:, :12].T, path[:, MOMENT].T
        nodes[12:15] = force[:, None] + whole_weight(at.constants)[:, None] * (1 - s)
        ends = self._stepped(nodes[:, :-1], at.constants, 1 / intervals)
        fine = self._code.run_one("value", 2 * intervals, data, state[:STATE])
        change = fine - reached[:STATE] + np.linalg.solve(J, moment - fine[MOMENT]) @ tangents
        return Shot(
            nodes=nodes,
            gaps=np.abs(ends[:STATE_SIZE] - nodes[:, 1:]).max(axis=1),
            tip=np.stack([nodes[12:15, -1] - force, off]),
            integrals=ends[STATE_SIZE:].sum(axis=1),
            error=_RICHARDSON * float(np.linalg.norm(change[POSITION])),
            rotation_error=_RICHARDSON * float(np.linalg.norm(change[ROTATION]) / np.sqrt(2)),
            passes=passes,
        )

    def map(self, n: int) -> Callable[[Array, Array, Array], Array]:
        """Return what takes nodes (18, n), constants and steps (1, n) as `shape_function` does, mapped n times."""
        return self._between

    def _between(self, nodes: Array, constants: Array, h: Array) -> Array:
        column = np.asarray(constants).reshape(-1, 1)
        data = np.vstack([np.repeat(column, h.size, axis=1), np.reshape(h, (1, -1))])
        ends = self._code.run_each("between", _SUBSTEPS, data, nodes)
        return np.vstack([ends, self._code.apply("strains", np.vstack([ends, data[:-1]]))])

    def _stepped(self, nodes: Array, constants: Array, h: float) -> Array:
        """Return states a step of RK4 further than nodes, and the integrals over it: (18 + N + 2, n)."""
        n = nodes.shape[1]
        data = np.repeat(np.append(constants, h)[:, None], n, axis=1)
        integrals = np.zeros((self._functions.lengths.size1_out(0), n))
        return self._code.run_each("interval", 1, data, np.vstack([nodes, integrals]))


def _pushes_back(R: Array, turned: Array, J: Array) -> bool:
    """Whether a turn of the tip, held by its moment alone, meets a moment against it: the form is positive definite."""
    W = turned.reshape(3, 3, 3).transpose(0, 2, 1) @ R.reshape(3, 3)  # dR R^T, of each direction
    U = np.stack([W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]])
    form = U.T @ J
    return bool(np.linalg.eigvalsh(form + form.T)[0] > 0)


def single_shooting(functions: RodFunctions) -> SingleShooting | None:
    """Compile what finds poses of a rod with dead loads; None where there is nothing to compile with."""
    reduced = reduced_rod(functions)
    functions = functions.in_kernels
    size, nc = functions.state_size, functions.field.size1_in(1)
    x, data, s = ca.SX.sym("x", size), ca.SX.sym("data", nc + 1), ca.SX.sym("s")
    c, h = data[:nc], data[nc]
    with_integrals = ca.SX.sym("x", size + functions.lengths.size1_out(0))
    along = [functions.field(with_integrals[:size], c), functions.lengths(with_integrals[:size], c)]
    state = ca.SX.sym("x", size + nc)
    strains = ca.vertcat(
        *functions.strains(state[:size], state[size:]), *functions.resultants(state[:size], state[size:])
    )
    maps = stretch_maps(functions)
    given = ca.SX.sym("given", maps["section"].size1_in(0))
    arc = functions.arc(given[:-1], given[-1], 1.0)
    maps["section"] = function("section", [given], ca.vertcat(maps["section"](given), arc[:3]))
    kernels = Kernels(
        {
            "directions": reduced.directions,
            "value": reduced.value,
            "interval": Step(function("interval", [with_integrals, data, s], h * ca.vertcat(*along))),
            "between": Step(function("between", [x, data, s], h * functions.field(x, c))),
        },
        {"strains": function("strains", [state], strains), **maps},
        traced=("directions",),
    )
    code = shooting(kernels)
    return SingleShooting(functions, code) if isinstance(code, Compiled) else None
