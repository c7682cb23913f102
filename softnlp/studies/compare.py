"""Comparing the model with measurements: every measured row simulated by every variant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES
from softnlp.model.contact_settings import CLOSURES, ContactSettings
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.step import Step
from softnlp.statics.wall import checked_contact, standing_wall
from softnlp.studies.comparison import NUMBERS, Comparison, Solved
from softnlp.studies.forward import checked_loads, followed
from softnlp.studies.measurements import Measurements, Observed, observed
from softnlp.studies.registered import fitted, sensor_places, sensor_turns
from softnlp.studies.registration import Registration, across
from softnlp.studies.variants import Variant

Array = NDArray[np.float64]

SHAPES = ("free", "blocked")
_POSE, _FORCE, _ORIENTATION = slice(0, 6), NUMBERS.index("blocked_force"), NUMBERS.index("orientation")
Tell = Callable[[int], None]
"""Called with how many rows were solved since the last call."""


def compare(
    measurements: Measurements | Sequence[Measurements],
    variants: Variant | Sequence[Variant],
    *,
    contact: ContactSettings = ContactSettings(),
    loads: Loads = Loads(),
    numerics: Numerics = Numerics(),
    shape: Literal["free", "blocked"] = "free",
    together: bool = False,
    progress: Callable[[int, int], None] | None = None,
    registration: Registration | None = None,
) -> Comparison:
    """Simulate what was measured with each variant of the model and return how far they are apart.

    Parameters
    ----------
    measurements
        Of one robot or of several, as for `softnlp.identify`; noise and weights in them change nothing.
    variants
        Laws, coefficients, conventions and closures; `softnlp.studies.variants.every_variant` combines them.
    contact
        The wall of blocked forces; one wall for all rows of a robot.
    loads, numerics
        As `softnlp.forward`; the same in every row.
    shape
        Whether tips, angles and elongations are those of the free robot or of the one that the wall blocks.
    together
        Solve all rows of a robot at once, as a workspace sweep does, instead of one after the other: for many rows.
    progress
        Called with how many solves are done, and how many there are.
    registration
        Where the sensor of the tips is and in which frame; what it fits is found for each robot and variant by itself.

    Returns
    -------
    Comparison
        A row that has no solution keeps a named status and has no errors.

    Raises
    ------
    InputError
        For measurements, variants, loads or a wall that are not right.

    """
    given = (measurements,) if isinstance(measurements, Measurements) else tuple(measurements)
    asked = (variants,) if isinstance(variants, Variant) else tuple(variants)
    if not given:
        raise InputError("expected measurements of at least one robot", key="measurements")
    if not asked:
        raise InputError("expected at least one variant", key="variants")
    if shape not in SHAPES:
        raise InputError(f"expected one of {', '.join(SHAPES)}, got {shape!r}", key="shape")
    for variant in asked:
        if variant.closure is not None and variant.closure not in CLOSURES:
            raise InputError(f"expected one of {', '.join(CLOSURES)}, got {variant.closure!r}", key="closure")
    robots = tuple(observed(m, NUMBERS) for m in given)
    loads, contact = checked_loads(loads), checked_contact(contact, [o.robot for o in robots])
    if registration is not None:
        if "clock" in registration.fit and across(loads):
            raise InputError("loads across the axis need it given; identify fits it", key="registration.clock")
        loads = registration.in_sets(loads)
    done, total = 0, _solves(robots, asked, shape == "blocked")

    def tell(rows: int) -> None:
        nonlocal done
        done += rows
        if progress is not None:
            progress(done, total)

    solve = _solved_together if together else _solved_in_order
    work = _Work(partial(solve, numerics, loads, tell), contact, shape == "blocked", registration)
    simulated = tuple(tuple(work.solved(variant, o) for o in robots) for variant in asked)
    return Comparison(robots, asked, simulated, contact, shape)


class _Work:
    """Solves the rows of one robot after the other; free poses once for all closures."""

    def __init__(
        self,
        solve: Callable[[Model, Array, ContactSettings | None], Solved],
        contact: ContactSettings,
        blocked: bool,
        registration: Registration | None = None,
    ) -> None:
        self._solve = solve
        self._contact = contact
        self._blocked = blocked
        self._registration = registration
        self._free: dict[tuple[int, ...], Solved] = {}

    def solved(self, variant: Variant, o: Observed) -> Solved:
        """Return what a variant says of the rows of a robot."""
        model = Model(o.robot, variant.material, variant.coefficients, variant.conventions)
        closure: Any = variant.closure or self._contact.closure
        values = np.full((len(o.pressure), len(NUMBERS)), np.nan)
        status: list[Status | None] = [None] * len(values)
        message = [""] * len(values)
        through: set[int] = set()

        turns = np.full((len(values), 9), np.nan)

        def put(rows: NDArray[np.intp], found: Solved, columns: slice | int) -> None:
            values[rows, columns] = found.values[:, columns]
            if columns != _FORCE and found.turns is not None:
                turns[rows] = found.turns
            through.update(rows[list(found.self_intersecting)].tolist())
            for row, ended, words in zip(rows.tolist(), found.status, found.message, strict=True):
                known = status[row]
                if known is None or known.has_solution:  # else what came first is told
                    status[row], message[row] = ended, words

        free, at_wall = _rows(o, self._blocked)
        if free.size:
            put(free, self._free_poses(variant, model, o, free), _POSE)
        if at_wall.size:
            found = self._solve(model, o.pressure[at_wall], replace(self._contact, closure=closure))
            put(at_wall, found, slice(0, len(NUMBERS)) if self._blocked else _FORCE)
        placed = self._registration
        if placed is not None:
            placed = fitted(placed, values[:, :3], turns, o)
            values[:, :3] = sensor_places(placed, values[:, :3], turns)
        if o.measured[:, _ORIENTATION].any():
            left = np.linalg.norm(sensor_turns(placed or Registration(), turns, o), axis=1)
            values[:, _ORIENTATION] = 2 * np.arcsin(np.minimum(left / 2, 1))
        values[~np.isfinite(o.values)] = np.nan
        return Solved(values, tuple(status), tuple(message), frozenset(through), registration=placed)

    def _free_poses(self, variant: Variant, model: Model, o: Observed, rows: NDArray[np.intp]) -> Solved:
        key = _free_key(variant, o)
        if key not in self._free:
            self._free[key] = self._solve(model, o.pressure[rows], None)
        return self._free[key]


def _rows(o: Observed, blocked: bool) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which rows are solved free and which against the wall."""
    if blocked:
        return np.zeros(0, np.intp), np.arange(len(o.pressure))
    posed = o.measured[:, _POSE].any(axis=1) | o.measured[:, _ORIENTATION]
    return np.flatnonzero(posed), np.flatnonzero(o.measured[:, _FORCE])


