"""How fast sweeps are, beside a pose of the paper's method, and what it takes to run them.

    python -m benchmarks.sweep [--million]

Every rate is of a whole sweep in a folder of its own: plan, workers, journal and result file. The model is D25L60 in
Ecoflex 00-50 to 1.2 bar with its weight and a small tip force, so that every pose is a boundary value problem, to the
default accuracy of 1e-6 of the length. "lane" is the arithmetic alone: chunks solved in one process. The blocked forces
are those of set 1 to 1.5 bar against the wall at the axis.

The paper's method is single shooting with 20 RK4 steps in NumPy and Levenberg-Marquardt with finite differences
(`benchmarks.paper_method`), here from the closed form of the unloaded shape. It gets the stretch and the stiffnesses
for nothing, and computes no error estimate and no stability, where a pose of a sweep includes all of these.

Processor time is told beside wall time, since the second depends on what else the machine does.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from statistics import median
from unittest.mock import patch

import numpy as np

from benchmarks import paper_method
from benchmarks.numpy_field import numpy_field
from benchmarks.paper_method import solve_pose
from benchmarks.statics import rod_at
from softnlp import BAR, Loads, Numerics, material, robot
from softnlp.base.units import STANDARD_GRAVITY
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan, cells
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.quantities import Model
from softnlp.scenario.workspace import run_sweep
from softnlp.sweep.dataset import data_hash
from softnlp.sweep.run import WORKSPACE_FILE

MODEL = Model(robot("D25L60"), material("Ecoflex 00-50"))
LOADS = Loads(tip_force=(0.02, 0.0, -0.01), gravity=(0.0, 0.0, -STANDARD_GRAVITY))
PAPER_POSES = 40


def plan(levels: int, *, chunk: int = 1024) -> Plan:
    """Return a grid of levels^3 poses."""
    axis = np.linspace(0, 1.2 * BAR, levels)
    values = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    return Plan(MODEL, LOADS, Numerics(), None, ("pressure",), values, cells(values, chunk), chunk)


def blocked_plan(poses: int, closure: str) -> Plan:
    """Return blocked poses along the pressure of set 1."""
    values = np.linspace(0, 1.5 * BAR, poses)[:, None] * np.array([1.0, 0.0, 0.0])
    contact = ContactSettings(closure=closure)  # type: ignore[arg-type]
    return Plan(MODEL, Loads(), Numerics(), contact, ("pressure",), values, cells(values, 1024), 1024)


def swept(asked: Plan, workers: int, executor: object = None) -> tuple[float, str, int]:
    """Return the seconds of a whole sweep, the digest of its data, and how many poses failed."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        summary = run_sweep(asked, folder, workers=workers, executor=executor)  # type: ignore[arg-type]
        seconds = time.perf_counter() - began
        return seconds, data_hash(Path(folder) / WORKSPACE_FILE), summary.failed


def lane(asked: Plan) -> tuple[float, float, np.ndarray]:
    """Return wall and processor seconds of the arithmetic alone, and the rows."""
    solver = ChunkSolver(asked)
    solver.solve(0)
    wall, processor = time.perf_counter(), time.process_time()
    rows = [solver.solve(k).rows for k in range(asked.chunks)]
    return time.perf_counter() - wall, time.process_time() - processor, np.concatenate(rows)


def paper_pose() -> tuple[float, float]:
    """Return wall and processor seconds of a pose of the paper's method."""
    rng = np.random.default_rng(0)
    rods = [rod_at(P, LOADS) for P in rng.uniform(0, 1.2 * BAR, (PAPER_POSES, 3))]
    with patch.object(paper_method, "field", numpy_field):
        wall, processor = time.perf_counter(), time.process_time()
        for rod in rods:
            if not solve_pose(rod, LOADS.tip_force, LOADS.tip_moment, start="arc").residual < 1e-6:
                raise RuntimeError("the paper's method did not converge")
        return (time.perf_counter() - wall) / PAPER_POSES, (time.process_time() - processor) / PAPER_POSES


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--million", action="store_true", help="also a sweep of a million poses")
    million = parser.parse_args().million
    ChunkSolver(plan(13))  # so that everything is compiled
    ChunkSolver(blocked_plan(2048, "free"))
    ChunkSolver(blocked_plan(2048, "compliant"))
    print(
        f"\n{MODEL.robot.name}, {MODEL.material.name}, to 1.2 bar, weight and tip force, {os.cpu_count()} processors\n"
    )
    print_rates()
    print_workers()
    print_growth(million)
    print_small()


