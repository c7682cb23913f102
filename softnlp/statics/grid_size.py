"""How many intervals a pose is solved on first, and how many its accuracy needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.model.numerics import Numerics, Transcribing
from softnlp.nlp.transcription import method_named
from softnlp.statics.loadcase import unpack_section
from softnlp.statics.pose_grid import next_size

Array = NDArray[np.float64]

MOST_INTERVALS = 1810
FIRST_INTERVALS = {"multiple-shooting": 10, "collocation": 5}
_MOST_COLLOCATION = 320  # as many points; order 8 needs no more
_SEARCHED_ON = 20  # intervals, at most, of the grid on which a branch is followed first
_BETWEEN = 4  # times as many, before a grid that has half as many again or more
_TURN = 0.25  # largest angle [rad] of the unloaded arc within one RK4 interval of a first grid


def most_intervals(transcription: str) -> int:
    """Return the finest grid that refinement uses."""
    return _MOST_COLLOCATION if transcription == "collocation" else MOST_INTERVALS


def first_intervals(
    transcription: str, constants: Array, moment: Array, arc_target: float | None = None, share: float = 1.0
) -> int:
    """Return a grid coarse enough to be quick and fine enough for the curl of the unloaded robot.

    constants : of a load case at its stretch. moment : (3,) at the tip, scaled. arc_target : for a robot without loads,
    the error to meet at once: RK4 turns a circular arc of angle a by a (a / K)^4 / 120 too little, of which the tip's
    position shows about 0.6. share : of the robot's length that the rod is.
    """
    section = unpack_section(constants)
    length = float(section.length)
    first = FIRST_INTERVALS[transcription]
    bent = section.pressure_moment_x / section.bending_x, section.pressure_moment_y / section.bending_y
    curl = 100 * float(np.sin(0.01 * length * np.hypot(*bent)))  # of the axis, R e3, over the first hundredth
    # The dead tip moment alone would bend or twist the rod so far; half as finely: it is not there at first.
    turned = float(np.linalg.norm(moment)) * length / min(section.bending_x, section.bending_y, section.torsion)
    curl = max(curl, turned / 2)
    wanted = max(share * first, curl / (_TURN * FIRST_INTERVALS["multiple-shooting"] / first))
    if arc_target is not None and transcription == "multiple-shooting":
        wanted = max(wanted, curl * (0.6 * curl / (120 * arc_target)) ** 0.25)
    return min(next_size(wanted), most_intervals(transcription))


def next_intervals(numerics: Numerics, error: float, intervals: int, target: float) -> int | None:
    """Return the finer grid that should meet the target, or None where this one does or the grid is given."""
    if numerics.intervals is not None or error <= target:
        return None
    order = method_named(numerics.transcription, 1).order
    factor = 1.1 * (error / target) ** (1 / order)
    return next_size(max(factor, 1.3) * intervals)


def search_grids(first: int, own: Transcribing, by: Transcribing, *, once: bool) -> list[tuple[int, Transcribing]]:
    """Return the grids on which a branch is followed one after another, until one is believed: intervals and kind.

    first : intervals of the first grid of the kind `own`. by : the kind whose steps are cheap. once : whether a grid
    twice as fine as `first` is not tried.
    """
    like = first if own == by else max(2 * first, 2 * _SEARCHED_ON)  # intervals that show as much
    coarse = [_SEARCHED_ON] if like > _SEARCHED_ON else []
    if 2 * like >= 3 * _BETWEEN * _SEARCHED_ON:
        coarse.append(_BETWEEN * _SEARCHED_ON)
    tried = [(size, by) for size in (*coarse, like)]
    if own != by:
        return [*tried, (first, own)]
    return tried if once else [*tried, (2 * first, own)]
