"""A solved pose or blocked pose with the derivatives of its outputs by quantities: what `sensitivity` is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import DEG, OUTPUTS
from softnlp.base.errors import InputError, nearest
from softnlp.base.quantity import Quantity
from softnlp.model.quantities import differentiable
from softnlp.model.section import RodSection
from softnlp.nlp.implicit import ImplicitDerivatives
from softnlp.nlp.problem import CompiledProblem
from softnlp.nlp.solver import Engine, Solution
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.joint import joint_solution
from softnlp.statics.pose_grid import Solved
from softnlp.statics.solver import PoseSolver

Array = NDArray[np.float64]

UNITS: Mapping[str, str] = {
    "tip_position": OUTPUTS["tip_position"].unit.si,
    "tip_rotation": DEG.si,
    **{name: OUTPUTS[name].unit.si for name in ("bending_angle", "backbone_length", "elongation", "stretch")},
    "chamber_lengths": OUTPUTS["chamber_length"].unit.si,
    "blocked_force": OUTPUTS["blocked_force"].unit.si,
}
"""Every output that has derivatives, and its unit. `tip_rotation` is a rotation vector in the world frame,
`elongation` the backbone's length less the robot's; `blocked_force` needs a wall."""

_CONTACT = ("contact.wall_point", "contact.tip_cap", "contact.chamber_reaction")
_AXES = ("x", "y", "z")
_BY_AXIS = ("tip_position", "tip_rotation", "tip_force", "tip_moment", "gravity", "contact.wall_point")


def rotation_vector(R: Array) -> Array:
    """Return the rotation vector (3,) of a rotation matrix [rad]; its norm is at most pi."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(R).as_rotvec(), dtype=float)


def labels(name: str, size: int) -> list[str]:
    """Return a name for each entry: "tip_position.x", "pressure.1" (counted from 1), "bending_angle"."""
    if name in _BY_AXIS:
        return [f"{name}.{axis}" for axis in _AXES]
    several = size > 1 or name in ("pressure", "chamber_lengths")
    return [f"{name}.{k + 1}" for k in range(size)] if several else [name]


def entries_of(names: Sequence[str], wanted: str) -> list[int]:
    """Return where a name is among `labels`, or all entries of the vector that it names."""
    parts = [name.rpartition(".") for name in names]
    return [
        k
        for k, (stem, _, last) in enumerate(parts)
        if names[k] == wanted or (stem == wanted and (last in _AXES or last.isdigit()))
    ]


def quantities_of(solver: PoseSolver | BlockedSolver) -> dict[str, Quantity]:
    """Return what outputs can be differentiated by, by name: the model's quantities, and the wall's where there is."""
    own = differentiable(solver.model)
    if isinstance(solver, PoseSolver):
        return {k: q for k, q in solver.quantities.items() if k in own}
    declared = solver.functions.declared(solver.model)
    return {k: q for k, q in declared.items() if k in own or k in _CONTACT}


def checked_names(names: Sequence[str], known: Sequence[str], key: str) -> tuple[str, ...]:
    """Return names without repetition, or raise `InputError` for one that is not known, or for none."""
    if isinstance(names, str):
        names = (names,)
    for name in names:
        if name not in known:
            raise InputError(f"unknown name {name!r}{nearest(str(name), known)}", key=key)
    if not names:
        raise InputError(f"expected at least one of {', '.join(known)}", key=key)
    return tuple(dict.fromkeys(names))


_STIFFNESSES = RodSection._fields.index("pressure_force")  # come first among the constants of a case


