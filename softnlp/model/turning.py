"""Moving the states of a rod: rotations are composed, and forces and moments turn with them.

A sum of rotation matrices is none; it is off by the square of the turn, and the far end of a curled rod turns a lot.
Composed, a part of the rod that only turns stays what it is, so Newton's method converges from much further. To first
order each function here is the sum or the difference that it stands for. x is [stretch | states of `STATE_SIZE`].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import STATE_BLOCKS, STATE_SIZE

Array = NDArray[np.float64]

_TURNING = (STATE_BLOCKS["force"], STATE_BLOCKS["moment"])


def moved(x: Array, dx: Array) -> Array:
    """Return x + dx with composed rotations; not finite where dx is out of all proportion."""
    with np.errstate(over="ignore", invalid="ignore"):
        new = x + dx
        old, change, states = (_states(v) for v in (x, dx, new))
        R, dR = _rotation(old), _rotation(change)
        W = _skew(dR @ _transposed(R))
        Q = _exp(W)
        _set_rotation(states, Q @ (R + dR - W @ R))  # what is left of dR keeps the drift of a coarse grid
        for block in _TURNING:
            states[:, block] = _times(Q, states[:, block] - _times(W, old[:, block]))
    return new


def change(x: Array, y: Array) -> Array:
    """Return y - x as a change at y: moved by it once more, y goes on as it came from x."""
    dx = y - x
    old, new, states = (_states(v) for v in (x, y, dx))
    R = _rotation(new)
    turn = R @ _transposed(_rotation(old))
    W = _skew(turn)
    sine = np.sqrt(np.sum(W**2, axis=(1, 2)) / 2)
    angle = np.arctan2(sine, (np.trace(turn, axis1=1, axis2=2) - 1) / 2)
    W *= np.divide(angle, sine, out=np.ones_like(sine), where=sine > 0)[:, None, None]
    _set_rotation(states, W @ R)
    for block in _TURNING:
        states[:, block] = new[:, block] - _times(_exp(W), old[:, block]) + _times(W, new[:, block])
    return dx


def carried(x: Array, a: Array, b: Array) -> Array:
    """Return x + b - a, the change from shape a to shape b taken in the body frames of a and made in those of x."""
    new = x + b - a
    states, start, end, result = (_states(v) for v in (x, a, b, new))
    R, A, B = (_rotation(v) for v in (states, start, end))
    turned = R @ _transposed(A) @ B
    _set_rotation(result, turned)
    for block in _TURNING:
        change_of_load = _times(_transposed(B), end[:, block]) - _times(_transposed(A), start[:, block])
        result[:, block] = _times(turned, _times(_transposed(R), states[:, block]) + change_of_load)
    return new


def _states(x: Array) -> Array:
    """Return the states in x as a view (points, 18)."""
    return x[1:].reshape(-1, STATE_SIZE)


def _rotation(states: Array) -> Array:
    """Return R (points, 3, 3), which states hold column by column."""
    return _transposed(states[:, STATE_BLOCKS["rotation"]].reshape(-1, 3, 3))


def _set_rotation(states: Array, R: Array) -> None:
    states[:, STATE_BLOCKS["rotation"]] = _transposed(R).reshape(-1, 9)


def _transposed(R: Array) -> Array:
    return R.transpose(0, 2, 1)


def _times(R: Array, v: Array) -> Array:
    product: Array = np.einsum("kij,kj->ki", R, v)
    return product


def _skew(A: Array) -> Array:
    """Return the skew part of matrices: to first order the rotation vector of the change that they make."""
    return (A - _transposed(A)) / 2


def _exp(W: Array) -> Array:
    """Return the rotations of skew matrices, by Rodrigues' formula."""
    turns = np.sqrt(np.sum(W**2, axis=(1, 2)) / 2)[:, None, None] / np.pi
    rotations: Array = np.eye(3) + np.sinc(turns) * W + np.sinc(turns / 2) ** 2 / 2 * (W @ W)
    return rotations
