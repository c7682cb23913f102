"""Motion over time: what a step costs, a minute of a gait, and how many of many random runs reach their end.

`python -m benchmarks.dynamics cost`, `gait` or `random [COUNT]`; `swing FILE` writes a trace. Times are wall times of
one process; set OMP_NUM_THREADS=1 where other programs run.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp import BAR, Body, Loads, Numerics, Segment, forward, material, robot
from softnlp.base.status import Status
from softnlp.dynamics.drive import Series
from softnlp.dynamics.grid import grid_of
from softnlp.dynamics.rod import Rod
from softnlp.dynamics.rules import rule
from softnlp.dynamics.sections import Failed, Sections
from softnlp.dynamics.simulation import Dynamics, Simulation
from softnlp.model.robot import ROBOTS
from softnlp.studies.dynamic import chosen_intervals, dynamic
from softnlp.studies.free_motion import stiffer

Array = NDArray[np.float64]

ROBOT, RUBBER = "D25L60", "Ecoflex 00-50"


def gait(seconds: float, step: float = 0.01) -> dict[str, float]:
    """Three sets pressed in turn, 1 Hz, hanging, at one step of time and output after another."""
    t = np.arange(0, seconds + step / 2, step)
    P = np.stack([0.4 * BAR * (1 + np.sin(2 * np.pi * (t + k / 3))) for k in range(3)], axis=1)
    began, worked = time.perf_counter(), time.process_time()
    asked = Dynamics(seconds, step, damping=0.004, lag=0.03, output_step=max(step, seconds / 600))
    run = dynamic(robot(ROBOT), material(RUBBER), P, asked, times=t, loads=Loads(gravity="hanging"))
    steps = sum(one.moving.time_steps for one in run.steps if one.moving is not None)
    wall, own = time.perf_counter() - began, time.process_time() - worked
    return {
        "seconds": seconds,
        "wall_s": wall,
        "processor_s": own,
        "steps": steps,
        "wall_ms_per_step": 1e3 * wall / steps,
        "iterations_per_step": sum(one.iterations for one in run.steps) / steps,
        "failed": len(run.failed),
        "largest_residual": max(one.residual or 0.0 for one in run.steps),
    }


def judged(simulation: Simulation, fresh: Rod) -> float:
    """Return the residual of the last step, evaluated again from its resultants alone with a new rod."""
    now, *before = simulation.recent
    numbers = fresh.sections.at(simulation.chambers.at(now.time, after=False))
    step = rule(simulation.asked.rule, before, now.time, simulation.acting(before[0].time))
    at = fresh.placed(numbers, now.e)
    off = step.balance(fresh, now.e, at, numbers, simulation.acting(now.time, after=False)).off
    return float(np.max(np.abs(off)))


def random_run(draw: np.random.Generator) -> dict[str, Any]:
    """One run: any robot, a step of pressures up to what its branch allows, a release or a load over time."""
    name = str(draw.choice([*ROBOTS]))
    rubber = material(str(draw.choice(["Ecoflex 00-10", "Ecoflex 00-30", "Ecoflex 00-50", "Dragon Skin 10"])))
    made = robot(name)
    kind = str(draw.choice(["pressure", "release", "load"]))
    body = Body([Segment(made, rubber)])
    sections = Sections(body, grid_of(body))
    scale = float(Rod(sections, grid_of(body)).units[0])  # EI/L^2 [N]
    direction = draw.random(made.chamber_sets)
    highest = 3.0 * BAR
    while highest > 0.01 * BAR:  # to the end of the branch, nearly
        try:
            sections.at(highest * direction)
            break
        except Failed:
            highest *= 0.9
    P = draw.uniform(0.2, 1.0) * highest * direction
    force = draw.normal(size=3)
    force *= scale * draw.uniform(0.1, 1.0) / np.linalg.norm(force)
    gravity = str(draw.choice(["off", "hanging", "standing"]))
    duration = 0.5
    times, rows, forces = [0.0], P[None], np.zeros((1, 3))
    loads = Loads(gravity=gravity)
    if kind == "pressure":
        ramp = float(draw.choice([0.0, 0.05, 0.2]))
        times, rows, forces = [0.0, ramp], np.stack([0 * P, P]), np.zeros((2, 3))
    elif kind == "load":
        times, rows = [0.0, 0.1, 0.3], np.repeat(P[None], 3, axis=0)
        forces = np.stack([0 * force, force, -force])
    else:
        loads = Loads(tuple(force), gravity=gravity)
    step = draw.choice([None, 0.001, 0.005])
    asked = Dynamics(
        duration,
        None if step is None else float(step),
        rule=str(draw.choice(["trapezoid", "bdf2"])),  # type: ignore[arg-type]
        damping=float(draw.choice([0.001, 0.01])),
        output_step=0.05,
        release=kind == "release",
    )
    both = Series(np.array(times), rows), Series(np.array(times), forces)
    intervals, _ = chosen_intervals(body, loads, both, Numerics())
    simulation = Simulation(body, loads, asked, *both, intervals=intervals, tolerance=1e-9)
    found: dict[str, Any] = {"robot": name, "rubber": rubber.name, "kind": kind, "bar": (P / BAR).tolist()}
    found |= {"rule": asked.rule, "step": asked.step, "gravity": gravity, "status": "solved", "false": False}
    largest, again, steps, began = 0.0, 0.0, 0, time.perf_counter()
    fresh = Rod(Sections(simulation.body, simulation.grid), simulation.grid, asked.damping)
    try:
        for output in simulation.run():
            steps += output.steps
            energy = output.energy
            largest = max(largest, output.residual)
            if len(simulation.recent) > 1:
                again = max(again, judged(simulation, fresh))
            found["false"] |= not np.isfinite(output.instant.at.position).all() or again > 1e-8
    except Failed as failure:
        found |= {"status": failure.status.value, "message": failure.message}
    else:
        found["imbalance"] = abs(energy.imbalance) / max(energy.exchanged, 1e-300)
    found |= {"judged_again": again, "residual": largest, "steps": steps, "wall_s": time.perf_counter() - began}
    return found


def random(count: int, seed: int = 19) -> dict[str, Any]:
    """Many random runs: how many reach their end, how many say so falsely, and what the others say."""
    draw = np.random.default_rng(seed)
    every = []
    for k in range(count):
        every.append(random_run(draw))
        print(k, json.dumps(every[-1]), file=sys.stderr, flush=True)
    ended = [one for one in every if one["status"] == Status.SOLVED]
    return {
        "runs": count,
        "reached_the_end": len(ended),
        "false": sum(one["false"] for one in every),
        "wall_s": sum(one["wall_s"] for one in every),
        "others": [one for one in every if one["status"] != Status.SOLVED],
    }


def cost() -> dict[str, Any]:
    """Time a step of 10 ms of the gait, and a static pose of the same robot, warm."""
    gait(0.2)
    moving = gait(4.0)
    P = [[0.4 * BAR * (1 + np.sin(0.06 * k)), 0.2 * BAR, 0.0] for k in range(60)]
    began = time.perf_counter()
    forward(robot(ROBOT), material(RUBBER), P, loads=Loads(gravity="hanging"))
    return {**moving, "wall_ms_per_static_pose": 1e3 * (time.perf_counter() - began) / len(P)}


def swing(file: str, seed: int = 19) -> None:
    """Write the trace of `scenarios/identify/swing.toml`: a step of pressure, known numbers, and noise of 0.2 mm."""
    asked = Dynamics(0.6, 1e-3, damping=0.006, lag=0.035, output_step=0.01)
    P, t = np.array([[0.0] * 3, [0.0] * 3, [0.5, 0.0, 0.0]]) * BAR, [0.0, 0.05, 0.05]
    silicone = stiffer(material(RUBBER), 1.12)
    run = dynamic(robot(ROBOT), silicone, P, asked, times=t, loads=Loads(gravity="hanging"))
    draw = np.random.default_rng(seed)
    with Path(file).open("w") as out:
        out.write("t_s,x_mm,y_mm,z_mm\n")
        for step in run.steps:
            assert step.pose is not None
            tip = 1e3 * step.pose.tip_position + 0.2 * draw.normal(size=3)
            out.write(f"{step.time:.3f},{tip[0]:.2f},{tip[1]:.2f},{tip[2]:.2f}\n")


def main(words: list[str]) -> None:
    """Print one of the measurements as JSON."""
    what = words[0] if words else "cost"
    if what == "gait":
        print(json.dumps(gait(60.0), indent=2))
    elif what == "swing":
        swing(words[1])
    elif what == "random":
        print(json.dumps(random(int(words[1]) if len(words) > 1 else 200), indent=2))
    else:
        print(json.dumps(cost(), indent=2))


if __name__ == "__main__":
    main(sys.argv[1:])
