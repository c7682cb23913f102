"""How fast a blocked tip force is beside the paper's method on the same robots and pressures.

    python -m benchmarks.blocked

The paper's method is single shooting with 20 RK4 steps in NumPy for the free shape and then, by SciPy's
Levenberg-Marquardt with finite differences, for the weighted squares of the blocked one (`benchmarks.paper_blocked`).
It gets the stretch and the stiffnesses for nothing, and computes no error estimate, stability or shape, where a step of
this package includes all of these. Both begin at zero pressure and start each step from the last one; 0 to 1.5 bar in
set 1 in 6 steps, of which the first (no pressure) is not counted.

"compiled": by a solver that has met these steps before. "as run": a new solver, with everything built. "20 intervals"
fixes the grid as the paper's is; "auto" refines it until the estimated error is within 1e-6 of the length.
"""

from __future__ import annotations

import os
import time
from statistics import mean, median

import numpy as np

from benchmarks.paper_blocked import Weights, solve_blocked
from benchmarks.paper_method import Rod
from softnlp import BAR, Loads, Numerics, material, robot
from softnlp.branch import branch_function, stretch_on_branch
from softnlp.contact_settings import ContactSettings
from softnlp.quantities import Model, quantities
from softnlp.robot import ROBOTS
from softnlp.section import deform
from softnlp.studies.blocked import BlockedSolver
from softnlp.studies.wall import standing_wall

NAMES = [name for name in ROBOTS if name.startswith("D")]
SILICONE = material("Ecoflex 00-50")
PRESSURES = np.linspace(0, 1.5 * BAR, 6)[:, None] * np.array([1.0, 0.0, 0.0])
WEIGHTS = Weights(L=5.0)
REPEATS = 3


def main() -> None:
    """Print milliseconds a step and how much faster each is than the paper's method."""
    print(f"\n{SILICONE.name}, set 1, 0 to 1.5 bar in 6 steps, ms a step, {os.cpu_count()} processors\n")
    header = [f"{closure}, {grid}" for closure in ("free", "compliant") for grid in ("auto", "20")]
    print(f"  {'robot':8s} {'paper':>9s}" + "".join(f"{h:>26s}" for h in header))
    ratios: dict[str, list[float]] = {h: [] for h in header}
    for name in NAMES:
        model = Model(robot(name), SILICONE)
        paper = median(paper_seconds(model) for _ in range(REPEATS))
        cells = []
        for head in header:
            closure, grid = head.split(", ")
            numerics = Numerics() if grid == "auto" else Numerics(intervals=20)
            solver = BlockedSolver(model, numerics, ContactSettings(closure=closure))  # type: ignore[arg-type]
            built = our_seconds(solver)
            ours = median(our_seconds(solver) for _ in range(REPEATS))
            ratios[head].append(paper / ours)
            cells.append(f"{1e3 * ours:8.1f} {paper / ours:6.1f}x ({1e3 * built:5.0f})")
        print(f"  {name:8s} {1e3 * paper:9.1f}" + "".join(f"{cell:>26s}" for cell in cells))
    print("\n  Compiled, times faster than the paper's method, as run in brackets [ms]. Least and mean of the ratios:")
    for head, values in ratios.items():
        print(f"  {head:20s} {min(values):6.1f}x {mean(values):6.1f}x")


def our_seconds(solver: BlockedSolver) -> float:
    """Return the time of one step [s], a mean over the sequence."""
    began = time.perf_counter()
    wall, near = standing_wall(solver.poses, solver.contact, PRESSURES, Loads()), None
    for pressure in PRESSURES:
        step, solved = solver.solve(pressure, Loads(), wall, near)
        near = solved or near
        if not step.status.has_solution:
            raise RuntimeError(step.message)
    return (time.perf_counter() - began) / (len(PRESSURES) - 1)


def paper_seconds(model: Model) -> float:
    """Return the time of one step of the paper's method [s], in space as it is published."""
    rods = [rod_at(model, P) for P in PRESSURES[1:]]
    began = time.perf_counter()
    start = None
    for rod in rods:
        answer = solve_blocked(rod, WEIGHTS, start=start)
        start = np.append(answer.base, answer.force)
    return (time.perf_counter() - began) / len(rods)


def rod_at(model: Model, pressure: np.ndarray) -> Rod:
    """Return the rod at a pressure [Pa], as plain numbers for the paper's method."""
    nominal = [q.nominal for name, q in quantities(model).items() if name != "pressure"]
    stretch = stretch_on_branch(branch_function(model), np.concatenate([pressure, *nominal]), pressure).stretch
    section = deform(model.robot, model.material, pressure, stretch, model.coefficients, model.conventions)
    EI_x, EI_y = section.bending_stiffness
    return Rod(
        length=float(stretch * model.robot.length),
        EA=float(section.axial_stiffness),
        GA=float(section.shear_stiffness),
        EI=(float(EI_x), float(EI_y)),
        GJ=float(section.torsional_stiffness),
        PA=float(section.pressure_area) * pressure[list(model.robot.set_of_chamber)],
        d=np.array(section.centres, dtype=float),
        weight=(0.0, 0.0, 0.0),
    )


if __name__ == "__main__":
    main()
