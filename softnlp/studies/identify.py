"""Identification: constants of the model from measurements of one or several robots, as one least-squares problem.

Every number measured gives a residual (model - measured) / sigma; the constants are shared by all. The poses are the
solutions of the model's equations at the trial constants, and their derivatives are exact, so this is Gauss-Newton in
a trust region (scipy's `least_squares`) on the constants alone; `softnlp.studies.identify_nlp` solves the same problem
with all poses as unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.statics.closing import DisputedError
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.wall import checked_contact
from softnlp.studies.check import Check
from softnlp.studies.forward import checked_loads
from softnlp.studies.identified import (
    Identified,
    constant_checks,
    free_constants,
    without_constants,
)
from softnlp.studies.identify_fit import Fit
from softnlp.studies.identify_nlp import closed_fit
from softnlp.studies.measurements import (
    Measurements,
    checked_measurements,
)
from softnlp.studies.predicted import Predicted
from softnlp.studies.registered import Registered, begun, checked_registration, with_registration
from softnlp.studies.registration import Registration
from softnlp.studies.tip_checks import tip_checks

Array = NDArray[np.float64]


def identify(
    measurements: Measurements | Sequence[Measurements],
    material: Material,
    free: Sequence[str],
    *,
    coefficients: Coefficients = Coefficients(),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    contact: ContactSettings = ContactSettings(),
    loads: Loads = Loads(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    progress: Callable[[int, float], None] | None = None,
    registration: Registration | None = None,
) -> Identified:
    """Find the constants that bring the model nearest to the measurements.

    Parameters
    ----------
    measurements
        Of one robot or of several that share the constants.
    material
        Where its constants start, and the values of those that are not free.
    free
        Of "k_e", "k_b", "k_a", "k_i", "phi", "k_c" and the names of the material's constants, such as "C10".
    coefficients
        The same for the stiffening, the corrections and k_c.
    bounds
        (2,) lower and upper by name, in place of the default ones [SI].
    contact, loads, conventions, numerics
        As `softnlp.blocked_force`; the same in every measurement.
    progress
        Called with the number of evaluations and the root mean square of the residuals.
    registration
        Where the sensor of the tips is and in which frame; what it fits is found together with the constants.

    Returns
    -------
    Identified
        Constants with their uncertainty; nan, with a status that says why, where the model could not be solved.

    Raises
    ------
    InputError
        For measurements, names or bounds that are not right, fewer numbers than constants, or a constant that no
        measurement depends on.
    """
    given = (measurements,) if isinstance(measurements, Measurements) else tuple(measurements)
    if not given:
        raise InputError("expected measurements of at least one robot", key="measurements")
    data = tuple(checked_measurements(m) for m in given)
    chosen = constants = free_constants(free, material, coefficients, bounds)
    count = sum(int(np.sum(d.fitted)) for d in data)
    in_base = checked_loads(loads)
    registration, clocked = checked_registration(registration, data, in_base)
    total = len(free) + (0 if registration is None else len(registration.names))
    if count < total:
        raise InputError(f"{count} numbers measured cannot determine {total} constants", key="free")
    contact = checked_contact(contact, [d.robot for d in data if np.any(d.measured[:, -1])])
    if contact.closure == "weighted" and any(np.any(d.measured[:, -1]) for d in data):
        raise InputError("expected a closure that has a definite force; 'weighted' depends on weights", key="closure")
    searching = numerics if numerics.engine == "ipopt" else numerics.without_ipopt()
    loads = in_base if clocked or registration is None else registration.in_sets(in_base)
    models = []
    for d in data:
        # Where nothing loads free shapes they are known in closed form.
        model = Model(d.robot, material, coefficients, conventions)
        poses = pose_solver(model, searching, unloaded_accuracy=searching.accuracy)
        blocked = blocked_solver(model, searching, contact) if np.any(d.measured[:, -1]) else None
        models.append(Predicted(d, poses, blocked, constants, loads, clocked))
    registered: Sequence[Predicted | Registered] = models
    if registration is not None:
        there = registration.in_sets(in_base)
        poses_there = [
            model.tips(constants.values(constants.start), d.pressure, there)
            for model, d in zip(models, data, strict=True)
        ]
        registration = begun(registration, data, poses_there)
        chosen = with_registration(constants, registration)
        registered = [Registered(model, registration, d, clocked) for model, d in zip(models, data, strict=True)]
    found = Fit(data, registered, chosen, material, coefficients, progress).solve()
    if found.status is Status.SOLVED:
        placed = None if registration is None else registration.found(found.constants[len(constants.names) :])
        fit = () if registration is None else registration.fit
        checks: list[Check] = []
        for d, after, predicted, m in zip(data, found.after, models, given, strict=True):
            tips_at = partial(predicted.tips, constants.values(constants.start))
            at = placed or Registration()
            checks += tip_checks(d, after, at, fit, tips_at, in_base, "tip_position" in m.sigma)
        found = replace(found, registration=placed, checks=(*constant_checks(found), *checks))
    if found.status is not Status.SOLVED:
        return found
    if numerics.engine == "newton":
        return replace(found, engine=numerics.engine)
    try:
        return closed_fit(found, contact, loads, conventions, numerics, registration)
    except DisputedError as error:
        lost = without_constants(found, Status.DISPUTED, str(error))
        return replace(lost, material=material, coefficients=coefficients)
