"""From a solution of a chain to a step in SI units: its shape, its outline along it, each segment by itself."""

from __future__ import annotations

import time
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.body import Body
from softnlp.model.model import Model
from softnlp.model.numerics import Numerics
from softnlp.model.rod import Loads
from softnlp.model.section import SectionRadii
from softnlp.nlp.solver import certificate, outputs
from softnlp.statics.chain_grid import ChainGrid, Piece
from softnlp.statics.pose import SHAPE_POINTS, bending_angle, between_nodes, shape_of, shape_warnings, stability
from softnlp.statics.pose_grid import Solved
from softnlp.statics.step import Pose, SegmentPose, Shape, Step

Array = NDArray[np.float64]

_FEWEST = 4  # points between two knots
_PER_STRETCH = ("arc", "position", "rotation", "force", "moment", "shear_extension", "curvature")


def chain_step(
    body: Body, numerics: Numerics, pressure: Array, loads: Loads, solved: Solved, iterations: int, began: float
) -> Step:
    """Return the step of a solved pose, as `softnlp.statics.pose_step.solved_step`."""
    grid, solution = solved.grid, solved.solution
    assert isinstance(grid, ChainGrid)
    pieces = grid.pieces(solved.nodes, solved.constants, solution)
    found, values = outputs(grid.problem, solution), grid.values(solution.p)
    shape, outline, numbers = _shape(body, pieces, grid.stretches(solution.x), values)
    bending = [0.0] * len(body.segments)
    for piece in pieces:
        bending[piece.part.segment] += _bending(piece)
    segments = tuple(
        SegmentPose(
            tip_position=found[f"segment.{k + 1}.tip_position"],
            tip_rotation=found[f"segment.{k + 1}.tip_rotation"],
            stretch=float(found[f"segment.{k + 1}.mean_stretch"][0]),
            bending_angle=bending[k],
        )
        for k in range(len(body.segments))
    )
    lengths = [grid_length(values, body, k) for k in range(len(body.segments))]
    tip, R = found["tip_position"], found["tip_rotation"]
    stable = stability(loads, solved.stable)
    pose = Pose(
        stretch=float(np.dot([s.stretch for s in segments], lengths) / np.sum(lengths)),
        stable=None if np.min(shape.shear_extension[:, 2]) <= 0 else stable,
        tip_position=tip,
        tip_displacement=tip - grid.unloaded(solution.p)[1][:3],
        tip_rotation=R,
        bending_angle=float(np.sum(bending)),
        tilt=float(np.arctan2(np.hypot(R[0, 2], R[1, 2]), R[2, 2])),
        backbone_length=float(found["backbone_length"][0]),
        chamber_length=np.atleast_1d(found["chamber_lengths"]),
        radii=SectionRadii(**{name: float(getattr(outline, name)[0]) for name in _RADII}),
        shape=shape,
        segments=segments,
        outline=outline,
        segment=numbers,
    )
    return Step(
        pressure=pressure,
        status=Status.SOLVED,
        message=Status.SOLVED.advice,
        pose=pose,
        residual=solution.residual,
        certificate=certificate(grid.problem, solution),
        discretisation_error=solved.error,
        intervals=solved.intervals,
        iterations=iterations,
        solve_time=time.perf_counter() - began,
        warnings=_warnings(body, pieces, grid.stretches(solution.x), pose, solved, numerics),
        engine=numerics.engine,
        ipopt=solution.ipopt,
    )


_RADII = tuple(SectionRadii.__dataclass_fields__)


def grid_length(values: dict[str, Array], body: Body, k: int) -> float:
    """Return the unpressurised length of a segment [m]."""
    return float(body.of_segment(k, values)["robot.length"][0])


def _bending(piece: Piece) -> float:
    """Return the bending angle of a part [rad]."""
    if piece.part.varies:
        share = piece.part.between[1] - piece.part.between[0]
        return bending_angle(piece.rod.varying.turning, piece.nodes, piece.constants, share)
    return bending_angle(piece.rod.shape, piece.nodes, piece.constants)


