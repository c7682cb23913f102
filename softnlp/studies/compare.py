"""Comparing the model with measurements: every measured row simulated by every variant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.model.contact_settings import CLOSURES, ContactSettings
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.statics.wall import checked_contact
from softnlp.studies.comparison import Comparison
from softnlp.studies.forward import checked_loads
from softnlp.studies.measurements import Measurements
from softnlp.studies.observed import FORCE, NUMBERS, POSE, Observed, observed
from softnlp.studies.simulated import RowSolver, Solved, SweepSolver, Tell, closed_by
from softnlp.studies.variants import Variant

Array = NDArray[np.float64]

SHAPES = ("free", "blocked")


def compare(
    measurements: Measurements | Sequence[Measurements],
    variants: Variant | Sequence[Variant],
    *,
    contact: ContactSettings = ContactSettings(),
    loads: Loads = Loads(),
    numerics: Numerics = Numerics(),
    shape: Literal["free", "blocked"] = "free",
    together: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Simulate what was measured with each variant of the model and return how far they are apart.

    Parameters
    ----------
    measurements
        Of one robot or of several, as for `softnlp.identify`; noise and weights in them change nothing.
    variants
        Laws, coefficients, conventions and closures; `softnlp.studies.variants.every_variant` combines them.
    contact
        The wall of blocked forces; one wall for all rows of a robot.
    loads, numerics
        As `softnlp.forward`; the same in every row.
    shape
        Whether tips, angles and elongations are those of the free robot or of the one that the wall blocks.
    together
        Solve all rows of a robot at once, as a workspace sweep does, instead of one after the other: for many rows.
    progress
        Called with how many solves are done, and how many there are.

    Returns
    -------
    Comparison
        A row that has no solution keeps a named status and has no errors.

    Raises
    ------
    InputError
        For measurements, variants, loads or a wall that are not right.

    """
    given = (measurements,) if isinstance(measurements, Measurements) else tuple(measurements)
    asked = (variants,) if isinstance(variants, Variant) else tuple(variants)
    if not given:
        raise InputError("expected measurements of at least one robot", key="measurements")
    if not asked:
        raise InputError("expected at least one variant", key="variants")
    if shape not in SHAPES:
        raise InputError(f"expected one of {', '.join(SHAPES)}, got {shape!r}", key="shape")
    for variant in asked:
        if variant.closure is not None and variant.closure not in CLOSURES:
            raise InputError(f"expected one of {', '.join(CLOSURES)}, got {variant.closure!r}", key="closure")
    robots = tuple(observed(m) for m in given)
    loads, contact = checked_loads(loads), checked_contact(contact, [o.robot for o in robots])
    solver = (SweepSolver if together else RowSolver)(numerics, loads)
    work = _Work(solver, contact, shape == "blocked", _Count(_solves(robots, asked, shape == "blocked"), progress))
    simulated = tuple(tuple(work.solved(variant, o) for o in robots) for variant in asked)
    return Comparison(robots, asked, simulated, contact, shape)


class _Count:
    """Adds up solved rows."""

    def __init__(self, total: int, progress: Callable[[int, int], None] | None) -> None:
        self._done, self._total, self._progress = 0, total, progress

    def __call__(self, rows: int) -> None:
        self._done += rows
        if self._progress is not None:
            self._progress(self._done, self._total)


class _Work:
    """Solves the rows of one robot after the other; free poses once for all closures."""

    def __init__(self, solver: RowSolver | SweepSolver, contact: ContactSettings, blocked: bool, tell: Tell) -> None:
        self._solver = solver
        self._contact = contact
        self._blocked = blocked
        self._tell = tell
        self._free: dict[tuple[int, ...], Solved] = {}

    def solved(self, variant: Variant, o: Observed) -> Solved:
        """Return what a variant says of the rows of a robot."""
        model = Model(o.robot, variant.material, variant.coefficients, variant.conventions)
        contact = closed_by(self._contact, variant.closure)
        values = np.full((len(o.pressure), len(NUMBERS)), np.nan)
        status: list[Status | None] = [None] * len(values)
        message = [""] * len(values)
        through: set[int] = set()

        def put(rows: NDArray[np.intp], found: Solved, columns: slice | int) -> None:
            values[rows, columns] = found.values[:, columns]
            through.update(rows[list(found.self_intersecting)].tolist())
            for row, ended, words in zip(rows.tolist(), found.status, found.message, strict=True):
                known = status[row]
                if known is None or known.has_solution:  # else what came first is told
                    status[row], message[row] = ended, words

        free, at_wall = _rows(o, self._blocked)
        if free.size:
            put(free, self._free_poses(variant, model, o, free), POSE)
        if at_wall.size:
            found = self._solver.solve(model, o.pressure[at_wall], contact, self._tell)
            put(at_wall, found, slice(0, len(NUMBERS)) if self._blocked else FORCE)
        values[~np.isfinite(o.values)] = np.nan
        return Solved(values, tuple(status), tuple(message), frozenset(through))

    def _free_poses(self, variant: Variant, model: Model, o: Observed, rows: NDArray[np.intp]) -> Solved:
        key = _free_key(variant, o)
        if key not in self._free:
            self._free[key] = self._solver.solve(model, o.pressure[rows], None, self._tell)
        return self._free[key]


def _rows(o: Observed, blocked: bool) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which rows are solved free and which against the wall."""
    if blocked:
        return np.zeros(0, np.intp), np.arange(len(o.pressure))
    return np.flatnonzero(o.has_pose), np.flatnonzero(o.has_force)


def _free_key(variant: Variant, o: Observed) -> tuple[int, ...]:
    """Return what a free pose depends on: everything but the closure."""
    return id(variant.material), id(variant.coefficients), id(variant.conventions), id(o)


def _solves(robots: Sequence[Observed], variants: Sequence[Variant], blocked: bool) -> int:
    """Return how many rows there are to solve."""
    free = {_free_key(variant, o): _rows(o, blocked)[0].size for variant in variants for o in robots}
    return sum(free.values()) + len(variants) * sum(_rows(o, blocked)[1].size for o in robots)