def print_rates() -> None:
    """Print what a pose costs by every way."""
    asked = plan(22)
    wall, processor, rows = lane(asked)
    seconds, _, failed = min(swept(asked, 2) for _ in range(3))
    paper_wall, paper_processor = paper_pose()
    print(f"  {'':44s} {'poses':>8s} {'poses/s':>9s} {'of processor':>13s}")

    def line(what: str, poses: int, took: float, processor: float | None = None) -> None:
        own = "" if processor is None else f"{poses / processor:13.0f}"
        print(f"  {what:44s} {poses:8d} {poses / took:9.0f} {own}")

    line("sweep, compiled, 2 workers, with journal", asked.poses, seconds)
    line("lane, compiled, 1 process", asked.poses, wall, processor)
    with patch.dict(os.environ, {"SOFTNLP_COMPILE": "0"}):
        small = plan(13)
        bare, _, _ = swept(small, 2)
        line("sweep, in NumPy, 2 workers", small.poses, bare)
    for closure in ("free", "compliant"):
        blocked = blocked_plan(10_000, closure)
        took, _, lost = min(swept(blocked, 2) for _ in range(2))
        line(f"blocked force, {closure}, 2 workers", blocked.poses, took)
        failed += lost
    line("paper's method, NumPy, 1 process", PAPER_POSES, PAPER_POSES * paper_wall, PAPER_POSES * paper_processor)
    ratio = paper_processor / (processor / asked.poses)
    print(f"\n  a pose of the lane is {ratio:.0f} times faster than one of the paper's method, a processor")
    print(f"  largest residual {rows['residual'].max():.1e}, estimated error {rows['error'].max():.1e} of the length")
    intervals, iterations = rows["intervals"].mean(), rows["iterations"].mean()
    print(f"  {intervals:.1f} intervals and {iterations:.2f} iterations a pose, {failed} failed\n")


def print_workers() -> None:
    """Print what a second worker and a cluster of two bring, for poses of 20 us, of 200 us and of 20 ms."""
    print(f"  {'':30s} {'poses':>8s} {'1 worker':>10s} {'2 workers':>10s} {'':7s} {'Dask, 2':>9s}   same data")
    one_by_one = replace(plan(10, chunk=20), numerics=Numerics(transcription="collocation"))
    asked = {
        "poses": plan(80),
        "blocked forces, compliant": blocked_plan(40_000, "compliant"),
        "poses one by one, collocation": one_by_one,
    }
    found = {what: (swept(one, 1), swept(one, 2)) for what, one in asked.items()}
    clustered = {}
    with suppress(ImportError):  # last, since its threads would keep the others from forking their workers
        from distributed import Client, LocalCluster

        local = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
        with LocalCluster(**local) as cluster, Client(cluster) as client:
            swept(plan(13), 2, client.get_executor())  # workers import on their first chunk
            clustered = {what: swept(one, 2, client.get_executor()) for what, one in asked.items()}
    for what, (one, two) in found.items():
        line = f"  {what:30s} {asked[what].poses:8d} {one[0]:8.2f} s {two[0]:8.2f} s {one[0] / two[0]:5.2f}x "
        identical = one[1] == two[1]
        if what in clustered:
            line += f" {clustered[what][0]:6.2f} s {one[0] / clustered[what][0]:5.2f}x"
            identical = identical and one[1] == clustered[what][1]
        print(f"{line}  {'yes' if identical else 'NO'}")
    print()


def print_growth(million: bool) -> None:
    """Print seconds and memory of growing sweeps, each in a process of its own."""
    print(f"  {'poses':>9s} {'seconds':>9s} {'poses/s':>9s} {'memory, MB':>11s}")
    for levels in (10, 22, 46, *((100,) if million else ())):
        code = f"from benchmarks.sweep import grown; grown({levels})"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        poses, seconds, memory = done.stdout.split()
        print(f"  {poses:>9s} {float(seconds):9.2f} {int(poses) / float(seconds):9.0f} {float(memory):11.0f}")
    print()


def grown(levels: int) -> None:
    """Sweep with two workers; print poses, seconds and the largest memory of this process and of a worker [MB]."""
    asked = plan(levels)
    seconds, _, _ = swept(asked, 2)
    used = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    print(asked.poses, seconds, used / 1024)


def print_small() -> None:
    """Print the time of a small sweep as a whole process."""
    scenario = Path(__file__).parents[1] / "scenarios" / "workspace" / "D25L60_sequence.toml"

    def run() -> float:
        with tempfile.TemporaryDirectory() as out:
            command = [sys.executable, "-m", "softnlp", "sweep", str(scenario), "--out", out]
            began = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True)
            return time.perf_counter() - began

    print(f"  {scenario.name}, 260 poses, whole process: {median(run() for _ in range(3)):.2f} s\n")


if __name__ == "__main__":
    main()
