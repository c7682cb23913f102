"""The load case: the rod in its own units, equations that name the right rows, outputs in SI; arcs are solutions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
import witness
from designs import Design, random_design, silicone
from scipy.spatial.transform import Rotation
from witness_section import Section as WitnessSection

from softnlp.base.quantity import Quantity
from softnlp.model import rod
from softnlp.model.conventions import AS_PRINTED, Coefficients
from softnlp.model.load import Load
from softnlp.model.quantities import Model, force_unit
from softnlp.model.robot import ROBOTS
from softnlp.model.round_chambers import deform
from softnlp.model.section import RodSection
from softnlp.model.tip import TipContact
from softnlp.nlp.transcription import Collocation, MultipleShooting
from softnlp.statics.loadcase import LoadCase, RodFunctions, load_case, rod_functions, unpack_section

CONDITIONS: dict[str, tuple[Load, ...]] = {
    "dead": (),
    "compliant": (TipContact("compliant"),),
    "rigid": (TipContact("rigid"),),
    "held": (TipContact("rigid", wall=False),),
}


class Case(NamedTuple):
    """A load case with the values of its quantities, SI, and the units L_0 and EI / L_0^2 of its states."""

    design: Design
    functions: RodFunctions
    values: dict[str, np.ndarray]
    L_0: float
    F_0: float

    @property
    def column(self) -> np.ndarray:
        """The model's quantities, which `section` and `arc` take."""
        own = [name for name in self.values if not name.startswith("contact.")]
        return np.concatenate([self.values[name] for name in own])


def cased(seed: int, conditions: str = "dead", design: Design | None = None) -> Case:
    design = design or random_design(np.random.default_rng(seed))
    functions = rod_functions(Model(design.robot, design.material), CONDITIONS[conditions])
    values = {name: q.nominal.copy() for name, q in functions.declared().items()}
    values["pressure"] = design.pressure
    for name in ("tip_force", "tip_moment", "gravity"):
        values[name] = np.array(getattr(design.loads, name), float)
    return Case(design, functions, values, design.robot.length, float(force_unit(functions.model)))


def scaled_constants(case: Case) -> np.ndarray:
    """Return c from the witness's section, in the units of the case."""
    w, L_0, F_0 = case.design.section, case.L_0, case.F_0
    line_density = float(np.asarray(case.values["material.density"])[0]) * w.A
    return np.array(
        [
            w.GA / F_0, w.EA / F_0, *(EI / F_0 / L_0**2 for EI in w.EI), w.GJ / F_0 / L_0**2, w.F_P / F_0,
            *(w.M_P[:2] / F_0 / L_0), line_density * L_0 / F_0, w.stretch, *case.values["gravity"],
            *(w.d / L_0).ravel(),
            w.E_t * np.pi * w.r_co**2 / F_0,
        ]
    )  # fmt: skip


def plain(value: Any) -> np.ndarray:
    return np.asarray(ca.DM(value)).ravel()


@pytest.mark.parametrize("seed", range(5))
def test_the_constants_are_the_witness_s_section_in_the_units_of_the_robot(seed: int) -> None:
    case = cased(seed)
    c, balance, units = case.functions.section(case.column, case.design.section.stretch)
    np.testing.assert_allclose(plain(units), [case.L_0, case.F_0], rtol=1e-13)
    np.testing.assert_allclose(plain(c), scaled_constants(case), rtol=1e-8, atol=1e-9)
    # the stretch is the one at equilibrium; elsewhere the balance is what the silicone lacks
    assert float(balance) == pytest.approx(0.0, abs=1e-7 * case.design.section.F_P / case.F_0)
    further = float(case.functions.section(case.column, 1.1 * case.design.section.stretch)[1])
    assert further * case.F_0 > 1e-2 * case.design.section.F_P
    assert unpack_section(plain(c))._fields == RodSection._fields
    assert list(unpack_section(plain(c))) == list(plain(c)[:10])


