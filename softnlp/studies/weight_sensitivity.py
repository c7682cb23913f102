"""How the force of the `weighted` closure answers to its weights, which the paper chooses for each robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.kept import blocked_solver
from softnlp.statics.step import Step, WeightSensitivity
from softnlp.statics.wall import checked_contact, standing_wall
from softnlp.studies.forward import checked_loads, pressure_table

UNITS: Mapping[str, str] = {"force": "1/N", "moment": "1/(N m)", "length": "1/m", "position": "1/m"}
FACTOR = 1.1


def given_weights(contact: ContactSettings) -> dict[str, float]:
    """Return the weights that are given, by name.

    Raises
    ------
    InputError
        When the closure is not `weighted`, or no weight is given.
    """
    if contact.closure != "weighted":
        raise InputError(f"expected closure = 'weighted', got {contact.closure!r}", key="closure")
    given = {name: value for name in UNITS if (value := getattr(contact.weights, name)) is not None}
    if not given:
        raise InputError("expected at least one weight", key="weights")
    return given


def sensitivities(solver: BlockedSolver, found: Blocked, factor: float = FACTOR) -> tuple[WeightSensitivity, ...]:
    """Return how the force of a solution of `weighted` changes with each weight that is given.

    Central differences over weights that are `factor` larger and smaller; nan where one of the two has no force.
    """
    contact, situation = solver.contact, found.situation
    made = []
    for name, value in given_weights(contact).items():
        forces = []
        for f in (factor, 1 / factor):
            weights = replace(contact.weights, **{name: value * f})
            other = solver.with_contact(replace(contact, weights=weights))
            step = other.solve(situation.pressure, situation.loads, situation.wall, found)[0]
            forces.append(step.contact.force if step.contact is not None else 0.0)
        known = min(forces) > 0
        slope = float(np.log(forces[0] / forces[1]) / (2 * np.log(factor))) if known else float("nan")
        made.append(WeightSensitivity(name, value, UNITS[name], slope))
    return tuple(made)


def weight_sensitivity(
    robot: Robot,
    material: Material,
    pressure: Any,
    contact: ContactSettings,
    *,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    factor: float = FACTOR,
) -> tuple[Step, tuple[WeightSensitivity, ...]]:
    """Return the step of `weighted` at a pressure and how its force changes with each weight given.

    Parameters
    ----------
    robot, material
        As `softnlp.blocked_force`.
    pressure
        (sets,) gauge [Pa].
    contact
        With closure `weighted` and at least one weight.
    loads, coefficients, conventions, numerics
        As `softnlp.blocked_force`.
    factor
        Of the weights: central differences over weights that much larger and smaller [1].

    Returns
    -------
    tuple
        The step, and a `WeightSensitivity` for each weight; none where the step has no force.

    Raises
    ------
    InputError
        When the closure is not `weighted`, or no weight is given; for a pressure or loads of the wrong shape.
    """
    check(robot, allow=LOWERABLE_RULES)
    contact, loads = checked_contact(contact, [robot]), checked_loads(loads)
    P = pressure_table(pressure, robot.chamber_sets)
    given_weights(contact)
    if len(P) != 1:
        raise InputError(f"expected one pressure a set, got {len(P)} steps", key="pressure")
    solver = blocked_solver(Model(robot, material, coefficients, conventions), numerics, contact)
    step, found = solver.solve(P[0], loads, standing_wall(solver.poses, contact, P, loads))
    return step, () if found is None else sensitivities(solver, found, factor)
