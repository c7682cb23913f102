"""Single poses by machine code: the same pose, grid, estimates and certificate as the general solver's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import material
from softnlp.model.numerics import EngineName, Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import robot
from softnlp.model.rod import Loads
from softnlp.native.jit import can_compile
from softnlp.statics import compiled
from softnlp.statics.pose import _graded, bending_angle, between_nodes, shape_function
from softnlp.statics.single_shooting import SingleShooting
from softnlp.statics.solver import PoseSolver

Array = NDArray[np.float64]

pytestmark = pytest.mark.skipif(not can_compile(), reason="no llvmlite")
D25 = Model(robot("D25L60"), material("Ecoflex 00-50"))
_CLOSE = 6e-12  # [m], 1e-10 of the length
LOADED = Loads(tip_force=(0.05, -0.03, 0.02), tip_moment=(0.0, 1e-3, 5e-4), gravity=(0.0, 0.0, -9.81))


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "_WORTH_COMPILING", 0)


def both(model: Model, engine: EngineName = "newton", **chosen: object) -> tuple[PoseSolver, PoseSolver]:
    numerics = replace(Numerics(engine=engine), **chosen)  # type: ignore[arg-type]
    return PoseSolver(model, numerics), PoseSolver(
        model, numerics, equations=compiled.rod_equations(model, by_machine=False)
    )


def drawn(seed: int) -> tuple[Model, Loads, Array]:
    rng = np.random.default_rng(seed)
    chosen = robot(str(rng.choice(["D10L60", "D15L40", "D20L60", "D25L60"])))
    silicone = material(
        *[("Ecoflex 00-50", "mooney-rivlin"), ("Ecoflex 00-30", "ogden"), ("Dragon Skin 10", "yeoh")][seed % 3]
    )
    size = 10 ** rng.uniform(-2.5, -0.5)
    gravity = 9.81 * rng.normal(size=3) * (seed % 2)
    loads = Loads(0.3 * size * rng.normal(size=3), 1e-2 * size * rng.normal(size=3), gravity)
    return (
        Model(chosen, silicone, Coefficients()),
        loads,
        rng.uniform(0.2, 1.0) * 1e5 * rng.random((3, 3))[:, : chosen.chamber_sets],
    )


@pytest.mark.parametrize("seed", range(12))
def test_poses_are_those_of_the_general_solver(seed: int) -> None:
    """Cold, then each from the last; what machine code is not certain of is left to the general solver."""
    model, loads, pressures = drawn(seed)
    quick, general = both(model)
    near, before = None, None
    for P in pressures:
        step, near = quick.solve(P, loads, near)
        expected, before = general.solve(P, loads, before)
        assert step.status is expected.status
        if step.pose is None or expected.pose is None:
            continue
        assert step.intervals == expected.intervals
        assert step.warnings == expected.warnings
        assert step.pose.stable is expected.pose.stable
        for name, close in (("tip_position", _CLOSE), ("tip_displacement", _CLOSE), ("chamber_length", _CLOSE)):
            assert getattr(step.pose, name) == pytest.approx(getattr(expected.pose, name), abs=close), name
        assert step.pose.bending_angle == pytest.approx(expected.pose.bending_angle, abs=1e-9)
        assert step.pose.shape.moment == pytest.approx(expected.pose.shape.moment, abs=1e-10)
        assert step.discretisation_error == pytest.approx(expected.discretisation_error, rel=0.05, abs=1e-10)


def test_the_certificate_has_every_equation_and_holds() -> None:
    quick, general = both(D25)
    P = np.array([0.6e5, 0.2e5, 0.0])
    (step, found), (expected, _) = quick.solve(P, LOADED), general.solve(P, LOADED)
    assert found is not None
    assert found.shot is not None
    assert [(line.equation, line.unit) for line in step.certificate] == [
        (e.equation, e.unit) for e in expected.certificate
    ]
    assert step.residual == max(line.scaled for line in step.certificate) <= 1e-10
    # The whole problem, as the general solver poses it, evaluated at these unknowns.
    everything = np.asarray(found.grid.problem.residual(found.solution.x, found.solution.p))
    assert np.abs(everything).max() <= 1e-10


def test_ipopt_closes_what_machine_code_proposes() -> None:
    quick, general = both(D25, "auto")
    P = np.array([0.6e5, 0.2e5, 0.0])
    (step, found), (expected, _) = quick.solve(P, LOADED), general.solve(P, LOADED)
    assert step.ipopt is not None
    assert step.ipopt.status == "Solve_Succeeded"
    assert found is not None
    assert found.solution.engine_status == "single shooting converged"
    assert step.pose is not None
    assert expected.pose is not None
    assert step.pose.tip_position == pytest.approx(expected.pose.tip_position, abs=_CLOSE)


@pytest.mark.parametrize(("intervals", "accuracy"), [(7, 1e-6), (None, 1e-9)])
def test_grids_are_those_asked_for(intervals: int | None, accuracy: float) -> None:
    quick, general = both(D25, intervals=intervals, accuracy=accuracy)
    P = np.array([0.9e5, 0.0, 0.0])
    (step, found), (expected, _) = quick.solve(P, LOADED), general.solve(P, LOADED)
    assert found is not None
    assert found.shot is not None
    assert step.intervals == expected.intervals
    assert step.warnings == expected.warnings


def test_what_is_not_certain_is_left_to_the_general_solver() -> None:
    """A column that has buckled is straight and unstable; a section beyond the end of its branch has none."""
    quick, _ = both(D25)
    step, found = quick.solve(np.zeros(3), Loads(tip_force=(0.0, 0.0, -2.0)))
    assert found is None or found.shot is None
    assert step.pose is None or step.pose.stable is False
    quick, _ = both(Model(robot("D10L60"), material("Ecoflex 00-30", "neo-hookean"), Coefficients(elongation=0)))
    step, found = quick.solve(np.array([9e5, 9e5, 9e5]), Loads())
    assert step.status is Status.UNSTABLE_MATERIAL
    assert found is None


def test_it_is_compiled_once_it_pays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "_WORTH_COMPILING", 3)
    solver, _ = both(D25)
    by_machine = []
    for k in range(5):
        _, found = solver.solve(np.array([1e4 * k, 0.0, 0.0]), LOADED)
        by_machine.append(found is not None and found.shot is not None)
    assert by_machine[:2] == [False, False]
    assert by_machine[-1]


def test_the_arc_s_tip_is_that_of_the_rod() -> None:
    solver, _ = both(D25)
    single = solver.equations.single_shooting()
    assert isinstance(single, SingleShooting)
    for P in ([0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [1e5, 0.3e5, 0.0]):
        column = solver.column(solver.values(np.array(P), Loads()))
        at = single.at_stretch(column)
        assert at is not None
        arc = np.asarray(solver.functions.arc(column, at.stretch, 1.0)).ravel()[:3]
        assert at.arc_tip == pytest.approx(arc, abs=1e-14)


def test_a_smooth_curvature_s_integral_is_that_of_the_graded_quadrature(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the curvature changes little over an interval its norm needs no grades."""
    solver, _ = both(D25, intervals=12)
    _, found = solver.solve(np.array([0.8e5, 0.1e5, 0.0]), LOADED)
    assert found is not None
    quick = bending_angle(solver.shape, found.nodes, found.constants)
    monkeypatch.setattr("softnlp.statics.pose._LITTLE", 0.0)
    assert quick == pytest.approx(bending_angle(solver.shape, found.nodes, found.constants), abs=1e-12)
    assert _graded(np.ones((2, 3, 6))) == pytest.approx(np.full(3, np.sqrt(2)))


def test_shapes_between_nodes_are_those_of_the_virtual_machine() -> None:
    quick, _ = both(D25)
    _, found = quick.solve(np.array([0.8e5, 0.1e5, 0.0]), LOADED)
    assert found is not None
    s, machine = np.linspace(0, 1, 61), shape_function(quick.functions)
    ours, theirs = (between_nodes(f, found.nodes, found.constants, s) for f in (quick.shape, machine))
    assert ours == pytest.approx(theirs, abs=1e-13)
