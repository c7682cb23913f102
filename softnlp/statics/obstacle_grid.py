"""What is compiled for poses among obstacles on one number of intervals, and a solution on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.numerics import Numerics
from softnlp.model.obstacles import Obstacle
from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine, Solution
from softnlp.statics.compiled import RodEquations
from softnlp.statics.obstacle_slope import ObstacleSlope
from softnlp.statics.obstructed import SMOOTHING, STEPS, ObstructedCase, numbers_of, obstructed_case

Array = NDArray[np.float64]

SHARP = 1e-6
"""tau of a solution: gap times force is its square, in L_0 times EI/L_0^2."""
ACTIVE = 10 * SHARP
"""Scaled push from which a node touches."""


@dataclass(frozen=True, eq=False)
class ObstacleGrid:
    """engine, stepper : to full tolerance, and loosely for points of a path. reference : IPOPT."""

    case: ObstructedCase
    engine: Engine
    stepper: Engine
    reference: Engine

    @property
    def problem(self) -> CompiledProblem:
        """The compiled problem, with every quantity fixed."""
        return self.engine.problem

    @property
    def intervals(self) -> int:
        """Their number."""
        return self.case.intervals

    @property
    def tip(self) -> slice:
        """Where x holds the tip's position."""
        start = 1 + STATE_SIZE * self.intervals
        return slice(start, start + 3)

    def nodes(self, x: Array) -> Array:
        """Return the states at the nodes before what pushes there (18, K + 1)."""
        states = x[1 : 1 + STATE_SIZE * (self.intervals + 1)]
        return np.ascontiguousarray(states.reshape(-1, STATE_SIZE).T)

    def pushes(self, x: Array) -> Array:
        """Return the push of each obstacle at each node (obstacles, K + 1), scaled."""
        found = np.zeros((len(self.case.obstacles), self.intervals + 1))
        for F, (k, j) in zip(x[1 + STATE_SIZE * (self.intervals + 1) :], self.case.pushes, strict=True):
            found[j, k] = F
        return found

    def packed(self, stretch: float, nodes: Array, pushes: Array) -> Array:
        """Return x."""
        return np.concatenate([[stretch], nodes.T.ravel(), [pushes[j, k] for k, j in self.case.pushes]])

    def distance(self, change: Array) -> float:
        """Return the largest change of a scaled position or of a direction cosine between two x."""
        return float(np.max(np.abs(self.nodes(change)[:12])))

    def taken(self, x: Array, p: Array) -> tuple[Array, Array, Array]:
        """Return what the field takes beside states, and the radius and numbers that obstacles take."""
        nc, count = self.case.functions.field.size1_in(1), len(self.case.obstacles)
        constants, radius, numbers = np.split(np.asarray(self.problem.case_constants(x, p)).ravel(), [nc, nc + count])
        return constants, radius, numbers


def compiled_obstacles(
    equations: RodEquations, numerics: Numerics, obstacles: Sequence[Obstacle], intervals: int
) -> ObstacleGrid:
    """Return the problem of one pose among obstacles, with every quantity fixed, and what solves it."""
    given = {**equations.declared, **{q.name: q for q in numbers_of(obstacles, intervals)}}
    case = obstructed_case("pose", equations.functions, given, obstacles, intervals)
    problem = compile_problem(list(given.values()), [case])
    linear = ObstacleSlope(case, problem)
    chosen: dict[str, Any] = {"linear": linear, "newton_only": True}
    if numerics.engine == "ipopt":
        chosen = {"linear": linear, "ipopt_only": True, "options": numerics.ipopt, "slope": linear.function}
    return ObstacleGrid(
        case=case,
        engine=Engine(problem, **chosen),
        stepper=Engine(problem, **chosen, tolerance=1e-7),
        reference=Engine(problem, options=numerics.ipopt, slope=linear.function),
    )


@dataclass(frozen=True, eq=False)
class Touched:
    """A solution and what was found of it.

    values : of the quantities, SI. s : (K + 1,) of the nodes. before, behind : (18, K + 1) states on both sides of
    what pushes at a node. pushes, gaps : (obstacles, K + 1), scaled. constants : what the field takes.
    radius, numbers : what the obstacles take. units : L_0 [m] and EI/L_0^2 [N].
    snapped : whether the branch turned back on the way.
    """

    grid: ObstacleGrid
    solution: Solution
    values: dict[str, Any]
    s: Array
    before: Array
    behind: Array
    pushes: Array
    gaps: Array
    constants: Array
    radius: Array
    numbers: Array
    units: Array
    snapped: bool = False

    @property
    def active(self) -> NDArray[np.bool_]:
        """Where what touches (obstacles, K + 1)."""
        return np.asarray(self.pushes > ACTIVE)


def touched(grid: ObstacleGrid, solution: Solution, values: dict[str, Any]) -> Touched:
    """Return a solution with what its nodes and obstacles say."""
    x, p = solution.x, solution.p
    constants, radius, numbers = grid.taken(x, p)
    before, pushes = grid.nodes(x), grid.pushes(x)
    behind, gaps = grid.case.touching.at(before, pushes, radius, numbers)
    behind[:, 0] = before[:, 0]  # the base is held
    steps = np.ravel(values[STEPS])
    s = np.concatenate([[0.0], np.cumsum(steps)])
    s[-1] = 1.0
    units = np.asarray(grid.problem.units(x, p)).ravel()
    return Touched(grid, solution, values, s, before, behind, pushes, gaps, constants, radius, numbers, units)


def sharpened(values: dict[str, Any], tau: float) -> dict[str, Any]:
    """Return values with another smoothing."""
    return {**values, SMOOTHING: tau}