def _free_key(variant: Variant, o: Observed) -> tuple[int, ...]:
    """Return what a free pose depends on: everything but the closure."""
    return id(variant.material), id(variant.coefficients), id(variant.conventions), id(o)


def _solves(robots: Sequence[Observed], variants: Sequence[Variant], blocked: bool) -> int:
    """Return how many rows there are to solve."""
    free = {_free_key(variant, o): _rows(o, blocked)[0].size for variant in variants for o in robots}
    return sum(free.values()) + len(variants) * sum(_rows(o, blocked)[1].size for o in robots)


def _solved_in_order(
    numerics: Numerics, loads: Loads, tell: Tell, model: Model, pressure: Array, contact: ContactSettings | None
) -> Solved:
    """Return the poses at pressures (rows, sets) [Pa], each from the last, against the wall of `contact` if any."""
    solver: Any = pose_solver(model, numerics) if contact is None else blocked_solver(model, numerics, contact)
    wall = () if contact is None else (standing_wall(solver.poses, contact, pressure, loads),)
    steps = followed(lambda P, near: solver.solve(P, loads, *wall, near), pressure, lambda *_: tell(1))
    length = float(model.robot.length)
    values = np.array([_numbers(step, length) for step in steps]).reshape(-1, len(NUMBERS))
    through = frozenset(k for k, step in enumerate(steps) if step.pose and step.pose.fit.self_intersecting)
    turns = np.array([_turn(step) for step in steps]).reshape(-1, 9)
    return Solved(values, tuple(step.status for step in steps), tuple(step.message for step in steps), through, turns)


def _turn(step: Step) -> Array:
    """Return the rotation of a step's tip by columns (9,), nan where it has none."""
    pose = step.pose
    return np.full(9, np.nan) if pose is None else np.asarray(pose.tip_rotation).ravel(order="F")


def _numbers(step: Step, length: float) -> list[float]:
    """Return `NUMBERS` of a step, nan where it has none."""
    pose = step.pose
    if pose is None or not step.status.has_solution:
        return [np.nan] * len(NUMBERS)
    force = np.nan if step.contact is None else step.contact.force
    return [*pose.tip_position, pose.bending_angle, pose.backbone_length - length, pose.tilt, force, np.nan]


def _solved_together(
    numerics: Numerics, loads: Loads, tell: Tell, model: Model, pressure: Array, contact: ContactSettings | None
) -> Solved:
    """Return the same of all rows at once, as a workspace sweep solves them."""
    order = np.arange(len(pressure), dtype=np.int64)
    plan = Plan(model, loads, numerics, contact, ("pressure",), np.ascontiguousarray(pressure), order)
    solver = ChunkSolver(plan)
    values, turns = np.full((len(pressure), len(NUMBERS)), np.nan), np.full((len(pressure), 9), np.nan)
    status = [Status.DIVERGED] * len(pressure)
    message = [""] * len(pressure)
    through: set[int] = set()
    for chunk in range(plan.chunks):
        block = solver.solve(chunk)
        members, rows = plan.members(chunk), block.rows
        through.update(members[rows["self_intersecting"] == 1].tolist())
        axis = rows["tip_rotation"][:, :, 2]
        turns[members] = rows["tip_rotation"].transpose(0, 2, 1).reshape(-1, 9)
        tilt = np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2])
        values[members, :3] = rows["tip_position"]
        pose = (rows["bending_angle"], rows["backbone_length"] - float(model.robot.length), tilt)
        values[members, 3:6] = np.column_stack(pose)
        if contact is not None:
            values[members, _FORCE] = rows["blocked_force"]
        for k, number in enumerate(members.tolist()):
            status[number] = STATUSES[rows["status"][k]]
            message[number] = status[number].advice
        for number, words in block.messages:
            message[number] = words
        tell(len(members))
    lost = np.array([not s.has_solution for s in status])
    values[lost] = np.nan
    return Solved(values, tuple(status), tuple(message), frozenset(through), turns)
