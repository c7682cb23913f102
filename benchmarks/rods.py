"""A pressurised robot as plain numbers, which is what the methods beside the package are given."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.paper_method import Array, Rod
from softnlp.base.status import Status
from softnlp.model.quantities import Model, quantities
from softnlp.model.rod import Loads
from softnlp.model.round_chambers import deform
from softnlp.statics.branch import branch_function, stretch_on_branch

NO_LOADS = Loads()


class Rods:
    """Rods of one model at any pressure. seconds : spent here so far, which no other method is charged with."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.seconds = 0.0
        self._branch = branch_function(model)
        self._nominal = {name: q.nominal for name, q in quantities(model).items()}

    def at(self, pressure: Array, loads: Loads = NO_LOADS, changed: Model | None = None) -> Rod:
        """Return the rod at a pressure (sets,) [Pa], of the model or of another of its kind.

        Raises
        ------
        ArithmeticError
            Where the stretch balance has no solution.
        """
        began = time.perf_counter()
        model = changed or self.model
        nominal: Mapping[str, Any] = self._nominal
        if changed is not None:
            nominal = {name: q.nominal for name, q in quantities(changed).items()}
        column = np.concatenate([pressure if name == "pressure" else value for name, value in nominal.items()])
        point = stretch_on_branch(self._branch, column, pressure)
        if point.status is not Status.SOLVED:
            raise ArithmeticError(point.message)
        rod = _rod(model, pressure, loads, point.stretch)
        self.seconds += time.perf_counter() - began
        return rod


def _rod(model: Model, pressure: Array, loads: Loads, stretch: float) -> Rod:
    section = deform(model.robot, model.material, pressure, stretch, model.coefficients, model.conventions)
    EI_x, EI_y = section.bending_stiffness
    w_x, w_y, w_z = (model.material.density * section.area * g for g in loads.gravity)
    return Rod(
        length=float(stretch * model.robot.length),
        EA=float(section.axial_stiffness),
        GA=float(section.shear_stiffness),
        EI=(float(EI_x), float(EI_y)),
        GJ=float(section.torsional_stiffness),
        PA=float(section.pressure_area) * pressure[list(model.robot.set_of_chamber)],
        d=np.array(section.centres, dtype=float),
        weight=(float(w_x), float(w_y), float(w_z)),
    )
