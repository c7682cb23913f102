"""The scenarios behind the pages, and variants of them over laws, sets and coefficients."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from docs.paper.published import ROOT
from softnlp import BAR, COEFFICIENT_SETS, ROBOTS, Coefficients, Loads, material
from softnlp.model.laws import LAWS
from softnlp.model.quantities import Model
from softnlp.scenario.read import Scenario, load_scenario
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.solver import PoseSolver

Array = NDArray[np.float64]

NAMES = tuple(name for name in ROBOTS if name.startswith("D"))
"""The eight robots that were tested."""
STIFFENED = COEFFICIENT_SETS["reproduction"]
BARE = replace(STIFFENED, elongation=0.0, bending=0.0)
"""Without the stiffening terms of Eqs. (10) and (12)."""
HYPERELASTIC = tuple(law for law in LAWS if law != "linear")


@cache
def case(name: str, folder: str = "paper") -> Scenario:
    """Return a scenario of `scenarios/<folder>`."""
    return load_scenario(ROOT / "scenarios" / folder / f"{name}.toml")


def model_of(scenario: Scenario, law: str | None = None, coefficients: Coefficients | None = None) -> Model:
    """Return the model of a scenario, with another law or other coefficients where they are given."""
    silicone = scenario.material if law is None else material(scenario.material.name, law)
    return Model(scenario.robot, silicone, coefficients or scenario.coefficients, scenario.conventions)


def law_of(scenario: Scenario) -> str:
    """Return the name of a scenario's law."""
    return scenario.material.law.name


def with_sets(pressures: Array, sets: int) -> Array:
    """Return pressures of set 1 (steps, sets) [Pa] with the same in the first so many sets."""
    pressed = np.arange(pressures.shape[1]) < sets
    return np.where(pressed, pressures[:, :1], 0.0)


def in_bar(pressures: Array) -> Array:
    """Return the pressures of set 1 (steps,) [bar]."""
    return np.asarray(pressures[:, 0] / BAR)


class Solvers:
    """Pose solvers of many models; robots of one kind, law and conventions share what is compiled."""

    def __init__(self) -> None:
        self._made: dict[tuple[int, int, str, str], PoseSolver] = {}

    def of(self, model: Model, scenario: Scenario) -> PoseSolver:
        """Return the solver of a model, with the numerics of a scenario."""
        robot = model.robot
        key = (robot.chamber_sets, robot.chambers_per_set, model.material.law.name, model.conventions.name)
        if key not in self._made:
            self._made[key] = PoseSolver(model, scenario.numerics)
        return self._made[key].with_model(model)


def unloaded(poses: PoseSolver, pressure: Array) -> tuple[float, float]:
    """Return the bending angle [rad], which does not wrap, and the stretch of the arc at a pressure (sets,) [Pa].

    NaN where the branch from zero pressure has ended.
    """
    column = poses.column(poses.values(pressure, Loads()))
    branch, functions = stretch_on_branch(poses.branch, column, pressure), poses.functions
    if not branch.status.has_solution:
        return float("nan"), float("nan")
    base, constants = functions.arc(column, branch.stretch, 0.0), functions.section(column, branch.stretch)[0]
    return float(np.asarray(functions.lengths(base, constants)).ravel()[poses.model.robot.chambers]), branch.stretch
