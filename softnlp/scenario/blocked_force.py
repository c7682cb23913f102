"""The wall of a scenario, [contact], and a blocked force against it: what is asked, in SI units, and the run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from softnlp.base.errors import InputError, located
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.model.contact_settings import ClosureWeights, ContactSettings, ContactTask, require_in_front
from softnlp.model.robot import Robot
from softnlp.model.segments import SegmentedRobot
from softnlp.scenario.data import Read, Scenario, run_of
from softnlp.scenario.schema import ContactTable
from softnlp.statics.kept import pose_solver
from softnlp.statics.step import Run, Step
from softnlp.studies.blocked_chain import require_free
from softnlp.studies.blocked_force import blocked_force, constrained_pose, force_against_offset
from softnlp.studies.blocked_obstacles import blocked_among, require_plain_wall
from softnlp.studies.force_inversion import pressure_for_force

SEVERAL = ("offsets_mm", "offset_ramp", "target_force_N")
"""Keys that ask for something else than the force at each pressure."""
_WEIGHTS = {
    "force": ("weight_force_per_N", 1.0),
    "moment": ("weight_moment_per_Nmm", NEWTON_MILLIMETRE),
    "length": ("weight_length_per_mm", MILLIMETRE),
    "position": ("weight_position_per_mm", MILLIMETRE),
}
_WEIGHT_KEYS = tuple(key for key, _ in _WEIGHTS.values())
_OFFSETS = ("offset_mm", "offsets_mm", "offset_ramp")
_PLACE = ("wall_point_mm", "wall_normal")


def contact_settings(table: ContactTable, robot: Robot | None = None, *, energy: bool = False) -> ContactSettings:
    """Return where the wall stands and how the problem is closed.

    robot : whose unbent tip may not start behind a wall given by a point; None leaves that to the study.
    energy : whether the conventions are, which have no closure.

    Raises
    ------
    InputError
        With the key (no table, no source), for keys that do not go together, and as `require_in_front`.
    """
    if len(place := table.written(_PLACE)) == 1:
        raise InputError(f"missing; expected together with {place[0]}", key=next(k for k in _PLACE if k not in place))
    offsets = table.written(_OFFSETS)
    if len(offsets) > 1:
        raise InputError(f"expected at most one of {', '.join(_OFFSETS)}, got {' and '.join(offsets)}", key=offsets[1])
    if place:
        table.refuse(["offset_mm"], "expected either offset_mm or wall_point_mm and wall_normal, got both")
    if table.closure != "weighted":
        problem = f"expected only with closure = 'weighted', got closure = {table.closure!r}"
        table.refuse((*_WEIGHT_KEYS, "weight_sensitivity"), problem)
    point = None
    if table.wall_point_mm is not None:
        x, y, z = (component * MILLIMETRE for component in table.wall_point_mm)
        point = (x, y, z)
    weights = {name: getattr(table, key) / unit for name, (key, unit) in _WEIGHTS.items() if table.written([key])}
    settings = ContactSettings(
        offset=(table.offset_mm or 0.0) * MILLIMETRE,
        tip_cap=table.tip_cap_mm * MILLIMETRE,
        closure="none" if energy else table.closure,
        wall_point=point,
        wall_normal=table.wall_normal,
        weights=ClosureWeights(**weights),
    )
    if robot is not None:
        require_in_front(settings, [float(robot.length)], _offsets(table) or ())
    return settings


def _offsets(table: ContactTable) -> list[float] | None:
    """Return the offsets of a characteristic curve [m], or None where none is asked for."""
    offsets = table.offsets_mm
    if table.offset_ramp is not None:
        ramp = table.offset_ramp
        offsets = np.linspace(ramp.from_mm, ramp.to_mm, ramp.steps).tolist()
    return None if offsets is None else [h * MILLIMETRE for h in offsets]


def contact_task(given: Read) -> ContactTask:
    """Return what is asked of the wall.

    Raises
    ------
    InputError
        As `contact_settings`, and where the pressures do not fit what is asked.
    """
    table, pressures = given.file.contact, given.steps.pressures
    if isinstance(given.robot, SegmentedRobot):
        require_free(contact_settings(table))
        for key in table.written((*SEVERAL, "weight_sensitivity")):
            raise InputError("expected only with one uniform segment so far", key=key)
        if table.mode != "blocked":
            raise InputError("expected 'blocked' with several segments or a section that varies", key="mode")
    if given.file.obstacle:
        require_plain_wall(contact_settings(table, energy=given.file.corrections.conventions == "energy"))
        for key in table.written((*SEVERAL, "weight_sensitivity")):
            raise InputError("not with [[obstacle]] so far; ask for the force at each pressure", key=key)
        if table.mode != "blocked":
            raise InputError(
                "expected 'blocked' beside [[obstacle]]; without a wall use study = \"forward\"", key="mode"
            )
    several = table.written(SEVERAL)
    constrained = table.mode == "constrained"
    if table.weight_sensitivity:
        if not table.written(_WEIGHT_KEYS):
            raise InputError(f"expected at least one of {', '.join(_WEIGHT_KEYS)} with it", key="weight_sensitivity")
        for other in [*several, *["mode = 'constrained'"] * constrained][:1]:
            problem = f"expected only where the force is asked for at each pressure, got {other}"
            raise InputError(problem, key="weight_sensitivity")
    if constrained:
        wall = (*_OFFSETS, *_PLACE, "target_force_N", "tip_cap_mm")
        table.refuse(wall, "expected only with mode = 'blocked': mode = 'constrained' has no wall")
        if table.closure == "free":
            raise InputError(
                "expected 'compliant', 'rigid' or 'weighted' with mode = 'constrained', got 'free', which constrains "
                'nothing; use study = "forward"',
                key="closure",
            )
        return ContactTask(constrained=True)
    if len(several) > 1:
        raise InputError(f"expected at most one of {', '.join(several)}", key=several[1])
    if table.target_force_N is not None:
        if not pressures[-1].any() or np.ptp(pressures[-1][pressures[-1] > 0]) > 0:
            raise InputError(
                "expected [pressure] to end with one pressure in the sets that are to push, which bounds the search, "
                "and none in the others",
                key="target_force_N",
            )
        return ContactTask(target_force=table.target_force_N)
    offsets = _offsets(table)
    if offsets is None:
        return ContactTask(weight_sensitivity=table.weight_sensitivity)
    if len(pressures) != 1:
        raise InputError(
            f"expected one step in [pressure] with several offsets, got {len(pressures)}; give sequence_bar one row",
            key=several[0],
        )
    return ContactTask(offsets=tuple(offsets))


def run_blocked(scenario: Scenario, progress: Callable[[int, Step], None] | None, branches: int = 0) -> Run:
    """Run a blocked force; `branches` other starts a step are tried for other equilibria.

    Raises
    ------
    InputError
        For pressures or loads that the study refuses.
    """
    contact, task = scenario.contact, scenario.task
    assert contact is not None
    assert isinstance(task, ContactTask)
    model, settings = (scenario.robot, scenario.material), scenario.settings
    times = None if scenario.times is None else scenario.times.tolist()
    if task.constrained:
        settings |= {"weights": contact.weights}
        steps = []
        for k, pressure in enumerate(scenario.pressures):
            step = constrained_pose(*model, pressure, closure=contact.closure, **settings)
            steps.append(step if times is None else replace(step, time=times[k]))
            if progress is not None:
                progress(k, steps[-1])
        return run_of(scenario, steps)
    if task.target_force is not None:
        bound = scenario.pressures[-1]
        sets = np.flatnonzero(bound).tolist()
        _, step = pressure_for_force(*model, sets, task.target_force, contact, highest=float(bound.max()), **settings)
        if progress is not None:
            progress(0, step)
        return run_of(scenario, [step])
    if scenario.obstacles:
        poses = pose_solver(scenario.model, scenario.numerics)
        with located(source=str(scenario.path)):
            steps = list(
                blocked_among(poses, scenario.pressures, scenario.loads, contact, scenario.obstacles, progress, times)
            )
        return run_of(scenario, steps)
    settings |= {"title": scenario.title, "progress": progress}
    if task.offsets is not None:
        return force_against_offset(*model, scenario.pressures[0], task.offsets, contact, **settings)
    settings |= {"times": times, "branches": branches, "weight_sensitivity": task.weight_sensitivity}
    return blocked_force(*model, scenario.pressures, contact, **settings)
