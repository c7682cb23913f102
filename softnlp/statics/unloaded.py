"""The load case of a robot without gravity or tip load: an arc in closed form, whose stretch is the only unknown."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from softnlp.base.quantity import Quantity
from softnlp.model.quantities import quantities
from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.case import Equation
from softnlp.nlp.transcription import Transcribed
from softnlp.statics.loadcase import LoadCase, RodFunctions

_STRAIGHT = 1e-12  # bending angle [rad] below which its slope is cut off: a straight robot bends in no direction


def unloaded_case(name: str, functions: RodFunctions, given: Mapping[str, Quantity]) -> LoadCase:
    """Pose the free shape at the pressure in `given`, exactly; gravity and tip load in it are taken as zero.

    The outputs are those of `softnlp.statics.loadcase.load_case`; there are no states, so `transcribed` is empty.
    """
    model = functions.model
    N = model.chambers
    column = ca.vertcat(*(given[key].symbol for key in quantities(model)))
    stretch = ca.MX.sym("stretch")
    constants, balance, units = functions.section(column, stretch)
    L_0, F_0 = units[0], units[1]
    tip = functions.arc(column, stretch, 1.0)
    u = functions.strains(tip[:STATE_SIZE], constants)[1]

    def integral(rates: ca.Function) -> ca.MX:
        return rates(tip, constants)  # the strains of an arc are constant

    along = integral(functions.lengths)
    none = ca.MX(0, 1)
    states = none, np.zeros(0), np.zeros(0, np.intp), STATE_SIZE, none, (), none, integral
    return LoadCase(
        name=name,
        method=None,
        transcribed=Transcribed(*states, slopes=lambda moved: (ca.MX(0, 0), none)),
        functions=functions,
        given=given,
        symbols=(stretch,),
        constants=constants,
        column=column,
        residuals=balance,
        ends=(balance, none),
        fine_residuals=balance,
        equations=(Equation("stretch balance", np.array([0]), "N", F_0),),
        outputs={
            "stretch": stretch,
            "tip_position": tip[:3] * L_0,
            "tip_rotation": ca.reshape(tip[3:12], 3, 3),
            "chamber_lengths": along[:N] * L_0,
            "bending_angle": stretch * ca.sqrt(u[0] ** 2 + u[1] ** 2 + _STRAIGHT**2),
            "backbone_length": along[N + 1] * L_0,
        },
        length_unit=L_0,
        force_unit=F_0,
    )
