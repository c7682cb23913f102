"""Targets of inverse kinematics: what is asked of the tip, and how near a pose comes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.statics.step import Aimed, Pose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Target:
    """Where the tip is to be: position (3,) [m], direction (3,) of its axis, unit; one or both, world frame."""

    position: Array | None
    direction: Array | None


@dataclass(frozen=True, eq=False)
class InverseTask:
    """A path of targets and the bounds of each set's pressure.

    lower, upper : (sets,) [Pa]. length_per_radian : how much of a distance [m] a radian of misfit counts for where
    position and direction cannot both be met. allow : with "self_intersection" in it, shapes that no body can take
    without passing through itself are answers too. contact_force : that no obstacle may push harder [N], None for any.
    """

    targets: tuple[Target, ...]
    lower: Array
    upper: Array
    length_per_radian: float
    allow: tuple[str, ...] = ()
    contact_force: float | None = None

    def step_count(self, pressures: int) -> int:
        """Return how many steps the run has: one a target."""
        return len(self.targets)


@dataclass(frozen=True, eq=False)
class Aim:
    """A target in the units of a robot: residuals are in L_0, a radian counts for `weight` of them.

    A direction a that should be t leaves weight (a - t): the chord of the angle, which grows up to the opposite
    direction. tangents : (3, 2) unit vectors across t.
    """

    target: Target
    length: float
    weight: float

    @property
    def tangents(self) -> Array:
        """Two unit vectors across the direction, and across each other, as columns."""
        assert self.target.direction is not None
        across: Array = np.linalg.svd(self.target.direction[None, :])[2][1:].T
        return across

    @property
    def conditions(self) -> int:
        """How many pressures it takes to meet the target."""
        return 3 * (self.target.position is not None) + 2 * (self.target.direction is not None)

    def values(self) -> dict[str, Any]:
        """Return the values of the target's quantities in `softnlp.studies.inverse_problem.inverse_problem`, SI."""
        values: dict[str, Any] = {}
        if self.target.position is not None:
            values["target.position"] = self.target.position
        if self.target.direction is not None:
            values["target.direction"] = self.target.direction
            values["target.tangents"] = self.tangents.ravel(order="F")
            values["target.weight"] = self.weight
        return values

    def aimed(self, pose: Pose | None) -> Aimed:
        """Return how near a pose comes."""
        position, direction = self.target.position, self.target.direction
        if pose is None:
            return Aimed(position, direction)
        axis = pose.tip_rotation[:, 2] / np.linalg.norm(pose.tip_rotation[:, 2])
        distance = None if position is None else float(np.linalg.norm(pose.tip_position - position))
        angle = None
        if direction is not None:
            angle = 2 * float(np.arctan2(np.linalg.norm(axis - direction), np.linalg.norm(axis + direction)))
        return Aimed(position, direction, distance, angle, pose.tip_position, axis)

    def cost(self, aimed: Aimed) -> float:
        """Return the weighed misfit of a pose, in L_0; inf without one."""
        if aimed.tip_position is None:
            return float("inf")
        parts = [0.0]
        if aimed.distance is not None:
            parts.append(aimed.distance / self.length)
        if aimed.angle is not None:
            parts.append(self.weight * 2 * float(np.sin(aimed.angle / 2)))
        return float(np.linalg.norm(parts))


def aim_of(task: InverseTask, target: Target, length: float) -> Aim:
    """Return the aim at a target for a robot of length L_0 [m]."""
    return Aim(target, length, task.length_per_radian / length)
