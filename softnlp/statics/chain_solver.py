"""Solving poses of a body of several segments, or of one whose section varies, as `PoseSolver` does those of a rod."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.model.segments import body_of
from softnlp.nlp.solver import Solution
from softnlp.statics.attempts import Neighbour
from softnlp.statics.branch import BranchPoint
from softnlp.statics.chain_grid import ChainEquations, ChainGrid, compiled_chain
from softnlp.statics.chain_step import chain_step
from softnlp.statics.grid_size import first_intervals
from softnlp.statics.pose_grid import Grid, Solved
from softnlp.statics.solver import UNLOADED_ACCURACY, PoseSolver
from softnlp.statics.step import Step

Array = NDArray[np.float64]


class ChainSolver(PoseSolver):
    """As `PoseSolver`; the grid has as many intervals on each segment."""

    equations: ChainEquations

    def __init__(
        self,
        model: Model,
        numerics: Numerics,
        *,
        equations: ChainEquations,
        unloaded_accuracy: float = UNLOADED_ACCURACY * 3,
    ) -> None:
        super().__init__(model, numerics, unloaded_accuracy=unloaded_accuracy, equations=equations)

    def _set_model(self, model: Model) -> None:
        super()._set_model(model)
        self.body = body_of(model)
        self._first: tuple[Any, int] | None = None  # what was asked last, and the grid

    def _compiled(self, numerics: Numerics, intervals: int) -> Grid:
        return compiled_chain(self.equations, numerics, intervals)

    def branch_at(self, values: Mapping[str, Any], only: int | None = None) -> BranchPoint:
        """Return where the branch of the first segment that ends before stands, else that of the first. only : of."""
        given = {
            name: np.atleast_1d(np.asarray(values.get(name, q.nominal), float)) for name, q in self.quantities.items()
        }
        found = []
        for k, rod in enumerate(self.equations.rods):
            if only not in (None, k):
                continue
            own = self.body.of_segment(k, given)
            for s in self.body.knots(k) if k in self.body.varying else [0.0]:
                there = self.body.of_segment(k, given, s)
                column = np.concatenate([there[key] if key in there else given[key] for key in rod.functions.taken])
                point = rod.stretch(column, own["pressure"])
                if point.status is not Status.SOLVED:
                    where = f"segment {k + 1}{f' at s = {s:g}' if k in self.body.varying else ''}: "
                    return replace(point, message=where + point.message)
                found.append(point)
        return found[0]

    def first_intervals(
        self, column: Array, stretch: float, arc_target: float | None = None, transcription: str | None = None
    ) -> int:
        """Return a first grid that is fine enough for each segment."""
        method = transcription or self.numerics.transcription
        asked = column.tobytes(), arc_target, method
        if self._first is None or self._first[0] != asked:
            self._first = asked, self._intervals(column, arc_target, method)
        return self._first[1]

    def _intervals(self, column: Array, arc_target: float | None, method: str) -> int:
        values, found = self._by_key(column), []
        every = [self.body.of_segment(k, values) for k in range(len(self.body.segments))]
        whole = sum(float(own["robot.length"][0]) for own in every)
        for own, rod in zip(every, self.equations.rods, strict=True):
            taken = np.concatenate([own[key] if key in own else values[key] for key in rod.functions.taken])
            at = rod.stretch(taken, own["pressure"]).stretch
            constants, _, units = (np.asarray(part).ravel() for part in rod.functions.section(taken, at))
            moment = values["tip_moment"] / np.prod(units)
            share = float(own["robot.length"][0]) / whole
            found.append(first_intervals(method, constants, moment, arc_target, share))
        return max(found)

    def arc_guess(self, grid: Grid, p: Array, stretch: float) -> Array:
        """Return x of the shape without loads at this pressure."""
        assert isinstance(grid, ChainGrid)
        return grid.unloaded(p)[0]

    def ends_below(self, upper: Array) -> BranchPoint | None:
        """Return where the branch of a segment ends below pressures (sets,) or their sum in one set; None for none."""
        for k in range(len(self.body.segments)):
            own = self.body.of_segment(k, {**self._by_key(self.column({})), "pressure": np.arange(upper.size)})
            places = np.asarray(own["pressure"], int)
            for corner in [upper[places], *(upper[places].sum() * np.eye(places.size))]:
                pressure = np.zeros(upper.size)
                pressure[places] = corner
                point = self.branch_at({"pressure": pressure}, only=k)
                if not point.status.has_solution:
                    return point
        return None

    def unloaded(self, case: Any, column: Array) -> Array | None:
        """Return x of a case without loads at every quantity in its order, None where a branch ends before."""
        values = self._by_key(column)
        if not self.branch_at(values).status.has_solution:
            return None
        found: Array = case.first_guess(values)[0]
        return found

    def _by_key(self, column: Array) -> dict[str, Array]:
        """Return every quantity by key of all in their order."""
        sizes = np.cumsum([q.size for q in self.quantities.values()])[:-1]
        return dict(zip(self.quantities, np.split(column, sizes), strict=True))

    def _neighbour(self, solved: Solved, grid: Grid, p: Array, stretch: float) -> Neighbour:
        assert isinstance(grid, ChainGrid)
        x_old, p_old = solved.solution.x, solved.solution.p
        x = x_old
        if solved.grid is not grid:
            before = solved.grid
            assert isinstance(before, ChainGrid)
            pieces = before.pieces(solved.limit, solved.constants, solved.solution)
            x = grid.resampled(pieces, before.stretches(x_old))
        arcs = self.arc_guess(grid, p_old, 0.0), self.arc_guess(grid, p, stretch)
        return Neighbour(x=x, p=p_old, moved=x + arcs[1] - arcs[0], stable=solved.stable)

    def _conjugate_points(self, grid: Grid, nodes: Array, constants: Array, solution: Solution) -> int:
        assert isinstance(grid, ChainGrid)
        return grid.conjugate_points(grid.pieces(nodes, constants, solution), solution)

    def _step(self, pressure: Array, loads: Loads, found: Solved, iterations: int, began: float) -> Step:
        return chain_step(self.body, self.numerics, pressure, loads, found, iterations, began)
