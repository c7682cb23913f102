"""The numbers of a step: name with unit suffix, dimensions, unit, meaning, and how to get each from a step.

One list, so that JSON, CSV and netCDF agree. Values are in the unit of the name; everything else is SI.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from softnlp.studies.step import Pose, Step
from softnlp.units import DEGREE, MILLIMETRE, NEWTON_MILLIMETRE


@dataclass(frozen=True)
class Field:
    """One quantity of a solved step.

    dims : names of its dimensions after `step`. unit : as a netCDF attribute. of : from a step and its pose.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    meaning: str
    of: Callable[[Step, Pose], Any]


def solved_pose(step: Step) -> Pose | None:
    """Return the pose of a step that carries a solution, else None: no number of another step is ever shown."""
    return step.pose if step.status.has_solution else None


STABLE = "stable"

POSE_FIELDS: tuple[Field, ...] = (
    Field("stretch", (), "1", "axial stretch from the pressure balance, Eq. (23)", lambda s, p: p.stretch),
    Field(STABLE, (), "1", "no conjugate point on the rod", lambda s, p: bool(p.stable)),
    Field(
        "tip_position_mm", ("axis",), "mm", "tip position in the world frame", lambda s, p: p.tip_position / MILLIMETRE
    ),
    Field(
        "tip_displacement_mm",
        ("axis",),
        "mm",
        "tip position against the shape at the same pressure without gravity or tip load",
        lambda s, p: p.tip_displacement / MILLIMETRE,
    ),
    Field("tip_rotation", ("row", "col"), "1", "tip rotation; columns are the body axes", lambda s, p: p.tip_rotation),
    Field(
        "bending_angle_deg",
        (),
        "degree",
        "bending angle: integral of sqrt(u_x^2 + u_y^2) over s",
        lambda s, p: p.bending_angle / DEGREE,
    ),
    Field("tilt_deg", (), "degree", "angle between the tip axis and +z", lambda s, p: p.tilt / DEGREE),
    Field(
        "backbone_length_mm",
        (),
        "mm",
        "length of the deformed axis: integral of |v| over s",
        lambda s, p: p.backbone_length / MILLIMETRE,
    ),
    Field(
        "chamber_length_mm",
        ("chamber",),
        "mm",
        "length of each deformed chamber axis",
        lambda s, p: p.chamber_length / MILLIMETRE,
    ),
)

SOLVE_FIELDS: tuple[Field, ...] = (
    Field(
        "discretisation_error",
        (),
        "1",
        "estimated error of the tip position, of the robot's length L_0",
        lambda s, p: s.discretisation_error,
    ),
    Field("intervals", (), "1", "intervals on the rod", lambda s, p: s.intervals),
    Field("iterations", (), "1", "iterations of the solver", lambda s, p: s.iterations),
    Field("solve_time_s", (), "s", "time spent on the step", lambda s, p: s.solve_time),
)

SECTION_FIELDS: tuple[Field, ...] = (
    Field("outer_radius_mm", (), "mm", "deformed outer radius r_r", lambda s, p: p.radii.outer / MILLIMETRE),
    Field("lumen_radius_mm", (), "mm", "deformed lumen radius r_i", lambda s, p: p.radii.lumen / MILLIMETRE),
    Field(
        "chamber_circle_radius_mm",
        (),
        "mm",
        "deformed radius r_cp of the circle of chamber axes",
        lambda s, p: p.radii.chamber_circle / MILLIMETRE,
    ),
    Field("chamber_radius_mm", (), "mm", "radius r_co of the thread", lambda s, p: p.radii.chamber / MILLIMETRE),
    Field("bore_radius_mm", (), "mm", "deformed bore radius r_ci, Eq. (22)", lambda s, p: p.radii.bore / MILLIMETRE),
)

SHAPE_FIELDS: tuple[Field, ...] = (
    Field("arc", ("s",), "1", "position along the rod s/L, from base to tip", lambda s, p: p.shape.arc),
    Field(
        "position_mm",
        ("s", "axis"),
        "mm",
        "position p of the rod's axis in the world frame",
        lambda s, p: p.shape.position / MILLIMETRE,
    ),
    Field(
        "rotation",
        ("s", "row", "col"),
        "1",
        "rotation R of the section; columns are the body axes",
        lambda s, p: p.shape.rotation,
    ),
    Field("force_N", ("s", "axis"), "N", "internal force n in the world frame", lambda s, p: p.shape.force),
    Field(
        "moment_Nmm",
        ("s", "axis"),
        "N mm",
        "internal moment m in the world frame",
        lambda s, p: p.shape.moment / NEWTON_MILLIMETRE,
    ),
    Field(
        "shear_extension",
        ("s", "axis"),
        "1",
        "shear and extension v in the body frame",
        lambda s, p: p.shape.shear_extension,
    ),
    Field("curvature_per_m", ("s", "axis"), "m-1", "curvature u in the body frame", lambda s, p: p.shape.curvature),
)

DOCUMENT_FIELDS = (*POSE_FIELDS, *SOLVE_FIELDS)
"""What JSON and CSV hold of a step, in order."""
