"""The laparoscope: five published bending angles, and the choice of silicone and number of chambers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from docs.paper.cases import Solvers, case, in_bar, law_of, model_of, unloaded
from docs.paper.figures import MEASURED, label_outer, legend, panels, saved
from docs.paper.published import published
from docs.paper.text import NONE, figure, fixed, page_text, scenario_link, table, worded
from softnlp import BAR, DEGREE, Design
from softnlp.figures.design import design_figure
from softnlp.figures.style import colour
from softnlp.scenario.design import run_design
from softnlp.statics.step import Step
from softnlp.studies.design_candidate import Candidate
from softnlp.studies.design_task import DesignTask

_HALF_DIGIT = 0.005


def names() -> dict[str, Mapping[str, Any]]:
    """Return the published simulations by the name of their scenario."""
    return {f"laparoscope_{p['material'].replace(' ', '_')}": p for p in published()["laparoscope"]}


Runs = Mapping[str, Sequence[Step]]
"""The steps of each published simulation by the name of its scenario."""


def solved() -> dict[str, list[Step]]:
    """Solve every pose of the published simulations; the robot is the same, so that one solver serves all."""
    solvers = Solvers()
    runs: dict[str, list[Step]] = {}
    for name in names():
        scenario = case(name)
        poses, near, runs[name] = solvers.of(model_of(scenario), scenario), None, []
        for pressure in scenario.pressures:
            step, near = poses.solve(pressure, scenario.loads, near)
            runs[name].append(step)
    return runs


def bending(steps: Sequence[Step]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the bending angle of each step [deg], NaN where it has none."""
    return np.array([np.nan if s.pose is None else s.pose.bending_angle / DEGREE for s in steps])


def page(folder: Path) -> str:
    """Write the figures into a folder and return the page."""
    runs = solved()
    first = case(next(iter(names())))
    _draw(runs, folder)
    done = run_design(case("laparoscope_paper", "design"))
    saved(design_figure(done), folder, "laparoscope_design")
    robot = first.robot
    return page_text(
        "Laparoscope: silicone and design",
        f"The paper simulates a robot for keyhole surgery, {robot.name} with {robot.chambers} chambers in "
        f"{robot.chamber_sets} sets, in {worded(len(names()))} silicones ({law_of(first)}, one set), and chooses "
        "silicone and number of chambers for it.",
        f"## The {worded(len(names()))} published angles",
        f"Scenarios: {', '.join(scenario_link(name) for name in names())}.",
        _angles(runs),
        figure("laparoscope_bending", "Bending angle against pressure, by silicone"),
        _settled(runs),
        "## Silicone and number of chambers",
        f"Scenario: {scenario_link('laparoscope_paper', 'design')}, to run with `softnlp design`. {_asked(done)}",
        _candidates(done),
        figure("laparoscope_design", "Every candidate of the design study"),
        _chosen(done),
    )


def _angles(runs: Runs) -> str:
    rows = []
    for name, known in names().items():
        ours = bending(runs[name])[-1]
        rows.append([known["material"], fixed(known["pressure_bar"]), fixed(known["bending_angle_deg"]), fixed(ours, 2),
                     f"{ours - known['bending_angle_deg']:+.2f}"])  # fmt: skip
    return table(["silicone", "pressure [bar]", "published [deg]", "here [deg]", "difference [deg]"], rows)


def _settled(runs: Runs) -> str:
    largest = max(abs(bending(runs[name])[-1] - p["bending_angle_deg"]) for name, p in names().items())
    scenario = case(next(iter(names())))
    c = scenario.coefficients
    residual = max(s.residual for steps in runs.values() for s in steps if s.residual is not None)
    return (
        f"The largest difference is {largest:.2f} deg. A published angle is rounded to a decimal, and so are the "
        f"coefficients k_e = {c.elongation:g} and k_b = {c.bending:g}: half of their last digit moves these angles by "
        f"up to {_by_rounding():.2f} deg. These angles settle how the equations are read: the set "
        f"`{scenario.conventions.name}` of [conventions](../model.md#conventions). Every pose is a boundary value "
        f"problem with a residual of at most {residual:.0e}."
    )


