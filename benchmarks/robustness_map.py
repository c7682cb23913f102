"""Where each way of solving a loaded pose from nothing succeeds, over pressure and tip force.

    python -m benchmarks.robustness_map [--images docs/images] [--out docs/benchmarks] [--directions 6] [--workers N]

D15L60 in Ecoflex 00-50 with one set pressed, and a dead force at the tip of up to three times the load at which the
straight robot without pressure buckles, pi^2 EI / (4 L^2). Each cell has the force along -z, across along +x, and in
random directions. The ways are those of `benchmarks.robust_methods`. An answer counts when its residual, evaluated
again, is at most 1e-8. It is then held against the equilibrium that the robot reaches when the force is applied slowly
to the pressurised robot: a solution may be another one, and a stable one or not.

Writes robustness.png, robustness.json and robustness.md, and nothing else.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

from benchmarks import machine, robustness_report
from benchmarks.paper_method import Array
from benchmarks.robust_methods import Methods, Pose
from softnlp import BAR, Loads, material, robot
from softnlp.cli.console import progress
from softnlp.model.quantities import Model, force_unit

MODEL = Model(robot("D15L60"), material("Ecoflex 00-50"))
BUCKLING = float(np.pi**2 / 4 * force_unit(MODEL))  # [N]
PRESSURES = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5)  # [bar]
FORCES = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0)  # of BUCKLING
RESIDUAL = 1e-8
_SAME_TIP = 1e-2  # of the length, and of a direction cosine


@dataclass(frozen=True)
class Outcome:
    """How one way ended at one pose. words : why, where it is no solution.

    same : whether the solution is the load path's; None where that path turns back before the whole force.
    """

    method: str
    solved: bool
    same: bool | None
    stable: bool
    iterations: int
    words: str


@dataclass(frozen=True)
class Tried:
    """One pose. force : of the buckling load. path_stable : None where the load path turns back before its end."""

    pressure_bar: float
    force: float
    direction: tuple[float, float, float]
    path_stable: bool | None
    outcomes: tuple[Outcome, ...]


def directions(cell: int, count: int) -> Array:
    """Return unit vectors (count, 3): against the axis, across it, and at random, the same for the same cell."""
    drawn = np.random.default_rng([cell, 7]).normal(size=(count, 3))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    drawn[:2] = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])[: len(drawn[:2])]
    return drawn


@cache
def methods() -> Methods:
    """Return the ways, compiled once in each process."""
    return Methods(MODEL)


def try_cell(cell: int, count: int) -> list[Tried]:
    """Try every way at every direction of one cell."""
    pressure, force = PRESSURES[cell % len(PRESSURES)], FORCES[cell // len(PRESSURES)]
    return [try_pose(pressure, force, d) for d in directions(cell, count)]


def try_pose(pressure: float, force: float, direction: Array) -> Tried:
    """Try every way at one pose: pressure of set 1 [bar], force of the buckling load."""
    ways = methods()
    pose = Pose(np.array([pressure * BAR, 0.0, 0.0]), Loads(tip_force=force * BUCKLING * direction))
    path = ways.end_of_load_path(pose)
    reached = None if path is None else ways.tip(ways.grid, path)
    outcomes = []
    for name, solve in ways.by_name.items():
        found = solve(pose)
        solved = ways.residual(found, pose) <= RESIDUAL
        same = None
        if solved and reached is not None:
            same = bool(np.abs(ways.tip(found.grid, found.x) - reached).max() <= _SAME_TIP)
        stable = solved and ways.stable(found.grid, found.x, pose)
        outcomes.append(Outcome(name, solved, same, stable, found.iterations, "" if solved else found.words))
    path_stable = None if path is None else ways.stable(ways.grid, path, pose)
    x, y, z = map(float, direction)
    return Tried(pressure, force, (x, y, z), path_stable, tuple(outcomes))


def tried(count: int, workers: int) -> list[Tried]:
    """Try all cells, the hardest first, with a progress bar on a terminal."""
    cells = range(len(PRESSURES) * len(FORCES))[::-1]
    found: list[Tried] = []
    with ProcessPoolExecutor(workers) as pool, progress(len(cells), "cells") as (advance, _):
        for k, poses in enumerate(pool.map(partial(try_cell, count=count), cells)):
            found += poses
            advance(k + 1)
    return found[::-1]


def main(arguments: Sequence[str] | None = None) -> None:
    """Try everything and write the figure, the numbers and their summary."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.robustness_map", description=__doc__.splitlines()[0])
    parser.add_argument("--images", type=Path, default=Path("docs/images"), help="folder of robustness.png")
    parser.add_argument("--out", type=Path, default=Path("docs/benchmarks"), help="folder of the JSON and its summary")
    parser.add_argument("--directions", type=int, default=6, help="of the force in each cell, 6 by default")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args(arguments)
    if given.directions < 1:
        parser.error("--directions: expected 1 or more")
    began = time.perf_counter()
    found = tried(given.directions, given.workers)
    seconds = time.perf_counter() - began
    for folder in (given.images, given.out):
        folder.mkdir(parents=True, exist_ok=True)
    robustness_report.figure(found, BUCKLING, given.images / "robustness.png")
    described = machine.described()
    page = robustness_report.markdown(found, BUCKLING, described, seconds)
    (given.out / "robustness.md").write_text(page, encoding="utf-8")
    document = {
        "machine": described,
        "seconds": seconds,
        "robot": MODEL.robot.name,
        "silicone": MODEL.material.name,
        "buckling_N": BUCKLING,
        "residual": RESIDUAL,
        "poses": [asdict(pose) for pose in found],
    }
    (given.out / "robustness.json").write_text(
        json.dumps(document, allow_nan=False, separators=(",", ":")) + "\n", encoding="utf-8"
    )
    print(page)


if __name__ == "__main__":
    main()
