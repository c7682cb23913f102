"""Whether a shape is possible as a body: no negative length, no bend too sharp, no part of the body inside another.

The body of outer radius r is the union of discs about the axis. Where curvature times r reaches 1 neighbouring discs
meet: the inside of the bend has no length left. Where a load compresses the rod to nothing (v_z <= 0) there is none at
all, and the curvature counts as infinite. Below that discs may only meet where the axis has turned by pi or more in
between (curve and point unrolled into a plane: the distance from a point of both discs has two minima below r), at
least pi r along the axis from each other. Then there is a pair of points nearest to each other, closer than 2 r, or the
face of an end lies in another part.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TURN = 3.0
"""Axes that turn by less [rad] never lead one part of a body into another; pi, less what shear and grids may take."""
WARNED = 0.9
"""Curvature times outer radius from which a bend is told of."""
_ANY = 100.0  # above it the number says nothing but that the rod is compressed to nearly nothing

_SMALL_TURN = 1e-4  # below it a series is more accurate than the quotient [rad]
_STEP = 0.3  # of the radius: how far apart stations are looked at
_FINEST = 32  # parts that an interval between stations is cut into at most
_ENTRIES = 4_000_000  # of distances held at once
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Fit:
    """How a shape suits a body.

    Attributes
    ----------
    tightness
        Largest curvature of the axis, per its deformed length, times the outer radius [1]; inf where v_z <= 0.
    overlaps
        Whether parts that are no neighbours lie inside each other.
    """

    tightness: float
    overlaps: bool

    @property
    def self_intersecting(self) -> bool:
        """Whether no body can take the shape without passing through itself."""
        return self.tightness >= 1 or self.overlaps

    @property
    def inside_out(self) -> bool:
        """Whether the rod is compressed to nothing somewhere, or past it."""
        return bool(np.isinf(self.tightness))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know of it."""
        found = []
        if self.inside_out:
            found.append("a part of the body has negative length (v_z <= 0), so no body can take this shape")
        elif self.tightness >= 1:
            number = f"{self.tightness:.2f}" if self.tightness <= _ANY else f"above {_ANY:g}"
            found.append(
                f"curvature times outer radius is {number}: from 1 on the inside of the bend has negative "
                "length, so no body can take this shape"
            )
        elif self.tightness >= WARNED:
            found.append(
                f"curvature times outer radius is {self.tightness:.2f}: near 1 the inside of the bend has no length "
                "left, and the model does not hold"
            )
        if self.overlaps:
            found.append(
                "the body passes through itself: parts of it lie inside each other, and the model has no contact of "
                "the body with itself"
            )
        return tuple(found)


def fit_of(
    position: Array, rotation: Array, radius: float | Array, curvature: Array | None = None, most_turn: float = np.inf
) -> Fit:
    """Return how a shape suits a body.

    position : (M, 3) of the axis [m]. rotation : (M, 3, 3), columns are the body axes. radius : outer, deformed, one
    or (M,) [m]. curvature : (M,) of the axis per its deformed length [1/m], inf where v_z <= 0; by default that of the
    screws between stations, with one radius. most_turn : of the axis, where that is known [rad].
    """
    if curvature is None:
        chord = np.linalg.norm(np.diff(position, axis=0), axis=1)
        turn = np.linalg.norm(turns(rotation)[:, :2], axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):  # a circular arc over this chord
            curvature = np.where(advances(position, rotation) > 0, 2 * np.sin(turn / 2) / chord, np.inf)
    tightness = float(np.max(curvature * radius))
    if most_turn <= TURN:
        return Fit(tightness, overlaps=False)
    return Fit(tightness, bool(overlapping(position[None], rotation[None, :, :, 2], np.asarray(radius)[None])[0]))


def advances(position: Array, rotation: Array) -> Array:
    """Return (M - 1,) how far the axis goes on from each station to the next, against its direction where negative."""
    found: Array = ((rotation[:-1, :, 2] + rotation[1:, :, 2]) * np.diff(position, axis=0)).sum(axis=1)
    return found


def turns(rotation: Array) -> Array:
    """Return (M - 1, 3) rotation vectors from each station to the next, in the body frame [rad]; below 180 degrees."""
    Q = np.swapaxes(rotation[:-1], 1, 2) @ rotation[1:]
    w = np.stack([Q[:, 2, 1] - Q[:, 1, 2], Q[:, 0, 2] - Q[:, 2, 0], Q[:, 1, 0] - Q[:, 0, 1]], axis=1) / 2
    sine = np.sqrt((w**2).sum(axis=1))
    angle = np.arctan2(sine, (np.trace(Q, axis1=1, axis2=2) - 1) / 2)
    flat = sine < _SMALL_TURN
    factor: Array = np.where(flat, 1 + sine**2 / 6, angle / np.where(flat, 1.0, sine))
    return w * factor[:, None]


def overlapping(position: Array, axis: Array, radius: Array) -> Mask:
    """Return which of n bodies, bent less sharply than their radius allows, have parts inside each other.

    position, axis : (n, M, 3), of the axis and its unit direction R e3. radius : (n,) or (n, M), in the unit of the
    positions.
    """
    radius = np.broadcast_to(radius[:, None] if radius.ndim == 1 else radius, position.shape[:2])
    found = np.zeros(len(position), bool)
    cosine = np.clip((axis[:, 1:] * axis[:, :-1]).sum(axis=2), -1, 1)
    curled = np.flatnonzero(np.arccos(cosine).sum(axis=1) > TURN)
    step = np.linalg.norm(np.diff(position, axis=1), axis=2).max(axis=1)
    for some in _blocks(curled, position.shape[1]):
        near = _near(_apart(position[some]), _along(position[some]), radius[some], step[some])
        found[some] = near.any(axis=(1, 2))
    close = np.flatnonzero(found)
    parts = int(np.clip(np.ceil((step / radius.min(axis=1))[close].max(initial=0.0) / _STEP), 1, _FINEST))
    for some in _blocks(close, parts * position.shape[1]):
        found[some] = _meeting(*finer(position[some], axis[some], radius[some], parts))
    return found


