"""The rod at the Gauss points: its shape from strains, its resultants from inertia and loads, and what is off between.

What is solved for are the elastic resultants e at every Gauss point, force and moment in the body frame. They give
strains, strains the shape (from the base), the shape velocities and accelerations (by a rule in time), and those the
resultants again, from the tip: N' = rho A_0 (a - g), M' = -p' x N + R (J w' + w x J w) per length as cast. With damping
stress is e + D times the rate of the strains, D the stiffness as cast times a time.

What the resultants have to carry is the exact adjoint of how the shape on the grid follows the strains, between two
shapes as well as at one: the work of all forces on a step is then that of the resultants, to rounding, on any grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
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

    turn_rate : (n, 4) their rates along the rod [1/m]. collocated : (n + 1 + m, 4) the quaternions as the rates give
    them, of a length that is 1 but for the grid, those of connectors last. rotation : (n, 3, 3). slope : (n, 3) p' per
    length as cast. position : (n + 1, 3), the tip last [m]. offsets : (m, 3) of connectors [m].
    """

    strains: Array
    compliance: Array
    turn: Array
    turn_rate: Array
    collocated: Array
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


def _bilinear(product: Callable[[Array, Array], Array], left: int, right: int) -> Array:
    """Return (left right, size) what the outer product of two vectors is multiplied with for a bilinear product."""
    pairs = [product(a, b) for a in np.eye(left) for b in np.eye(right)]
    return np.array([np.ravel(pair) for pair in pairs])


def _quaternion(a: Array, b: Array) -> Array:
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


_SLOWEST = 1.8751**2  # of a cantilever, over sqrt(EI / (rho A L^4))
_ONE = np.array([1.0, 0.0, 0.0, 0.0])
_CROSS = _bilinear(np.cross, 3, 3)
_TIMES = _bilinear(_quaternion, 4, 4)
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
_TURN = _bilinear(
    lambda a, b: np.array([_quaternion(_quaternion(a, np.array([0.0, *v])), b * _CONJUGATE)[1:] for v in np.eye(3)]).T,
    4,
    4,
)
"""R of q q: both sides of q v q*."""
_RIGHT = np.array([[_quaternion(e, np.array([0.0, *u])) for e in np.eye(4)] for u in np.eye(3)])
_RIGHT = _RIGHT.transpose(0, 2, 1).reshape(3, 16)
_HATS = np.array([np.cross(u, np.eye(3)).T for u in np.eye(3)]).reshape(3, 9)
# numpy's own cross and what is written by component cost several times as much at so few points.


def cross(a: Array, b: Array) -> Array:
    """Return a x b along the last axis."""
    both: Array = a[..., :, None] * b[..., None, :]
    found: Array = both.reshape(*both.shape[:-2], 9) @ _CROSS
    return found


def hats(a: Array) -> Array:
    """Return (n, 3, 3) the matrices that multiply as a x."""
    found: Array = (a @ _HATS).reshape(-1, 3, 3)
    return found


def times(a: Array, b: Array) -> Array:
    """Return (n, 4) the products of quaternions."""
    found: Array = (a[:, :, None] * b[:, None, :]).reshape(-1, 16) @ _TIMES
    return found


def by_right(U: Array) -> Array:
    """Return (n, 4, 4) what multiplies a quaternion by (0, U) from the right."""
    found: Array = (U @ _RIGHT).reshape(-1, 4, 4)
    return found


def matrices(q: Array) -> Array:
    """Return (n, 3, 3) rotations of unit quaternions (n, 4)."""
    found: Array = ((q[:, :, None] * q[:, None, :]).reshape(-1, 16) @ _TURN).reshape(-1, 3, 3)
    return found


def turned_by(before: Array, after: Array) -> Array:
    """Return (n, 3) Cayley's vector of the rotation from one quaternion to another, body frame: 2 tan(angle/2) axis."""
    q = times(before * _CONJUGATE, after)
    found: Array = 2 * q[:, 1:] / q[:, :1]
    return found


