"""How often a cold solve of a hard pose succeeds, and how long it takes: `python benchmarks/robustness.py --cases 300`.

A case is a robot of the library in any silicone and law; one to three chamber sets, with pressures in any ratio that
stretch the robot by up to 1.8 (a third of the cases by just that), which may curl it more than once around; a tip force
up to 3 EI/L^2 and a tip moment up to EI/L in any direction, with the EI and L of the robot without pressure; gravity in
any direction, or off. Each is solved on its own, from nothing, compiling its problem: there is no neighbour to start
from. A case counts as a success when it is reported as solved and its largest scaled residual, evaluated again, is at
most 1e-8.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from os import cpu_count
from statistics import median

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import SoftnlpError
from softnlp.base.status import Status
from softnlp.model.materials import Material, load_materials
from softnlp.model.quantities import Model, quantities
from softnlp.model.robot import ROBOTS, Robot
from softnlp.model.rod import Loads
from softnlp.model.round_chambers import deform
from softnlp.statics.branch import branch_function, stretch_on_branch
from softnlp.statics.step import Step
from softnlp.studies.forward import forward

MOST_STRETCH = 1.8
MOST_FORCE = 3.0  # EI / L^2
MOST_MOMENT = 1.0  # EI / L
GRAVITY = 9.80665
RESIDUAL = 1e-8


@dataclass(frozen=True, eq=False)
class Case:
    """A pose to solve. pressure : (sets,) [Pa]."""

    seed: int
    robot: Robot
    material: Material
    pressure: NDArray[np.float64]
    loads: Loads

    def __str__(self) -> str:
        bar = np.round(self.pressure / 1e5, 4).tolist()
        loads = [np.round(v, 5).tolist() for v in (self.loads.tip_force, self.loads.tip_moment, self.loads.gravity)]
        return (
            f"case {self.seed}: {self.robot.name}, {self.material.name}, {self.material.law.name}, {bar} bar, {loads}"
        )


@dataclass(frozen=True)
class Outcome:
    """How a case ended; `error` is what was raised, which nothing should be."""

    case: str
    status: str
    residual: float | None
    stable: bool | None
    intervals: int | None
    seconds: float
    error: str = ""

    @property
    def success(self) -> bool:
        """Whether it was solved and every equation holds."""
        return self.status == Status.SOLVED and self.residual is not None and self.residual <= RESIDUAL

    @property
    def wrong(self) -> bool:
        """Whether something was raised, or reported as solved without being so."""
        return bool(self.error) or (self.status == Status.SOLVED and not self.success)


def pressure_at(model: Model, share: NDArray[np.float64], stretch: float) -> NDArray[np.float64]:
    """Return the pressures [Pa] in the ratio of `share` with that stretch, or the last before the branch ends."""
    function = branch_function(model)
    declared = quantities(model)
    low, high = 0.0, 1e8
    while high - low > 1e-6 * high:
        middle = (low + high) / 2
        pressure = middle * share
        column = np.concatenate([pressure if name == "pressure" else q.nominal for name, q in declared.items()])
        point = stretch_on_branch(function, column, pressure)
        beyond = point.status is not Status.SOLVED or point.stretch > stretch
        low, high = (low, middle) if beyond else (middle, high)
    return low * share


def hard_case(seed: int, hardest: float = 1.0) -> Case:
    """Draw a case; the same seed gives the same one. `hardest` below 1 keeps that part of the range of stretch."""
    rng = np.random.default_rng([seed, 300])

    def direction() -> NDArray[np.float64]:
        v = rng.normal(size=3)
        return np.asarray(v / np.linalg.norm(v))

    robot = ROBOTS[str(rng.choice(list(ROBOTS)))]
    entries = load_materials()
    models = entries[str(rng.choice(list(entries)))].models
    material = models[str(rng.choice(list(models)))]
    model = Model(robot, material)
    pressed = rng.permutation(robot.chamber_sets) < rng.integers(1, robot.chamber_sets + 1)
    share = pressed * rng.uniform(0.1, 1, robot.chamber_sets)
    pressure = pressure_at(model, share, 1 + hardest * (min(rng.uniform(1, 2.2), MOST_STRETCH) - 1))
    rest = deform(robot, material, np.zeros(robot.chamber_sets), 1.0, model.coefficients)
    EI, L = float(sum(rest.bending_stiffness)) / 2, robot.length
    loads = Loads(
        tip_force=rng.uniform(0, MOST_FORCE) * EI / L**2 * direction(),
        tip_moment=rng.uniform(0, MOST_MOMENT) * EI / L * direction(),
        gravity=GRAVITY * direction() * (rng.uniform() < 0.8),
    )
    return Case(seed, robot, material, pressure, loads)


def solve_cold(case: Case) -> Step:
    """Solve a case from nothing."""
    return forward(case.robot, case.material, case.pressure, loads=case.loads).steps[0]


def outcome_of(seed: int, hardest: float = 1.0) -> Outcome:
    """Draw and solve a case; never raises."""
    case = hard_case(seed, hardest)
    began = time.perf_counter()
    try:
        step = solve_cold(case)
    except (SoftnlpError, ArithmeticError, RuntimeError, ValueError) as error:
        seconds = time.perf_counter() - began
        return Outcome(str(case), "raised", None, None, None, seconds, f"{type(error).__name__}: {error}")
    seconds = time.perf_counter() - began
    stable = step.pose.stable if step.pose else None
    return Outcome(str(case), str(step.status), step.residual, stable, step.intervals, seconds)


def report(outcomes: Sequence[Outcome]) -> str:
    """Return the summary of many cases as text."""
    seconds = [o.seconds for o in outcomes]
    successes = [o for o in outcomes if o.success]
    lines = [
        f"{len(outcomes)} cases, {len(successes)} solved with a residual of at most {RESIDUAL:g}: "
        f"{100 * len(successes) / len(outcomes):.1f} %",
        "statuses: " + ", ".join(f"{status} {n}" for status, n in Counter(o.status for o in outcomes).most_common()),
        f"raised or solved in name only: {sum(o.wrong for o in outcomes)}; "
        f"solved but not stable: {sum(o.stable is False for o in successes)}",
        f"time a case, compiling included: median {median(seconds):.2f} s, worst {max(seconds):.2f} s",
    ]
    if successes:
        lines.append(
            f"largest residual {max(o.residual or 0.0 for o in successes):.1e}, "
            f"intervals {min(o.intervals or 0 for o in successes)} to {max(o.intervals or 0 for o in successes)}"
        )
    lines += [f"not solved: {o.status} {o.error} after {o.seconds:.2f} s, {o.case}" for o in outcomes if not o.success]
    lines += [f"not stable: {o.case}" for o in successes if o.stable is False]
    slow = sorted(outcomes, key=lambda o: -o.seconds)[:3]
    return "\n".join([*lines, *(f"slowest: {o.seconds:.2f} s, {o.case}" for o in slow)])


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the cases on all cores and print the summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0, help="seed of the first case; the next ones count up")
    parser.add_argument("--workers", type=int, default=cpu_count() or 1)
    given = parser.parse_args(arguments)
    with ProcessPoolExecutor(given.workers) as pool:
        outcomes = list(pool.map(outcome_of, range(given.seed, given.seed + given.cases), chunksize=4))
    print(report(outcomes))


if __name__ == "__main__":
    main()
