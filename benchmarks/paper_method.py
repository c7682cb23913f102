"""The paper's numerical method, to be timed beside the package: single shooting, RK4, Levenberg-Marquardt in NumPy.

The unknowns are n(0) and m(0), the equations are Eqs. (2), (5), (8), (9), (13), (17) in the full state p, R, n, m, and
the Jacobian is MINPACK's own forward difference (`least_squares(method="lm")`): seven integrations an iteration.
Unknowns and residuals are scaled by EI/L^2 and EI/L. The field is written in Python floats, which for eighteen numbers
is several times faster than NumPy's small-array calls; NumPy holds the state between the stages.

A solve starts cold from `zeros` or from `arc` (the closed form of the unloaded shape), or warm from the previous n(0),
m(0). The stiffnesses come as plain numbers, so that a benchmark gives both methods the same rod.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rod:
    """A pressurised rod as numbers, SI.

    length : deformed length L [m]. EA, GA [N]. EI : about x and y, GJ [N m^2]. PA : (N,) P_i A_c [N].
    d : (N, 2) deformed chamber centres [m]. weight : (3,) f_e = rho A g, world frame [N/m].
    """

    length: float
    EA: float
    GA: float
    EI: tuple[float, float]
    GJ: float
    PA: Array
    d: Array
    weight: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def F_P(self) -> float:
        """Sum of P_i A_c [N]."""
        return float(np.sum(self.PA))

    @property
    def M_P(self) -> Array:
        """Sum of d_i x P_i A_c e3, body frame [N m]."""
        return np.array([self.PA @ self.d[:, 1], -self.PA @ self.d[:, 0], 0.0])

    @property
    def scale(self) -> Array:
        """(6,) EI/L^2 for n and EI/L for m."""
        EI = sum(self.EI) / 2
        return np.array([EI / self.length**2] * 3 + [EI / self.length] * 3)


@dataclass(frozen=True, eq=False)
class Tip:
    """The state where the shooting ends: p, n, m (3,), R (3, 3), chamber lengths (N,) when they were asked for."""

    p: Array
    R: Array
    n: Array
    m: Array
    lengths: Array


@dataclass(frozen=True, eq=False)
class Answer:
    """A pose: base (6,) is n(0), m(0) [N, N m], residual the largest scaled error.

    evaluations counts the integrations of the solve, those of its Jacobians included.
    """

    base: Array
    tip: Tip
    residual: float
    evaluations: int


def field(rod: Rod, lengths: bool) -> Callable[[Array], Array]:
    """Return y' = f(y) for y = p (3), R (9, by rows), n (3), m (3) and, with `lengths`, L_i (N)."""
    EA, GA, GJ, (EI_x, EI_y) = rod.EA, rod.GA, rod.GJ, rod.EI
    F_P, (M_x, M_y, _) = rod.F_P, rod.M_P.tolist()
    fx, fy, fz = rod.weight
    centres = rod.d.tolist() if lengths else []

    def derivative(y: Array) -> Array:
        state = y.tolist()
        _, _, _, a, b, c, d, e, f, g, h, i, n1, n2, n3, m1, m2, m3 = state[:18]
        vx = (a * n1 + d * n2 + g * n3) / GA
        vy = (b * n1 + e * n2 + h * n3) / GA
        vz = (c * n1 + f * n2 + i * n3 - F_P) / EA + 1
        ux = (a * m1 + d * m2 + g * m3) / EI_x
        uy = (b * m1 + e * m2 + h * m3) / EI_y
        uz = (c * m1 + f * m2 + i * m3) / GJ
        px = a * vx + b * vy + c * vz
        py = d * vx + e * vy + f * vz
        pz = g * vx + h * vy + i * vz
        # columns of R hat(u): R (u x e1), R (u x e2), R (u x e3)
        c1, c2, c3 = a * uy - b * ux, d * uy - e * ux, g * uy - h * ux
        # sum of P_i A_c [(v + u x d_i) x e3 + d_i x (u x e3)] = F_P v x e3 + u x sum d_i x P_i A_c e3
        qx = F_P * vy - uz * M_y
        qy = -F_P * vx + uz * M_x
        qz = ux * M_y - uy * M_x
        out = [
            px,
            py,
            pz,
            b * uz - c * uy,
            c * ux - a * uz,
            c1,
            e * uz - f * uy,
            f * ux - d * uz,
            c2,
            h * uz - i * uy,
            i * ux - g * uz,
            c3,
            F_P * c1 - fx,
            F_P * c2 - fy,
            F_P * c3 - fz,
            n2 * pz - n3 * py + a * qx + b * qy + c * qz,
            n3 * px - n1 * pz + d * qx + e * qy + f * qz,
            n1 * py - n2 * px + g * qx + h * qy + i * qz,
        ]
        for x, z in centres:
            lx, ly, lz = vx - uz * z, vy + uz * x, vz + ux * z - uy * x
            out.append((lx * lx + ly * ly + lz * lz) ** 0.5)
        return np.array(out)

    return derivative


def integrate(rod: Rod, base: Array, steps: int = 20, lengths: bool = False) -> Tip:
    """Integrate from the base with n(0), m(0) = base (6,) by `steps` steps of RK4."""
    f = field(rod, lengths)
    y = np.zeros(18 + (len(rod.PA) if lengths else 0))
    y[3] = y[7] = y[11] = 1.0
    y[12:18] = base
    h = rod.length / steps
    for _ in range(steps):
        k1 = f(y)
        k2 = f(y + (0.5 * h) * k1)
        k3 = f(y + (0.5 * h) * k2)
        k4 = f(y + h * k3)
        y = y + (h / 6) * (k1 + 2 * (k2 + k3) + k4)
    return Tip(y[:3], y[3:12].reshape(3, 3), y[12:15], y[15:18], y[18:])


def tip_errors(rod: Rod, tip: Tip, tip_force: Array, tip_moment: Array) -> Array:
    """Eq. (9) (6,) [N, N m]."""
    return np.concatenate([tip.n - tip_force - rod.F_P * tip.R[:, 2], tip.m - tip_moment - tip.R @ rod.M_P])


def arc_base(rod: Rod) -> Array:
    """n(0), m(0) (6,) of the unloaded circular arc."""
    return np.concatenate([[0.0, 0.0, rod.F_P], rod.M_P])


def solve_pose(
    rod: Rod,
    tip_force: Sequence[float] = (0.0, 0.0, 0.0),
    tip_moment: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    start: str | Array = "zeros",
    steps: int = 20,
    tolerance: float = 1e-10,
) -> Answer:
    """Solve one pose; `start` is "zeros", "arc" or the base (6,) of an earlier answer [N, N m].

    `tolerance` is MINPACK's on the sum of squares, the step and the gradient. The caller judges `residual`: a minimum
    of the squares that is not a solution is returned as found.
    """
    force, moment, scale = np.asarray(tip_force, float), np.asarray(tip_moment, float), rod.scale
    cold = {"zeros": np.zeros(6), "arc": arc_base(rod)}
    first = cold[start] if isinstance(start, str) else start
    evaluations = 0

    def residual(x: Array) -> Array:
        nonlocal evaluations
        evaluations += 1  # nfev leaves out those of the Jacobian
        return tip_errors(rod, integrate(rod, x * scale, steps), force, moment) / scale

    found = least_squares(residual, first / scale, method="lm", ftol=tolerance, xtol=tolerance, gtol=tolerance)
    base = found.x * scale
    return Answer(base, integrate(rod, base, steps, lengths=True), float(np.abs(found.fun).max()), evaluations)
