"""Sensitivities: against central differences, beam theory, similarity, symmetry and Monte Carlo."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from sybil import Document
from sybil.parsers.markdown import PythonCodeBlockParser

from softnlp import BAR, MILLIMETRE, Loads, Numerics, forward, material, robot
from softnlp.base.errors import IllPosedError, InputError
from softnlp.base.status import Status
from softnlp.cli import main
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import Coefficients
from softnlp.model.quantities import Model, quantities
from softnlp.model.round_chambers import deform
from softnlp.nlp.implicit import ImplicitDerivatives
from softnlp.nlp.problem import compile_problem
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.solver import PoseSolver
from softnlp.statics.wall import standing_wall
from softnlp.studies.blocked_force import blocked_force
from softnlp.studies.derivatives import (
    UNITS,
    LinearPoint,
    PoseDerivatives,
    blocked_point,
    checked_names,
    entries_of,
    rotation_vector,
)
from softnlp.studies.ellipsoids import compliance_ellipsoid, manipulability, stiffness_ellipsoid
from softnlp.studies.report import named_tolerances, sensitivity_report
from softnlp.studies.sensitivity import TIP, Sensitivities, sensitivities, tip_compliance, tip_jacobian
from softnlp.studies.tolerances import error_bars, monte_carlo

Array = NDArray[np.float64]

D25, SILICONE = robot("D25L60"), material("Ecoflex 00-50", "mooney-rivlin")
PRESSURE = np.array([0.9, 0.35, 0.1]) * BAR
HANGING = Loads(tip_force=(0.05, 0.02, 0.03), tip_moment=(0.0, 1e-3, 5e-4), gravity=(1.0, 0.0, -9.8))
OUTPUTS = tuple(name for name in UNITS if name != "blocked_force")
QUANTITIES = tuple(quantities(Model(D25, SILICONE)))
COARSE = Numerics(intervals=6)
# Changes for central differences of the fourth order: of the nominal value, or where that is 0 in SI.
STEP = {"tip_force": 2e-3, "tip_moment": 1e-5, "gravity": 0.5, "corrections.bore_fraction": 1e-3}


@cache
def loaded() -> Sensitivities:
    return sensitivities(
        D25, SILICONE, PRESSURE, outputs=OUTPUTS, by=QUANTITIES, loads=HANGING, numerics=Numerics(intervals=10)
    )


def central(point: LinearPoint, output: str, column: int, h: float) -> Array:
    """Return a derivative by solving again at four points."""

    def at(times: int) -> Array:
        theta = point.theta.copy()
        theta[column] += times * h
        solution = point.solved_at(theta)
        assert solution.holds(1e-10)
        return point.change(output, solution)

    derivative: Array = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h)
    return derivative


def step_of(found: Sensitivities, column: int) -> float:
    name = found.quantities[column]
    stem = name.rpartition(".")[0]
    return STEP.get(name, STEP.get(stem, 0.0)) or 2e-3 * abs(float(found.nominal[column]))


def worst_difference(found: Sensitivities, outputs: tuple[str, ...], columns: list[int]) -> float:
    """Return the largest error of a derivative, relative to the largest of its output's entries by that quantity."""
    assert found.point is not None
    worst = 0.0
    for column in columns:
        h = step_of(found, column)
        for output in outputs:
            rows = entries_of(found.outputs, output)
            exact = found.matrix[rows, column]
            by_hand = central(found.point, output, column, h)
            size = np.max(np.abs(exact))
            # What a step changes by round-off alone has no derivative to compare.
            floor = 1e-11 * max(1e-3, float(np.max(np.abs(found.values[rows])))) / h
            worst = max(worst, float(np.max(np.abs(by_hand - exact))) / max(size, 1e5 * floor))
    return worst


@pytest.mark.parametrize("part", range(4))
def test_every_output_by_every_quantity_is_a_central_difference(part: int) -> None:
    found = loaded()
    assert found.solved
    assert len(found.quantities) == found.matrix.shape[1] > 25
    assert worst_difference(found, OUTPUTS, list(range(part, len(found.quantities), 4))) < 1e-5


