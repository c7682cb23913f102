"""Predictions of tips where the sensor is, and the numbers of a registration among the constants that are fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.model.rod import Loads
from softnlp.statics.body import Fit
from softnlp.studies.identified import FreeConstants
from softnlp.studies.measurements import (
    ORIENTATION_NOISE,
    RELATIVE_NOISE,
    Data,
    Observed,
    column_slice,
)
from softnlp.studies.predicted import Predicted, Prediction
from softnlp.studies.registration import PREFIX, Registration, across

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

    def __init__(self, model: Predicted, registration: Registration, data: Data, clocked: bool = False) -> None:
        self._model = model
        self._data = data
        self._clocked = clocked
        self._orientation = registration.orientation()
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
        if np.any(at := np.isfinite(self._data.whole)):
            turn, by_turn, by_g = (
                np.asarray(part).reshape(3, int(np.sum(at)), -1).transpose(1, 0, 2)
                for part in self._orientation(found.turns[at].T, self._data.axes[at].T, self._data.whole[None, at], g)
            )
            where = column_slice("orientation")
            values[at, where] = turn[:, :, 0]
            slopes[at, where] = by_turn @ turned[at]
            slopes[at, where, slopes.shape[2] - g.size :] += by_g
        return Prediction(values, slopes, found.failures)

    def _widened(self, slopes: Array, count: int) -> Array:
        """Return slopes of the model (rows, m, constants) with those by the registration behind them."""
        own = slopes.shape[2] - self._clocked
        wide = np.concatenate([slopes[:, :, :own], np.zeros((*slopes.shape[:2], count))], axis=2)
        if self._clocked:
            wide[:, :, own + self._registration.names.index("clock")] = slopes[:, :, own]
        return wide


def checked_registration(
    given: Registration | None, data: Sequence[Data], loads: Loads
) -> tuple[Registration | None, bool]:
    """Return the registration that a fit needs, None for none, and whether its clock turns the loads.

    loads : in the frame of the base. Raises `InputError` for what is not offered together.
    """
    whole = np.concatenate([d.whole for d in data])
    if given is None or not given.acts:  # orientations are those of a sensor
        return Registration() if np.any(np.isfinite(whole)) else None, False
    if "tip_sensor" in given.fit and not np.any(whole == 1):
        raise InputError("expected quaternions of the sensor to fit its axes to", key="registration.tip_sensor")
    clocked = "clock" in given.fit and across(loads)
    if clocked and any(np.any(d.measured[:, -1]) for d in data):
        text = "a clock is not fitted to blocked forces under loads across the axis; give it"
        raise InputError(text, key="registration.clock")
    return given, clocked


def begun(registration: Registration, data: Sequence[Data], poses: Sequence[tuple[Array, Array]]) -> Registration:
    """Return a registration whose frame begins where the model's tips lie best on those measured (Kabsch 1976).

    poses : tips of the model, for each robot (rows, 3) [m], and their rotations by columns (rows, 9). The axes of a
    sensor begin at the mean of what the frame leaves of the orientations.
    """
    p, turns = (np.concatenate(part) for part in zip(*poses, strict=True))
    seen, axes, whole = (
        np.concatenate(part)
        for part in ([d.values[:, :3] for d in data], [d.axes for d in data], [d.whole for d in data])
    )
    return _laid(registration, p, turns, seen, axes, whole)


def _laid(registration: Registration, p: Array, turns: Array, q: Array, axes: Array, whole: Array) -> Registration:
    """Return a registration whose frame, if it is fitted, lays places p on q (rows, 3) [m], then the sensor's axes."""
    known = np.isfinite(np.column_stack([p, q])).all(axis=1)
    if "frame" in registration.fit and np.sum(known) >= 3:
        a, b = p[known], q[known]
        R = _nearest((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
        registration = replace(registration, rotation=R, translation=b.mean(axis=0) - R @ a.mean(axis=0))
    known = (whole == 1) & np.isfinite(turns).all(axis=1)
    if "tip_sensor" in registration.fit and np.any(known):
        T, M = (_matrices(part[known]) for part in (turns, axes))
        base = registration.in_base(np.asarray(registration.translation) + np.eye(3)).T  # (R Rz)^T
        registration = replace(registration, tip_sensor=_nearest(np.mean(T.transpose(0, 2, 1) @ base @ M, axis=0)))
    return registration


def _nearest(H: Array) -> Array:
    """Return the rotation nearest to a matrix (3, 3)."""
    U, _, Vt = np.linalg.svd(H)
    return np.asarray(U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt)


def _matrices(columns: Array) -> Array:
    """Return rotations (rows, 3, 3) of those by columns (rows, 9)."""
    return np.asarray(columns.reshape(-1, 3, 3).transpose(0, 2, 1))


def sensor_places(registration: Registration, tips: Array, turns: Array) -> Array:
    """Return where the sensor is (rows, 3) [m], of tips (rows, 3) [m] and their rotations by columns (rows, 9)."""
    return np.asarray(registration.function()(tips.T, turns.T, registration.start())[0]).T


def sensor_turns(registration: Registration, turns: Array, o: Observed) -> Array:
    """Return the turns (rows, 3) [rad] from the orientations measured, of rotations of tips by columns (rows, 9)."""
    found = registration.orientation()(turns.T, o.axes.T, np.nan_to_num(o.whole)[None], registration.start())[0]
    return np.where(np.isfinite(o.whole)[:, None], np.asarray(found).T, np.nan)


def fitted(registration: Registration, tips: Array, turns: Array, o: Observed) -> Registration:
    """Return a registration with what it fits at the least squares of places and orientations of the sensor.

    tips, turns : of the model (rows, 3) [m], rotations by columns (rows, 9). A degree counts as one percent of length.
    """
    from scipy.optimize import least_squares

    measured = o.values[:, :3]
    known = np.isfinite(np.column_stack([tips, turns, measured])).all(axis=1)
    also = np.isfinite(o.whole) & np.isfinite(turns).all(axis=1)
    count = len(registration.names)
    if not count or 3 * np.sum(known) + 2 * np.sum(also) < count:
        return registration.found(registration.start())
    begin = _laid(registration, tips, turns, measured, o.axes, o.whole)
    function, orientation = begin.function(), begin.orientation()
    arm = RELATIVE_NOISE * float(o.robot.length) / ORIENTATION_NOISE

    def at(g: Array) -> tuple[Array, Array]:
        places, _, _, slopes = (np.asarray(part) for part in function(tips[known].T, turns[known].T, g))
        r, J = [(places.T - measured[known]).ravel()], [_by_row(slopes, int(np.sum(known)), count)]
        if np.any(also):
            turn, _, slopes = (
                np.asarray(part) for part in orientation(turns[also].T, o.axes[also].T, o.whole[None, also], g)
            )
            r, J = [*r, arm * turn.T.ravel()], [*J, arm * _by_row(slopes, int(np.sum(also)), count)]
        return np.concatenate(r), np.concatenate(J)

    done = least_squares(lambda g: at(g)[0], begin.start(), jac=lambda g: at(g)[1], x_scale=begin.scales())
    return begin.found(done.x)


def _by_row(slopes: Array, rows: int, count: int) -> Array:
    """Return slopes (3 rows, numbers) of the blocks (3, numbers) that a mapped function returns side by side."""
    return slopes.reshape(3, rows, count).transpose(1, 0, 2).reshape(-1, count)
