"""From a solution of a pose to a step in SI units, with its certificate."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.nlp.solver import certificate, outputs
from softnlp.statics.compiled import RodEquations
from softnlp.statics.pose import pose_of, pose_warnings, shape_and_bend, shape_of, stability
from softnlp.statics.pose_grid import Solved
from softnlp.statics.proposed import certificate as certificate_of
from softnlp.statics.proposed import outputs_of
from softnlp.statics.step import Step

Array = NDArray[np.float64]


def solved_step(
    equations: RodEquations,
    model: Model,
    numerics: Numerics,
    pressure: Array,
    loads: Loads,
    solved: Solved,
    iterations: int,
    began: float,
) -> Step:
    """Return the step of a solved pose. began : when its solve did, by `time.perf_counter`."""
    solution = solved.solution
    if solved.shot is not None:
        at, _ = solved.shot
        result, lines = outputs_of(*solved.shot), certificate_of(*solved.shot)
        L_0, F_0, arc_tip = at.length_unit, at.force_unit, at.arc_tip
    else:
        problem = solved.grid.problem
        result, lines = outputs(problem, solution), certificate(problem, solution)
        L_0, F_0 = (float(v) for v in np.asarray(problem.units(solution.x, solution.p)).ravel())
        arc_tip = np.asarray(equations.functions.arc(solution.p, float(result["stretch"][0]), 1.0)).ravel()[:3]
    fine = solved.shot is not None and numerics.intervals is None
    s, values, bending = shape_and_bend(equations.shape, solved.nodes, solved.constants, fine=fine)
    shape = shape_of(values, s, L_0, F_0)
    pose = pose_of(model, result, shape, bending, arc_tip * L_0, stability(loads, solved.stable))
    warnings = list(pose_warnings(model, pose))
    if solved.error > numerics.accuracy:
        warnings.append(
            f"estimated discretisation error {solved.error:.2g} of the length is above the accuracy asked for with "
            f'{solved.intervals} intervals; set [solver] intervals = "auto" or a larger number'
        )
    return Step(
        pressure=pressure,
        status=Status.SOLVED,
        message=Status.SOLVED.advice,
        pose=pose,
        residual=solution.residual,
        certificate=lines,
        discretisation_error=solved.error,
        intervals=solved.intervals,
        iterations=iterations,
        solve_time=time.perf_counter() - began,
        warnings=tuple(warnings),
        engine=numerics.engine,
        ipopt=solution.ipopt,
    )
