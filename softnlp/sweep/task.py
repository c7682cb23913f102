"""What a workspace scenario asks for, as data in SI units, and its poses: grids, samples, or given pressures."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Any, NamedTuple

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import DEG, MM, NMM, N
from softnlp.model.materials import Material
from softnlp.model.robot import DIMENSIONS
from softnlp.model.rod import Vector

MOST_HALTON = 12
"""Dimensions up to which the Halton sequence is even enough."""


@dataclass(frozen=True, eq=False)
class Axis:
    """One number that differs between poses besides the pressures.

    key : as the scenario names it. quantity : of `softnlp.model.quantities`. place : which entry of that quantity it
    is, or the vector that it multiplies; None for a quantity that is a number.
    values : (levels,) SI, of a grid or beside given pressures; (2,), both ends, of samples.
    """

    key: str
    quantity: str
    place: int | Vector | None
    values: Array


@dataclass(frozen=True, eq=False)
class WorkspaceTask:
    """A grid (`levels` a set), `samples`, or neither: the scenario's own pressures in their order.

    sets : chamber sets that are swept, counted from 0; the others have no pressure. lowest, highest : [Pa].
    seed : of the scrambling of the samples. vary : what else differs, the first of them slowest.
    """

    levels: int | None = None
    samples: int | None = None
    sets: tuple[int, ...] = ()
    lowest: float = 0.0
    highest: float = 0.0
    seed: int = 0
    vary: tuple[Axis, ...] = ()

    def step_count(self, pressures: int) -> int:
        """Return the number of poses, for so many pressures of the scenario."""
        if self.samples is not None:
            return self.samples
        return (pressures if self.levels is None else self.levels ** len(self.sets)) * self.combinations

    @property
    def combinations(self) -> int:
        """The number of combinations of what a grid varies besides the pressures."""
        return prod(axis.values.size for axis in self.vary)


class Varied(NamedTuple):
    """A quantity that may be varied: where it goes as in `Axis`, its unit in files, SI per unit, and what it is."""

    quantity: str
    place: int | Vector | None
    unit: str
    scale: float
    meaning: str


def varied_quantities(material: Material, gravity: Vector) -> dict[str, Varied]:
    """Return what may be varied besides pressures, by its key in a scenario; gravity : the direction that it has."""
    kinds: dict[str, Varied] = {}
    for k, x in enumerate("xyz"):
        for what, unit in (("force", N), ("moment", NMM)):
            words = f"tip {what} along {x}"
            kinds[f"tip_load.{what}_{x}_{unit.suffix}"] = Varied(f"tip_{what}", k, unit.attribute, unit.scale, words)
    kinds["gravity.size_m_per_s2"] = Varied("gravity", gravity, "m/s^2", 1.0, "size of gravity")
    for d in DIMENSIONS:
        if d.scale is not None:
            unit, words = DEG if d.file_key.endswith(DEG.suffix) else MM, f"{d.field.replace('_', ' ')} of the robot"
            kinds[f"robot.{d.file_key}"] = Varied(f"robot.{d.field}", None, unit.attribute, d.scale, words)
    for c in material.law.constants:
        words = f"constant {c.name} of the silicone"
        kinds[f"material.{c.file_key}"] = Varied(f"material.{c.name}", None, c.unit, c.scale, words)
    kinds["material.density_kg_m3"] = Varied("material.density", None, "kg/m^3", 1.0, "density of the silicone")
    for table, names in (
        ("stiffening", ("elongation", "bending")),
        ("corrections", ("area", "inertia", "bore_fraction", "modulus_factor")),
    ):
        for name in names:
            kinds[f"{table}.{name}"] = Varied(
                f"{table}.{name}", None, "1", 1.0, f"coefficient {name.replace('_', ' ')}"
            )
    return kinds


def pressure_table(task: WorkspaceTask, chamber_sets: int, given: Array) -> Array:
    """Return the pressures of every pose as (poses, sets) [Pa]; `given` are those of the scenario, if it has any.

    Numbered as nested loops: the first varied quantity is slowest, then set after set or step after step.
    """
    if task.levels is None and task.samples is None:
        return np.tile(given, (task.combinations, 1))
    table = np.zeros((task.step_count(0), chamber_sets))
    if task.samples is not None:
        unit = unit_samples(task.samples, len(task.sets) + len(task.vary), task.seed)[:, : len(task.sets)]
        table[:, task.sets] = task.lowest + unit * (task.highest - task.lowest)
        return table
    assert task.levels is not None
    line = np.linspace(task.lowest, task.highest, task.levels)
    inner = np.meshgrid(*[line] * len(task.sets), indexing="ij")
    for chosen, column in zip(task.sets, inner, strict=True):
        table[:, chosen] = np.tile(column.ravel(), task.combinations)
    return table


def varied_table(task: WorkspaceTask, pressures: int) -> Array:
    """Return (poses, axes) of what differs besides the pressures, SI, for so many pressures of the scenario."""
    if task.samples is not None:
        unit = unit_samples(task.samples, len(task.sets) + len(task.vary), task.seed)[:, len(task.sets) :]
        low, high = np.array([axis.values for axis in task.vary]).reshape(-1, 2).T
        return np.asarray(low + unit * (high - low))
    repeats = task.step_count(pressures) // task.combinations
    return np.repeat(combinations(task), repeats, axis=0)


def combinations(task: WorkspaceTask) -> Array:
    """Return every combination of what a grid varies besides the pressures as (combinations, axes), SI."""
    columns = np.meshgrid(*(axis.values for axis in task.vary), indexing="ij")
    return np.stack([column.ravel() for column in columns], axis=1) if columns else np.zeros((1, 0))


def unit_samples(count: int, dimensions: int, seed: int) -> Array:
    """Return low-discrepancy points in the unit cube as (count, dimensions), the same for the same seed.

    Scrambled Sobol points for a power of 2, for which they are balanced, and beyond 12 dimensions; else scrambled
    Halton points, which are even for any number.
    """
    from scipy.stats import qmc

    sobol = count & (count - 1) == 0 or dimensions > MOST_HALTON
    kind: Any = qmc.Sobol if sobol else qmc.Halton
    try:
        points = kind(dimensions, scramble=True, rng=seed)
    except TypeError:  # scipy before 1.15
        points = kind(dimensions, scramble=True, seed=seed)
    if sobol:  # points after the first power of 2 make scipy warn; they are wanted
        return np.asarray(points.random_base2(max(0, count - 1).bit_length()))[:count]
    return np.asarray(points.random(count))
