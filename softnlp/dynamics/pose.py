"""From an instant of a run in time to a step: its shape, each segment by itself, what moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.dynamics.grid import Grid
from softnlp.dynamics.rod import Placed, Rod, cross, matrices, rotated
from softnlp.dynamics.sections import Numbers
from softnlp.dynamics.simulation import Output, Simulation
from softnlp.model.section import SectionRadii
from softnlp.statics.pose import SHAPE_POINTS, shape_warnings
from softnlp.statics.step import Moving, Pose, SegmentPose, Shape, Step

Array = NDArray[np.float64]

_FEWEST = 5  # points of a segment
_FINE = np.polynomial.legendre.leggauss(12)  # of a bending angle, to an interval
_RADII = tuple(SectionRadii.__dataclass_fields__)


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a segment. fraction : (m,) of its length. arc : (m,) of the body's. integrals, values : `Grid.at`.

    beyond : (m, connectors) 1 where one lies before a point.
    """

    fraction: Array
    arc: Array
    integrals: Array
    values: Array
    beyond: Array


def _samples(grid: Grid, k: int, fraction: Array, arc: Array) -> Samples:
    """Return points at fractions of the length of a segment."""
    own = np.flatnonzero(grid.of_interval == k)
    ends = grid.ends[np.append(own, own[-1] + 1)]
    place = ends[0] + fraction * (ends[-1] - ends[0])
    which = np.clip(np.searchsorted(ends, place, side="right") - 1, 0, own.size - 1)
    inside = (place - ends[which]) / (ends[which + 1] - ends[which])
    integrals, values = grid.at(own[which], inside)
    beyond = (grid.joints <= own[which][:, None]).astype(float).reshape(place.size, grid.joints.size)
    return Samples(fraction, arc, integrals, values, beyond)


