"""Figures show the numbers of the run, to scale, and say what has no solution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from arc_runs import arc_step, blocked_run, blocked_step, failed_step, offset_run, ramp_run, run_of
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle
from matplotlib.text import Text

from softnlp.base.errors import InputError
from softnlp.figures import material_figure, run_figure, save_figure, section_figure
from softnlp.figures.body import tube
from softnlp.figures.section import stretched_radii
from softnlp.figures.style import WRONG, colour
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material, formula_law, material
from softnlp.model.robot import ROBOTS, Robot, robot, violations
from softnlp.model.rod import Loads
from softnlp.model.round_chambers import deform
from softnlp.results import Body, to_dataset, view_of_dataset, view_of_run
from softnlp.statics.step import Run


def drawn(run: Run) -> Figure:
    return run_figure(view_of_run(run))


def labelled(axes: Any, label: str) -> list[Any]:
    return [artist for artist in axes.get_children() if artist.get_label() == label]


def texts(figure: Figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(Text) if t.get_text()]


def overlaps(found: Sequence[Text]) -> list[tuple[str, str]]:
    """Return the pairs of texts whose boxes meet, after a draw."""
    boxes = [(t.get_text(), t.get_window_extent()) for t in found if t.get_text().strip() and t.get_visible()]
    return [(a, b) for (a, box), (b, other) in combinations(boxes, 2) if box.overlaps(other)]


def outside(figure: Figure, found: Sequence[Text]) -> list[str]:
    width, height = figure.canvas.get_width_height()
    boxes = [(t.get_text(), t.get_window_extent()) for t in found if t.get_text().strip() and t.get_visible()]
    return [name for name, b in boxes if b.x0 < 0 or b.y0 < 0 or b.x1 > width or b.y1 > height]


# --- the figure of a run ---


def test_panels_hold_the_run_s_numbers() -> None:
    run = ramp_run(failed=(4,))
    _, bending, elongation = drawn(run).axes
    poses = [step.pose for step in run.steps]
    pressures = np.linspace(0, 1.5, 11)
    for panel, expected in (
        (bending, [math.nan if p is None else math.degrees(p.bending_angle) for p in poses]),
        (elongation, [math.nan if p is None else 1e3 * p.backbone_length - 60 for p in poses]),
    ):
        line = panel.lines[0]
        assert np.allclose(line.get_xdata(), pressures)
        assert np.allclose(line.get_ydata(), expected, equal_nan=True)
        (marks,) = labelled(panel, "steps")
        known = np.isfinite(expected)
        assert np.allclose(marks.get_offsets()[known], np.column_stack([pressures, expected])[known])
        assert np.ma.getmaskarray(marks.get_offsets()).any(axis=1).tolist() == (~known).tolist()
        (cross,) = labelled(panel, "no solution")
        assert cross.get_xdata() == pytest.approx([pressures[4]])
    assert bending.get_ylabel() == "bending [deg]"
    assert elongation.get_xlabel() == "pressure of set 1 [bar]"


@pytest.mark.parametrize(
    ("sets", "label"),
    [((1,), "pressure of set 2 [bar]"), ((0, 2), "pressure of sets 1 and 3 [bar]"), ((0, 1, 2), "sets 1, 2 and 3")],
)
def test_abscissa_names_the_sets_that_share_one_pressure(sets: tuple[int, ...], label: str) -> None:
    figure = drawn(ramp_run(4, sets=sets))
    assert label in figure.axes[-1].get_xlabel()
    assert len(figure.axes) == 3


def sweep(times: bool) -> Run:
    body = robot("D25L60")
    P = [6e4 * (1 + np.sin(k / 2 + np.array([0, 2.1, 4.2]))) for k in range(12)]
    return run_of([arc_step(body, p, time=3.0 * k if times else None) for k, p in enumerate(P)])


@pytest.mark.parametrize(("times", "label", "last"), [(True, "time [s]", 33), (False, "step", 12)])
def test_pressures_that_vary_apart_are_drawn_over_time_or_step(times: bool, label: str, last: float) -> None:
    run = sweep(times)
    panel = drawn(run).axes[-1]
    assert panel.get_xlabel() == label
    assert [line.get_color() for line in panel.lines] == [colour(0), colour(1), colour(2)]
    for k, line in enumerate(panel.lines):
        assert np.allclose(line.get_ydata(), [s.pressure[k] / 1e5 for s in run.steps])
        assert line.get_xdata()[-1] == last


def test_shapes_are_the_run_s_positions_in_mm() -> None:
    run = ramp_run(failed=(3,))
    axes: Any = drawn(run).axes[0]
    (lines,) = labelled(axes, "axes of the steps")
    solved = [s.pose for s in run.steps if s.pose]
    assert len(lines._segments3d) == len(solved) == 10
    for drawn_line, pose in zip(lines._segments3d, solved, strict=True):
        assert np.allclose(drawn_line, 1e3 * pose.shape.position)
    assert len(labelled(axes, "last step")) == len(labelled(axes, "base")) == len(labelled(axes, "tip frame")) == 1
    assert 1 <= len(labelled(axes, "earlier step")) <= 3
    low, high = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]).T
    points = np.concatenate([1e3 * p.shape.position for p in solved])
    assert (points > low).all()
    assert (points < high).all()


@given(st.floats(0.002, 0.02), st.floats(-0.01, 0.01), st.integers(4, 40), st.integers(2, 40))
@settings(max_examples=25, deadline=None)
def test_tube_has_its_radius_about_the_offset_axis(radius: float, offset: float, facets: int, stations: int) -> None:
    pose = arc_step(robot("D25L60"), [8e4, 2e4, 0]).pose
    assert pose is not None
    body = Body(pose.shape.position, pose.shape.rotation, pose.radii)
    quads, normals = tube(body, radius, (offset, 0.0), facets, stations)
    axis = 1e3 * (pose.shape.position + offset * pose.shape.rotation[:, :, 0])
    for end, vertex in ((0, quads[:facets, 0]), (-1, quads[-facets:, 1])):
        assert np.allclose(np.linalg.norm(vertex - axis[end], axis=1), 1e3 * radius)
        assert np.allclose((vertex - axis[end]) @ pose.shape.rotation[end][:, 2], 0, atol=1e-9)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)
    distance = np.linalg.norm(quads.reshape(-1, 1, 3) - axis[None], axis=2).min(axis=1)
    assert np.allclose(distance, 1e3 * radius, atol=1e-6)


def faces_of(collection: Any) -> list[np.ndarray]:
    """Return the corners of each face of a 3D collection, which matplotlib keeps for itself, before 3.10 in one row."""
    if hasattr(collection, "_faces"):
        return [np.asarray(face) for face in collection._faces]
    return [np.asarray(collection._vec)[:3, part].T for part in collection._segslices]


def projected(axes: Any, points: np.ndarray) -> np.ndarray:
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    x, y, _ = proj_transform(*np.asarray(points, dtype=float).T, axes.get_proj())
    return np.asarray(axes.transData.transform(np.column_stack([x, y])))


@pytest.mark.parametrize(
    "run", [ramp_run(), ramp_run(name="D10L60", sets=(0, 1, 2)), sweep(False), ramp_run(2, failed=(0, 1))]
)
def test_one_millimetre_is_as_long_on_each_axis(run: Run) -> None:
    figure = drawn(run)
    figure.canvas.draw()
    axes: Any = figure.axes[0]
    ranges = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim()), np.ptp(axes.get_zlim())])
    assert np.allclose(axes._box_aspect / axes._box_aspect[0], ranges / ranges[0])
    # Gauss: with one scale on three perpendicular axes, the images across and up are of one length and perpendicular.
    pixels = projected(axes, np.vstack([np.zeros(3), np.eye(3)]))
    steps = pixels[1:] - pixels[0]
    assert steps[:, 0] @ steps[:, 0] == pytest.approx(steps[:, 1] @ steps[:, 1], rel=1e-6)
    assert steps[:, 0] @ steps[:, 1] == pytest.approx(0, abs=1e-6 * float(steps[:, 0] @ steps[:, 0]))


@pytest.mark.parametrize("scale", [0.02, 1.0, 300.0])
def test_a_robot_of_any_size_has_a_scale_to_read(scale: float) -> None:
    body = ROBOTS["D25L60"]
    lengths = (
        "outer_diameter",
        "lumen_diameter",
        "chamber_circle_diameter",
        "chamber_diameter",
        "chamber_wall",
        "length",
    )
    scaled = replace(body, **{name: scale * getattr(body, name) for name in lengths})
    axes: Any = drawn(run_of([arc_step(scaled, [0, 0, 0])], robot=scaled)).axes[0]
    ticks = np.asarray(axes.get_zticks())
    assert 2 <= len(ticks) <= 7
    assert np.ptp(ticks) > 0.3 * np.ptp(axes.get_zlim())


def test_body_in_pixels_is_to_scale() -> None:
    """The straight unpressurised D25L60 is 25 mm wide and seen under 16 degrees of elevation."""
    figure = drawn(run_of([arc_step(robot("D25L60"), [0, 0, 0])]))
    figure.canvas.draw()
    axes: Any = figure.axes[0]
    (skin,) = labelled(axes, "last step")
    pixels = projected(axes, np.concatenate(faces_of(skin)).reshape(-1, 3))
    width, height = np.ptp(pixels, axis=0)
    expected = (60 * math.cos(math.radians(16)) + 25 * math.sin(math.radians(16))) / 25
    assert height / width == pytest.approx(expected, rel=0.02)


def test_loads_are_arrows_along_them_with_their_size() -> None:
    run = ramp_run(5, loads=Loads((0.06, 0, -0.08), (0, 0, 0), (0, 0, -9.80665)))
    figure = drawn(run)
    axes = figure.axes[0]
    (force,), (gravity,) = labelled(axes, "tip force"), labelled(axes, "gravity")
    start, end = np.array(force._segments3d[0])
    assert run.steps[-1].pose is not None
    assert np.allclose(start, 1e3 * run.steps[-1].pose.tip_position)
    assert np.allclose((end - start) / np.linalg.norm(end - start), [0.6, 0, -0.8])
    down = np.array(gravity._segments3d[0])
    assert np.allclose((down[1] - down[0]) / np.linalg.norm(down[1] - down[0]), [0, 0, -1])
    assert {"F 0.1 N", "g"} <= set(texts(figure))
    assert not labelled(axes, "tip moment")
    assert not labelled(drawn(ramp_run(2)).axes[0], "gravity")


@pytest.mark.parametrize("moment", [(0, 0, 2e-3), (0, 0, -2e-3), (2e-3, 0, 0), (0, 2e-3, 1e-3)], ids=str)
def test_a_moment_turns_about_its_axis_and_is_no_force(moment: tuple[float, float, float]) -> None:
    """Also where a force lies along it: by the right-hand rule the arrow advances, and the two texts stand apart."""
    run = ramp_run(5, loads=Loads((0, 0, -0.08), moment, (0, 0, -9.80665)))
    figure = drawn(run)
    figure.canvas.draw()
    axes: Any = figure.axes[0]
    (turn,) = labelled(axes, "tip moment")
    bend, *heads = (np.asarray(line) for line in turn._segments3d)
    assert run.steps[-1].pose is not None
    arms = bend - 1e3 * run.steps[-1].pose.tip_position
    axis = np.array(moment) / np.linalg.norm(moment)
    assert np.abs(arms @ axis).max() < 1e-9 * 60
    radius = np.linalg.norm(arms, axis=1)
    assert radius == pytest.approx(radius[0])
    assert radius[0] > 12.5  # round the body
    assert (np.cross(arms[:-1], arms[1:]) @ axis > 0).all()
    assert all(np.allclose(head[1], bend[-1]) for head in heads)
    loads = [t for t in axes.findobj(Text) if t.get_text()[:2] in ("F ", "M ")]
    assert len(loads) == 2
    places = projected(axes, np.array([t.get_position_3d() for t in loads]))  # type: ignore[attr-defined]
    assert np.linalg.norm(places[0] - places[1]) > 20  # pixels
    width, height = figure.canvas.get_width_height()
    assert (places > 0).all()
    assert (places < (width / 2, height)).all()
    letters = [t for t in axes.texts if t.get_text() in "xyz"]
    assert all(t.get_path_effects() for t in letters)  # they are read on any colour


def test_a_run_that_failed_everywhere_shows_no_shape() -> None:
    figure = drawn(ramp_run(5, failed=range(5)))
    axes = figure.axes[0]
    assert not labelled(axes, "last step")
    assert not labelled(axes, "axes of the steps")
    assert len(labelled(figure.axes[1], "no solution")[0].get_xdata()) == 5
    found = texts(figure)
    assert any("0 of 5 steps solved" in t for t in found)
    assert any("no shape is shown" in t for t in found)
    figure.canvas.draw()


def test_a_single_step_and_an_unstable_one() -> None:
    step = arc_step(robot("D25L60"), [5e4, 0, 1e4])
    assert step.pose is not None
    unstable = replace(step, pose=replace(step.pose, stable=False))
    figure = drawn(run_of([unstable]))
    (marks,) = labelled(figure.axes[1], "steps")
    assert marks.get_facecolor().tolist() == [[1, 1, 1, 1]]
    assert "unstable" in texts(figure)
    assert "unstable" not in texts(drawn(run_of([step])))
    figure.canvas.draw()


def test_rounding_errors_do_not_fill_a_panel() -> None:
    bending = drawn(ramp_run(sets=(0, 1, 2))).axes[1]
    assert np.ptp(bending.get_ylim()) >= 1


def test_figure_from_the_dataset_is_the_same() -> None:
    run = ramp_run(failed=(7,), loads=Loads((0.1, 0, 0)))
    one, other = drawn(run), run_figure(view_of_dataset(to_dataset(run)))
    assert texts(one) == texts(other)
    for figure in (one, other):
        figure.canvas.draw()
    pictures = [np.asarray(figure.canvas.buffer_rgba()).astype(int) for figure in (one, other)]  # type: ignore[attr-defined]
    assert np.mean(np.abs(pictures[0] - pictures[1]).max(axis=2) > 40) < 1e-3


@pytest.mark.parametrize(
    "run",
    [
        ramp_run(failed=(9, 10)),
        ramp_run(name="D10L60", sets=(0, 1, 2)),
        sweep(True),
        ramp_run(3, failed=(0, 1, 2)),
        ramp_run(1, title="$x^2 \\frac{\n" + "long " * 60),
    ],
)
def test_texts_of_a_run_s_figure_do_not_meet(run: Run) -> None:
    figure = drawn(run)
    figure.canvas.draw()
    flat = [*figure.texts, *(t for legend in figure.legends for t in legend.get_texts())]
    for axes in figure.axes[1:]:
        flat += [axes.xaxis.label, axes.yaxis.label]
        flat += [t for t in axes.get_yticklabels() if axes.get_ylim()[0] <= t.get_position()[1] <= axes.get_ylim()[1]]
    axes3d: Any = figure.axes[0]
    flat += [axes3d.xaxis.label, axes3d.yaxis.label, axes3d.zaxis.label]
    assert overlaps(flat) == []
    assert outside(figure, flat) == []


# --- the figure of a blocked force ---


def test_force_and_both_bending_angles_are_drawn_against_pressure() -> None:
    run = blocked_run(failed=(4,))
    view = view_of_run(run)
    assert view.contact is not None
    _, force, bending = run_figure(view, [(1.5e5, 1.18), (0.75e5, 0.6)]).axes
    assert force.get_ylabel() == "blocked force [N]"
    assert bending.get_xlabel() == "pressure of set 1 [bar]"
    assert np.allclose(force.lines[0].get_xdata(), np.linspace(0, 1.5, 6))
    assert np.allclose(force.lines[0].get_ydata(), view.contact.force, equal_nan=True)
    assert np.allclose(bending.lines[0].get_ydata(), np.degrees(view.bending_angle), equal_nan=True)
    (free,) = labelled(bending, "free shape")
    assert np.allclose(free.get_ydata(), np.degrees(view.contact.free_bending_angle), equal_nan=True)
    (measured,) = labelled(force, "measured")
    assert measured.get_xdata() == pytest.approx([1.5, 0.75])
    assert measured.get_ydata() == pytest.approx([1.18, 0.6])
    assert labelled(force, "no solution")[0].get_xdata() == pytest.approx([1.2])
    low, high = bending.get_ylim()
    assert low < np.nanmin(free.get_ydata())
    assert high > np.nanmax(free.get_ydata())


def test_a_characteristic_curve_is_drawn_against_the_wall_s_offset() -> None:
    run = offset_run()
    view = view_of_run(run)
    figure = run_figure(view, [(-0.01, 0.7)])
    _, force, bending = figure.axes
    assert bending.get_xlabel() == "wall offset [mm]"
    assert force.lines[0].get_xdata() == pytest.approx([0, -10, -20, -30])
    assert labelled(force, "measured")[0].get_xdata() == pytest.approx([-10])
    assert any("Step 1 cut open" in t for t in texts(figure))  # the largest force


def test_the_wall_its_force_and_the_cap_are_where_the_contact_is() -> None:
    run = blocked_run(tip_cap=0.006, offset=-0.004)
    axes: Any = drawn(run).axes[0]
    pose = run.steps[-1].pose
    assert pose is not None
    at = 1e3 * (pose.tip_position + 0.006 * pose.tip_rotation[:, 2])
    assert at[0] == pytest.approx(-4, abs=0.2)
    (arrow,) = labelled(axes, "wall's force")
    start, end = np.array(arrow._segments3d[0])
    assert end == pytest.approx(at)
    assert (end - start) / np.linalg.norm(end - start) == pytest.approx([1, 0, 0])
    (wall,) = labelled(axes, "wall")
    corners = faces_of(wall)[0]
    assert corners[:, 0] == pytest.approx([-4] * 4)
    assert corners.min(axis=0)[2] < at[2] < corners.max(axis=0)[2]
    (cap,) = labelled(axes, "tip cap")
    side = np.concatenate([face[:4] for face in faces_of(cap)[:-1]])
    along = (side - 1e3 * pose.tip_position) @ pose.tip_rotation[:, 2]
    assert (along.min(), along.max()) == pytest.approx((0, 6), abs=1e-9)
    assert "$F_b$ = 1.2 N" in texts(axes.figure)
    (free,) = labelled(axes, "free axis")
    contact = run.steps[-1].contact
    assert contact is not None
    assert np.allclose(free._segments3d[0], 1e3 * contact.free.shape.position)
    low, high = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]).T
    for seen in (corners, np.asarray(free._segments3d[0]), [start]):
        assert (seen > low).all()
        assert (seen < high).all()


def test_no_force_no_arrow_and_no_cap_without_one() -> None:
    axes = drawn(blocked_run(1, to=0.0)).axes[0]
    assert labelled(axes, "wall")
    assert not labelled(axes, "wall's force")
    assert not labelled(axes, "tip cap")
    assert len(drawn(blocked_run(3, failed=(0, 1, 2))).axes) == 3


def leaning() -> Run:
    normal = np.array([0.8, 0.0, 0.6])
    steps = [blocked_step(robot("D25L60"), [p, 0, 0], p / 1e5, normal=normal, tip_cap=3e-3) for p in (5e4, 1e5)]
    return run_of(steps, study="blocked-force", contact=None)


def test_a_leaning_wall_is_drawn_perpendicular_to_its_normal() -> None:
    axes: Any = drawn(leaning()).axes[0]
    corners = faces_of(labelled(axes, "wall")[0])[0]
    assert corners @ [0.8, 0, 0.6] == pytest.approx([0] * 4, abs=1e-9)


@pytest.mark.parametrize(
    "run",
    [
        blocked_run(failed=(5,), tip_cap=0.01),
        blocked_run(name="D10L40", force=0.12),
        blocked_run(1, to=0.0),
        replace(blocked_run(3), loads=Loads((0.1, 0, 0), (0, 0, 0), (0, 0, -9.8))),
        offset_run(),
        leaning(),
    ],
    ids=["cap", "small", "single", "loads", "curve", "leaning"],
)
def test_texts_of_a_blocked_force_s_figure_do_not_meet(run: Run) -> None:
    figure = run_figure(view_of_dataset(to_dataset(run)))
    figure.canvas.draw()
    flat = [*figure.texts, *(t for legend in figure.legends for t in legend.get_texts())]
    for axes in figure.axes[1:]:
        flat += [axes.xaxis.label, axes.yaxis.label]
        flat += [t for t in axes.get_yticklabels() if axes.get_ylim()[0] <= t.get_position()[1] <= axes.get_ylim()[1]]
    axes3d: Any = figure.axes[0]
    flat += [axes3d.xaxis.label, axes3d.yaxis.label, axes3d.zaxis.label]
    assert overlaps(flat) == []
    assert outside(figure, flat) == []


# --- the cross-section ---


def circles(axes: Any, label: str) -> list[Circle]:
    return [p for p in axes.patches if isinstance(p, Circle) and p.get_label() == label]


@pytest.mark.parametrize("name", list(ROBOTS))
def test_section_is_drawn_to_scale(name: str) -> None:
    body = ROBOTS[name]
    (axes,) = section_figure(body).axes
    assert axes.get_aspect() == 1
    assert [2 * c.get_radius() for c in circles(axes, "body")] == pytest.approx([1e3 * body.outer_diameter])
    assert [2 * c.get_radius() for c in circles(axes, "lumen")] == pytest.approx([1e3 * body.lumen_diameter])
    bores, threads = circles(axes, "bore"), circles(axes, "thread")
    centres = 1e3 * np.array(body.chamber_centres(), dtype=float)
    assert np.allclose([c.get_center() for c in bores], centres)
    assert np.allclose([c.get_center() for c in threads], centres)
    assert np.allclose([2 * c.get_radius() for c in bores], 1e3 * body.chamber_diameter)
    assert np.allclose([c.get_radius() for c in threads], 1e3 * body.chamber_radius)
    assert [c.get_facecolor() for c in bores] == [matplotlib.colors.to_rgba(colour(k)) for k in body.set_of_chamber]
    assert not circles(axes, "broken rule")


def test_section_names_its_dimensions() -> None:
    body = ROBOTS["D25L60"]
    found = texts(section_figure(body))
    for text in (
        *("$D_r$ 25", "$D_i$ 9", "$D_{cp}$ 17", "bore $D_c$ 4.5", r"chamber wall $\delta_c$ 0.5", "outer wall 1.25"),
        *(r"$\alpha_1$ 50°", "thread $2 r_{co}$ 5.5", "x", "y", "1", "6", "set 3: chambers 5 to 6"),
    ):
        assert text in found
    (axes,) = section_figure(body).axes
    (arc,) = (p for p in axes.patches if isinstance(p, Arc))
    assert (arc.theta1, arc.theta2) == pytest.approx((-25, 25))


@pytest.mark.parametrize("stretch", [0.9, 1.0, 1.3, 2.0])
def test_stretched_radii_are_those_of_the_model(stretch: float) -> None:
    body = ROBOTS["D15L40"]
    section = deform(body, material("Ecoflex 00-50"), [0.0] * 3, stretch, Coefficients())
    radii = stretched_radii(body, stretch)
    assert radii.outer == pytest.approx(float(section.outer_radius), rel=1e-14)
    assert radii.lumen == pytest.approx(float(section.lumen_radius), rel=1e-14)
    assert radii.chamber_circle == pytest.approx(float(section.chamber_circle_radius), rel=1e-14)
    assert radii.chamber == pytest.approx(float(section.chamber_radius), rel=1e-14)
    assert radii.bore == pytest.approx(float(section.bore_radius), rel=1e-14)


def test_stretched_section_stands_beside_at_the_same_scale() -> None:
    body = ROBOTS["laparoscope-9"]
    figure = section_figure(body, stretch=1.6)
    made, stretched = figure.axes
    assert (made.get_xlim(), made.get_ylim()) == (stretched.get_xlim(), stretched.get_ylim())
    assert made.get_position().size == pytest.approx(stretched.get_position().size)
    radii = stretched_radii(body, 1.6)
    assert circles(stretched, "bore")[0].get_radius() == pytest.approx(1e3 * radii.bore)
    assert len(circles(stretched, "broken rule")) == 9  # neighbours touch above 1.43
    assert not circles(made, "broken rule")
    assert any("touch above stretch 1.43" in t for t in texts(figure))


def crowded() -> Robot:
    return replace(ROBOTS["D10L60"], chamber_diameter=2.6e-3, chamber_circle_diameter=7e-3, name="crowded")


def test_broken_rules_are_red_with_their_message() -> None:
    body = crowded()
    broken = violations(body)
    assert len(broken) == 3
    figure = section_figure(body, broken)
    marked = circles(figure.axes[0], "broken rule")
    assert len(marked) == len({n for v in broken for n in v.chambers})
    red = " ".join(" ".join(t.get_text().split()) for t in figure.texts if t.get_color() == WRONG)
    for violation in broken:
        assert f"{violation.rule}: {violation.message}" in red


@pytest.mark.parametrize("stretch", [0.0, -1.0, 0.3, math.nan, math.inf])
def test_impossible_stretch(stretch: float) -> None:
    with pytest.raises(InputError, match="expected a stretch above"):
        section_figure(ROBOTS["D25L60"], stretch=stretch)


@pytest.mark.parametrize("body", [*ROBOTS.values(), crowded()], ids=lambda r: r.name)
def test_texts_of_a_section_do_not_meet(body: Robot) -> None:
    figure = section_figure(body, violations(body), stretch=1.5)
    figure.canvas.draw()
    found = [*figure.texts, *figure.legends[0].get_texts(), *(t for axes in figure.axes for t in axes.texts)]
    found = [t for t in found if not t.get_text().isdigit()]
    assert overlaps(found) == []
    assert outside(figure, found) == []


# --- silicones ---


def test_curves_are_the_materials_in_kpa() -> None:
    materials = [material("Ecoflex 00-50"), material("Ecoflex 00-50", "yeoh"), material("Dragon Skin 10")]
    figure = material_figure(materials, (1.0, 2.5))
    for axes, method in zip(figure.axes, ("engineering_stress", "true_stress", "tangent_modulus"), strict=True):
        for silicone in materials:
            (line,) = labelled(axes, f"{silicone.name}, {silicone.law.name}")
            expected = getattr(silicone, method)(np.asarray(line.get_xdata())) / 1e3
            assert np.allclose(line.get_ydata(), expected)
            assert line.get_xdata()[[0, -1]].tolist() == [1.0, 2.5]
        (shade,) = labelled(axes, "fitted range")
        assert shade.get_extents().transformed(axes.transData.inverted()).intervalx == pytest.approx([1, 2])
        assert "[kPa]" in axes.get_ylabel()
    lines = [labelled(figure.axes[0], f"{m.name}, {m.law.name}")[0] for m in materials]
    assert lines[0].get_color() == lines[1].get_color() != lines[2].get_color()
    assert lines[0].get_linestyle() == lines[2].get_linestyle() != lines[1].get_linestyle()


def test_a_law_that_runs_away_does_not_hide_the_others() -> None:
    laws = [material("Ecoflex 00-50", law) for law in ("mooney-rivlin", "ogden")]
    axes = material_figure(laws, (1.0, 6.0)).axes[0]
    highest = max(m.engineering_stress(2.0) for m in laws) / 1e3
    assert axes.get_ylim()[1] == pytest.approx(1.25 * highest, rel=0.01)


def test_every_silicone_and_law_can_be_told_apart() -> None:
    own = [
        Material("mine", formula_law(name, "c * (stretch - stretch**-2)", ["c"]), {"c": 0.03}) for name in ("a", "b")
    ]
    names = ("Dragon Skin 10", "Ecoflex 00-50", "Ecoflex 00-30", "Ecoflex 00-20", "Ecoflex 00-10")
    laws = ("linear", "neo-hookean", "mooney-rivlin", "yeoh", "ogden")
    figure = material_figure([*(material(n, law) for n in names for law in laws), *own])
    curves = [line for line in figure.axes[0].lines if ", " in str(line.get_label())]
    looks = {(line.get_color(), str(line._dash_pattern)) for line in curves}  # type: ignore[attr-defined]
    assert len(curves) == len(looks) == 27
    figure.canvas.draw()
    found = [*figure.texts, *(t for legend in figure.legends for t in legend.get_texts())]
    found += [label for axes in figure.axes for label in (axes.xaxis.label, axes.yaxis.label)]
    assert overlaps(found) == []
    assert outside(figure, found) == []


def test_material_figure_refuses_nothing_to_draw() -> None:
    with pytest.raises(InputError, match="at least one material"):
        material_figure([])
    for limits in ((2.0, 1.0), (0.0, 2.0), (1.0, math.inf), (1.0, math.nan)):
        with pytest.raises(InputError, match="range of stretch"):
            material_figure([material("Ecoflex 00-50")], limits)


# --- saving ---


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".PDF", b"%PDF"), (".svg", b"<?xml")])
def test_figure_is_saved_by_its_suffix(suffix: str, start: bytes, tmp_path: Path) -> None:
    path = save_figure(material_figure([material("Ecoflex 00-50")]), tmp_path / f"f{suffix}")
    assert path.read_bytes().startswith(start)


@pytest.mark.parametrize("name", ["f", "f.bmp", "f.png.txt"])
def test_unknown_suffix(name: str, tmp_path: Path) -> None:
    figure = material_figure([material("Ecoflex 00-50")])
    with pytest.raises(InputError, match=r"ends in \.png, \.pdf or \.svg"):
        save_figure(figure, tmp_path / name)
    with pytest.raises(InputError, match="cannot be written"):
        save_figure(figure, tmp_path / "nowhere" / "f.png")
    assert list(tmp_path.iterdir()) == []


def test_nothing_global_changes() -> None:
    before = dict(matplotlib.rcParams)
    drawn(ramp_run(2))
    section_figure(ROBOTS["D25L60"], stretch=1.2)
    assert dict(matplotlib.rcParams) == before


def test_many_sets_and_steps_can_be_drawn() -> None:
    body = Robot("nine", 0.03, 0.012, 0.021, 2e-3, 5e-4, 0.05, 9, 1, 0.1)
    steps = [arc_step(body, [1e3 * k * (n % 3) for n in range(9)]) for k in range(60)]
    figure = run_figure(view_of_run(run_of([*steps, failed_step([0.0] * 9)], robot=body)))
    assert len(figure.axes[-1].lines) == 9
    section = section_figure(body, stretch=1.1)
    for picture in (figure, section):
        picture.canvas.draw()
        found = [*picture.texts, *picture.legends[0].get_texts()]
        assert overlaps(found) == []
        assert outside(picture, found) == []
