"""Where the time of a loaded pose goes, in microseconds: machine code, what is shown of it, IPOPT's closing."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from softnlp import BAR, Loads, Numerics, material, robot
from softnlp.model.model import Model
from softnlp.statics.pose import shape_and_bend
from softnlp.statics.solver import PoseSolver

LOADS = Loads(tip_force=(0.05, -0.03, 0.02), gravity=(0.0, 0.0, -9.81))
PRESSURE = np.array([0.6, 0.2, 0.0]) * BAR
_WARM, _REPEATS = 20, 100


def least(work: Callable[[], object]) -> float:
    """Return the least processor time of a call in microseconds."""
    times = []
    for _ in range(_REPEATS):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return 1e6 * min(times)


def measured() -> dict[str, float]:
    """Return the parts of a pose with the engine "newton", then the whole with each engine, in microseconds."""
    newton, auto = (
        PoseSolver(Model(robot("D25L60"), material("Ecoflex 00-50")), Numerics(engine=engine))  # type: ignore[arg-type]
        for engine in ("newton", "auto")
    )
    near = None
    for solver in (newton, auto):
        for _ in range(_WARM):
            _, near = solver.solve(PRESSURE, LOADS, near)
    single = newton.equations.single_shooting()
    if single is None or near is None:
        raise RuntimeError("this chart needs llvmlite")
    column = newton.column(newton.values(PRESSURE, LOADS))
    at = single.at_stretch(column)
    assert at is not None
    loads = single.loads(column, at)
    K, start = near.intervals, near.nodes[15:, 0]
    parts = {
        "stretch and section": least(lambda: single.at_stretch(column)),
        "Newton's method, residuals,\nerror estimate, stability": least(lambda: single.shoot(at, *loads, K, start)),
        "shape at 61 points,\nbending angle": least(
            lambda: shape_and_bend(newton.shape, near.nodes, near.constants, fine=True)
        ),
    }
    whole = least(lambda: newton.solve(PRESSURE, LOADS, near))
    parts["grid, body, warnings, Step"] = whole - sum(parts.values())
    parts["IPOPT closes (auto)"] = least(lambda: auto.solve(PRESSURE, LOADS, near)) - whole
    return parts


def figure() -> Figure:
    """Return the chart."""
    parts = measured()
    made = Figure(figsize=(7.2, 2.9), layout="constrained")
    axes = made.subplots()
    names, values = list(parts), list(parts.values())
    colours = ["#33658a"] * (len(names) - 1) + ["#b5651d"]
    bars = axes.barh(names, values, color=colours)
    axes.bar_label(bars, [f"{value:.0f}" for value in values], padding=3)
    axes.invert_yaxis()
    axes.set_xlim(right=1.12 * max(values))
    axes.set_xlabel("time of a warm loaded pose, of D25L60 on 10 intervals [µs]")
    axes.spines[["top", "right"]].set_visible(False)
    return made
