"""What a pose that touches takes beside the same pose without obstacles, in processor time, side by side in one run.

    python -m benchmarks.obstacles

A robot is pressed against each kind of obstacle and let back, once with every engine. Each sequence is solved three
times; the first one compiles, and of the others the least time counts.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from softnlp import (
    BAR,
    Capsule,
    Cylinder,
    Loads,
    Numerics,
    Plane,
    Run,
    Sphere,
    Trocar,
    Tube,
    forward,
    material,
    robot,
)
from softnlp.base.units import STANDARD_GRAVITY
from softnlp.cli.console import say
from softnlp.model.obstacles import Obstacle

PRESSURES = np.array([0.3, 0.6, 0.9, 1.2, 0.9, 0.6])[:, None] * [BAR, 0.0, 0.0]
REPEATS = 3
KINDS: dict[str, Obstacle] = {
    "plane": Plane(point=(-0.02, 0, 0), normal=(1, 0, 0.2)),
    "sphere": Sphere(centre=(-0.03, 0, 0.04), radius=0.01),
    "cylinder": Cylinder(start=(-0.035, -0.05, 0.045), end=(-0.035, 0.05, 0.045), radius=0.01),
    "capsule": Capsule(start=(-0.035, -0.02, 0.04), end=(-0.035, 0.02, 0.04), radius=0.01),
    "trocar": Trocar(point=(0, 0, 0.03), axis=(0, 0, 1), radius=0.014, length=0.01),
    "tube": Tube(start=(0, 0, 0.005), end=(0, 0, 0.03), radius=0.014),
}


def timed(engine: str, obstacles: Sequence[Obstacle]) -> tuple[float, Run]:
    """Return the least processor time of a pose of the sequence [s], and the run."""
    times = []
    for _ in range(REPEATS):
        began = time.process_time()
        run = forward(
            robot("D25L60"),
            material("Ecoflex 00-50"),
            PRESSURES,
            loads=Loads(gravity=(0, 0, -STANDARD_GRAVITY)),
            numerics=Numerics(engine=engine),  # type: ignore[arg-type]
            obstacles=obstacles,
        )
        times.append((time.process_time() - began) / len(PRESSURES))
    return min(times[1:]), run


def main() -> None:
    """Print the table."""
    say("| engine | obstacle | ms a pose | of a free pose | poses that touch |")
    say("|---|---|--:|--:|--:|")
    for engine in ("newton", "auto", "ipopt"):
        free, _ = timed(engine, [])
        say(f"| {engine} | none | {1e3 * free:.0f} | 1 | |")
        for name, obstacle in KINDS.items():
            seconds, run = timed(engine, [obstacle])
            touching = sum(any(contact.arc.size for contact in step.contacts) for step in run.steps)
            solved = sum(step.status.has_solution for step in run.steps)
            lost = "" if solved == len(run.steps) else f", {len(run.steps) - solved} without a solution"
            say(f"| {engine} | {name} | {1e3 * seconds:.0f} | {seconds / free:.1f} | {touching}{lost} |")


if __name__ == "__main__":
    main()
