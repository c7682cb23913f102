"""Where the wall of a blocked force stands, which way it pushes, and what moves along a path towards a step."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.ranges import POSITION
from softnlp.base.status import Status
from softnlp.model.contact_settings import CLOSURES, NO_CLOSURE, Closure, ContactSettings, require_in_front
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.statics.arc import unloaded_arc
from softnlp.statics.chain_solver import ChainSolver
from softnlp.statics.loadcase import unpack_section
from softnlp.statics.solver import PoseSolver

Array = NDArray[np.float64]

_SIDEWAYS = 1e-9  # of the length: a free tip that moves less has no side


@dataclass(frozen=True, eq=False)
class Wall:
    """A plane without friction: a point of it [m] and the unit normal in which it pushes the robot; world frame."""

    point: Array
    normal: Array

    def gap(self, contact_point: Array) -> float:
        """Return how far a point is in front of the wall; negative beyond it [m]."""
        return float(self.normal @ (contact_point - self.point))

    @property
    def plane(self) -> Array | None:
        """The unit normal of the plane through +z in which the wall pushes; None where it pushes along z."""
        across = np.array([-self.normal[1], self.normal[0], 0.0])
        size = float(np.linalg.norm(across))
        return across / size if size > 1e-9 else None


def _wall_at(offset: float, rest: Array, furthest: Array) -> Wall:
    """Return the wall at x = offset [m], which pushes against the way the free shape goes.

    rest, furthest : (3,) the contact point without pressure and of the free shape at the largest pressure [m]. An
    offset on the other side preloads the robot.
    """
    moved = float(furthest[0] - rest[0])
    if abs(moved) <= _SIDEWAYS * float(np.linalg.norm(rest)):
        moved = offset - float(rest[0]) or -1.0
    return Wall(np.array([offset, 0.0, 0.0]), np.array([-np.sign(moved), 0.0, 0.0]))


def with_closure(model: Model, contact: ContactSettings) -> ContactSettings:
    """Return the settings, or raise `InputError` for a closure that the model's section does not have."""
    if model.section.coupled and contact.closure != NO_CLOSURE:
        text = f"{contact.closure_name!r} is not used with conventions energy; expected 'none'"
        raise InputError(text, key="closure")
    if contact.closure == NO_CLOSURE and not model.section.coupled:
        raise InputError("expected 'none' only with conventions energy", key="closure")
    return contact


def checked_contact(
    contact: ContactSettings, robots: Iterable[Robot] = (), offsets: Iterable[float] = ()
) -> ContactSettings:
    """Return the settings with a unit normal, or raise `InputError` naming what is not right.

    robots, offsets : whose unbent tips may not start behind the wall, and how far that is moved (`require_in_front`).
    """
    if contact.closure not in (*CLOSURES, NO_CLOSURE) and not isinstance(contact.closure, Closure):
        raise InputError(f"expected one of {', '.join(CLOSURES)}, got {contact.closure!r}", key="closure")
    numbers = {"offset": contact.offset, "tip_cap": contact.tip_cap}
    for key, value in numbers.items():
        if not np.all(np.isfinite(value)):
            raise InputError("expected a finite length", key=key)
        POSITION.require(value, key)
    if contact.tip_cap < 0:
        raise InputError("expected a length that is not negative", key="tip_cap")
    if (contact.wall_point is None) != (contact.wall_normal is None):
        raise InputError("expected a wall's point and normal, or neither", key="wall_normal")
    for key in ("force", "moment", "length", "position"):
        weight = getattr(contact.weights, key)
        if weight is not None and not (np.isfinite(weight) and weight > 0):
            raise InputError("expected a weight above 0", key=f"weights.{key}")
    if contact.wall_point is None or contact.wall_normal is None:
        return contact
    point, normal = (np.asarray(v, float) for v in (contact.wall_point, contact.wall_normal))
    size = float(np.linalg.norm(normal)) if normal.shape == (3,) else 0.0
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise InputError("expected three finite numbers", key="wall_point")
    POSITION.require(point, "wall_point")
    if not np.isfinite(size) or size == 0:
        raise InputError("expected three numbers that are not all zero", key="wall_normal")
    x, y, z = (float(v) for v in normal / size)
    contact = replace(contact, wall_normal=(x, y, z))
    require_in_front(contact, [float(robot.length) for robot in robots], offsets)
    return contact


