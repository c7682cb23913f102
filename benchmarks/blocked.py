"""How fast a blocked tip force is beside the paper's method on the same robots and pressures.

    python -m benchmarks.blocked [ROBOT ...] [--no-arrays]

The paper's method is single shooting with 20 RK4 steps for the free shape and then, by SciPy's Levenberg-Marquardt
with finite differences, for the weighted squares of the blocked one (`benchmarks.paper_blocked`). It gets the stretch
and the stiffnesses for nothing, and computes no error estimate, stability or shape, where a step of this package
includes all of these. It is timed four ways:

arrays           the field in NumPy arrays, as one writes it (and as MATLAB has it), in space as it is published
arrays, plane    only the unknowns and equations of the plane of the wall's normal: an optimisation that the paper does
                 not have. In space the squares have lower minima out of the plane, and most of the time goes there
floats           the field in Python floats with every sum by hand, which is about ten times faster than arrays
floats, plane    both: as fast as this method gets without a compiler

All begin at zero pressure and start each step from the last one; 0 to 1.5 bar in set 1 in 6 steps, of which the first
(no pressure) is not counted. "not reached" is a step that Levenberg-Marquardt did not finish within MINPACK's number of
evaluations (100 n (n + 1) for n unknowns).

Ours, by a solver that has met these steps before; in brackets a new one, with everything built. "20" fixes the
intervals as the paper's are; "auto" refines them until the estimated error is within 1e-6 of the length. A ratio is
the paper's time over ours; times are the processor's.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from statistics import mean, median
from unittest.mock import patch

import numpy as np

from benchmarks import paper_method
from benchmarks.numpy_field import numpy_field
from benchmarks.paper_blocked import Weights, solve_blocked
from benchmarks.rods import Rods
from softnlp import BAR, Loads, Numerics, material, robot
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.quantities import Model
from softnlp.model.robot import ROBOTS
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.wall import standing_wall

NAMES = [name for name in ROBOTS if name.startswith("D")]
SILICONE = material("Ecoflex 00-50")
PRESSURES = np.linspace(0, 1.5 * BAR, 6)[:, None] * np.array([1.0, 0.0, 0.0])
WEIGHTS = Weights(L=5.0)
WAYS = ("arrays", "arrays, plane", "floats", "floats, plane")
REPEATS = 3


def main(arguments: Sequence[str] | None = None) -> None:
    """Print milliseconds a step and how much faster each is than the paper's method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", help="all eight where none is named")
    parser.add_argument("--no-arrays", action="store_true", help="leave out the slowest way, which takes minutes")
    given = parser.parse_args(arguments)
    ways = [way for way in WAYS if not (given.no_arrays and way.startswith("arrays"))]
    print(f"\n{SILICONE.name}, set 1, 0 to 1.5 bar in 6 steps, ms a step, {os.cpu_count()} processors\n")
    print("  " + f"{'robot':8s} {'method':22s}{'ms a step':>12s}" + "".join(f"{f'to {way}':>18s}" for way in ways))
    ratios: dict[tuple[str, str], list[float]] = {}
    for name in given.robots or NAMES:
        model = Model(robot(name), SILICONE)
        solvers = {
            f"{closure}, {grid}": BlockedSolver(model, numerics, ContactSettings(closure=closure))  # type: ignore[arg-type]
            for closure in ("free", "compliant")
            for grid, numerics in (("auto", Numerics()), ("20", Numerics(intervals=20)))
        }
        built = {what: our_seconds(solver) for what, solver in solvers.items()}
        paper: dict[str, float | None] = {way: paper_way(model, way) for way in ways}
        ours: dict[str, list[float]] = {what: [] for what in solvers}
        again: dict[str, list[float]] = {way: [s] for way, s in paper.items() if s is not None}
        for _ in range(REPEATS):  # in turns, so that what else the machine does meets all alike
            for what, solver in solvers.items():
                ours[what].append(our_seconds(solver))
            for way in again:
                if not way.startswith("arrays"):
                    again[way].append(paper_way(model, way) or float("inf"))
        paper |= {way: median(times) for way, times in again.items()}
        for way, seconds in paper.items():
            print(f"  {name:8s} {f'paper, {way}':22s}{_milliseconds(seconds):>12s}")
        for what, times in ours.items():
            line = f"  {name:8s} {what:22s}{_milliseconds(median(times)):>12s}"
            for way, seconds in paper.items():
                if seconds is not None:
                    ratios.setdefault((what, way), []).append(seconds / median(times))
                line += f"{'-' if seconds is None else f'{seconds / median(times):.1f}x':>18s}"
            print(f"{line}  ({_milliseconds(built[what])} as run)", flush=True)
    print("\n  Least and mean of the ratios, where the paper's method arrived:")
    for (what, way), values in ratios.items():
        print(f"  {what:18s} to {way:14s}{min(values):8.1f}x {mean(values):8.1f}x")


def _milliseconds(seconds: float | None) -> str:
    return "not reached" if seconds is None else f"{1e3 * seconds:.1f}"


def paper_way(model: Model, way: str) -> float | None:
    """Return the time of one step of the paper's method [s], None where a step was not reached."""
    field = numpy_field if way.startswith("arrays") else paper_method.field
    with patch.object(paper_method, "field", field):
        return paper_seconds(model, planar=way.endswith("plane"))


def our_seconds(solver: BlockedSolver) -> float:
    """Return the time of one step [s], a mean over the sequence."""
    began = time.process_time()
    wall, near = standing_wall(solver.poses, solver.contact, PRESSURES, Loads()), None
    for pressure in PRESSURES:
        step, solved = solver.solve(pressure, Loads(), wall, near)
        near = solved or near
        if not step.status.has_solution:
            raise RuntimeError(step.message)
    return (time.process_time() - began) / (len(PRESSURES) - 1)


def paper_seconds(model: Model, *, planar: bool) -> float | None:
    """Return the time of one step of the paper's method [s], a mean over the sequence; None where one did not end."""
    made = Rods(model)
    rods = [made.at(P) for P in PRESSURES[1:]]
    began = time.process_time()
    start = None
    for rod in rods:
        answer = solve_blocked(rod, WEIGHTS, start=start, planar=planar)
        if not answer.converged:
            return None
        start = np.append(answer.base, answer.force)
    return (time.process_time() - began) / len(rods)


if __name__ == "__main__":
    main()
