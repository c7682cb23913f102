"""The paper's blocked tip force: weighted least squares over n(0), m(0), F_b by Levenberg-Marquardt.

Eight equations for seven unknowns, or five for the four in the plane y = 0. The free shape at the same pressure is
shot first for the free chamber lengths (Eq. (14)), then the blocked one. The answer is a compromise that depends on the
weights, so every residual is returned. In space the squares have lower minima out of the plane once the planar shape
can slide sideways along the wall; `planar` keeps to the plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from benchmarks.paper_method import Array, Rod, Tip, integrate, solve_pose, tip_errors


@dataclass(frozen=True)
class Weights:
    """W_n [1/N], W_m [1/(N m)], W_L [1/m], W_h [1/m]."""

    n: float = 1.0
    m: float = 1.0
    L: float = 1.0
    h: float = 1e3


@dataclass(frozen=True, eq=False)
class BlockedAnswer:
    """The wall's force along +x [N], base (6,), errors e_n (3,) [N], e_m (3,) [N m], e_L, e_h [m] and counts.

    converged : whether MINPACK met a tolerance within its number of evaluations.
    evaluations counts the integrations of the blocked shape, its Jacobians included; free_evaluations the free shape's.
    """

    force: float
    base: Array
    tip: Tip
    e_n: Array
    e_m: Array
    e_L: float
    e_h: float
    converged: bool
    evaluations: int
    free_evaluations: int


def solve_blocked(
    rod: Rod,
    weights: Weights = Weights(),
    *,
    offset: float = 0.0,
    tip_cap: float = 0.0,
    tip_force: Sequence[float] = (0.0, 0.0, 0.0),
    tip_moment: Sequence[float] = (0.0, 0.0, 0.0),
    start: Array | None = None,
    free_start: str | Array = "arc",
    planar: bool = False,
    steps: int = 20,
    tolerance: float = 1e-10,
) -> BlockedAnswer:
    """Solve one blocked pose with the wall at x = offset [m]; `start` (7,) is n(0), m(0), F_b of the previous step.

    Cold, it starts from the free shape's base and no force. `planar` drops n_y, m_x, m_z and their equations.
    """
    free = solve_pose(rod, tip_force, tip_moment, start=free_start, steps=steps, tolerance=tolerance)
    pressed = rod.PA > 0
    scale = np.append(rod.scale, rod.scale[0])
    stack = np.array([weights.n] * 3 + [weights.m] * 3 + [weights.L, weights.h])
    force, moment = np.asarray(tip_force, float), np.asarray(tip_moment, float)

    kept = [0, 2, 4, 6] if planar else list(range(7))
    equations = [0, 2, 4, 6, 7] if planar else list(range(8))
    evaluations = 0

    def errors(unknowns: Array) -> tuple[Array, Tip]:
        tip = integrate(rod, unknowns[:6], steps, lengths=True)
        push = np.array([unknowns[6], 0.0, 0.0])
        e3 = tip.R[:, 2]
        # L_t e3 x F_b
        lever = tip_cap * unknowns[6] * np.array([0.0, e3[2], -e3[1]])
        e_L = (free.tip.lengths - tip.lengths)[pressed].sum()
        e_h = tip.p[0] + tip_cap * e3[0] - offset
        return np.concatenate([tip_errors(rod, tip, force + push, moment + lever), [e_L, e_h]]), tip

    x = np.append(free.base, 0.0) if start is None else start

    def spread(x: Array) -> Array:
        unknowns = np.zeros(7)
        unknowns[kept] = x * scale[kept]
        return unknowns

    def residual(x: Array) -> Array:
        nonlocal evaluations
        evaluations += 1
        return (stack * errors(spread(x))[0])[equations]

    found = least_squares(residual, (x / scale)[kept], method="lm", ftol=tolerance, xtol=tolerance, gtol=tolerance)
    unknowns = spread(found.x)
    e, tip = errors(unknowns)
    return BlockedAnswer(
        force=float(unknowns[6]),
        base=unknowns[:6],
        tip=tip,
        e_n=e[:3],
        e_m=e[3:6],
        e_L=float(e[6]),
        e_h=float(e[7]),
        converged=found.status > 0,
        evaluations=evaluations,
        free_evaluations=free.evaluations,
    )
