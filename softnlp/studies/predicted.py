"""What the model says of measurements, and its exact derivatives by constants, at any values of the constants.

Without loads a pose is the arc of the section's constants in closed form, once the stretch is known; with loads, and
against a wall, it is the solution of the rod's equations g(x, p) = 0. Derivatives are those of the implicit function:
dx = -J^-1 g_p dp. At first, and whenever asked anew, solutions are followed as in `softnlp.forward` and
`softnlp.blocked_force`; at other constants nearby they are found from the known ones, and where that leads elsewhere
they are followed again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.quantities import LOADS
from softnlp.model.rod import Loads
from softnlp.nlp.implicit import ImplicitDerivatives
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.body import Fit
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.loadcase import stretch_imbalance, stretch_near
from softnlp.statics.pose_grid import Solved
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step
from softnlp.statics.wall import Wall, standing_wall
from softnlp.studies.derivatives import PoseDerivatives
from softnlp.studies.forward import followed
from softnlp.studies.identified import FreeConstants
from softnlp.studies.measurements import COLUMNS, POSE_COLUMNS, Data
from softnlp.studies.registration import CLOCK, turned

Array = NDArray[np.float64]
Found = TypeVar("Found")

_LARGEST_CHANGE = 0.1  # of a stretch, between constants
_NO_CURVATURE = 1e-30  # squared, under the root: the bending angle has no derivative at a straight shape
STRAIGHT = 1e-8
"""Bending angle of a straight shape [rad]; it has no derivative there."""
_LARGEST_JUMP = 0.3  # of a scaled position or direction cosine, between solutions at two sets of constants
_SEEN = ("tip_position", "bending_angle", "elongation", "chamber_lengths")


@dataclass(frozen=True)
class Failure:
    """A row whose pose was not found, and the named status of it."""

    row: int
    status: Status
    message: str


@dataclass(frozen=True, eq=False)
class Prediction:
    """values : (rows, m), nan where a pose was not found. slopes : (rows, m, constants).

    turns : (rows, 9) rotations of the tip by columns, and turn_slopes : (rows, 9, constants), of `Predicted`.
    """

    values: Array
    slopes: Array
    failures: tuple[Failure, ...]
    turns: Array | None = None
    turn_slopes: Array | None = None


class FreePoses(Protocol):
    """The observables of free poses: `POSE_COLUMNS`, then the chamber lengths [m]; and the tip's rotation."""

    def evaluate(self, constants: Mapping[str, float], anew: bool = False) -> Prediction:
        """Return them at values of quantities; `anew` follows every pose from zero pressure again."""
        ...


class ArcPoses:
    """Free poses without loads, in closed form."""

    def __init__(self, solver: PoseSolver, pressure: Array, names: Sequence[str]) -> None:
        self._solver = solver
        self._pressure = pressure
        self._function = _arc_function(solver, names)
        self._imbalance = stretch_imbalance(solver.functions)
        self._stretch: Array | None = None

    def evaluate(self, constants: Mapping[str, float], anew: bool = False) -> Prediction:
        """See `FreePoses`."""
        solver = self._solver.with_values(constants)
        columns = np.array([solver.column(solver.values(P, Loads())) for P in self._pressure]).T
        failures: list[Failure] = []
        stretch = None if anew or self._stretch is None else self._near(columns, self._stretch)
        if stretch is None:
            stretch = np.ones(len(self._pressure))
            for row, P in enumerate(self._pressure):
                point = stretch_on_branch(solver.branch, columns[:, row], P)
                stretch[row] = point.stretch if point.status is Status.SOLVED else np.nan
                if point.status is not Status.SOLVED:
                    failures.append(Failure(row, point.status, point.message))
            if not failures:
                polished = self._near(columns, stretch)
                stretch = stretch if polished is None else polished
        if not failures:
            self._stretch = stretch
        values, slopes = (np.asarray(part) for part in self._function(columns, stretch[None, :]))
        split = slopes.reshape(slopes.shape[0], len(stretch), -1).transpose(1, 0, 2)
        return _split(values.T, split, tuple(failures))

    def _near(self, columns: Array, stretch: Array) -> Array | None:
        """Return the roots of the balance next to known stretches, None where one is not near."""
        found = stretch_near(self._imbalance, columns, stretch)
        balance, slope = (np.asarray(part).ravel() for part in self._imbalance(columns, found[None, :]))
        # On the branch from zero pressure the resistance grows faster with the stretch than the pressure's force.
        near = (slope > 0) & (np.abs(found - stretch) < _LARGEST_CHANGE) & (np.abs(balance) < 1e-9)
        return found if np.all(near) else None


