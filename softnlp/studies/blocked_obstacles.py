"""The blocked force of a tip beside obstacles: the wall is one more plane, which the axis of the tip touches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.obstacles import Obstacle, Plane
from softnlp.model.rod import Loads
from softnlp.statics.obstacle_solver import among_obstacles
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Contact, Step
from softnlp.statics.wall import standing_wall
from softnlp.studies.forward import followed

Array = NDArray[np.float64]

WALL = "measuring wall"
"""What the wall is called beside the obstacles."""


def require_plain_wall(contact: ContactSettings) -> None:
    """Raise `InputError` for a wall that is not offered beside obstacles."""
    if contact.closure not in ("free", "none"):
        text = f"expected 'free' beside [[obstacle]], which have no closure, got {contact.closure!r}"
        raise InputError(text, key="closure")
    if contact.wall_point is None and contact.offset > 0:
        text = "expected at most 0 beside [[obstacle]], where no wall presses the tip without pressure"
        raise InputError(text, key="offset_mm")
    if contact.tip_cap:
        raise InputError("expected 0 beside [[obstacle]], where the axis of the tip touches", key="tip_cap_mm")


def blocked_among(
    poses: PoseSolver,
    pressures: Array,
    loads: Loads,
    contact: ContactSettings,
    obstacles: Sequence[Obstacle],
    progress: Callable[[int, Step], None] | None = None,
    times: Sequence[float] | None = None,
) -> tuple[Step, ...]:
    """Return a step a pressure, with what the wall and the obstacles do.

    poses : of the model without obstacles. pressures : (steps, sets) [Pa]. contact : see `require_plain_wall`; a wall
    at an offset stands where the free shape goes without the obstacles.

    Raises
    ------
    InputError
        As `require_plain_wall` and `among_obstacles`.
    """
    require_plain_wall(contact)
    wall = standing_wall(poses, contact, pressures, loads)
    plane = Plane(point=tuple(wall.point), normal=tuple(wall.normal), part="tip axis", name=WALL)
    point, normal = np.array(plane.point), np.array(plane.normal)
    free, walled = among_obstacles(poses, obstacles), among_obstacles(poses, [*obstacles, plane])

    def solve(pressure: Array, near: Any) -> tuple[Step, Any]:
        near_free, near_walled = near or (None, None)
        unblocked, found = free.solve(pressure, loads, near_free)
        if unblocked.pose is None:
            return unblocked, (near_free, near_walled)
        gap = float((unblocked.pose.tip_position - point) @ normal)
        step, touched = walled.solve(pressure, loads, near_walled)
        if step.pose is None:
            return step, (found, near_walled)
        force = float(step.contacts[-1].force @ normal)
        pressed = Contact(
            force=force,
            normal=normal,
            wall_point=point,
            tip_cap=0.0,
            closure=contact.closure_name,
            chamber_reaction=np.zeros(poses.model.chambers),
            free=unblocked.pose,
            gap=gap,
            length_error=0.0,
        )
        step = replace(step, contact=pressed, contacts=step.contacts[:-1])
        if touched is not None and not touched.active[-1].any():
            step = replace(step, status=Status.NO_CONTACT, message=Status.NO_CONTACT.advice)
        return step, (found, touched)

    return followed(solve, pressures, progress, times)