def test_the_sparse_factorisation_gives_the_same_as_the_sweep() -> None:
    point = loaded().point
    assert point is not None
    sparse = ImplicitDerivatives(point.problem, QUANTITIES)
    moves = sparse.states(point.solution.x, point.solution.p)
    assert moves == pytest.approx(point.moves, rel=1e-9, abs=1e-12 * np.abs(moves).max())


def test_collocation_gives_the_same_as_multiple_shooting() -> None:
    by = ("pressure", "robot.length", "tip_force")
    fine = [
        sensitivities(D25, SILICONE, PRESSURE, by=by, loads=HANGING, numerics=n).matrix
        for n in (Numerics(intervals=40), Numerics(transcription="collocation", intervals=3))
    ]
    assert fine[0] == pytest.approx(fine[1], rel=1e-4, abs=1e-4 * np.abs(fine[0]).max(axis=0).min())


@pytest.mark.thorough
def test_derivatives_hold_for_robots_built_anew() -> None:
    """The whole way from a robot's dimension to the tip, not only the compiled problem."""
    found = sensitivities(
        D25,
        SILICONE,
        PRESSURE,
        loads=HANGING,
        by=("robot.chamber_circle_diameter", "stiffening.bending", "pressure"),
        numerics=COARSE,
    )

    def tip(changed: object, bending: float, pressure: Array) -> Array:
        run = forward(
            changed, SILICONE, pressure, loads=HANGING, coefficients=Coefficients(bending=bending), numerics=COARSE  # type: ignore[arg-type]
        )  # fmt: skip
        pose = run.steps[0].pose
        assert pose is not None
        return pose.tip_position

    d, k = D25.chamber_circle_diameter, 1.23
    for name, h, pair in (
        (
            "robot.chamber_circle_diameter",
            1e-4 * d,
            [tip(replace(D25, chamber_circle_diameter=d * (1 + s * 1e-4)), k, PRESSURE) for s in (1, -1)],
        ),
        ("stiffening.bending", 1e-3, [tip(D25, k + s * 1e-3, PRESSURE) for s in (1, -1)]),
        ("pressure.2", 50.0, [tip(D25, k, PRESSURE + np.array([0, s * 50.0, 0])) for s in (1, -1)]),
    ):
        exact = found.of("tip_position", name)[:, 0]
        assert (pair[0] - pair[1]) / (2 * h) == pytest.approx(exact, abs=1e-5 * np.abs(exact).max())


def test_a_larger_robot_and_a_stiffer_silicone_are_similar() -> None:
    """Lengths times s: the shape times s. Stresses and pressures times s: the same shape, without loads."""
    dimensions = [name for name in QUANTITIES if name.startswith("robot.") and name != "robot.chamber_angle"]
    stresses = ["pressure", *(name for name in QUANTITIES if name in ("material.C10", "material.C01", "material.C20"))]
    found = sensitivities(D25, SILICONE, PRESSURE, outputs=OUTPUTS, by=[*dimensions, *stresses], numerics=COARSE)
    weighted = found.matrix * found.nominal
    by_length = weighted[:, [k for k, q in enumerate(found.quantities) if q.startswith("robot.")]].sum(axis=1)
    by_stress = weighted[:, [k for k, q in enumerate(found.quantities) if not q.startswith("robot.")]].sum(axis=1)
    degree = np.array([float(unit == "m") for unit in found.output_units])
    size = np.abs(weighted).max(axis=1)
    assert by_length == pytest.approx(degree * found.values, abs=1e-8 * size.max())
    assert by_stress == pytest.approx(0 * size, abs=1e-8 * size.max())


