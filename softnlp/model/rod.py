"""The Cosserat rod: Eqs. (2), (5), (8), (13), (17) as a field along s, and its tip balance, Eq. (9).

The state is x = [p (3), R (9, column by column), N (3), M (3)]: position, rotation (columns are the body axes), and the
force and moment that wall and fluid carry together, all in the world frame. Of the paper's n and m, which the wall
alone carries, these are N = n - F_P R e3 and M = m - R sum d_i x P_i A_c e3: pressure leaves every balance and stays in
the material law alone. Pure functions of numbers or symbols in any consistent system of units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from softnlp.model.gravity import gravity_named
from softnlp.model.section import RodSection

Vector = tuple[float, float, float]

STATE_BLOCKS = {"position": slice(0, 3), "rotation": slice(3, 12), "force": slice(12, 15), "moment": slice(15, 18)}
STATE_SIZE = 18


@dataclass(frozen=True, eq=False)
class Loads:
    """Dead loads in the world frame.

    Attributes
    ----------
    tip_force
        (3,) F_e [N].
    tip_moment
        (3,) M_e [N m].
    gravity
        (3,) acceleration g [m/s^2]; zeros switch it off. One of the words of a scenario, "standing" or "hanging" for
        instance, becomes that of the earth. Raises `InputError` for another word.
    """

    tip_force: Any = (0.0, 0.0, 0.0)
    tip_moment: Any = (0.0, 0.0, 0.0)
    gravity: Any = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Take a word for gravity."""
        if isinstance(self.gravity, str):
            object.__setattr__(self, "gravity", gravity_named(self.gravity))

    @property
    def act(self) -> bool:
        """Whether any of them is not zero."""
        return any(bool(value) for load in (self.tip_force, self.tip_moment, self.gravity) for value in load)


def hat(a: Any) -> Any:
    """Return the 3x3 matrix with hat(a) b = a x b."""
    return ca.vertcat(
        ca.horzcat(0, -a[2], a[1]),
        ca.horzcat(a[2], 0, -a[0]),
        ca.horzcat(-a[1], a[0], 0),
    )


def unpack(x: Any) -> tuple[Any, Any, Any, Any]:
    """Split a state into p, R (3x3), N, M."""
    return x[0:3], ca.reshape(x[3:12], 3, 3), x[12:15], x[15:18]


def in_body(x: Any) -> tuple[Any, Any]:
    """Return R^T N and R^T M."""
    _, R, N, M = unpack(x)
    return R.T @ N, R.T @ M


def wall_resultants(x: Any, section: RodSection) -> tuple[Any, Any]:
    """Return the paper's n and m, force and moment of the wall alone, world frame."""
    _, R, N, M = unpack(x)
    M_P = ca.vertcat(section.pressure_moment_x, section.pressure_moment_y, 0)
    return N + section.pressure_force * R[:, 2], M + R @ M_P


def field(x: Any, v: Any, u: Any, force: Any, moment: Any) -> Any:
    """Return dx/ds, Eqs. (2), (8), (13), for the stretched arc length s in 0..L.

    v, u : the strains of the section there. force, moment : f_e and l_e of all loads, (3,) per length, world frame.
    The pressure term of the paper's moment balance, sum P_i A_c [(v + u x d_i) x e3 + d_i x (u x e3)], is by the Jacobi
    identity F_P v x e3 + u x M_P, which is what N and M take out of n and m: N' = -f_e, M' = -p' x N - l_e.
    """
    _, R, N, _ = unpack(x)
    dp = R @ v
    return ca.vertcat(dp, ca.reshape(R @ hat(u), 9, 1), -force, -ca.cross(dp, N) - moment)


def base_balance(x: Any, turn: float = 0.0) -> Any:
    """Return the 12 clamped-base residuals: p = 0 and R = I, or that turned about e3 by an angle."""
    p, R, _, _ = unpack(x)
    return ca.vertcat(p, ca.reshape(R - turned(turn), 9, 1))


def turned(angle: float) -> Any:
    """Return the rotation about e3 by an angle."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.DM([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def carried(x: Any, length: Any, turn: float = 0.0) -> Any:
    """Return the state at the far end of a rigid, weightless piece along R e3, with the body axes turned about it."""
    p, R, N, M = unpack(x)
    offset = length * R[:, 2]
    return ca.vertcat(p + offset, ca.reshape(R @ turned(turn), 9, 1), N, M - ca.cross(offset, N))


def tip_balance(x: Any, force: Any, moment: Any) -> Any:
    """Return the 6 tip residuals N(L) - F_e and M(L) - M_e, Eq. (9)."""
    _, _, N, M = unpack(x)
    return ca.vertcat(N - force, M - moment)


def arc_state(s: Any, u_x: Any, u_y: Any) -> Any:
    """Return the state at s of the rod without gravity or tip load: the circular arc of this curvature, with v = e3.

    Exact for `field` with no weight; written without division by the curvature, so that zero pressure is straight.
    """
    angle2 = (u_x**2 + u_y**2) * s**2
    small = angle2 < 1e-8
    safe2 = ca.if_else(small, 1.0, angle2)
    angle = ca.sqrt(safe2)
    sinc = ca.if_else(small, 1 - angle2 / 6, ca.sin(angle) / angle)
    cosc = ca.if_else(small, 0.5 - angle2 / 24, (1 - ca.cos(angle)) / safe2)
    sinc3 = ca.if_else(small, 1.0 / 6 - angle2 / 120, (1 - ca.sin(angle) / angle) / safe2)
    K = hat(ca.vertcat(u_x, u_y, 0) * s)
    R = ca.DM.eye(3) + sinc * K + cosc * (K @ K)
    e3 = ca.vertcat(0, 0, 1)
    p = s * (e3 + cosc * (K @ e3) + sinc3 * (K @ (K @ e3)))
    return ca.vertcat(p, ca.reshape(R, 9, 1), ca.DM.zeros(6, 1))
