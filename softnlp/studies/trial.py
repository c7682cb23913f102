"""Solvers whose model's constants are tried at other values, and that serve every robot of a kind: compiled once."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.contact_settings import ContactSettings
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model, quantities
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.nlp.directions import SolutionDerivatives
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.solver import PoseSolver
from softnlp.statics.wall import Situation

Array = NDArray[np.float64]


class _Derivatives:
    """Derivatives of what is observed, by number of intervals, built at first use."""

    def __init__(self) -> None:
        self._made: dict[int, SolutionDerivatives] = {}

    def get(self, intervals: int, make: Callable[[], SolutionDerivatives]) -> SolutionDerivatives:
        if intervals not in self._made:
            self._made[intervals] = make()
        return self._made[intervals]


class TrialPoses(PoseSolver):
    """A `PoseSolver` with other values of some of its `quantities`."""

    def __init__(self, model: Model, numerics: Numerics) -> None:
        # As a blocked force takes free shapes: where nothing loads them they are known in closed form.
        super().__init__(model, numerics, unloaded_accuracy=numerics.accuracy)
        self.derivatives = _Derivatives()
        self._robot: Mapping[str, Any] = {}
        self._constants: Mapping[str, Any] = {}

    def values(self, pressure: Array, loads: Loads) -> dict[str, Any]:
        """Return the quantities that a step sets, and those that are tried."""
        return {**super().values(pressure, loads), **self._robot, **self._constants}

    def at(self, constants: Mapping[str, Any]) -> TrialPoses:
        """Return the solver at other values [SI], sharing all that is compiled; those of a wall are left out."""
        other = copy.copy(self)
        other._constants = {name: v for name, v in constants.items() if not name.startswith("contact.")}
        return other

    def of(self, robot: Robot) -> TrialPoses:
        """Return the solver of another robot with as many chambers and sets, sharing all that is compiled."""
        other = copy.copy(self)
        other.model = replace(self.model, robot=robot)
        other._robot = robot_values(other.model)
        return other


class TrialBlocked(BlockedSolver):
    """A `BlockedSolver` of `TrialPoses`, with other values of some of its quantities."""

    poses: TrialPoses

    def __init__(self, poses: TrialPoses, contact: ContactSettings) -> None:
        super().__init__(poses.model, poses.numerics, contact, poses=poses)
        self.derivatives = _Derivatives()
        self._constants: Mapping[str, Any] = {}

    def values(self, situation: Situation, pressed: Array, free_lengths: Array) -> dict[str, Any]:
        """Return the quantities that a blocked pose sets, and those that are tried."""
        return {**super().values(situation, pressed, free_lengths), **self._constants}

    def at(self, constants: Mapping[str, Any]) -> TrialBlocked:
        """Return the solver at other values [SI], sharing all that is compiled."""
        other = copy.copy(self)
        other.poses = self.poses.at(constants)
        other._constants = {name: v for name, v in constants.items() if name.startswith("contact.")}
        return other

    def of(self, robot: Robot) -> TrialBlocked:
        """Return the solver of another robot with as many chambers and sets, sharing all that is compiled."""
        other = copy.copy(self)
        other.poses = self.poses.of(robot)
        other.model = other.poses.model
        return other


def robot_values(model: Model) -> dict[str, Any]:
    """Return the dimensions of a model's robot as values of quantities."""
    return {name: q.nominal for name, q in quantities(model).items() if name.startswith("robot.")}
