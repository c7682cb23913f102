"""The rod at the Gauss points: its shape from strains, its resultants from inertia and loads, and what is off between.

What is solved for are the elastic resultants e at every Gauss point, force and moment in the body frame. They give
strains, strains the shape (from the base), the shape velocities and accelerations (by a rule in time), and those the
resultants again, from the tip: N' = rho A_0 (a - g), M' = -p' x N + R (J w' + w x J w) per length as cast. With damping
stress is e + D times the rate of the strains, D the stiffness as cast times a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy  # its parts are imported where they are first used
from numpy.typing import NDArray

from softnlp.dynamics.grid import Grid
from softnlp.dynamics.sections import Numbers, Sections

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Acting:
    """Loads at an instant, world frame.

    force, moment : (3,) at the tip [N], [N m]. gravity : (3,) [m/s^2]. mass : at the tip [kg].
    """

    force: Array
    moment: Array
    gravity: Array
    mass: float = 0.0


class Placed(NamedTuple):
    """A shape. strains : (n, 6). compliance : (n, 6, 6). turn : (n + 1, 4) quaternions w, x, y, z, the tip last.

    turn_rate : (n, 4) their rates along the rod [1/m]. rotation : (n, 3, 3). slope : (n, 3) p' per length as cast.
    position : (n + 1, 3), the tip last [m]. offsets : (m, 3) of connectors [m].
    """

    strains: Array
    compliance: Array
    turn: Array
    turn_rate: Array
    rotation: Array
    slope: Array
    position: Array
    offsets: Array

    @property
    def tip_rotation(self) -> Array:
        """(1, 3, 3) R at the tip."""
        return matrices(self.turn[-1:])


class Motion(NamedTuple):
    """Rates at the points. velocity : (n + 1, 3), the tip last [m/s]. spin : (n, 3), body frame [rad/s].

    strain_rate : (n, 6) of the strains, for the damping.
    """

    velocity: Array
    spin: Array
    strain_rate: Array


class Inertia(NamedTuple):
    """acceleration : (n + 1, 3), the tip last [m/s^2]. turning : (n, 3) rate of angular momentum, world frame [N]."""

    acceleration: Array
    turning: Array


def still(n: int) -> tuple[Motion, Inertia]:
    """Return no motion."""
    return Motion(np.zeros((n + 1, 3)), np.zeros((n, 3)), np.zeros((n, 6))), Inertia(
        np.zeros((n + 1, 3)), np.zeros((n, 3))
    )


def rotated(R: Array, a: Array) -> Array:
    """Return R a at each point, (n, 3)."""
    found: Array = np.matmul(R, a[:, :, None])[:, :, 0]
    return found


def cross(a: Array, b: Array) -> Array:
    """Return a x b along the last axis (np.cross costs ten times as much here)."""
    found = np.empty(np.broadcast_shapes(a.shape, b.shape))
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    found[..., 0], found[..., 1], found[..., 2] = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return found


def hats(a: Array) -> Array:
    """Return (n, 3, 3) the matrices that multiply as a x."""
    found = np.zeros((len(a), 3, 3))
    found[:, 0, 1], found[:, 0, 2], found[:, 1, 2] = -a[:, 2], a[:, 1], -a[:, 0]
    found[:, 1, 0], found[:, 2, 0], found[:, 2, 1] = a[:, 2], -a[:, 1], a[:, 0]
    return found


def matrices(q: Array) -> Array:
    """Return (n, 3, 3) rotations of unit quaternions (n, 4)."""
    w, x, y, z = q.T
    R = np.empty((len(q), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[:, 1, 0], R[:, 1, 1], R[:, 1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    R[:, 2, 0], R[:, 2, 1], R[:, 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return R


def turned_by(before: Array, after: Array) -> Array:
    """Return (n, 3) Cayley's vector of the rotation from one quaternion to another, body frame: 2 tan(angle/2) axis."""
    w0, v0, w1, v1 = before[:, 0], before[:, 1:], after[:, 0], after[:, 1:]
    w = w0 * w1 + (v0 * v1).sum(axis=1)
    v = w0[:, None] * v1 - w1[:, None] * v0 - cross(v0, v1)
    found: Array = 2 * v / w[:, None]
    return found


