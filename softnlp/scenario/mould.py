"""[mould] of a scenario: what a maker chooses of the moulds that `softnlp mould` writes; no study uses it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from softnlp.scenario.values import NotNegative, Positive, Table

Percent = Annotated[float, Field(ge=0, lt=50)]
Degrees = Annotated[float, Field(ge=0, le=5)]


class MouldTable(Table):
    """[mould]: sizes of the moulds, of the thread and of what is bought, for `softnlp mould`.

    core : how chamber cores are made; auto: three-part from 15 mm outer diameter on where there is room, pin below
    shell_parts : parts of the outer shell
    wall_mm : of the shell around the seats of the plates
    flange_mm : how far the flanges of the shell stand out, at least three times the screw
    flange_thickness_mm : of the flanges at their screws
    plate_mm : of base and top plates outside the shell
    clearance_mm : radial, between printed parts that slide in one another
    draft_deg : of the keys in three-part cores and of the register pins, on each side; less where there is no room
    minimum_wall_mm : the least wall, rod or web that the printer makes
    bed_mm : of the printer, along x, y and z
    screw_mm : thread of the clamping screws and tie rods, 3 for M3
    thread_diameter_mm : of the thread that is wound on the cores
    thread_pitch_mm : from one turn to the next
    groove_depth_mm : of the helical groove; by default half the thread; as in 0.1
    shoulder_mm : by how much ends of cores and lumen rod are thinner in radius; more where webs or play need it
    gate_mm : bore of the pour gate; by default 4 mm, or 0.8 of the silicone's wall if that is less; as in 3.0
    vent_mm : width of the vents
    cap_mm : thickness of the end caps
    tube_mm : diameter of the holes for tubes in the base cap; by default 2 mm, less in narrow bores; as in 1.5
    shrinkage_percent : of the silicone as it cures: moulds are made larger by it
    waste_percent : silicone and thread to prepare beyond what is needed
    """

    core: Literal["auto", "three-part", "pin"] = "auto"
    shell_parts: Literal[2, 3] = 2
    wall_mm: Positive = 3.0
    flange_mm: Positive = 12.0
    flange_thickness_mm: Positive = 4.0
    plate_mm: Positive = 5.0
    clearance_mm: NotNegative = 0.1
    draft_deg: Degrees = 0.5
    minimum_wall_mm: Positive = 0.8
    bed_mm: Annotated[list[Positive], Field(min_length=3, max_length=3)] = Field(default=[200.0, 200.0, 200.0])
    screw_mm: Positive = 3.0
    thread_diameter_mm: Positive = 0.2
    thread_pitch_mm: Positive = 1.0
    groove_depth_mm: NotNegative | None = None
    shoulder_mm: Positive = 0.2
    gate_mm: Positive | None = None
    vent_mm: Positive = 1.0
    cap_mm: Positive = 5.0
    tube_mm: Positive | None = None
    shrinkage_percent: Percent = 0.0
    waste_percent: Percent = 20.0
