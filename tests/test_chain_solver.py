"""Poses of several segments through the scenario: one rod cut in two, arcs, scipy, connectors, lines, stability."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from segment_files import scenario, segment, solved

from softnlp import BAR, MILLIMETRE, Loads, Numerics, Segment, forward, material, robot
from softnlp.model.quantities import Model
from softnlp.model.segments import segmented_robot
from softnlp.statics.step import Pose, Step

D25, SOFT, OTHER = robot("D25L60"), material("Ecoflex 00-50"), material("Ecoflex 00-30")
HALF = robot("D25L60", length=30 * MILLIMETRE)
LOADED = "[tip_load]\nforce_N = [0.03, 0.02, -0.01]\n[gravity]\ndirection = \"hanging\"\n"  # fmt: skip
LOADS = Loads(tip_force=(0.03, 0.02, -0.01), gravity="hanging")


def pose(segments: list[Segment], pressure: Any, loads: Loads = LOADS, **numerics: Any) -> Pose:
    made = segmented_robot(segments)
    (step,) = forward(made, made.material, np.array(pressure) * BAR, loads=loads, numerics=Numerics(**numerics)).steps
    assert step.status.has_solution, step.message
    assert step.pose is not None
    return step.pose


@pytest.mark.parametrize(("more", "transcription"), [("", "multiple-shooting"), (LOADED, "collocation")])
def test_two_segments_of_one_section_are_one_of_twice_the_length(tmp_path: Path, more: str, transcription: str) -> None:
    solver = '[solver]\nengine = "newton"\ntranscription = "{}"\nintervals = {}\n'
    halves = scenario([segment(), segment()], "[0.4, 0.1, 0, 0.4, 0.1, 0]", more + solver.format(transcription, 8))
    whole = scenario([segment('name = "D25L60"')], "[0.4, 0.1, 0]", more + solver.format(transcription, 16))
    (two,), (one,) = solved(tmp_path, halves), solved(tmp_path, whole)
    assert two["segments"][1]["tip_position_mm"] == two["tip_position_mm"]
    for name in ("tip_position_mm", "tip_displacement_mm", "backbone_length_mm"):
        np.testing.assert_allclose(two[name], one[name], atol=1e-10 * 60, err_msg=name)
    for name in ("tip_rotation", "stretch", "bending_angle_deg", "tilt_deg"):
        np.testing.assert_allclose(two[name], one[name], atol=1e-8, rtol=1e-9, err_msg=name)
    together = np.reshape(two["chamber_length_mm"], (2, -1)).sum(axis=0)
    np.testing.assert_allclose(together, one["chamber_length_mm"], atol=1e-9)
    assert (two["stable"], two["residual"] < 1e-8) == (True, True)


def arc(robot_: Any, silicone: Any, pressure: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and rotation from base to tip of the arc that one segment is alone."""
    found = forward(robot_, silicone, np.array(pressure) * BAR).steps[0].pose
    assert found is not None
    return found.tip_position, found.tip_rotation


def about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_different_segments_are_arcs_one_behind_the_other_with_rigid_pieces_between() -> None:
    """Without loads each segment is what it is alone; connectors and turns are rigid motions."""
    thin = robot("D20L40")
    segments = [Segment(HALF, SOFT, connector=3e-3), Segment(thin, OTHER, turn=0.7, connector=2e-3)]
    found = pose(segments, [0.5, 0.1, 0, 0, 0.4, 0.1], Loads())
    (p, R), (q, S) = arc(HALF, SOFT, [0.5, 0.1, 0]), arc(thin, OTHER, [0, 0.4, 0.1])
    start = p + 3e-3 * R[:, 2]
    R_2 = R @ about_z(0.7)
    np.testing.assert_allclose(found.segments[0].tip_position, p, atol=1e-9 * 0.07)
    np.testing.assert_allclose(found.segments[1].tip_position, start + R_2 @ q, atol=1e-9 * 0.07)
    np.testing.assert_allclose(found.tip_rotation, R_2 @ S, atol=1e-8)
    np.testing.assert_allclose(found.tip_position, start + R_2 @ (q + 2e-3 * S[:, 2]), atol=1e-9 * 0.07)
    np.testing.assert_allclose(found.tip_displacement, 0, atol=5e-9 * 0.07)
    silicone = sum(part.stretch * length for part, length in zip(found.segments, (0.03, 0.04), strict=True))
    assert found.stretch == pytest.approx(silicone / 0.07, rel=1e-12)
    assert found.backbone_length == pytest.approx(silicone + 5e-3, rel=1e-9)


