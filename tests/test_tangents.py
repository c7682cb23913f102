"""Intervals differentiated in machine code: the same linear algebra as the virtual machine's, for every closure."""

from __future__ import annotations

import numpy as np
import pytest

from softnlp.model.materials import material
from softnlp.model.quantities import Model
from softnlp.model.robot import robot
from softnlp.model.tip import TipContact
from softnlp.native.jit import can_compile
from softnlp.nlp.transcription import MultipleShooting
from softnlp.statics import tangents
from softnlp.statics.condensed import CondensedSolver
from softnlp.statics.loadcase import rod_functions

pytestmark = pytest.mark.skipif(not can_compile(), reason="no llvmlite")
MODEL = Model(robot("D25L60"), material("Ecoflex 00-50"))


@pytest.mark.parametrize("plane", [None, np.array([0.0, 1.0, 0.0])], ids=["in space", "in a plane"])
@pytest.mark.parametrize("closure", ["dead loads", "compliant", "rigid"])
def test_steps_are_those_of_the_virtual_machine(
    closure: str, plane: np.ndarray | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    loads = () if closure == "dead loads" else (TipContact(closure),)
    functions, slow = (rod_functions(MODEL, loads, by_machine=quick) for quick in (True, False))
    K, rng = 7, np.random.default_rng(5)
    column = np.concatenate([np.ravel(q.nominal) for q in functions.declared().values()])
    column[:3] = 0.8e5, 0.1e5, 0.0
    arc = np.asarray(functions.arc(column[: functions.section.size1_in(0)], 1.3, np.linspace(0, 1, K + 1)[None, :]))
    x = np.concatenate([[1.3], arc.T.ravel(), np.full(functions.tip_unknowns, 0.1)])
    x += 1e-3 * rng.normal(size=x.size)
    G = rng.normal(size=(x.size, 3))
    monkeypatch.setattr(tangents, "_WORTH_COMPILING", 0)
    ours, theirs = (CondensedSolver(f, MultipleShooting(K), plane) for f in (functions, slow))
    assert ours.solve(x, column, G[:, 0]) == pytest.approx(theirs.solve(x, column, G[:, 0]), rel=1e-11, abs=1e-11)
    assert tangents.tangents(functions).ready(0)
    assert not tangents.tangents(slow).ready(10**9)
    assert ours.solve_many(x, column, G) == pytest.approx(theirs.solve_many(x, column, G), rel=1e-11, abs=1e-11)
    assert ours.tip_moves(x, column) == pytest.approx(theirs.tip_moves(x, column), rel=1e-11, abs=1e-11)
    x[8] = np.nan  # of a rotation
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        ours.solve(x, column, G[:, 0])
