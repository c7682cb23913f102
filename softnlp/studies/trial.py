"""Solvers whose model's constants are tried at other values: compiled once, solved for many."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.rod import Loads
from softnlp.studies.blocked import BlockedSolver
from softnlp.studies.statics import PoseSolver
from softnlp.studies.wall import Situation

Array = NDArray[np.float64]


class TrialPoses(PoseSolver):
    """A `PoseSolver` with other values of some of its `quantities`."""

    constants: Mapping[str, Any] = {}

    def values(self, pressure: Array, loads: Loads) -> dict[str, Any]:
        """Return the quantities that a step sets, and those that are tried."""
        return {**self.constants, **super().values(pressure, loads)}

    def at(self, constants: Mapping[str, Any]) -> TrialPoses:
        """Return the solver at other values [SI], sharing all that is compiled; those of a wall are left out."""
        other = copy.copy(self)
        other.constants = {name: v for name, v in constants.items() if not name.startswith("contact.")}
        return other


class TrialBlocked(BlockedSolver):
    """A `BlockedSolver` of `TrialPoses`, with other values of some of its quantities."""

    poses: TrialPoses
    constants: Mapping[str, Any] = {}

    def values(self, situation: Situation, pressed: Array, free_lengths: Array) -> dict[str, Any]:
        """Return the quantities that a blocked pose sets, and those that are tried."""
        return {**self.constants, **super().values(situation, pressed, free_lengths)}

    def at(self, constants: Mapping[str, Any]) -> TrialBlocked:
        """Return the solver at other values [SI], sharing all that is compiled."""
        other = copy.copy(self)
        other.poses = self.poses.at(constants)
        other.constants = {name: v for name, v in constants.items() if name.startswith("contact.")}
        return other