def test_a_connector_is_a_lever_for_the_load_beyond_it() -> None:
    """A last connector moves the point of attack: the same as a force and its moment at the tip without it."""
    with_piece = pose([Segment(HALF, SOFT), Segment(HALF, OTHER, connector=4e-3)], [0.3, 0, 0, 0, 0.2, 0])
    arm = 4e-3 * with_piece.tip_rotation[:, 2]
    loads = Loads(LOADS.tip_force, tuple(np.cross(arm, LOADS.tip_force)), LOADS.gravity)
    bare = pose([Segment(HALF, SOFT), Segment(HALF, OTHER)], [0.3, 0, 0, 0, 0.2, 0], loads)
    np.testing.assert_allclose(bare.tip_position + arm, with_piece.tip_position, atol=1e-7 * 0.06)
    np.testing.assert_allclose(bare.tip_rotation, with_piece.tip_rotation, atol=1e-6)
    # Dead forces are carried to the base: of N the weight and the load, of M their moments about it.
    shape = with_piece.shape
    assert shape.arc[-1] == 1
    np.testing.assert_allclose(shape.force[-1], LOADS.tip_force, atol=1e-9)
    np.testing.assert_allclose(shape.moment[-1], 0, atol=1e-9)


def by_scipy(sections: list[Any], pressures: Any, stretches: list[float], force: Any) -> np.ndarray:
    """Return the tip of two rods under a dead force, of the same equations by scipy alone, posed side by side."""
    sizes = []
    for model, P, stretch in zip(sections, pressures, stretches, strict=True):
        state = model.section.at(model.numbers, P * BAR, stretch)
        K = [float(v) for v in (*state.bending_stiffness, state.torsional_stiffness)]
        S = [float(v) for v in (state.shear_stiffness, state.shear_stiffness, state.axial_stiffness)]
        M_P = np.array([*(float(m) for m in state.pressure_moment), 0.0])
        sizes.append((np.array(K), np.array(S), M_P, stretch * model.length))

    def rates(s: Any, y: np.ndarray) -> np.ndarray:
        del s
        found = []
        for (K, S, M_P, L), x in zip(sizes, (y[:15], y[15:]), strict=True):
            R = x[3:12].reshape(3, 3, -1)
            v = np.einsum("ijm,i->jm", R, force) / S[:, None] + np.array([[0], [0], [1]])
            u = (np.einsum("ijm,im->jm", R, x[12:]) + M_P[:, None]) / K[:, None]
            dp = np.einsum("ijm,jm->im", R, v)
            hat = np.zeros((3, 3, x.shape[1]))
            hat[2, 1], hat[0, 2], hat[1, 0] = u
            hat[1, 2], hat[2, 0], hat[0, 1] = -u
            dR = np.einsum("ijm,jkm->ikm", R, hat)
            dM = -np.cross(dp, np.array(force)[:, None], axis=0)
            found.append(L * np.concatenate([dp, dR.reshape(9, -1), dM]))
        return np.concatenate(found)

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        base = np.concatenate([a[:3], a[3:12] - np.eye(3).ravel()])
        return np.concatenate([base, a[15:] - b[:15], b[27:]])

    s = np.linspace(0, 1, 21)
    guess = np.zeros((30, s.size))
    for k, (_, _, _, L) in enumerate(sizes):
        guess[15 * k + 2] = L * s + (sizes[0][3] if k else 0)
        guess[15 * k + 3 : 15 * k + 12] = np.eye(3).ravel()[:, None]
    answer = solve_bvp(rates, ends, s, guess, tol=1e-9, max_nodes=20_000)
    assert answer.success, answer.message
    return np.asarray(answer.y[15:18, -1])


