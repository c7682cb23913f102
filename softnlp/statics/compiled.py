"""What is compiled for one kind of model and its loads; other numbers need nothing built."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity
from softnlp.model.load import Load
from softnlp.model.quantities import Model
from softnlp.statics.branch import BranchPoint, branch_function, stretch_on_branch
from softnlp.statics.loadcase import RodFunctions, rod_functions
from softnlp.statics.pose import Mapped, shape_function
from softnlp.statics.single_shooting import SingleShooting, single_shooting
from softnlp.statics.stability import MOST_INTERVALS, conjugate_points, transition_function
from softnlp.statics.varying import VaryingRod, varying_rod

Array = NDArray[np.float64]
T = TypeVar("T")

_WORTH_COMPILING = 16  # poses
_MOST_POINTS = 16  # of the branch that are kept
_OF_A_POSE = 0.15  # that a shape takes
MOST_GRIDS = 64
"""How many grids, and problems on grids, are kept of one rod."""


@dataclass(frozen=True, eq=False)
class RodEquations:
    """The rod of one kind of model under some loads, with the grids compiled for it so far.

    declared : every quantity, with the numbers of the model for which it was made. grids : by what tells them apart,
    those used last at the end.
    """

    functions: RodFunctions
    declared: dict[str, Quantity]
    grids: dict[Hashable, Any] = field(default_factory=dict)
    _mapped: dict[tuple[int, bool], ca.Function] = field(default_factory=dict)
    _points: dict[bytes, BranchPoint] = field(default_factory=dict)
    _asked: list[float] = field(default_factory=lambda: [0.0])

    @cached_property
    def branch(self) -> ca.Function:
        """The stretch's branch, see `branch_function`; built at first use, as all that follows."""
        return branch_function(self.functions.model)

    def stretch(self, column: Array, pressures: Array) -> BranchPoint:
        """Return where the branch of the stretch stands, see `stretch_on_branch`; the last ones asked for are kept."""
        own = column[: self.branch.size1_in(0)]
        key = own.tobytes()
        if key not in self._points:
            self._points[key] = stretch_on_branch(self.branch, own, pressures)
            while len(self._points) > _MOST_POINTS:
                del self._points[next(iter(self._points))]
        return self._points[key]

    def single_shooting(self) -> SingleShooting | None:
        """Return machine code for single poses, from when what was done without it has taken as long as to compile it.

        None before, under other loads than dead ones, and where there is nothing to compile with.
        """
        return self._worth(1.0)

    def _worth(self, poses: float) -> SingleShooting | None:
        """Return it, counting what it would do this time: as much as for so many poses."""
        self._asked[0] += poses
        possible = self.functions.by_machine and not self.functions.loads
        if not possible or self._asked[0] <= _WORTH_COMPILING:
            return None
        return self._compiled

    @cached_property
    def _compiled(self) -> SingleShooting | None:
        return single_shooting(self.functions)

    @property
    def shape(self) -> Mapped:
        """The shape between nodes, see `shape_function`; in machine code where that has been compiled."""
        return self._worth(_OF_A_POSE) or self._shape

    @cached_property
    def _shape(self) -> ca.Function:
        return shape_function(self.functions)

    @cached_property
    def varying(self) -> VaryingRod:
        """The rod whose section varies along s."""
        return varying_rod(self.functions)

    @cached_property
    def _transition(self) -> ca.Function:
        return transition_function(self.functions.field)

    def conjugate_points(self, nodes: Array, constants: Array) -> int:
        """Count the directions in which the energy falls, 0 where the pose is stable; see `conjugate_points`."""
        return conjugate_points(self.transition(nodes.shape[1] - 1), nodes, constants)

    def transition(self, intervals: int, *, varies: bool = False, every: bool = False) -> ca.Function:
        """Return what `conjugate_points` takes for a grid, of the uniform rod or of the one that varies.

        every : of each interval, however many.
        """
        K = intervals if every else min(intervals, MOST_INTERVALS)
        if (K, varies) not in self._mapped:
            self._mapped[K, varies] = (self.varying.transition if varies else self._transition).map(K)
        return self._mapped[K, varies]

    def kept(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what was compiled under a key, made at first use; what was used least recently goes."""
        if key not in self.grids:
            self.grids[key] = make()
            while len(self.grids) > MOST_GRIDS:
                del self.grids[next(iter(self.grids))]
        found: T = self.grids.pop(key)
        self.grids[key] = found
        return found

    def quantities_of(self, model: Model) -> dict[str, Quantity]:
        """Return the quantities of a model of the same kind with its numbers, under the compiled symbols."""
        return {
            name: replace(q, symbol=self.declared[name].symbol) for name, q in self.functions.declared(model).items()
        }


def rod_equations(
    model: Model, loads: Sequence[Load] = (), *, by_machine: bool = True, like: RodEquations | None = None
) -> RodEquations:
    """Compile the rod of a model, see `rod_functions`."""
    functions = rod_functions(model, loads, by_machine=by_machine, like=like.functions if like else None)
    return RodEquations(functions, functions.declared())
