"""The workspace test: the tip along a sequence of pressures, and how much each choice of the model moves it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.paper.cases import BARE, Solvers, case, law_of, model_of
from docs.paper.figures import label_outer, legend, named, panels, saved
from docs.paper.text import between, figure, fixed, page_text, scenario_link, table
from softnlp import BAR, COEFFICIENT_SETS, MILLIMETRE, Loads, Status
from softnlp.base.units import STANDARD_GRAVITY
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES, Rows
from softnlp.figures.style import GREY, SMALL, colour, plain
from softnlp.model.laws import LAWS
from softnlp.model.quantities import Model
from softnlp.statics.arc import unloaded_arc
from softnlp.sweep.boundary import alpha_shape, convex_hull, reach

Array = NDArray[np.float64]

NAME = "workspace_260"
_GRID = "#BBBBBB"
LEVELS = 8
"""Pressures a set of the grid that the sequence is compared with."""


@dataclass(frozen=True, eq=False)
class Found:
    """Everything on the page; tips [m]. tips, by_choice : (poses, 3) along the sequence. grid : (poses, 3)."""

    rows: Rows
    tips: Array
    by_choice: Mapping[str, Array]
    grid: Array


def found() -> Found:
    """Compute everything on the page."""
    scenario = case(NAME)
    rows = solved_rows(Loads())
    law, solvers = law_of(scenario), Solvers()
    by_choice = {f"law {other}": _arcs(solvers, model_of(scenario, other)) for other in LAWS if other != law}
    by_choice["without stiffening"] = _arcs(solvers, model_of(scenario, law, BARE))
    by_choice["coefficients calibrated"] = _arcs(solvers, model_of(scenario, law, COEFFICIENT_SETS["calibrated"]))
    for name, sense in (("own weight, standing", -1.0), ("own weight, hanging", 1.0)):
        by_choice[name] = solved_rows(Loads(gravity=(0.0, 0.0, sense * STANDARD_GRAVITY)))["tip_position"]
    return Found(rows, rows["tip_position"], by_choice, _grid(solvers, model_of(scenario)))


def solved_rows(loads: Loads) -> Rows:
    """Solve the boundary value problem at every pressure of the scenario, all at once, in its order."""
    scenario = case(NAME)
    pressures = np.ascontiguousarray(scenario.pressures)
    order = np.arange(len(pressures), dtype=np.int64)
    plan = Plan(model_of(scenario), loads, scenario.numerics, None, ("pressure",), pressures, order)
    solver = ChunkSolver(plan)
    return np.concatenate([solver.solve(chunk).rows for chunk in range(plan.chunks)])


def _arcs(solvers: Solvers, model: Model, pressures: Array | None = None) -> Array:
    """Return the tips at the pressures of the scenario, or at others, in closed form (poses, 3) [m]."""
    scenario = case(NAME)
    poses = solvers.of(model, scenario)
    tips = []
    for pressure in scenario.pressures if pressures is None else pressures:
        branch, arc = unloaded_arc(poses, pressure)
        tips.append(arc.tip_position if branch.status.has_solution else np.full(3, np.nan))
    return np.array(tips)


def times() -> Array:
    """Return when each pressure of the scenario is reached [s]."""
    found = case(NAME).times
    if found is None:
        raise RuntimeError("the scenario has no times")
    return found


def _grid(solvers: Solvers, model: Model) -> Array:
    """Return the tips at every combination of a few pressures up to the largest of the sequence."""
    levels = np.linspace(0, case(NAME).pressures.max(), LEVELS)
    return _arcs(solvers, model, np.array(list(product(levels, repeat=model.robot.chamber_sets))))


def page(folder: Path) -> str:
    """Write the figures into a folder and return the page."""
    it = found()
    scenario = case(NAME)
    steps = len(scenario.pressures)
    second = float(np.median(np.diff(times())))
    _draw_time(it, folder)
    _draw_tips(it, folder)
    return page_text(
        f"Workspace, {steps} points",
        f"In the paper's test the pressure of each set varies up to {scenario.pressures.max() / BAR:.1f} bar over "
        f"{steps} points, one each {second:g} s. The sequence and the measured tips are not published, so this page "
        f"shows the simulation alone, of {scenario.robot.name} in {scenario.material.name} ({law_of(scenario)}) along "
        f"a sequence that is made up: each set rises and falls at its own rhythm.{_back(scenario.pressures)}",
        f"Scenario: {scenario_link(NAME)}, with its pressures in "
        "[three_rhythms.csv](../../scenarios/files/three_rhythms_260.csv).",
        figure("workspace_time", "Pressures and tip position against time"),
        figure("workspace_tips", "Tips of the sequence among those of a grid"),
        "## What the poses come to",
        _numbers(it, steps),
        "## How much each choice moves the tip",
        f"Distance between the tips of this page and those with one choice changed, at the same pressures. "
        f"The robot is {float(scenario.robot.length) / MILLIMETRE:g} mm long.",
        _choices(it),
        "## With a measurement of your own",
        "`softnlp workspace SWEEP --against measured.csv` compares measured tips with a sweep, pose by pose, with RMSE "
        "by which sets have pressure ([how](../workspace_figures.md#against-a-measurement)).",
    )


def _back(pressures: Array) -> str:
    """Say whether a sequence retraces its way."""
    return " Its second half retraces the first." if np.allclose(pressures, pressures[::-1]) else ""


def _numbers(it: Found, steps: int) -> str:
    solved = it.rows[np.isin(it.rows["status"], [STATUSES.index(s) for s in Status if s.has_solution])]
    far, all_far = reach(it.tips), reach(it.grid)
    hull, whole = convex_hull(it.tips), convex_hull(it.grid)
    body = alpha_shape(it.grid)
    residual, error = float(solved["residual"].max()), float(solved["error"].max())

    def mm(low: float, high: float) -> str:
        return between(low / MILLIMETRE, high / MILLIMETRE)

    def volume(value: float) -> str:
        return fixed(value * 1e6)

    rows = [
        ["poses", str(steps), str(len(it.grid))],
        ["solved", str(len(solved)), str(int(np.isfinite(it.grid).all(axis=1).sum()))],
        ["distance from the base axis [mm]", *(mm(r.nearest_to_axis, r.farthest_from_axis) for r in (far, all_far))],
        ["height [mm]", *(mm(r.lowest, r.highest) for r in (far, all_far))],
        ["convex hull [cm³]", volume(hull.volume), volume(whole.volume)],
        ["volume between the poses [cm³]", "–", volume(body.volume)],
    ]
    return (
        table(["", "sequence", f"grid of {LEVELS} pressures a set"], rows)
        + f"\n\nThe sequence is solved as boundary value problems, all at once, with residuals up to {residual:.0e} "
        f"and a tip within {error:.0e} of the length by the estimated discretisation error; the grid in closed form. "
        f"A sequence is a curve: its hull takes in {100 * hull.volume / whole.volume:.0f} % of that of the grid. The "
        "tips lie on a thin dome, whose hollow a convex hull counts and the volume between the poses does not."
    )


def _choices(it: Found) -> str:
    rows = []
    for name, tips in it.by_choice.items():
        apart = np.linalg.norm(tips - it.tips, axis=1)
        length = float(case(NAME).robot.length)
        rms, most = float(np.sqrt(np.nanmean(apart**2))), float(np.nanmax(apart))
        missing = int(np.isnan(apart).sum())
        distances = (fixed(rms / MILLIMETRE, 2), fixed(100 * rms / length), fixed(most / MILLIMETRE, 2))
        rows.append([name, *distances, str(missing)])
    return table(["changed", "RMS [mm]", "RMS [% of the length]", "largest [mm]", "poses without a solution"], rows)


def _draw_time(it: Found, folder: Path) -> None:
    """Draw the pressures and the tip position against time."""
    scenario = case(NAME)
    canvas, axes = panels(
        f"{scenario.robot.name}, {len(it.tips)} points", "pressures made up; tip simulated", 2, 1, right=0.9
    )
    label_outer(axes, 1, "time [s]", "pressure [bar]")
    plain(axes[1], "time [s]", "tip position [mm]")
    for k, pressure in enumerate(scenario.pressures.T / BAR):
        axes[0].plot(times(), pressure, color=colour(k), label=f"set {k + 1}")
    for k, (name, values) in enumerate(zip("xyz", it.tips.T / MILLIMETRE, strict=True)):
        axes[1].plot(times(), values, color=colour(k + 3), label=name)
    for panel in axes:
        panel.set_xlim(0, float(times().max()))
        panel.legend(fontsize=SMALL, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    saved(canvas, folder, "workspace_time")


def _draw_tips(it: Found, folder: Path) -> None:
    """Draw the tips from the side and from above, in the order of time, over those of the grid."""
    canvas, axes = panels(
        "Tips of the sequence", "grey: a grid of pressures up to the same", 1, 2, row_height=4.1, right=1.0
    )
    tips, grid = it.tips / MILLIMETRE, it.grid / MILLIMETRE
    for panel, (first, second) in zip(axes, ((0, 2), (0, 1)), strict=True):
        plain(panel, f"{'xyz'[first]} [mm]", f"{'xyz'[second]} [mm]")
        panel.scatter(grid[:, first], grid[:, second], s=7, color=_GRID, label="grid", zorder=1)
        panel.plot(tips[:, first], tips[:, second], color=GREY, linewidth=0.6, zorder=2)
        points = panel.scatter(
            tips[:, first], tips[:, second], s=12, c=np.arange(len(tips)), cmap="viridis", label="sequence", zorder=3
        )
        panel.set_aspect("equal", adjustable="box")
    named(axes[0], "from the side")
    named(axes[1], "from above")
    bar = canvas.colorbar(points, cax=canvas.add_axes((0.93, 0.25, 0.012, 0.5)))
    bar.set_label("point of the sequence", size=SMALL)
    bar.ax.tick_params(labelsize=SMALL)
    legend(canvas, axes[0])
    saved(canvas, folder, "workspace_tips")