def test_loaded_segments_agree_with_scipy() -> None:
    thin, P, force = robot("D20L40"), [np.array([0.3, 0.1, 0]), np.array([0, 0.2, 0.1])], (0.02, -0.015, 0.01)
    found = pose([Segment(HALF, SOFT), Segment(thin, OTHER)], np.concatenate(P), Loads(tip_force=force), accuracy=1e-8)
    stretches = [part.stretch for part in found.segments]
    tip = by_scipy([Model(HALF, SOFT), Model(thin, OTHER)], P, stretches, force)
    np.testing.assert_allclose(found.tip_position, tip, atol=1e-9)  # a millionth of a millimetre


WIDTHS = ("outer_diameter", "lumen_diameter", "chamber_circle_diameter", "chamber_diameter", "chamber_wall")


def test_a_cone_under_an_axial_load_is_its_closed_form(tmp_path: Path) -> None:
    """Every width shrinks alike, so the area does by its square: the elongation is F L / (E sqrt(A_base A_tip))."""
    shrink, F = 0.6, 0.2
    large = {f"{name}_mm": 2e3 * getattr(D25, name) for name in WIDTHS}
    sizes = "\n".join(f"{key} = [{v}, {shrink * v}]" for key, v in large.items())
    text = (
        f'study = "forward"\n[robot]\nname = "D25L60"\n{sizes}\n[material]\nname = "Ecoflex 00-50"\nmodel = "linear"\n'
    )
    (step,) = solved(tmp_path, text + f"[tip_load]\nforce_N = [0, 0, {F}]\n[pressure]\nsequence_bar = [[0, 0, 0]]\n")
    rubber = material("Ecoflex 00-50", "linear")
    start = robot("D25L60", **{name: 2 * getattr(D25, name) for name in WIDTHS})
    section = Model(start, rubber).section.at(Model(start, rubber).numbers, np.zeros(3), 1.0)
    expected = F * 0.06 / (float(rubber.tangent_modulus(1.0)) * float(section.area) * shrink)  # type: ignore[attr-defined]
    assert (step["tip_position_mm"][2] - 60) / 1e3 == pytest.approx(expected, rel=1e-6)


CONE = {"robot.outer_diameter": (25e-3, 23e-3), "robot.chamber_circle_diameter": (17e-3, 15.5e-3)}


@cache
def cone(intervals: int, transcription: str = "multiple-shooting") -> Step:
    made = segmented_robot([Segment(robot("D25L60", lumen_diameter=8e-3), SOFT, along=CONE)])
    numerics = Numerics(engine="newton", intervals=intervals, transcription=transcription)  # type: ignore[arg-type]
    return forward(made, made.material, np.array([0.5, 0.1, 0]) * BAR, loads=LOADS, numerics=numerics).steps[0]


def test_poses_of_a_cone_converge_at_order_4_and_their_error_is_estimated() -> None:
    best, coarse, fine = cone(6, "collocation").pose, cone(5), cone(10)
    assert best is not None
    errors = []
    for step in (coarse, fine):
        assert step.pose is not None
        errors.append(float(np.linalg.norm(step.pose.tip_position - best.tip_position)) / 0.06)
        assert step.discretisation_error == pytest.approx(errors[-1], rel=0.3)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3)


def test_the_automatic_grid_meets_the_accuracy() -> None:
    made = segmented_robot(
        [Segment(HALF, SOFT, along={"robot.outer_diameter": (25e-3, 24.5e-3)}), Segment(HALF, OTHER)]
    )
    run = forward(made, made.material, np.array([0.9, 0, 0, 0, 0.7, 0]) * BAR, loads=LOADS)
    (step,) = run.steps
    assert step.discretisation_error is not None
    assert step.discretisation_error < 1e-6
    assert (step.engine, step.ipopt is not None) == ("auto", True)
    finer = pose(list(made.segments), [0.9, 0, 0, 0, 0.7, 0], transcription="collocation", accuracy=1e-9)
    assert step.pose is not None
    np.testing.assert_allclose(step.pose.tip_position, finer.tip_position, atol=1e-6 * 0.06)


