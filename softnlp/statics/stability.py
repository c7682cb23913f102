"""Whether an equilibrium is a minimum of the potential energy: the index of its second variation.

The loads are dead and the pressures fixed, so the rod has an energy. Its second variation is summed from tip to base:
the part of the rod beyond a node answers a small pose of the node with a stiffness, the interval before the node with
its own, and their sum, symmetric at an equilibrium, has as many negative eigenvalues as the node adds directions in
which the energy falls. The total is the number of conjugate points (Morse); it is exact for points that coincide, as
the two of a round column that buckles in both planes at once, where a determinant keeps its sign.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model import rod
from softnlp.nlp.transcription import RK4, rk_step

Array = NDArray[np.float64]

_SUBSTEPS = 2
MOST_INTERVALS = 225
"""Intervals of a finer grid are taken together: the index is a whole number, which needs no finer ones."""


def _perturbed(x: Any, delta: Any) -> Any:
    """Move a state along 12 independent directions: p, a rotation about the world axes, N, M."""
    p, R, N, M = rod.unpack(x)
    R_moved = (ca.SX.eye(3) + rod.hat(delta[3:6])) @ R
    others = x[rod.STATE_SIZE :]
    return ca.vertcat(p + delta[0:3], ca.reshape(R_moved, 9, 1), N + delta[6:9], M + delta[9:12], others)


def transition_function(field: ca.Function) -> ca.Function:
    """Return (x, c, h) -> the 12x12 matrix from variations at x to those a step h further.

    field : of a load case.
    """
    x, c, h = ca.SX.sym("x", field.size1_in(0)), ca.SX.sym("c", field.size1_in(1)), ca.SX.sym("h")
    delta = ca.SX.sym("delta", 12)
    step = rk_step(field, RK4)
    end = _perturbed(x, delta)
    for _ in range(_SUBSTEPS):
        end = step(end, c, h / _SUBSTEPS)
    reached = ca.substitute(end, delta, ca.SX.zeros(12))
    R = rod.unpack(reached)[1]
    moved = ca.jacobian(end, delta)
    rows = []
    for j in range(12):
        W = ca.reshape(moved[3:12, j], 3, 3) @ R.T
        turn = ca.vertcat(W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]) / 2
        rows.append(ca.vertcat(moved[0:3, j], turn, moved[12:18, j]))
    transition = ca.substitute(ca.horzcat(*rows), delta, ca.SX.zeros(12))
    return ca.Function("transition", [x, c, h], [transition])


def conjugate_points(transition: ca.Function, nodes: Array, constants: Array) -> int:
    """Count the directions in which the energy falls, from tip to base; 0 means stable.

    transition : of `transition_function`, mapped over the intervals, at most `MOST_INTERVALS`. nodes : (18, K + 1)
    states of a solution.
    """
    return answered(transition, nodes, constants, np.zeros((6, 6)))[0]  # a dead load answers with nothing


def answered(
    transition: ca.Function,
    nodes: Array,
    constants: Array,
    beyond: Array,
    springs: Array | None = None,
    steps: Array | None = None,
) -> tuple[int, Array]:
    """Return the count over one rod, and the stiffness (6, 6) with which its left end answers.

    transition, nodes : as of `conjugate_points`. beyond : the stiffness of what is behind its right end. springs,
    steps : (K + 1, 6, 6) with which each node is held, and the shares (K,) of the intervals, which are all taken then;
    the nodes are behind what holds them.
    """
    K = nodes.shape[1] - 1 if steps is not None else min(nodes.shape[1] - 1, MOST_INTERVALS)
    chosen = np.linspace(0, nodes.shape[1] - 1, K + 1).round().astype(int)
    nodes, h = nodes[:, chosen], np.diff(chosen) / chosen[-1] if steps is None else steps
    held = np.zeros((K + 1, 6, 6)) if springs is None else springs
    beyond = beyond + held[K]
    Phi = np.asarray(transition(nodes[:, :K], constants, h[None, :])).reshape(12, K, 12).transpose(1, 0, 2)
    A, B, C, D = Phi[:, :6, :6], Phi[:, :6, 6:], Phi[:, 6:, :6], Phi[:, 6:, 6:]
    before = D @ np.linalg.inv(B)  # force at a node by its pose, with the node before it held
    every = np.empty((K, 6, 6))  # and by what is beyond it
    for k in range(K - 1, -1, -1):
        every[k] = before[k] - beyond
        # Carry the stiffness of the rod beyond over the interval: f_left as a function of the pose at its left.
        beyond = np.linalg.solve(D[k] - beyond @ B[k], beyond @ A[k] - C[k]) + held[k]
    return int(np.sum(np.linalg.eigvalsh((every + every.transpose(0, 2, 1)) / 2) < 0)), beyond


def through_junction(beyond: Array, offset: Array, force: Array, units: Array) -> Array:
    """Return the stiffness (6, 6) with which the near end of a rigid piece answers, of that behind its far end.

    offset : from end to end (3,). force : N there (3,), as the offset in units of the near side. units : lengths and
    forces of the near side over those of the far side (2,).
    """
    length, newton = units
    energy = np.array([newton] * 3 + [newton * length] * 3)
    moved = np.diag([length] * 3 + [1.0] * 3)
    if not offset.any():
        return np.asarray(beyond @ moved / energy[:, None])
    a, N = (np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) for x, y, z in (offset, force))
    moved[:3, 3:] = -a * length
    turned, pushed = np.zeros((6, 6)), np.eye(6)
    turned[3:, 3:], pushed[3:, :3] = -N @ a, -a
    answer: Array = np.asarray(np.linalg.solve(energy[:, None] * pushed, beyond @ moved - energy[:, None] * turned))
    return answer
