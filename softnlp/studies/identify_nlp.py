"""Identification as one NLP: every pose of every measurement an unknown, the constants shared, the misfit minimised.

It is the same problem as that of `softnlp.studies.identify`, which eliminates the poses; here IPOPT moves poses and
constants together. It closes what that search proposes: nothing but the rod is shared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.quantity import Quantity, quantity
from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import Conventions
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import LOADS, OF_ROBOT, Model
from softnlp.model.rod import Loads
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import FROM_SOLUTION, Engine, Solution
from softnlp.nlp.transcription import method_named
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.closing import DisputedError, close
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.loadcase import LoadCase, blocked_case, load_case
from softnlp.statics.pose_grid import Solved
from softnlp.statics.unloaded import unloaded_case
from softnlp.statics.wall import standing_wall
from softnlp.studies.identified import FreeConstants, Identified, constants_text, file_name
from softnlp.studies.measurements import COLUMNS, POSE_COLUMNS, RELATIVE_NOISE, Data, column_slice
from softnlp.studies.predicted import STRAIGHT
from softnlp.studies.registration import CLOCK, Registration, across, turned
from softnlp.studies.registration import NAMES as REGISTRATION_NAMES

Array = NDArray[np.float64]

MOST_RODS = 200
"""Loaded and blocked shapes that IPOPT takes as unknowns at once; half a second of each."""

TOLERANCE = 1e-10
_ANGLE = POSE_COLUMNS.index("bending_angle")  # which has no derivative where a shape is straight
_TURNS = range(*column_slice("orientation").indices(len(COLUMNS)))
_OF_ERROR = 1e-3  # of a constant's standard error: what IPOPT may move it by
_MISFITS = "misfits"  # residuals times the noise that is assumed, so that they are about as large as the equations


class AtOnce:
    """Load cases, values and first guesses, gathered measurement by measurement.

    loads : in the frame of the base, where a clock that is fitted turns them.
    """

    def __init__(
        self,
        free: FreeConstants,
        numerics: Numerics,
        registration: Registration | None = None,
        loads: Loads = Loads(),
    ) -> None:
        self.free = free
        self.numerics = numerics.without_ipopt()
        self.declared: dict[str, Quantity] = {}
        self.loads = loads
        self.clock: ca.MX | None = None  # which turns the loads, where it is fitted and they act across the axis
        self.sensor: Callable[[LoadCase], list[ca.MX]] | None = None
        self.turn: Callable[[LoadCase, Data, int], list[ca.MX]] | None = None
        if registration is not None:
            self.declared = {q.name: q for q in registration.quantities()}
            g = ca.vertcat(*(q.symbol for q in self.declared.values()))
            self.sensor = partial(_sensor, registration.function(), g)
            self.turn = partial(_turn, registration.orientation(), g)
            if CLOCK in self.declared and across(loads):
                self.clock = self.declared[CLOCK].symbol
        self.cases: list[LoadCase] = []
        self.values: dict[str, Array] = {}
        self.guesses: list[Array] = []
        self.misfits: list[ca.MX] = []

    def own(self, name: str, like: Quantity, value: Array | float) -> Quantity:
        """Return a quantity of one robot or measurement, with its value."""
        made = replace(like, name=name, symbol=ca.MX.sym(name, like.size))
        self.declared[name] = made
        self.values[name] = np.asarray(value, float)
        return made

    def add_robot(self, data: Data, model: Model, contact: ContactSettings, loads: Loads, label: str) -> None:
        """Add the load cases of everything measured of one robot."""
        poses = pose_solver(model, self.numerics)
        given = {}
        for name, q in poses.quantities.items():
            if name.startswith(OF_ROBOT):
                given[name] = self.own(f"{label}.{name}", q, q.nominal)
            else:  # shared by all robots
                given[name] = self.declared.setdefault(name, q)
        for name in ("tip_force", "tip_moment", "gravity"):
            self.values[name] = np.asarray(getattr(loads, name), float)
        has_force = bool(np.any(data.measured[:, -1]))
        blocked = blocked_solver(model, self.numerics, contact) if has_force else None
        wall = standing_wall(poses, blocked.contact, data.pressure, loads) if blocked else None
        near_free: Solved | None = None
        near: Blocked | None = None
        for row, P in enumerate(data.pressure):
            mask = data.measured[row]
            if not np.any(mask):
                continue
            here = f"{label}.{row}"
            step, near_free = poses.solve(P, loads, near_free)
            if near_free is None:
                raise InputError(f"measurement {row + 1}: no pose to start from: {step.message}", key="measurements")
            at = given | {"pressure": self.own(f"{here}.pressure", given["pressure"], P)}
            if loads.act:
                method = method_named(self.numerics.transcription, near_free.intervals)
                free = load_case(f"{here} free", poses.functions, at, method)
            else:
                free = unloaded_case(f"{here} free", poses.functions, at)
            self.cases.append(free)
            self.guesses.append(near_free.solution.x[: None if loads.act else 1])
            assert step.pose is not None
            columns = [k for k in range(len(POSE_COLUMNS)) if k != _ANGLE or step.pose.bending_angle >= STRAIGHT]
            observed = _pose_observables(free)
            if self.sensor is not None:
                observed[:3] = self.sensor(free)
            self._add_squares([observed[k] for k in columns], data, row, columns)
            if self.turn is not None:
                self._add_squares(self.turn(free, data, row), data, row, _TURNS)
            if not mask[-1]:
                continue
            assert wall is not None
            assert blocked is not None
            step, near = blocked.solve(P, loads, wall, near)
            if near is None:
                raise InputError(f"measurement {row + 1}: no blocked shape: {step.message}", key="measurements")
            contact_values = blocked.values(near.situation, near.pressed, np.zeros(0))
            for name, q in blocked.functions.declared(model).items():
                if name == "contact.chamber_reaction":
                    at[name] = self.declared.setdefault(name, q)
                elif name.startswith("contact.") and name != "contact.free_lengths":
                    at[name] = self.own(f"{here}.{name}", q, np.asarray(contact_values.get(name, q.nominal), float))
            method = method_named(self.numerics.transcription, near.grid.intervals)
            pressed = blocked_case(f"{here} blocked", blocked.functions, at, free, method)
            self.cases.append(pressed)
            self.guesses.append(near.solution.x)
            self._add_squares([pressed.outputs["tip_forces"][0]], data, row, [len(COLUMNS) - 1])

    def _add_squares(self, observed: Sequence[ca.MX], data: Data, row: int, columns: Sequence[int]) -> None:
        """Add the squared residuals of what was measured."""
        for value, column in zip(observed, columns, strict=True):
            if data.measured[row, column]:
                error = (value - data.values[row, column]) / data.sigma[row, column]
                self.misfits.append(RELATIVE_NOISE * data.root_weight[row] * error)

    def compiled(self) -> CompiledProblem:
        """Return the problem with the constants free."""
        declared = dict(self.declared)
        free = self.free
        for asked, name, lower, upper, scale in zip(
            free.names, free.quantities, free.lower, free.upper, free.scale, strict=True
        ):
            if name not in declared:
                raise InputError(f"no measurement depends on {asked!r}; fix it", key="free")
            declared[name] = replace(declared[name], lower=float(lower), upper=float(upper), scale=float(scale))
        # As unknowns of their own: the square of an angle, an integral along the rod, would couple all of its states.
        misfits = quantity(_MISFITS, "1", np.zeros(len(self.misfits)))
        given = [] if self.clock is None else [self._turned_with(declared[name], self.clock) for name in LOADS]
        given.append(Constraint(_MISFITS, ca.vertcat(*self.misfits) - misfits.symbol))
        return compile_problem(
            [*declared.values(), misfits],
            self.cases,
            free=[*free.quantities, *(() if self.clock is None else LOADS), _MISFITS],
            constraints=given,
            objective=ca.sumsqr(misfits.symbol) / 2,
        )

    def _turned_with(self, load: Quantity, clock: ca.MX) -> Constraint:
        """Return that a load of the sets' frame is that of the base's, which the clock turns the other way."""
        x, y, z = (float(v) for v in getattr(self.loads, load.name))
        c, s = ca.cos(clock), ca.sin(clock)
        return Constraint(f"turned {load.name}", load.symbol - ca.vertcat(c * x + s * y, c * y - s * x, z))

    def packed(self, problem: CompiledProblem) -> Array:
        """Return the fixed values of the compiled problem."""
        known = {q.name for q in problem.fixed}
        return problem.pack({name: value for name, value in self.values.items() if name in known})

    def start(self, problem: CompiledProblem, constants: Array) -> Array:
        """Return the first guess of the compiled problem."""
        values: dict[str, Any] = dict(self.free.values(constants))
        count = len(self.misfits)
        if self.clock is not None:
            values |= {name: self.values[name] for name in LOADS}
        x = np.concatenate([problem.pack_free(values), *self.guesses])
        rows = np.asarray(problem.residual(x, self.packed(problem))).ravel()[-count:]
        return np.concatenate([problem.pack_free({**values, _MISFITS: rows}), *self.guesses])


def _pose_observables(case: LoadCase) -> list[ca.MX]:
    out = case.outputs
    tip = out["tip_position"]
    return [tip[0], tip[1], tip[2], out["bending_angle"], out["backbone_length"] - case.length_unit]


def _sensor(function: ca.Function, g: ca.MX, case: LoadCase) -> list[ca.MX]:
    """Return the position of the sensor of a load case; g : numbers of the registration."""
    place = function(case.outputs["tip_position"], ca.vec(case.outputs["tip_rotation"]), g)[0]
    return [place[0], place[1], place[2]]


def _turn(function: ca.Function, g: ca.MX, case: LoadCase, data: Data, row: int) -> list[ca.MX]:
    """Return the turn of the sensor of a load case from the one measured in a row."""
    whole = float(np.nan_to_num(data.whole[row]))
    turn = function(ca.vec(case.outputs["tip_rotation"]), data.axes[row], whole, g)[0]
    return [turn[0], turn[1], turn[2]]


def closed_fit(
    found: Identified,
    contact: ContactSettings,
    loads: Loads,
    conventions: Conventions,
    numerics: Numerics,
    registration: Registration | None = None,
) -> Identified:
    """Return constants with IPOPT's word on them, or with a warning where there are too many rods for it.

    IPOPT starts at them, with all poses among its unknowns, each on the grid of its own. Numbers of a registration that
    the data leave open stay where the search left them, for any of them fits as well.

    Raises
    ------
    DisputedError
        Where it finds others: they differ by more than a thousandth of their standard error, and by more than the
        accuracy asked for, relative to themselves.
    """
    every = [_pressing(data, after) for data, after in zip(found.data, found.after, strict=True)]
    rods = sum(int(np.sum(d.measured[:, -1])) + loads.act * len(d.pressure) for d in every)
    if rods > MOST_RODS:
        note = f"IPOPT did not close the constants: {rods} rods would be its unknowns, and it takes at most {MOST_RODS}"
        return replace(found, engine=numerics.engine, warnings=(*found.warnings, note))
    errors = found.uncertainty.standard_errors
    settled = ~(np.isinf(errors) & np.array([name in REGISTRATION_NAMES for name in found.free.names]))
    free, x, errors = found.free.those(settled), found.constants[settled], errors[settled]
    nlp = AtOnce(free, numerics, registration, loads)
    nlp.values |= {name: np.asarray(value) for name, value in found.free.values(found.constants).items()}
    if nlp.clock is not None:
        loads = turned(loads, -found.free.values(found.constants)[CLOCK])
    for k, data in enumerate(every):
        model = Model(data.robot, found.material, found.coefficients, conventions)
        try:
            nlp.add_robot(data, model, contact, loads, f"robot {k + 1}")
        except InputError as error:
            raise DisputedError(f"{Status.DISPUTED.advice}; {error.message}") from None
    problem = nlp.compiled()
    engine = Engine(problem, tolerance=TOLERANCE, options={**FROM_SOLUTION, **dict(numerics.ipopt)})
    close_to = np.fmax(_OF_ERROR * errors, numerics.accuracy * np.maximum(np.abs(x), free.scale))

    def differs(solution: Solution) -> str:
        values = problem.free_values(solution.x)
        constants = np.concatenate([values[name] for name in free.quantities])
        if solution.holds(numerics.tolerance) and bool(np.all(np.abs(constants - x) <= close_to)):
            return ""
        keys = [file_name(name, found.material) for name in free.names]
        here, there = (constants_text(keys, values, ".6g") for values in (x, constants))
        return f"the search found {here} and IPOPT {there}"

    p, start = nlp.packed(problem), nlp.start(problem, x)
    solution = close(engine, Solution(start, p, 0.0, 0, ""), differs)
    return replace(found, engine=numerics.engine, ipopt=solution.ipopt)


def _pressing(data: Data, after: Array) -> Data:
    """Return measurements without the forces of shapes that do not press the wall: no constant moves those."""
    values = data.values.copy()
    values[after[:, -1] == 0, -1] = np.nan
    return replace(data, values=values)