def test_the_section_follows_the_model_s_coefficients_and_readings() -> None:
    robot, coefficients = ROBOTS["D15L60"], Coefficients(0.3, 1.1, 0.97, 1.02, 0.2)
    model = Model(robot, silicone("Ecoflex 00-30"), coefficients, AS_PRINTED)
    functions = rod_functions(model)
    values = {name: q.nominal for name, q in functions.declared().items()}
    values["pressure"] = np.array([4e4, 2e4, 0.0])
    c, balance, _ = functions.section(np.concatenate(list(values.values())), 1.2)
    made = deform(robot, model.material, values["pressure"], 1.2, coefficients, AS_PRINTED)
    F_0 = float(force_unit(model))
    assert plain(c)[1] * F_0 == pytest.approx(float(made.axial_stiffness), rel=1e-12)
    assert plain(c)[3] * F_0 * robot.length**2 == pytest.approx(float(made.bending_stiffness[1]), rel=1e-12)
    expected = float(made.imbalance)
    assert float(balance) * F_0 == pytest.approx(expected, rel=1e-12)
    other = deform(robot, model.material, values["pressure"], 1.2, coefficients)
    assert expected != pytest.approx(float(other.imbalance), rel=1e-3)


def random_state(seed: int, section: WitnessSection) -> tuple[np.ndarray, np.ndarray]:
    """Return a state with the total N and M in the package's order, and with the wall's n and m in the witness's."""
    rng = np.random.default_rng(seed)
    R = Rotation.random(random_state=rng).as_matrix()
    p, n, m = rng.normal(size=(3, 3))
    theirs = np.zeros((20 + len(section.PA), 1))
    theirs[:18, 0] = np.concatenate([p, R.ravel(), n, m])
    return np.concatenate([p, R.T.ravel(), n - section.F_P * R[:, 2], m - R @ section.M_P]), theirs


@pytest.mark.parametrize("conditions", ["dead", "compliant"])
def test_field_and_lengths_are_rates_by_s_over_L(conditions: str) -> None:
    for seed in range(4):
        case = cased(seed, conditions)
        sec, N = case.design.section, len(case.design.section.PA)
        problem = replace(
            witness.scaled(sec).sec,
            EA=sec.EA / case.F_0,
            GA=sec.GA / case.F_0,
            EI=tuple(EI / case.F_0 / case.L_0**2 for EI in sec.EI),
            GJ=sec.GJ / case.F_0 / case.L_0**2,
            PA=sec.PA / case.F_0,
            d=sec.d / case.L_0,
        )
        x, theirs = random_state(seed, problem)
        c = scaled_constants(case)
        expected = c[9] * witness._field(problem, c[8] * c[10:13], theirs, True)[:, 0]
        dR = expected[3:12].reshape(3, 3)
        expected[12:15] -= problem.F_P * dR[:, 2]
        expected[15:18] -= dR @ problem.M_P
        with_lengths = conditions != "dead"
        assert case.functions.state_size == 18 + N * with_lengths
        full = np.concatenate([x, np.zeros(N * with_lengths)])
        found = plain(case.functions.field(full, c))
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found[:3], expected[:3], atol=1e-12 * scale)
        np.testing.assert_allclose(found[3:12].reshape(3, 3).T.ravel(), expected[3:12], atol=1e-12 * scale)
        np.testing.assert_allclose(found[12:18], expected[12:18], atol=1e-12 * scale)
        np.testing.assert_allclose(found[18:], expected[20:] if with_lengths else [], atol=1e-12 * scale)
        rates = plain(case.functions.lengths(full, c))
        np.testing.assert_allclose(rates, [*expected[20:], expected[18], expected[19]], atol=1e-12 * scale)


@pytest.mark.parametrize("conditions", ["dead", "rigid"])
def test_the_arc_is_the_closed_form(conditions: str) -> None:
    for seed in range(4):
        case = cased(seed, conditions)
        sec, L_0 = case.design.section, case.L_0
        tip = plain(case.functions.arc(case.column, sec.stretch, 1.0))
        exact = witness.arc(sec)
        np.testing.assert_allclose(tip[:3] * L_0, exact["tip_position"], atol=1e-8 * L_0)
        np.testing.assert_allclose(tip[3:12].reshape(3, 3).T, exact["tip_rotation"], atol=1e-7)
        for s in (0.0, 0.3, 1.0):
            x = plain(case.functions.arc(case.column, sec.stretch, s))
            assert x.size == case.functions.state_size
            np.testing.assert_allclose(x[18:] * L_0, s * exact["chamber_lengths"][: x.size - 18], rtol=1e-7)


