"""Runs made of circular arcs, in closed form: what results and figures are tested on without a solve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from softnlp.base.status import Status
from softnlp.model.contact_settings import ClosureWeights, ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients
from softnlp.model.materials import material
from softnlp.model.robot import Robot, robot
from softnlp.model.rod import Loads
from softnlp.nlp.solver import EquationResidual
from softnlp.statics.step import Contact, Pose, Run, SectionRadii, Shape, Step

POINTS = 31
BENDING_STIFFNESS = 7.1e-4  # [N m^2], of the order of a D25 robot's
STRETCH_PER_PASCAL = 1.2e-6  # for each set


def arc_pose(body: Robot, pressure: np.ndarray, points: int = POINTS) -> Pose:
    """Return the arc whose constant curvature the pressures [Pa] of a section of fixed stiffness give."""
    stretch = 1.0 + STRETCH_PER_PASCAL * float(pressure.sum())
    length = stretch * body.length
    shrink = stretch**-0.5
    centres = np.array(body.chamber_centres(), dtype=float) * shrink
    bore = np.sqrt(body.chamber_radius**2 - (body.chamber_radius**2 - body.bore_radius**2) / stretch)
    forces = np.pi * bore**2 * pressure[list(body.set_of_chamber)]
    pressure_moment = np.array([forces @ centres[:, 1], -forces @ centres[:, 0], 0.0])
    u = pressure_moment / BENDING_STIFFNESS
    kappa = float(np.hypot(u[0], u[1]))
    arc = np.linspace(0.0, 1.0, points)
    angle = kappa * length * arc
    across = np.array([u[1], -u[0]]) / kappa if kappa else np.array([1.0, 0.0])
    # The axis turns towards `across` = u x e3 / |u|.
    sideways = (1 - np.cos(angle)) / kappa if kappa else 0 * arc
    upwards = np.sin(angle) / kappa if kappa else length * arc
    position = np.column_stack([sideways * across[0], sideways * across[1], upwards])
    rotation = np.stack([_rotation(u / kappa if kappa else np.array([0.0, 1.0, 0.0]), a) for a in angle])
    force = forces.sum() * rotation[:, :, 2]
    offsets = np.column_stack([centres, np.zeros(len(centres))])
    chamber_length = length * np.linalg.norm(np.array([0, 0, 1.0]) + np.cross(u, offsets), axis=1)
    return Pose(
        stretch=stretch,
        stable=True,
        tip_position=position[-1],
        tip_displacement=np.zeros(3),
        tip_rotation=rotation[-1],
        bending_angle=kappa * length,
        tilt=float(np.arccos(np.clip(rotation[-1, 2, 2], -1, 1))),
        backbone_length=length,
        chamber_length=chamber_length,
        radii=SectionRadii(
            outer=body.outer_radius * shrink,
            lumen=body.lumen_radius * shrink,
            chamber_circle=body.chamber_circle_radius * shrink,
            chamber=body.chamber_radius,
            bore=float(bore),
        ),
        shape=Shape(
            arc=arc,
            position=position,
            rotation=rotation,
            force=force,
            moment=rotation @ pressure_moment,
            shear_extension=np.tile([0.0, 0.0, 1.0], (points, 1)),
            curvature=np.tile(u, (points, 1)),
        ),
    )


def _rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def arc_step(body: Robot, pressure: Sequence[float], **changes: Any) -> Step:
    """Return a solved step at pressures [Pa]."""
    values = np.array(pressure, dtype=float)
    step = Step(
        values,
        Status.SOLVED,
        "",
        pose=arc_pose(body, values),
        residual=1.3e-12,
        certificate=(
            EquationResidual("tip force", 2e-13, "N", 4e-13),
            EquationResidual("tip moment", 1e-15, "N m", 1.3e-12),
        ),
        discretisation_error=3e-8,
        intervals=10,
        iterations=4,
        solve_time=0.0123,
    )
    return replace(step, **changes)


def failed_step(pressure: Sequence[float], **changes: Any) -> Step:
    """Return a step at pressures [Pa] with no equilibrium."""
    message = "the stretch balance has no root on the branch from zero pressure; the last equilibrium is at 1.31 bar"
    step = Step(np.array(pressure, dtype=float), Status.NO_EQUILIBRIUM, message, residual=0.25, solve_time=0.2)
    return replace(step, **changes)


def run_of(steps: Sequence[Step], name: str = "D25L60", **changes: Any) -> Run:
    """Return a run of the given steps."""
    run = Run(
        "forward", robot(name), material("Ecoflex 00-50"), Coefficients(), REPRODUCTION, Loads(), tuple(steps), "a test"
    )
    return replace(run, **changes)


def ramp_run(
    steps: int = 11,
    to: float = 1.5e5,
    sets: Sequence[int] = (0,),
    name: str = "D25L60",
    failed: Sequence[int] = (),
    **changes: Any,
) -> Run:
    """Return a run whose chosen sets (from 0) go from 0 to a pressure [Pa] together; the steps in `failed` fail."""
    body = robot(name)
    made = []
    for k, level in enumerate(np.linspace(0, to, steps)):
        pressure = [level if n in sets else 0.0 for n in range(body.chamber_sets)]
        made.append(failed_step(pressure) if k in failed else arc_step(body, pressure))
    return run_of(made, name, **changes)


def contact_of(
    body: Robot, pressure: np.ndarray, *, force: float, offset: float = 0.0, tip_cap: float = 0.0, **changes: Any
) -> Contact:
    """Return a contact that holds the tip at x = offset and pushes along +x; its free shape is the pressures' arc."""
    free = arc_pose(body, pressure)
    reach = float((free.tip_position + tip_cap * free.tip_rotation[:, 2])[0])
    contact = Contact(
        force=force,
        normal=np.array([1.0, 0.0, 0.0]),
        wall_point=np.array([offset, 0.0, 0.0]),
        tip_cap=tip_cap,
        closure="compliant",
        chamber_reaction=np.where(pressure[list(body.set_of_chamber)] > 0, 0.4 * force, 0.0),
        free=free,
        gap=reach - offset,
        length_error=2e-3,
    )
    return replace(contact, **changes)


