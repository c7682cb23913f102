"""Figures of comparisons show the numbers, and the document about them tells what there is."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparisons import made_up
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text

from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.cli import main
from softnlp.figures import observable_figure, tips_figure
from softnlp.figures.compare_parts import looks
from softnlp.results.comparison import STATISTICS
from softnlp.scenario.measured_rows import ALIASES, MEASURED_COLUMNS
from softnlp.studies.comparison import OBSERVABLES, Comparison

ROOT = Path(__file__).parents[1]
DOCUMENT = (ROOT / "docs" / "compare.md").read_text()
CODE = set(re.findall(r"`([^`\n]+)`", DOCUMENT))


def ramps(robots: int = 2, variants: int = 2, laws: Sequence[str] = ("mooney-rivlin",)) -> Comparison:
    """Return robots at five pressures of set 1 and of sets 1 and 2, each variant off by its number of degrees."""
    P = np.zeros((10 * robots, 3))
    P[:, 0] = np.repeat(np.tile(np.linspace(0.3, 1.5, 5), 2), robots) * BAR
    P[5 * robots :, 1] = P[5 * robots :, 0]
    values = np.full((len(P), 7), np.nan)
    values[:, 3] = P.sum(axis=1) / BAR * 60 * DEGREE
    off = np.zeros((variants, len(P), 7))
    off[:, :, 3] = (np.arange(variants) + 1)[:, None] * DEGREE
    return made_up(values, values + off, robots, P, laws)


def tips(rows: int = 60, variants: int = 2) -> Comparison:
    random = np.random.default_rng(4)
    values = np.full((rows, 7), np.nan)
    values[:, :3] = random.normal(0, 20 * MILLIMETRE, (rows, 3))
    off = np.zeros((variants, rows, 7))
    off[:, :, :3] = (np.arange(variants) + 1)[:, None, None] * np.array([1, 0, -2]) * MILLIMETRE
    return made_up(values, values + off, pressure=random.uniform(0, BAR, (rows, 3)))


def axes_of(figure: Figure, x_label: str) -> list[Any]:
    return [a for a in figure.axes if a.get_xlabel() == x_label]


def named(figure: Figure, y_label: str) -> Any:
    (axes,) = (a for a in figure.axes if a.get_ylabel() == y_label)
    return axes


def lines(axes: Any, label: str) -> list[Any]:
    return [line for line in axes.lines if line.get_label() == label]


def test_a_panel_for_each_robot_and_combination_of_sets_holds_the_numbers() -> None:
    found = ramps()
    figure = observable_figure(found, "bending_angle", "title")
    panels = [a for a in figure.axes if a.get_title(loc="left")]
    titles = [f"robot {k}, {sets}" for k in (1, 2) for sets in ("set 1", "sets 1+2")]
    assert [a.get_title(loc="left") for a in panels] == titles
    for axes, sets in zip(panels, (1, 2, 1, 2), strict=True):
        (measured,) = lines(axes, "measured")
        assert measured.get_linestyle() == "None"
        assert measured.get_xdata() == pytest.approx([0.3, 0.6, 0.9, 1.2, 1.5])
        assert measured.get_ydata() == pytest.approx(sets * 60 * np.array([0.3, 0.6, 0.9, 1.2, 1.5]))
        for v, label in enumerate(found.labels):
            (line,) = lines(axes, label)
            assert line.get_ydata() == pytest.approx(measured.get_ydata() + v + 1)
    assert len(axes_of(figure, "pressure [bar]")) == 2  # below the lowest row alone


def test_bars_and_boxes_are_of_the_errors() -> None:
    found = ramps(variants=3)
    figure = observable_figure(found, "bending_angle", "title")
    bars = named(figure, "mean error [deg]")
    assert [t.get_text() for t in bars.get_xticklabels()] == ["robot 1", "robot 2"]
    heights = [[patch.get_height() for patch in bar] for bar in bars.containers]
    assert np.allclose(heights, [[1, 1], [2, 2], [3, 3]])
    (boxes,) = axes_of(figure, "simulated - measured [deg]")
    assert [t.get_text() for t in boxes.get_yticklabels()] == ["set 3", "set 2", "set 1"]
    medians = [line.get_xdata()[0] for line in boxes.lines if line.get_linewidth() == 1.5]
    assert medians == pytest.approx([3, 2, 1])
    colours = [to_hex(bar.patches[0].get_facecolor()).upper() for bar in bars.containers]
    assert colours == [look.colour for look in looks(found)]


def test_a_row_without_a_solution_is_a_gap_and_a_cross() -> None:
    found = ramps(robots=1)
    found.simulated[1][0].values[2] = np.nan
    found.simulated[1][0].values[7] = np.nan
    figure = observable_figure(found, "bending_angle", "title")
    axes = figure.axes[0]
    (line,) = lines(axes, "set 2")
    assert np.isnan(line.get_ydata()).tolist() == [False, False, True, False, False]
    (cross,) = (line for line in axes.lines if line.get_marker() == "x")
    assert cross.get_xdata() == pytest.approx([0.9])
    assert any("crosses: no solution" in t.get_text() for t in figure.texts)
    assert not any("crosses" in t.get_text() for t in observable_figure(ramps(), "bending_angle", "t").texts)


def single(variants: int = 2) -> Comparison:
    P = BAR * np.array([[1.5, 0, 0], [1.5, 1.5, 0], [0.5, 0, 1], [0, 0, 0]])
    values = np.full((4, 7), np.nan)
    values[:, 6] = [1.0, 2.0, 3.0, 0.0]
    simulated = np.repeat(values[None], variants, axis=0) * 1.1
    simulated[-1, 1] = np.nan
    return made_up(values, simulated, 2, P)


def test_few_pressures_have_a_lane_each() -> None:
    axes = observable_figure(single(), "blocked_force", "title").axes[0]
    assert axes.get_xlabel() == "blocked force [N]"
    assert [t.get_text() for t in axes.get_yticklabels()] == [
        *("robot 1, set 1 at 1.5 bar", "robot 1, 0.5 / 0 / 1 bar"),
        *("robot 2, at rest", "robot 2, sets 1+2 at 1.5 bar"),
    ]
    assert [line.get_xdata()[0] for line in lines(axes, "measured")] == pytest.approx([1, 3, 0, 2])
    assert [line.get_xdata()[0] for line in lines(axes, "set 1")] == pytest.approx([1.1, 3.3, 0, 2.2])
    assert [line.get_xdata()[0] for line in lines(axes, "set 2")] == pytest.approx([1.1, 3.3, 0])
    assert sum(line.get_marker() == "x" for line in axes.lines) == 1


def test_pressures_that_vary_apart_are_drawn_over_time_or_row() -> None:
    random = np.random.default_rng(2)
    values = np.full((20, 7), np.nan)
    values[:, 4] = random.uniform(0, 0.02, 20)
    found = made_up(values, values[None] * 1.2, pressure=random.uniform(0, BAR, (20, 3)))
    time = np.arange(20) * 2.0
    (axes,) = axes_of(observable_figure(found, "elongation", "t", [time]), "time [s]")
    assert lines(axes, "measured")[0].get_xdata() == pytest.approx(time)
    assert lines(axes, "measured")[0].get_ydata() == pytest.approx(values[:, 4] / MILLIMETRE)
    (axes,) = axes_of(observable_figure(found, "elongation", "t"), "row")
    assert axes.lines[0].get_xdata()[-1] == 20


def test_the_clouds_and_their_errors_are_the_tips() -> None:
    found = tips()
    figure = tips_figure(found, "title")
    clouds: Any = figure.axes[0]
    scattered = {c.get_label(): np.array(c._offsets3d).T for c in clouds.collections if hasattr(c, "_offsets3d")}
    measured = found.observed[0].values[:, :3] / MILLIMETRE
    assert set(scattered) == {"measured", "set 1"}  # of the best variant alone
    assert np.sort(scattered["measured"], axis=0) == pytest.approx(np.sort(measured, axis=0))
    assert np.sort(scattered["set 1"], axis=0) == pytest.approx(np.sort(measured + np.array([1, 0, -2]), axis=0))
    boxes = named(figure, "simulated - measured [mm]")
    assert [t.get_text() for t in boxes.get_xticklabels()] == ["x", "y", "z", "distance"]
    medians = [line.get_ydata()[0] for line in boxes.lines if line.get_linewidth() == 1.5]
    assert medians == pytest.approx([1, 2, 0, 0, -2, -4, 5**0.5, 2 * 5**0.5], abs=1e-9)
    histogram = named(figure, "tips")
    for patch, v in zip(histogram.patches, (0, 1), strict=True):
        counts, edges, _ = patch.get_data()
        assert counts.sum() == 60
        assert edges[np.argmax(counts)] <= (v + 1) * 5**0.5 + 1e-9


def test_no_solution_at_all_is_said() -> None:
    found = tips(variants=1)
    found.simulated[0][0].values[:] = np.nan
    assert any(t.get_text() == "No row has a solution" for t in tips_figure(found, "title").texts)
    angles = ramps(robots=1, variants=1)
    angles.simulated[0][0].values[:] = np.nan
    observable_figure(angles, "bending_angle", "title").canvas.draw()


FIVE = ("linear", "neo-hookean", "mooney-rivlin", "yeoh", "ogden")


@pytest.mark.parametrize(
    "draw",
    [
        lambda: observable_figure(ramps(1, 1), "bending_angle", "One robot"),
        lambda: observable_figure(ramps(4, 15, FIVE), "bending_angle", "$x^2 \\frac " + "long " * 60),
        lambda: observable_figure(ramps(8, 3), "bending_angle", "More panels than are drawn"),
        lambda: observable_figure(single(3), "blocked_force", "Lanes"),
        lambda: tips_figure(tips(), "Tips"),
        lambda: tips_figure(tips(300, 8), "Tips of many variants"),
    ],
    ids=["one", "laws", "robots", "lanes", "tips", "many"],
)
def test_texts_do_not_meet(draw: Callable[[], Figure]) -> None:
    figure = draw()
    figure.canvas.draw()
    shown = [*figure.texts, *(t for legend in figure.legends for t in legend.get_texts())]
    for axes in figure.axes:
        shown += [axes.xaxis.label, axes.yaxis.label, axes.title, axes._left_title]  # type: ignore[attr-defined]
        if not hasattr(axes, "zaxis"):
            shown += _within(axes)
    boxes = [(t.get_text(), t.get_window_extent()) for t in shown if t.get_text().strip() and t.get_visible()]
    assert [(a, b) for (a, box), (b, other) in combinations(boxes, 2) if box.overlaps(other)] == []
    width, height = figure.canvas.get_width_height()
    assert [name for name, b in boxes if b.x0 < 0 or b.y0 < 0 or b.x1 > width or b.y1 > height] == []


def _within(axes: Any) -> list[Text]:
    """Return the labels of ticks that are in sight."""
    found = []
    for place, axis in enumerate((axes.xaxis, axes.yaxis)):
        low, high = sorted(axis.get_view_interval())
        found += [t for t in axis.get_ticklabels() if low <= t.get_position()[place] <= high]
    return found


def test_more_panels_than_fit_are_said() -> None:
    figure = observable_figure(ramps(8, 2), "bending_angle", "title")
    assert sum(bool(a.get_title(loc="left")) for a in figure.axes) == 12
    assert any(t.get_text() == "the first 12 of 16 curves" for t in figure.texts)


# --- the document ---


@pytest.mark.thorough
def test_the_document_s_commands_and_example_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenarios").symlink_to(ROOT / "scenarios")
    (commands,) = re.findall(r"```bash\n(.*?)```", DOCUMENT, re.DOTALL)
    said = []
    for line in commands.splitlines():
        assert main(shlex.split(line)[1:]) == 0, line
        said.append(capsys.readouterr().out)
    (table,) = re.findall(r"```text\n(.*?)```", DOCUMENT, re.DOTALL)
    assert table in said[0]
    assert {f.name for f in Path("results/angles_compare").iterdir()} <= CODE
    (code,) = re.findall(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)
    exec(code, {})
    assert capsys.readouterr().out.splitlines()[-1] == "calibrated"


def test_everything_is_documented(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "--help"]) == 0
    options = set(re.findall(r"--[a-z][a-z-]+", capsys.readouterr().out)) - {"--help", "--version"}
    shown = {code.split()[0] for code in CODE}
    assert len(options) == 10
    assert options <= shown
    assert set(MEASURED_COLUMNS) <= shown
    plain = {name for name in ALIASES if not re.search(r"_[yz]_mm$", name)}
    assert plain <= shown
    assert {o.measured for o in OBSERVABLES.values()} <= shown
    assert set(STATISTICS) <= shown
