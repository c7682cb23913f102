"""How many random cold problems each engine solves: loaded poses, blocked forces and targets.

    python -m benchmarks.engines [--problems 200] [--seed 13] [--list]

A problem has a robot and a silicone of the library, random pressures, and either random dead loads, a wall with one of
the closures, or the tip of a random pose as a target. Each is solved from nothing by "auto" and by "ipopt". Of those
that "auto" solves at least 99 % have to be solved by "ipopt" too, else the exit status is 1; where both solve, their
tips or forces are held against each other.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp import (
    BAR,
    ROBOTS,
    ContactSettings,
    Loads,
    Numerics,
    Status,
    Step,
    blocked_force,
    forward,
    inverse,
    load_materials,
    material,
)

Array = NDArray[np.float64]
ENGINES = ("auto", "ipopt")
KINDS = ("loaded", "wall", "target")
CLOSURES: tuple[Any, ...] = ("free", "compliant", "rigid", "weighted")
SHARE = 0.99
_SAME = 1e-5  # of the length, or of the force


@dataclass(frozen=True)
class Problem:
    """What is solved, in words, and how: by an engine, as a step."""

    kind: str
    words: str
    solve: Callable[[Numerics], Step]


def problem(rng: np.random.Generator, kind: str) -> Problem:
    """Return a random problem of a kind."""
    name = str(rng.choice([name for name in ROBOTS if not name.startswith("laparoscope")]))
    body, silicone = ROBOTS[name], material(str(rng.choice(sorted(load_materials()))))
    P = rng.uniform(0.1, 1.0, 3) * (rng.random(3) < 0.6) * BAR
    if not P.any():
        P[int(rng.integers(3))] = 0.5 * BAR
    words = f"{name}, {silicone.name}, {np.round(P / BAR, 3).tolist()} bar"
    if kind == "loaded":
        F = rng.normal(size=3) * 0.02 * (body.outer_diameter / 0.025) ** 4
        gravity = str(rng.choice(["standing", "hanging"]))
        loads = Loads(tip_force=tuple(F), gravity=gravity)
        words += f", {np.round(1e3 * F, 3).tolist()} mN, {gravity}"
        return Problem(kind, words, lambda n: forward(body, silicone, [P], loads=loads, numerics=n).steps[0])
    if kind == "wall":
        closure = CLOSURES[int(rng.integers(4))]
        contact = ContactSettings(closure=closure)
        one = np.array([P.max(), 0.0, 0.0])
        words = f"{name}, {silicone.name}, {one[0] / BAR:.3f} bar in one set, {closure}"
        return Problem(kind, words, lambda n: blocked_force(body, silicone, [one], contact, numerics=n).steps[0])
    pose = forward(body, silicone, [P], numerics=Numerics(engine="newton")).steps[0].pose
    tip = np.array([0.0, 0.0, body.length]) if pose is None else pose.tip_position
    words = f"{name}, {silicone.name}, tip of {np.round(P / BAR, 3).tolist()} bar"
    return Problem(kind, words, lambda n: inverse(body, silicone, positions=[tip], numerics=n).steps[0])


def seen(step: Step) -> Array:
    """Return what the engines are compared by."""
    if step.aimed is not None and step.aimed.tip_position is not None:
        return np.asarray(step.aimed.tip_position)
    if step.contact is not None:
        return np.array([step.contact.force])
    return np.zeros(3) if step.pose is None else step.pose.tip_position


def main() -> int:
    """Solve and print; 1 where "ipopt" solves too few."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=200)
    parser.add_argument("--seed", type=int, default=13)
    parser.add_argument("--list", action="store_true", help="print every problem, not those alone that differ")
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    counts = dict.fromkeys([(kind, what) for kind in KINDS for what in ("posed", "auto", "ipopt", "both", "apart")], 0)
    spent = dict.fromkeys(ENGINES, 0.0)
    for k in range(asked.problems):
        posed = problem(rng, KINDS[k % len(KINDS)])
        steps = {}
        for engine in ENGINES:
            began = time.process_time()
            steps[engine] = posed.solve(replace(Numerics(), engine=engine))
            spent[engine] += time.process_time() - began
        solved = {engine: step.status.has_solution for engine, step in steps.items()}
        one, other = (seen(steps[engine]) for engine in ENGINES)
        apart = all(solved.values()) and not np.allclose(one, other, rtol=_SAME, atol=_SAME * 0.06)
        counts[posed.kind, "posed"] += 1
        for engine in ENGINES:
            counts[posed.kind, engine] += solved[engine]
        counts[posed.kind, "both"] += all(solved.values())
        counts[posed.kind, "apart"] += apart
        if asked.list or apart or len({step.status for step in steps.values()} - {Status.NO_CONTACT}) > 1:
            said = "; ".join(f"{e}: {s.status.value}, {np.round(seen(s), 6).tolist()}" for e, s in steps.items())
            print(f"{k + 1:4d} {posed.kind}: {posed.words}: {said}", flush=True)
    print(f"{'':8s} {'posed':>7s} {'auto':>7s} {'ipopt':>7s} {'both':>7s} {'apart':>7s}")
    for kind in KINDS:
        print(
            f"{kind:8s} " + " ".join(f"{counts[kind, what]:7d}" for what in ("posed", "auto", "ipopt", "both", "apart"))
        )
    share = sum(counts[kind, "both"] for kind in KINDS) / max(sum(counts[kind, "auto"] for kind in KINDS), 1)
    print(
        f"ipopt solves {100 * share:.2f} % of those that auto solves; "
        + ", ".join(f"{e} {t:.0f} s" for e, t in spent.items())
    )
    return 0 if share >= SHARE else 1


if __name__ == "__main__":
    sys.exit(main())
