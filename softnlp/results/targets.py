"""The numbers of a step that inverse kinematics adds: its target, how near the tip comes, and where it is then.

Unlike those of a pose they are also known of a target out of reach, whose pressures are those of the nearest point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.statics.step import Aimed, Run, Step

INVERSE = "inverse"


@dataclass(frozen=True)
class TargetField:
    """One number of a target; None where the target has none of its kind or no pose was found.

    dims : ("axis",) or (). unit : as a netCDF attribute. of : from a target, in the unit of the name.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    meaning: str
    of: Callable[[Aimed], Any]


def _in(unit: float, value: Any) -> Any:
    return None if value is None else value / unit


TARGET_FIELDS: tuple[TargetField, ...] = (
    TargetField("target_mm", ("axis",), "mm", "where the tip is to be", lambda a: _in(MILLIMETRE, a.position)),
    TargetField("target_direction", ("axis",), "1", "where the tip is to point", lambda a: a.direction),
    TargetField("distance_mm", (), "mm", "distance of the tip from its target", lambda a: _in(MILLIMETRE, a.distance)),
    TargetField(
        "direction_error_deg",
        (),
        "degree",
        "angle between the tip's axis and the direction it is to have",
        lambda a: _in(DEGREE, a.angle),
    ),
    TargetField(
        "nearest_mm", ("axis",), "mm", "the reachable tip position found", lambda a: _in(MILLIMETRE, a.tip_position)
    ),
    TargetField("nearest_direction", ("axis",), "1", "the tip's axis there", lambda a: a.tip_direction),
    TargetField("optimal", (), "1", "whether nothing that was left to choose is better nearby", lambda a: a.optimal),
)


def target_values(run: Run, step: Step) -> dict[str, Any]:
    """Return the numbers of a step's target by name; none for another study."""
    if run.study != INVERSE:
        return {}
    return {field.name: None if step.aimed is None else field.of(step.aimed) for field in TARGET_FIELDS}
