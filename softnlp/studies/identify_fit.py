"""The least squares of an identification: Gauss-Newton in a trust region, and what is said of its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, MaterialError
from softnlp.base.status import Status
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material
from softnlp.nlp.optimality import OPTIMAL, misfit_slope, not_optimal
from softnlp.studies.fit_statistics import Uncertainty, open_constants, uncertainty
from softnlp.studies.identified import (
    FreeConstants,
    Identified,
    constants_text,
    file_name,
    further_measurements,
    grown_errors,
    unexplained,
    weighted_residuals,
    without_constants,
)
from softnlp.studies.measurements import (
    POSE_COLUMNS,
    Data,
    repeated_numbers,
)
from softnlp.studies.predicted import Predicted, Prediction
from softnlp.studies.registered import Registered
from softnlp.studies.registration import NAMES as REGISTRATION_NAMES

Array = NDArray[np.float64]

_MOST_EVALUATIONS = 200
_MOVED = 1e-4  # relative; constants that move more are followed once more from zero pressure
_TIGHT = 1e-13
_NEARLY = 1e-2  # of a constant or its scale: a rough search that ends nearer to a bound is about to reach it
_AT_BOUND = 1e-6  # of a constant or its scale
_NO_EFFECT = 1e-9  # of a standard deviation: what rounding leaves where a constant over its scale moves nothing
_NOTHING = Uncertainty(np.zeros(0), np.zeros((0, 0)), np.nan, ())
_LOOSE = 1e-4  # residuals of a registration that is a typical size away from where it began
_SMALL = 1e-6  # root mean square of residuals with nothing left in them [sigma]


class Fit:
    """The least-squares problem of an identification."""

    def __init__(
        self,
        data: tuple[Data, ...],
        models: Sequence[Predicted | Registered],
        free: FreeConstants,
        material: Material,
        coefficients: Coefficients,
        progress: Callable[[int, float], None] | None,
    ) -> None:
        self.data = data
        self.models = models
        self.free = free
        self.material = material
        self.keys = [file_name(name, material) for name in free.names]
        self.coefficients = coefficients
        self.progress = progress
        self.evaluations = 0
        self._last: tuple[Array, list[Prediction]] | None = None
        self._cost = np.inf  # half the sum of squares at the end of the last search

    def solve(self) -> Identified:
        """Minimise from the start; then follow every pose again from zero pressure, to be sure of its branch."""
        first = self.predictions(self.free.start, anew=True)
        if (lost := self._lost(first)) is not None:
            return self._unsolved(*lost, first)
        self._require_dependence(first)
        x = self._minimise(self.free.start)
        last = self.predictions(x, anew=True)
        if (lost := self._lost(last)) is not None:
            return self._unsolved(*lost, first)
        again = self._minimise(x)  # on the grids that suit the poses there
        last = self.predictions(
            again, anew=bool(np.any(np.abs(again - x) > _MOVED * np.maximum(np.abs(x), self.free.scale)))
        )
        if (lost := self._lost(last) or self._worse(again, first, last)) is not None:
            return self._unsolved(*lost, first)
        return self._found(again, first, last)

    def _worse(self, x: Array, first: Sequence[Prediction], last: Sequence[Prediction]) -> tuple[Status, str] | None:
        """Say where the end is further from the measurements than the start, which no minimum near the start is."""
        before, after = self.residuals(first), self.residuals(last)
        if after @ after <= before @ before + after.size * _SMALL**2:
            return None
        return Status.DIVERGED, (
            f"the search ended at {constants_text(self.keys, x)}, further from the measurements than its start; "
            "give bounds or another start"
        )

    def predictions(self, x: Array, anew: bool = False) -> list[Prediction]:
        """Return what the model says of every robot; the last result is kept."""
        if not anew and self._last is not None and np.array_equal(self._last[0], x):
            return self._last[1]
        values = self.free.values(x)
        found = [model.evaluate(values, anew) for model in self.models]
        self.evaluations += 1
        self._last = (x.copy(), found)
        if self.progress is not None:
            r = self.residuals(found)
            self.progress(self.evaluations, float(np.sqrt(np.mean(r**2))))
        return found

    def residuals(self, found: Sequence[Prediction]) -> Array:
        """Return the weighted residuals of all numbers measured; nan where a pose was not found."""
        return weighted_residuals(self.data, [prediction.values for prediction in found])

    def jacobian(self, found: Sequence[Prediction]) -> Array:
        """Return the derivative of the weighted residuals by the constants."""
        pairs = [(d, prediction.slopes) for d, prediction in zip(self.data, found, strict=True)]
        return np.concatenate([(J / d.sigma[:, :, None] * d.root_weight[:, None, None])[d.fitted] for d, J in pairs])

    def _minimise(self, start: Array) -> Array:
        """Return the constants at the minimum within the bounds.

        An interior method comes near a bound ever more slowly. So the first search is a rough one; what has then all
        but reached a bound that the sum of squares pushes it against is held there while the others are found.
        """
        free = self.free
        every = np.ones(start.size, bool)
        x = self._search(start, every, 1e-7)
        rough = self._cost
        near = _NEARLY * np.maximum(free.scale, np.abs(x))
        low, high = x - free.lower < near, free.upper - x < near
        bound = np.where(low, free.lower, np.where(high, free.upper, x))
        moving = ~(low | high)
        if np.all(moving) or not np.any(moving):
            return self._search(bound, every, _TIGHT)
        held = self._search(bound, moving, _TIGHT)
        found = self.predictions(held)
        if self._lost(found) is None:
            slope = self.jacobian(found).T @ self.residuals(found)
            if np.all(slope[low] >= 0) and np.all(slope[high] <= 0) and self._cost <= rough:
                return held
        return self._search(x, every, _TIGHT)

    def _search(self, start: Array, moving: NDArray[np.bool_], tolerance: float) -> Array:
        """Return the minimum over the constants that move."""
        from scipy.optimize import least_squares

        scale = self.free.scale
        # What no row tells of a registration stays where it began; what the rows tell is moved by less than 1e-10.
        loose = _LOOSE * np.array([name in REGISTRATION_NAMES for name in self.free.names], float)
        kept = start / scale

        def at(z: Array) -> list[Prediction]:
            x = start.copy()
            x[moving] = z * scale[moving]
            return self.predictions(x)

        done = least_squares(
            lambda z: np.concatenate([self.residuals(at(z)), loose[moving] * (z - kept[moving])]),
            start[moving] / scale[moving],
            jac=lambda z: np.vstack([(self.jacobian(at(z)) * scale)[:, moving], np.diag(loose[moving])]),
            bounds=(self.free.lower[moving] / scale[moving], self.free.upper[moving] / scale[moving]),
            x_scale="jac",
            ftol=tolerance,
            xtol=tolerance,
            gtol=_TIGHT,
            max_nfev=_MOST_EVALUATIONS,
        )
        self._cost = float(done.cost)
        x = start.copy()
        x[moving] = done.x * scale[moving]
        return x

    def _lost(self, found: Sequence[Prediction]) -> tuple[Status, str] | None:
        """Return the status of the first measurement that the model has no pose for."""
        for d, prediction in zip(self.data, found, strict=True):
            for failure in prediction.failures:
                where = f"{d.label}, measurement {failure.row + 1}"
                return failure.status, f"{where}: {failure.message}"
        return None

    def _require_dependence(self, found: Sequence[Prediction]) -> None:
        """Refuse a constant that no measurement depends on."""
        J = np.abs(self.jacobian(found)) * self.free.scale
        for k, name in enumerate(self.free.names):
            if not np.max(J[:, k]) > _NO_EFFECT:
                raise InputError(f"no measurement depends on {name!r}; fix it", key="free")

    def _found(self, x: Array, first: Sequence[Prediction], last: Sequence[Prediction]) -> Identified:
        near = _AT_BOUND * np.maximum(self.free.scale, np.abs(x))
        low, high = x - self.free.lower < near, self.free.upper - x < near
        held = [bool(h) for h in low | high]
        x = np.where(low, self.free.lower, np.where(high, self.free.upper, x))  # not a rounding beside a bound
        J, r = self.jacobian(last), self.residuals(last)
        known = uncertainty(self.free.names, J, r, held, repeated_numbers(self.data), further=further_measurements)
        units = np.array([unit for _, unit in self.keys])
        own = sum(name not in REGISTRATION_NAMES for name in self.free.names)  # a place of 0 is as good as any
        warnings = [
            *known.warnings,
            *open_constants(
                [key for key, _ in self.keys][:own],
                (x / units)[:own],
                (known.standard_errors / units)[:own],
                held[:own],
            ),
            *self._stretched(last),
            *self._impossible(x, last),
        ]
        found = replace(
            self._result(x, first, last),
            at_bound=tuple(name for name, h in zip(self.free.names, held, strict=True) if h),
            uncertainty=known,
            warnings=tuple(warnings),
        )
        if (kkt := misfit_slope(J, r, low, high)) > OPTIMAL:
            words = not_optimal(kkt, f"{self.evaluations} evaluations")
            found = replace(found, status=Status.NOT_OPTIMAL, message=words)
        try:
            material, coefficients = self.free.applied(x, self.material, self.coefficients)
            found = replace(found, material=material, coefficients=coefficients)
        except MaterialError as error:
            words = f"the constants found are no material: {error.message}"
            found = replace(found, status=Status.UNSTABLE_MATERIAL, message=words)
        return replace(found, warnings=(*found.warnings, *unexplained(found), *grown_errors(found)))

    def _stretched(self, found: Sequence[Prediction]) -> list[str]:
        """Say where a free robot is stretched beyond the range in which the material was fitted."""
        low, high = self.material.fitted_stretch
        warnings = []
        for d, prediction in zip(self.data, found, strict=True):
            stretch = 1 + prediction.values[:, POSE_COLUMNS.index("elongation")] / float(d.robot.length)
            row = int(np.argmax(stretch))
            if stretch[row] > high:
                warnings.append(
                    f"{d.label}, measurement {row + 1}: the free robot is stretched to {stretch[row]:.3f}, outside "
                    f"{low:g} to {high:g}, where {self.material.name} was fitted"
                )
        return warnings

    def _impossible(self, x: Array, found: Sequence[Prediction]) -> Iterator[str]:
        """Yield what is to be said of the shape of each free robot that is bent the most."""
        for d, model, prediction in zip(self.data, self.models, found, strict=True):
            row = int(np.argmax(prediction.values[:, POSE_COLUMNS.index("bending_angle")]))
            if (fit := model.fit(self.free.values(x), row)) is not None:
                yield from (f"{d.label}, measurement {row + 1}: {words}" for words in fit.warnings)

    def _unsolved(self, status: Status, message: str, first: Sequence[Prediction]) -> Identified:
        return without_constants(self._result(self.free.start, first, first), status, message)

    def _result(self, x: Array, first: Sequence[Prediction], last: Sequence[Prediction]) -> Identified:
        """Return constants with the model at the start and at the end, before anything is said of them."""
        before, after = (
            tuple(np.where(d.measured, p.values, np.nan) for p, d in zip(every, self.data, strict=True))
            for every in (first, last)
        )
        return Identified(
            status=Status.SOLVED,
            message="the sum of squares is at a minimum",
            free=self.free,
            constants=x,
            at_bound=(),
            uncertainty=_NOTHING,
            material=self.material,
            coefficients=self.coefficients,
            data=self.data,
            before=before,
            after=after,
            evaluations=self.evaluations,
            warnings=(),
        )