def _shape(
    body: Body, pieces: list[Piece], stretches: list[float], values: dict[str, Array]
) -> tuple[Shape, SectionRadii, Array]:
    """Return the shape at points of all segments and the end of a last connector, radii and segments there (M,)."""
    lengths = [grid_length(values, body, k) for k in range(len(body.segments))]
    connectors = [
        float(np.ravel(values[body.connector_key(k)])[0]) if body.connected[k] else 0.0 for k in range(len(lengths))
    ]
    whole, before = sum(lengths) + sum(connectors), 0.0
    shapes, radii, numbers = list[Shape](), list[dict[str, Array]](), list[int]()
    for k, own in groupby(zip(pieces, stretches, strict=True), key=lambda pair: pair[0].part.segment):
        model = body.models[k]
        for piece, stretch in own:
            a, b = piece.part.between
            points = max(_FEWEST, round((SHAPE_POINTS - 1) * (b - a) * lengths[k] / whole)) + 1
            s = np.linspace(0, 1, points)
            found = np.asarray(between_nodes(piece.shape, piece.nodes, piece.constants, s))
            shape = shape_of(found, (before + (a + s * (b - a)) * lengths[k]) / whole, piece.length, piece.force)
            shapes.append(shape)
            numbers += [k + 1] * points
            base, tip = (body.of_segment(k, values, end) for end in (a, b))
            there = found[30] if piece.part.varies else np.full(points, stretch)
            radii.append(_outline(model, base, tip, s, there))
        before += lengths[k] + connectors[k]
        if connectors[k] and k + 1 == len(lengths):
            shapes.append(_rigid_end(shapes[-1], piece, connectors[k]))
            radii.append({name: values[-1:] for name, values in radii[-1].items()})
            numbers.append(0)
    along: dict[str, Any] = {name: np.concatenate([some[name] for some in radii]) for name in _RADII}
    joined = Shape(**{name: np.concatenate([getattr(shape, name) for shape in shapes]) for name in _PER_STRETCH})
    return joined, SectionRadii(**along), np.array(numbers, dtype=float)


def _outline(model: Model, base: dict[str, Array], tip: dict[str, Array], s: Array, stretch: Array) -> dict[str, Array]:
    """Return the radii (M,) where a section is linear in s from one end of a part to the other. stretch : (M,)."""
    numbers = {key: base[key] + s * (tip[key] - base[key]) if base[key].size == 1 else base[key] for key in base}
    radii = model.section.outline(numbers, stretch)
    return {name: np.broadcast_to(np.asarray(getattr(radii, name), float), s.size) for name in _RADII}


def _rigid_end(shape: Shape, piece: Piece, connector: float) -> Shape:
    """Return the far end of the connector behind the last part, which no pressure is in."""
    offset = connector * shape.rotation[-1, :, 2]
    N = piece.nodes[12:15, -1] * piece.force
    M = piece.nodes[15:18, -1] * piece.force * piece.length - np.cross(offset, N)
    return Shape(
        arc=np.array([1.0]),
        position=shape.position[-1:] + offset,
        rotation=shape.rotation[-1:],
        force=N[None],
        moment=M[None],
        shear_extension=np.array([[0.0, 0.0, 1.0]]),
        curvature=np.zeros((1, 3)),
    )


def _warnings(
    body: Body, pieces: list[Piece], stretches: list[float], pose: Pose, solved: Solved, numerics: Numerics
) -> tuple[str, ...]:
    """Return what to know of a pose, of its segments by their numbers."""
    found = []
    for piece, stretch in zip(pieces, stretches, strict=True):
        k = piece.part.segment
        ends = [stretch, float(piece.nodes[18, -1])] if piece.part.varies else [stretch]
        found += [f"segment {k + 1}: {note}" for one in ends for note in body.models[k].section.warnings(one)]
    found += shape_warnings(pose)
    if solved.error > numerics.accuracy:
        found.append(
            f"estimated discretisation error {solved.error:.2g} of the length is above the accuracy asked for with "
            f'{solved.intervals} intervals; set [solver] intervals = "auto" or a larger number'
        )
    return tuple(dict.fromkeys(found))
