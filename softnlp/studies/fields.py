"""The numbers of a step: name with unit suffix, dimensions, unit, meaning, and how to get each from a step.

One list, so that JSON, CSV and netCDF agree. Values are in the unit of the name; everything else is SI.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from softnlp.base.units import DEGREE, MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.nlp.solver import EquationResidual
from softnlp.statics.step import STABLE_MEANING, Contact, Pose, Run, Step

BLOCKED_FORCE = "blocked-force"


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


STABLE, SELF_INTERSECTING = "stable", "self_intersecting"

POSE_FIELDS: tuple[Field, ...] = (
    Field("stretch", (), "1", "axial stretch from the pressure balance, Eq. (23)", lambda s, p: p.stretch),
    Field(STABLE, (), "1", STABLE_MEANING, lambda s, p: p.stable),
    Field(
        SELF_INTERSECTING,
        (),
        "1",
        "curvature times outer radius reaches 1, or parts of the body lie inside each other",
        lambda s, p: p.fit.self_intersecting,
    ),
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
    Field("curvature_per_m", ("s", "axis"), "1/m", "curvature u in the body frame", lambda s, p: p.shape.curvature),
)


def _contact(of: Callable[[Contact], Any]) -> Callable[[Step, Pose], Any]:
    """Take a number from the contact of a step; None without one."""
    return lambda s, p: None if s.contact is None else of(s.contact)


def _wall(of: Callable[[Contact], Any]) -> Callable[[Step, Pose], Any]:
    """Take a number of the wall; None where the chambers alone are constrained, whose contact has no normal."""
    return _contact(lambda c: of(c) if c.normal.any() else None)


CONTACT_FIELDS: tuple[Field, ...] = (
    Field(
        "blocked_force_N",
        (),
        "N",
        "force with which the wall pushes the tip, not negative",
        _contact(lambda c: c.force),
    ),
    Field(
        "chamber_reaction_N",
        ("chamber",),
        "N",
        "reaction T_i of each chamber, without the pressure's P A_c",
        _contact(lambda c: c.chamber_reaction),
    ),
    Field(
        "gap_mm",
        (),
        "mm",
        "distance of the free shape's contact point in front of the wall, negative beyond it",
        _wall(lambda c: c.gap / MILLIMETRE),
    ),
    Field("wall_point_mm", ("axis",), "mm", "a point of the wall", _wall(lambda c: c.wall_point / MILLIMETRE)),
    Field("wall_normal", ("axis",), "1", "direction in which the wall pushes the robot", _wall(lambda c: c.normal)),
    Field("tip_cap_mm", (), "mm", "length L_t of the rigid cap on the tip", _contact(lambda c: c.tip_cap / MILLIMETRE)),
    Field(
        "length_error_mm",
        (),
        "mm",
        "sum over the pressurised chambers of free length minus length, Eq. (14)",
        _contact(lambda c: c.length_error / MILLIMETRE),
    ),
    Field(
        "free_tip_position_mm",
        ("axis",),
        "mm",
        "tip position of the free shape at the same pressure",
        _contact(lambda c: c.free.tip_position / MILLIMETRE),
    ),
    Field(
        "free_bending_angle_deg",
        (),
        "degree",
        "bending angle of the free shape at the same pressure",
        _contact(lambda c: c.free.bending_angle / DEGREE),
    ),
)


def _elasticity(weight: str) -> Callable[[Step, Pose], Any]:
    """Take the answer of the force to a weight; None where it was not asked for."""
    return _contact(lambda c: next((line.elasticity for line in c.sensitivity if line.weight == weight), None))


# Beside `weighted`, where the scenario asks for it: d ln F / d ln W.
SENSITIVITY_FIELDS = tuple(
    Field(
        f"force_elasticity_to_weight_{weight}",
        (),
        "1",
        f"relative change of the blocked force over that of the weight of {what}",
        _elasticity(weight),
    )
    for weight, what in (("force", "e_n"), ("moment", "e_m"), ("length", "e_L"), ("position", "e_h"))
)

FREE_SHAPE_FIELDS: tuple[Field, ...] = (
    Field(
        "free_position_mm",
        ("s", "axis"),
        "mm",
        "position of the free shape's axis in the world frame",
        _contact(lambda c: c.free.shape.position / MILLIMETRE),
    ),
    Field(
        "free_rotation",
        ("s", "row", "col"),
        "1",
        "rotation of the free shape's section; columns are the body axes",
        _contact(lambda c: c.free.shape.rotation),
    ),
)


def document_fields(run: Run) -> tuple[Field, ...]:
    """Return what JSON and CSV hold of a step, in order."""
    contact = CONTACT_FIELDS if run.study == BLOCKED_FORCE else ()
    if any(step.contact is not None and step.contact.sensitivity for step in run.steps):
        contact = (*contact, *SENSITIVITY_FIELDS)
    return (*POSE_FIELDS, *contact, *SOLVE_FIELDS)


def dataset_fields(run: Run) -> tuple[Field, ...]:
    """Return what netCDF holds of a step: the same, the section, and shapes along the rod."""
    free = FREE_SHAPE_FIELDS if run.study == BLOCKED_FORCE else ()
    return (*document_fields(run), *SECTION_FIELDS, *SHAPE_FIELDS, *free)


def closure_of(run: Run, step: Step) -> str | None:
    """Return the closure of a step, known of a failed one by what was asked."""
    if step.contact is not None:
        return step.contact.closure
    return None if run.contact is None else run.contact.closure_name


def left_by_weights(step: Step) -> tuple[EquationResidual, ...]:
    """Return what `weighted` left of its equations, nothing for other closures and failed steps."""
    return step.contact.weighted if step.contact is not None and step.status.has_solution else ()
