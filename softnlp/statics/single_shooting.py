"""One pose by single shooting in machine code: the base moment by Newton's method, judged as the whole problem is.

The unknowns are the three entries of M(0), see `softnlp.statics.reduced`. What is found is a solution of the
multiple-shooting equations of all states, which are evaluated again; where it does not converge, or is not stable for
certain, nothing is returned and the general solver has its turn.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.quantities import LOADS
from softnlp.model.rod import STATE_SIZE
from softnlp.native.kernels import Kernels, Newton, Step
from softnlp.native.shooting import Compiled, shooting
from softnlp.statics.loadcase import RodFunctions, whole_weight
from softnlp.statics.reduced import (
    MOMENT,
    POSITION,
    ROTATION,
    STATE,
    base_state,
    function,
    reduced_rod,
    smallest_minor,
    turned,
)
from softnlp.statics.stretches import Stretches, stretch_maps

Array = NDArray[np.float64]

_PASSES = 8
_CONVERGED = 1e-11  # scaled residual of the tip
_DIVERGED = 1e3
_RICHARDSON = 16 / 15  # a fourth-order method's error over its change from halving every step
_SUBSTEPS = 4  # between nodes
_NEWTON_STEPS, _SETTLED = 3, 1e-12  # of the stretch, from between two samples 0.005 apart
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
        self._integrals = functions.lengths.size1_out(0)
        start, self._where = 0, dict[str, slice]()
        for name, q in functions.declared().items():
            self._where[name] = slice(start, start + q.size)
            start += q.size

    def loaded(self, column: Array) -> bool:
        """Whether tip force, tip moment or gravity acts, in a column of every quantity [SI]."""
        return bool(column[self._where[LOADS[0]].start : self._where[LOADS[-1]].stop].any())

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
        if self._functions.model.section.coupled:
            stretches, known = curve.find(column[:, None])
            if not known[0]:
                return None
            stretch, found = float(stretches[0]), self._code.apply_one("section", np.append(column, stretches))
        else:
            settled = self._code.apply_one("settled", np.append(column, curve.starts(column[:, None])))
            (stretch, change), found = settled[:2].tolist(), settled[2:]
            if not abs(change) <= _SETTLED:
                return None
        imbalance, length_unit, force_unit = found[-6:-3].tolist()
        return AtStretch(stretch, found[:-6], imbalance, length_unit, force_unit, found[-3:])

    def shoot(self, at: AtStretch, force: Array, moment: Array, intervals: int, start: Array) -> Shot | None:
        """Return the pose on a grid that Newton's method reaches from a base moment (3,); scaled loads (3,)."""
        data = np.concatenate([at.constants, force, moment])
        state = _BASE.copy()
        state[MOMENT] = start
        passes, base, reached, path = self._code.solve_one("directions", intervals, data, state, moment)
        if not passes:
            return None
        fine = self._code.run_one("value", 2 * intervals, data, base[:STATE])
        judged = self._code.apply_one("judged", np.concatenate([reached, moment, fine]))
        least, error, rotation_error = judged.tolist()
        if not least > 0:
            return None
        s = np.arange(intervals + 1) / intervals
        nodes = np.empty((STATE_SIZE, intervals + 1))
        nodes[:12, 0], nodes[15:, 0] = base[:12], base[MOMENT]
        nodes[:12, 1:], nodes[15:, 1:] = path[:, :12].T, path[:, MOMENT].T
        nodes[12:15] = force[:, None] + whole_weight(at.constants)[:, None] * (1 - s)
        ends = self._stepped(nodes[:, :-1], at.constants, 1 / intervals)
        return Shot(
            nodes=nodes,
            gaps=np.abs(ends[:STATE_SIZE] - nodes[:, 1:]).max(axis=1),
            tip=np.stack([nodes[12:15, -1] - force, reached[MOMENT] - moment]),
            integrals=ends[STATE_SIZE:].sum(axis=1),
            error=error,
            rotation_error=rotation_error,
            passes=passes,
        )

    def map(self, n: int) -> Callable[[Array, Array, Array], Array]:
        """Return what takes nodes (18, n), constants and steps (1, n) as `shape_function` does, mapped n times."""
        return self._between

    def _between(self, nodes: Array, constants: Array, h: Array) -> Array:
        data = _with_step(np.asarray(constants, dtype=float).ravel(), np.asarray(h))
        ends = self._code.run_each("between", _SUBSTEPS, data, nodes)
        return np.concatenate([ends, self._code.apply("strains", np.concatenate([ends, data[:-1]]))])

    def _stepped(self, nodes: Array, constants: Array, h: float) -> Array:
        """Return states a step of RK4 further than nodes, and the integrals over it: (18 + N + 2, n)."""
        integrals = np.zeros((self._integrals, nodes.shape[1]))
        data = _with_step(constants, np.full((1, nodes.shape[1]), h))
        return self._code.run_each("interval", 1, data, np.concatenate([nodes, integrals]))


