"""Collocation with its stages eliminated: the same linear algebra as a sparse factorisation's, for every closure."""

from __future__ import annotations

import numpy as np
import pytest

from softnlp.model.materials import material
from softnlp.model.quantities import Model
from softnlp.model.robot import robot
from softnlp.model.tip import TipContact
from softnlp.nlp.linear import SparseSolver
from softnlp.nlp.problem import compile_problem
from softnlp.nlp.transcription import Collocation
from softnlp.statics.compiled import rod_equations
from softnlp.statics.condensed_collocation import CondensedCollocation
from softnlp.statics.loadcase import load_case

MODEL = Model(robot("D25L60"), material("Ecoflex 00-50"))


@pytest.mark.parametrize(
    "method", [Collocation(4), Collocation(3, degree=2, points="radau")], ids=["Legendre", "Radau"]
)
@pytest.mark.parametrize("closure", ["dead loads", "compliant", "rigid"])
def test_steps_are_those_of_a_sparse_factorisation(closure: str, method: Collocation) -> None:
    equations = rod_equations(MODEL, () if closure == "dead loads" else (TipContact(closure),))
    functions, rng = equations.functions, np.random.default_rng(5)
    case = load_case("pose", functions, equations.declared, method)
    problem = compile_problem(list(equations.declared.values()), [case])
    p = problem.pack({"pressure": [0.8e5, 0.1e5, 0.0], "tip_force": [0.02, 0.01, -0.03]})
    x = case.arc(p[: functions.section.size1_in(0)], 1.3)
    x += 1e-2 * rng.normal(size=x.size)
    G = rng.normal(size=(x.size, 3))
    ours, theirs = CondensedCollocation(functions, method), SparseSolver(problem)
    expected = theirs.solve_many(x, p, G)
    size = np.abs(expected).max()
    assert ours.solve_many(x, p, G) == pytest.approx(expected, abs=1e-10 * size)
    assert ours.solve(x, p, G[:, 1]) == pytest.approx(expected[:, 1], abs=1e-10 * size)
    x[1 + functions.state_size + 7] = np.nan  # of a rotation at the first point
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        ours.solve(x, p, G[:, 0])
