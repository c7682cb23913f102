"""One design at one pressure, in numbers: its outputs, and which requirements and rules of manufacture it misses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import ONE, Output
from softnlp.base.errors import RobotError
from softnlp.base.status import Status
from softnlp.model.quantities import Model
from softnlp.model.robot import SELF_INTERSECTION, Robot, touching_stretch, violations
from softnlp.model.rules import neighbours
from softnlp.statics.arc import Arc, unloaded_arc
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.pose_grid import Solved
from softnlp.statics.step import Pose, Step
from softnlp.statics.wall import Situation, Wall, standing_wall
from softnlp.studies.design_task import OUTPUTS, DesignTask, Limits, Setting

Array = NDArray[np.float64]

FEASIBLE = 1e-5
"""A requirement counts as met where it is missed by no more than this part of its limit."""

_TINY = 1e-24  # [m^2] under the root of the tip's deflection, whose slope has a limit nowhere at 0


def robot_outputs(robot: Robot) -> dict[str, Any]:
    """Return the outputs of kind "robot", SI; numbers or symbols as the dimensions are."""
    outer, inner = robot.side_walls
    walls = {"outer_wall": outer, "inner_wall": inner, "wall": robot.chamber_wall + robot.outer_wall}
    names = [output.name for output in OUTPUTS.values() if output.group == "robot" and output.name not in walls]
    return {name: getattr(robot, name) for name in names} | walls


def free_outputs(case: Mapping[str, Any], length: Any) -> dict[str, Any]:
    """Return the outputs of kind "free", SI, from those of a load case (numbers or symbols) and L_0."""
    x, y, z = (case["tip_position"][k] for k in range(3))
    return {
        "bending_angle": case["bending_angle"],
        "stretch": case["stretch"],
        "elongation": case["backbone_length"] - length,
        "tip_x": x,
        "tip_y": y,
        "tip_z": z,
        "tip_deflection": (x**2 + y**2 + _TINY) ** 0.5,
    }


def chamber_gaps(robot: Robot, stretch: Any) -> list[Any]:
    """Return the gaps between neighbouring reinforced chambers at a stretch [m], as `softnlp.model.rules.neighbours`.

    The circle shrinks as lambda^-1/2 (S2), r_co stays.
    """
    return [chord * stretch**-0.5 - 2 * robot.chamber_radius for chord, _, _ in neighbours(robot)]


def shape_outputs(robot: Robot, shape: Pose | Arc) -> dict[str, float]:
    """Return the outputs of kind "free" of a solved shape, with the smallest gap between neighbouring chambers.

    The gap is between reinforced chambers, at the shape's stretch [m]; inf for a single chamber.
    """
    case = {key: getattr(shape, key) for key in ("bending_angle", "stretch", "backbone_length", "tip_position")}
    outputs = {name: float(value) for name, value in free_outputs(case, float(robot.length)).items()}
    gap = 2 * float(robot.chamber_radius) * (float(np.sqrt(touching_stretch(robot) / shape.stretch)) - 1)
    return {**outputs, "chamber_gap": gap}


def shown(output: Output, value: float) -> str:
    """Return a value in the unit of files."""
    unit = "" if output.unit is ONE else f" {output.unit}"
    return f"{value / output.scale:.5g}{unit}"


def missed(outputs: Mapping[str, float], requirements: Mapping[str, Limits]) -> Iterator[tuple[str, str, float]]:
    """Yield, for each requirement that known outputs miss: its name, in words, and by which part of its limit."""
    for name, limits in requirements.items():
        if name not in outputs:
            continue
        output, value = OUTPUTS[name], outputs[name]
        for limit, off, words in (
            (limits.lower, limits.lower - value, "least"),
            (limits.upper, value - limits.upper, "most"),
        ):
            size = max(abs(limit), 1e-3 * output.scale) if np.isfinite(limit) else np.inf
            if not off <= FEASIBLE * size:
                said = f"{output.key}: {shown(output, value)}, at {words} {shown(output, limit)} wanted"
                yield name, said, off / size


def broken_rules(robot: Robot, task: DesignTask) -> list[str]:
    """Return the rules of manufacture and the requirements on dimensions that a robot of numbers breaks."""
    try:
        found = violations(robot, task.minimum_wall, task.walls)
    except RobotError as error:
        return [str(error)]
    rules = [f"{v.rule}: {v.message}" for v in found if not (v.lowerable and v.rule in task.allow)]
    return rules + [words for _, words, _ in missed(robot_outputs(robot), task.requirements)]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A design at one pressure [Pa].

    outputs : every known output by name, SI; none where there is no solution. step : of the free or the blocked shape.
    free, blocked : the solutions, where there are some. wall : where the blocked shape was pressed.
    """

    model: Model
    pressure: float
    status: Status
    message: str
    outputs: Mapping[str, float]
    step: Step | None = None
    free: Solved | None = None
    blocked: Blocked | None = None
    wall: Wall | None = None