class Rod:
    """The rod of a body on a grid; everything SI, in the world frame or that of the body.

    damping_s : the Kelvin-Voigt time. units : (6,) of the residual, EI/L^2 and EI/L. period : about that of the slowest
    swing, of a straight beam of Euler and Bernoulli without a mass at its tip [s].
    """

    def __init__(self, sections: Sections, grid: Grid, damping_s: float = 0.0) -> None:
        self.grid, self.sections, self.damping_s = grid, sections, damping_s
        n = self.size = grid.size
        self.mass, self.inertia = sections.mass, sections.inertia
        self.P, self.B, self.w = grid.from_base, grid.to_tip, grid.weight
        self.P_tip = np.vstack([self.P, self.w])
        self.length = float(grid.ends[-1] + grid.connectors.sum())
        rest = sections.at(np.zeros(sections.body.sets)) if sections.body.sets else sections.at(np.zeros(0))
        self.at_rest = rest
        self.viscosity = damping_s * rest.stiffness
        EI = float(np.mean(rest.stiffness[:, [3, 4], [3, 4]]))
        self.units = np.repeat([EI / self.length**2, EI / self.length], 3)
        self.period = 2 * np.pi / _SLOWEST * self.length**2 * float(np.sqrt(np.mean(self.mass) / EI))
        EA = float(np.mean(rest.stiffness[:, 2, 2]))
        self._noise = (
            np.finfo(float).eps * self.length**2 / EI * np.array([np.mean(self.mass) * self.length**2, damping_s * EA])
        )
        d, K = grid.points, grid.of_interval.size
        inside = np.arange(n).reshape(K, d)
        self._own = self.P[inside[:, :, None], inside[:, None, :]] / 2
        self._onward = self.B[inside[:, :, None], inside[:, None, :]] / 2
        self._weights = self.w.reshape(K, d)
        self._eye = np.eye(4 * d)
        self._ones = np.zeros((4 * d, 1))
        self._ones[::4] = 1.0

    def noise(self, rate: float) -> float:
        """Return what rounding leaves of a residual, in `units`, where rates gain so much by what is at the end."""
        return float(self._noise @ [rate**2, rate])

    def turns(self, U: Array) -> tuple[Array, Array]:
        """Return quaternions at points, tip and connectors (n + 1 + m, 4), not quite of length 1, and rates (n, 4).

        q' = q (0, U) / 2. Each interval is solved from the unit quaternion; what is before it multiplies from the left.
        """
        grid, M = self.grid, by_right(U)
        d, K = grid.points, grid.of_interval.size
        A = self._eye - (self._own[:, :, None, :, None] * M.reshape(K, d, 4, 4).transpose(0, 2, 1, 3)[:, None]).reshape(
            K, 4 * d, 4 * d
        )
        own: Array = np.asarray(np.linalg.solve(A, self._ones)[:, :, 0].reshape(-1, 4), float)
        rate = np.matmul(M, own[:, :, None])[:, :, 0] / 2
        ends = (self._weights[:, :, None] * rate.reshape(K, d, 4)).sum(axis=1)
        ends[:, 0] += 1.0
        nodes = np.empty((K + 1, 4))
        nodes[0] = _ONE
        for k in range(K):
            nodes[k + 1] = (nodes[k][:, None] * ends[k]).ravel() @ _TIMES
        before = nodes[:-1].repeat(d, axis=0)
        return np.concatenate([times(before, own), nodes[-1:], nodes[grid.joints]]), times(before, rate)

    def placed(self, numbers: Numbers, e: Array) -> Placed:
        """Return the shape under elastic resultants (n, 6)."""
        return self.shape(*self.sections.strains(numbers, e))

    def shape(self, strains: Array, compliance: Array) -> Placed:
        """Return the shape of strains (n, 6)."""
        collocated, rate = self.turns(strains[:, 3:])
        unit, n = collocated / np.sqrt((collocated**2).sum(axis=1))[:, None], self.size
        q, joints = unit[: n + 1], unit[n + 1 :]
        R = matrices(q[:-1])
        slope = np.matmul(R, strains[:, :3, None])[:, :, 0]
        p = self.P_tip @ slope
        offsets = np.zeros((0, 3))
        if self.grid.joints.size:
            offsets = self.grid.connectors[:, None] * matrices(joints)[:, :, 2]
            p = p + self.grid.beyond @ offsets
        return Placed(strains, compliance, q, rate, collocated, R, slope, p, offsets)

    def required(self, was: Placed, at: Placed, inertia: Inertia, acting: Acting) -> tuple[Array, Array]:
        """Return what inertia and loads ask for between two shapes, which may be one: N world frame, m body frame.

        Both are (n, 3). N works on the change of the slope, and m on that of the curvature: the sum of w m over the
        points is the sum of the moments' work on the turn from one shape to the other.
        """
        f, N_tip = self.pulled(inertia, acting)
        N = N_tip - self.B @ f
        return N, self.turned_back(was, at, self.work(was, at, N, inertia, acting))

    def pulled(self, inertia: Inertia, acting: Acting) -> tuple[Array, Array]:
        """Return what N loses towards the tip per length (n, 3), and N at the tip (3,)."""
        f = self.mass[:, None] * (inertia.acceleration[:-1] - acting.gravity)
        return f, acting.force - acting.mass * (inertia.acceleration[-1] - acting.gravity)

    def work(self, was: Placed, at: Placed, N: Array, inertia: Inertia, acting: Acting) -> Array:
        """Return the moments that work on the turn at points, tip and connectors (n + 1 + m, 3), world frame."""
        found = np.empty((len(at.collocated), 3))
        found[: self.size] = self.w[:, None] * (cross((was.slope + at.slope) / 2, N) - inertia.turning)
        found[self.size] = acting.moment
        if self.grid.joints.size:
            f, N_tip = self.pulled(inertia, acting)
            beyond = self.w - self.grid.at_joints
            found[self.size + 1 :] = cross((was.offsets + at.offsets) / 2, N_tip - beyond @ f)
        return found

    def turned_back(self, was: Placed, at: Placed, work: Array) -> Array:
        """Return the moments (n, 3), body frame, whose work on the change of U is that of moments on the turn.

        work : as of `costates`, which the grid carries to the base.
        """
        x, q = self.costates(was, at, work)[0], (was.collocated + at.collocated)[: self.size] / 2
        found: Array = times(q * _CONJUGATE, x)[:, 1:] / 2
        return found

    def costates(self, was: Placed, at: Placed, work: Array) -> tuple[Array, Array]:
        """Return the costate of the quaternion at points (n, 4) and at the ends of intervals (K + 1, 4).

        work : (n + 1 + m, 3) moments that work on Cayley's vector of the turn at points, tip and connectors, world
        frame. Half that vector is vec(dq q*) / (q_0 . q_1), q the mean and dq the difference of the quaternions, which
        the grid gives by dq = P r, r = (dq U + q dU) / 2, U the mean: linear in dU, so its transpose is solved for.
        """
        grid, before, after = self.grid, was.collocated, at.collocated
        q, U = (before + after) / 2, (was.strains[:, 3:] + at.strains[:, 3:]) / 2
        n, d, K = self.size, grid.points, grid.of_interval.size
        y = np.zeros_like(q)
        y[:, 1:] = 2 / (before * after).sum(axis=1)[:, None] * work
        y = times(y, q)
        M = by_right(U)
        A = self._eye + (
            self._onward[:, :, None, :, None] * M.reshape(K, d, 4, 4).transpose(0, 2, 1, 3)[:, None]
        ).reshape(K, 4 * d, 4 * d)
        b = np.empty((K, 4 * d, 2))
        b[:, :, :1] = self._ones
        b[:, :, 1] = np.matmul(2 * self._onward, (y[:n] / self.w[:, None]).reshape(K, d, 4)).reshape(K, 4 * d)
        both: Array = np.asarray(np.linalg.solve(A, b).reshape(K, d, 4, 2), float)
        free, forced = both[..., 0], both[..., 1]
        # what an interval adds from its end to its beginning, of what it was given and of what acts in it
        turned = np.matmul(M.reshape(K, d, 4, 4), both)
        passed = self._weights[:, :, None, None] * turned / 2
        through, added = -passed[..., 0].sum(axis=1), y[:n].reshape(K, d, 4).sum(axis=1) - passed[..., 1].sum(axis=1)
        through[:, 0] += 1.0
        ends, nodes, now = np.empty((K, 4)), np.empty((K + 1, 4)), y[n]
        nodes[K] = now
        joints = dict(zip(grid.joints.tolist(), y[n + 1 :], strict=True))
        for k in range(K - 1, -1, -1):
            if k + 1 in joints:
                now = now + joints[k + 1]
            ends[k] = now
            now = nodes[k] = (now[:, None] * through[k]).ravel() @ _TIMES + added[k]
        return times(ends.repeat(d, axis=0), free.reshape(-1, 4)) + forced.reshape(-1, 4), nodes

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