def test_the_compliance_of_a_straight_robot_is_a_beams() -> None:
    model = Model(D25, SILICONE)
    s = deform(D25, SILICONE, [0.0] * 3, 1.0, model.coefficients, model.conventions)
    L, EI, EA = D25.length, float(s.bending_stiffness[0]), float(s.axial_stiffness)
    GA, GJ = float(s.shear_stiffness), float(s.torsional_stiffness)
    C = tip_compliance(D25, SILICONE, np.zeros(3)).matrix
    expected = np.diag([*[L**3 / (3 * EI) + L / GA] * 2, L / EA, L / EI, L / EI, L / GJ])
    expected[0, 4] = expected[4, 0] = L**2 / (2 * EI)
    expected[1, 3] = expected[3, 1] = -(L**2) / (2 * EI)
    assert pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(expected).max()) == C


@pytest.mark.parametrize("moment", [(0.0, 0.0, 0.0), (1e-3, -5e-4, 2e-3)])
def test_the_stiffness_is_symmetric_but_for_a_dead_moment(moment: tuple[float, float, float]) -> None:
    loads = Loads((0.05, 0.02, 0.03), moment, (0.0, 0.0, -9.8))
    C = tip_compliance(D25, SILICONE, PRESSURE, loads=loads, numerics=Numerics(intervals=40)).matrix
    M_x, M_y, M_z = moment
    hat = np.array([[0, M_z, -M_y], [-M_z, 0, M_x], [M_y, -M_x, 0]])
    K = np.linalg.inv(C)
    skew = K - K.T
    assert skew[3:, 3:] == pytest.approx(hat, abs=1e-7)
    assert skew[:3] == pytest.approx(np.zeros((3, 6)), abs=1e-7 * np.abs(K).max())
    if not any(moment):
        assert pytest.approx(C.T, abs=1e-6 * np.abs(C).max()) == C


@cache
def pushed(closure: str) -> Sensitivities:
    contact = ContactSettings(closure=closure, tip_cap=2e-3)  # type: ignore[arg-type]
    by = ("pressure", "robot.length", "material.C10", "stiffening.bending", "contact.wall_point", "contact.tip_cap")
    outputs = ("blocked_force", "tip_position", "chamber_lengths")
    return sensitivities(
        D25,
        SILICONE,
        [0.6 * BAR, 0.0, 0.0],
        outputs=outputs,
        by=(*by, "contact.chamber_reaction"),
        contact=contact,
        numerics=COARSE,
    )


@pytest.mark.parametrize("closure", ["compliant", "rigid"])
def test_a_blocked_force_has_the_slope_of_the_force_found_again(closure: str) -> None:
    found = pushed(closure)
    assert found.solved
    columns = [found.quantities.index(name) for name in ("pressure.1", "robot.length", "contact.tip_cap")]
    assert worst_difference(found, ("blocked_force", "tip_position", "chamber_lengths"), columns) < 1e-5


def test_a_blocked_force_has_the_slope_of_the_force_found_anew() -> None:
    found = pushed("compliant")

    def force(pressure: float) -> float:
        contact = ContactSettings(tip_cap=2e-3)
        step = blocked_force(D25, SILICONE, [pressure, 0, 0], contact, numerics=COARSE).steps[0]
        assert step.contact is not None
        return step.contact.force

    slope = (force(0.6 * BAR + 100) - force(0.6 * BAR - 100)) / 200
    # Alone, the blocked shape takes its free lengths from the closed form and not from the same grid.
    assert found.of("blocked_force", "pressure.1")[0, 0] == pytest.approx(slope, rel=2e-4)


def test_closures_differ_in_what_the_reaction_does() -> None:
    reaction = {c: pushed(c).of("blocked_force", "contact.chamber_reaction")[0, 0] for c in ("free", "compliant")}
    assert reaction["free"] == 0
    assert reaction["compliant"] > 0
    compliant = pushed("compliant")
    assert compliant.of("blocked_force", "contact.wall_point.x")[0, 0] > 0  # pushed further back
    assert compliant.of("blocked_force", "contact.wall_point.z")[0, 0] == pytest.approx(0, abs=1e-12)


