"""What is compiled of a body of several segments: its rods, and the problem of one pose on a grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity
from softnlp.model.body import Body
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import STATE_SIZE
from softnlp.model.segments import body_of
from softnlp.nlp.linear import LastFactors, LinearSolver, SparseSolver
from softnlp.nlp.problem import compile_problem
from softnlp.nlp.solver import Engine, Solution
from softnlp.nlp.transcription import method_named
from softnlp.statics.chain import Chain, Part, chain_case
from softnlp.statics.compiled import RodEquations
from softnlp.statics.pose import Mapped, between_nodes
from softnlp.statics.pose_grid import Grid, iteration_cost
from softnlp.statics.single_shooting import SingleShooting
from softnlp.statics.stability import answered, through_junction
from softnlp.statics.varying import PLACE

Array = NDArray[np.float64]

_MOST_KEPT = 12  # of what depends on fixed values alone
_ROWS = PLACE + 1  # of the states of a part that varies, as which all are held


@dataclass(frozen=True, eq=False)
class ChainEquations(RodEquations):
    """The rods of one kind of body; functions : of the last one, whose tip is the body's. body : with the symbols."""

    body: Body = None  # type: ignore[assignment]
    rods: tuple[RodEquations, ...] = ()

    def single_shooting(self) -> SingleShooting | None:
        """Return None: there is no machine code for several rods."""
        return None

    @property
    def shape(self) -> Mapped:
        """Of one rod only."""
        raise NotImplementedError("the shape of a chain is that of its parts")

    def quantities_of(self, model: Model) -> dict[str, Quantity]:
        """Return the quantities of a body of the same kind with its numbers, under the compiled symbols."""
        nominal = body_of(model).quantities
        return {
            name: Quantity(name, q.unit, self.declared[name].symbol, q.nominal, q.scale, q.lower, q.upper)
            for name, q in nominal.items()
        }


