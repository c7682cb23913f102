"""Where the nodes of a solution among obstacles are: one is put where a contact touches at one point."""

from __future__ import annotations

from functools import lru_cache
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import STATE_SIZE
from softnlp.statics.obstacle_grid import ObstacleGrid, Touched
from softnlp.statics.pose import Mapped

Array = NDArray[np.float64]

_SHORT = 0.15  # of the length: up to which all of a piece that touches counts
_DEEP = 1e-4  # of L_0: overlap between nodes from which some are put there
_SAMPLES = 8  # of each interval, where gaps are looked at between nodes


def between(shape: Mapped, found: Touched, s: Array) -> Array:
    """Return states, strains and the paper's n, m (30, M) at points s in 0..1, behind what pushes at a node."""
    left = np.clip(np.searchsorted(found.s, s + 1e-12, side="right") - 1, 0, found.s.size - 1)
    return np.asarray(shape.map(s.size)(found.behind[:, left], found.constants, (s - found.s[left])[None, :]))


@lru_cache(maxsize=4)
def gaps_between(shape: Mapped, found: Touched) -> tuple[Array, Array]:
    """Return points along the rod (M,), nodes among them but not the base, and the gap of each obstacle there."""
    K = found.s.size - 1
    inner = np.arange(1, _SAMPLES + 1) / _SAMPLES
    s = (found.s[:-1, None] + np.diff(found.s)[:, None] * inner).ravel()
    states = between(shape, found, s)[:STATE_SIZE]
    none = np.zeros((len(found.grid.case.obstacles), s.size))
    _, gaps = found.grid.case.touching.at(states, none, found.radius, found.numbers)
    for j, obstacle in enumerate(found.grid.case.obstacles):
        if obstacle.part != "body":
            gaps[j, :-1] = np.inf
    assert s.size == K * _SAMPLES
    return s, gaps


def deepest(shape: Mapped, found: Touched) -> float:
    """Return how deep the body is in an obstacle, anywhere, in L_0; negative where it is outside of all."""
    return -float(np.min(gaps_between(shape, found)[1]))


def regraded(shape: Mapped, found: Touched, intervals: int) -> Array:
    """Return nodes (K + 1,), half of them where obstacles touch and close by, or overlap between nodes.

    A push at one point makes a kink of the axis, by shear, so that a body touches along a short piece: F / GA over the
    curvature that it has against the obstacle, a few hundredths of the length. Of a long piece both ends count, where
    the body lifts off.
    """
    windows, last = [], found.s.size - 1
    for own in _runs(np.any(found.active, axis=0)):
        short = found.s[own[-1]] - found.s[own[0]] <= _SHORT
        ends = [own] if short else [own[:1], own[-1:]]
        windows += [(found.s[max(some[0] - 1, 0)], found.s[min(some[-1] + 1, last)]) for some in ends]
    s, gaps = gaps_between(shape, found)
    for k in np.unique(np.searchsorted(found.s, s[np.min(gaps, axis=0) < -_DEEP])):
        if not any(low <= found.s[k - 1] and found.s[k] <= high for low, high in windows):
            windows.append((found.s[k - 1], found.s[k]))
    if not windows:
        return np.linspace(0, 1, intervals + 1)
    breaks = np.unique([0.0, 1.0, *(end for window in windows for end in window)])
    middle = (breaks[1:] + breaks[:-1]) / 2
    inside = np.array([any(low < m < high for low, high in windows) for m in middle])
    size = np.diff(breaks)
    share = np.where(inside, 0.5 / inside.sum(), 0.0) + 0.5 * size
    at = np.concatenate([[0.0], np.cumsum(share)])
    nodes: Array = np.interp(np.linspace(0, 1, intervals + 1), at / at[-1], breaks)
    nodes[0], nodes[-1] = 0.0, 1.0
    return nodes


def halved(found: Touched) -> Array:
    """Return nodes (2 K + 1,) with one in the middle of each interval."""
    return np.sort(np.concatenate([found.s, (found.s[1:] + found.s[:-1]) / 2]))


def fewest_touching(found: Touched) -> int:
    """Return the least number of nodes that touch side by side; many where the tip touches alone, or nothing does."""
    runs = _runs(np.any(found.active, axis=0))
    return min((len(own) for own in runs if own != [found.s.size - 1]), default=found.s.size)


def _runs(active: NDArray[np.bool_]) -> list[list[int]]:
    """Return the nodes that touch, those next to each other together."""
    touching = np.flatnonzero(active)
    groups = groupby(enumerate(touching), key=lambda pair: pair[1] - pair[0])
    return [[int(k) for _, k in group] for _, group in groups]


def resampled(shape: Mapped, found: Touched, grid: ObstacleGrid, s: Array) -> Array:
    """Return x of a solution on nodes s (K + 1,) of a grid; each push goes to the nearest node."""
    states = between(shape, found, s)[:STATE_SIZE]
    # A node that was there holds the state before its push.
    same = np.abs(found.s[:, None] - s).min(axis=0) < 1e-12
    where = np.abs(found.s[:, None] - s).argmin(axis=0)
    states[:, same] = found.before[:, where[same]]
    states[:, -1] = found.before[:, -1]
    pushes = np.zeros((found.pushes.shape[0], s.size))
    nearest = np.abs(found.s[:, None] - s[1:]).argmin(axis=1) + 1
    for j in range(len(pushes)):
        np.add.at(pushes[j], nearest, found.pushes[j])
    for j, obstacle in enumerate(found.grid.case.obstacles):
        if obstacle.part != "body":
            pushes[j] = 0.0
            pushes[j, -1] = found.pushes[j, -1]
    return grid.packed(float(found.solution.x[0]), states, pushes)
