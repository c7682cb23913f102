"""Physical quantities as named symbols: one model whose numbers may be fixed, swept or unknown."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.robot import DIMENSIONS, Robot
from softnlp.model.section import deform

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """A robot, its silicone, and how the equations are read. Numbers here are the nominal values of quantities."""

    robot: Robot
    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION

    @property
    def kind(self) -> Hashable:
        """What the compiled equations depend on; models of one kind differ by the values of quantities only."""
        robot, law = self.robot, self.material.law
        chambers = (robot.chamber_sets, robot.chambers_per_set)
        return chambers, (law.name, law.constants, law.formula, law.modulus), self.conventions

    def check_kind(self, other: Model) -> None:
        """Raise `ValueError` for a model of another kind, whose numbers do not fit the compiled equations."""
        if self.kind != other.kind:
            raise ValueError("a model with other chambers, law or conventions needs a solver of its own")


_SIZES = tuple(d.field for d in DIMENSIONS if d.scale is not None)
_COEFFICIENT_NAMES = {
    "elongation": "stiffening.elongation",
    "bending": "stiffening.bending",
    "area": "corrections.area",
    "inertia": "corrections.inertia",
    "bore_fraction": "corrections.bore_fraction",
}


def quantities(model: Model) -> dict[str, Quantity]:
    """Return every quantity of the model by name, with the model's values as nominal ones.

    "pressure" (one entry a set, Pa), "tip_force" (N), "tip_moment" (N m), "gravity" (m/s^2), "robot.<dimension>" (m
    or rad), "material.<constant>", "material.density", "stiffening.elongation", "stiffening.bending",
    "corrections.area", "corrections.inertia", "corrections.bore_fraction".
    """
    robot, material = model.robot, model.material
    declared = [
        quantity("pressure", "Pa", np.zeros(robot.chamber_sets), scale=1e5, lower=0.0),
        quantity("tip_force", "N", np.zeros(3)),
        quantity("tip_moment", "N m", np.zeros(3), scale=1e-2),
        quantity("gravity", "m/s^2", np.zeros(3), scale=10.0),
    ]
    for name in _SIZES:
        value = float(getattr(robot, name))
        unit = "rad" if name == "chamber_angle" else "m"
        declared.append(quantity(f"robot.{name}", unit, value, scale=max(abs(value), 1e-4), lower=0.0))
    for constant in material.law.constants:
        value = float(material.constants[constant.name])
        unit = "Pa" if constant.unit == "MPa" else constant.unit
        declared.append(quantity(f"material.{constant.name}", unit, value, scale=abs(value) or 1.0))
    declared.append(quantity("material.density", "kg/m^3", float(material.density), scale=1e3, lower=0.0))
    for field_name, name in _COEFFICIENT_NAMES.items():
        declared.append(quantity(name, "1", float(getattr(model.coefficients, field_name)), lower=0.0))
    return {q.name: q for q in declared}


def contact_quantities(model: Model) -> dict[str, Quantity]:
    """Return the quantities of a wall and a closure by name, "contact." and a field of `softnlp.model.tip.Given`."""
    N = model.robot.chambers
    L_0 = float(model.robot.length)
    declared = [
        quantity("contact.wall_point", "m", np.zeros(3), scale=L_0),
        quantity("contact.wall_normal", "1", np.array([1.0, 0.0, 0.0])),
        quantity("contact.tip_cap", "m", 0.0, scale=L_0, lower=0.0),
        quantity("contact.chamber_reaction", "1", float(model.coefficients.chamber_reaction), lower=0.0),
        quantity("contact.free_lengths", "m", np.full(N, L_0), scale=L_0, lower=0.0),
        quantity("contact.pressed", "1", np.zeros(N)),
        quantity("contact.force_error", "N", np.zeros(3)),
        quantity("contact.moment_error", "N m", np.zeros(3), scale=1e-2),
        quantity("contact.gap_error", "m", 0.0, scale=L_0),
    ]
    return {q.name: q for q in declared}


def with_symbols(model: Model, values: Mapping[str, Any]) -> Model:
    """Return the model with the named quantities (see `quantities`) in place of its numbers."""
    robot = replace(model.robot, **{name: values[f"robot.{name}"] for name in _SIZES})
    constants = {c.name: values[f"material.{c.name}"] for c in model.material.law.constants}
    material = replace(model.material, constants=constants, density=values["material.density"])
    coefficients = replace(model.coefficients, **{k: values[name] for k, name in _COEFFICIENT_NAMES.items()})
    return Model(robot, material, coefficients, model.conventions)


def section_function(model: Model, build: Callable[[Model, Any, Any, Any], Sequence[Any]]) -> ca.Function:
    """Compile `build(model, pressures, gravity, stretch)` for symbols in place of the model's numbers.

    Returns a function of (every quantity of `quantities(model)` in that order as one column, stretch) with the
    expressions that `build` returns, made of scalar operations so that it costs one call in a larger graph.
    """
    declared = quantities(model)
    symbols = {name: ca.SX.sym(name, q.size) for name, q in declared.items()}
    stretch = ca.SX.sym("stretch")
    results = build(with_symbols(model, symbols), symbols["pressure"], symbols["gravity"], stretch)
    return ca.Function("section", [ca.vertcat(*symbols.values()), stretch], list(results), {"cse": True})


def force_unit(model: Model) -> Any:
    """Return EI / L_0^2 [N], with EI the mean bending stiffness of the section without pressure."""
    rest = deform(
        model.robot, model.material, [0.0] * model.robot.chamber_sets, 1.0, model.coefficients, model.conventions
    )
    return (rest.bending_stiffness[0] + rest.bending_stiffness[1]) / 2 / model.robot.length**2
