"""Where the nodes of a solution among obstacles are: one is put where a contact touches at one point."""

from __future__ import annotations

from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import STATE_SIZE
from softnlp.statics.obstacle_grid import ObstacleGrid, Touched
from softnlp.statics.pose import Mapped

Array = NDArray[np.float64]

_SAMPLES = 8  # of each interval, where gaps are looked at between nodes
_ROOM = 0.15  # of an interval: what is left between a node that is moved and the next
_STILL = 1e-5  # of an interval: a node nearer than that stays


def between(shape: Mapped, found: Touched, s: Array) -> Array:
    """Return states, strains and the paper's n, m (30, M) at points s in 0..1, behind what pushes at a node."""
    left = np.clip(np.searchsorted(found.s, s + 1e-12, side="right") - 1, 0, found.s.size - 1)
    return np.asarray(shape.map(s.size)(found.behind[:, left], found.constants, (s - found.s[left])[None, :]))


def gaps_between(shape: Mapped, found: Touched) -> tuple[Array, Array]:
    """Return points along the rod (M,), nodes among them but not the base, and the gap of each obstacle there."""
    K = found.s.size - 1
    inner = np.arange(1, _SAMPLES + 1) / _SAMPLES
    s = (found.s[:-1, None] + np.diff(found.s)[:, None] * inner).ravel()
    states = between(shape, found, s)[:STATE_SIZE]
    pushed = found.grid.case.touching.pushed.map(s.size)
    count = len(found.grid.case.obstacles)
    wide = [np.tile(part[:, None], s.size) for part in (found.radius, found.numbers)]
    gaps = np.asarray(pushed(states, np.zeros((count, s.size)), *wide)[1])
    for j, obstacle in enumerate(found.grid.case.obstacles):
        if obstacle.part != "body":
            gaps[j, :-1] = np.inf
    assert s.size == K * _SAMPLES
    return s, gaps


def depth(shape: Mapped, found: Touched) -> float:
    """Return the deepest overlap between nodes, over L_0; 0 for none."""
    return max(0.0, -float(np.min(gaps_between(shape, found)[1], initial=0.0)))


def moved_nodes(shape: Mapped, found: Touched) -> Array | None:
    """Return the nodes (K + 1,) with one at each point where an obstacle touches alone; None where all are there.

    A contact at one point has its least gap there; of two nodes that share it one goes there.
    """
    s, K = found.s.copy(), found.s.size - 1
    fine, gaps = gaps_between(shape, found)
    taken, far = set[int](), 0.0
    for j, obstacle in enumerate(found.grid.case.obstacles):
        if obstacle.part != "body":
            continue
        for own in _runs(found.active[j]):
            if len(own) > 2 or own[-1] == K or taken & {own[0] - 1, *own, own[-1] + 1}:
                continue
            low, high = found.s[own[0] - 1], found.s[own[-1] + 1]
            inside = np.flatnonzero((fine > low) & (fine < high))
            target = _lowest(fine[inside], gaps[j, inside])
            if len(own) == 2:
                F = found.pushes[j, own]
                target = float(F @ found.s[own] / F.sum())
            k = min(own, key=lambda node: abs(found.s[node] - target))
            room = _ROOM * min(found.s[k] - found.s[k - 1], found.s[k + 1] - found.s[k])
            target = float(np.clip(target, found.s[k - 1] + room, found.s[k + 1] - room))
            far = max(far, abs(target - s[k]) * K)
            s[k] = target
            taken |= {k - 1, k, k + 1}
    return s if far > _STILL else None


def _runs(active: NDArray[np.bool_]) -> list[list[int]]:
    """Return the nodes that touch, those next to each other together."""
    touching = np.flatnonzero(active)
    return [[int(k) for _, k in group] for _, group in groupby(enumerate(touching), key=lambda pair: pair[1] - pair[0])]


def _lowest(s: Array, gap: Array) -> float:
    """Return where a gap is least, by the parabola through the least sample and its neighbours."""
    k = int(np.clip(np.argmin(gap), 1, gap.size - 2))
    a = np.polyfit(s[k - 1 : k + 2] - s[k], gap[k - 1 : k + 2], 2)
    if not a[0] > 0:
        return float(s[np.argmin(gap)])
    return float(np.clip(s[k] - a[1] / (2 * a[0]), s[k - 1], s[k + 1]))


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