def free_tips(solver: PoseSolver, loads: Loads, pressure: Array) -> tuple[Array, Array]:
    """Return tips (rows, 3) [m] at pressures (rows, sets) [Pa] and their rotations by columns (rows, 9), else nan."""
    if not loads.act:
        found = ArcPoses(solver, pressure, ()).evaluate({})
        assert found.turns is not None
        return found.values[:, :3], found.turns
    tips, turns = np.full((len(pressure), 3), np.nan), np.full((len(pressure), 9), np.nan)
    for row, step in enumerate(followed(lambda P, near: solver.solve(P, loads, near), pressure, None)):
        if step.pose is not None:
            tips[row], turns[row] = step.pose.tip_position, np.asarray(step.pose.tip_rotation).ravel(order="F")
    return tips, turns


def _split(values: Array, slopes: Array, failures: tuple[Failure, ...]) -> Prediction:
    """Return a prediction of observables behind which the rotation of the tip stands."""
    return Prediction(values[:, :-9], slopes[:, :-9], failures, values[:, -9:], slopes[:, -9:])


def _arc_function(solver: PoseSolver, names: Sequence[str]) -> ca.Function:
    """Return (quantities, stretch) -> observables, and their derivatives by the named with the stretch in balance."""
    functions = solver.functions
    column, stretch = ca.SX.sym("quantities", functions.section.size1_in(0)), ca.SX.sym("stretch")
    c, balance, units = functions.section(column, stretch)
    state = functions.arc(column, stretch, 1.0)
    L_0, N = units[0], functions.model.chambers
    u = functions.strains(state, c)[1]
    angle = stretch * ca.sqrt(u[0] ** 2 + u[1] ** 2 + _NO_CURVATURE)
    lengths = functions.lengths(state, c)[:N] * L_0
    seen = ca.vertcat(state[:3] * L_0, angle, (stretch - 1) * L_0, lengths, state[3:12])
    chosen = ca.DM(column.numel(), len(names))
    at = np.cumsum([0, *(q.size for q in solver.quantities.values())])
    for row, name in zip(at, solver.quantities, strict=False):
        if name in names:
            chosen[int(row), list(names).index(name)] = 1.0
    rates = ca.jtimes(balance, column, chosen) / ca.jacobian(balance, stretch)
    slopes = ca.jtimes(seen, column, chosen) - ca.jacobian(seen, stretch) @ rates
    return ca.Function("arcs", [column, stretch], [ca.densify(seen), ca.densify(slopes)], {"cse": True})


class LoadedPoses:
    """Free poses under dead loads: each followed from the last at first, then from itself at other constants.

    Where `CLOCK` is among the names the loads turn with it, the other way than the sets do.
    """

    def __init__(self, solver: PoseSolver, pressure: Array, loads: Loads, names: Sequence[str]) -> None:
        self._solver = solver
        self._pressure = pressure
        self._loads = self._given = loads
        self._names = tuple(names)
        self._clock: float | None = None
        self._derivatives = PoseDerivatives(solver)
        self._known: dict[int, Solved] = {}

    def evaluate(self, constants: Mapping[str, float], anew: bool = False) -> Prediction:
        """See `FreePoses`."""
        solver = self._solver.with_values(constants)
        failures: tuple[Failure, ...] = ()
        if CLOCK in self._names:
            self._clock = constants[CLOCK]
            self._loads = turned(self._given, -self._clock)
        if anew or not self._moved(solver):
            pressed = enumerate(self._pressure)
            self._known, failures = _followed(pressed, lambda P, near: solver.solve(P, self._loads, near))
        shape = (5 + solver.model.robot.chambers + 9, len(self._names))
        values = np.full((len(self._pressure), shape[0]), np.nan)
        slopes = np.full((len(self._pressure), *shape), np.nan)
        for row, found in self._known.items():
            values[row], slopes[row] = self._observed(found)
        return _split(values, slopes, failures)

    def _moved(self, solver: PoseSolver) -> bool:
        """Solve every known pose at other constants; whether all are still there, and near."""
        if len(self._known) < len(self._pressure):
            return False
        moved = {}
        for row, found in self._known.items():
            grid, x = found.grid, found.solution.x
            p = grid.problem.pack(solver.values(self._pressure[row], self._loads))
            solution = grid.engine.solve(p, x)
            if not solution.holds(solver.numerics.tolerance) or grid.distance(solution.x - x) > _LARGEST_JUMP:
                return False
            moved[row] = replace(found, solution=solution)
        self._known = moved
        return True

    def _observed(self, found: Solved) -> tuple[Array, Array]:
        """Return the observables of a pose and their derivatives."""
        own = [name for name in self._names if name in self._solver.quantities]
        point = self._derivatives.at(found, own if self._clock is None else [*own, *LOADS])
        turn, turn_slopes = point.rotation
        values = np.concatenate([*(point.value(name) for name in _SEEN), turn])
        moved = np.vstack([*(point.derivative(name) for name in _SEEN), turn_slopes])
        slopes = _by_name(moved[:, : len(own)], own, self._names)
        if self._clock is not None:
            rate = turned(self._given, -self._clock, rate=-1.0)
            by_loads = np.concatenate([np.asarray(getattr(rate, name)) for name in LOADS])
            slopes[:, self._names.index(CLOCK)] = moved[:, len(own) :] @ by_loads
        if values[3] < STRAIGHT:
            slopes[3] = 0.0
        return values, slopes


