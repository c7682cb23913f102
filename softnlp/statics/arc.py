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

    position, axis : (3,) of the tip [m], unit. lengths : (N,) of the chambers [m].
    """

    column: Array
    stretch: float
    position: Array
    axis: Array
    lengths: Array


def unloaded_arc(poses: PoseSolver, pressure: Array) -> tuple[BranchPoint, Arc]:
    """Return the arc at a pressure (sets,) [Pa], or where the branch to it ends and the arc there."""
    column = poses.column(poses.values(pressure, Loads()))
    branch = stretch_on_branch(poses.branch, column, pressure)
    tip = np.asarray(poses.functions.arc(column, branch.stretch, 1.0)).ravel()
    L_0 = float(poses.model.robot.length)
    lengths = L_0 * _along(poses, column, branch.stretch)[: poses.model.robot.chambers]
    return branch, Arc(column, branch.stretch, L_0 * tip[:3], tip[9:12], lengths)


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
    integrals = _along(poses, column, stretch)
    N = poses.model.robot.chambers
    outputs = {
        "stretch": np.array([stretch]),
        "tip_position": arc.position,
        "tip_rotation": states[3:12, -1].reshape(3, 3).T,
        "chamber_lengths": arc.lengths,
        "backbone_length": L_0 * integrals[N + 1 :],
    }
    shape = shape_of(along, s, L_0, F_0)
    return pose_of(poses.model, outputs, shape, float(integrals[N]), arc.position, True)


def _along(poses: PoseSolver, column: Array, stretch: float) -> Array:
    """Return chamber lengths, bending angle and backbone length, scaled; their rates are constant on an arc."""
    constants = poses.functions.section(column, stretch)[0]
    return np.asarray(poses.functions.lengths(poses.functions.arc(column, stretch, 0.0), constants)).ravel()
