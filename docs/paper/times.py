"""Run times: this package and the paper's method in one run, and the published ones."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from benchmarks import paper_method
from benchmarks.numpy_field import numpy_field
from benchmarks.paper_blocked import Weights, solve_blocked
from benchmarks.paper_method import Rod, solve_pose
from benchmarks.rods import Rods
from docs.paper.blocked import raised
from docs.paper.cases import case, law_of, model_of
from docs.paper.figures import legend, named, panels, saved
from docs.paper.published import published
from docs.paper.text import figure, fixed, page_text, table
from softnlp import ContactSettings, Loads
from softnlp.figures.style import COLOURS, INK, PALE, SMALL, plain
from softnlp.model.quantities import Model
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.solver import PoseSolver
from softnlp.statics.wall import standing_wall

Array = NDArray[np.float64]

LOADS = Loads(tip_force=(0.02, 0.01, -0.03))
WEIGHTS = Weights(L=2.0)
REPEATS = 2
_SOLVED = 1e-6  # scaled residual of a pose by the paper's method
ARRAYS, FLOATS = "paper's, NumPy arrays", "paper's, Python floats"
PLANE, SPACE = ", in the plane", ", in space"
FIELDS = {ARRAYS: numpy_field, FLOATS: paper_method.field}


def robot_name() -> str:
    """Return the robot that the paper simulates against a wall."""
    return str(published()["simulated_blocked_force"]["robot"])


def page(folder: Path) -> str:
    """Write the figures into a folder and return the page."""
    poses, pushes = pose_times(), push_times()
    known, scenario = published()["run_time_s"], case(f"bending_{robot_name()}")
    force = ", ".join(f"{component:g}" for component in LOADS.tip_force)
    _draw(poses, pushes, folder)
    return page_text(
        "Run times",
        f"The paper gives {_range(known['pose'])} s for a pose and {_range(known['blocked_force'])} s for a blocked "
        f"force ({known['where']}). That is another machine and another language. To compare methods, the "
        f"paper's (single shooting, {_steps()} Runge-Kutta steps, Levenberg-Marquardt with finite differences) was "
        "written again in `benchmarks/paper_method.py` and `benchmarks/paper_blocked.py` and timed here in the same "
        f"run as this package: {platform.machine()}, one core of {os.cpu_count()}, Python {platform.python_version()}.",
        f"{scenario.robot.name} in {scenario.material.name} ({law_of(scenario)}), one set, each pose from the last. "
        "Processor time for one, the median of a few repeats (the slowest ways once); these numbers differ each time "
        "the page is built.",
        figure("times", "Milliseconds a pose and a blocked force"),
        "## A pose with a force on the tip",
        f"The force is ({force}) N.",
        _table(poses, ARRAYS),
        "## A blocked force",
        _table(pushes, ARRAYS + PLANE),
        "## What is in these numbers",
        _notes(pushes),
    )


def _steps() -> int:
    """Return the number of Runge-Kutta steps that the paper's method takes here."""
    defaults = solve_pose.__kwdefaults__ or {}
    return int(defaults["steps"])


def _range(known: Sequence[float]) -> str:
    return " to ".join(f"{seconds:g}" for seconds in known)


def _table(times: Mapping[str, float], base: str) -> str:
    rows = [[name, _milliseconds(t), fixed(times[base] / t)] for name, t in times.items()]
    return table(["method", "one [ms]", f"times as fast as {base}"], rows)


def _milliseconds(seconds: float) -> str:
    return "not reached" if np.isnan(seconds) else f"{1e3 * seconds:.1f}"


def _notes(pushes: Mapping[str, float]) -> str:
    published_times = _range(published()["run_time_s"]["blocked_force"])
    return "\n".join(
        [
            "- A pose or force of this package includes stretch, stiffnesses, an error estimate with refinement of the "
            "grid, the stability test, warnings and the whole shape. The paper's method gets the stretch and the "
            "stiffnesses for nothing and computes none of the others.",
            '- "first" is a new solver, what it compiles shared out over its few poses; "kept" one that has met the '
            "robot before, as in a longer sequence or a design.",
            "- NumPy arrays is how one writes the method, and what MATLAB has. Python floats is the same with every "
            "sum written by hand.",
            "- In the plane only four unknowns are left, which the paper's method does not do. In space its squares "
            "have lower minima out of the plane, and most of the time goes there. Arrays in space take much longer "
            "still, and are left to the benchmarks named below.",
            f"- Here the paper's method in arrays takes {_milliseconds(pushes[ARRAYS + PLANE])} ms for a blocked force "
            f"in the plane; published is {published_times} s.",
            "- `python -m benchmarks.statics` and `python -m benchmarks.blocked` measure more robots and repeats.",
        ]
    )


def pose_times() -> dict[str, float]:
    """Return the time of one loaded pose by method [s]."""
    scenario = case(f"bending_{robot_name()}")
    pressures, model = raised(scenario.pressures)[1::2], model_of(scenario)
    kept = PoseSolver(model, scenario.numerics)
    made = Rods(model)
    rods = [made.at(P) for P in pressures]
    slow: dict[str, Callable[[], bool]] = {
        ARRAYS: lambda: _paper_poses(rods, numpy_field),
        "this package, first": lambda: _poses(PoseSolver(model, scenario.numerics), pressures),
    }
    work: dict[str, Callable[[], bool]] = {
        FLOATS: lambda: _paper_poses(rods, paper_method.field),
        "this package, kept": lambda: _poses(kept, pressures),
    }
    _poses(kept, pressures)
    return timed(slow, len(rods), 1) | timed(work, len(rods))


