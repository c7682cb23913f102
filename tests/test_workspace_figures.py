"""The figure of a workspace shows its poses where they are, in their colour, and says what it leaves out."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arc_workspaces import grid, workspace_dataset, write_workspace
from matplotlib.figure import Figure
from matplotlib.text import Text

from softnlp.base.errors import InputError
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.figures import workspace_figure
from softnlp.figures.space import VIEWS, mark_size, outline, seen
from softnlp.sweep.boundary import Extent
from softnlp.sweep.read import Workspace, load_workspace
from softnlp.sweep.summary import parameters, summarise


@pytest.fixture(scope="module")
def space(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    folder = write_workspace(tmp_path_factory.mktemp("sweep"), grid(7), failed={3: "diverged"}, unstable=(5, 6))
    return load_workspace(folder)


def labelled(figure: Figure, label: str) -> list[Any]:
    return [artist for axes in figure.axes for artist in axes.get_children() if artist.get_label() == label]


def texts(figure: Figure) -> str:
    return "\n".join(t.get_text() for t in figure.findobj(Text))


def test_every_panel_shows_every_pose_in_its_colour(space: Workspace) -> None:
    figure = workspace_figure(space, "p2_bar")
    clouds = labelled(figure, "poses")
    assert len(clouds) == 4
    tips, P = space.tip_position[space.solved] / MILLIMETRE, space.pressure[space.solved, 1] / BAR
    for cloud, (first, second, _, _) in zip(clouds[1:], VIEWS, strict=True):
        drawn = np.column_stack([np.asarray(cloud.get_offsets()), np.asarray(cloud.get_array())])
        expected = np.column_stack([tips[:, first], tips[:, second], P])
        assert drawn[np.lexsort(drawn.T)] == pytest.approx(expected[np.lexsort(expected.T)])
    assert sorted(clouds[0].get_array()) == pytest.approx(sorted(P))
    assert "pressure of set 2 [bar]" in texts(figure)
    assert "342 of 343 poses solved  ·  2 unstable" in texts(figure)
    assert "All solved poses are drawn" in texts(figure)
    assert all(cloud.get_rasterized() for cloud in clouds)


def test_the_scales_are_equal_and_named(space: Workspace) -> None:
    figure = workspace_figure(space)
    panels = figure.axes[1:4]
    figure.canvas.draw()
    scales = []
    for axes in panels:
        box = axes.get_window_extent()
        scales += [box.width / np.ptp(axes.get_xlim()), box.height / np.ptp(axes.get_ylim())]
    assert scales == pytest.approx([scales[0]] * 6, rel=1e-3)
    assert [(a.get_xlabel(), a.get_ylabel()) for a in panels] == [
        ("x [mm]", "y [mm]"),
        ("x [mm]", "z [mm]"),
        ("y [mm]", "z [mm]"),
    ]
    assert "bending angle [deg]" in texts(figure)
    low, high = figure.axes[0].get_xlim3d()
    assert (high - low) / np.ptp(figure.axes[0].get_zlim3d()) == pytest.approx(
        figure.axes[0]._box_aspect[0] / figure.axes[0]._box_aspect[2]
    )


def test_no_texts_meet_and_none_is_cut(space: Workspace) -> None:
    figure = workspace_figure(space)
    figure.canvas.draw()
    hidden = {id(t) for t in figure.axes[0].findobj(Text)}  # of 3-D, which turns its texts
    for axes in figure.axes[1:]:
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            ticks = axis.get_major_ticks()
            hidden |= {id(t) for tick in ticks if not low <= tick.get_loc() <= high for t in (tick.label1, tick.label2)}
    found = [t for t in figure.findobj(Text) if t.get_visible() and t.get_text().strip() and id(t) not in hidden]
    boxes = [(t.get_text(), t.get_window_extent()) for t in found]
    assert len(boxes) > 30
    width, height = figure.canvas.get_width_height()
    assert [name for name, b in boxes if b.x0 < 0 or b.y0 < 0 or b.x1 > width or b.y1 > height] == []
    xy, _, yz, bar = (axes.get_window_extent() for axes in figure.axes[1:5])
    assert xy.x1 < bar.x0 < bar.x1 <= yz.x1 + 1  # beside xy, beneath yz: no quarter is empty
    assert xy.y0 < bar.y0 < bar.y1 < yz.y0
    meet = [(a, b) for (a, box), (b, other) in combinations(boxes, 2) if box.overlaps(other)]
    assert meet == []


def test_the_outlines_are_those_of_the_projection(space: Workspace) -> None:
    tips = space.tip_position[space.solved] / MILLIMETRE
    for view in VIEWS:
        found = outline(tips, view, 3)
        ends = found.hull.reshape(-1, 2)
        assert ends.min(axis=0) == pytest.approx(tips[:, list(view[:2])].min(axis=0))
        assert ends.max(axis=0) == pytest.approx(tips[:, list(view[:2])].max(axis=0))
        # closed: each corner ends two edges (a corner where two loops touch, four)
        _, count = np.unique(found.boundary.reshape(-1, 2), axis=0, return_counts=True)
        assert np.all(count % 2 == 0)


def test_a_large_cloud_is_thinned_by_what_is_nearest(space: Workspace) -> None:
    rng = np.random.default_rng(0)
    cloud = rng.random((60_000, 3))
    for view in VIEWS:
        kept = seen(cloud, view, 3000)
        assert len(kept) <= 3000
        assert np.array_equal(kept, seen(cloud, view, 3000))
        depth = view[3] * cloud[:, view[2]]
        assert np.all(np.diff(depth[kept]) >= 0)  # the nearest is drawn last
        assert depth[kept].mean() - depth.min() > 0.9  # of some 20 in each cell the one in front
    assert mark_size(100, 9e4) > mark_size(10_000, 9e4) > 1


def test_a_thinned_figure_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("softnlp.figures.space.MOST_SHOWN", 150)
    monkeypatch.setattr("softnlp.figures.space.shown.__defaults__", (150,))
    monkeypatch.setattr("softnlp.figures.space.seen.__defaults__", (150,))
    figure = workspace_figure(load_workspace(write_workspace(tmp_path, grid(7))))
    counts = [len(cloud.get_array()) for cloud in labelled(figure, "poses")]
    assert max(counts) <= 150
    assert f"Drawn of 343 solved poses: {counts[0]} in 3-D" in texts(figure)


@pytest.mark.parametrize("sets", [1, 2])
def test_one_and_two_sets_are_drawn_and_named(tmp_path: Path, sets: int) -> None:
    """One set gives a curve in a plane, two give a curved surface: no volume of its own, and no error."""
    space = load_workspace(write_workspace(tmp_path, grid(12, sets=sets)))
    assert parameters(space) == sets
    found = summarise(space)
    assert found.boundary.extent is (Extent.CURVE if sets == 1 else Extent.SURFACE)
    assert found.boundary.volume == 0
    figure = workspace_figure(space)
    assert len(labelled(figure, "poses")) == 4
    figure.canvas.draw()


def test_numbers_of_the_summary(space: Workspace) -> None:
    found = summarise(space)
    tips = space.tip_position[space.solved]
    assert (found.poses, found.solved, found.unstable, found.parameters) == (343, 342, 2, 3)
    assert {str(status): n for status, n in found.failed.items()} == {"diverged": 1}
    assert found.reach.highest == tips[:, 2].max()
    assert 0 < found.boundary.volume < found.hull.volume
    assert found.worst_residual == pytest.approx(1e-12)  # not that of the failed pose
    assert found.dexterity is not None
    assert found.dexterity.poses.sum() == 342
    assert found.dexterity.highest_tilt.max() == pytest.approx(np.nanmax(space.bending_angle))
    assert summarise(space, voxel=2e-3).dexterity.size == 2e-3  # type: ignore[union-attr]


def test_sets_that_share_a_pressure_are_one_parameter(tmp_path: Path) -> None:
    P = np.repeat(np.linspace(0, 1 * BAR, 9)[:, None], 3, axis=1) * [1.0, 0.5, 0.0]
    assert parameters(load_workspace(write_workspace(tmp_path / "a", P))) == 1
    dataset = workspace_dataset(P).assign_attrs(varied='["pressure", "tip_force"]')
    (tmp_path / "b").mkdir()
    dataset.to_netcdf(tmp_path / "b" / "workspace.nc", engine="h5netcdf")
    assert parameters(load_workspace(tmp_path / "b")) == 3


def test_nothing_solved_and_one_pose_are_drawn(tmp_path: Path) -> None:
    none = load_workspace(write_workspace(tmp_path / "none", grid(2), failed=dict.fromkeys(range(8), "diverged")))
    assert "No pose has a solution" in texts(workspace_figure(none))
    assert summarise(none).dexterity is None
    assert summarise(none).hull.extent is Extent.EMPTY
    one = load_workspace(write_workspace(tmp_path / "one", grid(2)[:1]))
    workspace_figure(one).canvas.draw()
    assert summarise(one).boundary.extent is Extent.POINT


def test_a_residual_is_on_a_logarithmic_scale(space: Workspace) -> None:
    from matplotlib.colors import LogNorm

    figure = workspace_figure(space, "residual")
    assert isinstance(labelled(figure, "poses")[0].norm, LogNorm)
    figure.canvas.draw()
    with pytest.raises(InputError, match="did you mean 'stretch'"):
        workspace_figure(space, "strech")


def test_bending_and_tilt_agree_with_the_file(space: Workspace) -> None:
    figure = workspace_figure(space, "tilt_deg")
    values = np.sort(np.asarray(labelled(figure, "poses")[1].get_array()))
    assert values == pytest.approx(np.sort(space.tilt[space.solved] / DEGREE), abs=1e-9)
