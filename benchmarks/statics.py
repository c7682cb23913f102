"""How fast poses are beside the paper's method on the same equations, and how fast the commands are.

    python -m benchmarks.statics

The paper's method is single shooting with 20 RK4 steps and Levenberg-Marquardt with finite differences
(`benchmarks.paper_method`), once with the field in NumPy arrays, as one writes it, and once in Python floats, which is
ten times faster. It gets the stretch and the stiffnesses for nothing, and computes no error estimate, stability or
shape. A pose of this package includes all of these.

"cold" starts from the closed form of the unloaded shape, and "from zeros" from n(0) = m(0) = 0. A sequence starts cold
and then warm, each pose from the last. Ours, "compiled": by a solver that has met these poses before, so that its grids
exist; "as run": by a new one each time. "auto" refines the grid until the estimated error is met (1e-6 of the length
with loads, 5e-9 without); "20 intervals" fixes it, as the paper's is. The error is the tip's distance to one with
320 intervals.

Two segments in series, by the general solver, are timed beside one robot of their length, in machine code.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from unittest.mock import patch

import numpy as np

from benchmarks import paper_method
from benchmarks.numpy_field import numpy_field
from benchmarks.paper_method import Array, Rod, solve_pose
from benchmarks.rods import Rods
from softnlp import BAR, Loads, Numerics, Segment, forward, material, robot, segmented_robot
from softnlp.base.units import STANDARD_GRAVITY
from softnlp.model.quantities import Model
from softnlp.statics.solver import PoseSolver

MODEL = Model(robot("D25L60"), material("Ecoflex 00-50"))
PRESSURES = np.linspace(0, 1.5 * BAR, 11)[:, None] * np.array([1.0, 0.0, 0.0])
CASES = {
    "no load": Loads(),
    "tip force and gravity": Loads(tip_force=(0.02, 0.01, -0.03), gravity=(0.0, 0.0, -STANDARD_GRAVITY)),
}
FIXED, FINE = Numerics(intervals=20), Numerics(intervals=320)
REPEATS = 5
SCENARIO = Path(__file__).parents[1] / "scenarios" / "D25L60_one_set.toml"


@dataclass(frozen=True)
class Line:
    """One line of the table. seconds : median. error : of the tip position, largest of the poses [L_0]."""

    what: str
    method: str
    seconds: float
    error: float


def main() -> None:
    """Print both tables."""
    for case, loads in CASES.items():
        print(f"\n{MODEL.robot.name}, {MODEL.material.name}, set 1 to 1.5 bar, {case}\n")
        print_poses(poses(loads))
    print("\nTwo segments of half the length beside one, a loaded pose of a sequence, processor time, this run\n")
    one, two = segments()
    print(f"  one segment {1e3 * one:7.1f} ms   two segments {1e3 * two:7.1f} ms   ratio {two / one:5.2f}")
    print(f"\nWhole processes, median of 5, on {os.cpu_count()} processors\n")
    for what, seconds in processes().items():
        print(f"  {what:45s} {seconds:7.3f} s")


def poses(loads: Loads) -> list[Line]:
    """Time a cold pose at 1.5 bar and the whole sequence, by both methods."""
    rods = [rod_at(P, loads) for P in PRESSURES]
    exact = our_sequence(PoseSolver(MODEL, FINE), loads, PRESSURES)
    lines = []

    def add(what: str, method: str, work: Callable[[], Array]) -> None:
        tips = work()
        error = np.linalg.norm(tips - exact[-len(tips) :], axis=1).max() / MODEL.robot.length
        lines.append(Line(what, method, timed(work), float(error)))

    for what, chosen in (("cold pose", slice(-1, None)), ("sequence of 11", slice(None))):
        P, R = PRESSURES[chosen], rods[chosen]
        for language, field in (("NumPy", numpy_field), ("floats", paper_method.field)):
            with patch.object(paper_method, "field", field):
                add(what, f"paper, {language}, cold", partial(paper_sequence, R, loads, "arc"))
                add(what, f"paper, {language}, from zeros", partial(paper_sequence, R, loads, "zeros"))
        for name, numerics in (("auto", Numerics()), ("20 intervals", FIXED)):
            add(what, f"ours, {name}, compiled", partial(our_sequence, PoseSolver(MODEL, numerics), loads, P))
            add(what, f"ours, {name}, as run", partial(our_new_sequence, numerics, loads, P))
    return lines


def segments() -> tuple[float, float]:
    """Return the processor time of a loaded pose of one robot, and of two halves of it in series: the least of some."""
    whole, silicone, loads = MODEL.robot, MODEL.material, CASES["tip force and gravity"]
    half = robot("D25L60", length=float(whole.length) / 2)
    halves = segmented_robot([Segment(half, silicone)] * 2)
    P = np.linspace(0, 0.8 * BAR, 30)[:, None] * np.array([1.0, 0.1, 0.0])
    works = (
        lambda: forward(whole, silicone, P, loads=loads),
        lambda: forward(halves, halves.material, np.hstack([P, P]), loads=loads),
    )
    found = []
    for work in works:
        taken = []
        for _ in range(REPEATS + 1):
            began = time.process_time()
            work()
            taken.append((time.process_time() - began) / len(P))
        found.append(min(taken))
    return found[0], found[1]


def print_poses(lines: list[Line]) -> None:
    """Print the lines, each with how many times faster it is than the paper's method with the same cold start."""
    print(f"  {'':15s} {'method':28s} {'time':>10s} {'to NumPy':>9s} {'to floats':>10s} {'tip error':>10s}")
    for line in lines:
        paper = {b.method: b.seconds for b in lines if b.what == line.what}
        to_numpy, to_floats = (paper[f"paper, {language}, cold"] / line.seconds for language in ("NumPy", "floats"))
        times = f"{1e3 * line.seconds:7.1f} ms {to_numpy:8.1f}x {to_floats:9.2f}x"
        print(f"  {line.what:15s} {line.method:28s} {times} {line.error:10.0e}")


