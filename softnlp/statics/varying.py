"""The rod where its section varies along s: the stretch is a field, lambda(s), by the section's own balance.

Between two knots every number of the section is linear in s. Wall and fluid carry no force where no load acts, so the
balance of Eq. (10) holds at each s with the numbers that the section has there; differentiated along s it gives
lambda', and the stretch and the place become states like the others. What is compiled for a uniform rod is taken at
each s, and its units, which are those of the section there, are changed to those at the beginning of the segment.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model import rod
from softnlp.nlp.transcription import RK4, rk_step
from softnlp.statics.loadcase import RodFunctions, centres_of
from softnlp.statics.stability import transition_function

Array = NDArray[np.float64]

STRETCH, PLACE = rod.STATE_SIZE, rod.STATE_SIZE + 1
STATE_BLOCKS = {**rod.STATE_BLOCKS, "stretch": slice(STRETCH, PLACE), "place": slice(PLACE, PLACE + 1)}
_SUBSTEPS = 4


@dataclass(frozen=True, eq=False)
class VaryingRod:
    """A part of a segment between two knots as functions of s in 0..1 along the part.

    The state is [p, R, N, M, stretch, s]; c stacks what `RodFunctions.section` takes at the part's two ends, its share
    of the segment's length, and the unit of force.

    field : (x, c) -> dx/ds. lengths : (x, c) -> rates as of `RodFunctions`. mean : (x, c) -> rate of the stretch's
    mean over the segment. resultants : (x, c) -> strains v, u, then n and m of the wall alone.
    """

    field: ca.Function
    lengths: ca.Function
    mean: ca.Function
    resultants: ca.Function

    @cached_property
    def shape(self) -> ca.Function:
        """What `softnlp.statics.pose.shape_function` is of a uniform rod, and the stretch and the place (32,)."""
        x, c, h = ca.SX.sym("x", PLACE + 1), ca.SX.sym("c", self.field.size1_in(1)), ca.SX.sym("h")
        end = x
        for _ in range(_SUBSTEPS):
            end = self._step(end, c, h / _SUBSTEPS)
        every = ca.vertcat(end[: rod.STATE_SIZE], self.resultants(end, c), end[rod.STATE_SIZE :])
        return ca.Function("shape", [x, c, h], [every], {"cse": True})

    @cached_property
    def turning(self) -> ca.Function:
        """The same with the curvature per unpressurised length."""
        x, c, h = ca.SX.sym("x", PLACE + 1), ca.SX.sym("c", self.field.size1_in(1)), ca.SX.sym("h")
        every = self.shape(x, c, h)
        stretch = every[30]
        return ca.Function("turning", [x, c, h], [ca.vertcat(every[:21], every[21:24] * stretch, every[24:30])])

    @cached_property
    def transition(self) -> ca.Function:
        """As of `softnlp.statics.stability`; the stretch and the place are not moved by a pose."""
        return transition_function(self.field)

    @cached_property
    def _step(self) -> ca.Function:
        return rk_step(self.field, RK4)

    def unloaded(self, start: Array, c: Array, points: Array) -> Array:
        """Return the states (20, points) without loads from the one at the beginning, by RK4."""
        x, s = start, 0.0
        states = []
        for point in points:
            for _ in range(_SUBSTEPS if point > s else 0):
                x = np.asarray(self._step(x, c, (point - s) / _SUBSTEPS)).ravel()
            s = float(point)
            states.append(x)
        return np.array(states).T


def varying_rod(functions: RodFunctions) -> VaryingRod:
    """Compile the rod of a model with numbers that are linear in s."""
    size = functions.section.size1_in(0)
    a, b = ca.SX.sym("a", size), ca.SX.sym("b", size)
    part, F_0, x = ca.SX.sym("part"), ca.SX.sym("force_unit"), ca.SX.sym("x", PLACE + 1)
    column, stretch = ca.SX.sym("column", size), ca.SX.sym("stretch")
    constants, balance, units = functions.section(column, stretch)
    d = ca.vertcat(*(ca.vertcat(*centre) for centre in centres_of(constants, functions.model.chambers)))
    slope = -ca.jtimes(balance, column, b - a) / ca.jacobian(balance, stretch)
    moved = ca.jtimes(d, column, b - a) + ca.jacobian(d, stretch) * slope if d.numel() else d
    there = ca.Function("there", [column, stretch, a, b], [constants, units[1], slope, d, moved])
    c_here, F_here, slope, d, moved = there(a + x[PLACE] * (b - a), x[STRETCH], a, b)

    local = in_units(x[: rod.STATE_SIZE], 1, F_0, 1, F_here)
    rates = part * functions.field(local, c_here)
    whole = ca.vertcat(in_units(rates, 1, F_here, 1, F_0), slope, 1)
    v, u = functions.strains(local, c_here)
    L = part * x[STRETCH]
    chambers = [
        ca.norm_2(L * (v + ca.cross(u, ca.vertcat(d[k], d[k + 1], 0))) + ca.vertcat(moved[k], moved[k + 1], 0))
        for k in range(0, d.numel(), 2)
    ]
    along = ca.vertcat(*chambers, L * ca.norm_2(u[:2]), L * ca.norm_2(v))
    n, m = functions.resultants(local, c_here)
    wall = ca.vertcat(v, u, n * F_here / F_0, m * F_here / F_0)
    given, options = [x, ca.vertcat(a, b, part, F_0)], {"cse": True}
    return VaryingRod(
        ca.Function("field", given, [whole], options),
        ca.Function("lengths", given, [along], options),
        ca.Function("mean", given, [part * x[STRETCH]]),
        ca.Function("resultants", given, [wall], options),
    )


def in_units(state: Any, L_a: Any, F_a: Any, L_b: Any, F_b: Any) -> Any:
    """Return a scaled state, or its rates, in units of length and force b in place of a."""
    moment = F_a * L_a / (F_b * L_b)
    return ca.vertcat(state[:3] * L_a / L_b, state[3:12], state[12:15] * F_a / F_b, state[15:18] * moment)
