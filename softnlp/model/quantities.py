"""Physical quantities as named symbols: one model whose numbers may be fixed, swept or unknown."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.dead_tip import DeadTip
from softnlp.model.model import Model as Model
from softnlp.model.round_chambers import with_numbers
from softnlp.model.tip import TipContact
from softnlp.model.weight import Weight

LOADS = ("tip_force", "tip_moment", "gravity")
"""Keys of the loads that every model has."""
OF_ROBOT = ("robot.", "rings.")
"""What the keys begin with that are of one robot; the others are of its silicone, or shared."""


def quantities(model: Model) -> dict[str, Quantity]:
    """Return every quantity of the model by name, with the model's values as nominal ones.

    "pressure" (one entry a set, Pa), "tip_force" (N), "tip_moment" (N m), "gravity" (m/s^2), then those of the section,
    see `softnlp.model.round_chambers.RoundChambers.quantities`.
    """
    pressure = quantity("pressure", "Pa", np.zeros(model.sets), scale=1e5, lower=0.0)
    loads = [*DeadTip().quantities(model), *Weight().quantities(model)]
    return {q.name: q for q in (pressure, *loads, *model.section.quantities())}


def differentiable(model: Model) -> dict[str, Quantity]:
    """Return the quantities by which a derivative says how the model answers.

    Those of rings follow from the dimensions, so that with rings none of these but the length is such a one.
    """
    fixed = OF_ROBOT if model.conventions.rings is not None else OF_ROBOT[1:]
    return {k: q for k, q in quantities(model).items() if k == "robot.length" or not k.startswith(fixed)}


def contact_quantities(model: Model) -> dict[str, Quantity]:
    """Return the quantities of a wall and a closure by name, "contact." and a field of `softnlp.model.tip.Given`."""
    return {q.name: q for q in TipContact("free").quantities(model)}


def with_symbols(model: Model, values: Mapping[str, Any]) -> Model:
    """Return the model with the named quantities (see `quantities`) in place of its numbers."""
    numbers = with_numbers(model.robot, model.material, model.coefficients, values)
    return Model(*numbers, model.conventions, model.section_type)


def section_function(declared: Mapping[str, Quantity], build: Callable[[Any, Any], Sequence[Any]]) -> ca.Function:
    """Compile `build(numbers, stretch)` for symbols in place of numbers, by the keys of what is declared.

    Returns a function of (every quantity declared, in that order as one column, stretch) with the expressions that
    `build` returns, made of scalar operations so that it costs one call in a larger graph.
    """
    symbols = {name: ca.SX.sym(name, q.size) for name, q in declared.items()}
    stretch = ca.SX.sym("stretch")
    return ca.Function(
        "section", [ca.vertcat(*symbols.values()), stretch], list(build(symbols, stretch)), {"cse": True}
    )


def force_unit(model: Model, numbers: Mapping[str, Any] | None = None) -> Any:
    """Return EI / L_0^2 [N], with EI the mean bending stiffness of the section without pressure, or near to it.

    numbers : of the section by key, symbols perhaps; None are the model's own.
    """
    own = model.numbers if numbers is None else numbers
    return model.section.bending_at_rest(own) / own["robot.length"] ** 2
