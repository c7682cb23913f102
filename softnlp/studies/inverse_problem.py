"""Inverse kinematics as one problem: the pressures freed in the rod's own case, with bounds and what the target asks.

It is posed once. `Reduced` searches it in the pressures alone, IPOPT in all unknowns of the rod.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.quantity import quantity
from softnlp.base.units import BAR
from softnlp.model.numerics import Numerics
from softnlp.model.rod import Loads
from softnlp.nlp.bounded import Limits, could_gain
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.implicit import ImplicitDerivatives
from softnlp.nlp.places import each_from_the_last, least_apart, spread
from softnlp.nlp.reduced import Point, Reduced
from softnlp.nlp.solver import Engine, Solution
from softnlp.statics.branch import BranchPoint, stretch_on_branch
from softnlp.statics.case import alone
from softnlp.statics.chain import Chain
from softnlp.statics.chain_solver import ChainSolver
from softnlp.statics.condensed import case_solver
from softnlp.statics.loadcase import LoadCase
from softnlp.statics.pose_grid import Solved
from softnlp.statics.posed import Problem, problem
from softnlp.statics.solver import PoseSolver
from softnlp.statics.unloaded import unloaded_case
from softnlp.studies.derivatives import PoseDerivatives
from softnlp.studies.targets import Aim

Array = NDArray[np.float64]

_ARCS, _POSES = 729, 64  # entries of a table of tips
_FEWEST, _TABLE_WORK = 16, 20_000  # poses of a table where each is dear, and what it may cost, as of `Grid`
_APART = 0.35  # of the bounds: starts differ by more in some set
_FOLD_MARGIN = 1e-6  # of the last pressure with an equilibrium
_LEAST_STRETCH = 0.5  # of the branch from zero pressure, which begins at 1 and rises


def inverse_problem(case: LoadCase | Chain, aim: Aim, limits: Limits, *, meets: bool) -> Problem:
    """Pose what targets of the kind of `aim` ask of a case.

    meets : the target is met, which takes as many sets that may move as it has conditions, with the smallest sum of
    squares of the pressures where there are more sets. Otherwise the weighed misfit is made smallest.
    """
    L_0, axis = case.whole_length, case.outputs["tip_rotation"][:, 2]
    axis = axis / ca.norm_2(axis)  # a grid leaves R e3 a little off unit
    pressure = replace(case.given["pressure"], lower=limits.lower * BAR, upper=limits.upper * BAR)
    z = pressure.symbol / BAR
    given, wanted, misfit = [pressure], list[Constraint](), list[ca.MX]()
    if aim.target.position is not None:
        place = quantity("target.position", "m", np.zeros(3))
        off = (case.outputs["tip_position"] - place.symbol) / L_0
        given.append(place)
        misfit.append(off)
        wanted.append(Constraint("tip position", off * L_0, unit="m", scale=L_0))
    if aim.target.direction is not None:
        towards = quantity("target.direction", "1", np.array([0.0, 0.0, 1.0]))
        across = quantity("target.tangents", "1", np.eye(3)[:, :2].ravel(order="F"))
        weight = quantity("target.weight", "1", 1.0)
        given += [towards, across, weight]
        misfit.append(weight.symbol * (axis - towards.symbol))
        wanted.append(Constraint("tip direction", ca.reshape(across.symbol, 3, 2).T @ (axis - towards.symbol)))
    rows = wanted if meets else []
    if np.sum(limits.upper) > limits.largest_sum:
        rows.append(Constraint("last pressure with an equilibrium", ca.sum1(z), -np.inf, limits.largest_sum, "bar"))
    least = ca.sumsqr(z) / 2 if meets and aim.conditions < limits.lower.size else None
    return problem(
        [case],
        given=given,
        free=["pressure"],
        constraints=rows,
        objective=least,
        residuals=[] if meets else misfit,
    )


@dataclass(frozen=True, eq=False)
class Program:
    """The problem of one target on one grid, and what searches it.

    p : its fixed values. Free are the pressures z [bar]. afford : see `Reduced.least_squares`.
    """

    problem: Problem
    reduced: Reduced
    tips: Tips
    meets: bool
    p: Array
    afford: Callable[[], bool] = lambda: True

    def at(self, z: Array, near: Point | Array | None = None) -> Point | None:
        """Return the tip at pressures, from one nearby or its states, else from the arc; see `Reduced.at`."""
        return self.reduced.at(z, self.p, near)

    def again(self, point: Point) -> Point:
        """Return a tip found for another target on the same grid."""
        return self.reduced.judged(point.theta, point.states, point.moves, self.p)

    def searched(self, start: Point, second: Array | None = None) -> tuple[Point, Array]:
        """Return the best tip near a start, and the curvature there, see `Reduced.least_squares`."""
        search = self.reduced.minimum_norm if self.meets else self.reduced.least_squares
        return search(self.p, start, self.tips.limits, second, afford=self.afford)

    def engine(self, **options: Any) -> Engine:
        """Return IPOPT on all unknowns, with options beside those asked for; built at first use."""
        return self.problem._engine(ipopt_only=True, options={**options, **dict(self.tips.numerics.ipopt)})

    def by_ipopt(self, start: Point) -> Array | None:
        """Return the pressures [bar] that IPOPT finds from a tip, None where it finds none."""
        solution = self.engine().solve(self.p, start.x)
        if not solution.holds(self.tips.numerics.tolerance):
            return None
        return self.tips.limits.clip(solution.x[: start.theta.size])  # IPOPT relaxes its bounds

    def could_gain(self, point: Point) -> float:
        """Return what the first-order conditions leave at a tip, see `softnlp.nlp.bounded.could_gain`."""
        return could_gain(self.reduced.measured(point), self.tips.limits, meets=self.meets)

    def misfits(self, points: Sequence[Point | None]) -> Array:
        """Return the weighed misfit [L_0] at points of this grid; inf where there is none."""
        known = [k for k, point in enumerate(points) if point is not None]
        found = np.full(len(points), np.inf)
        r = self.reduced.residuals([point for point in points if point is not None], self.p)
        found[known] = np.linalg.norm(r, axis=0)
        return found


@dataclass(frozen=True, eq=False)
class Tips:
    """The tip of a robot by its pressures within limits [bar], on one grid, or without loads as that of an arc.

    intervals : None for the arc, which is exact.
    """

    poses: PoseSolver
    loads: Loads
    limits: Limits
    numerics: Numerics
    intervals: int | None

    def program(self, aim: Aim, *, meets: bool = False) -> Program:
        """Return the problem of a target, see `inverse_problem`; compiled at first use for targets of its kind."""
        kind = (aim.target.position is None, aim.target.direction is None, meets)
        key = ("inverse", self._key, kind, self.numerics.ipopt)
        posed, reduced = self.poses.equations.kept(key, lambda: self._posed(aim, meets=meets))
        values = {name: v for name, v in self.poses.values(np.zeros(0), self.loads).items() if name != "pressure"}
        return Program(posed, reduced, self, meets, posed.compiled.pack({**values, **aim.values()}))

    def _posed(self, aim: Aim, *, meets: bool) -> tuple[Problem, Reduced]:
        case, held = self._cases()
        places = [0] if self.intervals is None else self.poses.grid(self.intervals).stretch_places
        posed = inverse_problem(case, aim, self.limits, meets=meets)
        begin, sound = partial(self.poses.unloaded, case), lambda x: bool(np.all(x[places] >= _LEAST_STRETCH))
        return posed, Reduced(posed.compiled, held, posed.residuals, begin=begin, sound=sound)

    def _cases(self) -> tuple[LoadCase | Chain, ImplicitDerivatives]:
        """Return the case, and what solves it with the pressures fixed, with its derivatives by them."""
        equations = self.poses.equations
        if self.intervals is not None:
            found = PoseDerivatives(self.poses).on_grid(self.intervals, ("pressure",))
            return self.poses.grid(self.intervals).case, found
        arc = unloaded_case("pose", equations.functions, equations.declared)
        held = lambda: ImplicitDerivatives(alone(arc), ("pressure",), case_solver(arc))  # noqa: E731
        return arc, equations.kept(("arc", "pressure"), held)

    def moved(self, solved: Solved) -> Array:
        """Return the states of a pose solved on any grid, on this one."""
        if self.intervals is None:
            return solved.solution.x[:1]
        grid = self.poses.grid(self.intervals)
        return solved.solution.x if solved.grid is grid else self.poses.transfer(solved, grid)

    def solved(self, program: Program, point: Point) -> Solved:
        """Return a point as a pose on this grid, not examined, for going on to another grid."""
        assert self.intervals is not None
        grid = self.poses.grid(self.intervals)
        solution = Solution(point.states, program.reduced.fixed(point.theta, program.p), 0.0, 0, "")
        nodes = grid.nodes(point.states)
        constants = grid.constants(solution)
        return Solved(lambda: grid, self.intervals, solution, nodes, nodes, constants, 0.0, 0.0, stable=True)

    def nearest(self, program: Program, most: int | None = None, below: float = np.inf) -> list[Point]:
        """Return tips of a table over the limits, apart from each other, nearer than `below`, the nearest first."""
        places = spread(self.limits, self._entries)
        numbers = program.reduced.fixed(self.limits.lower, program.p).tobytes()
        table = self.poses.equations.kept(("tips", self._key, numbers), lambda: each_from_the_last(places, program.at))
        misfit = program.misfits(table)
        span = np.maximum(self.limits.upper - self.limits.lower, 1e-9)
        chosen = least_apart(misfit, places, _APART * span, most or len(misfit))
        return [point for k in chosen if misfit[k] < below and (point := table[k]) is not None]

    @property
    def _entries(self) -> int:
        """The size of the table."""
        if self.intervals is None:
            return _ARCS
        return int(np.clip(_TABLE_WORK // self.poses.grid(self.intervals).iteration_cost, _FEWEST, _POSES))

    @property
    def _key(self) -> tuple[Hashable, ...]:
        """What tells compiled problems and tables apart, beside what is asked of the tip."""
        limits = (*self.limits.lower, *self.limits.upper, self.limits.largest_sum)
        return (self.numerics.transcription, self.intervals, limits)


def pressure_limits(poses: PoseSolver, lower: Array, upper: Array) -> tuple[Limits, BranchPoint | None]:
    """Return bounds [bar] with the largest sum of pressures that has an equilibrium, and what ends the branch there.

    The stretch balance holds the pressures by their sum alone; the stiffnesses may tell sets apart, so the least sum
    of the bounds' corners is taken. lower, upper : (sets,) [Pa]. Of several segments each holds its own; bounds beyond
    the last pressure of one raise `InputError`.
    """
    if isinstance(poses, ChainSolver):
        if (ended := poses.ends_below(upper)) is not None:
            raise InputError(f"expected lower ones: {ended.message}", table="bounds", key="pressure_bar")
        return Limits(lower / BAR, upper / BAR, np.inf), None
    largest, ends = float(np.sum(upper)), None
    for corner in [upper, *(upper.sum() * np.eye(upper.size))]:
        branch = stretch_on_branch(poses.branch, poses.column({"pressure": corner}), corner)
        if not branch.status.has_solution and branch.fraction * corner.sum() < largest:
            largest = (1 - _FOLD_MARGIN) * branch.fraction * float(corner.sum())
            ends = branch
    return Limits(lower / BAR, upper / BAR, largest / BAR), ends


def coarse_intervals(poses: PoseSolver, limits: Limits) -> int:
    """Return a grid that holds the most curled unloaded arc within limits [bar]."""
    most = 0
    for corner in np.diag(np.minimum(limits.upper, limits.largest_sum)):
        pressure = limits.clip(corner) * BAR
        column = poses.column({"pressure": pressure})
        stretch = poses.branch_at({"pressure": pressure}).stretch
        most = max(most, poses.first_intervals(column, stretch))
    return most