class BlockedForces:
    """The blocked force of one robot at a sequence of pressures."""

    def __init__(self, solver: BlockedSolver, pressure: Array, loads: Loads, names: Sequence[str]) -> None:
        self._solver = solver
        self._pressure = pressure
        self._loads = loads
        self._names = tuple(names)
        self._order = np.argsort(np.sum(pressure, axis=1), kind="stable")
        self._wall: Wall | None = None
        self._known: dict[int, Blocked] = {}
        self._failures: tuple[Failure, ...] = ()

    def evaluate(self, constants: Mapping[str, float], lengths: Array, slopes: Array, anew: bool = False) -> Prediction:
        """Return the forces (rows, 1) [N] and their derivatives.

        lengths : (rows, N) free chamber lengths [m]; slopes : (rows, N, constants) their derivatives.
        """
        solver = _blocked_at(self._solver, constants)
        if self._wall is None:
            self._wall = standing_wall(solver.poses, solver.contact, self._pressure, self._loads)
        if anew or self._failures or not self._moved(solver, lengths):
            self._follow(solver, self._wall)
        rows, n = len(self._pressure), len(self._names)
        forces, by_constant = np.zeros((rows, 1)), np.zeros((rows, 1, n))
        for failure in self._failures:
            forces[failure.row], by_constant[failure.row] = np.nan, np.nan
        for row, found in self._known.items():
            forces[row] = found.grid.problem.outputs(x=found.solution.x, p=found.solution.p)["tip_forces"][0]
            by_constant[row] = self._slopes(found, slopes[row])
        return Prediction(forces, by_constant, self._failures)

    def _follow(self, solver: BlockedSolver, wall: Wall) -> None:
        """Follow every force from zero pressure."""
        pressed = ((int(row), self._pressure[row]) for row in self._order)
        self._known, self._failures = _followed(pressed, lambda P, near: solver.solve(P, self._loads, wall, near))

    def _moved(self, solver: BlockedSolver, lengths: Array) -> bool:
        """Solve every known blocked shape at other constants; whether all are still there, and near."""
        pressed = {int(row) for row in np.flatnonzero(np.any(self._pressure > 0, axis=1))}
        if not pressed <= set(self._known):
            return False  # not solved yet, or a shape that did not touch the wall may do so now
        moved = {}
        for row, found in self._known.items():
            grid = found.grid
            p = grid.problem.pack(solver.values(found.situation, found.pressed, lengths[row]))
            solution = grid.engine.solve(p, found.solution.x)
            near = solution.holds(solver.numerics.tolerance) and bool(
                grid.distance(solution.x - found.solution.x) < _LARGEST_JUMP
            )
            if not near or grid.tip_forces(solution.x)[0] < 0:
                return False
            plane = solver.plane(found.situation)
            if grid.determinants(solution, plane)[0] * grid.determinants(found.solution, plane)[0] <= 0:
                return False
            moved[row] = replace(found, solution=solution)
        self._known = moved
        return True

    def _slopes(self, found: Blocked, slopes: Array) -> Array:
        """Return the derivatives of the force of a blocked shape, whose free chamber lengths move by these."""
        problem, solution, transcription = found.grid.problem, found.solution, self._solver.numerics.transcription
        own = [name for name in self._names if name in {q.name for q in problem.fixed}]
        linear = found.grid.judge if transcription == "multiple-shooting" else None
        key = ("force", transcription, found.grid.intervals, *own)
        derivatives = self._solver.equations.kept(
            key, lambda: ImplicitDerivatives(problem, [*own, "contact.free_lengths"], linear)
        )
        moved = derivatives.outputs(solution.x, solution.p)["tip_forces"][0]
        by_name: Array = _by_name(moved[: len(own)], own, self._names) + moved[len(own) :] @ slopes
        return by_name


