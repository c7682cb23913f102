"""How long a design takes beside a derivative-free search, and whether random designs beat it.

    python -m benchmarks.design [speed] [random]

"speed": the dimensions of scenarios/design/D25L60_dimensions.toml, with the force required and without. Ours is
`softnlp.design` as a script calls it: everything built, every start, the answer solved again. The other is
scipy.optimize.minimize with Nelder-Mead from the middle of the same box, requirements and rules of manufacture as
penalties, around the forward solve, begun again from its best design until it is within 0.1 % of our answer or has
solved 400 designs: "as run" calls `softnlp.forward` or `softnlp.blocked_force` for each design, as a
script would; "kept" keeps one solver with everything compiled. Seconds of processor time, in one run.

"random": 2,000 random designs that meet every requirement, judged by the same forward solve, against the optimum. The
force asked for is lowered to 0.2 N there: a random design hardly ever pushes with 1 N. The optimum is the same.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from softnlp import DesignTask, Numerics, at_least, design, forward, load_scenario
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.scenario.read import Scenario
from softnlp.studies.blocked_force import blocked_force
from softnlp.studies.design_evaluate import Evaluator, broken_rules, chamber_gaps, missed, robot_outputs, shape_outputs
from softnlp.studies.design_task import Setting

FILE = Path(__file__).parents[1] / "scenarios" / "design" / "D25L60_dimensions.toml"
PENALTY = 20.0  # objective units for missing a requirement by all of its limit, or a wall by a millimetre
RANDOM = 2000
RANDOM_FORCE = 0.2  # [N]
MOST_EVALUATIONS = 400
REACHED = 1e-3

Outputs = Callable[[Robot], dict[str, float]]


def main() -> None:
    """Run what is asked for, everything by default."""
    asked = sys.argv[1:] or ["speed", "random"]
    scenario = load_scenario(FILE)
    task = scenario.task
    assert isinstance(task, DesignTask)
    if "speed" in asked:
        angle = {name: limits for name, limits in task.requirements.items() if name != "blocked_force"}
        compare("without a force", scenario, replace(task, requirements=angle))
        compare("with a force", scenario, task)
    if "random" in asked:
        lowered = {**task.requirements, "blocked_force": at_least(RANDOM_FORCE)}
        compare_random(scenario, replace(task, requirements=lowered))


def compare(title: str, scenario: Scenario, task: DesignTask) -> None:
    """Print the seconds and the answers of both."""
    began = time.process_time()
    found = design(scenario.robot, scenario.material, task).best
    ours = time.process_time() - began
    assert found is not None
    scale = task.objective.scale
    print(f"\n{title}: {task.objective.key}\n")
    print(f"  {'softnlp.design':20s} {found.objective / scale:9.3f}  {ours:8.2f} s  {found.iterations:5d} iterations")
    for name, solve in (("Nelder-Mead, kept", kept(scenario, task)), ("Nelder-Mead, as run", as_run(scenario, task))):
        began = time.process_time()
        best, evaluations = nelder_mead(scenario, task, solve, found.objective)
        theirs = time.process_time() - began
        line = f"  {name:20s} {best / scale:9.3f}  {theirs:8.2f} s  {evaluations:5d} solves    "
        print(f"{line}{theirs / ours:7.1f} times ours")


class _Done(Exception):
    """Ends a search."""


def nelder_mead(scenario: Scenario, task: DesignTask, solve: Outputs, answer: float) -> tuple[float, int]:
    """Return the best objective among designs met that are feasible, and how many were solved."""
    names, ranges = list(task.ranges), list(task.ranges.values())
    lower, upper = (np.array([getattr(r, side) for r in ranges]) for side in ("lower", "upper"))
    best, evaluations = -np.inf, 0
    place = np.full(len(names), 0.5)

    def cost(unit: np.ndarray) -> float:
        nonlocal best, evaluations, place
        robot = replace(scenario.robot, **dict(zip(names, lower + unit * (upper - lower), strict=True)))
        off = rules_missed(robot, task)
        if off > 1.0:  # no use in solving what cannot be made at all
            return PENALTY * (10.0 + off)
        evaluations += 1
        outputs = solve(robot)
        if not outputs:
            return PENALTY * 10.0
        off += sum(part for _, _, part in missed(outputs, task.requirements))
        objective = outputs[task.objective.name]
        if off <= 1e-5 and task.sign * objective > best:
            best, place = task.sign * objective, unit
        if evaluations >= MOST_EVALUATIONS or best >= task.sign * answer - REACHED * abs(answer):
            raise _Done
        return -task.sign * objective / task.objective.scale / 10 + PENALTY * off

    options = {"xatol": 1e-4, "fatol": 1e-4}
    with suppress(_Done):
        while True:
            minimize(cost, place, method="Nelder-Mead", bounds=[(0, 1)] * len(names), options=options)
    return task.sign * best, evaluations


def rules_missed(robot: Robot, task: DesignTask) -> float:
    """Return by how much the rules of manufacture are missed [mm]."""
    walls = robot_outputs(robot)
    short = [task.minimum_wall - walls["wall"], -walls["outer_wall"], -walls["inner_wall"]]
    short += [-gap for gap in chamber_gaps(robot, 1.0)]
    return float(1e3 * sum(max(0.0, float(v)) for v in short))


def kept(scenario: Scenario, task: DesignTask) -> Outputs:
    """Return the forward solve with one solver kept."""
    setting = Setting(scenario.robot, scenario.material)
    evaluator = Evaluator(setting, task, Model(scenario.robot, scenario.material))
    assert isinstance(task.pressure, float)
    P = task.pressure
    return lambda robot: dict(evaluator.full(Model(robot, scenario.material), P).outputs)


def as_run(scenario: Scenario, task: DesignTask) -> Outputs:
    """Return the forward solve as a script calls it."""
    assert isinstance(task.pressure, float)
    pressures = np.zeros(scenario.robot.chamber_sets)
    pressures[list(task.sets)] = task.pressure

    def solve(robot: Robot) -> dict[str, float]:
        run = (blocked_force if task.needs_force else forward)(robot, scenario.material, pressures, numerics=Numerics())
        step = run.steps[0]
        pose = step.contact.free if step.contact is not None else step.pose
        if pose is None:
            return {}
        found = {**robot_outputs(robot), **shape_outputs(robot, pose), "pressure": task.pressure}
        found["chamber_gap"] = min(float(gap) for gap in chamber_gaps(robot, pose.stretch))
        return found | ({"blocked_force": step.contact.force} if step.contact is not None else {})

    return solve


def compare_random(scenario: Scenario, task: DesignTask) -> None:
    """Print the best of random feasible designs beside the optimum."""
    found = design(scenario.robot, scenario.material, task).best
    assert found is not None
    setting = Setting(scenario.robot, scenario.material)
    evaluator = Evaluator(setting, task, Model(scenario.robot, scenario.material))
    assert isinstance(task.pressure, float)
    free = {name: limits for name, limits in task.requirements.items() if name != "blocked_force"}
    rng = np.random.default_rng(11)
    objectives: list[float] = []
    drawn = made = 0
    began = time.process_time()
    while len(objectives) < RANDOM:
        drawn += 1
        chosen = {name: float(rng.uniform(r.lower, r.upper)) for name, r in task.ranges.items()}
        robot = replace(scenario.robot, **chosen)
        if broken_rules(robot, task):
            continue
        model = Model(robot, scenario.material)
        shape = evaluator.free(model, task.pressure)
        if not shape.outputs or list(missed(shape.outputs, free)):
            continue
        made += 1
        whole = evaluator.full(model, task.pressure)
        if whole.outputs and not list(missed(whole.outputs, task.requirements)):
            objectives.append(task.sign * whole.outputs[task.objective.name])
    scale = task.objective.scale
    best = task.sign * max(objectives)
    print(f"\n{RANDOM} random feasible designs ({drawn} drawn, {made} solved, {time.process_time() - began:.0f} s)\n")
    print(f"  best of them {best / scale:.3f}, the optimum {found.objective / scale:.3f} ({task.objective.key})")
    if not task.sign * found.objective >= max(objectives) * (1 - 1e-9):
        raise SystemExit("a random design beats the optimum")


if __name__ == "__main__":
    main()
