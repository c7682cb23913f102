"""Natural frequencies, shapes and damping about a pose at rest, and the linear system that the robot is near it.

Small strains x beside those of the pose follow M x'' + D x' + K x = f at the Gauss points, with the matrices that the
steps of a run are solved with. K holds the loads, so that a pose which buckles has a negative one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from softnlp.dynamics.motion import Stepper
from softnlp.dynamics.rod import Acting, Rod, rotated, still
from softnlp.dynamics.rules import Instant, at_end
from softnlp.dynamics.sections import Numbers
from softnlp.nlp.solver import Ipopt

Array = NDArray[np.float64]
Kind = Literal["bending", "torsion", "extension"]

_STEP = 50.0  # of a pressure in a central difference quotient [Pa]
_NEAR = 0.1  # how near an eigenvalue of the damped system is to where its mode's damping alone would move it
_KINDS: dict[Kind, tuple[int, ...]] = {"bending": (0, 1, 3, 4), "torsion": (5,), "extension": (2,)}


@dataclass(frozen=True, eq=False)
class Mode:
    """One way of swinging about a pose.

    Attributes
    ----------
    frequency
        Of the damped eigenvalue its absolute value over 2 pi; of a pose that buckles in this way 0 [Hz].
    damping_ratio
        Above 1 it does not swing [1].
    kind
        "bending", "torsion" or "extension": where most of its elastic energy is.
    shares
        (3,) of that energy in bending, torsion and extension [1].
    displacement
        (points, 3) of the axis at the Gauss points and, last, the tip, world frame, the largest 1, or that of the
        surface by torsion where that is larger [1].
    rotation
        (points, 3) at the Gauss points in the same scale, world frame [1/m].
    stable
        Whether the pose does not buckle in this way.
    """

    frequency: float
    damping_ratio: float
    kind: Kind
    shares: Array
    displacement: Array
    rotation: Array
    stable: bool


@dataclass(frozen=True, eq=False)
class Linear:
    """x' = A x + B u, y = C x + D u about a pose at rest, SI.

    Attributes
    ----------
    A, B, C, D
        (states, states), (states, inputs), (outputs, states) and (outputs, inputs) [SI].
    states, inputs, outputs
        Their names, with units.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Vibration:
    """What is known of small motions about a pose.

    Attributes
    ----------
    modes
        Lowest first.
    linear
        The linear system.
    pressure
        (sets,) in the chambers [Pa].
    place
        (points,) of the Gauss points and, last, the tip, of the segments' lengths together [1].
    tip
        (3,) at rest, world frame [m].
    residual
        Of the pose, scaled [1].
    ipopt
        What IPOPT said of the pose, None where it took no part.
    """

    modes: tuple[Mode, ...]
    linear: Linear
    pressure: Array
    place: Array
    tip: Array
    residual: float
    ipopt: Ipopt | None = None

    @property
    def stable(self) -> bool:
        """Whether no mode grows."""
        return all(mode.stable for mode in self.modes)


_NAMES = ("v1", "v2", "v3", "u1 [1/m]", "u2 [1/m]", "u3 [1/m]")


def vibration(stepper: Stepper, pressures: Array, acting: Acting, radius: float, lag: float = 0.0) -> Vibration:
    """Return modes and linear system about the pose at rest, which the stepper finds.

    pressures : (sets,) [Pa]. radius : of the body, which says how torsion counts beside displacement [m]. lag : of
    the chambers behind the regulators, whose pressures are the inputs then [s].
    Raises `Failed` where there is no pose at rest.
    """
    rod = stepper.rod
    n, numbers = rod.size, rod.sections.at(pressures)
    found = stepper.pose(numbers, acting)
    pose, residual = found.instant, found.residual
    K, D, mass = _matrices(rod, pose, acting)
    elastic = np.linalg.inv(pose.at.compliance)
    move, turn = rod.kinematics(pose.at)
    values, left, right = scipy.linalg.eig(K, mass, left=True)
    order = np.argsort(values.real)
    damped = _damped(K, D, mass) if rod.damping_s else np.zeros(0)
    modes = []
    for k in order:
        x, y = right[:, k].real, left[:, k].real
        if np.linalg.norm(x) < 0.5:
            x, y = right[:, k].imag, left[:, k].imag
        square = float(values[k].real)
        omega = np.sqrt(abs(square))
        ratio = float(y @ D @ x / (2 * omega * (y @ mass @ x))) if rod.damping_s else 0.0
        frequency = float(omega)
        if rod.damping_s and square > 0 and 0 < ratio < 1:
            guess = omega * complex(-ratio, np.sqrt(1 - ratio**2))
            near = damped[np.argmin(np.abs(damped - guess))]
            if abs(near - guess) < _NEAR * omega:
                frequency, ratio = float(abs(near)), float(-near.real / abs(near))
        strains = x.reshape(n, 6)
        stored = rod.w @ (strains * np.matmul(elastic, strains[:, :, None])[:, :, 0])
        shares = np.array([stored[list(rows)].sum() for rows in _KINDS.values()]) / stored.sum()
        displacement, rotation = (move @ x).reshape(n + 1, 3), (turn @ x).reshape(n, 3)
        spun = radius * np.abs((rotation * pose.at.rotation[:, :, 2]).sum(axis=1)).max()
        size = max(float(np.linalg.norm(displacement, axis=1).max()), float(spun))
        modes.append(
            Mode(
                frequency=frequency / (2 * np.pi) if square > 0 else 0.0,
                damping_ratio=ratio if square > 0 else 0.0,
                kind=list(_KINDS)[int(np.argmax(shares))],
                shares=shares,
                displacement=displacement / size,
                rotation=rotation / size,
                stable=square > 0,
            )
        )
    linear = _linear(rod, numbers, pressures, pose, (K, D, mass), move, lag)
    place = np.append(rod.grid.place, rod.grid.ends[-1]) / rod.grid.ends[-1]
    return Vibration(tuple(modes), linear, pressures, place, pose.at.position[-1], residual, found.ipopt)