@dataclass(frozen=True, eq=False)
class LinearPoint:
    """A solution and how everything in it moves with chosen quantities.

    prefix : of the outputs' names in the problem. moves : d x / d theta. The entries of theta are `quantities`, one
    behind the other, SI.
    """

    engine: Engine
    solution: Solution
    derivatives: ImplicitDerivatives
    moves: Array
    prefix: str

    @property
    def problem(self) -> CompiledProblem:
        """The compiled problem."""
        return self.engine.problem

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The quantities by which was differentiated."""
        return self.derivatives.quantities

    @property
    def theta(self) -> Array:
        """The value of every entry of the quantities, SI."""
        values: Array = self.solution.p[self.derivatives.columns]
        return values

    def value(self, output: str) -> Array:
        """Return an output, flat, SI; the rotation as the rotation vector of the tip's orientation."""
        if output == "tip_rotation":
            return rotation_vector(_rotation(self._here))
        return self._here[output]

    def derivative(self, output: str) -> Array:
        """Return d output / d theta (size, k); of the rotation, the rotation vector in the world frame."""
        if output == "tip_rotation":
            return spin(self._slopes["tip_rotation"], _rotation(self._here))
        return self._slopes[output]

    @property
    def rotation(self) -> tuple[Array, Array]:
        """The tip's rotation matrix by columns (9,), and d / d theta (9, k)."""
        return self._here["tip_rotation"], self._slopes["tip_rotation"]

    def solved_at(self, theta: Array) -> Solution:
        """Solve again with other values of the quantities, from the first-order prediction."""
        p = self.solution.p.copy()
        p[self.derivatives.columns] = theta
        return self.engine.solve(p, self.solution.x + self.moves @ (theta - self.theta))

    def is_solution(self, other: Solution, tolerance: float) -> bool:
        """Whether the equations hold at another point and no stiffness has lost its sign there."""
        constants = np.asarray(self.problem.case_constants(other.x, other.p)).reshape(len(self.problem.cases), -1)
        stiffnesses = constants[:, :_STIFFNESSES]
        return other.holds(tolerance) and bool(np.all(stiffnesses > 0))

    def change(self, output: str, other: Solution) -> Array:
        """Return how an output differs at another solution; of the rotation, the rotation vector from here to there."""
        there = self._outputs(other)
        if output == "tip_rotation":
            return rotation_vector(_rotation(there) @ _rotation(self._here).T)
        return there[output] - self._here[output]

    @cached_property
    def _here(self) -> dict[str, Array]:
        return self._outputs(self.solution)

    @cached_property
    def _slopes(self) -> dict[str, Array]:
        by_length = [np.full(q.size, 1.0 if q.name == "robot.length" else 0.0) for q in self.quantities]
        raw = self.derivatives.outputs(self.solution.x, self.solution.p, self.moves)
        return self._named(raw, np.concatenate(by_length) if by_length else np.zeros(0))

    def _outputs(self, solution: Solution) -> dict[str, Array]:
        """Return every output at a solution, flat, SI."""
        raw = self.problem.outputs(x=solution.x, p=solution.p)
        names = [q.name for q in self.problem.fixed]
        start = sum(q.size for q in self.problem.fixed[: names.index("robot.length")])
        flat = {name: np.asarray(value).ravel(order="F") for name, value in raw.items()}
        return self._named(flat, solution.p[start])

    def _named(self, raw: Mapping[str, Array], length: Any) -> dict[str, Array]:
        """Return outputs of the problem, or their derivatives, by the names of `UNITS`; length : that of the robot."""
        found = {name.removeprefix(self.prefix): v for name, v in raw.items() if name.startswith(self.prefix)}
        found["elongation"] = found["backbone_length"] - length
        if "tip_forces" in found:
            found["blocked_force"] = found["tip_forces"][:1]
        return found


def _rotation(outputs: Mapping[str, Array]) -> Array:
    return outputs["tip_rotation"].reshape(3, 3, order="F")


def spin(dR: Array, R: Array) -> Array:
    """Return the rotation vectors (3, k), world frame, of changes (9, k) of a matrix given column by column."""
    W = np.einsum("ijk,lj->ilk", dR.reshape(3, 3, -1, order="F"), R)
    omega: Array = np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2
    return omega


class PoseDerivatives:
    """Derivatives of the poses that a solver finds; what is compiled is kept for each grid and choice of quantities."""

    def __init__(self, poses: PoseSolver) -> None:
        self.poses = poses

    def on_grid(self, intervals: int, names: tuple[str, ...]) -> ImplicitDerivatives:
        """Return the derivatives by quantities on a grid, compiled at first use."""
        grid = self.poses.grid(intervals)
        key = ("derivatives", self.poses.numerics.transcription, intervals, names)
        return self.poses.equations.kept(key, lambda: ImplicitDerivatives(grid.problem, names, grid.engine.linear))

    def at(self, solved: Solved, names: Sequence[str]) -> LinearPoint:
        """Return a solved pose with its derivatives by the named quantities.

        Raises `numpy.linalg.LinAlgError` at a fold or a branch point.
        """
        derivatives = self.on_grid(solved.intervals, tuple(dict.fromkeys(names)))
        moves = derivatives.states(solved.solution.x, solved.solution.p)
        return LinearPoint(solved.grid.engine, solved.solution, derivatives, moves, "")


def blocked_point(solver: BlockedSolver, found: Blocked, names: Sequence[str]) -> LinearPoint | None:
    """Return a blocked pose with its derivatives, the free shape's chamber lengths moving along; None if not found.

    Free and blocked shape are one problem here, solved once more together. Raises as `PoseDerivatives.at`.
    """
    engine, solution, start = joint_solution(solver, found, {}, free_pressure=False)
    # The blocked shape took its free lengths from the closed form or from another grid: nearly the same ones.
    if not solution.holds(solver.numerics.tolerance) or float(np.max(np.abs(solution.x - start))) > 1e-2:
        return None
    chosen = tuple(dict.fromkeys(names))
    key = ("derivatives", solver.numerics.transcription, found.grid.intervals, chosen)
    derivatives = solver.equations.kept(key, lambda: ImplicitDerivatives(engine.problem, chosen))
    return LinearPoint(engine, solution, derivatives, derivatives.states(solution.x, solution.p), "blocked_")


def is_straight(point: LinearPoint) -> bool:
    """Whether a pose is straight, so that its bending angle has a kink there and no derivative."""
    return float(point.value("bending_angle")[0]) < 1e-9
