"""Everything measured of one robot, as the model predicts it at any values of the constants."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import Loads
from softnlp.statics.body import Fit
from softnlp.studies.free_constants import FreeConstants
from softnlp.studies.measurements import COLUMNS, POSE_COLUMNS, Data
from softnlp.studies.predicted_force import BlockedForces
from softnlp.studies.predicted_pose import ArcPoses, Failure, FreePoses, LoadedPoses, Prediction
from softnlp.studies.trial import TrialBlocked, TrialPoses

Array = NDArray[np.float64]


class Predicted:
    """Everything measured of one robot, as the model predicts it."""

    def __init__(
        self, data: Data, poses: TrialPoses, blocked: TrialBlocked | None, free: FreeConstants, loads: Loads
    ) -> None:
        self._data = data
        self._solver, self._loads = poses, loads
        self._poses: FreePoses = (
            LoadedPoses(poses, data.pressure, loads, free.quantities)
            if loads.act
            else ArcPoses(poses, data.pressure, free.quantities)
        )
        self._rows = np.flatnonzero(data.measured[:, -1])
        self._forces: BlockedForces | None = None
        if self._rows.size and blocked is not None:
            self._forces = BlockedForces(blocked.of(data.robot), data.pressure[self._rows], loads, free.quantities)

    def fit(self, constants: Mapping[str, float], row: int) -> Fit | None:
        """Return how the free shape of a row suits a body, None where it has none."""
        pose = self._solver.at(constants).solve(self._data.pressure[row], self._loads)[0].pose
        return None if pose is None else pose.fit

    def evaluate(self, constants: Mapping[str, float], anew: bool) -> Prediction:
        """Return the values in the order of `COLUMNS`, and their derivatives."""
        poses = self._poses.evaluate(constants, anew)
        k, n = len(POSE_COLUMNS), poses.slopes.shape[-1]
        rows = len(self._data.pressure)
        values, slopes = np.full((rows, len(COLUMNS)), np.nan), np.full((rows, len(COLUMNS), n), np.nan)
        values[:, :k], slopes[:, :k] = poses.values[:, :k], poses.slopes[:, :k]
        failures = poses.failures
        if self._forces is not None and not failures:
            r = self._rows
            forces = self._forces.evaluate(constants, poses.values[r, k:], poses.slopes[r, k:], anew)
            values[r, k:], slopes[r, k:] = forces.values, forces.slopes
            failures = tuple(Failure(int(r[f.row]), f.status, f.message) for f in forces.failures)
        return Prediction(values, slopes, failures)
