"""What is compiled for poses on one grid, and a solution on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.numerics import Numerics
from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.linear import LinearSolver
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine, Solution
from softnlp.nlp.transcription import Collocation, method_named
from softnlp.statics.compiled import RodEquations
from softnlp.statics.condensed import case_solver
from softnlp.statics.condensed_collocation import CondensedCollocation
from softnlp.statics.loadcase import LoadCase, load_case
from softnlp.statics.single_shooting import AtStretch, Shot

Array = NDArray[np.float64]

HOPELESS = 1.0
"""Estimated error of a given grid, in lengths, from which its solution is none of the rod."""
_DEARER = 3  # an iteration on a neighbour's grid than on a coarse one, where the neighbour's is still tried first
_ROUGH = 1e-2  # error of a grid whose word on stability does not count

# Of an iteration, in intervals: beside its own, and of one of them.
_OVERHEAD, _COST = 15, {"multiple-shooting": 1, "collocation": 25}


TIP = slice(-STATE_SIZE, -STATE_SIZE + 3)
"""Where x of a pose holds the tip's position."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Everything compiled for one number of intervals.

    engine : Newton's method to full tolerance. stepper : the same, loosely, for points of a path. reference : IPOPT.
    order : of the transcription's error at the nodes.
    iteration_cost : time of one Newton iteration, in units of one interval of Runge-Kutta (some 0.07 ms).
    """

    case: LoadCase
    engine: Engine
    stepper: Engine
    reference: Engine
    transcription: str
    order: int
    iteration_cost: float

    @property
    def problem(self) -> CompiledProblem:
        """The compiled problem, with every quantity fixed."""
        return self.engine.problem

    @property
    def corrector(self) -> LinearSolver | None:
        """What the estimate of the discretisation error is solved with."""
        return self.engine.linear

    @property
    def intervals(self) -> int:
        """The number of intervals."""
        return self.case.transcribed.node_index.size - 1

    @property
    def tip(self) -> slice:
        """Where x holds the tip's position."""
        return TIP

    @property
    def stretch_places(self) -> list[int]:
        """Where x holds a stretch."""
        return [0]

    def last_state(self, x: Array) -> Array:
        """Return the last state in x (18,)."""
        return x[-STATE_SIZE:]

    def tip_error(self, change: Array, solution: Solution) -> tuple[float, float]:
        """Return how far a change (18,) of the last state moves the tip [L_0] and turns it [rad]."""
        return float(np.linalg.norm(change[:3])), float(np.linalg.norm(change[3:12]) / np.sqrt(2))

    def distance(self, change: Array) -> float:
        """Return the largest change of a scaled position or of a direction cosine between two x."""
        states = change[1:].reshape(-1, STATE_SIZE)
        return float(np.max(np.abs(states[:, :12])))

    def weight(self, x: Array) -> Array:
        """Return the weight of each entry of x in an arc length, the mean over the nodes of the change of pose."""
        states = np.zeros((x.size // STATE_SIZE, STATE_SIZE))
        states[:, :12] = 1.0 / len(states)
        return np.concatenate([[0.0], states.ravel()])

    def nodes(self, x: Array) -> Array:
        """Return the scaled node states (18, K + 1) in x."""
        states = x[1:].reshape(-1, STATE_SIZE).T
        return np.ascontiguousarray(states[:, self.case.transcribed.node_index])

    def constants(self, solution: Solution) -> Array:
        """Return what the field takes beside the state."""
        return np.asarray(self.problem.case_constants(solution.x, solution.p)).ravel()


def iteration_cost(intervals: int, transcription: str) -> int:
    """Return the time of a Newton iteration on a grid, see `Grid`."""
    return _OVERHEAD + _COST[transcription] * intervals


def compiled_grid(equations: RodEquations, numerics: Numerics, intervals: int) -> Grid:
    """Return the problem of one pose on a grid, with every quantity fixed, and what solves it."""
    method = method_named(numerics.transcription, intervals)
    given = equations.declared
    case = load_case("pose", equations.functions, given, method)
    problem = compile_problem(list(given.values()), [case])
    linear: Any = case_solver(case)
    if isinstance(method, Collocation):
        linear = CondensedCollocation(equations.functions, method)
    chosen: dict[str, Any] = {"linear": linear, "newton_only": True}
    if numerics.engine == "ipopt":
        chosen = {"linear": linear, "ipopt_only": True, "options": numerics.ipopt}
    return Grid(
        case=case,
        engine=Engine(problem, **chosen),
        stepper=Engine(problem, **chosen, tolerance=1e-7),
        reference=Engine(problem, options=numerics.ipopt),
        transcription=numerics.transcription,
        order=method.order,
        iteration_cost=iteration_cost(intervals, numerics.transcription),
    )


def dearer(intervals: int, first: int, transcription: str = "multiple-shooting") -> bool:
    """Whether an iteration on a neighbour's grid costs so much more than on a first one that this is tried instead."""
    return iteration_cost(intervals, transcription) > _DEARER * iteration_cost(first, transcription)


@dataclass(frozen=True, eq=False)
class Solved:
    """A solution on a grid and what was found of it.

    compiled : returns what is compiled for the grid, which is built when it is first asked for. intervals : of it.
    nodes : (18, K + 1) scaled states. limit : what they tend to on finer grids, where those begin. constants : what the
    field takes beside them. error : estimated tip position error over L_0. rotation_error : the same for the tip's
    orientation [rad]. stable : no conjugate point. shot : what came of single shooting, where that found it.
    """

    compiled: Callable[[], Grid]
    intervals: int
    solution: Solution
    nodes: Array
    limit: Array
    constants: Array
    error: float
    rotation_error: float
    stable: bool
    shot: tuple[AtStretch, Shot] | None = None

    @property
    def grid(self) -> Grid:
        """What is compiled for its grid."""
        return self.compiled()

    @property
    def is_rough(self) -> bool:
        """Whether the pose is not stable on its grid, which is so coarse that it may be on another."""
        return not self.stable and self.refinement_error > _ROUGH

    @property
    def refinement_error(self) -> float:
        """What refinement holds against the accuracy: a rotation is allowed five times as much as a position."""
        return max(self.error, self.rotation_error / 5)


def next_size(wanted: float) -> int:
    """Return the first grid size of at least `wanted`; sizes grow by the square root of 2, so that few are compiled."""
    k = 0
    while (size := 5 * round(2 ** (k / 2))) < wanted:
        k += 1
    return size
