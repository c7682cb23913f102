"""The linear algebra of one load case by collocation, with its stages and interior nodes eliminated.

In an interval from x_k to x_k+1 with the stages z, and with the stretch's change d(lambda) known,

    stages   A dz + B dx_k + a d(lambda) = -g_z        so dz = -A^-1 (B dx_k + a d(lambda) + g_z)
    gap      dx_k+1 = D dx_k + E dz + b d(lambda) + g_k

which leaves for each interval what multiple shooting has, see `softnlp.statics.condensed`: a map of a change of its
first node and what it adds. A sparse factorisation gives the same numbers in ten times the time.
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.evaluation import evaluated
from softnlp.nlp.transcription import Collocation, Transcription, interval_slopes
from softnlp.statics.condensed import LARGEST, chained, end_pieces
from softnlp.statics.loadcase import RodFunctions

Array = NDArray[np.float64]


class CondensedCollocation:
    """Solves J dx = -g for a load case with every quantity fixed, transcribed by collocation.

    The fixed values p are those of `functions.declared()`, in order.
    """

    def __init__(self, functions: RodFunctions, method: Collocation) -> None:
        self._functions, self._method = functions, method
        self._entries, rows, columns = _interval_entries(functions.field, method.with_intervals(1))
        self._places = rows, columns
        self._mapped = self._entries.map(method.intervals)

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx. Raises `numpy.linalg.LinAlgError` where an interval or the tip is singular or not finite."""
        return self.solve_many(x, p, np.asarray(g, float)[:, None])[:, 0]

    def solve_many(self, x: Array, p: Array, G: Array) -> Array:
        """Return the columns dx for as many right sides G (n, r). Raises as `solve`."""
        functions, K, nx = self._functions, self._method.intervals, self._functions.state_size
        r, rows, count = G.shape[1], 6 + functions.tip_unknowns, 1 + K * (self._method.degree + 1)
        ends = end_pieces(functions, 6 + r, r)
        c, slope, balance_slope, scales = evaluated(ends.section, p[: ends.section.size1_in(0)], x[:1])
        states, inner = x[1 : 1 + nx * count], G[1 + nx - 6 : -rows].reshape(K, -1, r)
        with np.errstate(all="ignore"):
            d_stretch = -G[:1] / balance_slope
            own, moved = self._intervals(states, c, slope)
            m = own.shape[1] - nx  # of the stages
            known = moved * d_stretch + inner
            by_node, added = np.split(
                np.linalg.solve(own[:, :m, nx:], np.dstack([own[:, :m, :nx], known[:, :m]])), [nx], 2
            )
            maps = own[:, m:, :nx] - own[:, m:, nx:] @ by_node
            every = chained(np.eye(6), G[1 : 1 + nx - 6], maps, known[:, m:] - own[:, m:, nx:] @ added)
            last, y = states[-nx:], x[1 + nx * count :]
            (tip,) = evaluated(ends.tip, every[K], last, c, slope @ d_stretch, y, functions.tip_numbers(p), scales)
            if not np.max(np.abs(tip)) < LARGEST:  # nan is not either
                raise np.linalg.LinAlgError("the linearised tip equations are not finite")
            found = np.linalg.solve(np.delete(tip, np.s_[6 : 6 + r], axis=1), -(tip[:, 6 : 6 + r] + G[-rows:]))
            nodes = every[:, :, :6] @ found[:6] + every[:, :, 6:]
            stages = -(by_node @ nodes[:-1] + added)
        moves = np.concatenate([stages, nodes[1:]], axis=1).reshape(-1, r)  # of an interval, and of the node behind it
        return np.concatenate([d_stretch, nodes[0], moves, found[6:]])

    def _intervals(self, states: Array, c: Array, slope: Array) -> tuple[Array, Array]:
        """Return the Jacobian of each interval by its first node and stages (K, m, m), and its change (K, m, 1)."""
        K, (rows, columns) = self._method.intervals, self._places
        m, nx = self._entries.size1_out(1), self._functions.state_size
        windows = states[np.arange(m + nx)[:, None] + m * np.arange(K)]
        every = (np.broadcast_to(part, (part.shape[0], K)) for part in (c, np.full((1, 1), 1 / K), slope))
        entries, moved = evaluated(self._mapped, windows, *every)
        own = np.zeros((K, m, m))
        own[:, rows, columns] = entries.T
        return own, moved.T[:, :, None]


@lru_cache(maxsize=16)
def _interval_entries(field: ca.Function, method: Transcription) -> tuple[ca.Function, list[int], list[int]]:
    """Return the entries of `interval_slopes` but those of the last node as a column, and their rows and columns."""
    slopes = interval_slopes(field, method)
    given = [ca.SX.sym(name, slopes.size1_in(k)) for k, name in enumerate(("w", "c", "h", "dc"))]
    own, _, moved = slopes(*given)
    rows, columns = own.sparsity().get_triplet()
    return (
        ca.Function("entries", given, [ca.densify(own.nz[:]), moved]),
        rows,
        columns,
    )
