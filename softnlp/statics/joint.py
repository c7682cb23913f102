"""The free and the blocked shape as one problem, which shares pressure, geometry and material."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import quantity
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.solver import Engine, Solution
from softnlp.nlp.transcription import method_named
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.loadcase import blocked_case, load_case
from softnlp.statics.posed import Problem, problem

Array = NDArray[np.float64]


def joint_problem(solver: BlockedSolver, intervals: int, *, free_pressure: bool) -> Problem:
    """Return the problem of both shapes at "pressure scale" times "pressure".

    The blocked shape takes its free chamber lengths from the free shape's states. With every quantity fixed the wall's
    force is found for a pressure. With `free_pressure` the scale is free, and the wall's force has to be "target
    force" [N].
    """
    declared = solver.functions.declared(solver.model)
    del declared["contact.free_lengths"]
    scale, target = quantity("pressure scale", "1", 1.0, lower=0.0), quantity("target force", "N", 0.0)
    pressure = declared["pressure"]
    shared = {**declared, "pressure": replace(pressure, symbol=scale.symbol * pressure.symbol)}
    method = method_named(solver.numerics.transcription, intervals)
    free = load_case("free", solver.poses.functions, shared, method)
    blocked = blocked_case("blocked", solver.functions, shared, free, method)
    error = blocked.outputs["tip_forces"][0] - target.symbol
    wanted = Constraint("blocked force", error, unit="N", scale=blocked.force_unit)
    freed = ["pressure scale"] if free_pressure else []
    return problem(
        [free, blocked], given=[pressure, scale, target], free=freed, constraints=[wanted] if free_pressure else []
    )


def joint_engine(solver: BlockedSolver, intervals: int, *, free_pressure: bool) -> Engine:
    """Return what solves `joint_problem`, kept with what the solver has compiled."""
    numerics = solver.numerics
    key = ("joint", numerics.transcription, intervals, free_pressure)
    posed = solver.equations.kept(key, lambda: joint_problem(solver, intervals, free_pressure=free_pressure))
    alone = {"ipopt_only": numerics.engine == "ipopt", "newton_only": numerics.engine == "newton"}
    return posed._engine(**alone, options=numerics.ipopt)


def joint_solution(
    solver: BlockedSolver, near: Blocked, given: Mapping[str, Any], *, free_pressure: bool
) -> tuple[Engine, Solution, Array]:
    """Solve both shapes at once from a blocked solution nearby; return what solved them, the solution, and its start.

    given : values of `joint_problem` by name other than those of the blocked solution.
    """
    engine = joint_engine(solver, near.grid.intervals, free_pressure=free_pressure)
    values = solver.values(near.situation, near.pressed, np.zeros(0))
    del values["contact.free_lengths"]
    p = engine.problem.pack({**values, **given})
    grid, shape = solver.poses.grid(near.grid.intervals), near.free
    arc = solver.poses.arc_guess(grid, shape.column, shape.stretch)
    guess = arc if shape.solved is None else solver.poses.transfer(shape.solved, grid)
    free = grid.engine.solve(shape.column, guess)
    start = np.concatenate([[1.0] * free_pressure, free.x, near.solution.x])
    return engine, engine.solve(p, start), start
