"""Poses without a wall, many at once: from every quantity of each to its solution in the units of the load case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.arrays import some
from softnlp.batch.bodies import self_intersecting
from softnlp.batch.newton import Batch, BatchSolver, Shot
from softnlp.batch.plan import Plan
from softnlp.model.quantities import LOADS
from softnlp.native.kernels import Kernels
from softnlp.native.shooting import shooting
from softnlp.statics.loadcase import rod_functions, unpack_section
from softnlp.statics.reduced import STATE, base_state, reduced_rod
from softnlp.statics.stretches import Stretches, stretch_maps

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of poses at their stretch: c, the scaled imbalance of the stretch, units of length and force."""

    stretch: Array
    constants: Array
    imbalance: Array
    length_unit: Array
    force_unit: Array


@dataclass(frozen=True, eq=False)
class Poses:
    """Solved poses: their numbers among those asked, sections, what came of the shooting, and the scaled residual."""

    numbers: NDArray[np.intp]
    sections: Sections
    shot: Shot
    residual: Array


class PoseLane:
    """Solves poses of one plan without a wall, and says which of them are solved, accurate and stable for certain."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        functions = rod_functions(plan.model)
        reduced = reduced_rod(functions)
        kernels = Kernels(
            {"value": reduced.value, "directions": reduced.directions, "check": reduced.check},
            {"ends": reduced.ends, "onward": reduced.onward, **stretch_maps(functions)},
        )
        self._kernels = shooting(kernels)
        self._batch = BatchSolver(functions, self._kernels, plan.numerics.accuracy / 3, plan.numerics.intervals)
        self._stretches = Stretches(functions, self._kernels, shared=not set(plan.varied) - {"pressure", *LOADS})
        self._force, self._moment = (entries(plan, name) for name in ("tip_force", "tip_moment"))
        self._outline = {name: entries(plan, name) for name in plan.model.numbers}

    def sections(self, columns: Array) -> tuple[Sections, NDArray[np.intp]]:
        """Return the sections of the poses whose stretch is found, and their numbers; columns of every quantity, SI."""
        stretch, known = self._stretches.find(columns)
        numbers = np.flatnonzero(known)
        found = self._kernels.apply("section", np.vstack([columns[:, numbers], stretch[numbers]]))
        return Sections(stretch[numbers], found[:-3], *found[-3:]), numbers

    def loads(self, columns: Array, sections: Sections) -> tuple[Array, Array]:
        """Return the scaled tip forces and moments."""
        force, moment = columns[self._force], columns[self._moment]
        return force / sections.force_unit, moment / (sections.force_unit * sections.length_unit)

    def outer_radius(self, columns: Array, sections: Sections) -> Array:
        """Return the scaled outer radii at the stretch, (S2)."""
        numbers = {
            name: columns[rows] if rows.stop - rows.start > 1 else columns[rows.start]
            for name, rows in self._outline.items()
        }
        radii = self._plan.model.section.outline(numbers, sections.stretch)
        return np.asarray(radii.outer / sections.length_unit)

    def self_intersecting(self, poses: Poses, columns: Array) -> Mask:
        """Return which solved poses pass through themselves; columns : of every pose asked."""
        own, shot = columns[:, poses.numbers], poses.shot
        data = np.vstack([poses.sections.constants, *self.loads(own, poses.sections)])
        return self_intersecting(
            self._kernels,
            "onward",
            base_state(shot.base)[:STATE],
            data,
            curvature=shot.curvature,
            bending=shot.integrals[-2],
            radius=self.outer_radius(own, poses.sections),
            intervals=shot.intervals,
        )

    def solve(self, columns: Array, features: Array) -> Poses:
        """Solve poses; those that are not solved, accurate and stable for certain are left out.

        columns : (quantities, poses), SI. features : (poses, columns) of what differs between them.
        """
        sections, numbers = self.sections(columns)
        force, moment = self.loads(columns[:, numbers], sections)
        c = sections.constants
        rod = unpack_section(c)
        bend = rod.length * np.hypot(rod.pressure_moment_x / rod.bending_x, rod.pressure_moment_y / rod.bending_y)
        shot = self._batch.solve(Batch(np.vstack([c, force, moment]), bend), features[numbers])
        residual = np.maximum(shot.residual, np.abs(sections.imbalance))
        numerics = self._plan.numerics
        good = (residual <= numerics.tolerance) & shot.certain
        good &= (shot.refinement_error <= numerics.accuracy) | (numerics.intervals is not None)
        return Poses(numbers[good], some(sections, good), some(shot, good), residual[good])


def entries(plan: Plan, name: str) -> slice:
    """Return where a quantity stands in a column of all of them."""
    names = list(plan.nominal)
    start = sum(plan.nominal[other].size for other in names[: names.index(name)])
    return slice(start, start + plan.nominal[name].size)
