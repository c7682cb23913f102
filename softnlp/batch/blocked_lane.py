"""Blocked poses, many at once: which free shapes reach the wall, and the branches that those follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.arrays import joined, some, spread
from softnlp.batch.bodies import self_intersecting
from softnlp.batch.contact_newton import PATH, BlockedShot, ContactBatch, Stage
from softnlp.batch.plan import Plan
from softnlp.batch.pose_lane import PoseLane, Poses, Sections, entries
from softnlp.batch.reduced_contact import reduced_contact
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.quantities import LOADS
from softnlp.model.rod import Loads
from softnlp.model.tip import TipContact
from softnlp.native.kernels import Kernels
from softnlp.native.shooting import shooting
from softnlp.statics.blocked import TOUCHING
from softnlp.statics.blocked_step import PULL
from softnlp.statics.loadcase import rod_functions, unpack_section
from softnlp.statics.reduced import POSITION
from softnlp.statics.solver import PoseSolver
from softnlp.statics.wall import Wall, standing_wall

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CLOSURES = ("free", "compliant", "rigid", "none")
"""Closures that are solved together; `weighted` is a minimum, not a root."""


@dataclass(frozen=True, eq=False)
class BlockedPoses:
    """Solved blocked poses: their numbers among those asked, and what came of them in the units of the load case.

    force : of the wall, not negative [N].
    """

    numbers: NDArray[np.intp]
    sections: Sections
    shot: BlockedShot
    residual: Array
    force: Array


def wall_of_plan(plan: Plan, contact: ContactSettings) -> Wall:
    """Return the wall of a sweep: where the free shape goes at the largest sum of pressures."""
    loads = Loads(*(plan.nominal[name] for name in LOADS))
    largest = plan.pressures()[[int(np.argmax(plan.pressures().sum(axis=1)))]]
    return standing_wall(PoseSolver(plan.model, plan.numerics), contact, largest, loads)


class BlockedLane:
    """Solves blocked poses of one plan against one wall."""

    def __init__(self, plan: Plan, contact: ContactSettings, wall: Wall, free: PoseLane) -> None:
        self._plan, self._contact, self._wall, self._free = plan, contact, wall, free
        functions = rod_functions(plan.model, (TipContact(contact.closure),))
        reduced = reduced_contact(functions)
        kernels = Kernels(
            {
                "contact_value": reduced.value,
                "contact_directions": reduced.directions,
                "contact_check": reduced.check,
            },
            {"contact_tip": reduced.tip, "contact_onward": reduced.onward, "arc": reduced.arc},
        )
        self._kernels = shooting(kernels)
        self._flat = ContactBatch(functions, self._kernels, wall.plane)
        self._spatial = ContactBatch(functions, self._kernels, None)
        self._sets = plan.model.sets
        self._set_of_chamber = np.array(plan.model.section.set_of_chamber)

    def gaps(self, poses: Poses) -> Array:
        """Return how far each free contact point is in front of the wall [m]."""
        L_0 = poses.sections.length_unit
        tip = poses.shot.tip
        return self._wall.normal @ (tip[POSITION] * L_0 + self._contact.tip_cap * tip[9:12]) - float(
            self._wall.normal @ self._wall.point
        )

    def touching(self, poses: Poses) -> Array:
        """Return below which distance a free contact point touches the wall [m]."""
        return (TOUCHING + 3 * poses.shot.error) * poses.sections.length_unit

    def solve(self, columns: Array, features: Array, free: Poses) -> BlockedPoses | None:
        """Solve the poses of `free`, whose free shapes are beyond the wall; None where none is solved.

        columns, features : as `PoseLane.solve`, of every pose asked.
        """
        own = columns[:, free.numbers]
        path = [self._along(own, features[free.numbers], t) for t in PATH[:-1]]
        path.append(
            (free.sections, self._contact_lengths(free, own), self.gaps(free), np.ones(free.numbers.size, bool))
        )
        beyond = np.array([gap < 0 for _, _, gap, _ in path])
        usable = np.all([ok for *_, ok in path], axis=0) & (path[0][2] >= -self.touching(free))
        # the point of the path from which the free shape stays beyond the wall
        first = len(PATH) - 1 - np.argmin(np.vstack([beyond[::-1], np.zeros((1, own.shape[1]), bool)])[1:], axis=0)
        flat = self._flat_poses(own, free.sections)
        found: list[tuple[NDArray[np.intp], BlockedShot, Mask]] = []
        for batch, members in ((self._flat, usable & flat), (self._spatial, usable & ~flat)):
            chosen = np.flatnonzero(members)
            if chosen.size:

                def stage_at(j: int, on: NDArray[np.intp], chosen: NDArray[np.intp] = chosen) -> Stage:
                    poses = chosen[on]
                    sections = some(path[j][0], poses)
                    given = self._given(own[:, poses], path[j][1][:, poses])
                    units = np.vstack([sections.length_unit, sections.force_unit])
                    return Stage(sections.constants, given, units)

                target = self._plan.numerics.accuracy / 3
                found.append((chosen, *batch.follow(stage_at, first[chosen], target)))
        return self._kept(free, found)

    def self_intersecting(self, poses: BlockedPoses, columns: Array) -> Mask:
        """Return which solved poses pass through themselves; columns : of every pose asked."""
        shot = poses.shot
        return self_intersecting(
            self._kernels,
            "contact_onward",
            self._spatial.start(shot.unknowns)[: shot.state.shape[0]],
            np.vstack([poses.sections.constants, shot.unknowns[:3]]),
            curvature=shot.curvature,
            bending=shot.integrals[0],
            radius=self._free.outer_radius(columns[:, poses.numbers], poses.sections),
            intervals=shot.intervals,
        )

    def _kept(self, free: Poses, found: list[tuple[NDArray[np.intp], BlockedShot, Mask]]) -> BlockedPoses | None:
        """Return the poses that hold every equation within the tolerance and push."""
        parts = []
        for chosen, shot, held in found:
            sections = some(free.sections, chosen)
            residual = np.maximum(shot.residual, np.abs(sections.imbalance))
            y = shot.unknowns[6]
            accurate = shot.worst_error <= self._plan.numerics.accuracy
            good = held & accurate & (residual <= self._plan.numerics.tolerance)
            good &= y >= -(PULL + 10 * shot.worst_error)
            kept = np.flatnonzero(good)
            force = np.maximum(y * sections.force_unit, 0.0)[kept]
            parts.append((chosen[kept], some(sections, kept), some(shot, kept), residual[kept], force))
        if not parts:
            return None
        chosen = np.concatenate([part[0] for part in parts])
        return BlockedPoses(
            free.numbers[chosen],
            joined([part[1] for part in parts]),
            joined([part[2] for part in parts]),
            np.concatenate([part[3] for part in parts]),
            np.concatenate([part[4] for part in parts]),
        )

    def _along(self, columns: Array, features: Array, t: float) -> tuple[Sections, Array, Array, Mask]:
        """Return sections, free chamber lengths, gaps of the free contact point, and what was found, at part t."""
        moved = columns.copy()
        moved[: self._sets] *= t
        n = columns.shape[1]
        every, numbers = self._free.sections(moved)
        sections, found = spread(every, numbers, n), np.zeros(n, bool)
        tips = np.full((12, n), np.nan)
        lengths = np.full((self._set_of_chamber.size, n), np.nan)
        loaded = np.any(self._loads_of(moved) != 0, axis=0)
        plain = np.setdiff1d(numbers, np.flatnonzero(loaded))
        if plain.size:
            states = self._kernels.apply("arc", np.vstack([moved[:, plain], sections.stretch[plain]]))
            tips[:, plain], lengths[:, plain] = states[:12], states[18:]
            found[plain] = True
        carried = np.flatnonzero(loaded)
        if carried.size:
            poses = self._free.solve(moved[:, carried], features[carried])
            where = carried[poses.numbers]
            tips[:, where], lengths[:, where] = poses.shot.tip[:12], poses.shot.integrals[:-2]
            found[where] = True
        L_0 = sections.length_unit
        point = tips[:3] * L_0 + self._contact.tip_cap * tips[9:12]
        gap = self._wall.normal @ point - float(self._wall.normal @ self._wall.point)
        return sections, lengths * L_0, gap, found

    def _contact_lengths(self, free: Poses, columns: Array) -> Array:
        """Return the free chamber lengths at the full pressure [m], in closed form where no load acts."""
        lengths = free.shot.integrals[:-2] * free.sections.length_unit
        plain = np.flatnonzero(~np.any(self._loads_of(columns) != 0, axis=0))
        if plain.size:
            states = self._kernels.apply("arc", np.vstack([columns[:, plain], free.sections.stretch[plain]]))
            lengths[:, plain] = states[18:] * free.sections.length_unit[plain]
        return lengths

    def _loads_of(self, columns: Array) -> Array:
        """Return tip force, tip moment and gravity, (9, poses)."""
        return np.vstack([columns[entries(self._plan, name)] for name in LOADS])

    def _given(self, columns: Array, free_lengths: Array) -> Array:
        """Return what the loads take at the tip, SI: the dead ones, then as `contact_quantities` has it."""
        n = columns.shape[1]
        pressed = (columns[: self._sets] > 0)[self._set_of_chamber]
        coefficient = float(self._plan.model.coefficients.chamber_reaction)
        return np.vstack(
            [
                self._loads_of(columns)[:6],
                np.repeat(self._wall.point[:, None], n, axis=1),
                np.repeat(self._wall.normal[:, None], n, axis=1),
                np.full(n, self._contact.tip_cap),
                np.full(n, coefficient),
                free_lengths,
                pressed,
                np.zeros((7, n)),
            ]
        )

    def _flat_poses(self, columns: Array, sections: Sections) -> Mask:
        """Return which poses wall, pressures and loads keep in the plane of the wall's normal."""
        n, plane = columns.shape[1], self._wall.plane
        if plane is None:
            return np.zeros(n, bool)
        rod = unpack_section(sections.constants)
        up = np.array([0.0, 0.0, 1.0])
        along = np.cross(plane, up)
        round_section = np.abs(rod.bending_x - rod.bending_y) <= 1e-9 * np.abs(rod.bending_x)
        if min(abs(plane[0]), abs(plane[1])) <= 1e-12:
            round_section = np.ones(n, bool)
        force, moment, gravity = np.split(self._loads_of(columns), 3)
        pressing = np.vstack([rod.pressure_moment_x, rod.pressure_moment_y, np.zeros(n)])

        def absent(vectors: Array, direction: Array) -> Mask:
            limit: Mask = np.abs(direction @ vectors) <= 1e-9 * np.linalg.norm(vectors, axis=0)
            return limit

        flat: Mask = round_section & absent(pressing, along) & absent(moment, along) & absent(moment, up)
        return flat & absent(force, plane) & absent(gravity, plane)