def evaluated(case: Case, name: str, method: Any) -> tuple[LoadCase, ca.Function, Mapping[str, Quantity]]:
    given = case.functions.declared()
    made = load_case(name, case.functions, given, method)
    scales = ca.vertcat(*(e.si_scale for e in made.equations))
    symbols = [*made.symbols, *(q.symbol for q in given.values())]
    every = [made.residuals, made.fine_residuals, scales, *made.outputs.values(), made.constants]
    return made, ca.Function("f", symbols, [*every, made.length_unit, made.force_unit]), given


def arcs(case: Case, made: LoadCase) -> np.ndarray:
    points = made.transcribed.points
    return np.asarray(case.functions.arc(case.column, case.design.section.stretch, points[None, :])).T.ravel()


def free_of_loads(seed: int, conditions: str) -> Case:
    case = cased(seed, conditions)
    for name in ("tip_force", "tip_moment", "gravity"):
        case.values[name] = np.zeros(3)
    lengths = witness.arc(case.design.section)["chamber_lengths"]
    for name, value in {"contact.free_lengths": lengths, "contact.pressed": 1.0 * (case.design.section.PA > 0)}.items():
        if name in case.values:
            case.values[name] = np.asarray(value)
    if "contact.wall_point" in case.values:  # a wall that the arc just touches
        case.values["contact.wall_point"] = np.asarray(witness.arc(case.design.section)["tip_position"])
    return case


@pytest.mark.parametrize("conditions", list(CONDITIONS))
@pytest.mark.parametrize("method", [MultipleShooting(64), Collocation(12, 5)], ids=["shooting", "collocation"])
def test_the_unloaded_arc_solves_every_equation(conditions: str, method: Any) -> None:
    case = free_of_loads(1, conditions)
    made, function, _ = evaluated(case, "free", method)
    y = [np.zeros(case.functions.tip_unknowns)] if case.functions.tip_unknowns else []
    at = [case.design.section.stretch, arcs(case, made), *y, *case.values.values()]
    rows, fine, scales, *rest = (np.asarray(value) for value in function(*at))
    outputs = dict(zip(made.outputs, rest, strict=False))
    assert made.name == "free"
    assert made.functions is case.functions
    assert len(made.symbols) == 2 + bool(y)
    assert sum(s.numel() for s in made.symbols) == rows.size
    assert np.abs(rows).max() < 1e-5  # the discretisation's error in each interval
    assert np.abs(fine).max() < np.abs(rows).max() / 8
    exact = witness.arc(case.design.section)
    np.testing.assert_allclose(outputs["tip_position"].ravel(), exact["tip_position"], atol=1e-7 * case.L_0)
    np.testing.assert_allclose(outputs["tip_rotation"], exact["tip_rotation"], atol=1e-7)
    np.testing.assert_allclose(outputs["chamber_lengths"].ravel(), exact["chamber_lengths"], rtol=2e-7)
    assert outputs["bending_angle"].item() == pytest.approx(float(exact["bending_angle"]), rel=1e-7)
    assert outputs["backbone_length"].item() == pytest.approx(case.design.section.L, rel=1e-7)  # v = e3
    assert outputs["stretch"].item() == case.design.section.stretch
    assert ("tip_forces" in outputs) == bool(y)
    np.testing.assert_allclose(plain(rest[-3]), scaled_constants(case), rtol=1e-8, atol=1e-9)
    assert (rest[-2].item(), rest[-1].item()) == pytest.approx((case.L_0, case.F_0), rel=1e-13)
    assert scales.size == len(made.equations)


