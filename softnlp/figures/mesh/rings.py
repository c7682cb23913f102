"""Circles of a body's section placed along its axis: the geometry that figures, live display and solids share."""

from __future__ import annotations

import numpy as np

from softnlp.base.arrays import Array
from softnlp.model.robot import Robot
from softnlp.model.round_chambers import radii
from softnlp.results import Body
from softnlp.statics.body import turns

_SMALL_TURN = 1e-4  # below it a series is more accurate than the quotient [rad]


def circle(facets: int) -> Array:
    """Return (facets, 2) points on the unit circle, counter-clockwise from +x."""
    angle = 2 * np.pi * np.arange(facets) / facets
    return np.column_stack([np.cos(angle), np.sin(angle)])


def placed(position: Array, rotation: Array, local: Array) -> Array:
    """Return (..., 3) points p + R [x, y, 0] of a section; leading dimensions broadcast, units are kept.

    position : (..., 3). rotation : (..., 3, 3). local : (..., 2), in the body frame.
    """
    x, y = local[..., 0, None], local[..., 1, None]
    points: Array = position + rotation[..., :, 0] * x + rotation[..., :, 1] * y
    return points


def natural_body(robot: Robot, stations: int = 2) -> Body:
    """Return the body as it is cast: straight along +z, of length L_0, with the radii of no pressure."""
    position = np.zeros((stations, 3))
    position[:, 2] = np.linspace(0.0, robot.length, stations)
    return Body(position, np.tile(np.eye(3), (stations, 1, 1)), radii(robot, 1.0))


def resampled(body: Body, stations: int) -> Body:
    """Return a body at so many stations, evenly spaced along the chords of the given ones.

    Between two of them it follows the screw that leads from one to the other: exact where the strains are constant in
    the body frame, as on a circular arc.
    """
    p, R = body.position, body.rotation
    step = np.diff(p, axis=0)
    chord = np.concatenate([[0.0], np.cumsum(np.sqrt((step**2).sum(axis=1)))])
    along = np.linspace(0.0, chord[-1], stations)
    k = np.clip(np.searchsorted(chord, along, side="right") - 1, 0, len(p) - 2)
    t = (along - chord[k]) / (chord[k + 1] - chord[k])
    turn = turns(R)[k]
    # The translation of the screw in the frame where it starts: V(turn) rho is the step.
    rho = np.linalg.solve(_exponential(turn)[1], np.einsum("kji,kj->ki", R[k], step[k])[..., None])[..., 0]
    Q, V = _exponential(turn * t[:, None])
    local = np.einsum("kij,kj->ki", V, rho * t[:, None])
    position = p[k] + np.einsum("kij,kj->ki", R[k], local)
    return Body(position, R[k] @ Q, body.radii)


def _exponential(turn: Array) -> tuple[Array, Array]:
    """Return (n, 3, 3) rotations exp(hat a) of rotation vectors a, and their integrals V along the screw."""
    angle = np.sqrt((turn**2).sum(axis=1))[:, None, None]
    flat = angle < _SMALL_TURN
    x = np.where(flat, 1.0, angle)
    a = np.where(flat, 1 - angle**2 / 6, np.sin(x) / x)
    b = np.where(flat, 0.5 - angle**2 / 24, 2 * np.sin(x / 2) ** 2 / x**2)
    c = np.where(flat, 1 / 6 - angle**2 / 120, (x - np.sin(x)) / x**3)
    K = np.zeros((len(turn), 3, 3))
    K[:, 2, 1], K[:, 0, 2], K[:, 1, 0] = turn.T
    K[:, 1, 2], K[:, 2, 0], K[:, 0, 1] = -turn.T
    K2 = K @ K
    return np.eye(3) + a * K + b * K2, np.eye(3) + b * K + c * K2
