"""The blocked force with and without the constraint of the chambers, beside the published simulations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.paper.cases import BARE, STIFFENED, case, in_bar, law_of, model_of
from docs.paper.figures import MEASURED, label_outer, legend, named, panels, saved
from docs.paper.published import measured_forces, measured_pressure, published
from docs.paper.text import NONE, figure, fixed, page_text, scenario_link, table
from docs.paper.weights import ROUGH, force_at, length_weight_for, with_length_weight
from softnlp import MILLIMETRE, Conventions, Loads, run_scenario
from softnlp.base.units import STANDARD_GRAVITY
from softnlp.figures.style import GREY, colour
from softnlp.model.quantities import Model
from softnlp.scenario.read import Scenario
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.step import Step
from softnlp.statics.wall import Wall

Array = NDArray[np.float64]

RUNS = ("without", "compliant", "weighted")
_PARTS = np.geomspace(0.01, 10.0, 13)  # W_L of the figure over that of the scenario


@dataclass(frozen=True, eq=False)
class Found:
    """Everything on the page. force : by scenario, along its pressures [N]. free : without the constraint at the last.

    published_length : W_L that gives the published force [1/m]. published_force : by weighted with it, along the
    pressures. offset : h at which `free` gives the published force without the constraint [m].
    """

    pressure: Array
    force: Mapping[str, Array]
    steps: Mapping[str, Step]
    published_length: float
    published_force: Array
    lengths: Array
    by_length: Array
    offset: float
    readings: Mapping[str, float]


def found() -> Found:
    """Compute everything on the page."""
    runs = {name: run_scenario(case(f"constraint_{name}")) for name in RUNS}
    known = published()["simulated_blocked_force"]
    weighted = case("constraint_weighted")
    solver = _solver(weighted)
    last = weighted.pressures[-1]
    search = _solver(replace(weighted, numerics=replace(weighted.numerics, accuracy=ROUGH)))
    tuned = length_weight_for(search, last, known["with_constraint_N"])
    given = weighted.contact.weights.length if weighted.contact else None
    assert given is not None
    lengths = given * _PARTS
    by_length = np.array([force_at(with_length_weight(search, length), last) for length in lengths])
    pressed = weighted.pressures[1:]
    at_tuned = np.array([force_at(with_length_weight(solver, tuned), P) for P in pressed])
    return Found(
        pressure=in_bar(weighted.pressures),
        force={name: np.array([_force(step) for step in run.steps]) for name, run in runs.items()},
        steps={name: run.steps[-1] for name, run in runs.items()},
        published_length=tuned,
        published_force=np.append(0.0, at_tuned),
        lengths=lengths,
        by_length=np.where(np.isfinite(by_length), by_length, np.nan),
        offset=_offset(case("constraint_without"), known["without_constraint_N"]),
        readings=_readings(case("constraint_without")),
    )


def _solver(scenario: Scenario, model: Model | None = None) -> BlockedSolver:
    assert scenario.contact is not None
    return BlockedSolver(model or model_of(scenario), scenario.numerics, scenario.contact)


def _force(step: Step) -> float:
    return step.contact.force if step.contact is not None and step.status.has_solution else float("nan")


def _readings(scenario: Scenario) -> dict[str, float]:
    """Return the force without the constraint at the last pressure by other readings of the equations [N]."""
    base = scenario.conventions
    fibre = 0.1 * MILLIMETRE
    own = replace(base, name="own", mean_pressure=False)
    readings: dict[str, tuple[Model, Loads]] = {}

    def add(name: str, model: Model, gravity: float = 0.0) -> None:
        readings[name] = model, Loads(gravity=(0.0, 0.0, gravity))

    def read(conventions: Conventions) -> Model:
        return replace(model_of(scenario), conventions=conventions)

    add("fibre thickness t_f as printed in (S3), (S4), (S6)", read(replace(base, name="fibre", fibre_thickness=fibre)))
    add("each chamber's own pressure in Eq. (12)", read(own))
    add("k_b zero", model_of(scenario, None, replace(STIFFENED, bending=0.0)))
    add("k_e zero", model_of(scenario, None, replace(STIFFENED, elongation=0.0)))
    add("both zero", model_of(scenario, None, BARE))
    add("weight, standing", model_of(scenario), -STANDARD_GRAVITY)
    add("weight, hanging", model_of(scenario), STANDARD_GRAVITY)
    shared, forces = _solver(scenario), {}
    for name, (model, loads) in readings.items():
        # conventions are compiled in, so another one needs a solver of its own
        solver = shared.with_model(model) if model.conventions is base else _solver(scenario, model)
        forces[name] = _force(solver.solve(scenario.pressures[-1], loads, _wall(0.0))[0])
    return forces


def _wall(offset: float) -> Wall:
    """Return a wall at x = offset [m] that pushes along +x, as the robot bends towards -x."""
    return Wall(np.array([offset, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))


def _offset(scenario: Scenario, force: float) -> float:
    """Return the h [m] at which the tip is pushed with a force."""
    from scipy.optimize import brentq

    solver = _solver(scenario)
    reach = float(scenario.robot.outer_radius)
    P = scenario.pressures[-1]
    return float(
        brentq(lambda h: _force(solver.solve(P, scenario.loads, _wall(h))[0]) - force, -reach, reach, xtol=1e-6)
    )


def page(folder: Path) -> str:
    """Write the figures into a folder and return the page."""
    it = found()
    known = published()["simulated_blocked_force"]
    scenario = case("constraint_weighted")
    robot, top = scenario.robot.name, measured_pressure()
    _draw(it, folder)
    links = ", ".join(scenario_link(f"constraint_{name}") for name in RUNS)
    return page_text(
        "With and without the chamber constraint",
        "A robot pressed against a wall cannot let its pressurised chambers shorten freely. The paper simulates "
        f"{robot} in {scenario.material.name} ({law_of(scenario)}) at {top} bar with that constraint, Eq. (14), "
        "and without.",
        f"Scenarios: {links}.",
        _table(it),
        figure("constraint", "Blocked force against pressure, and against the weight of the constraint"),
        "## Why it differs",
        _reasons(it, known, scenario),
        "Readings of the equations that were left open, without the constraint:",
        table(["reading", f"force at {top} bar [N]"], [[name, fixed(f, 3)] for name, f in it.readings.items()]),
    )


def _table(it: Found) -> str:
    known = published()["simulated_blocked_force"]
    measured = measured_forces()[known["robot"]]
    weights = _weights()

    def row(name: str, force: float, paper: float | None) -> list[str]:
        step_error = NONE if paper is None else f"{100 * (force / paper - 1):+.1f}"
        return [name, fixed(force, 3), fixed(paper, 2), step_error, f"{100 * (force / measured - 1):+.1f}"]

    last = {name: float(forces[-1]) for name, forces in it.force.items()}
    rows = [
        row("without: `free`", last["without"], known["without_constraint_N"]),
        row(f"with: `weighted`, W_L = {it.published_length:.1f} /m", float(it.published_force[-1]),
            known["with_constraint_N"]),
        row(f"with: `weighted`, W_L = {weights[2]:g} /m, for all robots", last["weighted"], known["with_constraint_N"]),
        row("with: `compliant`", last["compliant"], known["with_constraint_N"]),
    ]  # fmt: skip
    return f"At {measured_pressure()} bar, where {measured} N was measured:\n\n" + table(
        ["", "here [N]", "published [N]", "to published [%]", "to measured [%]"], rows
    )


def _weights() -> tuple[float, float, float]:
    contact = case("constraint_weighted").contact
    assert contact is not None
    w = contact.weights
    assert w.force is not None and w.moment is not None and w.length is not None  # noqa: PT018
    return w.force, w.moment, w.length


def _reasons(it: Found, known: Mapping[str, float], scenario: Scenario) -> str:
    W_n, W_m, W_L = _weights()
    finite = it.by_length[np.isfinite(it.by_length)]
    weighted = it.steps["weighted"].contact
    assert weighted is not None
    left = {line.equation: line.value for line in weighted.weighted}
    free = float(it.force["without"][-1])
    nearest = min(it.readings, key=lambda name: abs(it.readings[name] - known["without_constraint_N"]))
    springs = it.steps["compliant"].contact
    assert springs is not None
    return "\n".join(
        [
            "- With the constraint the paper solves eight weighted equations for seven unknowns; which weights gave "
            f"its number is not known here. With W_n = {W_n:g} /N and W_m = {W_m:g} /(N m) the published "
            f"{known['with_constraint_N']} N is what W_L = {it.published_length:.2f} /m gives. Only ratios count while "
            f"the wall is held exactly: that is W_L / W_n = {it.published_length / W_n:.2f} N/m.",
            f"- Over the weights of the figure the force of `weighted` goes from {finite.min():.2f} to "
            f"{finite.max():.2f} N, from the rod alone to chambers that hardly give. So the published number is within "
            "what the method can give, but it does not follow from the equations alone.",
            f"- `weighted` leaves errors: with W_L = {W_L:g} /m a moment of {1e3 * abs(left['e_m']):.0f} N mm at the "
            f"tip and {abs(left['e_L']) / MILLIMETRE:.1f} mm of chamber length. `compliant` solves every equation; its "
            f"chambers give way by {abs(springs.length_error) / MILLIMETRE:.1f} mm in sum.",
            f"- Without the constraint the problem is square and nothing can be tuned: {free:.3f} N, "
            f"{100 * (1 - free / known['without_constraint_N']):.0f} % below the published "
            f"{known['without_constraint_N']} N. No reading of the equations in the table below closes that; the "
            f'nearest is "{nearest}" with {it.readings[nearest]:.3f} N. A tip held {it.offset / MILLIMETRE:.1f} mm '
            "past the axis would give it, and so would a small weight of the constraint. Which it was is not known.",
        ]
    )


def _draw(it: Found, folder: Path) -> None:
    """Draw the force against pressure, and at the last pressure against W_L."""
    known = published()["simulated_blocked_force"]
    robot, top = known["robot"], measured_pressure()
    canvas, (left, right) = panels(
        f"{robot}, with and without the chamber constraint",
        f"{law_of(case('constraint_weighted'))}",
        1,
        2,
        row_height=3.4,
    )
    label_outer([left, right], 2, "pressure [bar]", "blocked force [N]")
    named(left, "force against pressure")
    lines = {
        "without": ("free", it.force["without"], colour(5)),
        "compliant": ("compliant", it.force["compliant"], colour(0)),
        "weighted": (f"weighted, W_L = {_weights()[2]:g} /m", it.force["weighted"], colour(1)),
        "published": (f"weighted, W_L = {it.published_length:.1f} /m", it.published_force, colour(3)),
    }
    for label, force, shade in lines.values():
        left.plot(it.pressure, force, color=shade, marker=".", label=label)
    left.plot([top], [measured_forces()[robot]], label="measured", **MEASURED)
    simulated = [known["with_constraint_N"], known["without_constraint_N"]]
    hollow = {**MEASURED, "marker": "s", "markerfacecolor": "white"}
    left.plot([top, top], simulated, label="published simulations", **hollow)
    left.set_xlim(0, top)
    left.set_ylim(bottom=0)
    named(right, f"at {top} bar against the weight of the constraint")
    right.plot(it.lengths, it.by_length, color=colour(1), marker=".", zorder=3)
    for value, words in zip(simulated, ("published, with", "published, without"), strict=True):
        right.axhline(value, color=GREY, linewidth=0.9, linestyle=(0, (5, 3)))
        right.text(it.lengths[0], value, f" {words}", color=GREY, va="bottom", size=8)
    right.plot([it.published_length], [known["with_constraint_N"]], **hollow)
    right.set(xscale="log", xlabel="weight W_L [1/m]")
    right.set_ylim(bottom=0)
    legend(canvas, left, 6)
    saved(canvas, folder, "constraint")
