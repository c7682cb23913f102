"""Every study of the package beside the paper's method, or SciPy's, on the same task: what is raced, and its error.

The paper's method is single shooting with 20 RK4 steps and Levenberg-Marquardt with finite differences
(`benchmarks.paper_method`). It gets the stretch and the stiffnesses for nothing. Where the paper has no method for a
task (inverse kinematics, identification, design) its forward solve stands inside Nelder-Mead, each solve started from
the last one. Nothing here is solved before the clock starts except what `Entry.prepare` says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks import blocked, inverse, paper_method, scipy_bvp, statics, sweep
from benchmarks.numpy_field import numpy_field
from benchmarks.paper_blocked import solve_blocked
from benchmarks.paper_method import Array, solve_pose
from benchmarks.race import Entry, Judge
from benchmarks.rods import Rods
from softnlp import Loads, Numerics, robot
from softnlp.batch.chunk import ChunkSolver
from softnlp.model.contact_settings import ClosureWeights, ContactSettings
from softnlp.model.quantities import Model
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.solver import PoseSolver
from softnlp.statics.wall import standing_wall
from softnlp.studies.inverse_solver import InverseKinematics
from softnlp.studies.targets import Target

REFERENCE = Numerics(intervals=160)
LEVELS = 13  # of each set in the sweep
FEW = 20  # poses of it that are solved one by one
TARGETS = 4
BLOCKED_ROBOT = "D25L60"


@dataclass(frozen=True, eq=False)
class Task:
    """What is raced. unit : what one answer is. error : what `judge` returns, in words with the unit."""

    name: str
    unit: str
    error: str
    entries: list[Entry]
    judge: Judge


def in_arrays(solve: Callable[[], Any]) -> Callable[[], Any]:
    """Return a solve of the paper's method with its field in NumPy arrays, as one writes it."""

    def solved() -> Any:
        with patch.object(paper_method, "field", numpy_field):
            return solve()

    return solved


def forward(case: str) -> Task:
    """Eleven poses of one set to 1.5 bar, cold and then each from the last."""
    loads, pressures = statics.CASES[case], statics.PRESSURES
    rods = [statics.rod_at(P, loads) for P in pressures]
    exact = statics.our_sequence(PoseSolver(statics.MODEL, REFERENCE), loads, pressures)
    poses = len(pressures)

    def ours(numerics: Numerics) -> Callable[[], Array]:
        return partial(statics.our_sequence, PoseSolver(statics.MODEL, numerics), loads, pressures)

    def bvp() -> Array:
        tips = [scipy_bvp.solve_pose(rod, loads.tip_force, loads.tip_moment, tolerance=1e-6) for rod in rods]
        return np.array(tips)

    def judge(tips: Array) -> float:
        return float(np.linalg.norm(tips - exact, axis=1).max()) / float(statics.MODEL.robot.length)

    theirs = partial(statics.paper_sequence, rods, loads, "arc")
    entries = [
        Entry("softnlp", "auto", lambda: ours(Numerics()), reference=True, units=poses),
        Entry("softnlp", "20 intervals", lambda: ours(statics.FIXED), units=poses),
        Entry("paper's method, floats", "20 steps", lambda: theirs, units=poses),
        Entry("paper's method, arrays", "20 steps", lambda: in_arrays(theirs), units=poses),
        Entry("scipy solve_bvp", "tol 1e-06", lambda: bvp, units=poses, note="each from the arc"),
    ]
    return Task(f"forward, {case}", "pose", "tip position, of L_0", entries, judge)


def blocked_force() -> Task:
    """Five steps of one set to 1.5 bar against the wall at the axis, with the closure of the paper."""
    model = Model(robot(BLOCKED_ROBOT), blocked.SILICONE)
    w = blocked.WEIGHTS
    weights = ClosureWeights(w.n, w.m, w.L, w.h)
    rods = [Rods(model).at(P) for P in blocked.PRESSURES[1:]]
    weighted, compliant = ContactSettings(closure="weighted", weights=weights), ContactSettings()
    exact = our_forces(BlockedSolver(model, Numerics(intervals=80), weighted))

    def theirs(planar: bool) -> Array:
        start, forces = None, []
        for rod in rods:
            answer = solve_blocked(rod, w, start=start, planar=planar)
            if not answer.converged:
                raise RuntimeError("Levenberg-Marquardt reached MINPACK's limit of evaluations")
            start = np.append(answer.base, answer.force)
            forces.append(answer.force)
        return np.array(forces)

    def ours(contact: ContactSettings, numerics: Numerics) -> Callable[[], Array]:
        return partial(our_forces, BlockedSolver(model, numerics, contact))

    def judge(forces: Array) -> float:
        return float(np.max(np.abs(forces - exact)) / exact.max())

    steps = len(rods)
    entries = [
        Entry("softnlp, weighted", "auto", lambda: ours(weighted, Numerics()), reference=True, units=steps),
        Entry("softnlp, weighted", "20 intervals", lambda: ours(weighted, Numerics(intervals=20)), units=steps),
        Entry("softnlp, compliant", "auto", lambda: ours(compliant, Numerics()), units=steps, judged=False,
              note="the default closure: another force"),
        Entry("paper's method, floats, in the plane", "20 steps", lambda: partial(theirs, True), units=steps),
        Entry("paper's method, floats", "20 steps", lambda: partial(theirs, False), units=steps),
        Entry("paper's method, arrays, in the plane", "20 steps", lambda: in_arrays(partial(theirs, True)),
              units=steps),
    ]  # fmt: skip
    return Task("blocked force", "step", "force, of the largest", entries, judge)