class Poses:
    """Makes steps of the outputs of a simulation."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self.rod: Rod = simulation.rod
        grid, body = self.rod.grid, simulation.body
        lengths = [float(segment.robot.length) for segment in body.segments]
        connectors = [segment.connector for segment in body.segments]
        self.whole = sum(lengths) + sum(connectors)
        self._points, self._fine, begin = list[Samples](), list[tuple[Samples, Array]](), 0.0
        for k, length in enumerate(lengths):
            share = SHAPE_POINTS - 1 if len(lengths) == 1 else round((SHAPE_POINTS - 1) * length / self.whole)
            fraction = np.linspace(0, 1, max(share, _FEWEST - 1) + 1)
            self._points.append(_samples(grid, k, fraction, (begin + fraction * length) / self.whole))
            own = np.flatnonzero(grid.of_interval == k)
            ends = (grid.ends[np.append(own, own[-1] + 1)] - grid.ends[own[0]]) / length
            at = (ends[:-1, None] + np.diff(ends)[:, None] * (_FINE[0] + 1) / 2).ravel()
            weight = (np.diff(ends)[:, None] * _FINE[1] / 2).ravel() * length
            self._fine.append((_samples(grid, k, at, at), weight))
            begin += length + connectors[k]

    def step(self, output: Output, seconds: float, error: float | None) -> Step:
        """Return the step of an output. seconds : it took. error : of the grid, estimated."""
        pose, warnings = self.pose(output)
        moving = Moving(
            tip_velocity=output.instant.motion.velocity[-1],
            regulator=np.asarray(output.regulator),
            energy=output.energy.as_numbers(),
            time_steps=output.steps,
        )
        return Step(
            pressure=np.asarray(output.pressure),
            status=Status.SOLVED,
            message=Status.SOLVED.advice,
            time=output.instant.time,
            pose=pose,
            residual=output.residual,
            discretisation_error=error,
            intervals=int(self.rod.grid.of_interval.size),
            iterations=output.iterations,
            solve_time=seconds,
            warnings=warnings,
            engine=self._simulation.numerics.engine if output.ipopt is not None else "newton",
            ipopt=output.ipopt,
            moving=moving,
        )

    def pose(self, output: Output) -> tuple[Pose, tuple[str, ...]]:
        """Return the pose of an output and what to know of it."""
        rod, numbers, at = self.rod, output.numbers, output.instant.at
        stress = rod.stress(output.instant.e, output.instant.motion.strain_rate)
        wall = stress + self._carried(numbers)
        shapes = [self._shape(k, at, wall, numbers) for k in range(len(self._points))]
        segments, bodies = list[SegmentPose](), self._simulation.body.segments
        chambers = list[Array]()
        for k, (shape, own) in enumerate(zip(shapes, rod.sections.stations, strict=True)):
            samples, weight = self._fine[k]
            bend = samples.values @ at.strains[:, 3:5]
            stretch = float(rod.w[own.rows] @ numbers.stretch[own.rows] / rod.w[own.rows].sum())
            segments.append(
                SegmentPose(shape.position[-1], shape.rotation[-1], stretch, float(weight @ np.hypot(*bend.T)))
            )
            chambers.append(self._chambers(k, at, numbers))
        whole = float(np.dot([s.stretch for s in segments], [float(s.robot.length) for s in bodies]))
        whole /= sum(float(s.robot.length) for s in bodies)
        R, tip = rod_tip(at) @ rod.sections.axes[-1], at.position[-1]
        unloaded = rod.placed(numbers, np.zeros((rod.size, 6))).position[-1]
        length = float(rod.w @ np.sqrt((at.strains[:, :3] ** 2).sum(axis=1))) + float(rod.grid.connectors.sum())
        several = len(bodies) > 1 or bool(bodies[0].along) or rod.grid.joints.size > 0
        outline = [self._outline(k, numbers) for k in range(len(shapes))]
        count = [np.full(shape.arc.size, k + 1.0) for k, shape in enumerate(shapes)]
        if bodies[-1].connector > 0:
            shapes.append(_rigid_end(tip, R, output))
            outline.append({name: values[-1:] for name, values in outline[-1].items()})
            count.append(np.zeros(1))
        joined: dict[str, Any] = {
            name: np.concatenate([getattr(shape, name) for shape in shapes]) for name in Shape.__dataclass_fields__
        }
        radii: dict[str, Any] = {name: np.concatenate([some[name] for some in outline]) for name in _RADII}
        pose = Pose(
            stretch=whole,
            stable=None,
            tip_position=tip,
            tip_displacement=tip - unloaded,
            tip_rotation=R,
            bending_angle=float(sum(s.bending_angle for s in segments)),
            tilt=float(np.arctan2(np.hypot(R[0, 2], R[1, 2]), R[2, 2])),
            backbone_length=length,
            chamber_length=np.concatenate(chambers),
            radii=SectionRadii(**{name: float(values[0]) for name, values in radii.items()}),
            shape=Shape(**joined),
            segments=tuple(segments) if several else (),
            outline=SectionRadii(**radii) if several else None,
            segment=np.concatenate(count) if several else np.zeros(0),
        )
        return pose, tuple(self._warnings(pose, numbers))

    def _carried(self, numbers: Numbers) -> Array:
        """Return what the fluid carries of the resultants (n, 6), by sections that leave it out of n and m."""
        found = self.rod.sections.pressure_resultants(numbers)
        for own in self.rod.sections.stations:
            if not getattr(own.model.section, "splits_pressure", True):
                found[own.rows] = 0.0
        return found

    def _shape(self, k: int, at: Placed, wall: Array, numbers: Numbers) -> Shape:
        """Return the shape of a segment."""
        samples, axes = self._points[k], self.rod.sections.axes[k]
        q = samples.integrals @ at.turn_rate
        q[:, 0] += 1.0
        R = matrices(q / np.linalg.norm(q, axis=1, keepdims=True))
        p = samples.integrals @ at.slope + samples.beyond @ at.offsets
        carried, strains = samples.values @ wall, samples.values @ at.strains
        stretch = (samples.values @ numbers.stretch)[:, None]
        return Shape(
            arc=samples.arc,
            position=p,
            rotation=R @ axes,
            force=rotated(R, carried[:, :3]),
            moment=rotated(R, carried[:, 3:]),
            shear_extension=strains[:, :3] @ axes / stretch,
            curvature=strains[:, 3:] @ axes / stretch,
        )

    def _chambers(self, k: int, at: Placed, numbers: Numbers) -> Array:
        """Return the length of each chamber of a segment, Eq. (13)."""
        own, axes = self.rod.sections.stations[k], self.rod.sections.axes[k]
        count = self._simulation.body.chambers[k]
        if not count:
            return np.zeros(0)
        centres = self.rod.sections.centres(numbers)[k][:, :count]
        d = np.concatenate([centres, np.zeros((*centres.shape[:2], 1))], axis=2)
        v, u = at.strains[own.rows, :3] @ axes, at.strains[own.rows, 3:] @ axes
        rate = np.linalg.norm(v[:, None] + cross(u[:, None], d), axis=2)
        found: Array = self.rod.w[own.rows] @ rate
        return found

    def _outline(self, k: int, numbers: Numbers) -> dict[str, Array]:
        """Return the radii along a segment."""
        samples = self._points[k]
        radii = self.rod.sections.outline(k, samples.fraction, samples.values @ numbers.stretch)
        return {
            name: np.array(np.broadcast_to(np.asarray(getattr(radii, name), float), samples.arc.shape))
            for name in _RADII
        }

    def _warnings(self, pose: Pose, numbers: Numbers) -> Iterator[str]:
        stations = self.rod.sections.stations
        found = dict[str, None]()
        for k, own in enumerate(stations):
            prefix = f"segment {k + 1}: " if pose.segments else ""
            stretch = numbers.stretch[own.rows]
            for one in {float(stretch.min()), float(stretch.max())}:
                found |= {f"{prefix}{note}": None for note in own.model.section.warnings(one)}
        yield from found
        # The pose is no equilibrium, so nothing is said of stability.
        yield from shape_warnings(replace(pose, stable=True))


def rod_tip(at: Placed) -> Array:
    """Return R at the tip in the base's axes (3, 3)."""
    found: Array = at.tip_rotation[0]
    return found


def _rigid_end(tip: Array, R: Array, output: Output) -> Shape:
    """Return the far end of a last connector, which no pressure is in and where the loads act."""
    return Shape(
        arc=np.array([1.0]),
        position=tip[None],
        rotation=R[None],
        force=output.acting.force[None],
        moment=output.acting.moment[None],
        shear_extension=np.array([[0.0, 0.0, 1.0]]),
        curvature=np.zeros((1, 3)),
    )