def paper_sequence(rods: list[Rod], loads: Loads, start: str) -> Array:
    """Solve poses by the paper's method, each from the last, the first from `start`; return the tips (steps, 3)."""
    near: str | Array = start
    tips = []
    for rod in rods:
        answer = solve_pose(rod, loads.tip_force, loads.tip_moment, start=near)
        if not answer.residual < 1e-6:
            raise RuntimeError(f"the paper's method ended at a residual of {answer.residual:.1e}")
        near = answer.base
        tips.append(answer.tip.p)
    return np.array(tips)


def our_sequence(solver: PoseSolver, loads: Loads, pressures: Array) -> Array:
    """Solve poses by the package, each from the last, the first cold; return the tips (steps, 3)."""
    near = None
    tips = []
    for P in pressures:
        step, near = solver.solve(P, loads, near)
        if step.pose is None:
            raise RuntimeError(step.message)
        tips.append(step.pose.tip_position)
    return np.array(tips)


def our_new_sequence(numerics: Numerics, loads: Loads, pressures: Array) -> Array:
    """Do the same with a solver of its own, building it included."""
    return our_sequence(PoseSolver(MODEL, numerics), loads, pressures)


def rod_at(pressure: Array, loads: Loads) -> Rod:
    """Return the rod at a pressure [Pa], as plain numbers for the paper's method."""
    return Rods(MODEL).at(pressure, loads)


def processes() -> dict[str, float]:
    """Time the commands as whole processes, the interpreter's start included."""
    python = [sys.executable, "-c"]
    with tempfile.TemporaryDirectory() as folder:
        commands = {
            f"softnlp run scenarios/{SCENARIO.name}": [sys.executable, "-m", "softnlp", "run", str(SCENARIO)],
            "import softnlp": [*python, "import softnlp"],
            "from softnlp import forward, material, robot": [*python, "from softnlp import forward, material, robot"],
            "softnlp --version": [sys.executable, "-m", "softnlp", "--version"],
            "python -c pass, for comparison": [*python, "pass"],
        }
        return {
            what: timed(partial(subprocess.run, command, cwd=folder, capture_output=True, check=True), repeats=5)
            for what, command in commands.items()
        }


def timed(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the median time of a piece of work [s]."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return median(times)


if __name__ == "__main__":
    main()