def _with_step(constants: Array, h: Array) -> Array:
    """Return the constants beside each step (1, n) and the steps: (constants + 1, n)."""
    data = np.empty((constants.size + 1, h.size))
    data[:-1], data[-1] = constants[:, None], h
    return data


def _settled(maps: Mapping[str, ca.Function]) -> ca.Function:
    """Return [every quantity, a stretch near a root] -> [the root, the last change, what "section" gives there]."""
    given = ca.SX.sym("given", maps["balance"].size1_in(0))
    column, stretch, change = given[:-1], given[-1], ca.SX(0)
    for _ in range(_NEWTON_STEPS):
        rows = maps["balance"](ca.vertcat(column, stretch))
        change = -rows[0] / rows[1]
        stretch += change
    return function("settled", [given], ca.vertcat(stretch, change, maps["section"](ca.vertcat(column, stretch))))


def _newton() -> ca.Function:
    """Return [state at the tip, moment there] -> [largest entry of what is off, Newton's change of M(0)]."""
    given = ca.SX.sym("given", 4 * STATE + 4)
    off = given[MOMENT] - given[-3:]
    change = -_inverse(_tangents(given)[MOMENT, :]) @ off
    return function("newton", [given], ca.vertcat(ca.norm_inf(off), change))


def _judged() -> ca.Function:
    """Return [state at the tip, moment there, the state by half the step] -> [stability, error, error of rotation].

    stability : positive where no point on the way is conjugate to the base for certain, and where a turn of the tip,
    held by its moment alone, meets a moment against it.
    """
    given = ca.SX.sym("given", 5 * STATE + 4)
    reached, moment, fine = given[: 4 * STATE + 1], given[4 * STATE + 1 : 4 * STATE + 4], given[4 * STATE + 4 :]
    V = _tangents(reached)
    J = V[MOMENT, :]
    R = ca.reshape(reached[ROTATION], 3, 3)
    form = turned(R, V).T @ J
    change = fine - reached[:STATE] + V @ (_inverse(J) @ (moment - fine[MOMENT]))
    errors = ca.norm_2(change[POSITION]), ca.norm_2(change[ROTATION]) / np.sqrt(2)
    least = ca.fmin(reached[4 * STATE], smallest_minor(form + form.T))
    return function("judged", [given], ca.vertcat(least, *(_RICHARDSON * error for error in errors)))


def _tangents(reached: Any) -> Any:
    """Return the derivatives (15, 3) of a state by M(0)."""
    return ca.reshape(reached[STATE : 4 * STATE], STATE, 3)


def _inverse(J: Any) -> Any:
    """Return the inverse of a 3x3 matrix by its cofactors."""
    a, b, c = (J[:, k] for k in range(3))
    rows = [ca.cross(b, c), ca.cross(c, a), ca.cross(a, b)]
    return ca.horzcat(*rows).T / ca.dot(a, rows[0])


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
    if not functions.model.section.coupled:
        maps["settled"] = _settled(maps)
    kernels = Kernels(
        {
            "directions": reduced.directions,
            "value": reduced.value,
            "interval": Step(function("interval", [with_integrals, data, s], h * ca.vertcat(*along))),
            "between": Step(function("between", [x, data, s], h * functions.field(x, c))),
        },
        {"strains": function("strains", [state], strains), "newton": _newton(), "judged": _judged(), **maps},
        solved={"directions": Newton("newton", MOMENT.start, STATE, _CONVERGED, _DIVERGED, _PASSES)},
    )
    code = shooting(kernels)
    return SingleShooting(functions, code) if isinstance(code, Compiled) else None
