"""Solving further poses of a finished sweep's robot, from the tables that its file carries."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.inputs import loads_of_table
from softnlp.model.materials import material_from_table
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.statics.step import Run, Step
from softnlp.studies.forward import forward
from softnlp.sweep.read import Workspace
from softnlp.sweep.summary import varied_besides_pressure

Array = NDArray[np.float64]


def model_of(workspace: Workspace) -> tuple[Model, Loads]:
    """Return the robot, silicone and loads that every pose of a sweep shares.

    Raises
    ------
    InputError
        When poses differ in more than pressure, when they stand at a wall, or when the file does not tell the model in
        full (a law of one's own).
    """
    source = str(workspace.file)
    if varied := varied_besides_pressure(workspace):
        raise InputError(f"expected a sweep of pressures alone; this varies {', '.join(varied)} too", source=source)
    if "contact" in workspace.attributes:
        raise InputError("expected a sweep of free poses; this one stands at a wall", source=source)
    try:
        tables = workspace.attributes
        made = material_from_table(tables["material"])
        known = {f.name for f in fields(Coefficients)}
        coefficients = Coefficients(**{k: float(v) for k, v in tables["coefficients"].items() if k in known})
        conventions = _conventions(tables["conventions_in_full"])
        return Model(workspace.robot, made, coefficients, conventions), loads_of_table(tables["loads"])
    except (KeyError, TypeError, ValueError) as error:
        reason = error.message if isinstance(error, InputError) else f"no {error}"
        raise InputError(f"the file does not tell the model in full: {reason}", source=source) from None


def solve_again(workspace: Workspace, pressures: Array, progress: Callable[[int, Step], None] | None = None) -> Run:
    """Solve the poses at further pressures (M, sets) [Pa] of a sweep's robot.

    Raises
    ------
    InputError
        As `model_of`.
    """
    model, loads = model_of(workspace)
    return forward(
        model.robot,
        model.material,
        pressures,
        loads=loads,
        coefficients=model.coefficients,
        conventions=model.conventions,
        progress=progress,
    )


def _conventions(table: Mapping[str, Any]) -> Conventions:
    """Return the conventions of a `conventions_table`; KeyError or TypeError where one is missing."""
    values = dict(table)
    values["fibre_thickness"] = float(values.pop("fibre_thickness_mm")) * MILLIMETRE
    return Conventions(**values)
