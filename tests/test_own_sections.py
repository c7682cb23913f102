"""Sections of one's own, through every way that a pose is solved; the law of the rod is theirs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import pi
from typing import Any

import casadi as ca
import numpy as np
import pytest
from sweeps import GRID, QUICK
from sweeps import plan as small_plan

from softnlp import (
    BAR,
    Body,
    Collocation,
    Loads,
    MultipleShooting,
    Numerics,
    Quantity,
    SectionRadii,
    SectionState,
    Segment,
    Status,
    case,
    material,
    problem,
    quantity,
    robot,
    solve,
)
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.poses import Lane
from softnlp.model.quantities import Model
from softnlp.model.round_chambers import RoundChambers, RoundState
from softnlp.model.section import RodSection, Section
from softnlp.statics.kept import pose_solver

D25, SOFT = robot("D25L60"), material("Ecoflex 00-50")
PRESSURE = np.array([0.5, 0.1, 0.0]) * BAR
LOADS = Loads(tip_force=(0.03, 0.02, -0.01), gravity=(0.0, 0.0, 9.80665))
VALUES = {"pressure": PRESSURE, "tip_force": LOADS.tip_force, "gravity": LOADS.gravity}


class Cored(RoundChambers):
    """The paper's section with an elastic rod in its lumen."""

    modulus = 2e6

    def quantities(self) -> list[Quantity]:
        own = [quantity("core.modulus", "Pa", self.modulus), quantity("core.diameter", "m", 2e-3, scale=1e-3)]
        return [*super().quantities(), *own]

    def at(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> RoundState:
        state, r, E = super().at(numbers, pressures, stretch), numbers["core.diameter"] / 2, numbers["core.modulus"]
        EI_x, EI_y = (EI + E * pi * r**4 / 4 / stretch**2 for EI in state.bending_stiffness)
        return replace(
            state,
            imbalance=state.imbalance + E * (stretch - 1) * pi * r**2,
            axial_stiffness=state.axial_stiffness + E * pi * r**2 / stretch,
            bending_stiffness=(EI_x, EI_y),
        )


class Limp(Cored):
    """The same with a core of no stiffness."""

    modulus = 0.0


class NotBySum(Limp):
    """The same, of which batches know nothing."""

    @property
    def by_sum(self) -> bool:
        return False


@pytest.mark.parametrize("method", [MultipleShooting(20), Collocation(4)], ids=["shooting", "collocation"])
def test_a_core_of_no_stiffness_changes_nothing(method: Any) -> None:
    answers = [
        solve(problem([case("pose", Body([Segment(D25, SOFT, section)]), method=method)]), VALUES)
        for section in (RoundChambers, Limp)
    ]
    for name, expected in answers[0].outputs.items():
        np.testing.assert_allclose(answers[1][name], expected, atol=1e-12, err_msg=name)
    for unloaded in (None, method):  # the closed form and the grid
        stiff = case("pose", Body([Segment(D25, SOFT, Cored)]), method=unloaded)
        found = solve(problem([stiff]), {"pressure": PRESSURE})
        model = Model(D25, SOFT, section_type=Cored)
        state = model.section.at(model.numbers, PRESSURE, float(found["stretch"][0]))
        assert abs(float(state.imbalance)) < 1e-10
        EI, M_P = state.bending_stiffness, state.pressure_moment
        curvature = np.hypot(float(M_P[0] / EI[0]), float(M_P[1] / EI[1]))
        assert found["bending_angle"][0] == pytest.approx(curvature * D25.length * found["stretch"][0], rel=1e-9)


def test_single_poses_ask_the_section() -> None:
    numerics = Numerics(engine="newton")
    plain, limp, cored = (
        pose_solver(Model(D25, SOFT, section_type=kind), numerics).solve(PRESSURE, LOADS)[0].pose
        for kind in (RoundChambers, Limp, Cored)
    )
    assert plain is not None
    assert limp is not None
    assert cored is not None
    np.testing.assert_allclose(limp.tip_position, plain.tip_position, atol=1e-12)
    assert limp.radii == plain.radii
    assert plain.stable
    assert cored.stable
    assert cored.stretch < plain.stretch - 5e-3
    assert cored.bending_angle < 0.97 * plain.bending_angle


def test_batches_ask_the_section() -> None:
    asked = small_plan(GRID + QUICK, chunk=27)
    rows = {}
    for kind in (RoundChambers, Limp, NotBySum):
        model = replace(asked.model, section_type=kind)
        rows[kind] = ChunkSolver(replace(asked, model=model)).solve(0).rows
        alone = pose_solver(model, asked.numerics.without_ipopt())
        numbers = asked.members(0)
        k = int(np.flatnonzero(rows[kind]["lane"] != Lane.PROBLEM)[-1]) if kind is not NotBySum else 5
        loads = Loads(*(tuple(asked.nominal[name]) for name in ("tip_force", "tip_moment", "gravity")))
        step = alone.solve(asked.pressures()[numbers[k]], loads)[0]
        assert step.pose is not None
        np.testing.assert_allclose(rows[kind]["tip_position"][k], step.pose.tip_position, atol=1e-3 * D25.length)
    for other in (Limp, NotBySum):
        np.testing.assert_allclose(
            rows[other]["tip_position"], rows[RoundChambers]["tip_position"], atol=2e-3 * D25.length
        )
    np.testing.assert_array_equal(rows[Limp]["lane"], rows[RoundChambers]["lane"])
    assert (rows[NotBySum]["lane"] == Lane.PROBLEM).all()


def test_what_a_section_brings_may_vary_too() -> None:
    along = {"core.diameter": (1e-3, 4e-3)}
    found = solve(problem([case("pose", Body([Segment(D25, SOFT, Cored, along)]))]), {"pressure": PRESSURE})
    assert found.status is Status.SOLVED
    model = Model(D25, SOFT, section_type=Cored)
    for s, stretch in ((0.0, found["stretch"]), (1.0, found["segment.1.tip_stretch"])):
        numbers = {**model.numbers, "core.diameter": 1e-3 + s * 3e-3}
        assert abs(float(model.section.at(numbers, PRESSURE, float(stretch[0])).imbalance)) < 1e-6
    both = Body([Segment(D25, SOFT, Cored, along), Segment(D25, SOFT, Cored)])
    assert {"segment.1.core.diameter", "segment.2.core.diameter"} <= set(both.quantities)


class Hardening(Section):
    """A bar of 1 cm^2 that gets stiffer the more it is pulled: N = E A e + c e^3, solved for e in closed form."""

    def __init__(self, bar: Any, *_: Any) -> None:
        self.bar = bar

    def quantities(self) -> Sequence[Quantity]:
        return [quantity("robot.length", "m", self.bar.length), quantity("bar.hardening", "N", 50.0)]

    def at(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> SectionState:
        E, A = 1e5, 1e-4
        return SectionState(
            imbalance=E * A * (stretch - 1),
            line_density=1000 * A,
            tangent_modulus=E,
            axial_stiffness=E * A,
            shear_stiffness=E * A / 3,
            bending_stiffness=(E * A**2 / 12, E * A**2 / 12),
            torsional_stiffness=E * A**2 / 20,
            pressure_force=0.0,
            pressure_moment=(0.0, 0.0),
            centres=(),
            chamber_stiffness=0.0,
            own=[(numbers["bar.hardening"], "N")],
        )

    def strains(self, section: RodSection, own: Sequence[Any], force: Any, moment: Any) -> tuple[Any, Any]:
        v, u = super().strains(section, own, force, moment)
        p, q = section.axial / own[0], force[2] / own[0]  # e^3 + p e = q, which has one real root
        root = ca.sqrt(q**2 / 4 + p**3 / 27)
        e = (root + q / 2) ** (1 / 3) - (root - q / 2) ** (1 / 3)
        return ca.vertcat(v[0], v[1], 1 + e), u

    def outline(self, numbers: Mapping[str, Any], stretch: Any) -> SectionRadii:
        return SectionRadii(5e-3, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("engine", ["newton", "ipopt"])
@pytest.mark.parametrize("force", [0.5, 3.0])
def test_the_law_of_the_rod_is_the_section_s(force: float, engine: Any) -> None:
    bar = replace(D25, length=0.05)
    pose = case("pose", Body([Segment(bar, SOFT, Hardening)]))
    found = solve(problem([pose]), {"tip_force": (0.0, 0.0, force)}, engine=engine)
    assert found.status is Status.SOLVED, found.message
    e = found["tip_position"][2] / 0.05 - 1
    assert 10 * e + 50 * e**3 == pytest.approx(force, rel=1e-9)
    varying = Body([Segment(bar, SOFT, Hardening, {"bar.hardening": (50.0, 50.0)})])
    same = solve(problem([case("pose", varying)]), {"tip_force": (0.0, 0.0, force)}, engine=engine)
    np.testing.assert_allclose(same["tip_position"], found["tip_position"], atol=1e-12)