def blocked_step(
    body: Robot,
    pressure: Sequence[float],
    force: float,
    *,
    time: float | None = None,
    solve_time: float = 0.0123,
    **changes: Any,
) -> Step:
    """Return a solved blocked step; its shape is a bulge of no physics that ends at the wall."""
    values = np.array(pressure, dtype=float)
    contact = contact_of(body, values, force=force, **changes)
    pose = contact.free
    s = pose.shape.arc
    bulge = 0.12 * body.length * np.sin(np.pi * s)
    held = contact.wall_point[0] * s
    position = np.column_stack([bulge + held, 0 * s, pose.stretch * body.length * s])
    slope = np.gradient(position[:, 0], position[:, 2])
    rotation = np.stack([_rotation(np.array([0.0, 1.0, 0.0]), a) for a in np.arctan(slope)])
    position = position - contact.tip_cap * rotation[-1, 0, 2] * s[:, None] * np.array([1.0, 0, 0])
    shape = replace(pose.shape, position=position, rotation=rotation)
    blocked = replace(
        pose, tip_position=position[-1], tip_rotation=rotation[-1], bending_angle=0.7 * pose.bending_angle, shape=shape
    )
    return arc_step(body, pressure, pose=blocked, contact=contact, time=time, solve_time=solve_time)


def blocked_run(
    steps: int = 6,
    to: float = 1.5e5,
    name: str = "D25L60",
    force: float = 1.2,
    failed: Sequence[int] = (),
    **changes: Any,
) -> Run:
    """Return a blocked force that rises with the pressure of set 1; the steps in `failed` end in a fold."""
    body = robot(name)
    made = []
    for k, level in enumerate(np.linspace(0, to, steps)):
        pressure = [level, 0.0, 0.0]
        if k in failed:
            made.append(failed_step(pressure, status=Status.FOLD))
        elif level == 0:
            made.append(replace(blocked_step(body, pressure, 0.0, **changes), status=Status.NO_CONTACT))
        else:
            made.append(blocked_step(body, pressure, force * level / to, **changes))
    return run_of(made, name, study="blocked-force", contact=ContactSettings())


def offset_run(offsets: Sequence[float] = (0.0, -0.01, -0.02, -0.03), force: float = 1.2) -> Run:
    """Return a characteristic curve at 1.5 bar: the force falls to 0 over the offsets [m]."""
    body = robot("D25L60")
    made = [
        blocked_step(body, [1.5e5, 0, 0], force * (1 - k / (len(offsets) - 1)), offset=h) for k, h in enumerate(offsets)
    ]
    made[-1] = replace(made[-1], status=Status.NO_CONTACT)
    return run_of(made, "D25L60", study="blocked-force", contact=ContactSettings())


def weighted_run() -> Run:
    """Two steps of the `weighted` closure, and one that failed."""
    body = robot("D25L60")
    left = (EquationResidual("e_n", 0.03, "N", 0.15), EquationResidual("e_m", 2e-3, "N m", 0.4))
    made = [blocked_step(body, [p, 0, 0], 0.5, closure="weighted", weighted=left) for p in (5e4, 1e5)]
    contact = ContactSettings(closure="weighted", weights=ClosureWeights(force=2.0, moment=30.0, length=4e3))
    return run_of([*made, failed_step([1.5e5, 0, 0])], study="blocked-force", contact=contact)
