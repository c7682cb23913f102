"""Identification and design beside Nelder-Mead around the paper's method; see `benchmarks.studies`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks import design, identify
from benchmarks.paper_method import Array, Tip
from benchmarks.race import Entry
from benchmarks.rods import NO_LOADS, Rods
from benchmarks.studies import Task, paper_tip_state
from softnlp import DesignTask, load_scenario
from softnlp import design as our_design
from softnlp.model.conventions import Coefficients
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.studies.design_evaluate import chamber_gaps, robot_outputs


def identification() -> Task:
    """Three constants from angle, elongation and tip at nine pressures."""
    values = identify.seen(identify.TRUE)
    rods = Rods(Model(identify.ROBOT, identify.SILICONE))

    def by_paper() -> Callable[[Array], Array]:
        starts: dict[int, Array] = {}

        def observables(x: Array) -> Array:
            k_e, k_b, phi = x
            changed = replace(rods.model, coefficients=Coefficients(elongation=k_e, bending=k_b, bore_fraction=phi))
            rows = []
            for k, P in enumerate(identify.P):
                rod = rods.at(P, changed=changed)
                tip, starts[k] = paper_tip_state(rod, NO_LOADS, starts.get(k, "arc"))
                rows.append([*tip.p, tilt(tip), rod.length - identify.ROBOT.length])
            return np.array(rows)

        return observables

    def search(make: Callable[[], Callable[[Array], Array]]) -> Callable[[], identify.Timed]:
        return partial(identify.by_search, values, make)

    entries = [
        Entry("softnlp", "auto", lambda: partial(identify.by_derivatives, values), reference=True),
        Entry("Nelder-Mead, softnlp's closed form", "exact", lambda: search(identify.closed_form), once=True),
        Entry("Nelder-Mead, softnlp's poses", "auto", lambda: search(identify.forward_solves), once=True),
        Entry("Nelder-Mead, paper's method, floats", "20 steps", lambda: search(by_paper), once=True,
              uncharged=lambda: rods.seconds),
    ]  # fmt: skip
    return Task("identification", "fit", "farthest constant from the true one", entries, lambda done: done.error)


def tilt(tip: Tip) -> float:
    """Return the tip's tilt [rad], which is the bending angle of an arc of less than half a turn."""
    return float(np.arctan2(np.hypot(tip.R[0, 2], tip.R[1, 2]), tip.R[2, 2]))


def best_design() -> Task:
    """Four dimensions for the largest bending angle at a pressure, under the rules of manufacture; no force asked."""
    scenario = load_scenario(design.FILE)
    assert isinstance(scenario.task, DesignTask)
    assert isinstance(scenario.task.pressure, float)
    angle = {name: limits for name, limits in scenario.task.requirements.items() if name != "blocked_force"}
    task = replace(scenario.task, requirements=angle)
    pressure = np.zeros(scenario.robot.chamber_sets)
    pressure[list(task.sets)] = scenario.task.pressure
    rods = Rods(Model(scenario.robot, scenario.material))

    def ours() -> float:
        best = our_design(scenario.robot, scenario.material, task).best
        if best is None:
            raise RuntimeError("no design was found")
        return best.objective

    answer = ours()

    def by_paper(robot: Robot) -> dict[str, float]:
        try:
            rod = rods.at(pressure, changed=Model(robot, scenario.material))
            tip, _ = paper_tip_state(rod, NO_LOADS, "arc")
        except (ArithmeticError, RuntimeError):
            return {}
        stretch = rod.length / float(robot.length)
        gap = min(float(gap) for gap in chamber_gaps(robot, stretch))
        found = {"bending_angle": tilt(tip), "stretch": stretch, "chamber_gap": gap}
        return {**robot_outputs(robot), **found}

    def search(solve: design.Outputs) -> float:
        return design.nelder_mead(scenario, task, solve, answer)[0]

    entries = [
        Entry("softnlp", "auto", lambda: ours, reference=True, note="everything built, every start"),
        Entry("Nelder-Mead, softnlp's poses", "auto", lambda: partial(search, design.kept(scenario, task)), once=True),
        Entry("Nelder-Mead, paper's method, floats", "20 steps", lambda: partial(search, by_paper), once=True,
              uncharged=lambda: rods.seconds),
    ]  # fmt: skip
    return Task("design", "design", "short of our angle, of it", entries, lambda best: (answer - best) / abs(answer))
