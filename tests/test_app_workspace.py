"""The workspace tab: the sweep is the package's own, can be stopped and gone on with, and its points give pressures."""

from __future__ import annotations

import tomllib
from pathlib import Path
from threading import Thread
from time import sleep

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import NotedView, done, enter, field, opened, ran

from softnlp.app.asking import Progress, scenario_with
from softnlp.app.session import Session
from softnlp.app.tabs import workspace as cloud
from softnlp.app.tabs.workspace import workspace_tab
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.studies.ellipsoids import manipulability
from softnlp.studies.sensitivity import tip_jacobian


def swept(folder: Path, workspace: dict[str, object], progress: Progress | None = None) -> cloud.Swept:
    session = Session()
    asked = scenario_with(session, "workspace", {"workspace": workspace})
    return cloud.sweep(asked, folder, 1, progress or Progress())


@pytest.mark.thorough
def test_manipulability_of_a_grid_is_that_of_the_tip_jacobian(tmp_path: Path) -> None:
    """Differences over the grid approach the exact derivative as its square."""
    errors = []
    for levels in (5, 9):
        found = swept(tmp_path, {"levels": levels, "from_bar": 0.2, "to_bar": 1.0})
        assert found.workspace is not None
        values = cloud.manipulability_of_grid(found)
        assert values is not None
        assert cloud.MANIPULABILITY in cloud.quantities(found)
        pressure = np.array([0.4, 0.8, 0.6]) * BAR
        number = int(np.argmin(np.abs(found.workspace.pressure - pressure).sum(axis=1)))
        np.testing.assert_allclose(found.workspace.pressure[number], pressure)
        s = found.asked
        model = (s.robot, s.material)
        exact = manipulability(tip_jacobian(*model, pressure, coefficients=s.coefficients)).measure
        errors.append(abs(values[number] / (exact / MILLIMETRE**3 * BAR**3) - 1))
    assert errors[1] < 0.03
    assert errors[1] < 0.4 * errors[0]


def test_manipulability_needs_three_sets_and_a_grid(tmp_path: Path) -> None:
    for table in ({"samples": 8, "to_bar": 1.0}, {"levels": 3, "to_bar": 1.0, "sets": [1, 2]}):
        found = swept(tmp_path, table)
        assert cloud.manipulability_of_grid(found) is None
        assert cloud.MANIPULABILITY not in cloud.quantities(found)


def stopped(folder: Path) -> cloud.Swept:
    progress, found = Progress(), []
    work = Thread(target=lambda: found.append(swept(folder, {"samples": 100_000, "to_bar": 1.2}, progress)))
    work.start()
    while "poses/s" not in progress.text and work.is_alive():
        sleep(0.01)
    sleep(0.3)
    progress.stop()
    work.join(60)
    return found[0]


@pytest.mark.thorough
def test_a_stopped_sweep_is_gone_on_with(tmp_path: Path) -> None:
    first = stopped(tmp_path)
    assert first.news.stopped
    assert 0 < first.news.done < 100_000
    assert first.workspace is None
    assert cloud.quantities(first) == {}
    assert stopped(tmp_path).news.already == first.news.done


def test_colours_run_from_the_smallest_number_to_the_largest() -> None:
    colours = cloud.colours_of(np.array([1.0, np.nan, 3.0, 2.0]))
    assert colours.shape == (4, 3)
    assert colours[1] == pytest.approx([0.5] * 3)
    assert colours[0].sum() < colours[3].sum() < colours[2].sum()  # viridis rises in lightness
    assert cloud.limits(np.full(2, np.nan)) == (0.0, 0.0)
    assert np.isfinite(cloud.colours_of(np.ones(3))).all()


def test_a_line_of_sight_meets_the_point_in_front(tmp_path: Path) -> None:
    """From straight above the axis, the poses with equal pressures stand behind each other."""
    found = swept(tmp_path, {"levels": 3, "to_bar": 1.0})
    assert found.workspace is not None
    above = cloud.in_sight(found.workspace, (0.0, 0.0, 300.0), (0.0, 0.0, -1.0))
    below = cloud.in_sight(found.workspace, (0.0, 0.0, -300.0), (0.0, 0.0, 1.0))
    assert above is not None
    assert below is not None
    np.testing.assert_allclose(found.workspace.pressure[[above, below]], [[1.0 * BAR] * 3, [0.0] * 3])
    assert cloud.in_sight(found.workspace, (0.0, 0.0, 300.0), (0.0, 0.0, 1.0)) is None


async def _visit() -> None:
    async with opened(workspace_tab, "workspace") as (user, stage):
        view = stage.view
        assert isinstance(view, NotedView)
        enter(user, "workspace.levels", 4)
        enter(user, "workspace.to_bar", 1.0)
        assert "64 poses" in field(user, "workspace.count").text
        await ran(user, "workspace", "64 poses, 0 failed")
        assert view.points_shown.shape == view.colours_shown.shape == (64, 3)
        numbers = {row["c0"]: row["c1"] for row in field(user, "workspace.numbers").rows}
        assert numbers["Solved"] == "64"
        # a click near a tip gives its pressures, when that is wanted
        tip = view.points_shown[37]
        viewer = np.array([150.0, -200.0, 90.0])
        along = (tip - viewer) / np.linalg.norm(tip - viewer)
        before = stage.session.pressure.copy()
        view.handlers[0](tuple(viewer), tuple(along))
        assert (stage.session.pressure == before).all()
        enter(user, "workspace.pick", True)
        view.handlers[0](tuple(viewer), tuple(along))
        scenario = stage.session.scenario
        assert scenario is not None
        run, _ = stage.session.live.pose(scenario, stage.session.pressure)
        assert run.steps[0].pose is not None
        assert run.steps[0].pose.tip_position / MILLIMETRE == pytest.approx(view.points_shown[37], abs=1e-3)
        # another study takes the points away, and this one brings them back
        stage.session.choose("forward")
        assert view.points_shown is None
        stage.session.choose("workspace")
        assert len(view.points_shown) == 64
        # samples, a wall, and what cannot be run
        enter(user, "workspace.kind", "samples")
        assert stage.session.document.table("workspace") == {"samples": 1000, "to_bar": 1.0}
        stage.session.change_all("contact", {"closure": "rigid"})
        assert "contact" not in tomllib.loads(
            stage.session.text()
        )  # it belongs to the blocked force until it is wanted
        enter(user, "workspace.wall", True)
        assert tomllib.loads(stage.session.text())["contact"] == {"closure": "rigid"}
        assert Session(stage.session.text()).document.sweeps_wall
        stage.session.change_all("contact", {"offset_mm": 0.0})
        enter(user, "workspace.samples", 16)
        await ran(user, "workspace", "16 poses, 0 failed")
        assert "blocked_force_N" in field(user, "workspace.colour").options
        enter(user, "workspace.colour", "blocked_force_N")
        assert field(user, "workspace.high").text.endswith(" N")
        for samples, words in ((10**7, "too many for this page"), (-3, "samples"), (10**12, "at most")):
            enter(user, "workspace.samples", samples)
            await ran(user, "workspace", words)


def test_a_sweep_on_the_page() -> None:
    done(_visit())
