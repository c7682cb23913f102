"""An independent witness of the statics: numpy and scipy only, none of the package's physics.

It is written from the paper's equations as printed, on purpose the slow and obvious way: an explicit sum over chambers,
the full state p, R, n, m with six unknowns at the base, an adaptive eighth-order integrator. Lengths in m, angles in
rad, pressures and stresses in Pa, forces in N, world frame with the base at the origin and +z the axis; inside the
integration arrays carry the component first, then the column of a batch.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from witness_section import BODIES, REPRODUCTION, Array, Choices, Section, published, section


class NoConvergence(ArithmeticError):
    """Newton and continuation did not reach the load."""


# rows of the state
_P, _R, _N, _M, _ANGLE, _ARC, _CHAMBERS = (
    slice(0, 3),
    slice(3, 12),
    slice(12, 15),
    slice(15, 18),
    18,
    19,
    slice(20, None),
)


def _cross(a: Sequence[Array], b: Sequence[Array]) -> Array:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _field(sec: Section, f_e: Array, y: Array, with_angle: bool) -> Array:
    """Eqs. (2), (5), (8), (13), (17) for a batch of states, (20 + N, K) -> the same."""
    R = y[_R].reshape(3, 3, -1)
    n_w, m_w = y[_N], y[_M]

    def turned(a: Array) -> Array:
        return np.einsum("ijk,jk->ik", R, a)

    n, m = (np.einsum("jik,jk->ik", R, w) for w in (n_w, m_w))  # R^T n, R^T m
    one = np.ones_like(n[0])
    zero = np.zeros_like(one)
    e1, e2, e3 = (one, zero, zero), (zero, one, zero), (zero, zero, one)
    v = np.array([n[0] / sec.GA, n[1] / sec.GA, (n[2] - sec.F_P) / sec.EA + 1])
    u = np.array([m[0] / sec.EI[0], m[1] / sec.EI[1], m[2] / sec.GJ])
    u_e3 = _cross(u, e3)

    p_s = turned(v)
    # column j of R hat(u) is R (u x e_j)
    R_s = np.stack([turned(_cross(u, e1)), turned(_cross(u, e2)), turned(u_e3)], axis=1)
    n_s = -f_e[:, None] + sec.F_P * turned(u_e3)
    chamber_moment = np.zeros_like(u)
    lengths = []
    for PA_i, (d_x, d_y) in zip(sec.PA, sec.d, strict=True):
        d_i = (d_x * one, d_y * one, zero)
        q = v + _cross(u, d_i)
        lengths.append(np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2))
        if PA_i != 0:
            chamber_moment += PA_i * (_cross(q, e3) + _cross(d_i, u_e3))
    m_s = -_cross(p_s, n_w) + turned(chamber_moment)
    # the angle has a corner where the curvature passes zero, which would cost every other integration many steps
    angle_s = np.sqrt(u[0] ** 2 + u[1] ** 2) if with_angle else zero
    arc_s = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    return np.vstack([p_s, R_s.reshape(9, -1), n_s, m_s, angle_s, arc_s, *lengths])


@dataclass(frozen=True)
class Scaled:
    """A section made dimensionless by L, EI/L^2 and EI/L, with the dead loads on it."""

    sec: Section
    length: float
    force: float
    moment: float
    f_e: Array
    F_e: Array
    M_e: Array


def scaled(
    sec: Section,
    tip_force: Sequence[float] | Array = (0, 0, 0),
    tip_moment: Sequence[float] | Array = (0, 0, 0),
    gravity: Sequence[float] | Array = (0, 0, 0),
    density: float = 1070.0,
) -> Scaled:
    """Return the dimensionless problem; `gravity` is an acceleration vector [m/s^2]."""
    EI = (sec.EI[0] + sec.EI[1]) / 2
    length, force, moment = sec.L, EI / sec.L**2, EI / sec.L
    small = replace(
        sec,
        L=1.0,
        EA=sec.EA / force,
        GA=sec.GA / force,
        EI=(sec.EI[0] / EI, sec.EI[1] / EI),
        GJ=sec.GJ / EI,
        PA=sec.PA / force,
        d=sec.d / length,
    )
    f_e = density * sec.A * np.asarray(gravity, float) * length / force
    return Scaled(
        small, length, force, moment, f_e, np.asarray(tip_force, float) / force, np.asarray(tip_moment, float) / moment
    )


def integrate(
    problem: Scaled,
    start: Array,
    load: float = 1.0,
    *,
    rtol: float = 1e-12,
    at: Array | None = None,
    backward_from: Array | None = None,
    with_angle: bool = False,
) -> Array:
    """Integrate from the base with columns of (n(0), m(0)), (6, K).

    Returns the tip states (20 + N, K), or with `at` (M,) all of them, (20 + N, K, M). `backward_from` (20 + N, K) are
    states at the tip to integrate from instead. The row of the bending angle is filled with `with_angle` only.
    """
    N = len(problem.sec.PA)
    if backward_from is None:
        K = start.shape[1]
        y0 = np.zeros((20 + N, K))
        y0[_R] = np.eye(3).reshape(9, 1)
        y0[12:18] = start
        span = (0.0, 1.0)
    else:
        y0, span = backward_from, (1.0, 0.0)
        K = y0.shape[1]
    f_e = load * problem.f_e
    # the size of the state varies over its rows: forces may be 100 EI/L^2 while lengths are 1
    atol = np.repeat(1e-13 * (rtol / 1e-12) * np.maximum(1.0, np.abs(y0).max(axis=1)), K)
    out = solve_ivp(
        lambda s, y: _field(problem.sec, f_e, y.reshape(-1, K), with_angle).ravel(),
        span,
        y0.ravel(),
        method="DOP853",
        rtol=rtol,
        atol=atol,
        t_eval=at,
    )
    if not out.success:
        raise NoConvergence(out.message)
    y = out.y.reshape(20 + N, K, -1)
    return y if at is not None else y[:, :, -1]


def tip_imbalance(problem: Scaled, tip: Array, load: float = 1.0, reaction: Array | None = None) -> Array:
    """Eq. (9) as residuals (6, K); `reaction` adds T_i to P_i A_c there."""
    R = tip[_R].reshape(3, 3, -1)
    pull = problem.sec.PA[:, None] if reaction is None else problem.sec.PA[:, None] + reaction
    e3 = R[:, 2]
    e_n = tip[_N] - load * problem.F_e[:, None] - e3 * pull.sum(axis=0)
    # d x e3 = (d_y, -d_x, 0)
    M = np.array([(problem.sec.d[:, 1:] * pull).sum(axis=0), -(problem.sec.d[:, :1] * pull).sum(axis=0)])
    e_m = tip[_M] - load * problem.M_e[:, None] - np.einsum("ijk,jk->ik", R[:, :2], M + np.zeros(R.shape[2]))
    return np.vstack([e_n, e_m])


def newton(
    residual: Callable[[Array, float], Array],
    x: Array,
    *,
    tolerance: float,
    rtol: float,
    most: int = 12,
) -> tuple[Array, Array]:
    """Newton on residual(columns, rtol) with a difference Jacobian evaluated as one batch; return x and the Jacobian.

    Full steps only and they must shrink: a start too far away is the caller's to bring nearer.
    """
    k = len(x)
    step_before = np.inf
    for _ in range(most):
        h = 1e-6 * np.maximum(1.0, np.abs(x))
        columns = np.concatenate([x[:, None], x[:, None] + np.diag(h), x[:, None] - np.diag(h)], axis=1)
        try:
            r = residual(columns, rtol)
        except (FloatingPointError, OverflowError) as error:
            raise NoConvergence(str(error)) from error
        J = (r[:, 1 : k + 1] - r[:, k + 1 :]) / (2 * h)
        if not np.isfinite(r).all():
            raise NoConvergence("not finite")
        if np.abs(r[:, 0]).max() < tolerance:
            return x, J
        dx = np.linalg.solve(J, -r[:, 0])
        size = np.abs(dx / np.maximum(1.0, np.abs(x))).max()
        if size > 2 * step_before and size > 1e-6:
            raise NoConvergence("steps grow")
        x, step_before = x + dx, size
    raise NoConvergence(f"residual {np.abs(r[:, 0]).max():.2e}")


@dataclass(frozen=True)
class Witnessed:
    """A solved pose in SI units. s : (M,) from 0 to L; p, n, m : (M, 3); R : (M, 3, 3); u, v : (M, 3) body frame.

    conjugate_points counts them over the rod (0: a minimum of the energy). residual is dimensionless.
    """

    section: Section
    stretch: float
    tip_position: Array
    tip_rotation: Array
    chamber_lengths: Array
    bending_angle: float
    tilt: float
    backbone_length: float
    residual: float
    determinant: float
    conjugate_points: int
    s: Array
    p: Array
    R: Array
    n: Array
    m: Array
    u: Array
    v: Array
    base: Array


def arc_start(problem: Scaled) -> Array:
    """Return n(0), m(0) of the unloaded circular arc."""
    return np.concatenate([[0.0, 0.0, problem.sec.F_P], problem.sec.M_P])


def solve_base(
    problem: Scaled, *, steps: int = 4, tolerance: float = 1e-10, start: Array | None = None
) -> tuple[Array, Array]:
    """Return n(0), m(0) (6,) and the 6x6 Jacobian of the tip imbalance, following the loads from zero.

    Raises
    ------
    NoConvergence
        The path could not be followed with steps of 1/512 of the load.
    """
    loaded = bool(np.any(problem.f_e) or np.any(problem.F_e) or np.any(problem.M_e))

    def residual_at(load: float) -> Callable[[Array, float], Array]:
        return lambda x, rtol: tip_imbalance(problem, integrate(problem, x, load, rtol=rtol), load)

    x = arc_start(problem) if start is None else start
    if loaded and start is None:
        done, step, x_before, done_before = 0.0, 1 / steps, x, 0.0
        while done < 1:
            load = min(1.0, done + step)
            guess = x + (x - x_before) * ((load - done) / (done - done_before) if done > done_before else 0.0)
            try:
                found, _ = newton(residual_at(load), guess, tolerance=1e-5, rtol=1e-7, most=6)
            except (NoConvergence, np.linalg.LinAlgError):
                step /= 2
                if step < 1 / 512:
                    raise NoConvergence(f"stuck at {done:.4f} of the load") from None
                continue
            x_before, done_before, x, done = x, done, found, load
            step *= 1.5
    return newton(residual_at(1.0), x, tolerance=tolerance, rtol=1e-12)


def shoot(
    sec: Section,
    tip_force: Sequence[float] | Array = (0, 0, 0),
    tip_moment: Sequence[float] | Array = (0, 0, 0),
    gravity: Sequence[float] | Array = (0, 0, 0),
    density: float = 1070.0,
    *,
    steps: int = 4,
    points: int = 41,
    tolerance: float = 1e-10,
    start: Array | None = None,
) -> Witnessed:
    """Solve the boundary value problem by single shooting, following the loads from zero in at least `steps` steps.

    `gravity` is an acceleration [m/s^2]; `start` (dimensionless n(0), m(0), as in `base`) skips the path. Raises as
    `solve_base`.
    """
    problem = scaled(sec, tip_force, tip_moment, gravity, density)
    x, J = solve_base(problem, steps=steps, tolerance=tolerance, start=start)
    at = np.linspace(0, 1, points)
    y = integrate(problem, x[:, None], at=at, with_angle=True)[:, 0, :]
    tip = y[:, -1:]
    R = np.moveaxis(y[_R].reshape(3, 3, -1), -1, 0)
    n, m = y[_N].T * problem.force, y[_M].T * problem.moment
    n_b, m_b = (np.einsum("sji,sj->si", R, w) for w in (n, m))
    return Witnessed(
        section=sec,
        stretch=sec.stretch,
        tip_position=tip[_P, 0] * sec.L,
        tip_rotation=R[-1],
        chamber_lengths=tip[_CHAMBERS, 0] * sec.L,
        bending_angle=float(tip[_ANGLE, 0]),
        tilt=float(np.arctan2(np.hypot(R[-1][0, 2], R[-1][1, 2]), R[-1][2, 2])),
        backbone_length=float(tip[_ARC, 0]) * sec.L,
        residual=float(np.abs(tip_imbalance(problem, tip)).max()),
        determinant=float(np.linalg.det(J)),
        conjugate_points=_conjugate_points(problem, tip),
        s=at * sec.L,
        p=y[_P].T * sec.L,
        R=R,
        n=n,
        m=m,
        u=m_b / np.array([*sec.EI, sec.GJ]),
        v=(n_b - [0, 0, sec.F_P]) / np.array([sec.GA, sec.GA, sec.EA]) + [0, 0, 1],
        base=x,
    )


def _conjugate_points(problem: Scaled, tip: Array, points: int = 201) -> int:
    """Count the points s where a rod clamped at s and loaded as this one beyond it has a neighbouring equilibrium.

    The tip is turned by small rotations with its balance (Eq. (9)) kept, and the field is integrated towards the base.
    With X = turning of the section, Y = change of m - R M_P there, the eigenvalues of Y X^-1 pass through infinity
    where X is singular, which shows also when two eigenvalues do so at once (a round column under its weight).
    """
    eps = 1e-5
    R_L = tip[_R, 0].reshape(3, 3)
    columns = []
    for sign in (1, -1):
        for e in np.eye(3):
            a = sign * eps
            K = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            R = (np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K) @ R_L
            y = tip[:, 0].copy()
            y[_R] = R.ravel()
            y[_N] = problem.F_e + problem.sec.F_P * R[:, 2]
            y[_M] = problem.M_e + R @ problem.sec.M_P
            columns.append(y)
    at = np.linspace(1, 0, points)
    y = integrate(problem, np.empty((6, 0)), rtol=1e-10, at=at, backward_from=np.array(columns).T)
    R = y[_R].reshape(3, 3, 6, -1)
    free = y[_M] - np.einsum("ijks,j->iks", R, problem.sec.M_P)
    total = np.empty(points)
    for k in range(points):
        X, Y = np.empty((3, 3)), np.empty((3, 3))
        for j in range(3):
            turn = R[:, :, j, k] @ R[:, :, j + 3, k].T
            X[:, j] = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * eps)
            Y[:, j] = (free[:, j, k] - free[:, j + 3, k]) / (2 * eps)
        S = Y @ np.linalg.pinv(X, rcond=1e-14)
        total[k] = np.arctan(np.linalg.eigvalsh((S + S.T) / 2)).sum()
    return int(np.abs(np.round(np.diff(total) / np.pi)).sum())


def solve(
    robot: str,
    silicone: str,
    pressures_bar: Sequence[float],
    *,
    law: str = "mooney-rivlin",
    choices: Choices = REPRODUCTION,
    **loads: Sequence[float],
) -> Witnessed:
    """Return a published robot in a published silicone; loads as in `shoot`."""
    sec = section(BODIES[robot], published(silicone, law), 1e5 * np.asarray(pressures_bar, float), choices)
    return shoot(sec, **loads)


def arc(sec: Section) -> Mapping[str, Array | float]:
    """Return tip position, rotation, chamber lengths and angle of the unloaded circular arc in closed form (v = e3)."""
    u = sec.M_P / np.array([*sec.EI, sec.GJ])
    kappa = float(np.linalg.norm(u))
    t = kappa * sec.L
    K = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    if kappa == 0:
        R, V = np.eye(3), np.eye(3)
    else:
        K = K / kappa
        R = np.eye(3) + np.sin(t) * K + (1 - np.cos(t)) * K @ K
        V = np.eye(3) + (1 - np.cos(t)) / t * K + (1 - np.sin(t) / t) * K @ K
    lengths = sec.L * (1 + u[0] * sec.d[:, 1] - u[1] * sec.d[:, 0])  # |e3 + u x d| with u_z = 0
    return {"tip_position": sec.L * V[:, 2], "tip_rotation": R, "chamber_lengths": np.abs(lengths), "bending_angle": t}