def test_away_from_the_wall_nothing_changes_the_force() -> None:
    found = sensitivities(
        D25,
        SILICONE,
        [0.3 * BAR, 0, 0],
        outputs=("blocked_force", "tip_position"),
        by=("pressure", "contact.wall_point"),
        contact=ContactSettings(offset=-0.2),
        numerics=COARSE,
    )
    assert found.step.status is Status.NO_CONTACT
    free = tip_jacobian(D25, SILICONE, [0.3 * BAR, 0, 0], numerics=COARSE)
    assert not found.of("blocked_force", "pressure").any()
    assert found.of("tip_position", "pressure") == pytest.approx(free.of("tip_position", "pressure"))
    assert not found.of("tip_position", "contact.wall_point").any()


def test_touching_the_wall_has_no_derivative() -> None:
    found = sensitivities(
        D25, SILICONE, np.zeros(3), outputs=["blocked_force"], contact=ContactSettings(), numerics=COARSE
    )
    assert not found.solved
    assert "touches" in found.warnings[0]


def test_a_blocked_pose_that_is_another_when_solved_again_has_no_derivative() -> None:
    """Free and blocked shape are solved together from what was found; what that leads to must be what was found."""
    solver = BlockedSolver(Model(D25, SILICONE), COARSE, ContactSettings())
    P = np.array([[0.4, 0, 0], [0.8, 0, 0]]) * BAR
    wall = standing_wall(solver.poses, solver.contact, P, Loads())
    (step, low), (_, high) = (solver.solve(pressure, Loads(), wall) for pressure in P)
    assert low is not None
    assert high is not None
    assert step.contact is not None
    point = blocked_point(solver, low, ["pressure"])
    assert point is not None
    assert point.value("blocked_force")[0] == pytest.approx(step.contact.force, rel=1e-3)
    assert blocked_point(solver, replace(low, solution=replace(low.solution, x=high.solution.x)), ["pressure"]) is None


def test_what_is_compiled_for_derivatives_is_kept() -> None:
    derivatives = PoseDerivatives(PoseSolver(Model(D25, SILICONE), COARSE))
    solved = [derivatives.poses.solve(np.array([bar, 0, 0]) * BAR, Loads())[1] for bar in (0.4, 0.5)]
    assert all(solved)
    first, second = (derivatives.at(s, ["pressure", "pressure"]) for s in solved if s)
    assert second.derivatives is first.derivatives
    ahead = first.value("tip_position") + first.derivative("tip_position")[:, 0] * 0.1 * BAR
    assert second.value("tip_position") == pytest.approx(ahead, abs=1e-3)  # of a move of 5 mm
    assert np.linalg.norm(second.value("tip_position") - first.value("tip_position")) > 3e-3


def test_one_name_is_a_list_of_one() -> None:
    assert checked_names("stretch", list(UNITS), "outputs") == ("stretch",)
    with pytest.raises(InputError, match="unknown name 'strech'; did you mean 'stretch'"):
        checked_names("strech", list(UNITS), "outputs")


def test_a_straight_robot_has_no_derivative_of_its_bending_angle() -> None:
    found = sensitivities(D25, SILICONE, [0.5 * BAR] * 3, outputs=("bending_angle", "elongation"), numerics=COARSE)
    assert np.isnan(found.of("bending_angle", "pressure")).all()
    assert "straight" in found.warnings[0]
    assert (found.of("elongation", "pressure") > 0).all()


def test_without_a_solution_there_are_no_numbers() -> None:
    soft = Coefficients(elongation=0.0, bending=0.0)
    found = tip_jacobian(D25, material("Dragon Skin 10", "yeoh"), [40 * BAR] * 3, coefficients=soft)
    assert not found.step.status.has_solution
    assert not found.solved
    assert np.isnan(found.matrix).all()
    assert np.isnan(manipulability(found).measure)
    with pytest.raises(InputError, match="expected a step with a solution"):
        monte_carlo(found, {"pressure": 1.0})


