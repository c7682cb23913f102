"""Damping, lag and a factor of the modulus from a tip over time, as a least-squares problem on these alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.base.ranges import FORCE
from softnlp.base.status import Status
from softnlp.dynamics.drive import Series
from softnlp.dynamics.sections import Failed
from softnlp.dynamics.simulation import Dynamics
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.studies.check import Check, messages
from softnlp.studies.dynamic import sentence, series_of
from softnlp.studies.fit_statistics import Uncertainty, constant_note, determined, open_constants, uncertainty
from softnlp.studies.forward import checked_loads, pressure_table
from softnlp.studies.free_motion import Motion
from softnlp.studies.trace import Trace, TraceErrors, checked_trace, trace_errors

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Free:
    """A number that may be freed. typical : where it starts if nothing is said, and its size. unit : in files."""

    typical: float
    lower: float
    upper: float
    unit: str


FREE: Mapping[str, Free] = {
    "damping_s": Free(0.004, 0.0, 1.0, "s"),
    "lag_s": Free(0.02, 0.0, 10.0, "s"),
    "modulus_factor": Free(1.0, 0.05, 20.0, ""),
}
"""By the key that a scenario has for it."""

_STEPS = 100  # to a period of the first mode, where no step is asked for
_DIFFERENCE = 1e-4  # of a number, for a difference quotient
_AT_BOUND = 1e-6
_MOST = 40  # evaluations of a search, without those of its slopes
_COARSE, _SMALL = 0.1, 1e-3  # of what is left, and of the movement: errors in time beyond both are told of
_SAMPLES: tuple[tuple[float, float], tuple[float, float]] = (8.0, np.inf), (2.0, np.inf)
_RATIO: tuple[tuple[float, float], tuple[float, float]] = (0.0, 0.5), (0.0, 2.0)
_LAG: tuple[tuple[float, float], tuple[float, float]] = (0.0, 1.0), (0.0, 5.0)
_FACTOR: tuple[tuple[float, float], tuple[float, float]] = (0.4, 2.5), (0.2, 5.0)
_LEFT: tuple[tuple[float, float], tuple[float, float]] = (0.0, 0.3), (0.0, 0.7)


@dataclass(frozen=True, eq=False)
class MotionFit:
    """What a trace tells of a robot.

    Attributes
    ----------
    status, message
        "solved", or why the motion could not be followed.
    names
        What was free, of "damping_s", "lag_s" and "modulus_factor".
    start, lower, upper, values
        (n,) in the order of the names, nan where nothing was found [s or 1].
    uncertainty
        Of the values.
    at_bound
        Names of those at a bound.
    trace
        As it was measured.
    before, after
        (rows, 3) simulated tips at the start and with the values found, nan where there are none [m].
    errors_before, errors_after
        How far they are from the trace, None where there are none.
    asked
        The motion with the values found, and with the step of time that was taken.
    material, coefficients
        With the factor found.
    evaluations
        How often the motion was simulated.
    checks
        Whether the values, the samples and what is left can be.
    warnings
        What the trace leaves open.
    """

    status: Status
    message: str
    names: tuple[str, ...]
    start: Array
    lower: Array
    upper: Array
    values: Array
    uncertainty: Uncertainty
    at_bound: tuple[str, ...]
    trace: Trace
    before: Array
    after: Array
    errors_before: TraceErrors | None
    errors_after: TraceErrors | None
    asked: Dynamics
    material: Material
    coefficients: Coefficients
    evaluations: int
    checks: tuple[Check, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def problems(self) -> tuple[str, ...]:
        """What cannot be true of what was found."""
        return messages(self.checks, "failed")

    @property
    def determined(self) -> dict[str, bool | None]:
        """By name: whether a standard error is within the value, None where there is none."""
        triples = zip(self.names, self.values, self.uncertainty.standard_errors, strict=True)
        return {name: determined(value, error) for name, value, error in triples}

    @property
    def notes(self) -> dict[str, str]:
        """By name: whether a value is at its bound or not determined, else ""."""
        return {name: constant_note(known, name in self.at_bound) for name, known in self.determined.items()}


def identify_motion(
    robot: Robot,
    material: Material,
    pressures: Any,
    asked: Dynamics,
    trace: Trace,
    free: Sequence[str],
    *,
    times: Any = None,
    forces: Any = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    progress: Callable[[int, float], None] | None = None,
) -> MotionFit:
    """Find damping, lag and a factor of the modulus that bring the motion nearest to a trace of the tip.

    Parameters
    ----------
    robot, material, pressures, times, forces
        As `softnlp.dynamic`.
    asked
        As `softnlp.dynamic`; its damping and lag are the start, and what is not free. Its duration is that of the
        trace, its step that of every simulation: a hundredth of the first mode's period where none is said.
    trace
        What was measured, on the clock of the pressures.
    free
        Of "damping_s", "lag_s" and "modulus_factor", a factor of the silicone's stress.
    bounds
        (2,) lower and upper by name, in place of the default ones [s or 1].
    loads, coefficients, conventions, numerics
        As `softnlp.dynamic`; the search is made by Newton's method alone but with the engine "ipopt", and the motion
        found is simulated by the engine.
    progress
        Called with the number of simulations and the root mean square of the residuals [m].

    Returns
    -------
    MotionFit
        With standard errors.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For what does not fit.
    """
    trace = checked_trace(trace.times, trace.tip)
    P = pressure_table(pressures, robot.chamber_sets)
    loads = checked_loads(loads)
    t, F = series_of(times, forces, len(P))
    FORCE.require(np.abs(F), "forces")
    start, lower, upper = _begun(free, bounds or {}, asked, coefficients if conventions.energy else None)
    asked = replace(asked, duration=float(trace.times[-1]))
    motion = Motion(
        robot, material, coefficients, conventions, loads, asked, Series(t, P), Series(t, F), numerics, tuple(free)
    )
    return _Fit(motion, trace, start, lower, upper, progress).solved()


def _begun(
    free: Sequence[str], bounds: Mapping[str, tuple[float, float]], asked: Dynamics, given: Coefficients | None
) -> tuple[Array, Array, Array]:
    """Return start and bounds (n,) of what is free, or raise `InputError`."""
    if not free:
        raise InputError(f"expected at least one of {', '.join(FREE)}", key="free")
    for k, name in enumerate(free):
        if name not in FREE:
            raise InputError(
                f"unknown number {name!r}{nearest(str(name), FREE)}; with [dynamic] free are {', '.join(FREE)}",
                key="free",
            )
        if name in free[:k]:
            raise InputError(f"expected each number once, got {name!r} twice", key="free")
    for name, pair in bounds.items():
        if name not in free:
            raise InputError(f"expected a number that is free{nearest(str(name), free)}", key=f"bounds.{name}")
        if len(pair) != 2 or not FREE[name].lower <= pair[0] < pair[1]:
            raise InputError(
                f"expected a lower bound from {FREE[name].lower:g} and an upper one above, got {list(pair)}",
                key=f"bounds.{name}",
            )
    own = {"damping_s": asked.damping, "lag_s": asked.lag}
    own["modulus_factor"] = 1.0 if given is None else float(given.modulus_factor)
    lower, upper = np.array([bounds.get(name, (FREE[name].lower, FREE[name].upper)) for name in free], float).T
    start = np.array([own[name] or FREE[name].typical for name in free])
    return np.clip(start, lower, upper), lower, upper


class _Fit:
    """The least-squares problem."""

    def __init__(
        self,
        motion: Motion,
        trace: Trace,
        start: Array,
        lower: Array,
        upper: Array,
        progress: Callable[[int, float], None] | None,
    ) -> None:
        self.motion, self.trace, self.progress = motion, trace, progress
        self.start, self.lower, self.upper = start, lower, upper
        self.scale = np.maximum(start, [FREE[name].typical for name in motion.names])
        self._seen = trace.seen.T
        self._known: dict[bytes, Array] = {}
        self._worst = np.inf

    def tips(self, x: Array) -> Array:
        """Return the tips (rows, 3), kept. Raises `Failed`."""
        key = x.tobytes()
        if key not in self._known:
            self._known[key] = self.motion.tips(x, self.trace)
            if self.progress is not None:
                r = self.residuals(self._known[key])
                self.progress(self.motion.evaluations, float(np.sqrt(np.mean(r**2))))
        return self._known[key]

    def residuals(self, tips: Array) -> Array:
        """Return what is left (m,), one axis after the other, so that neighbours follow one another in time [m]."""
        found: Array = (tips - self.trace.tip).T[self._seen]
        return found

    def slope(self, x: Array) -> Array:
        """Return the derivative of the residuals (m, n) by difference quotients. Raises `Failed`."""
        base, columns = self.residuals(self.tips(x)), []
        for k in range(x.size):
            step = _DIFFERENCE * self.scale[k]
            to = x.copy()
            to[k] += step if x[k] + step <= self.upper[k] else -step
            columns.append((self.residuals(self.tips(to)) - base) / (to[k] - x[k]))
        return np.column_stack(columns)

    def solved(self) -> MotionFit:
        """Minimise from the start."""
        from scipy.optimize import least_squares

        motion, scale = self.motion, self.scale
        motion.step = motion.asked.step or 1.0
        try:
            if motion.asked.step is None:
                motion.step = self._step()
            before = self.tips(self.start)
        except Failed as failure:
            return self._result(failure.status, sentence(failure))
        largest = float(np.max(np.abs(self.residuals(before))))

        def left(z: Array) -> Array:
            try:
                return self.residuals(self.tips(z * scale))
            except Failed:  # so far away that the search turns back
                return np.full(int(self._seen.sum()), 10 * largest)

        try:
            done = least_squares(
                left, self.start / scale, jac=lambda z: self.slope(z * scale) * scale,
                bounds=(self.lower / scale, self.upper / scale), ftol=1e-9, xtol=1e-7, gtol=1e-12, max_nfev=_MOST,
            )  # fmt: skip
            x = np.where(done.x * scale - self.lower < _AT_BOUND * scale, self.lower, done.x * scale)
            x = np.where(self.upper - x < _AT_BOUND * scale, self.upper, x)
            engine = motion.numerics
            after = motion.tips(x, self.trace, engine) if engine.engine == "auto" else self.tips(x)
            return self._found(x, before, after)
        except Failed as failure:
            return self._result(failure.status, sentence(failure), before)

    def _step(self) -> float:
        """Return a step of time: so many to a period of the first mode."""
        found = self.motion.modes(self.start)
        first = next((mode.frequency for mode in found.modes if mode.frequency > 0), 0.0) if found is not None else 0.0
        duration = float(self.trace.times[-1])
        return min(1 / (_STEPS * first), duration / _STEPS) if first else duration / (10 * _STEPS)

    def _result(self, status: Status, message: str, before: Array | None = None) -> MotionFit:
        """Return an end without values."""
        n, motion = self.start.size, self.motion
        nothing, tips = np.full(n, np.nan), np.full_like(self.trace.tip, np.nan)
        return MotionFit(
            status, message, motion.names, self.start, self.lower, self.upper, nothing,
            Uncertainty(nothing, np.full((n, n), np.nan), np.nan, ()), (), self.trace,
            tips if before is None else before, tips,
            None if before is None else trace_errors(self.trace, before), None,
            motion.asked, motion.material, motion.coefficients, motion.evaluations,
        )  # fmt: skip

    def _found(self, x: Array, before: Array, after: Array) -> MotionFit:
        motion, names = self.motion, self.motion.names
        held = [bool(value) for value in (x == self.lower) | (x == self.upper)]
        J, r = self.slope(x), self.residuals(after)
        for k, name in enumerate(names):
            if not np.max(np.abs(J[:, k])) > 0:
                raise InputError(f"the trace does not depend on {name!r}; fix it", key="free")
        known = uncertainty(names, J, r, held, serial=True, further=lambda _: "a trace of another kind of motion")
        errors = trace_errors(self.trace, after)
        asked, material, coefficients = motion.with_values(x)
        warnings = [*known.warnings, *open_constants(names, x, known.standard_errors, held)]
        motion.step /= 2
        finer = self.residuals(motion.tips(x, self.trace)) - r
        motion.step *= 2
        share = np.linalg.norm(finer) / np.linalg.norm(r)
        if share > _COARSE and np.linalg.norm(finer) > _SMALL * errors.movement * np.sqrt(r.size):
            words = f"half the step of time changes the trace by {100 * share:.2g} % of what is left: shorten step_s"
            warnings.append(words)
        return MotionFit(
            Status.SOLVED, "the sum of squares is at a minimum", names, self.start, self.lower, self.upper, x, known,
            tuple(name for name, at in zip(names, held, strict=True) if at), self.trace, before, after,
            trace_errors(self.trace, before), errors, asked, material, coefficients, motion.evaluations,
            tuple(self._checks(x, held, errors)), tuple(warnings),
        )  # fmt: skip

    def _checks(self, x: Array, held: Sequence[bool], errors: TraceErrors) -> list[Check]:
        found = dict(zip(self.motion.names, x.tolist(), strict=True))
        out = ", ".join(name for name, at in zip(self.motion.names, held, strict=True) if at)
        likely = f"{out}: the model leaves its range to follow this trace; check clock, units, sets, or the bounds"
        checks = [Check("number of values at a bound", sum(held), (0, 0), (0, 0), likely)]
        modes = self.motion.modes(x)
        swings = [mode for mode in modes.modes if mode.frequency > 0] if modes is not None else []
        if swings:
            first = swings[0]
            apart = float(np.median(np.diff(self.trace.times)))
            samples = 1 / (first.frequency * apart)
            words = "too few frames to see the swing: film faster, or the time is not in seconds"
            checks.append(Check("rows to a period of the first mode", samples, *_SAMPLES, words))
            words = "looks like creep, or a trace that is much slower than the robot: check the time's unit"
            checks.append(Check("damping ratio of the first mode", first.damping_ratio, *_RATIO, words))
        if "lag_s" in found:
            words = "looks like a clock that began at another time than that of the pressures, or a time in ms"
            checks.append(Check("lag of the pressure", found["lag_s"], *_LAG, words, "s"))
        if "modulus_factor" in found:
            words = "no batch of a silicone is so far from another: check the unit of pressures and tips, and the time"
            checks.append(Check("factor of the modulus", found["modulus_factor"], *_FACTOR, words))
        if errors.movement > 0:
            words = "the model does not follow this trace: check its frame and unit, the clock, the sets and the robot"
            checks.append(Check("what is left of the movement", errors.rmse / errors.movement, *_LEFT, words))
        return checks
