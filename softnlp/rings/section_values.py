"""What the energy section takes from the rings of its thread, as values at stretches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from softnlp.model.conventions import CONVENTIONS, UNIAXIAL, Conventions
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.robot import Robot
from softnlp.model.round_layout import turned_round
from softnlp.rings.outline import Array


def ring_values(robot: Robot, stretches: Sequence[float]) -> tuple[Array, Array]:
    """Return lambda T / 2, by which the body is stiffer, and the circle's ratio a at stretches (n,).

    Beyond the range that was solved for the section they go on as `Curve` says. Responses are kept by the section's
    shape. Raises `RingError` for a section that cannot be meshed.
    """
    from softnlp.rings.outlined import outlined_response  # finite elements, which few runs need
    from softnlp.rings.response import robot_response

    if isinstance(robot, OutlinedRobot):
        if (layout := turned_round(robot)) is None:
            return outlined_response(robot).values(stretches)
        robot = layout
    response, at = robot_response(robot), np.asarray(stretches, float)
    p, q = response.plane_stretches(at)
    return np.asarray(at * (p**2 + q**2) / 2), np.asarray(response.circle_ratio(at))


def pressed(robot: OutlinedRobot) -> tuple[Array, Array]:
    """Return `softnlp.rings.outlined.pressed_areas` of a robot."""
    from softnlp.rings.outlined import pressed_areas

    return pressed_areas(robot)


ENERGY: Conventions = replace(UNIAXIAL, rings=ring_values, pressed=pressed)
"""The energy section, with the rings of its thread."""

ALL_CONVENTIONS = {**CONVENTIONS, ENERGY.name: ENERGY}
"""By the name that a scenario has for them."""
