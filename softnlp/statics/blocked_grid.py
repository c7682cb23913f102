"""What is compiled for blocked poses on one grid, and a solution on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.contact_settings import ClosureWeights
from softnlp.model.numerics import Numerics
from softnlp.nlp.evaluation import evaluated
from softnlp.nlp.linear import LinearSolver
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine, Solution, discretisation_correction
from softnlp.nlp.transcription import Collocation, MultipleShooting, method_named
from softnlp.statics.compiled import RodEquations
from softnlp.statics.condensed import CondensedSolver, plane_directions
from softnlp.statics.condensed_collocation import CondensedCollocation
from softnlp.statics.free_shape import Free
from softnlp.statics.loadcase import LoadCase, load_case
from softnlp.statics.pose import Mapped, between_nodes
from softnlp.statics.wall import Situation
from softnlp.statics.weighted import Weighted

Array = NDArray[np.float64]


_FORCE_SHARE = 0.1  # of a scaled force beside a scaled position in what a step changes
_LARGEST_MISS = 0.5  # of a step's change: a prediction that is off by more does not tell which branch was met
_SMALL = 1e-3  # a change that tells nothing of its prediction


def has_nodes_only(case: LoadCase) -> bool:
    """Whether the nodes are the only states, as the condensed solver takes it."""
    return case.transcribed.node_index.size == len(case.transcribed.points)


@dataclass(frozen=True, eq=False)
class BlockedGrid:
    """Everything compiled for one number of intervals, in a plane of symmetry or in space.

    engine, stepper : to full tolerance, and loosely for points of a path. reference : of the square problem, which
    IPOPT closes. condensed : the tip equations at the nodes, in the plane. judge : in space.
    """

    case: LoadCase
    engine: Engine | Weighted
    stepper: Engine | Weighted
    reference: Engine
    condensed: CondensedSolver
    judge: CondensedSolver
    intervals: int
    state_size: int
    transcription: str

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

    @property
    def tip(self) -> slice:
        """Where x holds the tip's position."""
        start = 1 + self.state_size * (len(self.case.transcribed.points) - 1)
        return slice(start, start + 3)

    def tip_forces(self, x: Array) -> Array:
        """Return the scaled forces that the loads add."""
        return x[1 + self.state_size * len(self.case.transcribed.points) :]

    @property
    def is_minimum(self) -> bool:
        """Whether the solution is a minimum of weighted squares, which may go on where the equations are singular."""
        return isinstance(self.engine, Weighted)

    @property
    def has_tangent(self) -> bool:
        """Whether `predicted` can be used: not for a minimum, and where the nodes are the only states."""
        return not self.is_minimum and has_nodes_only(self.case)

    def predicted(self, x: Array, p: Array) -> Array:
        """Return x moved along the tangent from a solution towards the one at p; x where the tangent is singular."""
        try:
            return x + self.condensed.solve(x, p, evaluated(self.problem.residual, x, p)[0].ravel())
        except np.linalg.LinAlgError:
            return x

    def strayed(self, predicted: Array, change: Array) -> float:
        """Return how far a step went from where it was predicted to, of what is allowed: more is another branch.

        Past a fold another part of the curve may be so near that its distance alone does not tell it, also with the
        same sign of the determinant; its forces are others.
        """

        def size(move: Array) -> float:
            forces = float(np.max(np.abs(self.tip_forces(move)), initial=0.0))
            return max(self.distance(move), _FORCE_SHARE * forces)

        return size(change - predicted) / max(_LARGEST_MISS * size(change), _SMALL)

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

    def refinement(self, solution: Solution) -> tuple[float, float, float]:
        """Return how far the tip's position [L_0], its rotation [rad] and the forces are from those of finer grids.

        Of forces relative to those above one.
        """
        order = method_named(self.transcription, 1).order
        linear = self.engine.linear or self.reference.linear  # of a minimum by collocation: with the errors it left
        correction = discretisation_correction(self.problem, solution, linear)
        change = correction * 2**order / (2**order - 1)
        tip = self.nodes(change)[:, -1]
        forces = self.tip_forces(change) / np.maximum(1.0, np.abs(self.tip_forces(solution.x)))
        rotation = np.linalg.norm(tip[3:12]) / np.sqrt(2)
        return float(np.linalg.norm(tip[:3])), float(rotation), float(np.max(np.abs(forces), initial=0.0))

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


