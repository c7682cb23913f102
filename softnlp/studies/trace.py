"""A tip over time as it was measured, how far a simulated one is from it, and the first harmonic of both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.dynamics.simulation import Simulation

Array = NDArray[np.float64]

FEWEST = 8  # rows with a tip, which a harmonic and its trend leave something of
_TRIED = 2000  # frequencies that a first harmonic is looked for at, about
_LEAST = 1e-9  # of a movement [m]


@dataclass(frozen=True, eq=False)
class Trace:
    """A tip over time.

    Attributes
    ----------
    times
        (rows,) rising [s].
    tip
        (rows, 3) positions, world frame, nan where one was not seen [m].
    """

    times: Array
    tip: Array

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(rows, 3) what was seen."""
        return np.isfinite(self.tip)


@dataclass(frozen=True, eq=False)
class Harmonic:
    """The motion at one frequency along one axis, beside a mean and a drift.

    Attributes
    ----------
    frequency
        [Hz].
    axis
        0, 1 or 2 of x, y, z.
    measured, simulated
        Amplitude times exp(i phase), of a cosine [m].
    """

    frequency: float
    axis: int
    measured: complex
    simulated: complex

    @property
    def phase(self) -> float:
        """By which the simulated one is ahead, from -pi to pi [rad]."""
        return float(np.angle(self.simulated * np.conj(self.measured)))


@dataclass(frozen=True, eq=False)
class TraceErrors:
    """How far a simulated tip is from a measured one.

    Attributes
    ----------
    distance
        (rows,) of what was seen, nan where nothing was [m].
    axes
        (3,) root mean square along each axis, nan of one that was not seen [m].
    movement
        Root mean square of the measured tip about its mean [m].
    harmonic
        The first one, None where the tip hardly moves or too little was seen.
    """

    distance: Array
    axes: Array
    movement: float
    harmonic: Harmonic | None

    @property
    def rmse(self) -> float:
        """Root mean square of the distances [m]."""
        return float(np.sqrt(np.nanmean(self.distance**2)))

    @property
    def largest(self) -> float:
        """The largest distance [m]."""
        return float(np.nanmax(self.distance))


def checked_trace(times: Any, tip: Any) -> Trace:
    """Return a trace, or raise `InputError` for times that do not rise, and for too few tips."""
    t, p = np.asarray(times, float), np.asarray(tip, float)
    if t.ndim != 1 or p.shape != (t.size, 3):
        raise InputError(f"expected (rows,) times and (rows, 3) tips, got {t.shape} and {p.shape}", key="trace")
    if not np.all(np.isfinite(t)) or np.any(t < 0) or np.any(np.diff(t) <= 0):
        raise InputError("expected finite times from 0 on, each above the one before", key="trace")
    if np.isfinite(p).any(axis=1).sum() < FEWEST or not t[-1] > 0:
        raise InputError(f"expected at least {FEWEST} rows with a tip", key="trace")
    return Trace(t, p)


def times_of(trace: Trace) -> Array:
    """Return the times of a trace from 0 on, which a simulation keeps."""
    return trace.times if trace.times[0] == 0 else np.append(0.0, trace.times)


def simulated_tips(simulation: Simulation, rows: int) -> Array:
    """Return the tips (rows, 3) of the last outputs of a simulation that keeps `times_of` a trace.

    Raises `Failed` where it cannot be followed to the last of them.
    """
    return np.array([output.instant.at.position[-1] for output in simulation.run()])[-rows:]


def trace_errors(trace: Trace, simulated: Array) -> TraceErrors:
    """Return how far simulated tips (rows, 3) are from a trace."""
    off = np.where(trace.seen, simulated - trace.tip, np.nan)
    any_seen = trace.seen.any(axis=1)
    distance = np.where(any_seen, np.sqrt(np.nansum(off**2, axis=1)), np.nan)
    columns = trace.seen.any(axis=0)
    axes = np.full(3, np.nan)
    axes[columns] = np.sqrt(np.nanmean(off[:, columns] ** 2, axis=0))
    moved = trace.tip[:, columns] - np.nanmean(trace.tip[:, columns], axis=0)
    movement = float(np.sqrt(np.nansum(moved**2) / any_seen.sum()))
    return TraceErrors(distance, axes, movement, _first_harmonic(trace, simulated))


def _first_harmonic(trace: Trace, simulated: Array) -> Harmonic | None:
    """Return the harmonic that most of the measured motion along its largest axis is of."""
    from scipy.optimize import minimize_scalar

    counts = trace.seen.sum(axis=0)
    spread = [float(np.nanstd(trace.tip[:, k])) if counts[k] >= FEWEST else 0.0 for k in range(3)]
    axis = int(np.argmax(spread))
    rows = trace.seen[:, axis]
    if spread[axis] < _LEAST:
        return None
    t, x = trace.times[rows], trace.tip[rows, axis]
    whole, apart = float(t[-1] - t[0]), float(np.median(np.diff(t)))
    low, high = 1 / whole, 0.5 / apart
    if not high > low:
        return None

    def left(frequency: float) -> float:
        off = x - _columns(t, frequency) @ np.linalg.lstsq(_columns(t, frequency), x, rcond=None)[0]
        return float(off @ off)

    tried = np.linspace(low, high, min(int(4 * whole * (high - low)) + 2, _TRIED))
    best = int(np.argmin([left(f) for f in tried]))
    ends = tried[max(best - 1, 0)], tried[min(best + 1, tried.size - 1)]
    frequency = float(minimize_scalar(left, bounds=ends, method="bounded", options={"xatol": 1e-6 * high}).x)
    both = np.linalg.lstsq(_columns(t, frequency), np.column_stack([x, simulated[rows, axis]]), rcond=None)[0]
    measured, model = (complex(c, -s) for c, s in zip(both[0], both[1], strict=True))
    return Harmonic(frequency, axis, measured, model)


def _columns(t: Array, frequency: float) -> Array:
    """Return a cosine, a sine, a mean and a drift at some times (rows, 4)."""
    angle, middle = 2 * np.pi * frequency * t, (t - t.mean()) / np.ptp(t)
    return np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(t), middle])