def push_times() -> dict[str, float]:
    """Return the time of one blocked force by method [s]."""
    scenario = case("constraint_compliant")
    pressures, model = raised(scenario.pressures), model_of(scenario)
    made = Rods(model)
    rods = [made.at(P) for P in pressures]
    contacts = [ContactSettings(closure=closure) for closure in ("compliant", "free")]
    kept = {c.closure: BlockedSolver(model, scenario.numerics, c) for c in contacts}
    slow: dict[str, Callable[[], bool]] = {
        ARRAYS + PLANE: lambda: _paper_pushes(rods, numpy_field, planar=True),
        FLOATS + SPACE: lambda: _paper_pushes(rods, paper_method.field, planar=False),
        "this package, compliant, first": lambda: _pushes(_new(model), pressures),
    }
    work: dict[str, Callable[[], bool]] = {
        FLOATS + PLANE: lambda: _paper_pushes(rods, paper_method.field, planar=True),
    }
    for closure, solver in kept.items():
        _pushes(solver, pressures)
        work[f"this package, {closure}, kept"] = partial(_pushes, solver, pressures)
    return timed(slow, len(rods), 1) | timed(work, len(rods))


def _new(model: Model) -> BlockedSolver:
    return BlockedSolver(model, case("constraint_compliant").numerics, ContactSettings())


def timed(work: Mapping[str, Callable[[], bool]], count: int, repeats: int = REPEATS) -> dict[str, float]:
    """Return the median processor time of each piece of work over `count` [s], all in turns.

    NaN for one that says that it did not arrive.
    """
    times: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(repeats):
        for name, do in work.items():
            began = time.process_time()
            arrived = do()
            times[name].append((time.process_time() - began) / count if arrived else np.nan)
    return {name: float(np.median(values)) for name, values in times.items()}


def _paper_poses(rods: list[Rod], field: Callable[..., object]) -> bool:
    """Solve loaded poses by the paper's method, each from the last; return whether all are solutions."""
    near: str | Array = "arc"
    arrived = True
    with patch.object(paper_method, "field", field):
        for rod in rods:
            answer = solve_pose(rod, LOADS.tip_force, LOADS.tip_moment, start=near)
            arrived, near = arrived and answer.residual < _SOLVED, answer.base
    return arrived


def _poses(solver: PoseSolver, pressures: Array) -> bool:
    near, arrived = None, True
    for P in pressures:
        step, near = solver.solve(P, LOADS, near)
        arrived = arrived and step.pose is not None
    return arrived


def _paper_pushes(rods: list[Rod], field: Callable[..., object], *, planar: bool) -> bool:
    """Solve blocked forces by the paper's method; return whether all ended within MINPACK's evaluations."""
    start, arrived = None, True
    with patch.object(paper_method, "field", field):
        for rod in rods:
            answer = solve_blocked(rod, WEIGHTS, start=start, planar=planar)
            arrived, start = arrived and answer.converged, np.append(answer.base, answer.force)
    return arrived


def _pushes(solver: BlockedSolver, pressures: Array) -> bool:
    wall, near, arrived = standing_wall(solver.poses, solver.contact, pressures, Loads()), None, True
    for P in pressures:
        step, solved = solver.solve(P, Loads(), wall, near)
        near, arrived = solved or near, arrived and step.status.has_solution
    return arrived


def _draw(poses: Mapping[str, float], pushes: Mapping[str, float], folder: Path) -> None:
    """Draw bars of both on a logarithmic axis, with the published ranges as bands."""
    known = published()["run_time_s"]
    canvas, axes = panels("Time of one solve", f"{robot_name()}, one set; lower is faster", 2, 1, left=2.6)
    groups = zip(axes, (poses, pushes), ("pose", "blocked_force"), strict=True)
    for panel, measured, key in groups:
        times = {name: seconds for name, seconds in measured.items() if np.isfinite(seconds)}
        plain(panel, "processor time [s]", "")
        places = np.arange(len(times))
        shades = [COLOURS[0] if name.startswith("this") else COLOURS[1] for name in times]
        panel.barh(places, list(times.values()), color=shades, height=0.62)
        low, high = known[key]
        panel.axvspan(low, high, color=PALE, linewidth=0, zorder=0, label=f"published ({known['where']})")
        panel.set_xscale("log")
        panel.set_xlim(min(times.values()) / 3, 3 * max(*times.values(), high))
        panel.set_yticks(places, list(times), size=SMALL)
        panel.grid(False, axis="y")
        named(panel, key.replace("_", " "))
        for place, seconds in enumerate(times.values()):
            panel.text(seconds * 1.1, place, f"{_milliseconds(seconds)} ms", size=SMALL, color=INK, va="center")
        panel.set_ylim(len(times) - 0.4, -0.6)
    legend(canvas, axes[0])
    saved(canvas, folder, "times")
