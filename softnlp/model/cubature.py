"""Sums over areas of any outline: as few points and positive weights as are exact for polynomials of a degree.

Moments of an area are sums over a fine rule; among many places in it non-negative least squares find weights with the
same moments. By V. Tchakaloff (1957) as many points as there are polynomials are enough: A. Sommariva and M. Vianello,
Compression of multivariate discrete measures and applications, Numer. Funct. Anal. Optim. 36 (2015) 1198.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import pi

import numpy as np
from scipy.optimize import nnls

from softnlp.base.errors import InputError
from softnlp.model.plane import Array, Circle, Outline, corners_of, reach

Points = tuple[tuple[float, float, float], ...]
"""x, y and weight of each."""

DEGREE = 11
"""Polynomials that the sums over a body are exact for."""
LINER_DEGREE = 5
"""The same of a liner, which is thin."""
_CLOSE = 1e-9  # of a moment, of the area
_GRIDS = (24, 36, 54)  # places across the section


def moment_rule(outline: Outline, degree: int) -> tuple[Array, Array]:
    """Return (n, 2) points and (n,) weights that are exact for polynomials of a degree; some weights are negative."""
    n = degree // 2 + 2
    at, weight = np.polynomial.legendre.leggauss(n)
    at, weight = (1 + at) / 2, weight / 2
    if isinstance(outline, Circle):
        turns = 2 * pi * np.arange(degree + 1) / (degree + 1)
        r, angle = (grid.ravel() for grid in np.meshgrid(outline.radius * at, turns, indexing="ij"))
        weights = np.repeat(weight * at * outline.radius**2 * 2 * pi / (degree + 1), degree + 1)
        return np.array(outline.centre) + np.column_stack([r * np.cos(angle), r * np.sin(angle)]), weights
    corners = corners_of(outline)
    middle = np.array(outline.centre)
    a, b = corners - middle, np.roll(corners, -1, axis=0) - middle
    out, along = (grid.ravel() for grid in np.meshgrid(at, at, indexing="ij"))
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    share = np.outer(weight * at, weight).ravel()
    places = out[:, None] * ((1 - along)[:, None] * a[:, None] + along[:, None] * b[:, None])
    return (middle + places).reshape(-1, 2), np.outer(twice, share).ravel()


@lru_cache(maxsize=64)
def points_over(plus: tuple[Outline, ...], minus: tuple[Outline, ...], degree: int = DEGREE) -> Points:
    """Return points and weights over areas less other ones that lie in them, in the unit of length of these.

    Raises
    ------
    InputError
        Where no positive weights are found: an area that is much thinner than it is long.
    """
    size = max(reach(outline) for outline in plus)
    moments = np.zeros((degree + 1) * (degree + 2) // 2)
    for outlines, sign in ((plus, 1.0), (minus, -1.0)):
        for outline in outlines:
            points, weights = moment_rule(outline, degree)
            moments += sign * weights @ _polynomials(points / size, degree)
    for count in _GRIDS:
        places = _places(plus, minus, count)
        basis = _polynomials(places / size, degree)
        # Columns that are orthonormal over the places keep the small problem well conditioned.
        _, R = np.linalg.qr(basis)
        matrix, wanted = np.linalg.solve(R.T, basis.T), np.linalg.solve(R.T, moments)
        weights, _ = nnls(matrix, wanted, maxiter=50 * matrix.shape[1])
        if np.abs(weights @ basis - moments).max() < _CLOSE * moments[0]:
            kept = weights > 0
            return tuple((float(x), float(y), float(w)) for (x, y), w in zip(places[kept], weights[kept], strict=True))
    raise InputError("no sum over this section was found: a part of it is too thin for its size")


def _polynomials(points: Array, degree: int) -> Array:
    """Return (n, terms) products of Chebyshev's polynomials of both coordinates, the constant first."""
    x, y = (np.polynomial.chebyshev.chebvander(points[:, k], degree) for k in (0, 1))
    return np.column_stack([x[:, i] * y[:, j - i] for j in range(degree + 1) for i in range(j + 1)])


def _places(plus: Sequence[Outline], minus: Sequence[Outline], count: int) -> Array:
    """Return places in the areas: of a grid, and between outlines that are near to each other."""
    found = []
    for outline in plus:
        corners = corners_of(outline)
        low, high = corners.min(axis=0), corners.max(axis=0)
        step = (np.arange(count) + 0.5) / count
        found.append(
            np.array([(x, y) for x in low[0] + step * (high - low)[0] for y in low[1] + step * (high - low)[1]])
        )
        for hole in minus:  # from the hole's border towards the next place of the outer one
            inner = corners_of(hole)[:: max(1, len(corners_of(hole)) // (4 * count))]
            apart = ((inner[:, None] - corners[None]) ** 2).sum(axis=2)
            nearest = corners[apart.argmin(axis=1)]
            found += [inner + share * (nearest - inner) for share in (0.2, 0.5, 0.8)]
    places = np.concatenate(found)
    inside = (
        np.max([of.signed(places) for of in plus], axis=0)
        if len(plus) == 1
        else np.min([of.signed(places) for of in plus], axis=0)
    )
    for hole in minus:
        inside = np.maximum(inside, -hole.signed(places))
    return np.asarray(places[inside < 0])
