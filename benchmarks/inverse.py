"""Inverse kinematics: do answers meet their targets, are nearest points nearest, and how fast beside Nelder-Mead.

    python -m benchmarks.inverse [targets]

Targets are tips at random pressures, so each can be reached. An answer counts when the pose at its pressure, solved
anew as a single forward step, is within 1e-6 of the length and every pressure within the bounds. For targets out of
reach the distance left is compared with a dense forward search: poses at 12 levels a set, then finer ones about the
best. The baseline is what one would write without derivatives: scipy's minimize by Nelder-Mead around the forward
solve of this package, warm-started from pose to pose, begun in the middle of the bounds and stopped as soon as it is
within the same 1e-6. Both are timed in one run on the same targets; both solvers have what they need compiled, and the
time to build this package's table of starts is in its own share.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from statistics import mean, median
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from softnlp import BAR, Loads, Numerics, Status, material, robot
from softnlp.model.quantities import Model
from softnlp.statics.solver import PoseSolver, Solved
from softnlp.studies.inverse_solver import InverseKinematics
from softnlp.studies.targets import InverseTask, Target

Array = NDArray[np.float64]
TipOf = Callable[[Array, Any], tuple[Array, Any]]

SILICONE = material("Ecoflex 00-50")
HIGHEST = 1.5 * BAR
LOADED = Loads(tip_force=(0.05, 0.02, 0.0), tip_moment=(0.0, 0.0, 1e-3), gravity=(0.0, 0.0, -9.80665))
CASES = {
    "D25L60, no load": ("D25L60", Loads()),
    "D25L60, tip load and gravity": ("D25L60", LOADED),
    "D15L60, gravity": ("D15L60", Loads(gravity=(0.0, 0.0, 9.80665))),
}
TIMED = 12
REACHED = 1e-6  # of the length
FAR = ((0.05, 0.02, 0.06), (0.0, 0.0, 0.16), (0.0, 0.0, 0.03), (0.03, 0.0, -0.03), (-0.08, -0.05, 0.05))


def main(count: int = 200) -> None:
    """Print how many answers hold, how near the far ones are, and the ratio of times."""
    for case, (name, loads) in CASES.items():
        model = Model(robot(name), SILICONE)
        length = float(model.robot.length)
        print(f"\n{case}, 0 to {HIGHEST / BAR:g} bar")
        forward = PoseSolver(model, Numerics())
        targets = random_tips(forward, loads, count)
        solver, seconds, answers = answered(model, loads, targets)
        judged = [forward.solve(step.pressure, loads)[0].pose for step in answers]
        left = [np.linalg.norm(p.tip_position - t) / length for p, t in zip(judged, targets, strict=True) if p]
        inside = all(np.all(step.pressure >= 0) and np.all(step.pressure <= HIGHEST) for step in answers)
        solved = sum(step.status is Status.SOLVED for step in answers)
        print(f"  {solved} of {count} solved; farthest forward pose {max(left):.1e} L; all within bounds: {inside}")
        print(f"  ms a target: median {1e3 * median(seconds[1:]):.1f}, mean {1e3 * mean(seconds):.1f}")
        out_of_reach(solver, forward, loads, length)
        against_nelder_mead(model, forward, loads, targets[:TIMED], mean(seconds))


def random_tips(forward: PoseSolver, loads: Loads, count: int) -> Array:
    """Return the tips at random pressures, a quarter of them with a set at one of its bounds."""
    rng = np.random.default_rng(11)
    tips = []
    for k in range(count):
        P = rng.uniform(0, HIGHEST, 3)
        if k % 4 == 0:
            P[rng.integers(3)] = rng.choice([0.0, HIGHEST])
        pose = forward.solve(P, loads)[0].pose
        assert pose is not None
        assert pose.stable
        tips.append(pose.tip_position)
    return np.array(tips)


def solver_for(model: Model, loads: Loads) -> InverseKinematics:
    """Return a solver for positions within the bounds."""
    sets = model.robot.chamber_sets
    task = InverseTask((), np.zeros(sets), np.full(sets, HIGHEST), float(model.robot.length))
    return InverseKinematics(model, Numerics(), loads, task, "newton")


def answered(model: Model, loads: Loads, targets: Array) -> tuple[InverseKinematics, list[float], list[Any]]:
    """Solve every target on its own, no one begun from the last; the first includes the table of starts."""
    solver = solver_for(model, loads)
    seconds, steps = [], []
    for target in targets:
        began = time.perf_counter()
        steps.append(solver.nearest(Target(target, None), None)[0])
        seconds.append(time.perf_counter() - began)
    return solver, seconds, steps


def out_of_reach(solver: InverseKinematics, forward: PoseSolver, loads: Loads, length: float) -> None:
    """Compare the distances left with a dense search."""
    levels = np.linspace(0, HIGHEST, 12)
    pressures = [np.array(P) for P in product(levels, repeat=3)]
    tips = []
    near: Solved | None = None
    for P in pressures:
        tips.append(tip_at(forward, loads, P, near)[0])
    dense = np.array(tips)
    for target in np.array(FAR) * length / 0.06:
        step = solver.nearest(Target(target, None), None)[0]
        distances = np.linalg.norm(dense - target, axis=1)
        best, left = pressures[int(np.nanargmin(distances))], float(np.nanmin(distances))
        width = (levels[1] - levels[0]) / 2
        while width > 2e-5 * HIGHEST:
            around = [np.clip(best + width * np.array(move), 0, HIGHEST) for move in product((-1, 0, 1), repeat=3)]
            found = [float(np.linalg.norm(tip_at(forward, loads, P, None)[0] - target)) for P in around]
            k = int(np.nanargmin(found))
            if found[k] < left * (1 - 1e-6):
                best, left = around[k], found[k]
            else:
                width /= 2
        assert step.aimed is not None
        ours = step.aimed.distance or 0.0
        print(f"  {step.status.value}: {1e3 * ours:.4f} mm left, dense search {1e3 * left:.4f} mm ({ours / left:.4f})")


def tip_at(forward: PoseSolver, loads: Loads, P: Array, near: Solved | None) -> tuple[Array, Solved | None]:
    """Return the tip of a stable pose, NaN where there is none."""
    step, solved = forward.solve(P, loads, near)
    if step.pose is None or not step.pose.stable:
        return np.full(3, np.nan), near
    return step.pose.tip_position, solved


def against_nelder_mead(model: Model, forward: PoseSolver, loads: Loads, targets: Array, usual: float) -> None:
    """Time both on the same targets, in turns; `usual` is our mean over all targets [s], the table built once."""
    length = float(model.robot.length)
    solver = solver_for(model, loads)
    solver.nearest(Target(targets[0], None), None)  # compiled, as the forward solver is
    solver = solver_for(model, loads)  # its table of starts is built anew
    ratios, ours, theirs, solves = [], [], [], []
    for target in targets:
        began = time.perf_counter()
        solver.nearest(Target(target, None), None)
        middle = time.perf_counter()
        searched = nelder_mead(partial(tip_at, forward, loads), target, length)
        ended = time.perf_counter()
        ours.append(middle - began)
        theirs.append(ended - middle)
        solves.append(searched.solves)
        if searched.distance <= REACHED:
            ratios.append(theirs[-1] / ours[-1])
    print(f"  Nelder-Mead met {len(ratios)} of {len(targets)} targets, {median(solves):.0f} forward solves each")
    print(f"  s for {len(targets)} targets: {sum(ours):.2f} and Nelder-Mead {sum(theirs):.2f}")
    print(f"  ratio of the sums {sum(theirs) / sum(ours):.1f}, of those it met: least {min(ratios):.1f}, median "
          f"{median(ratios):.1f}")  # fmt: skip
    print(f"  ratio of the means, ours over all targets: {mean(theirs) / usual:.1f}")


@dataclass(frozen=True, eq=False)
class Searched:
    """How a search ended: forward solves spent, distance left over the length, at this pressure (sets,) [Pa]."""

    solves: int
    distance: float
    pressure: Array


def nelder_mead(tip_of: TipOf, target: Array, length: float) -> Searched:
    """Search the pressures from the middle of the bounds until the tip is within `REACHED` of the length.

    tip_of : (pressure, what it returned of the last pose or None) -> tip (3,), NaN where there is none, and what to
    start the next pose from.
    """
    near: Any = None
    spent, best, pressure = 0, np.inf, np.full(3, HIGHEST / 2)

    def distance(z: Array) -> float:
        nonlocal near, spent, best, pressure
        tip, near = tip_of(z * BAR, near)
        spent += 1
        found = float(np.linalg.norm(tip - target)) / length
        if found < best:
            best, pressure = found, z * BAR
        return found if np.isfinite(found) else 1e3

    def stop(*_: Any) -> None:
        if best <= REACHED:
            raise StopIteration

    minimize(
        distance,
        np.full(3, HIGHEST / BAR / 2),
        method="Nelder-Mead",
        bounds=[(0.0, HIGHEST / BAR)] * 3,
        callback=stop,
        options={"xatol": 1e-9, "fatol": 1e-9, "maxiter": 1000},
    )
    return Searched(spent, best, pressure)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
