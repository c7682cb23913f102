"""Looking for other equilibria of a blocked pose than the one that was followed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked

Array = NDArray[np.float64]


def other_equilibria(solver: BlockedSolver, found: Blocked, starts: int) -> tuple[str, ...]:
    """Return a warning for each other equilibrium that first guesses elsewhere lead to.

    The guesses are arcs of other curvatures and wall forces, in the plane where there is one; always the same ones.
    An equilibrium whose wall would have to pull is left out.
    """
    grid, problem = found.grid, found.grid.problem
    p, x = found.solution.p, found.solution.x
    n_c = solver.functions.section.size1_in(0)
    rng = np.random.default_rng(7)
    L_0, F_0 = (float(v) for v in np.asarray(problem.units(x, p)).ravel())
    points = grid.case.transcribed.points
    known = [x]
    told = []
    sets = solver.model.sets
    for _ in range(starts):
        column = p[:n_c].copy()
        column[:sets] *= rng.uniform(-2.0, 2.5)
        states = np.asarray(solver.functions.arc(column, x[0], points[None, :]))
        y = grid.tip_forces(x) * rng.uniform(0.0, 3.0, size=solver.functions.tip_unknowns)
        start = np.concatenate([x[:1], states.T.ravel(), y])
        solution = grid.stepper.solve(p, start)
        if solution.holds(10 * grid.stepper.tolerance):
            solution = grid.engine.solve(p, solution.x)
        if not solution.holds(solver.numerics.tolerance) or abs(solution.x[0] - x[0]) > 1e-6:
            continue
        force = float(grid.tip_forces(solution.x)[0])
        if force < 0 or any(grid.distance(solution.x - other) < 1e-4 for other in known):
            continue
        known.append(solution.x)
        tip = ", ".join(f"{1e3 * L_0 * v:.1f}" for v in grid.nodes(solution.x)[:3, -1])
        told.append(
            f"another equilibrium has a blocked force of {force * F_0:.3g} N with the tip at ({tip}) mm; "
            "it is not on the branch followed from zero pressure"
        )
    return tuple(told)