def test_bonded_lines_carry_their_pressure_through_the_section() -> None:
    """With turned lines segment 1 is one robot of twice the sets: its own balance, and its force at the base."""
    one = robot("D25L60", length=30e-3, chambers_per_set=1, chamber_angle=0.0)
    segments = [Segment(one, SOFT, lines="bonded"), Segment(one, SOFT, turn=np.pi / 3)]
    found = pose(segments, [0.3, 0, 0, 0, 0.4, 0], Loads())
    six = robot("D25L60", length=30e-3, chamber_sets=6, chambers_per_set=1, chamber_angle=0.0)
    alone = forward(six, SOFT, np.array([0.3, 0, 0, 0.4, 0, 0]) * BAR).steps[0].pose  # set 5 is at 60 + 120 degrees
    assert alone is not None
    base = found.segments[0]
    assert base.stretch == pytest.approx(alone.stretch, rel=1e-12)
    np.testing.assert_allclose(base.tip_position, alone.tip_position, atol=1e-8 * 0.03)
    np.testing.assert_allclose(base.tip_rotation, alone.tip_rotation, atol=1e-7)
    A_c = np.pi * float(found.radii.bore) ** 2
    np.testing.assert_allclose(found.shape.force[0], [0, 0, 0.7 * BAR * A_c], atol=1e-8)
    # Behind the junction only its own pressure is left.
    first = int(np.flatnonzero(found.segment == 2)[0])
    assert found.outline is not None
    own = 0.4 * BAR * np.pi * float(found.outline.bore[first]) ** 2  # type: ignore[index]
    np.testing.assert_allclose(found.shape.force[first] @ found.shape.rotation[first, :, 2], own, rtol=1e-9)


def test_lines_that_hang_loose_change_nothing_and_lines_in_a_chamber_are_told_of() -> None:
    loose = pose([Segment(HALF, SOFT, lines="slack"), Segment(HALF, SOFT)], [0.3, 0, 0, 0, 0.4, 0])
    none = pose([Segment(HALF, SOFT), Segment(HALF, SOFT)], [0.3, 0, 0, 0, 0.4, 0])
    np.testing.assert_array_equal(loose.tip_position, none.tip_position)
    made = segmented_robot([Segment(HALF, SOFT, lines="bonded"), Segment(HALF, SOFT)])
    assert made.notes == [
        "segment 1: the lines of segment 2 overlap a chamber; turn_deg of a segment turns it against the one before"
    ]


def stable(segments: list[Segment], loads: Loads) -> bool | None:
    return pose(segments, np.zeros(6), loads, intervals=10, engine="newton").stable


def column(length: float) -> tuple[list[Segment], float, float]:
    """Return a column of two halves, its bending stiffness and its weight per length and acceleration."""
    half = robot("D10L60", length=length / 2)
    section = Model(half, SOFT).section.at(Model(half, SOFT).numbers, np.zeros(3), 1.0)
    return [Segment(half, SOFT)] * 2, float(section.bending_stiffness[0]), float(section.line_density)


def test_a_standing_chain_buckles_under_its_weight_where_one_column_does() -> None:
    """Greenhill's column, rho A g L^3 / EI = 7.84, in both planes at once, its conjugate point through the junction."""
    segments, EI, density = column(0.06)
    for factor, holds in ((7.6, True), (8.0, False)):
        g = factor * EI / (density * 0.06**3)
        assert stable(segments, Loads(gravity=(0.0, 0.0, -g))) is holds


def test_a_column_with_a_rigid_end_buckles_at_its_closed_form() -> None:
    """A load on a rigid piece of length c on top: k c tan(k L) = 1 with k^2 = P / EI: k L = 1.1925 for c = L / 3."""
    segments, EI, _ = column(0.06)
    topped = [segments[0], Segment(segments[1].robot, SOFT, connector=0.02)]
    for part, holds in ((0.97, True), (1.03, False)):
        P = part * EI * (1.1925 / 0.06) ** 2
        assert stable(topped, Loads(tip_force=(0.0, 0.0, -P))) is holds
    assert stable(segments, Loads(tip_force=(0.0, 0.0, -1.1 * EI * (1.1925 / 0.06) ** 2))) is True