class Rod:
    """The rod of a body on a grid; everything SI, in the world frame or that of the body.

    damping_s : the Kelvin-Voigt time. units : (6,) of the residual, EI/L^2 and EI/L.
    """

    def __init__(self, sections: Sections, grid: Grid, damping_s: float = 0.0) -> None:
        self.grid, self.sections, self.damping_s = grid, sections, damping_s
        n = self.size = grid.size
        self.mass, self.inertia = sections.mass, sections.inertia
        self.P, self.B, self.w = grid.from_base, grid.to_tip, grid.weight
        self.P_tip = np.vstack([self.P, self.w])
        self.P_turn = np.vstack([self.P_tip, grid.at_joints])
        self.length = float(grid.ends[-1] + grid.connectors.sum())
        rest = sections.at(np.zeros(sections.body.sets)) if sections.body.sets else sections.at(np.zeros(0))
        self.at_rest = rest
        self.viscosity = damping_s * rest.stiffness
        EI = float(np.mean(rest.stiffness[:, [3, 4], [3, 4]]))
        self.units = np.repeat([EI / self.length**2, EI / self.length], 3)
        EA = float(np.mean(rest.stiffness[:, 2, 2]))
        self._noise = (
            np.finfo(float).eps * self.length**2 / EI * np.array([np.mean(self.mass) * self.length**2, damping_s * EA])
        )
        self._eye = np.eye(4 * n)
        self._first = np.zeros(4 * n)
        self._first[::4] = 1.0
        self._half = self.P / 2

    def noise(self, rate: float) -> float:
        """Return what rounding leaves of a residual, in `units`, where rates gain so much by what is at the end."""
        return float(self._noise @ [rate**2, rate])

    def turns(self, U: Array) -> tuple[Array, Array, Array]:
        """Return unit quaternions at points and tip (n + 1, 4), at connectors (m, 4), and their rates (n, 4).

        q' = q (0, U) / 2.
        """
        n = self.size
        M = np.zeros((n, 4, 4))
        M[:, 1:, 0], M[:, 0, 1:] = U, -U
        M[:, 1:, 1:] = -hats(U)
        A = self._eye - (self._half[:, None, :, None] * M.transpose(1, 0, 2)[None]).reshape(4 * n, 4 * n)
        q = scipy.linalg.lapack.dgesv(A, self._first)[2].reshape(n, 4)
        rate = np.matmul(M, q[:, :, None])[:, :, 0] / 2
        every = self.P_turn @ rate
        every[:, 0] += 1.0
        every /= np.sqrt((every**2).sum(axis=1))[:, None]
        return every[: n + 1], every[n + 1 :], rate

    def placed(self, numbers: Numbers, e: Array) -> Placed:
        """Return the shape under elastic resultants (n, 6)."""
        return self.shape(*self.sections.strains(numbers, e))

    def shape(self, strains: Array, compliance: Array) -> Placed:
        """Return the shape of strains (n, 6)."""
        q, joints, rate = self.turns(strains[:, 3:])
        R = matrices(q[:-1])
        slope = np.matmul(R, strains[:, :3, None])[:, :, 0]
        p = self.P_tip @ slope
        offsets = np.zeros((0, 3))
        if self.grid.joints.size:
            offsets = self.grid.connectors[:, None] * matrices(joints)[:, :, 2]
            p = p + self.grid.beyond @ offsets
        return Placed(strains, compliance, q, rate, R, slope, p, offsets)

    def required(self, slope: Array, offsets: Array, inertia: Inertia, acting: Acting) -> tuple[Array, Array]:
        """Return N and M (n, 3) that inertia and loads ask for at a slope p', with connectors' offsets; world frame."""
        f = self.mass[:, None] * (inertia.acceleration[:-1] - acting.gravity)
        N_tip = acting.force - acting.mass * (inertia.acceleration[-1] - acting.gravity)
        N = N_tip - self.B @ f
        M = acting.moment - self.B @ (inertia.turning - cross(slope, N))
        if self.grid.joints.size:
            beyond = self.w - self.grid.at_joints
            M = M + (1 - self.grid.beyond[:-1]) @ cross(offsets, N_tip - beyond @ f)
        return N, M

    def stress(self, e: Array, strain_rate: Array) -> Array:
        """Return (n, 6) resultants with damping, body frame."""
        if not self.damping_s:
            return e
        found: Array = e + rotated(self.viscosity, strain_rate)
        return found

    def kinematics(self, at: Placed) -> tuple[Array, Array]:
        """Return how positions (3 (n + 1), 6 n) and rotations (3 n, 6 n; world frame) follow strains."""
        n, R = self.size, at.rotation
        by_u = np.zeros((n, 3, n, 6))
        by_u[:, :, :, 3:] = (self.P[:, :, None, None] * R[None]).transpose(0, 2, 1, 3)
        turn = by_u.reshape(3 * n, 6 * n)
        rate = -np.matmul(hats(at.slope), turn.reshape(n, 3, 6 * n))
        rate = rate.reshape(n, 3, n, 6)
        rate[range(n), :, range(n), :3] += R
        move = self.P_tip @ rate.reshape(n, 18 * n)
        move = move.reshape(3 * (n + 1), 6 * n)
        if self.grid.joints.size:
            joint = (self.grid.at_joints[:, :, None, None] * R[None]).transpose(0, 2, 1, 3)
            by_joint = np.zeros((len(joint), 3, n, 6))
            by_joint[:, :, :, 3:] = joint
            swing = -np.matmul(hats(at.offsets), by_joint.reshape(-1, 3, 6 * n))
            move = move + (self.grid.beyond @ swing.reshape(-1, 18 * n)).reshape(3 * (n + 1), 6 * n)
        return move, turn

    def tangent(self, at: Placed, N: Array, M: Array, beta: float, acting: Acting) -> Array:
        """Return (6 n, 6 n) how N and M, body frame, follow strains, where accelerations are beta displacements."""
        n, R = self.size, at.rotation
        move, turn = self.kinematics(at)
        by_turn = turn.reshape(n, 3, 6 * n)
        pulled, pushed = self.mass * beta, -beta * acting.mass * move[3 * n :]
        moved = move[: 3 * n].reshape(n, 18 * n)
        dN = (pushed.ravel() - (self.B * pulled) @ moved).reshape(n, 3, 6 * n)
        # of the rate of M: -dp' x N - p' x dN + R J R^T times the angular acceleration
        dslope = -np.matmul(hats(at.slope), by_turn).reshape(n, 3, n, 6)
        dslope[range(n), :, range(n), :3] += R
        rate = np.matmul(hats(N), dslope.reshape(n, 3, 6 * n)) - np.matmul(hats(at.slope), dN)
        if beta:
            J = np.matmul(R * self.inertia[:, None, :], R.transpose(0, 2, 1))
            rate += beta * np.matmul(J, by_turn)
        dM = -(self.B @ rate.reshape(n, 18 * n)).reshape(n, 3, 6 * n)
        if self.grid.joints.size:
            dM = dM + self._joint_tangent(at, N, pulled, pushed, moved, acting)
        R_T = R.transpose(0, 2, 1)
        found: Array = np.empty((n, 6, 6 * n))
        found[:, :3] = np.matmul(R_T, dN + np.matmul(hats(N), by_turn))
        found[:, 3:] = np.matmul(R_T, dM + np.matmul(hats(M), by_turn))
        return found.reshape(6 * n, 6 * n)

    def _joint_tangent(self, at: Placed, N: Array, pulled: Array, pushed: Array, moved: Array, acting: Acting) -> Array:
        """Return what connectors add to the change of M."""
        n, grid = self.size, self.grid
        beyond = self.w - grid.at_joints
        N_joint = self._at_joints(N)
        dN = (pushed.ravel() - (beyond * pulled) @ moved).reshape(-1, 3, 6 * n)
        joint = np.zeros((len(dN), 3, n, 6))
        joint[:, :, :, 3:] = (grid.at_joints[:, :, None, None] * at.rotation[None]).transpose(0, 2, 1, 3)
        swing = -np.matmul(hats(at.offsets), joint.reshape(-1, 3, 6 * n))
        change = np.matmul(hats(at.offsets), dN) - np.matmul(hats(N_joint), swing)
        found: Array = ((1 - grid.beyond[:-1]) @ change.reshape(-1, 18 * n)).reshape(n, 3, 6 * n)
        return found

    def _at_joints(self, N: Array) -> Array:
        """Return N at connectors (m, 3), of the polynomial of the interval before."""
        d = self.grid.points
        c = np.polynomial.legendre.leggauss(d)[0]
        weights = np.array([np.prod([(1 - c[k]) / (c[j] - c[k]) for k in range(d) if k != j]) for j in range(d)])
        return np.array([weights @ N[(k - 1) * d : k * d] for k in self.grid.joints])

    def slope(self, at: Placed, N: Array, M: Array, rate: float, acting: Acting) -> Array:
        """Return (6 n, 6 n) how the residual, in `units`, follows e; rate : of a strain's rate by the strain [1/s]."""
        n = self.size
        by_strain = -self.tangent(at, N, M, rate * rate, acting)
        blocks = by_strain.reshape(n, 6, n, 6)
        if self.damping_s and rate:
            blocks[range(n), :, range(n)] += rate * self.viscosity
        found: Array = np.matmul(by_strain.reshape(6 * n, n, 1, 6), at.compliance[None])[:, :, 0].reshape(n, 6, n, 6)
        found[range(n), :, range(n)] += np.eye(6)
        found /= self.units[None, :, None, None]
        return found.reshape(6 * n, 6 * n)