def chain_equations(body: Body, rods: tuple[RodEquations, ...]) -> ChainEquations:
    """Return what is compiled for a body, its numbers nominal."""
    return ChainEquations(rods[-1].functions, body.quantities, body=body, rods=rods)


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a solution: states (18 or 20, K + 1), what its field takes beside them, units of length and force."""

    part: Part
    rod: RodEquations
    nodes: Array
    constants: Array
    length: float
    force: float

    @property
    def shape(self) -> Mapped:
        """What gives the shape between the nodes, see `softnlp.statics.pose.shape_function`."""
        return self.rod.varying.shape if self.part.varies else self.rod.shape


@dataclass(frozen=True, eq=False)
class ChainGrid(Grid):
    """As `Grid`, of several segments with as many intervals each; nodes are those of all parts in turn."""

    case: Chain  # type: ignore[assignment]

    @property
    def intervals(self) -> int:
        """The number of intervals of each segment."""
        return self.case.method.intervals

    @cached_property
    def corrector(self) -> LinearSolver | None:
        """What the estimate of the discretisation error is solved with: the last factors of Newton's method."""
        linear = self.engine.linear
        return LastFactors(linear) if isinstance(linear, SparseSolver) else linear

    @cached_property
    def _places(self) -> list[slice]:
        """Where x holds the states of each part."""
        found, start = [], 0
        for part in self.case.parts:
            size = part.transcribed.unknowns.numel()
            found.append(slice(start + 1, start + 1 + size))
            start += 1 + size
        return found

    @property
    def tip(self) -> slice:
        """Where x holds the end of the last segment, from its end."""
        last = -self.case.parts[-1].transcribed.state_size - self.case.added.numel()
        return slice(last, last + 3)

    def last_state(self, x: Array) -> Array:
        """Return the last state in x (18,), without the stretch and the place of one that varies."""
        return x[self.tip.start :][:STATE_SIZE]

    def states(self, x: Array) -> Iterator[tuple[Part, Array]]:
        """Yield each part with its states in x, as columns."""
        for part, place in zip(self.case.parts, self._places, strict=True):
            yield part, x[place].reshape(-1, part.transcribed.state_size).T

    @cached_property
    def stretch_places(self) -> list[int]:
        """Where x holds the stretch at the beginning of each part."""
        return [place.start - 1 for place in self._places]

    def stretches(self, x: Array) -> list[float]:
        """Return the stretch at the beginning of each part."""
        return [float(x[place]) for place in self.stretch_places]

    @cached_property
    def _units(self) -> ca.Function:
        """(x, p) -> L_0, F_0 of each part (2, parts), and the length of the whole body, SI."""
        case = self.case
        units = ca.horzcat(*(ca.vertcat(part.length_unit, part.force_unit) for part in case.parts))
        last = case.given[case.body.connector_key(len(case.body.segments) - 1)].symbol if case.body.connected[-1] else 0
        return self.problem.function("part_units", [units, case.whole_length, ca.MX(last)])

    def tip_error(self, change: Array, solution: Solution) -> tuple[float, float]:
        """Return how far a change (18,) of the last state moves the tip, of the whole length, and turns it [rad]."""
        units, whole, connector = self.units(solution)
        off = units[0, -1] * change[:3] + connector * change[9:12]
        return float(np.linalg.norm(off)) / whole, float(np.linalg.norm(change[3:12]) / np.sqrt(2))

    def distance(self, change: Array) -> float:
        """Return the largest change of a scaled position or of a direction cosine between two x."""
        return max(float(np.max(np.abs(states[:12]))) for _, states in self.states(change))

    def weight(self, x: Array) -> Array:
        """Return the weight of each entry of x in an arc length, the mean over the nodes of the change of pose."""
        found = np.zeros(x.size)
        count = sum(states.shape[1] for _, states in self.states(x))
        for part, place in zip(self.case.parts, self._places, strict=True):
            found[place].reshape(-1, part.transcribed.state_size)[:, :12] = 1.0 / count
        return found

    def nodes(self, x: Array) -> Array:
        """Return the scaled node states (20, nodes of all parts); rows that a part does not have are 0."""
        found = []
        for part, states in self.states(x):
            own = states[:, part.transcribed.node_index]
            found.append(np.vstack([own, np.zeros((_ROWS - own.shape[0], own.shape[1]))]))
        return np.hstack(found)

    def pieces(self, nodes: Array, constants: Array, solution: Solution) -> list[Piece]:
        """Return the parts of what `nodes` and `constants` return."""
        units = self.units(solution)[0]
        found, column, row = [], 0, 0
        for k, part in enumerate(self.case.parts):
            count, size = part.transcribed.node_index.size, part.constants.numel()
            own = np.ascontiguousarray(nodes[: part.transcribed.state_size, column : column + count])
            own_constants, rod = constants[row : row + size], self.case.equations_of[part.segment]
            found.append(Piece(part, rod, own, own_constants, *(float(unit) for unit in units[:, k])))
            column, row = column + count, row + size
        return found

    def resampled(self, pieces: list[Piece], stretches: list[float]) -> Array:
        """Return x, without what the loads add, of the same body's parts on another grid. stretches : of each part."""
        found = []
        for piece, stretch, part in zip(pieces, stretches, self.case.parts, strict=True):
            own = between_nodes(piece.shape, piece.nodes, piece.constants, part.transcribed.points)
            states = np.vstack([own[:STATE_SIZE], own[30:32]]) if part.varies else own[:STATE_SIZE]
            found += [np.array([stretch]), states.T.ravel()]
        return np.concatenate(found)

    def unloaded(self, p: Array) -> tuple[Array, Array]:
        """Return x and the last state of the shape without loads at fixed values, see `Chain.first_guess`."""
        found: tuple[Array, Array] = self._once("unloaded", p, lambda: self.case.first_guess(self.values(p)))
        return found

    def values(self, p: Array) -> dict[str, Array]:
        """Return every quantity by key, SI."""
        found: dict[str, Array] = self._once("values", p, lambda: self.problem.values(np.zeros(0), p))
        return found

    def units(self, solution: Solution) -> tuple[Array, float, float]:
        """Return L_0, F_0 of each part (2, parts), the whole length, and that of the last connector, SI."""

        def found() -> tuple[Array, float, float]:
            units, whole, connector = self._units(solution.x, solution.p)
            return np.asarray(units), float(whole), float(connector)

        every: tuple[Array, float, float] = self._once("units", solution.p, found)
        return every

    def _once(self, what: str, p: Array, make: Callable[[], Any]) -> Any:
        """Return what depends on fixed values alone, those asked for last being kept."""
        key = what, p.tobytes()
        if key not in self._kept:
            while len(self._kept) >= _MOST_KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = make()
        return self._kept[key]

    @cached_property
    def _kept(self) -> dict[tuple[str, bytes], Any]:
        return {}

    def conjugate_points(self, pieces: list[Piece], solution: Solution) -> int:
        """Count the directions in which the energy falls, from tip to base through the junctions."""
        beyond, found, body = np.zeros((6, 6)), 0, self.case.body
        values = self.values(solution.p)
        for k in range(len(pieces) - 1, -1, -1):
            piece = pieces[k]
            segment, following = piece.part.segment, pieces[k + 1] if k + 1 < len(pieces) else None
            units, offset = np.ones(2), np.zeros(3)
            if following is not None:
                units = np.array([piece.length / following.length, piece.force / following.force])
            if piece.part.between[1] == 1.0 and body.connected[segment]:
                connector = float(np.ravel(values[body.connector_key(segment)])[0])
                offset = connector / piece.length * piece.nodes[9:12, -1]
            beyond = through_junction(beyond, offset, piece.nodes[12:15, -1], units)
            transition = piece.rod.transition(piece.nodes.shape[1] - 1, varies=piece.part.varies)
            count, beyond = answered(transition, piece.nodes, piece.constants, beyond)
            found += count
        return found


def compiled_chain(equations: ChainEquations, numerics: Numerics, intervals: int) -> ChainGrid:
    """Return the problem of one pose on a grid, with every quantity fixed, and what solves it."""
    method = method_named(numerics.transcription, intervals)
    case = chain_case("pose", equations.body, equations.rods, equations.declared, method)
    problem = compile_problem(list(equations.declared.values()), [case])
    linear = SparseSolver(problem)
    chosen: dict[str, Any] = {"linear": linear, "newton_only": True}
    if numerics.engine == "ipopt":
        chosen = {"linear": linear, "ipopt_only": True, "options": numerics.ipopt}
    return ChainGrid(
        case=case,
        engine=Engine(problem, **chosen),
        stepper=Engine(problem, **chosen, tolerance=1e-7),
        reference=Engine(problem, options=numerics.ipopt),
        transcription=numerics.transcription,
        order=method.order,
        iteration_cost=len(case.parts) * iteration_cost(intervals, numerics.transcription),
    )
