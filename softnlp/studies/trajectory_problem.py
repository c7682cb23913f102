"""A path of the tip as one problem: the rod at every instant, its pressures free, joined by how fast these may change.

The rod at one instant is posed once, with the target and the obstacles as numbers; the whole is as many copies of that.
Which targets are equations, and which are only to be neared, is said by bounds alone, see `PathProgram.bounds`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import quantity
from softnlp.base.units import BAR
from softnlp.model.model import Model
from softnlp.model.obstacles import Obstacle
from softnlp.nlp.bounded import Limits
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.joined import Link, joined
from softnlp.nlp.optimality import Bounds
from softnlp.nlp.problem import CompiledProblem
from softnlp.statics.chain import Chain
from softnlp.statics.clearance import NodeGaps, node_gaps
from softnlp.statics.loadcase import LoadCase
from softnlp.statics.obstructed import numbers_of
from softnlp.statics.posed import problem
from softnlp.studies.targets import Aim

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Minimise = Literal["pressure", "rate"]

ON_TARGET, CLEARANCE, RATE = "tip on its target", "clearance", "rate of pressure"
MISS, NEAREST = "trajectory.miss", "trajectory.nearest"

_MISSING = 1e2  # what the sum of misses counts for, in L_0 against a sum of squares in bar: see `PathProgram.bounds`
_NEAREST = 1e6  # what half the square of a distance counts for, of a target that is not met
_STILL = 1e-3  # of the pressures beside their rates, so that nothing is left undetermined


@dataclass(frozen=True, eq=False)
class PathTask:
    """A path of targets over time and what limits it.

    targets : as of `inverse`, all of one kind. times : (T,) [s], each later than the one before. lower, upper : (sets,)
    [Pa]. rate : the largest rate of any pressure [Pa/s], None for any. clearance : least distance to obstacles [m].
    minimise : what is made small where pressures are left to choose. length_per_radian : as `InverseTask` [m].
    allow : as `InverseTask`.
    """

    targets: tuple[Any, ...]
    times: Array
    lower: Array
    upper: Array
    rate: float | None
    clearance: float
    minimise: Minimise
    length_per_radian: float
    allow: tuple[str, ...] = ()

    def step_count(self, pressures: int) -> int:
        """Return how many steps the run has: one an instant."""
        return len(self.targets)


@dataclass(frozen=True, eq=False)
class Instant:
    """The problem of one instant.

    x holds the pressures [bar], the misses of the target's conditions on either side, and the states. Its rows are the
    equations of the case, the target's, the largest sum of pressures where there is one, and the gaps of the nodes.
    """

    compiled: CompiledProblem
    case: LoadCase | Chain
    sets: int
    conditions: int
    gaps: NodeGaps | None

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return int(self.compiled.nlp["x"].numel())

    @property
    def misses(self) -> slice:
        """Where x has the misses."""
        return slice(self.sets, self.sets + 2 * self.conditions)

    @property
    def head(self) -> int:
        """Where the states begin."""
        return int(self.misses.stop)

    def rows(self, name: str) -> NDArray[np.intp]:
        """Return the rows of an equation, none where it is not posed."""
        found = [e.rows for e in self.compiled.equations if e.name == name]
        return found[0] if found else np.zeros(0, int)


def instant(
    case: LoadCase | Chain, model: Model, aim: Aim, limits: Limits, obstacles: Sequence[Obstacle], *, effort: float
) -> Instant:
    """Pose one instant for targets of the kind of `aim`.

    case : of the model's kind. effort : what half the sum of squares of the pressures counts for [bar].
    """
    L_0, axis = case.whole_length, case.outputs["tip_rotation"][:, 2]
    axis = axis / ca.norm_2(axis)  # a grid leaves R e3 a little off unit
    pressure = replace(case.given["pressure"], lower=limits.lower * BAR, upper=limits.upper * BAR)
    z = pressure.symbol / BAR
    nearest = quantity(NEAREST, "1", 0.0)
    given, wanted, misfit = [pressure, nearest], list[ca.MX](), list[ca.MX]()
    if aim.target.position is not None:
        place = quantity("target.position", "m", np.zeros(3))
        off = (case.outputs["tip_position"] - place.symbol) / L_0
        given.append(place)
        wanted.append(off)
        misfit.append(off)
    if aim.target.direction is not None:
        towards = quantity("target.direction", "1", np.array([0.0, 0.0, 1.0]))
        across = quantity("target.tangents", "1", np.eye(3)[:, :2].ravel(order="F"))
        weight = quantity("target.weight", "1", 1.0)
        given += [towards, across, weight]
        wanted.append(ca.reshape(across.symbol, 3, 2).T @ (axis - towards.symbol))
        misfit.append(weight.symbol * (axis - towards.symbol))
    m = aim.conditions
    miss = quantity(MISS, "1", np.zeros(2 * m), lower=0.0)
    given.append(miss)
    over, under = miss.symbol[:m], miss.symbol[m:]
    free = (-np.inf, np.inf)  # which rows are equations is said later
    rows = [Constraint(ON_TARGET, ca.vertcat(*wanted) - over + under, *free)]
    if np.sum(limits.upper) > limits.largest_sum:
        rows.append(Constraint("last pressure with an equilibrium", ca.sum1(z), -np.inf, limits.largest_sum, "bar"))
    gaps = None
    if obstacles:
        numbers = numbers_of(obstacles, 1)[: len(obstacles)]
        given += numbers
        gaps = node_gaps(case, model, obstacles, numbers)
        rows.append(Constraint(CLEARANCE, gaps.gaps * L_0, *free, unit="m", scale=aim.length))
    cost = effort * ca.sumsqr(z) / 2 + nearest.symbol * ca.sumsqr(ca.vertcat(*misfit)) / 2
    posed = problem(
        [case],
        given=given,
        free=["pressure", MISS],
        constraints=rows,
        objective=cost + _MISSING * ca.sum1(miss.symbol),
    )
    compiled = replace(posed.compiled, own_slope=lambda: _slope(posed.compiled, case))
    return Instant(compiled, case, limits.lower.size, m, gaps)


def _slope(compiled: CompiledProblem, case: LoadCase | Chain) -> ca.MX:
    """Return the Jacobian of an instant's rows, those of the case by the blocks of one interval."""
    x, p = compiled.nlp["x"], compiled.nlp["p"]
    by_free = [q.scale * ca.jacobian(case.residuals, q.symbol) for q in compiled.free]
    own = compiled.function("own_slope", [ca.horzcat(*by_free, case.slope)], dense=False)(x, p)
    return ca.vertcat(own, ca.jacobian(compiled.curved[case.residuals.numel() :], x))


