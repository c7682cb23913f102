"""How far a robot is from obstacles that it does not touch: at the nodes of a case, and along a solved pose.

The gap at a point of the axis is the obstacle's signed distance less the outer radius, as the section is stretched
there; see `softnlp.statics.obstructed`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.quantity import Quantity
from softnlp.model.model import Model
from softnlp.model.obstacles import Obstacle
from softnlp.model.quantities import quantities
from softnlp.model.robot import Robot
from softnlp.model.rod import STATE_SIZE
from softnlp.model.section import unit_scale
from softnlp.model.segments import SegmentedRobot, body_of
from softnlp.statics.body import finer
from softnlp.statics.chain import Chain
from softnlp.statics.loadcase import LoadCase
from softnlp.statics.obstructed import outer_radii, touching
from softnlp.statics.step import Pose

Array = NDArray[np.float64]

_PARTS = 6  # of the axis between two points of a shape, where gaps are looked at
_REST = 400  # points of each segment of the unpressurised robot


@dataclass(frozen=True, eq=False)
class NodeGaps:
    """The gaps at the nodes of a case but the first, which is held.

    gaps : a row for each node and obstacle, in lengths of the robot. arc : (rows,) where along the whole robot, 0 to 1.
    obstacle : (rows,) which, from 0.
    """

    gaps: ca.MX
    arc: Array
    obstacle: NDArray[np.intp]


def require_whole_body(obstacles: Sequence[Obstacle]) -> None:
    """Raise `InputError` for an obstacle that is none of the whole body."""
    for k, obstacle in enumerate(obstacles):
        if obstacle.part != "body":
            problem = f"a clearance is one of the whole body; expected 'body', got {obstacle.part!r}"
            raise InputError(problem, table=f"obstacle.{k + 1}", key="part")


def node_gaps(
    case: LoadCase | Chain, model: Model, obstacles: Sequence[Obstacle], given: Sequence[Quantity]
) -> NodeGaps:
    """Return the gaps of a case of a model. given : of `softnlp.statics.obstructed.numbers_of`, the obstacles first.

    Raises
    ------
    InputError
        For a section that varies along the robot.
    """
    of = _gap(obstacles)
    rows, arcs = list[ca.MX](), list[Array]()
    for states, arc, unit, radius in _rods(case, model):
        numbers = ca.vertcat(
            *(
                given[j].symbol / ca.vertcat(*(unit_scale(u, unit, 1.0) for u in obstacle.units))
                for j, obstacle in enumerate(obstacles)
            )
        )
        found = of.map(states.shape[1])(states, radius, numbers)
        rows.append(ca.vec(found) * unit / case.whole_length)
        arcs.append(arc)
    every = np.concatenate(arcs)
    count = len(obstacles)
    return NodeGaps(ca.vertcat(*rows), np.repeat(every, count), np.tile(np.arange(count), every.size))


def _rods(case: LoadCase | Chain, model: Model) -> list[tuple[ca.MX, Array, ca.MX, ca.MX]]:
    """Return of each rod its node states behind the first, where they are, the unit of length and the outer radius."""
    if isinstance(case, LoadCase):
        K = case.transcribed.node_index.size - 1
        values = {key: q.symbol for key, q in case.given.items()}
        radius = _radius(case.functions.model, values, case.symbols[0])
        nodes = case.transcribed.nodes[:STATE_SIZE, 1:]
        return [(nodes, np.arange(1, K + 1) / K, case.length_unit, radius)]
    body, found = case.body, list[tuple[ca.MX, Array, ca.MX, ca.MX]]()
    if body.varying:
        raise InputError("a clearance takes no section that varies along the robot so far", table="obstacle")
    segments = body_of(model).segments
    lengths, rigid = [float(one.robot.length) for one in segments], [float(one.connector) for one in segments]
    whole, before = sum(lengths) + sum(rigid), 0.0
    values = {key: q.symbol for key, q in case.given.items()}
    for k, part in enumerate(case.parts):
        K = part.transcribed.node_index.size - 1
        nodes, arc = part.transcribed.nodes[:STATE_SIZE, 1:], before + lengths[k] * np.arange(1, K + 1) / K
        if body.connected[k]:
            last = nodes[:, -1]
            offset = values[body.connector_key(k)] / part.length_unit * last[9:12]
            nodes = ca.horzcat(nodes, ca.vertcat(last[:3] + offset, last[3:]))
            arc = np.append(arc, arc[-1] + rigid[k])
        radius = _radius(body.models[k], {**values, **body.of_segment(k, values)}, part.stretch)
        found.append((nodes, arc / whole, part.length_unit, radius))
        before += lengths[k] + rigid[k]
    return found


def _radius(model: Model, values: Mapping[str, Any], stretch: ca.MX) -> ca.MX:
    """Return the outer radius as it is stretched, over the length of the segment."""
    radius: ca.MX = outer_radii(model)(ca.vertcat(*(values[key] for key in quantities(model))), stretch)[0]
    return radius


def _gap(obstacles: Sequence[Obstacle]) -> ca.Function:
    """Return (state, radius, numbers) -> the gap of each obstacle, in the unit of the state."""
    pushed = touching(obstacles).pushed
    count = len(obstacles)
    x, radius, numbers = ca.SX.sym("x", STATE_SIZE), ca.SX.sym("r"), ca.SX.sym("numbers", pushed.size1_in(3))
    gaps = pushed(x, ca.SX.zeros(count), ca.repmat(radius, count, 1), numbers)[1]
    return ca.Function("gaps", [x, radius, numbers], [gaps], {"cse": True})


class BodyGaps:
    """The gaps along solved poses, on points between those of the shape. length : of the robot, the unit within [m]."""

    def __init__(self, obstacles: Sequence[Obstacle], length: float) -> None:
        self._length = length
        self._function = _gap(obstacles)
        self._numbers = np.concatenate(
            [np.asarray(o.numbers) / [unit_scale(u, length, 1.0) for u in o.units] for o in obstacles]
        )

    def at(self, pose: Pose) -> tuple[Array, Array]:
        """Return points along the robot (M,), 0 to 1, and the gap of each obstacle there (obstacles, M) [m]."""
        shape = pose.shape
        wide = pose.radii if pose.outline is None else pose.outline
        radius = np.broadcast_to(np.asarray(wide.outer, float), shape.arc.shape)
        p, axis, _, r = finer(shape.position[None], shape.rotation[None, :, :, 2], radius[None], _PARTS)
        places = np.arange(shape.arc.size)
        arc = np.interp(np.arange(p.shape[1]) / _PARTS, places, shape.arc)
        return arc, self._gaps(p[0], axis[0], r[0])

    def at_rest(self, robot: Robot) -> Array:
        """Return the least gap of each obstacle to the robot without pressure and loads (obstacles,) [m]."""
        z, radius, before = list[Array](), list[Array](), 0.0
        for length, own in _straight(robot):
            z.append(np.linspace(before, before + length, _REST))
            radius.append(np.full(_REST, own))
            before += length
        place = np.concatenate(z)[:, None] * np.array([0.0, 0.0, 1.0])
        found: Array = self._gaps(place, np.tile([0.0, 0.0, 1.0], (len(place), 1)), np.concatenate(radius)).min(axis=1)
        return found

    def at_base(self, robot: Robot) -> Array:
        """Return the gap of each obstacle to the base without pressure (obstacles,) [m]."""
        _, own = _straight(robot)[0]
        return self._gaps(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.array([own]))[:, 0]

    def _gaps(self, p: Array, axis: Array, radius: Array) -> Array:
        """Return the gaps (obstacles, M) at points (M, 3) of an axis of direction (M, 3) and radius (M,) [m]."""
        states = np.zeros((STATE_SIZE, len(p)))
        states[:3], states[9:12] = p.T / self._length, axis.T
        gaps = self._function.map(len(p))(states, radius[None, :] / self._length, self._numbers)
        return np.asarray(gaps) * self._length


def _straight(robot: Robot) -> list[tuple[float, float]]:
    """Return the length of each segment with its connector, and its outer radius, without pressure [m]."""
    if not isinstance(robot, SegmentedRobot):
        return [(float(robot.length), float(robot.outer_diameter) / 2)]
    return [
        (float(one.robot.length) + float(one.connector), float(one.robot.outer_diameter) / 2) for one in robot.segments
    ]


def beside_nodes(gaps: NodeGaps, arc: Array, closer: Array) -> Array:
    """Return by how much the body is closer than it may be beside each node, 0 where it is not (rows,).

    arc : (M,). closer : (obstacles, M) there. Beside a node are the two intervals that meet in it.
    """
    found = np.zeros(gaps.arc.size)
    for j in range(len(closer)):
        own = gaps.obstacle == j
        worst = np.maximum(-least_between(gaps.arc[own], arc, -closer[j]), 0.0)
        found[own] = np.maximum(worst[:-1], worst[1:])
    return found


def least_between(nodes: Array, arc: Array, values: Array) -> Array:
    """Return the least of values (M,) at points arc (M,) in each interval that ends at a node, and behind the last one.

    nodes : (K,) rising. The result has K + 1 entries, inf where no point is.
    """
    found = np.full(nodes.size + 1, np.inf)
    np.minimum.at(found, np.searchsorted(nodes, arc - 1e-12), values)
    return found