def _by_rounding() -> float:
    """Return the largest change of an angle [deg] when k_e and k_b change by half of their second decimal."""
    solvers, moved = Solvers(), []
    for name in names():
        scenario = case(name)
        c = scenario.coefficients
        angles = []
        for part in (-_HALF_DIGIT, 0.0, _HALF_DIGIT):
            near = replace(c, elongation=c.elongation + part, bending=c.bending + part)
            poses = solvers.of(model_of(scenario, None, near), scenario)
            angles.append(unloaded(poses, scenario.pressures[-1])[0] / DEGREE)
        moved += [abs(angle - angles[1]) for angle in angles]
    return max(moved)


def _asked(done: Design) -> str:
    task = done.task
    limit = task.requirements["bending_angle"].lower / DEGREE
    return (
        f"Of {len(done.candidates)} combinations, each at the lowest pressure that bends it by {limit:.0f} deg, the "
        f"one that pushes hardest (closure `{done.setting.contact.closure}`)."
    )


def _output(candidate: Candidate, name: str, scale: float) -> float | None:
    value = candidate.outputs.get(name)
    return None if value is None else value / scale


def _candidates(done: Design) -> str:
    rows = []
    for c in done.candidates:
        at = [
            fixed(_output(c, "pressure", BAR)),
            fixed(_output(c, "bending_angle", DEGREE)),
            fixed(_output(c, "stretch", 1), 3),
        ]
        force = fixed(c.objective, 3) if c.is_feasible else NONE
        rows.append([c.material.name, str(c.robot.chambers), *at, force, "best" if c is done.best else c.status])
    return table(["silicone", "chambers", "pressure [bar]", "bending [deg]", "stretch", "force [N]", ""], rows)


def _chosen(done: Design) -> str:
    best, known = done.best, published()["design"]
    if best is None:
        raise RuntimeError("no candidate of the laparoscope design is feasible")
    second = done.feasible[1]
    same = (best.material.name, best.robot.chambers) == (known["material"], known["chambers"])
    assert isinstance(done.task, DesignTask)
    free = done.free_closure_force
    slips = " ".join(f"The result says: {w}." for w in best.warnings)
    return (
        f"Best here: {best.material.name} with {best.robot.chambers} chambers, {best.objective:.3f} N at "
        f"{best.outputs['pressure'] / BAR:g} bar; next {second.material.name} with {second.robot.chambers}, "
        f"{second.objective:.3f} N. The paper chose {known['material']} with {known['chambers']}: "
        f"{'the same' if same else 'another one'}. No force was published for this robot, so the number rests on the "
        f"closure: by the rod alone it is {fixed(free, 3)} N. {slips}\n\n"
        "[Design](../design.md) asks the same with the pressure free, which the paper could not, and finds another."
    )


def _draw(runs: Runs, folder: Path) -> None:
    """Draw the angle against pressure for every silicone, and the published points."""
    first = case(next(iter(names())))
    canvas, (panel,) = panels(f"{first.robot.name}, one set", f"{law_of(first)}, by silicone", 1, 1, row_height=3.4)
    label_outer([panel], 1, "pressure [bar]", "bending angle [deg]")
    for k, (name, known) in enumerate(names().items()):
        pressure = in_bar(case(name).pressures)
        panel.plot(pressure, bending(runs[name]), color=colour(k), marker=".", label=known["material"])
        label = "published simulation" if k == len(names()) - 1 else None
        panel.plot([known["pressure_bar"]], [known["bending_angle_deg"]], label=label,
                   **{**MEASURED, "markerfacecolor": "none", "markersize": 9})  # fmt: skip
    panel.set_xlim(left=0)
    panel.set_ylim(bottom=0)
    legend(canvas, panel)
    saved(canvas, folder, "laparoscope_bending")