def grows(rod: Rod, pose: Instant, acting: Acting) -> bool:
    """Return whether a pose at rest buckles: whether a small motion about it grows."""
    K, _, mass = _matrices(rod, pose, acting)
    return bool(np.min(np.linalg.eigvals(np.linalg.solve(mass, K)).real) < 0)


def _matrices(rod: Rod, pose: Instant, acting: Acting) -> tuple[Array, Array, Array]:
    """Return K, D and M about a pose at rest."""
    n = rod.size
    _, N, M, *_ = at_end(rod, pose.e, pose.at, still(n), acting)
    K = -rod.tangent(pose.at, N, M, 0.0, acting)
    mass, D = -rod.tangent(pose.at, N, M, 1.0, acting) - K, np.zeros((6 * n, 6 * n))
    K.reshape(n, 6, n, 6)[range(n), :, range(n)] += np.linalg.inv(pose.at.compliance)
    D.reshape(n, 6, n, 6)[range(n), :, range(n)] += rod.viscosity
    return K, D, mass


def _damped(K: Array, D: Array, mass: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues of the damped system that swing."""
    n = len(K)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:] = -np.linalg.solve(mass, np.hstack([K, D]))
    found = np.asarray(np.linalg.eigvals(A), complex)
    swinging: NDArray[np.complex128] = found[found.imag > 0]
    return swinging


def _linear(
    rod: Rod,
    numbers: Numbers,
    pressures: Array,
    pose: Instant,
    matrices: tuple[Array, Array, Array],
    move: Array,
    lag: float,
) -> Linear:
    """Return the linear system; the pressures in the chambers are states behind a lag."""
    n, sets = rod.size, int(pressures.size)
    K, D, mass = matrices
    e, at = pose.e, pose.at
    by_pressure = np.empty((n, 6, sets))
    stiff: Array = np.asarray(np.linalg.inv(rod.sections.strains(numbers, e)[1]), float)
    for j in range(sets):
        change = np.zeros(sets)
        change[j] = _STEP
        ends = [rod.sections.strains(rod.sections.at(pressures + d), e)[0] for d in (change, -change)]
        by_pressure[:, :, j] = rotated(stiff, (ends[0] - ends[1]) / (2 * _STEP))
    by_force = np.empty((n, 6, 3))
    none = still(n)[1]
    for j in range(3):
        push = Acting(np.eye(3)[j], np.zeros(3), np.zeros(3))
        N, moment = rod.required(at, at, none, push)
        by_force[:, :3, j], by_force[:, 3:, j] = rotated(at.rotation.transpose(0, 2, 1), N), moment
    solved = np.linalg.solve(mass, np.hstack([K, D, by_pressure.reshape(6 * n, -1), by_force.reshape(6 * n, -1)]))
    m = 6 * n
    states = 2 * m + (sets if lag else 0)
    A, B, C = np.zeros((states, states)), np.zeros((states, sets + 3)), np.zeros((6, states))
    A[:m, m : 2 * m] = np.eye(m)
    A[m : 2 * m, : 2 * m] = -solved[:, : 2 * m]
    B[m : 2 * m, sets:] = solved[:, 2 * m + sets :]
    if lag:
        A[m : 2 * m, 2 * m :] = solved[:, 2 * m : 2 * m + sets]
        A[2 * m :, 2 * m :] = -np.eye(sets) / lag
        B[2 * m :, :sets] = np.eye(sets) / lag
    else:
        B[m : 2 * m, :sets] = solved[:, 2 * m : 2 * m + sets]
    C[:3, :m] = C[3:, m : 2 * m] = move[3 * n :]
    points = [f"{name} at point {k + 1}" for k in range(n) for name in _NAMES]
    return Linear(
        A,
        B,
        C,
        np.zeros((6, sets + 3)),
        states=(
            *points,
            *(f"rate of {point}" for point in points),
            *([f"pressure {j + 1} in the chambers [Pa]" for j in range(sets)] if lag else []),
        ),
        inputs=(*(f"pressure {j + 1} [Pa]" for j in range(sets)), *(f"tip force {x} [N]" for x in "xyz")),
        outputs=(*(f"tip {x} [m]" for x in "xyz"), *(f"tip velocity {x} [m/s]" for x in "xyz")),
    )