def our_forces(solver: BlockedSolver) -> Array:
    """Return the forces [N] of the sequence, the free shapes and the wall included."""
    wall, near, forces = standing_wall(solver.poses, solver.contact, blocked.PRESSURES, Loads()), None, []
    for pressure in blocked.PRESSURES:
        step, solved = solver.solve(pressure, Loads(), wall, near)
        near = solved or near
        if step.contact is None:
            raise RuntimeError(step.message)
        forces.append(step.contact.force)
    return np.array(forces[1:])


def workspace() -> Task:
    """Poses on a grid of three sets to 1.2 bar, with weight and tip force; the paper's method solves a few of them."""
    asked = sweep.plan(LEVELS)
    chosen = np.random.default_rng(0).permutation(asked.poses)[:FEW]
    solver = PoseSolver(sweep.MODEL, REFERENCE)
    exact = np.array([inverse.tip_at(solver, sweep.LOADS, P, None)[0] for P in asked.values[chosen]])
    rods = [statics.rod_at(P, sweep.LOADS) for P in asked.values[chosen]]

    def lane() -> Callable[[], Array]:
        solver = ChunkSolver(asked)

        def solve() -> Array:
            blocks = [solver.solve(k).rows for k in range(asked.chunks)]
            tips = np.empty((asked.poses, 3))
            for rows, k in zip(blocks, range(asked.chunks), strict=True):
                tips[asked.members(k)] = rows["tip_position"]
            return tips[chosen]

        return solve

    def one_by_one() -> Callable[[], Array]:
        solver = PoseSolver(sweep.MODEL, Numerics())
        return lambda: np.array([inverse.tip_at(solver, sweep.LOADS, P, None)[0] for P in asked.values[chosen]])

    def theirs() -> Array:
        return np.array([paper_tip(rod, sweep.LOADS, "arc")[0] for rod in rods])

    def judge(tips: Array) -> float:
        return float(np.linalg.norm(tips - exact, axis=1).max()) / float(sweep.MODEL.robot.length)

    few = len(chosen)
    entries = [
        Entry(
            "softnlp, sweep", "auto", lane, reference=True, units=asked.poses, note=f"{asked.poses} poses, 1 process"
        ),
        Entry("softnlp, pose by pose", "auto", one_by_one, units=few, note=f"{few} of them, each from the arc"),
        Entry(
            "paper's method, floats", "20 steps", lambda: theirs, units=few, note=f"{few} of them, each from the arc"
        ),
        Entry("paper's method, arrays", "20 steps", lambda: in_arrays(theirs), units=few, note=f"{few} of them"),
    ]
    return Task("workspace sweep", "pose", "tip position, of L_0", entries, judge)


def paper_tip(rod: paper_method.Rod, loads: Loads, start: str | Array) -> tuple[Array, Array]:
    """Return the tip position of the paper's method and its base; raises as `paper_tip_state`."""
    tip, base = paper_tip_state(rod, loads, start)
    return tip.p, base


def paper_tip_state(rod: paper_method.Rod, loads: Loads, start: str | Array) -> tuple[paper_method.Tip, Array]:
    """Return the tip of the paper's method and its base, to start the next pose from.

    Raises
    ------
    RuntimeError
        Where its residual is not small.
    """
    answer = solve_pose(rod, loads.tip_force, loads.tip_moment, start=start)
    if not answer.residual < 1e-6:
        raise RuntimeError(f"the paper's method ended at a residual of {answer.residual:.1e}")
    return answer.tip, answer.base


def inverse_kinematics() -> Task:
    """Pressures for tips that random pressures reach, with tip load and gravity; the search stops at 1e-6 L."""
    name, loads = inverse.CASES["D25L60, tip load and gravity"]
    model, length = Model(robot(name), inverse.SILICONE), float(robot(name).length)
    forward = PoseSolver(model, Numerics())
    targets = inverse.random_tips(forward, loads, TARGETS)
    rods = Rods(model)

    def ours() -> Callable[[], Array]:
        def solve() -> Array:
            solver = inverse.solver_for(model, loads)  # so that its table of starts is in the time
            return np.array([found_pressure(solver, target) for target in targets])

        return solve

    def search(tip_of: inverse.TipOf) -> Array:
        return np.array([inverse.nelder_mead(tip_of, target, length).pressure for target in targets])

    def by_paper(P: Array, near: Any) -> tuple[Array, Any]:
        try:
            return paper_tip(rods.at(P, loads), loads, "arc" if near is None else near)
        except RuntimeError:
            return np.full(3, np.nan), near

    def judge(pressures: Array) -> float:
        tips = [inverse.tip_at(forward, loads, P, None)[0] for P in pressures]
        return float(np.max(np.linalg.norm(np.array(tips) - targets, axis=1))) / length

    kept = partial(inverse.tip_at, PoseSolver(model, Numerics()), loads)
    entries = [
        Entry("softnlp", "auto", ours, reference=True, units=TARGETS, note="its table of starts is built anew"),
        Entry("Nelder-Mead, softnlp's poses", "auto", lambda: partial(search, kept), units=TARGETS, once=True),
        Entry("Nelder-Mead, paper's method, floats", "20 steps", lambda: partial(search, by_paper), units=TARGETS,
              once=True, uncharged=lambda: rods.seconds),
    ]  # fmt: skip
    return Task("inverse kinematics", "target", "farthest pose from its target, of L_0", entries, judge)


def found_pressure(solver: InverseKinematics, target: Array) -> Array:
    """Return the pressure that our inverse kinematics finds."""
    step, _ = solver.nearest(Target(target, None), None)
    if step.pose is None:
        raise RuntimeError(step.message)
    return step.pressure
