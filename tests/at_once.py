"""Identification by IPOPT alone, with all poses as unknowns of one NLP: what `softnlp.identify` is held against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.nlp.solver import Engine
from softnlp.statics.wall import checked_contact
from softnlp.studies.forward import checked_loads
from softnlp.studies.identified import free_constants
from softnlp.studies.identify_nlp import TOLERANCE, AtOnce
from softnlp.studies.measurements import RELATIVE_NOISE, Measurements, checked_measurements


@dataclass(frozen=True, eq=False)
class IdentifiedAtOnce:
    """What the NLP gave. constants : by name as asked, SI, nan unless solved. cost : half the sum of squares.

    status : "not_optimal" where the poses hold but the sum of squares is not at a minimum. residual : largest scaled
    violation of any equation, evaluated again.
    """

    status: Status
    constants: Mapping[str, float]
    cost: float
    residual: float
    iterations: int


def identify_at_once(
    measurements: Measurements | Sequence[Measurements],
    material: Material,
    free: Sequence[str],
    *,
    coefficients: Coefficients = Coefficients(),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    contact: ContactSettings = ContactSettings(),
    loads: Loads = Loads(),
    conventions: Conventions = REPRODUCTION,
    intervals: int = 20,
) -> IdentifiedAtOnce:
    """Find the constants as `softnlp.studies.identify.identify` does, with all poses as unknowns of one NLP.

    The arguments are those of `identify`; intervals : of every rod. It starts from the poses at the first constants.
    The bending angle of a straight shape, which has no derivative, is left out.

    Raises
    ------
    InputError
        As `identify`, and where a measurement has no pose at the start.
    """
    given = (measurements,) if isinstance(measurements, Measurements) else tuple(measurements)
    chosen = free_constants(free, material, coefficients, bounds)
    nlp = AtOnce(chosen, Numerics(intervals=intervals))
    loads, contact = checked_loads(loads), checked_contact(contact)
    for k, m in enumerate(given):
        data = checked_measurements(m)
        nlp.add_robot(data, Model(data.robot, material, coefficients, conventions), contact, loads, f"robot {k + 1}")
    problem = nlp.compiled()
    p = nlp.packed(problem)
    solution = Engine(problem, tolerance=TOLERANCE).solve(p, nlp.start(problem, chosen.start))
    cost = float(ca.Function("cost", [problem.nlp["x"], problem.nlp["p"]], [problem.nlp["f"]])(solution.x, p))
    cost /= RELATIVE_NOISE**2
    holds = solution.holds(nlp.numerics.tolerance)
    solved = holds and solution.optimal
    found = problem.free_values(solution.x)
    constants = {
        name: float(found[q][0]) if solved else float("nan")
        for name, q in zip(chosen.names, chosen.quantities, strict=True)
    }
    status = Status.SOLVED if solved else Status.NOT_OPTIMAL if holds else Status.DIVERGED
    return IdentifiedAtOnce(status, constants, cost if solved else float("nan"), solution.residual, solution.iterations)
