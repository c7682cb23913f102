"""A pose from machine code on the grid that the general solver would choose, where it is stable for certain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.model.numerics import Numerics
from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.solver import EquationResidual
from softnlp.statics.grid_size import first_intervals, most_intervals, next_intervals
from softnlp.statics.pose_grid import HOPELESS, dearer
from softnlp.statics.single_shooting import AtStretch, Shot, SingleShooting

Array = NDArray[np.float64]

_MOST_INTERVALS = 320  # beyond it the general solver says what it takes
_BLOCKS = {"position": slice(0, 3), "rotation": slice(3, 12), "force": slice(12, 15), "moment": slice(15, STATE_SIZE)}


def proposed(
    single: SingleShooting, numerics: Numerics, column: Array, target: float, near: Array | None
) -> tuple[AtStretch, Shot] | None:
    """Return a pose and the rod at its stretch, or None, which says nothing of the pose.

    column : every quantity, SI. target : the estimated error to meet, over L_0. near : nodes (18, k) of a neighbour.
    """
    at = single.at_stretch(column)
    if at is None:
        return None
    force, moment = single.loads(column, at)
    loaded = single.loaded(column)
    first = numerics.intervals or first_intervals("multiple-shooting", at.constants, moment, None if loaded else target)
    size, start = first, np.zeros(3)
    if near is not None:
        start = near[15:, 0]
        size = max(near.shape[1] - 1, first)
        if dearer(size, first):
            size = first
    most = min(_MOST_INTERVALS, most_intervals("multiple-shooting"))
    while size <= most:
        shot = single.shoot(at, force, moment, size, start)
        if shot is None:
            return None
        error = max(shot.error, shot.rotation_error / 5)
        wanted = next_intervals(numerics, error, size, target)
        if wanted is None:
            sound = residual(at, shot) <= numerics.tolerance and error <= HOPELESS
            return (at, shot) if sound else None
        size, start = wanted, shot.nodes[15:, 0]
    return None


def outputs_of(at: AtStretch, shot: Shot) -> dict[str, Array]:
    """Return the outputs of a load case, SI and world frame."""
    L_0 = at.length_unit
    return {
        "stretch": np.array([at.stretch]),
        "tip_position": shot.nodes[:3, -1] * L_0,
        "tip_rotation": shot.nodes[3:12, -1].reshape(3, 3).T,
        "chamber_lengths": shot.integrals[:-2] * L_0,
        "backbone_length": shot.integrals[-1:] * L_0,
    }


def residual(at: AtStretch, shot: Shot) -> float:
    """Return the largest scaled error of any equation."""
    return float(np.abs(np.concatenate([shot.gaps, shot.tip.ravel(), [at.imbalance]])).max())


def certificate(at: AtStretch, shot: Shot) -> tuple[EquationResidual, ...]:
    """Return the largest residual of every equation of a load case, in its unit and scaled."""
    L_0, F_0 = at.length_unit, at.force_unit
    units = {"position": ("m", L_0), "rotation": ("1", 1.0), "force": ("N", F_0), "moment": ("N m", F_0 * L_0)}
    gaps = shot.gaps.tolist()
    off = [("stretch balance", abs(at.imbalance), *units["force"])]
    off += [("base position", 0.0, *units["position"]), ("base orientation", 0.0, *units["rotation"])]
    off += [(f"continuity of {name}", max(gaps[rows]), *units[name]) for name, rows in _BLOCKS.items()]
    tips = zip(("force", "moment"), shot.tip.tolist(), strict=True)
    off += [(f"tip {name}", max(map(abs, rows)), *units[name]) for name, rows in tips]
    return tuple(EquationResidual(name, v * scale, unit, v) for name, v, unit, scale in off)
