"""The shape without gravity and tip load: a circular arc in closed form, so nothing is solved but its stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import Loads
from softnlp.statics.branch import BranchPoint, stretch_on_branch
from softnlp.statics.pose import SHAPE_POINTS, pose_of, shape_of
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Pose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Arc:
    """An unloaded shape. column : every quantity in its order, SI. stretch : lambda.

    tip_position, axis : (3,) of the tip [m], unit. lengths : (N,) of the chambers [m]. bending_angle : [rad].
    backbone_length : [m].
    """

    column: Array
    stretch: float
    tip_position: Array
    axis: Array
    lengths: Array
    bending_angle: float
    backbone_length: float


def unloaded_arc(poses: PoseSolver, pressure: Array) -> tuple[BranchPoint, Arc]:
    """Return the arc at a pressure (sets,) [Pa], or where the branch to it ends and the arc there."""
    column = poses.column(poses.values(pressure, Loads()))
    branch = stretch_on_branch(poses.branch, column, pressure)
    state = np.asarray(poses.functions.arc(column, branch.stretch, 1.0)).ravel()
    constants = poses.functions.section(column, branch.stretch)[0]
    along = np.asarray(poses.functions.lengths(state, constants)).ravel()  # rates, which are constant on an arc
    L_0, N = poses.model.length, poses.model.chambers
    lengths, backbone = L_0 * along[:N], L_0 * float(along[N + 1])
    arc = Arc(column, branch.stretch, L_0 * state[:3], state[9:12], lengths, float(along[N]), backbone)
    return branch, arc


def arc_pose(poses: PoseSolver, arc: Arc) -> Pose:
    """Return the pose of an arc.

    It is stable: without loads the energy is a sum over s of a convex function of the strains, which are free.
    """
    column, stretch = arc.column, arc.stretch
    constants, _, units = poses.functions.section(column, stretch)
    L_0, F_0 = (float(v) for v in np.asarray(units).ravel())
    s = np.linspace(0, 1, SHAPE_POINTS)
    states = np.asarray(poses.functions.arc(column, stretch, s[None, :]))
    along = np.asarray(poses.shape.map(s.size)(states, constants, np.zeros((1, s.size))))
    outputs = {
        "stretch": np.array([stretch]),
        "tip_position": arc.tip_position,
        "tip_rotation": states[3:12, -1].reshape(3, 3).T,
        "chamber_lengths": arc.lengths,
        "backbone_length": np.array([arc.backbone_length]),
    }
    shape = shape_of(along, s, L_0, F_0)
    return pose_of(poses.model, outputs, shape, arc.bending_angle, arc.tip_position, True)