@dataclass(frozen=True, eq=False)
class Situation:
    """What is given in one blocked pose: (sets,) pressure [Pa], dead loads, the wall (None: no wall)."""

    pressure: Array
    loads: Loads
    wall: Wall | None

    def turned_as(self, other: Situation) -> bool:
        """Whether both walls have one normal, or one of them is not there."""
        a, b = self.wall, other.wall
        return a is None or b is None or bool(np.all(a.normal == b.normal))

    def towards(self, other: Situation, t: float) -> Situation:
        """Return the situation a fraction t of the way to another one; the wall keeps the other's normal."""
        if t >= 1.0:
            return other

        def between(a: Any, b: Any) -> Array:
            start = np.asarray(a, float)
            moved: Array = start + t * (np.asarray(b, float) - start)
            return moved

        here, there = self.loads, other.loads
        loads = Loads(
            between(here.tip_force, there.tip_force),
            between(here.tip_moment, there.tip_moment),
            between(here.gravity, there.gravity),
        )
        wall = other.wall
        if wall is not None and self.wall is not None:
            wall = Wall(between(self.wall.point, wall.point), wall.normal)
        return Situation(between(self.pressure, other.pressure), loads, wall)


def standing_wall(poses: PoseSolver, contact: ContactSettings, pressures: Array, loads: Loads) -> Wall:
    """Return the wall that the settings describe; one at an offset stands where the free shape goes.

    pressures : (steps, sets) [Pa], of which the largest sum tells the way. A wall that is given is kept as it is.
    """
    if contact.wall_point is not None and contact.wall_normal is not None:
        return Wall(np.asarray(contact.wall_point, float), np.asarray(contact.wall_normal, float))
    largest = pressures[int(np.argmax(np.sum(pressures, axis=1)))]
    rest = np.array([0.0, 0.0, poses.model.length + contact.tip_cap])
    if loads.act or isinstance(poses, ChainSolver):
        found = poses.solve(largest, loads)
        poses.ahead, pose = (poses.column(poses.values(largest, loads)), found), found[0].pose
        if pose is not None:
            return _wall_at(contact.offset, rest, pose.tip_position + contact.tip_cap * pose.tip_rotation[:, 2])
    for pressure in (largest, 1e-3 * largest):
        tip = _unloaded_tip(poses, pressure)
        if tip is not None:
            return _wall_at(contact.offset, rest, tip[0] + contact.tip_cap * tip[1])
    return _wall_at(contact.offset, rest, rest)


def _unloaded_tip(poses: PoseSolver, pressure: Array) -> tuple[Array, Array] | None:
    """Return the tip [m] of the shape without loads and its axis, None where the stretch ends before this pressure."""
    if isinstance(poses, ChainSolver):  # several arcs, of which no closed form is kept
        pose = poses.solve(pressure, Loads())[0].pose
        return None if pose is None else (pose.tip_position, pose.tip_rotation[:, 2])
    branch, arc = unloaded_arc(poses, pressure)
    return (arc.tip_position, arc.axis) if branch.status is Status.SOLVED else None


def slipping_pressure(begin: Situation, end: Situation, sideways: list[tuple[float, float]]) -> float | None:
    """Return the largest set pressure at which the out-of-plane determinant changed its sign, if it has."""
    for (u, a), (w, b) in pairwise(sideways):
        if a * b < 0:
            return float(np.max(begin.towards(end, u + (w - u) * a / (a - b)).pressure))
    return None


def keeps_plane(plane: Array, c: Array, loads: Loads) -> bool:
    """Whether the section's constants c and the loads keep the rod in a plane of this normal."""
    section = unpack_section(c)
    EI_x, EI_y = section.bending_x, section.bending_y
    section_plane = abs(EI_x - EI_y) <= 1e-9 * abs(EI_x) or min(abs(plane[0]), abs(plane[1])) <= 1e-12
    moment = np.array([section.pressure_moment_x, section.pressure_moment_y, 0.0])
    along = np.cross(plane, [0.0, 0.0, 1.0])
    up = np.array([0.0, 0.0, 1.0])
    pairs = [(moment, along), (np.asarray(loads.tip_moment, float), along)]
    pairs += [(np.asarray(loads.tip_moment, float), up)]
    pairs += [(np.asarray(v, float), plane) for v in (loads.tip_force, loads.gravity)]
    flat = all(abs(v @ d) <= 1e-9 * max(float(np.linalg.norm(v)), 1e-300) for v, d in pairs)
    return section_plane and flat
