"""What is compiled for blocked poses on one grid, and a solution on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.condensed import CondensedSolver, plane_directions
from softnlp.loadcase import LoadCase
from softnlp.problem import CompiledProblem
from softnlp.solver import Engine, Solution
from softnlp.studies.free_shape import Free
from softnlp.studies.wall import Situation
from softnlp.studies.weighted import Weighted

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BlockedGrid:
    """Everything compiled for one number of intervals, in a plane of symmetry or in space.

    condensed : the tip equations at the nodes, in the plane. judge : in space.
    """

    case: LoadCase
    engine: Engine | Weighted
    stepper: Engine | Weighted
    condensed: CondensedSolver
    judge: CondensedSolver
    intervals: int
    state_size: int

    @property
    def problem(self) -> CompiledProblem:
        """The compiled problem, with every quantity fixed."""
        return self.engine.problem

    def states(self, x: Array) -> Array:
        """Return every state in x, (nx, count)."""
        count = len(self.case.transcribed.points)
        return x[1 : 1 + self.state_size * count].reshape(count, self.state_size).T

    def nodes(self, x: Array) -> Array:
        """Return the node states (nx, K + 1) in x."""
        return np.ascontiguousarray(self.states(x)[:, self.case.transcribed.node_index])

    def tip_forces(self, x: Array) -> Array:
        """Return the scaled forces that the tip conditions add."""
        return x[1 + self.state_size * len(self.case.transcribed.points) :]

    def distance(self, change: Array) -> float:
        """Return the largest change of a scaled position or of a direction cosine."""
        return float(np.max(np.abs(self.states(change)[:12])))

    def determinants(self, solution: Solution, plane: Array | None) -> tuple[float, float]:
        """Return the determinants of the tip equations in the plane and out of it; in space, of all of them and 1."""
        matrix = self.judge.tip_system(self._at_nodes(solution.x), solution.p).matrix
        if plane is None:
            return float(np.linalg.det(matrix)), 1.0
        inside, outside = (float(np.linalg.det(V.T @ matrix @ V)) for V in plane_directions(plane, len(matrix)))
        return inside, outside

    def _at_nodes(self, x: Array) -> Array:
        """Return x with the states of the nodes alone."""
        return np.concatenate([x[:1], self.nodes(x).T.ravel(), self.tip_forces(x)])


@dataclass(frozen=True, eq=False)
class Blocked:
    """A solution with the wall in place and what was found of it.

    constants : what the field takes beside the states. error : estimated tip position error over L_0. refinement_error
    : the same for position, rotation and forces. slips : pressure [Pa] of the most pressurised set above which a planar
    shape may slip sideways, or None. determinants : in and out of the plane. free : the free shape there.
    """

    situation: Situation
    pressed: Array
    grid: BlockedGrid
    solution: Solution
    constants: Array
    error: float
    refinement_error: float
    slips: float | None
    determinants: tuple[float, float]
    free: Free
