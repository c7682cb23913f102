"""Ellipsoids of the tip: how far small pressures move it, and how stiffly it holds its place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.errors import InputError
from softnlp.studies.sensitivity import Sensitivities

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """Semi-axes (3,), largest first, and their directions as the columns of axes (3, 3), right-handed, world frame.

    unit : of the semi-axes. A semi-axis of 0 is a direction in which nothing moves.
    """

    axes: Array
    semi_axes: Array
    unit: str


@dataclass(frozen=True, eq=False)
class Manipulability:
    """What a unit ball of pressures, sum of squares at most 1 Pa^2, does to the tip.

    translation [m/Pa], rotation [rad/Pa] : as ellipsoids. measure : sqrt(det J J^T) of the translation, its volume
    over that of the unit ball, 0 at a singular pose. isotropy : least over largest semi-axis.
    """

    translation: Ellipsoid
    rotation: Ellipsoid
    measure: float
    isotropy: float


def manipulability(jacobian: Sensitivities) -> Manipulability:
    """Return the manipulability of a tip Jacobian, of `softnlp.studies.sensitivity.tip_jacobian`; NaN if not solved."""
    linear, angular = jacobian.of("tip_position", "pressure"), jacobian.of("tip_rotation", "pressure")
    translation = _image(linear, "m/Pa")
    a = translation.semi_axes
    with np.errstate(invalid="ignore"):
        isotropy = float(a[-1] / a[0])
    return Manipulability(translation, _image(angular, "rad/Pa"), float(np.prod(a)), isotropy)


def compliance_ellipsoid(compliance: Sensitivities) -> Ellipsoid:
    """Return how far a unit force moves the tip [m/N]; the tip may turn.

    compliance : of `tip_compliance`. The image of the unit ball of forces.
    """
    return _image(compliance.of("tip_position", "tip_force"), "m/N")


def stiffness_ellipsoid(compliance: Sensitivities, *, rotation_held: bool = False) -> Ellipsoid:
    """Return the force that moves the tip by a unit displacement [N/m], the image of the unit ball of displacements.

    rotation_held : the tip may not turn, which takes a moment beside the force; by default it is free to turn.
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
    if matrix.shape[0] != 3:
        raise InputError(f"expected three rows, got {matrix.shape}", key="matrix")
    if not np.isfinite(matrix).all():
        return Ellipsoid(np.full((3, 3), np.nan), np.full(3, np.nan), unit)
    U, sizes, _ = np.linalg.svd(matrix)
    if np.linalg.det(U) < 0:
        U[:, 2] = -U[:, 2]
    return Ellipsoid(U, np.concatenate([sizes, np.zeros(3 - sizes.size)]), unit)
