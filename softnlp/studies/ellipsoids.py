"""Ellipsoids of the tip: how far small pressures move it, and how stiffly it holds its place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.studies.sensitivity import Sensitivities

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """The image of a unit ball, world frame.

    Attributes
    ----------
    axes
        (3, 3) directions of the semi-axes as columns, right-handed [1].
    semi_axes
        (3,) largest first, in `unit` [SI]. A semi-axis of 0 is a direction in which nothing moves.
    unit
        Of the semi-axes.
    """

    axes: Array
    semi_axes: Array
    unit: str


@dataclass(frozen=True, eq=False)
class Manipulability:
    """What a unit ball of pressures, sum of squares at most 1 Pa^2, does to the tip.

    Attributes
    ----------
    translation, rotation
        As ellipsoids, in m/Pa and rad/Pa.
    measure
        sqrt(det J J^T) of the translation [m^3/Pa^3], its volume over that of the unit ball, 0 at a singular pose.
    isotropy
        Least over largest semi-axis of the translation [1].
    """

    translation: Ellipsoid
    rotation: Ellipsoid
    measure: float
    isotropy: float


def manipulability(jacobian: Sensitivities) -> Manipulability:
    """Return the manipulability of a tip Jacobian.

    Parameters
    ----------
    jacobian
        Of `softnlp.tip_jacobian`.

    Returns
    -------
    Manipulability
        NaN where the pose is not solved.
    """
    linear, angular = jacobian.of("tip_position", "pressure"), jacobian.of("tip_rotation", "pressure")
    translation = _image(linear, "m/Pa")
    a = translation.semi_axes
    with np.errstate(invalid="ignore"):
        isotropy = float(a[-1] / a[0])
    return Manipulability(translation, _image(angular, "rad/Pa"), float(np.prod(a)), isotropy)


def compliance_ellipsoid(compliance: Sensitivities) -> Ellipsoid:
    """Return how far a unit force moves the tip, which may turn: the image of the unit ball of forces.

    Parameters
    ----------
    compliance
        Of `softnlp.tip_compliance`.

    Returns
    -------
    Ellipsoid
        In m/N.
    """
    return _image(compliance.of("tip_position", "tip_force"), "m/N")


def stiffness_ellipsoid(compliance: Sensitivities, *, rotation_held: bool = False) -> Ellipsoid:
    """Return the force that moves the tip by a unit displacement, the image of the unit ball of displacements.

    Parameters
    ----------
    compliance
        Of `softnlp.tip_compliance`.
    rotation_held
        The tip may not turn, which takes a moment beside the force; by default it is free to turn.

    Returns
    -------
    Ellipsoid
        In N/m.
    """
    rows = ("tip_position", "tip_rotation") if rotation_held else ("tip_position",)
    columns = ("tip_force", "tip_moment") if rotation_held else ("tip_force",)
    C = np.vstack([np.hstack([compliance.of(row, column) for column in columns]) for row in rows])
    if not np.isfinite(C).all():
        return _image(np.full((3, 3), np.nan), "N/m")
    K = np.linalg.inv(np.asarray(C, dtype=np.float64))
    return _image(K[:3, :3], "N/m")


def _image(matrix: Array, unit: str) -> Ellipsoid:
    """Return the image of the unit ball under a matrix (3, n)."""
    if not np.isfinite(matrix).all():
        return Ellipsoid(np.full((3, 3), np.nan), np.full(3, np.nan), unit)
    U, sizes, _ = np.linalg.svd(matrix)
    if np.linalg.det(U) < 0:
        U[:, 2] = -U[:, 2]
    return Ellipsoid(U, np.concatenate([sizes, np.zeros(3 - sizes.size)]), unit)
