"""The same rod by `scipy.integrate.solve_bvp`: a public collocation solver with an adaptive mesh.

The state is p, R, n, m with 12 conditions at the base and 6 at the tip, made dimensionless by L, EI/L^2 and EI/L. The
field is vectorised over the mesh, as the solver wants it; its Jacobian is the solver's own forward difference, as a
user who writes down the equations has it. The first guess is the unloaded circular arc on 11 nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation

from benchmarks.paper_method import Array, Rod

_GUESS_NODES = 11
_MOST_NODES = 20_000


def solve_pose(
    rod: Rod,
    tip_force: Sequence[float] = (0.0, 0.0, 0.0),
    tip_moment: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    tolerance: float,
) -> Array:
    """Return the tip position (3,) [m]; `tolerance` is scipy's on the relative residual.

    Raises
    ------
    RuntimeError
        Where the solver says that it did not converge.
    """
    small, force, moment = _scaled(rod, tip_force, tip_moment)
    s = np.linspace(0.0, 1.0, _GUESS_NODES)
    found = solve_bvp(
        lambda s, y: field(small, y),
        lambda base, tip: conditions(small, base, tip, force, moment),
        s,
        arc(small, s),
        tol=tolerance,
        bc_tol=1e-10,
        max_nodes=_MOST_NODES,
    )
    if not found.success:
        raise RuntimeError(found.message)
    return np.asarray(found.y[:3, -1] * rod.length)


def _scaled(rod: Rod, tip_force: Sequence[float], tip_moment: Sequence[float]) -> tuple[Rod, Array, Array]:
    force, moment = float(rod.scale[0]), float(rod.scale[3])
    EI = moment * rod.length
    small = replace(
        rod,
        length=1.0,
        EA=rod.EA / force,
        GA=rod.GA / force,
        EI=(rod.EI[0] / EI, rod.EI[1] / EI),
        GJ=rod.GJ / EI,
        PA=rod.PA / force,
        d=rod.d / rod.length,
        weight=tuple(w * rod.length / force for w in rod.weight),  # type: ignore[arg-type]
    )
    return small, np.asarray(tip_force, float) / force, np.asarray(tip_moment, float) / moment


def field(rod: Rod, y: Array) -> Array:
    """Return dy/ds of a rod of length 1 for columns of p, R (by rows), n, m: Eqs. (2), (5), (8), (13)."""
    R, n, m = y[3:12].reshape(3, 3, -1), y[12:15], y[15:18]
    v = np.einsum("jik,jk->ik", R, n)
    v[2] -= rod.F_P
    v /= np.array([rod.GA, rod.GA, rod.EA])[:, None]
    v[2] += 1.0
    u = np.einsum("jik,jk->ik", R, m) / np.array([*rod.EI, rod.GJ])[:, None]
    p_s = np.einsum("ijk,jk->ik", R, v)
    # the columns of R hat(u)
    R_s = np.stack([R[:, 1] * u[2] - R[:, 2] * u[1], R[:, 2] * u[0] - R[:, 0] * u[2], R[:, 0] * u[1] - R[:, 1] * u[0]])
    n_s = rod.F_P * R_s[2] - np.array(rod.weight)[:, None]
    M_x, M_y, _ = rod.M_P
    q = np.stack([rod.F_P * v[1] - u[2] * M_y, -rod.F_P * v[0] + u[2] * M_x, u[0] * M_y - u[1] * M_x])
    m_s = -np.cross(p_s, n, axis=0) + np.einsum("ijk,jk->ik", R, q)
    return np.concatenate([p_s, R_s.transpose(1, 0, 2).reshape(9, -1), n_s, m_s])


def conditions(rod: Rod, base: Array, tip: Array, force: Array, moment: Array) -> Array:
    """Return the clamped base (12) and Eq. (9) at the tip (6)."""
    R = tip[3:12].reshape(3, 3)
    held = base[:12] - np.concatenate([np.zeros(3), np.eye(3).ravel()])
    return np.concatenate([held, tip[12:15] - force - rod.F_P * R[:, 2], tip[15:18] - moment - R @ rod.M_P])


def arc(rod: Rod, s: Array) -> Array:
    """Return the unloaded arc of a rod of length 1 at s, (18, nodes)."""
    u = rod.M_P / np.array([*rod.EI, rod.GJ])
    turned = Rotation.from_rotvec(s[:, None] * u).as_matrix()
    fine = np.linspace(0.0, 1.0, 20 * (len(s) - 1) + 1)
    axis = Rotation.from_rotvec(fine[:, None] * u).as_matrix()[:, :, 2]
    steps = 0.5 * (axis[1:] + axis[:-1]) * np.diff(fine)[:, None]
    p = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])[::20]
    return np.vstack([p.T, turned.reshape(-1, 9).T, rod.F_P * turned[:, :, 2].T, (turned @ rod.M_P).T])