@dataclass(frozen=True, eq=False)
class PathProgram:
    """The whole path on one grid. times : (T,) [s]. compiled : all instants as one, see `softnlp.nlp.joined`."""

    instant: Instant
    task: PathTask
    compiled: CompiledProblem

    @property
    def count(self) -> int:
        """The number of instants."""
        return len(self.task.targets)

    @property
    def rows(self) -> int:
        """The number of rows of an instant."""
        return int(self.instant.compiled.nlp["g"].numel())

    def split(self, x: Array) -> Array:
        """Return the unknowns of each instant (T, n)."""
        return x.reshape(self.count, -1)

    def pressures(self, x: Array) -> Array:
        """Return the pressures of each instant (T, sets) [bar]."""
        return self.split(x)[:, : self.instant.sets]

    def packed(self, aims: Sequence[Aim], values: dict[str, Any], missed: Mask) -> Array:
        """Return p. values : of what all instants share, SI. missed : (T,) whose targets are neared only."""
        one = self.instant.compiled
        return np.concatenate(
            [
                one.pack({**values, **aim.values(), NEAREST: _NEAREST if lost else 0.0})
                for aim, lost in zip(aims, missed, strict=True)
            ]
        )

    def bounds(self, missed: Mask, tightened: Array, *, elastic: bool = False) -> Bounds:
        """Return bounds by which targets are equations, but for those that are missed.

        elastic : equations may be missed at a price that is above what meeting them is worth, so that as few as can be
        are. tightened : (T, rows) by how much each gap of a node is to be above the clearance [L_0].
        """
        instant, one = self.instant, self.instant.compiled
        T, m = self.count, one.nlp["g"].numel()
        lower_g, upper_g = (np.tile(bound, (T, 1)) for bound in (one.lower_g, one.upper_g))
        met = np.ix_(~missed, instant.rows(ON_TARGET))
        lower_g[met] = upper_g[met] = 0.0
        clear = instant.rows(CLEARANCE)
        if clear.size:
            lower_g[:, clear] = self.clearance + tightened
        upper_x = np.tile(one.upper_x, (T, 1))
        upper_x[:, instant.misses] = 0.0
        if elastic:
            upper_x[~missed, instant.misses] = np.inf
        links = slice(T * m, None)
        return Bounds(
            np.tile(one.lower_x, T),
            upper_x.ravel(),
            np.concatenate([lower_g.ravel(), self.compiled.lower_g[links]]),
            np.concatenate([upper_g.ravel(), self.compiled.upper_g[links]]),
        )

    @property
    def clearance(self) -> float:
        """The clearance as the gaps are scaled."""
        equation = next(e for e in self.instant.compiled.constraints if e.name == CLEARANCE)
        return self.task.clearance / float(equation.scale)


def path_program(one: Instant, task: PathTask, moving: int) -> PathProgram:
    """Join the instants of a path. moving : how many sets may move."""
    T, n, sets = len(task.targets), one.size, one.sets
    apart = np.diff(task.times)
    change = _changes(T, n, sets)
    links = []
    if task.rate is not None and T > 1:
        room = np.repeat(task.rate * apart / BAR, sets)
        matrix = ca.DM(ca.Sparsity.diag(room.size), 1 / room) @ change
        ones = np.ones(room.size)
        links.append(Link(RATE, matrix, -ones, ones, "Pa/s", task.rate))
    quadratic = None
    if task.minimise == "rate" and T > 1 and moving > one.conditions:
        mean = float(np.mean(apart))  # a path of even steps has the weight 1 on each change
        weight = np.repeat(mean / apart, sets)
        quadratic = change.T @ ca.DM(ca.Sparsity.diag(weight.size), weight) @ change
    return PathProgram(one, task, joined(one.compiled, T, links=links, quadratic=quadratic))


def effort_of(task: PathTask, moving: int, conditions: int) -> float:
    """Return what the pressures count for: nothing where the targets determine them."""
    if moving <= conditions:
        return 0.0
    return 1.0 if task.minimise == "pressure" else _STILL


def _changes(count: int, size: int, sets: int) -> ca.DM:
    """Return the matrix of the changes of pressures from each instant to the next."""
    k, j = (index.ravel() for index in np.meshgrid(np.arange(count - 1), np.arange(sets), indexing="ij"))
    rows = np.arange(k.size)
    columns = np.concatenate([k * size + j, (k + 1) * size + j])
    sign = np.concatenate([-np.ones(k.size), np.ones(k.size)])
    found = ca.DM.triplet(np.concatenate([rows, rows]).tolist(), columns.tolist(), ca.DM(sign), k.size, count * size)
    return found