def _blocked_at(solver: BlockedSolver, constants: Mapping[str, float]) -> BlockedSolver:
    """Return a blocked solver at other values of constants [SI], sharing all that is compiled."""
    other, coefficients = copy(solver), solver.model.coefficients
    other.poses = solver.poses.with_values(constants)
    reaction = constants.get("contact.chamber_reaction", coefficients.chamber_reaction)
    other.model = replace(solver.model, coefficients=replace(coefficients, chamber_reaction=reaction))
    return other


def _followed(
    rows: Iterable[tuple[int, Array]], solve: Callable[[Array, Any], tuple[Step, Found | None]]
) -> tuple[dict[int, Found], tuple[Failure, ...]]:
    """Solve rows in order, each from the last that was found; return what was found, and those without a solution."""
    known: dict[int, Found] = {}
    failures = []
    near: Found | None = None
    for row, P in rows:
        step, found = solve(P, near)
        near = found or near
        if found is not None:
            known[row] = found
        elif not step.status.has_solution:
            failures.append(Failure(row, step.status, step.message))
    return known, tuple(failures)


def _by_name(slopes: Array, own: Sequence[str], names: Sequence[str]) -> Array:
    """Return derivatives (..., own) in the order of all names; 0 by those that are not among one's own."""
    every = np.zeros((*slopes.shape[:-1], len(names)))
    every[..., [list(names).index(name) for name in own]] = slopes
    return every


class Predicted:
    """Everything measured of one robot, as the model predicts it.

    clocked : whether the clock of a registration turns the loads; the slopes by it then come last.
    """

    def __init__(
        self,
        data: Data,
        poses: PoseSolver,
        blocked: BlockedSolver | None,
        free: FreeConstants,
        loads: Loads,
        clocked: bool = False,
    ) -> None:
        self._data = data
        self._solver, self._loads, self._clocked = poses, loads, clocked
        names = (*free.quantities, CLOCK) if clocked else free.quantities
        self._poses: FreePoses = (
            LoadedPoses(poses, data.pressure, loads, names)
            if loads.act
            else ArcPoses(poses, data.pressure, free.quantities)
        )
        self._rows = np.flatnonzero(data.measured[:, -1])
        self._forces: BlockedForces | None = None
        if self._rows.size and blocked is not None:
            self._forces = BlockedForces(blocked, data.pressure[self._rows], loads, free.quantities)

    def fit(self, constants: Mapping[str, float], row: int) -> Fit | None:
        """Return how the free shape of a row suits a body, None where it has none."""
        loads = turned(self._loads, -constants[CLOCK]) if self._clocked else self._loads
        pose = self._solver.with_values(constants).solve(self._data.pressure[row], loads)[0].pose
        return None if pose is None else pose.fit

    def tips(self, constants: Mapping[str, float], pressure: Array, loads: Loads) -> tuple[Array, Array]:
        """Return `free_tips` at other pressures (rows, sets) [Pa] and loads."""
        return free_tips(self._solver.with_values(constants), loads, pressure)

    def evaluate(self, constants: Mapping[str, float], anew: bool) -> Prediction:
        """Return the values in the order of `COLUMNS`, and their derivatives."""
        poses = self._poses.evaluate(constants, anew)
        k, n = len(POSE_COLUMNS), poses.slopes.shape[-1]
        rows = len(self._data.pressure)
        values, slopes = np.full((rows, len(COLUMNS)), np.nan), np.full((rows, len(COLUMNS), n), np.nan)
        values[:, :k], slopes[:, :k] = poses.values[:, :k], poses.slopes[:, :k]
        failures = poses.failures
        if self._forces is not None and not failures:
            r = self._rows
            forces = self._forces.evaluate(constants, poses.values[r, k:], poses.slopes[r, k:], anew)
            values[r, k:], slopes[r, k:] = forces.values, forces.slopes
            failures = tuple(Failure(int(r[f.row]), f.status, f.message) for f in forces.failures)
        return Prediction(values, slopes, failures, poses.turns, poses.turn_slopes)
