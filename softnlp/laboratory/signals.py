"""Signals of any kind: the break of a specimen, static plateaus, and the lag between two clocks."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_BROKEN = 0.5  # of the largest stress: what is left of it after a break
_HELD, _RELAXED = 2e-3, 0.02  # of the range of the stretch, and of the largest stress
_TRIED_ON = 4000  # samples on which a lag is looked for first
_CHANGED = 0.05  # of the range: a step between two plateaus
_NOISE = 6.0  # standard deviations of the change between samples


def break_row(stress: Array) -> int:
    """Return the row of the largest stress where the specimen then broke, else how many rows there are."""
    top = int(np.argmax(stress))
    after = stress[top:]
    if stress[top] > 0 and len(after) > 1 and np.median(after[-max(1, len(after) // 10) :]) < _BROKEN * stress[top]:
        falls = np.flatnonzero(after < _BROKEN * stress[top])
        # a fall at once is a break; one as slow as the rise is an unloading
        if falls[0] <= max(5, 0.05 * top):
            return top
    return len(stress)


def relaxing(stretch: Array, stress: Array) -> int:
    """Return over how many rows a stress falls while the stretch is held: that relaxes and follows no elastic law."""
    held = _HELD * float(np.ptp(stretch))
    fall = _RELAXED * float(np.max(np.abs(stress)))
    count = first = 0
    while first < len(stretch):
        away = np.flatnonzero(np.abs(stretch[first:] - stretch[first]) > held)
        end = first + int(away[0]) if away.size else len(stretch)
        third = (end - first) // 3
        if third > 1 and np.median(stress[first : first + third]) - np.median(stress[end - third : end]) > fall:
            count += end - first
        first = end
    return count


def enclosed_area(x: Array, y: Array) -> float:
    """Return the work along a curve, by trapezia."""
    return float(np.sum(np.diff(x) * (y[1:] + y[:-1]) / 2))


def noise(signal: Array) -> float:
    """Return the standard deviation of a signal (samples,) about its steps."""
    changes = np.abs(np.diff(signal))
    return float(1.4826 * np.median(changes) / np.sqrt(2)) if changes.size else 0.0


def plateaus(signals: Array, shortest: int = 3) -> Iterator[Rows]:
    """Yield the rows of each stretch over which signals (samples, channels) stand still.

    A sample belongs to the one before unless a channel changes by six times its noise, and by a hundredth of its range;
    the first and the last tenth of a plateau, which may move, are left out.
    """
    if len(signals) < shortest:
        return
    limit = np.array([max(_NOISE * np.sqrt(2) * noise(c), 0.02 * float(np.ptp(c)), 1e-12) for c in signals.T])
    moved = np.any(np.abs(np.diff(signals, axis=0)) > limit, axis=1)
    edges = np.concatenate([[0], np.flatnonzero(moved) + 1, [len(signals)]])
    for first, end in pairwise(edges):
        if end - first < shortest:
            continue
        third = max(1, (end - first) // 3)
        drift = np.abs(signals[first : first + third].mean(axis=0) - signals[end - third : end].mean(axis=0))
        if np.all(drift <= limit):
            cut = (end - first) // 10
            yield np.arange(first + cut, end - cut)


class Commands:
    """The commands of a log: time (m,) [s], columns (sets, m), and between which samples they step."""

    def __init__(self, time: Array, command: Array) -> None:
        self.time = time
        self.columns = np.ascontiguousarray(command.T)  # sums along a set are ten times as fast as across
        limits = np.array([max(_NOISE * np.sqrt(2) * noise(c), 0.02 * float(np.ptp(c))) for c in self.columns])
        steps = np.any(np.abs(np.diff(self.columns, axis=1)) > limits[:, None], axis=0)
        self.steps: NDArray[np.bool_] = steps & bool(np.mean(steps) <= 0.5)  # none of one that moves all the time
        self.stepping = bool(np.any(self.steps))
        self.counted = np.cumsum(self.steps)
        holds = np.diff(time[1:][self.steps])
        usual = 3 * float(np.median(np.diff(time)))
        self.hold = float(np.median(holds[holds > usual])) if np.any(holds > usual) else np.inf
        self.least = 0.02 * max(float(np.max(np.ptp(self.columns, axis=1))), 1e-30)


def lag_between(time: Array, response: Array, command_time: Array, command: Array) -> tuple[float, float, float]:
    """Return how much later the clock of a command reads than that of a response [s], its uncertainty, and R^2.

    time : (n,). response : (n, channels) of one unit. command_time : (m,). command : (m, sets). The lag is the shift at
    which the commands, as a linear map, explain the most of the response; the two share half of the shorter record.
    """
    half = min(np.ptp(time), np.ptp(command_time)) / 2
    low, high = command_time[0] - time[-1] + half, command_time[-1] - time[0] - half
    sampled = min(float(np.median(np.diff(time))), float(np.median(np.diff(command_time)))) / 2
    some, few = (slice(None, None, 1 + len(time) // most) for most in (_TRIED_ON, 10 * _TRIED_ON))
    thin = slice(None, None, 1 + len(command) // (10 * _TRIED_ON))
    commands = Commands(command_time[thin], command[thin])
    # of a long record as finely as its plateaus need, and then around the best
    step = max(sampled, (high - low) / 10_000, min((high - low) / 2000, commands.hold / 3))
    tried = np.arange(low, high + step, step)
    quality = np.array([explained(time[some], response[some], commands, lag) for lag in tried])
    best = tried[int(np.argmax(quality))]
    while True:
        fine = best + np.linspace(-2, 2, 41) * step
        sharp = np.array([explained(time[few], response[few], commands, lag) for lag in fine])
        good = fine[sharp >= sharp.max() - 1e-9 - 0.02 * (1 - sharp.min())]
        if step <= 2 * sampled or np.ptp(good) > step:
            break
        best, step = float(np.mean(good)), step / 10
    between = sum(float(np.median(np.diff(clock))) for clock in (time[few], commands.time))
    error = max(np.ptp(good), step, between) / 2
    return float(np.mean(good)), float(error), float(sharp.max())


def explained(time: Array, response: Array, commands: Commands, lag: float) -> float:
    """Return the part of a response that commands explain as a linear map, but for samples at which they step.

    It is R^2 adjusted for how many levels the commands hold (Theil 1961): four levels of three sets explain anything. 0
    where the two share less than half of the shorter record. lag : how much later the clock of the commands reads [s].
    """
    time, known = time + lag, commands.time
    shared = min(time[-1], known[-1]) - max(time[0], known[0])
    if shared < 0.49 * min(np.ptp(time), np.ptp(known)):
        return 0.0
    at = np.clip(np.searchsorted(known, time, side="right") - 1, 0, len(commands.steps) - 1)
    inside = (time >= known[0]) & (time <= known[-1]) & ~commands.steps[at]
    if np.sum(inside) < 10:
        return 0.0
    P = np.array([np.interp(time[inside], known, column) for column in commands.columns])
    P = P[np.ptp(P, axis=1) > commands.least]
    levels = 1 + int(np.sum(np.diff(commands.counted[at[inside]]) > 0)) if commands.stepping else P.shape[1]
    free = levels - 1 - len(P)
    y = response[inside].T
    y = y - y.mean(axis=1, keepdims=True)
    total = float(np.sum(y**2))
    if free < 1 or not len(P) or not total > 0:
        return 0.0
    A = np.vstack([np.ones(P.shape[1]), P / np.ptp(P, axis=1, keepdims=True)])  # with squares another lag fits as well
    left = y - np.linalg.lstsq(A @ A.T, A @ y.T, rcond=None)[0].T @ A  # of numbers near 1: faster, and exact enough
    return float(max(0.0, 1 - np.sum(left**2) / total * (levels - 1) / free))


def changes(time: Array, signals: Array) -> Array:
    """Return from when to when (changes, 2) signals go from one plateau to another, a twentieth of the range away."""
    still = list(plateaus(signals))
    levels = [np.median(signals[rows], axis=0) for rows in still]
    size = np.maximum(np.ptp(signals, axis=0), 1e-30)
    found = [
        (time[a[-1]], time[b[0]])
        for (a, before), (b, after) in pairwise(zip(still, levels, strict=True))
        if np.max(np.abs(after - before) / size) > _CHANGED
    ]
    return np.array(found).reshape(-1, 2)