def _blocks(bodies: NDArray[np.intp], stations: int) -> Iterator[NDArray[np.intp]]:
    """Yield some bodies at a time, as many as distances between their stations are held at once."""
    most = max(1, _ENTRIES // stations**2)
    for start in range(0, bodies.size, most):
        yield bodies[start : start + most]


def _along(p: Array) -> Array:
    """Return the lengths along the axis (n, M)."""
    return np.pad(np.linalg.norm(np.diff(p, axis=1), axis=2).cumsum(axis=1), ((0, 0), (1, 0)))


def _apart(p: Array) -> Array:
    """Return the squared distances between the stations (n, M, M)."""
    square = (p**2).sum(axis=2)
    apart: Array = np.maximum(square[:, :, None] + square[:, None] - 2 * p @ p.swapaxes(1, 2), 0.0)
    return apart


def _near(apart: Array, s: Array, radius: Array, slack: Array) -> Mask:
    """Return which stations (n, M, M), the first before the second, may be parts that lie inside each other.

    radius : (n, M). slack : (n,) how far from a station a point between stations may be, both ends taken together.
    """
    both = radius[:, None] + radius[:, :, None]
    far = s[:, None] - s[:, :, None] >= np.pi / 2 * both - slack[:, None, None]
    near: Mask = far & (apart < (both + slack[:, None, None]) ** 2)
    return near


def finer(position: Array, axis: Array, radius: Array, parts: int) -> tuple[Array, Array, Array, Array]:
    """Return positions, directions, lengths along the axis and radii, intervals cut by the cubic through their ends."""
    step = np.diff(position, axis=1)
    chord = np.linalg.norm(step, axis=2)
    t = (np.arange(parts) / parts)[:, None]
    before, after = (chord[:, :, None, None] * end[:, :, None] for end in (axis[:, :-1], axis[:, 1:]))
    curve = position[:, :-1, None] + step[:, :, None] * (3 * t**2 - 2 * t**3)
    curve = curve + before * (t - 2 * t**2 + t**3) + after * (t**3 - t**2)
    straight = axis[:, :-1, None] * (1 - t) + axis[:, 1:, None] * t
    wide = radius[:, :-1, None] * (1 - t[:, 0]) + radius[:, 1:, None] * t[:, 0]

    def joined(inside: Array, last: Array) -> Array:
        return np.concatenate([inside.reshape(len(position), -1, 3), last[:, None]], axis=1)

    p, a = joined(curve, position[:, -1]), joined(straight, axis[:, -1])
    r = np.concatenate([wide.reshape(len(position), -1), radius[:, -1:]], axis=1)
    return p, a / np.linalg.norm(a, axis=2, keepdims=True), _along(p), r


def _meeting(p: Array, a: Array, s: Array, radius: Array) -> Mask:
    """Return which of n bodies meet themselves; stations as of `finer`."""
    apart = _apart(p)
    near = _near(apart, s, radius, -_ROUNDING * radius.min(axis=1))
    apart = apart / (radius[:, None] + radius[:, :, None]) ** 2
    found = np.zeros(len(p), bool)
    for k in np.flatnonzero(near.any(axis=(1, 2))):
        i, j = np.nonzero(near[k, 1:-1, 1:-1])
        around = [apart[k, i + m, j + n] for m in range(3) for n in range(3)]
        least = around[4] <= np.min(around, axis=0) * (1 + _ROUNDING)
        found[k] = bool(least.any()) or _ends_inside(p[k], a[k], s[k], radius[k])
    return found


def _ends_inside(p: Array, a: Array, s: Array, radius: Array) -> bool:
    """Return whether a point of the face of an end lies in a part of the body that is no neighbour of it."""
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    disc = np.concatenate([r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (0.0, 0.4, 0.7, 1.0)])
    for end in (0, -1):
        both = radius + radius[end]
        close = (np.abs(s - s[end]) >= np.pi / 2 * both) & (np.linalg.norm(p - p[end], axis=1) < 1.25 * both)
        k = np.flatnonzero(close[:-1] & close[1:])
        x = np.cross(a[end], np.eye(3)[np.argmin(np.abs(a[end]))])
        x /= np.linalg.norm(x)
        points = p[end] + radius[end] * (disc @ np.array([x, np.cross(a[end], x)]))
        ahead, behind = (points @ a[j].T - (p[j] * a[j]).sum(axis=1) for j in (k, k + 1))
        point, at = np.nonzero((ahead >= 0) & (behind < 0))
        part = ahead[point, at] / (ahead[point, at] - behind[point, at])
        centre = p[k[at]] + part[:, None] * (p[k[at] + 1] - p[k[at]])
        wide = radius[k[at]] + part * (radius[k[at] + 1] - radius[k[at]])
        if (np.linalg.norm(points[point] - centre, axis=1) < (1 - _ROUNDING) * wide).any():
            return True
    return False