def test_ellipsoids_are_images_of_unit_balls() -> None:
    J = tip_jacobian(D25, SILICONE, PRESSURE, loads=HANGING, numerics=COARSE)
    moved = manipulability(J)
    linear = J.of("tip_position", "pressure")
    assert moved.measure == pytest.approx(abs(np.linalg.det(linear)), rel=1e-9)
    rng = np.random.default_rng(1)
    balls = rng.standard_normal((3, 200))
    balls /= np.linalg.norm(balls, axis=0)
    inside = moved.translation.axes.T @ linear @ balls / moved.translation.semi_axes[:, None]
    assert np.linalg.norm(inside, axis=0) == pytest.approx(np.ones(200), rel=1e-9)
    assert np.linalg.det(moved.translation.axes) == pytest.approx(1)
    assert 0 < moved.isotropy < 1

    C = tip_compliance(D25, SILICONE, PRESSURE, loads=HANGING, numerics=COARSE)
    given, stiff = compliance_ellipsoid(C), stiffness_ellipsoid(C)
    assert given.semi_axes[::-1] * stiff.semi_axes == pytest.approx(np.ones(3))
    assert (stiffness_ellipsoid(C, rotation_held=True).semi_axes >= stiff.semi_axes).all()


def test_axes_are_right_handed_whatever_the_derivatives() -> None:
    """The left singular vectors come in either hand."""
    found = tip_jacobian(D25, SILICONE, PRESSURE, numerics=COARSE)
    rows, hands = entries_of(found.outputs, "tip_position"), set()
    for sizes in permutations([1.0, 2.0, 3.0]):  # each pressure moves the tip along one axis
        matrix = found.matrix.copy()
        matrix[rows] = np.diag(sizes)
        moved = manipulability(replace(found, matrix=matrix)).translation
        hands.add(float(np.sign(np.linalg.det(np.linalg.svd(matrix[rows])[0]))))
        assert np.linalg.det(moved.axes) == pytest.approx(1)
        spanned = moved.axes @ np.diag(moved.semi_axes**2) @ moved.axes.T
        assert spanned == pytest.approx(matrix[rows] @ matrix[rows].T, rel=1e-9, abs=1e-12)
    assert hands == {1.0, -1.0}


def test_a_blocked_pose_without_equilibrium_has_no_numbers() -> None:
    ogden = material("Ecoflex 00-50", "ogden")
    found = sensitivities(
        D25, ogden, [100 * BAR, 0, 0], outputs=["blocked_force"], contact=ContactSettings(), numerics=COARSE
    )
    assert found.step.status is Status.UNSTABLE_MATERIAL
    assert not found.solved
    assert np.isnan(found.matrix).all()
    assert found.step.message in found.warnings


def test_a_load_that_compresses_the_rod_to_nothing_is_warned_of() -> None:
    """v_z = 1 + n_z / EA is 0 under -EA, for which the law's fit says nothing any more."""
    pressure, told = [0.1 * BAR] * 3, "compresses the rod to nothing"

    def at(F: float) -> tuple[tuple[str, ...], float]:
        step = forward(D25, SILICONE, pressure, loads=Loads(tip_force=(0.0, 0.0, -F)), numerics=COARSE).steps[0]
        assert step.pose is not None
        return step.warnings, float(step.pose.shape.shear_extension[:, 2].min())

    axial_stiffness = 1.0 / (1.0 - at(1.0)[1])
    for part, warned in ((0.95, False), (1.05, True)):
        warnings, v_z = at(part * axial_stiffness)
        assert v_z == pytest.approx(1 - part, abs=1e-6)
        assert any(told in warning for warning in warnings) == warned


