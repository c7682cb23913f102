"""Whether an equilibrium is a minimum of the potential energy: conjugate points of the second variation.

The loads are dead and the pressures fixed, so the rod has an energy. With a clamped base and a free tip its equilibrium is
stable when no variation that keeps the tip balance linearised vanishes (as a pose) anywhere between base and tip: the 6x6
determinant of the pose part of the six such solutions, started at the tip, keeps its sign down to the base. At the base
this is the determinant of the map from base unknowns to tip residual.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp import rod
from softnlp.transcription import RK4, rk_step

Array = NDArray[np.float64]

_SUBSTEPS = 2


def _perturbed(x: ca.SX, delta: ca.SX) -> ca.SX:
    """Move a state along 12 independent directions: p, a rotation about the body axes, n, m."""
    p, R, n, m = rod.unpack(x)
    R_moved = R @ (ca.SX.eye(3) + rod.hat(delta[3:6]))
    return ca.vertcat(p + delta[0:3], ca.reshape(R_moved, 9, 1), n + delta[6:9], m + delta[9:12])


def transition_functions(field: ca.Function) -> tuple[ca.Function, ca.Function]:
    """Return the linearised step over one interval and the linearised tip balance.

    field : of a load case. The first maps (x, c, h) to the 12x12 matrix from variations at x to those a step h further; the
    second maps the tip's (x, c) to the 6x6 matrix A with d(n, m) = -A d(pose) at the tip, for a dead load.
    """
    x, c, h = ca.SX.sym("x", rod.STATE_SIZE), ca.SX.sym("c", field.size1_in(1)), ca.SX.sym("h")
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
        W = R.T @ ca.reshape(moved[3:12, j], 3, 3)
        turn = ca.vertcat(W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]) / 2
        rows.append(ca.vertcat(moved[0:3, j], turn, moved[12:18, j]))
    transition = ca.substitute(ca.horzcat(*rows), delta, ca.SX.zeros(12))

    section = rod.RodSection(*(c[k] for k in range(len(rod.RodSection._fields))))
    balance = rod.tip_balance(_perturbed(x, delta), section, ca.SX.zeros(3), ca.SX.zeros(3))
    tip = ca.substitute(ca.jacobian(balance, delta[:6]), delta, ca.SX.zeros(12))
    return (
        ca.Function("transition", [x, c, h], [transition], {"cse": True}),
        ca.Function("tip_variation", [x, c], [tip], {"cse": True}),
    )


def conjugate_points(transition: ca.Function, tip_variation: ca.Function, nodes: Array, constants: Array) -> int:
    """Count the sign changes of the pose determinant from tip to base; 0 means stable.

    transition : of `transition_functions`, mapped over the intervals. nodes : (18, K + 1) states of a solution. Two conjugate points within one interval cancel.
    """
    K = nodes.shape[1] - 1
    Phi = np.asarray(transition(nodes[:, :K], constants, 1 / K)).reshape(12, K, 12).transpose(1, 0, 2)
    A = np.asarray(tip_variation(nodes[:, K], constants))
    Y = np.vstack([np.eye(6), -A])
    sign, count = 1.0, 0
    for k in range(K - 1, -1, -1):
        Y = np.linalg.solve(Phi[k], Y)
        Y /= np.max(np.abs(Y))
        now = float(np.sign(np.linalg.det(Y[:6])))
        count += now != sign
        sign = now
    return count
