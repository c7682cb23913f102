"""One pose after another as a slider moves: the solvers of a session, kept between poses."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from softnlp.model.contact_settings import ContactSettings, ContactTask
from softnlp.model.rod import Loads
from softnlp.model.segments import SegmentedRobot, body_of
from softnlp.scenario.data import run_of
from softnlp.scenario.read import Scenario
from softnlp.scenario.run import solve_steps
from softnlp.statics.arc import arc_pose, unloaded_arc
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.chain_grid import chain_equations
from softnlp.statics.chain_solver import ChainSolver
from softnlp.statics.compiled import rod_equations
from softnlp.statics.obstacle_solver import ObstacleSolver, among_obstacles
from softnlp.statics.pose_grid import Solved
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Pose, Run, Step
from softnlp.statics.wall import standing_wall
from softnlp.studies.uncertainty import Deviations

Array = NDArray[np.float64]


class LivePoses:
    """Solves single poses of changing scenarios, each from the last; what is compiled is kept while it fits.

    CasADi's solvers are not to be used by two threads at once, so calls wait for each other.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._poses: dict[Hashable, PoseSolver] = {}
        self._blocked: dict[Hashable, BlockedSolver] = {}
        self._near: Solved | None = None
        self._near_kind: Hashable = None
        self._deviations: tuple[Scenario, bool, Deviations] | None = None
        self._among: tuple[Scenario, ObstacleSolver] | None = None

    def pose(self, scenario: Scenario, pressure: Array) -> tuple[Run, Pose | None]:
        """Return a run of one step at a pressure (sets,) [Pa], and the shape there without loads where loads act.

        Among obstacles the other shape is that without them. The step is that of `softnlp.forward` with these settings
        (among obstacles it is followed from rest, as the first step there is). Never raises for a pose that cannot be
        solved.

        Raises
        ------
        InputError
            Where obstacles do not fit the robot: one that it overlaps at rest, for instance.
        """
        with self._lock:
            solver = self._solver(scenario)
            among = self._obstacles(solver, scenario) if scenario.obstacles else None
            step, solved = solver.solve(pressure, scenario.loads, self._start(scenario))
            self._near, self._near_kind = solved or self._near, _kind(scenario)
            if among is not None:
                free = step.pose
                step, _ = among.solve(pressure, scenario.loads)
                run = replace(run_of(scenario, [step]), study="forward", contact=None)
                return run, free if any(contact.force.any() for contact in step.contacts) else None
            step = self._scattered(scenario, step)
            run = replace(run_of(scenario, [step]), study="forward", contact=None)  # a pose of whatever study it is
            return run, self._ghost(solver, scenario, step)

    def blocked(self, scenario: Scenario, pressure: Array) -> tuple[Run, Pose | None]:
        """Return a run of one step of the blocked force at a pressure (sets,) [Pa], and the free shape there.

        The step is that of `softnlp.blocked_force`, or of `softnlp.constrained_pose` where there is no wall.

        Raises
        ------
        InputError
            Where the wall does not fit the pressures.
        """
        assert scenario.contact is not None
        if isinstance(scenario.robot, SegmentedRobot) or scenario.obstacles:
            with self._lock:
                run = solve_steps(replace(scenario, pressures=np.atleast_2d(pressure), times=None))
            pressed = run.steps[0].contact
            return run, None if pressed is None else pressed.free
        constrained = isinstance(scenario.task, ContactTask) and scenario.task.constrained
        with self._lock:
            solver = self._blocked_solver(scenario, scenario.contact, not constrained)
            wall = None
            if not constrained:
                wall = standing_wall(solver.poses, scenario.contact, np.atleast_2d(pressure), scenario.loads)
            step, _ = solver.solve(pressure, scenario.loads, wall)
            step = self._scattered(scenario, step)
        free = None if step.contact is None else step.contact.free
        return run_of(scenario, [step]), free

    def _scattered(self, scenario: Scenario, step: Step) -> Step:
        """Return the step with standard deviations, where the scenario says what scatters."""
        if scenario.uncertainty is None:
            return step
        pressed, kept = step.contact is not None, self._deviations
        if kept is None or kept[0] is not scenario or kept[1] is not pressed:
            contact = scenario.contact if pressed else None
            asked = scenario.model, scenario.numerics, scenario.loads, contact, scenario.uncertainty
            self._deviations = kept = scenario, pressed, Deviations(*asked)
        return kept[2].added(step)

    def _start(self, scenario: Scenario) -> Solved | None:
        """Return the last pose, where it is one of the same kind of problem."""
        return self._near if self._near_kind == _kind(scenario) else None

    def _solver(self, scenario: Scenario) -> PoseSolver:
        kind = _kind(scenario)
        if kind not in self._poses:
            self._poses.clear()  # one kind at a time: a compiled grid is some megabytes
            self._poses[kind] = _compiled(scenario)
        return self._poses[kind].with_model(scenario.model)

    def _obstacles(self, solver: PoseSolver, scenario: Scenario) -> ObstacleSolver:
        """Return the solver among the scenario's obstacles; it shares what the other one compiles."""
        if self._among is None or self._among[0] is not scenario:
            self._among = scenario, among_obstacles(solver, scenario.obstacles)
        return self._among[1]

    def _blocked_solver(self, scenario: Scenario, contact: ContactSettings, wall: bool) -> BlockedSolver:
        kind = (_kind(scenario), contact.closure, wall)
        if kind not in self._blocked:
            self._blocked.clear()
            self._blocked[kind] = BlockedSolver(scenario.model, scenario.numerics, contact, wall=wall)
        return self._blocked[kind].with_contact(contact).with_model(scenario.model)

    def _ghost(self, solver: PoseSolver, scenario: Scenario, step: Step) -> Pose | None:
        if step.pose is None or not np.any(_loads(scenario.loads)):
            return None
        if isinstance(scenario.robot, SegmentedRobot):
            return solver.solve(step.pressure, Loads(), self._near)[0].pose
        return arc_pose(solver, unloaded_arc(solver, step.pressure)[1])


def _loads(loads: Loads) -> Array:
    return np.array([loads.tip_force, loads.tip_moment, loads.gravity], dtype=float)


def _compiled(scenario: Scenario) -> PoseSolver:
    """Return a solver with equations of its own: those that are kept elsewhere are another thread's."""
    model = scenario.model
    if not isinstance(model.robot, SegmentedRobot):
        return PoseSolver(model, scenario.numerics)
    body = body_of(model)
    equations = chain_equations(body, tuple(rod_equations(part) for part in body.models))
    return ChainSolver(model, scenario.numerics, equations=equations)


def _kind(scenario: Scenario) -> Hashable:
    """Return what a compiled solver is made for; numbers may differ."""
    model = scenario.model
    kind = body_of(model).kind if isinstance(model.robot, SegmentedRobot) else model.kind
    return kind, scenario.numerics