def test_two_sets_span_a_flat_ellipsoid() -> None:
    two = replace(D25, chamber_sets=2, chambers_per_set=2)
    moved = manipulability(tip_jacobian(two, SILICONE, [0.4 * BAR, 0.6 * BAR], numerics=COARSE))
    assert moved.translation.semi_axes[2] == 0 == moved.measure
    assert moved.translation.semi_axes[1] > 0


@pytest.mark.thorough
def test_error_bars_are_those_of_monte_carlo() -> None:
    tolerances = {
        "robot.chamber_diameter": 0.02 * MILLIMETRE,
        "robot.length": 0.2 * MILLIMETRE,
        "material.C01": 0.02 * SILICONE.constants["C01"],
        "pressure": 300.0,
    }
    found = sensitivities(
        D25,
        SILICONE,
        PRESSURE,
        outputs=(*TIP, "bending_angle"),
        by=[*tolerances, "stiffening.bending"],
        loads=HANGING,
        numerics=COARSE,
    )
    bars = error_bars(found, tolerances)
    assert bars.quantities == (
        "robot.chamber_diameter", "robot.length", "material.C01", "pressure.1", "pressure.2", "pressure.3"
    )  # fmt: skip
    assert bars.total == pytest.approx(np.linalg.norm(bars.contribution, axis=1))
    drawn = monte_carlo(found, tolerances, 400)
    assert drawn.solved == drawn.asked == 400
    assert (np.abs(drawn.deviation - bars.total) < 4 * drawn.standard_error).all()
    assert (np.abs(drawn.mean_shift) < 0.2 * bars.total).all()
    # Pressures alone, half as large: the same draws, half the deviation.
    small = monte_carlo(found, {"pressure": 3.0}, 40)
    assert monte_carlo(found, {"pressure": 6.0}, 40).deviation == pytest.approx(2 * small.deviation, rel=1e-3)


def test_draws_without_a_solution_are_counted_and_left_out() -> None:
    """A constant that scatters by ten times its size takes the stiffness away in one of two mirrored draws."""
    found = loaded()
    size = {"material.C01": 10 * abs(float(found.nominal[found.quantities.index("material.C01")]))}
    some = monte_carlo(found, size, 8)
    assert 2 <= some.solved < some.asked == 8
    assert np.isfinite(some.deviation[found.outputs.index("tip_position.x")])
    few = monte_carlo(found, size, 2)
    assert few.solved < 2
    assert np.isnan([few.deviation, few.mean_shift, few.standard_error]).all()


def test_a_report_has_error_bars_where_they_are_asked_for() -> None:
    plain, first_order = (
        sensitivity_report(D25, SILICONE, PRESSURE, tolerances, numerics=COARSE, samples=0)
        for tolerances in (None, {"pressure": 1e3})
    )
    assert plain.bars is plain.sampled is first_order.sampled is None
    assert first_order.bars is not None
    by_pressure = plain.sensitivities.of("bending_angle", "pressure")
    total = first_order.bars.total[first_order.bars.outputs.index("bending_angle")]
    assert total == pytest.approx(1e3 * np.linalg.norm(by_pressure), rel=1e-9)


def test_rotations_are_in_the_world_frame() -> None:
    """A moment about world z twists the straight tip about z, and a bent one about a world axis of its own."""
    C = tip_compliance(D25, SILICONE, [0.8 * BAR, 0, 0], numerics=COARSE)
    assert C.point is not None
    theta = C.point.theta + np.array([0, 0, 0, 0, 0, 1e-6])
    moved = C.point.change("tip_rotation", C.point.solved_at(theta))
    assert C.of("tip_rotation", "tip_moment.z")[:, 0] == pytest.approx(moved / 1e-6, rel=1e-4, abs=1e-2)
    assert rotation_vector(np.eye(3)) == pytest.approx(np.zeros(3))


