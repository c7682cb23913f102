"""The field of `benchmarks.paper_method` written with NumPy arrays, as the equations are printed.

Beside it, because the one in Python floats is an optimisation of its own: ten times faster, with every sum by hand.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.paper_method import Array, Rod


def numpy_field(rod: Rod, lengths: bool) -> Callable[[Array], Array]:
    """Return y' = f(y) as `benchmarks.paper_method.field` does, Eqs. (2), (5), (8), (13), (17)."""
    K_se, K_bt = np.array([rod.GA, rod.GA, rod.EA]), np.array([*rod.EI, rod.GJ])
    F_P, M_P, f_e, e3 = rod.F_P, rod.M_P, np.array(rod.weight), np.array([0.0, 0.0, 1.0])
    d = np.column_stack([rod.d, np.zeros(len(rod.d))])

    def derivative(y: Array) -> Array:
        R, n, m = y[3:12].reshape(3, 3), y[12:15], y[15:18]
        v = (R.T @ n - F_P * e3) / K_se + e3
        u = R.T @ m / K_bt
        p_s = R @ v
        R_s = R @ np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
        n_s = F_P * R_s[:, 2] - f_e
        m_s = -np.cross(p_s, n) + R @ (F_P * np.cross(v, e3) + np.cross(u, M_P))
        rates = np.linalg.norm(v + np.cross(u, d), axis=1) if lengths else np.zeros(0)
        return np.concatenate([p_s, R_s.ravel(), n_s, m_s, rates])

    return derivative