@pytest.mark.parametrize("conditions", list(CONDITIONS))
@pytest.mark.parametrize("method", [MultipleShooting(3), Collocation(2, 2)], ids=["shooting", "collocation"])
def test_the_equations_name_every_row_once_with_its_unit(conditions: str, method: Any) -> None:
    case = free_of_loads(2, conditions)
    made, function, _ = evaluated(case, "named", method)
    names = [e.name for e in made.equations]
    assert len(set(names)) == len(names)
    np.testing.assert_array_equal(
        np.sort(np.concatenate([e.rows for e in made.equations])), np.arange(made.residuals.numel())
    )
    y = [np.zeros(case.functions.tip_unknowns)] if case.functions.tip_unknowns else []
    results = function(case.design.section.stretch, arcs(case, made), *y, *case.values.values())
    si = {"N": case.F_0, "N m": case.F_0 * case.L_0, "m": case.L_0, "1": 1.0}
    np.testing.assert_allclose(plain(results[2]), [si[e.unit] for e in made.equations], rtol=1e-12)
    units = {e.name: e.unit for e in made.equations}
    K, stages, N = method.intervals, getattr(method, "degree", 0), case.design.robot.chambers
    sizes = {e.name: e.rows.size for e in made.equations}
    expected = {
        "stretch balance": ("N", 1), "base position": ("m", 3), "base orientation": ("1", 9), "tip force": ("N", 3),
        "tip moment": ("N m", 3),
    }  # fmt: skip
    blocks = {"position": ("m", 3), "rotation": ("1", 9), "force": ("N", 3), "moment": ("N m", 3)}
    if conditions != "dead":
        expected["base chamber length"] = ("m", N)
        blocks["chamber length"] = ("m", N)
    for block, (unit, size) in blocks.items():
        expected[f"continuity of {block}"] = (unit, K * size)
        if stages:
            expected[f"collocation of {block}"] = (unit, K * stages * size)
    expected |= {name: (unit, 1) for load in case.functions.loads for name, unit in load.equations.items()}
    assert {name: (units[name], sizes[name]) for name in names} == expected


@pytest.mark.parametrize("conditions", ["dead", "rigid"])
@pytest.mark.parametrize("method", [MultipleShooting(4), Collocation(3, 2)], ids=["shooting", "collocation"])
def test_each_equation_answers_to_its_own_part_of_the_state(conditions: str, method: Any) -> None:
    # the first state moves the base's equations, the last one continuity there and the tip's, block by block
    case = free_of_loads(3, conditions)
    made, function, _ = evaluated(case, "moved", method)
    y = [np.zeros(case.functions.tip_unknowns)] if case.functions.tip_unknowns else []
    states, nx = arcs(case, made), case.functions.state_size
    blocks = {**rod.STATE_BLOCKS, **({"chamber length": slice(18, nx)} if nx > 18 else {})}
    base = {"position": "base position", "rotation": "base orientation", "chamber length": "base chamber length"}

    def answering(change: np.ndarray) -> dict[str, np.ndarray]:
        at = [case.design.section.stretch, states, *y, *case.values.values()]
        before = plain(function(*at)[0])
        at[1] = states + change
        moved = plain(function(*at)[0]) - before
        return {e.name: moved[e.rows] for e in made.equations if np.abs(moved[e.rows]).max() > 1e-13}

    for block, where in blocks.items():
        change = np.zeros_like(states)
        change[where] = 1e-3 * np.arange(1, where.stop - where.start + 1)
        answer = answering(change)
        assert {name for name in answer if name.startswith("base")} == ({base[block]} if block in base else set())
        if block in base:
            np.testing.assert_allclose(answer[base[block]], change[where], rtol=1e-9)
        assert f"continuity of {block}" in answer
        change = np.zeros_like(states)
        change[len(states) - nx :][where] = 1e-3
        answer = answering(change)
        gaps = {name for name in answer if name.startswith("continuity")}
        assert gaps == {f"continuity of {block}"}
        np.testing.assert_allclose(answer[f"continuity of {block}"][-(where.stop - where.start) :], -1e-3, rtol=1e-9)
        assert not {name for name in answer if name.startswith("base")}
        tip = {name for name in answer if name in ("tip force", "tip moment", "contact gap", "chamber length")}
        assert (
            tip
            == {
                "position": {"contact gap"} if nx > 18 else set(),
                "rotation": set(),  # a dead load does not turn with the tip
                "force": {"tip force"},
                "moment": {"tip moment"},
                "chamber length": {"chamber length"},
            }[block]
        )


