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
    """What is measured of one robot by a sensor somewhere: `Predicted`, with its tips where the sensor is."""

    def __init__(self, model: Predicted, registration: Registration) -> None:
        self._model = model
        self._registration = registration
        self._function = registration.function()

    def fit(self, constants: Mapping[str, float], row: int) -> Fit | None:
        """See `Predicted.fit`."""
        return self._model.fit(_plain(constants), row)

    def evaluate(self, constants: Mapping[str, float], anew: bool) -> Prediction:
        """See `Predicted.evaluate`; the slopes by the numbers of the registration come last."""
        g = np.array([constants[PREFIX + name] for name in self._registration.names])
        found = self._model.evaluate(_plain(constants), anew)
        rows, columns, n = found.slopes.shape
        values = found.values.copy()
        slopes = np.concatenate([found.slopes, np.zeros((rows, columns, g.size))], axis=2)
        assert found.turns is not None
        assert found.turn_slopes is not None
        for row in range(rows):
            sensor, by_tip, by_turn, by_g = (
                np.asarray(part) for part in self._function(values[row, :3], found.turns[row], g)
            )
            values[row, :3] = sensor.ravel()
            slopes[row, :3, :n] = by_tip @ found.slopes[row, :3] + by_turn @ found.turn_slopes[row]
            slopes[row, :3, n:] = by_g
        return Prediction(values, slopes, found.failures)


def _plain(constants: Mapping[str, float]) -> Mapping[str, float]:
    return {name: value for name, value in constants.items() if not name.startswith(PREFIX)}


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
    g = registration.start()
    function = registration.function()
    found = [np.asarray(function(p, R, g)[0]).ravel() for p, R in zip(tips, turns, strict=True)]
    return np.array(found).reshape(-1, 3)


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
        parts = [function(a, b, g) for a, b in zip(p, R, strict=True)]
        places = np.array([np.asarray(part[0]).ravel() for part in parts])
        return (places - q).ravel(), np.concatenate([np.asarray(part[3]) for part in parts])

    done = least_squares(lambda g: at(g)[0], begin.start(), jac=lambda g: at(g)[1], x_scale=begin.scales())
    return begin.found(done.x)