def test_relative_sensitivities_are_elasticities() -> None:
    found = sensitivities(D25, SILICONE, PRESSURE, outputs=["stretch"], by=["robot.length", "pressure"])
    assert found.relative[0, 0] == pytest.approx(0, abs=1e-12)
    assert found.relative[0, 1] == pytest.approx(
        found.of("stretch", "pressure.1")[0, 0] * PRESSURE[0] / found.values[0]
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"outputs": ["tip_positoin"]}, "outputs: unknown name 'tip_positoin'; did you mean 'tip_position'"),
        ({"by": ["robot.lenght"]}, "by: unknown name 'robot.lenght'; did you mean 'robot.length'"),
        ({"outputs": ["blocked_force"]}, "outputs: unknown name 'blocked_force'"),
        ({"by": []}, "by: expected at least one of pressure"),
        ({"contact": ContactSettings(closure="weighted")}, "closure: expected 'free', 'compliant' or 'rigid'"),
        ({"pressure": np.zeros((2, 3))}, "pressure: expected one pressure a set, got 2 steps"),
    ],
)
def test_what_cannot_be_differentiated_is_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        sensitivities(D25, SILICONE, **{"pressure": PRESSURE, **settings})  # type: ignore[arg-type]


def test_a_tolerance_must_be_of_a_quantity_there() -> None:
    found = loaded()
    with pytest.raises(InputError, match=r"robot\.lenght: no such quantity here; did you mean 'robot\.length'"):
        error_bars(found, {"robot.lenght": 1.0})
    with pytest.raises(InputError, match="robot: no such quantity"):
        error_bars(found, {"robot": 1.0})
    with pytest.raises(InputError, match="expected a number that is not negative"):
        error_bars(found, {"robot.length": -1.0})
    with pytest.raises(InputError, match="no such output here; did you mean 'tip_position"):
        found.of("tip_positon", "pressure")


def test_only_fixed_quantities_of_square_problems_are_differentiated() -> None:
    point = loaded().point
    assert point is not None
    with pytest.raises(IllPosedError, match=r"'robot\.lenght' is not a fixed quantity"):
        ImplicitDerivatives(point.problem, ["robot.lenght"])
    declared = quantities(Model(D25, SILICONE))
    declared["pressure"] = replace(declared["pressure"], upper=2 * BAR)
    cases = point.problem.cases
    chosen = compile_problem(list(point.problem.fixed), cases, free=["pressure"], objective=cases[0].symbols[0] ** 2)
    with pytest.raises(IllPosedError, match="is not differentiated"):
        ImplicitDerivatives(chosen, ["robot.length"])


ROOT = Path(__file__).parents[1]
LOADED = ROOT / "scenarios" / "D25L60_loaded_tip.toml"