def test_loads_and_forces_of_the_tip_come_in_si() -> None:
    case = free_of_loads(4, "rigid")
    made, function, _ = evaluated(case, "loaded", MultipleShooting(4))
    names = [e.name for e in made.equations]
    rows = {name: made.equations[names.index(name)].rows for name in names}
    still = [case.design.section.stretch, arcs(case, made), np.zeros(2), *case.values.values()]
    before = plain(function(*still)[0])
    case.values["tip_force"] = np.array([0.3, -0.2, 0.1])
    case.values["tip_moment"] = np.array([4e-3, 5e-3, -6e-3])
    left_n, left_m = np.array([0.02, 0.01, -0.03]), np.array([1e-3, 2e-3, -1e-3])
    case.values["contact.force_error"], case.values["contact.moment_error"] = left_n, left_m
    y = np.array([0.7, -0.4])
    results = function(*still[:2], y, *case.values.values())
    moved = plain(results[0]) - before
    R = np.asarray(witness.arc(case.design.section)["tip_rotation"])
    pressed = case.values["contact.pressed"]
    push, pull = y[0] * case.F_0 * np.array([1.0, 0.0, 0.0]), y[1] * case.F_0 * pressed
    arms = sum(np.cross([*d, 0.0], [0, 0, a]) for d, a in zip(case.design.section.d, pull, strict=True))
    force = case.values["tip_force"] + push + pull.sum() * R[:, 2] + left_n
    np.testing.assert_allclose(moved[rows["tip force"]] * case.F_0, -force, rtol=1e-6)
    moment = case.values["tip_moment"] + R @ arms + left_m
    np.testing.assert_allclose(moved[rows["tip moment"]] * case.F_0 * case.L_0, -moment, rtol=1e-5, atol=1e-9)
    forces = dict(zip(made.outputs, results[3:], strict=False))["tip_forces"]
    np.testing.assert_allclose(plain(forces), y * case.F_0, rtol=1e-12)


@pytest.mark.parametrize("conditions", list(CONDITIONS))
def test_what_is_declared_is_what_is_taken(conditions: str) -> None:
    functions = cased(5, conditions).functions
    taken = [name for name in functions.declared() if name.startswith("contact.")]
    assert bool(taken) == (conditions != "dead")
    assert functions.tip_unknowns == sum(len(load.unknowns) for load in CONDITIONS[conditions])
    assert functions.tip.size1_out(0) == 6 + functions.tip_unknowns
    assert functions.tip.size1_in(3) == 6 + sum(functions.declared()[name].size for name in taken)
    assert functions.contact.n_out() == (3 if taken else 0)


def test_what_is_judged_of_a_contact_is_reaction_length_error_and_gap() -> None:
    case = free_of_loads(6, "compliant")
    sec, L_0, F_0 = case.design.section, case.L_0, case.F_0
    short = 0.9 * case.values["contact.free_lengths"]
    x = plain(case.functions.arc(case.column, sec.stretch, 1.0))
    x[18:] = short / L_0
    x[0] += 2e-3 / L_0
    a = case.functions.tip_numbers(np.concatenate(list(case.values.values())))
    T, e_L, e_h = case.functions.contact(x, scaled_constants(case), [0.0], a, [L_0, F_0])
    pressed = sec.PA > 0
    expected = np.where(pressed, 1.45 * sec.E_t * np.pi * sec.r_co**2 * 0.1, 0.0)
    np.testing.assert_allclose(plain(T) * F_0, expected, rtol=1e-7)
    assert float(e_L) * L_0 == pytest.approx(sum(short[pressed]) / 9, rel=1e-7)
    assert float(e_h) * L_0 == pytest.approx(2e-3, rel=1e-5)


def test_a_case_may_have_a_pressure_of_its_own() -> None:
    model = Model(ROBOTS["D20L40"], silicone("Ecoflex 00-50"), Coefficients())
    functions = rod_functions(model)
    given = functions.declared()
    own = replace(given["pressure"], name="own", symbol=ca.MX.sym("own", 3))
    made = load_case("own", functions, {**given, "pressure": own}, MultipleShooting(2))
    assert ca.depends_on(made.residuals, own.symbol)
    assert not ca.depends_on(made.residuals, given["pressure"].symbol)