def unjudged(
    grid: BlockedGrid,
    solution: Solution,
    situation: Situation,
    pressed: Array,
    aside: tuple[float | None, tuple[float, float]],
    free: Free,
) -> Blocked:
    """Return a solution whose errors are not known. aside : slips and determinants, see `Blocked`."""
    constants = np.asarray(grid.problem.case_constants(solution.x, solution.p)).ravel()
    return Blocked(situation, pressed, grid, solution, constants, np.inf, np.inf, *aside, free)


def transferred(found: Blocked, case: LoadCase, shape: Mapped) -> Array:
    """Return the unknowns of a solution as those of the same rod's case on another grid, see `between_nodes`."""
    x = found.solution.x
    if found.grid.case is case:
        return x
    states = between_nodes(shape, found.grid.nodes(x), found.constants, case.transcribed.points)
    return np.concatenate([x[:1], states[: found.grid.state_size].T.ravel(), found.grid.tip_forces(x)])


def kept_grid(
    equations: RodEquations, numerics: Numerics, weights: ClosureWeights | None, intervals: int, plane: Array | None
) -> BlockedGrid:
    """Return what is compiled on a grid and in a plane (None: in space), building it at first use.

    weights : of the closure `weighted`, None for any other.
    """
    direction = None if plane is None else np.round(plane, 12).tobytes()
    key = (numerics.transcription, numerics.engine, numerics.ipopt, intervals, direction, weights)
    return equations.kept(key, lambda: _compiled(equations, numerics, weights, intervals, plane))


def _compiled(
    equations: RodEquations, numerics: Numerics, weights: ClosureWeights | None, intervals: int, plane: Array | None
) -> BlockedGrid:
    name, functions = numerics.transcription, equations.functions
    shooting = MultipleShooting(intervals)

    def in_space() -> tuple[LoadCase, CompiledProblem, CondensedSolver]:
        case = load_case("blocked", functions, equations.declared, method_named(name, intervals))
        return case, compile_problem(list(equations.declared.values()), [case]), CondensedSolver(functions, shooting)

    case, problem, judge = equations.kept((name, intervals), in_space)
    condensed = CondensedSolver(functions, shooting, plane)
    exact, loose = _engines(problem, case, condensed, numerics)
    engine: Engine | Weighted = exact
    stepper: Engine | Weighted = loose
    if weights is not None:
        engine, stepper = (Weighted(e, functions, case, condensed, plane, weights) for e in (exact, loose))
    return BlockedGrid(case, engine, stepper, exact, condensed, judge, intervals, functions.state_size, name)


def _engines(
    problem: CompiledProblem, case: LoadCase, condensed: CondensedSolver, numerics: Numerics
) -> tuple[Engine, Engine]:
    """Return what solves a blocked problem to full tolerance, and loosely for points of a path."""
    linear: LinearSolver | None = condensed
    if isinstance(case.method, Collocation):
        linear = CondensedCollocation(case.functions, case.method) if numerics.engine != "ipopt" else None
    common: dict[str, Any] = {"linear": linear, "options": numerics.ipopt, "ipopt_only": numerics.engine == "ipopt"}
    quick = linear is not None and numerics.engine != "ipopt"
    exact = Engine(problem, **common, newton_only=numerics.engine == "newton")
    return exact, Engine(problem, **common, newton_only=quick, max_iterations=8, tolerance=1e-7)