class Evaluator:
    """Evaluates designs of one structure (chambers, law); what is compiled is kept between them.

    model : any of that structure.
    """

    def __init__(self, setting: Setting, task: DesignTask, model: Model) -> None:
        self.setting = setting
        self.task = task
        self.direction = np.zeros(model.robot.chamber_sets)
        self.direction[list(task.sets)] = 1.0
        numerics = setting.numerics
        self.solver = blocked_solver(model, numerics, setting.contact) if task.needs_force else None
        self.poses = self.solver.poses if self.solver else pose_solver(model, numerics)

    def free(self, model: Model, pressure: float) -> Evaluation:
        """Return the free shape at a pressure [Pa]: in closed form without loads, else solved."""
        P = pressure * self.direction
        poses = self.poses.with_model(model)
        known = {**robot_outputs(model.robot), "pressure": pressure}
        if self.setting.loads.act:
            step, solved = poses.solve(P, self.setting.loads)
            return self._of_pose(model, pressure, known, step, step.pose, solved)
        branch, arc = unloaded_arc(poses, P)
        if branch.status is not Status.SOLVED:
            return Evaluation(model, pressure, branch.status, branch.message, {})
        return Evaluation(model, pressure, Status.SOLVED, branch.message, {**known, **shape_outputs(model.robot, arc)})

    def full(self, model: Model, pressure: float) -> Evaluation:
        """Return everything that the task asks of a design at a pressure [Pa], to the accuracy of the setting."""
        P, loads = pressure * self.direction, self.setting.loads
        known = {**robot_outputs(model.robot), "pressure": pressure}
        if self.solver is None:
            step, free = self.poses.with_model(model).solve(P, loads)
            return self._of_pose(model, pressure, known, step, step.pose, free)
        solver = self.solver.with_model(model)
        wall = standing_wall(solver.poses, self.setting.contact, P[None, :], loads)
        step, blocked = solver.solve(P, loads, wall)
        if step.contact is None:
            return Evaluation(model, pressure, step.status, step.message, {}, step, wall=wall)
        known["blocked_force"] = step.contact.force
        free = blocked.free.solved if blocked else None
        found = self._of_pose(model, pressure, known, step, step.contact.free, free)
        return replace(found, blocked=blocked, wall=wall)

    def values(self, found: Evaluation) -> dict[str, Any]:
        """Return every quantity of a solved design by name, SI."""
        if self.solver is None:
            return self.poses.with_model(found.model).values(found.pressure * self.direction, self.setting.loads)
        pressed = np.array([float(k in self.task.sets) for k in found.model.robot.set_of_chamber])
        solver = self.solver.with_model(found.model)
        return solver.values(self._situation(found), pressed * (found.pressure > 0), np.zeros(0))

    def plane(self, found: Evaluation) -> Array | None:
        """Return the normal of the plane that the blocked shape of a design keeps to, if it keeps to one."""
        return self.solver.with_model(found.model).plane(self._situation(found)) if self.solver else None

    def _situation(self, found: Evaluation) -> Situation:
        return Situation(found.pressure * self.direction, self.setting.loads, found.wall)

    def _of_pose(
        self, model: Model, pressure: float, known: dict[str, float], step: Step, pose: Pose | None, free: Solved | None
    ) -> Evaluation:
        if pose is None:
            return Evaluation(model, pressure, step.status, step.message, {}, step)
        outputs = {**known, **shape_outputs(model.robot, pose)}
        return Evaluation(model, pressure, step.status, step.message, outputs, step, free)


def unmet(found: Evaluation, task: DesignTask) -> list[str]:
    """Return why a design at a pressure is not feasible, in words; nothing where it is."""
    if not found.outputs:
        return [f"{found.status.value}: {found.message}"]
    reasons = [words for _, words, _ in missed(found.outputs, task.requirements)]
    contact = found.step and found.step.contact
    free = found.step and (contact.free if contact else found.step.pose)
    if free and free.stable is False:
        reasons.append("the free shape is not stable: it buckles under its load")
    shapes = {"free": free, "blocked": found.step.pose if found.step and contact else None}
    for name, pose in shapes.items():
        if pose and pose.fit.self_intersecting and SELF_INTERSECTION not in task.allow:
            reasons.append(f"{SELF_INTERSECTION} of the {name} shape: {pose.fit.warnings[-1]}")
    return reasons
