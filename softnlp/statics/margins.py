"""How far a step of a path is from what limits it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Margins:
    """How far a step of a path is from what limits it, negative beyond; None where nothing does.

    Attributes
    ----------
    pressure
        A number, the least distance of any set's pressure from its bounds [Pa].
    rate
        A number, what the largest rate of any set is below the limit, before the step and behind it [Pa/s].
    clearance
        A number, the least distance between body and obstacles less the clearance, between nodes too [m].
    stiffness
        A number, the least force that moves the tip by a unit displacement, whichever way it goes: zero where the pose
        ceases to be stable [N/m].
    """

    pressure: float
    rate: float | None = None
    clearance: float | None = None
    stiffness: float | None = None