def test_the_command_writes_what_it_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["sensitivity", str(LOADED), "--step", "3", "--tolerance", "length_mm=0.2", "C01_MPa=3%"]
    assert main([*asked, "--samples", "20", "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    for heading in ("tip by pressure", "compliance", "ellipsoids of the tip", "error bars"):
        assert heading in shown
    document = json.loads((tmp_path / "sensitivity.json").read_text())
    names = [q["name"] for q in document["quantities"]]
    outputs = [o["name"] for o in document["outputs"]]
    assert np.shape(document["matrix"]) == (len(outputs), len(names))
    assert document["step"] == 3
    assert document["error_bars"]["tolerance"] == pytest.approx([2e-4, 0.03 * 15580], rel=1e-6)
    assert document["monte_carlo"]["solved"] == 20
    assert (tmp_path / "sensitivity.png").stat().st_size > 10_000
    again = sensitivities(D25, SILICONE, [p * BAR for p in document["pressure_bar"]], loads=_loads(document))
    J = [document["matrix"][outputs.index("tip_position.x")][names.index(f"pressure.{k}")] for k in (1, 2, 3)]
    assert again.of("tip_position.x", "pressure")[0] == pytest.approx(J, rel=1e-6)


def _loads(document: dict[str, list[dict[str, object]]]) -> Loads:
    value = {q["name"]: q["value"] for q in document["quantities"]}
    kinds = [tuple(value[f"{name}.{axis}"] for axis in "xyz") for name in ("tip_force", "tip_moment", "gravity")]
    return Loads(*kinds)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--step", "99"], "--step: expected a step from 1 to"),
        (["--tolerance", "lenght_mm=1"], "unknown name 'lenght_mm'; did you mean 'length_mm'?"),
        (["--tolerance", "length_mm"], "expected NAME=VALUE"),
        (["--tolerance", "length_mm=x"], "length_mm: expected a number, got 'x'"),
        (["--tolerance", "length_mm=-1"], "expected a number that is not negative"),
        (["--tolerance", "length_mm=1e300"], "length_mm: expected at most 1e+06, got 1e300"),
        (["--tolerance", "length_mm=1e300%"], "length_mm: expected at most 10 (1000%), got 1e300%"),
        (["--tolerance", "force_N=1%"], "force_N: expected a number and no percentage"),
        (["--samples", "1"], "--samples: expected 0, or at least 2"),
    ],
)
def test_a_wrong_request_is_one_line(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sensitivity", str(LOADED), *arguments]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert message in told


def test_only_a_forward_scenario_has_a_pose(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sensitivity", str(ROOT / "scenarios" / "inverse" / "point.toml")]) == 2
    assert "expected study 'forward', got 'inverse'" in capsys.readouterr().err


def test_tolerances_are_named_as_in_a_scenario() -> None:
    found = named_tolerances(
        ["chamber_angle_deg=2", "pressure_bar=10%", "bending=0.1", "outer_diameter_mm=1%", "moment_Nmm=3"],
        D25, SILICONE, Coefficients(), PRESSURE,
    )  # fmt: skip
    assert found == pytest.approx(
        {
            "robot.chamber_angle": np.radians(2),
            **{f"pressure.{k + 1}": 0.1 * P for k, P in enumerate(PRESSURE)},
            "stiffening.bending": 0.1,
            "robot.outer_diameter": 0.25e-3,
            "tip_moment": 3e-3,
        }
    )


def _documents() -> Iterator[tuple[str, Document]]:
    for name in ("inverse", "sensitivity"):
        yield name, Document.parse(str(ROOT / "docs" / f"{name}.md"), PythonCodeBlockParser())


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["inverse", "sensitivity"])
def test_the_examples_of_the_documents_run(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """In order: the later ones use names of the first."""
    document = dict(_documents())[name]
    count = 0
    for example in document.examples():
        example.evaluate()
        count += 1
    assert count == {"inverse": 1, "sensitivity": 4}[name]
    assert "nan" not in capsys.readouterr().out


def test_every_output_and_quantity_is_documented() -> None:
    text = (ROOT / "docs" / "sensitivity.md").read_text()
    for name in UNITS:
        assert f"`{name}`" in text
    for name in QUANTITIES:
        stem = name.partition(".")[0]
        assert f"`{name}`" in text or (stem in ("robot", "material") and f"`{stem}." in text)


def test_every_key_of_a_target_is_documented() -> None:
    from softnlp.base.columns import outputs
    from softnlp.scenario.inverse import BoundsTable, TargetTable

    text = (ROOT / "docs" / "inverse.md").read_text()
    for key in (*TargetTable.model_fields, *BoundsTable.model_fields, *(output.key for output in outputs("target"))):
        assert f"`{key}`" in text


def test_what_is_warned_of_in_a_scenario_is_said_with_its_sensitivities(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "s.toml"
    file.write_text(
        'study = "forward"\n[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
        "[pressure]\nsequence_bar = [[0.5, -0.01, 0.0]]\n[solver]\nintervals = 8\naccuracy = 1e-3\n"
    )
    assert main(["sensitivity", str(file), "--json"]) == 0
    shown = capsys.readouterr()
    (noise,) = json.loads(shown.out)["warnings"]
    assert "the lowest -0.01 bar, taken as 0" in noise
    assert noise in shown.err
