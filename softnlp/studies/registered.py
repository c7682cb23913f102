"""Predictions of tips where the sensor is, and the numbers of a registration among the constants that are fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.statics.body import Fit
from softnlp.studies.identified import FreeConstants
from softnlp.studies.measurements import Data
from softnlp.studies.predicted import Predicted, Prediction
from softnlp.studies.registration import PREFIX, Registration

Array = NDArray[np.float64]


def with_registration(free: FreeConstants, registration: Registration) -> FreeConstants:
    """Return free constants with the numbers of a registration behind them."""
    count = len(registration.names)
    return FreeConstants(
        (*free.names, *registration.names),
        (*free.quantities, *(PREFIX + name for name in registration.names)),
        np.concatenate([free.start, registration.start()]),
        np.concatenate([free.lower, np.full(count, -np.inf)]),
        np.concatenate([free.upper, np.full(count, np.inf)]),
        np.concatenate([free.scale, registration.scales()]),
    )


class Registered:
    """What is measured of one robot by a sensor somewhere: `Predicted`, with its tips where the sensor is.

    clocked : as of the model.
    """

    def __init__(self, model: Predicted, registration: Registration, clocked: bool = False) -> None:
        self._model = model
        self._clocked = clocked
        self._registration = registration
        self._function = registration.function()

    def fit(self, constants: Mapping[str, float], row: int) -> Fit | None:
        """See `Predicted.fit`."""
        return self._model.fit(constants, row)

    def evaluate(self, constants: Mapping[str, float], anew: bool) -> Prediction:
        """See `Predicted.evaluate`; the slopes by the numbers of the registration come last."""
        g = np.array([constants[PREFIX + name] for name in self._registration.names])
        found = self._model.evaluate(constants, anew)
        rows = len(found.values)
        values = found.values.copy()
        assert found.turns is not None
        assert found.turn_slopes is not None
        moved, turned = (self._widened(part, g.size) for part in (found.slopes, found.turn_slopes))
        slopes = moved.copy()
        sensor, by_tip, by_turn, by_g = (
            np.asarray(part).reshape(3, rows, -1).transpose(1, 0, 2)
            for part in self._function(values[:, :3].T, found.turns.T, g)
        )
        values[:, :3] = sensor[:, :, 0]
        slopes[:, :3] = by_tip @ moved[:, :3] + by_turn @ turned
        slopes[:, :3, slopes.shape[2] - g.size :] += by_g
        return Prediction(values, slopes, found.failures)

    def _widened(self, slopes: Array, count: int) -> Array:
        """Return slopes of the model (rows, m, constants) with those by the registration behind them."""
        own = slopes.shape[2] - self._clocked
        wide = np.concatenate([slopes[:, :, :own], np.zeros((*slopes.shape[:2], count))], axis=2)
        if self._clocked:
            wide[:, :, own + self._registration.names.index("clock")] = slopes[:, :, own]
        return wide


def begun(registration: Registration, data: Sequence[Data], tips: Sequence[Array]) -> Registration:
    """Return a registration whose frame begins where the model's tips lie best on those measured (Kabsch 1976).

    tips : of the model with the tip's offset and clock that are given, for each robot (rows, 3) [m].
    """
    pairs = [np.column_stack([p, d.values[:, :3]]) for d, p in zip(data, tips, strict=True)]
    both = np.concatenate(pairs)
    both = both[np.isfinite(both).all(axis=1)]
    return _laid(registration, both[:, :3], both[:, 3:])


def _laid(registration: Registration, p: Array, q: Array) -> Registration:
    """Return a registration whose frame, if it is fitted, lays places p on q (rows, 3) [m]."""
    if "frame" not in registration.fit or len(p) < 3:
        return registration
    U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
    R = Vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    return replace(registration, rotation=R, translation=q.mean(axis=0) - R @ p.mean(axis=0))


def sensor_places(registration: Registration, tips: Array, turns: Array) -> Array:
    """Return where the sensor is (rows, 3) [m], of tips (rows, 3) [m] and their rotations by columns (rows, 9)."""
    return np.asarray(registration.function()(tips.T, turns.T, registration.start())[0]).T


def fitted(registration: Registration, tips: Array, turns: Array, measured: Array) -> Registration:
    """Return a registration with what it fits at the least squares of places of the sensor (rows, 3) [m]."""
    from scipy.optimize import least_squares

    known = np.isfinite(np.column_stack([tips, turns, measured])).all(axis=1)
    count = len(registration.names)
    if not count or 3 * np.sum(known) < count:
        return registration.found(registration.start())
    p, R, q = tips[known], turns[known], measured[known]
    begin = _laid(registration, p, q)
    function = begin.function()

    def at(g: Array) -> tuple[Array, Array]:
        places, _, _, slopes = (np.asarray(part) for part in function(p.T, R.T, g))
        return (places.T - q).ravel(), slopes.reshape(3, len(p), count).transpose(1, 0, 2).reshape(-1, count)

    done = least_squares(lambda g: at(g)[0], begin.start(), jac=lambda g: at(g)[1], x_scale=begin.scales())
    return begin.found(done.x)
