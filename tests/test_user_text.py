"""What people call things reaches figures, tables and bars as they wrote it; no figure comes before the numbers."""

from __future__ import annotations

import io
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest
from arc_runs import blocked_run
from matplotlib.text import Text

from softnlp.cli import main
from softnlp.cli.console import say_rows
from softnlp.cli.sweep import _Bar
from softnlp.figures import run_figure
from softnlp.figures.canvas import MissingGlyphs, OwnFigure
from softnlp.figures.style import user_text
from softnlp.results import view_of_run
from softnlp.sweep.run import SweepProgress

MARKS = r"$a^{ $b_ %# & ~ \alpha <b>&lt; [red]{x}[/bold]"
ROBOT, SILICONE, LAW = f"_D25 {MARKS}", f"_batch {MARKS}", f"_law {MARKS}"
TITLE = f"budget \N{ROBOT FACE} {MARKS} \\"
OTHER = f"two\nlines\t\x1b[31m {MARKS}{60 * 'x'}"


def quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


OWN = f"""[robot]
name = {quoted(ROBOT)}
outer_diameter_mm = 25
lumen_diameter_mm = 9
chamber_circle_diameter_mm = 17
chamber_diameter_mm = 4.5
chamber_wall_mm = 0.5
length_mm = 60
chamber_sets = 3
chambers_per_set = 2
chamber_angle_deg = 50
"""
RUBBER = f'[material]\nfile = "own $m_{{.toml"\nname = {quoted(SILICONE)}\nmodel = {quoted(LAW)}\n'
QUICK = '[solver]\nengine = "newton"\nintervals = 10\naccuracy = 1e-3\n'


def scenario(study: str, more: str, body: str = OWN + RUBBER + QUICK) -> str:
    return f'study = "{study}"\ntitle = {quoted(TITLE)}\n{body}{more}'


PRESSURE = "[pressure]\nsequence_bar = [[0.5, 0, 0]]\n"
STRETCHES = [1 + k / 9 for k in range(9)]
FILES = {
    "own $m_{.toml": f"""[{quoted(SILICONE)}]
fitted_stretch = [1.0, 1.8]
[{quoted(SILICONE)}.neo-hookean]
mu0_MPa = 0.03
[{quoted(SILICONE)}.{quoted(LAW)}]
formula = "a*(stretch-stretch**-2)"
constants = {{ a = 0.03 }}
""",
    "tips $^{.csv": f"p1_bar,p2_bar,p3_bar,bending_angle_deg,x_mm,y_mm,z_mm,robot\n1,0,0,60,-39,0,48,{ROBOT}\n"
    "0,1,0,20,18,-30,50,\n",
    "others.csv": f'p1_bar,p2_bar,p3_bar,bending_angle_deg,robot\n0.5,0,0,20,"{OTHER}"\n1,0,0,60,"{OTHER}"\n',
    "test.csv": "stretch,stress_MPa\n" + "".join(f"{x},{0.03 * (x - x**-2)}\n" for x in STRETCHES),
    "run.toml": scenario("forward", PRESSURE),
    "inverse.toml": scenario("inverse", "[target]\ntip_position_mm = [[-18, 0, 60]]\n"),
    "identify.toml": scenario(
        "identify",
        '[measurements]\nfile = "others.csv"\nfree = ["a"]\n',
        OWN.replace("[robot]", f"[robots.{quoted(OTHER)}]").replace(f"name = {quoted(ROBOT)}\n", "") + RUBBER + QUICK,
    ),
    "tensile.toml": scenario("identify", '[tensile]\nfile = "test.csv"\nlaws = ["neo-hookean"]\n', RUBBER),
    "design.toml": scenario(
        "design",
        f"[choices]\nmaterial.model = [{quoted(LAW)}]\n[actuation]\nsets = [1]\npressure_bar = 0.5\n"
        '[objective]\nmaximise = "bending_angle_deg"\n',
    ),
    "sweep.toml": scenario("workspace", "[workspace]\nlevels = 2\nto_bar = 1.0\n"),
}
NUMBERS = {
    "run": {"results.nc", "table.csv", "results.json", "versions.json", "scenario.toml"},
    "identify": {"identified.json", "table.csv", "versions.json", "scenario.toml"},
    "design": {"design.json", "table.csv", "best.toml", "versions.json", "scenario.toml"},
    "workspace": {"workspace.nc", "comparison.csv", "versions.json", "scenario.toml"},
    "compare": {"comparison.json", "rows.csv", "summary.csv", "measured.csv", "versions.json", "scenario.toml"},
    "sensitivity": {"sensitivity.json"},
}
SWEPT = "a sweep $^{"
# the words of each command, its results, the figures it draws, and what people named that is to be read in them
COMMANDS: tuple[tuple[tuple[str, ...], set[str], tuple[str, ...], tuple[str, ...]], ...] = (
    (("run", "run.toml", "--out", "run"), NUMBERS["run"], ("figure.png",), (TITLE, ROBOT)),
    (("run", "inverse.toml", "--out", "inverse"), NUMBERS["run"], ("figure.png",), (TITLE, ROBOT)),
    (("run", "identify.toml", "--out", "fit"), NUMBERS["identify"], ("figure.png",), (TITLE,)),
    (("run", "tensile.toml", "--out", "test"), NUMBERS["identify"], ("figure.png",), (SILICONE,)),
    (("design", "design.toml", "--out", "design", "--workers", "1"), NUMBERS["design"], ("figure.png",), (TITLE,)),
    (("sweep", "sweep.toml", "--out", SWEPT, "--workers", "1"), set(), (), ()),
    (
        ("workspace", SWEPT, "--against", "tips $^{.csv"),
        NUMBERS["workspace"],
        ("workspace.png", "dexterity.png", "comparison.png"),
        (TITLE, ROBOT),
    ),
    (
        ("compare", "run.toml", "tips $^{.csv", "--law", "all", "--out", "compare"),
        NUMBERS["compare"],
        ("tips.png", "bending_angle.png"),
        (TITLE, ROBOT, LAW),
    ),
    (
        ("sensitivity", "run.toml", "--samples", "0", "--out", "bars"),
        NUMBERS["sensitivity"],
        ("sensitivity.png",),
        (TITLE, ROBOT, SILICONE),
    ),
    (
        ("plot", "section", "run.toml"),
        set(),
        ("section-_D25--a----b_---------alpha--b--lt---red--x---bold-.png",),
        (ROBOT,),
    ),
    (("plot", "material", "--file", "own $m_{.toml", "--law", "all"), set(), ("materials.png",), (SILICONE, LAW)),
)


@dataclass(frozen=True)
class Told:
    """What a command left. texts : of its figures. before : the files that were there when the first was saved."""

    status: int
    out: str
    err: list[str]
    texts: list[list[str]]
    before: set[str]


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Told]]:
    """Run every command that draws, with figures that are drawn small and then cannot be saved."""
    folder = tmp_path_factory.mktemp("named")
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8", newline="")
    figures: list[list[str]] = []
    found: dict[str, Told] = {}
    with pytest.MonkeyPatch.context() as patch, mpl.rc_context({"text.usetex": True, "text.parse_math": True}):
        patch.chdir(folder)
        patch.setattr("softnlp.figures.style.DPI", 24)

        def unsaved(figure: OwnFigure, *_: Any, **__: Any) -> None:
            figure.canvas.draw()
            figures.append([t.get_text() for t in figure.findobj(Text) if t.get_text().strip()])
            if len(figures) == 1:
                there.update(os.listdir(place) if place.is_dir() else ())
            raise RuntimeError("no ink")

        patch.setattr(OwnFigure, "savefig", unsaved)
        for words, *_ in COMMANDS:
            place = Path(
                words[words.index("--out") + 1] if "--out" in words else words[1] if words[0] == "workspace" else "."
            )
            there: set[str] = set()
            figures.clear()
            out, err = io.StringIO(), io.StringIO()
            patch.setattr(sys, "stdout", out)
            patch.setattr(sys, "stderr", err)
            status = main(words)
            found[" ".join(words)] = Told(status, out.getvalue(), err.getvalue().splitlines(), [*figures], there)
        yield found


def kept_in(words: tuple[str, ...]) -> str:
    """Return what is said of the numbers where a figure fails."""
    if words[0] == "plot":
        return ""
    return f"; the results are in {words[1] if words[0] == 'workspace' else words[words.index('--out') + 1]}"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("words", "numbers", "figures", "names"), COMMANDS, ids=[" ".join(words[:2]) for words, *_ in COMMANDS]
)
def test_names_are_drawn_as_they_are_and_a_figure_that_fails_costs_no_numbers(
    words: tuple[str, ...], numbers: set[str], figures: tuple[str, ...], names: tuple[str, ...], told: dict[str, Told]
) -> None:
    found = told[" ".join(words)]
    assert found.status == (3 if words[0] == "plot" else 0)
    failed = [f"softnlp: the figure could not be drawn: {f}: RuntimeError: no ink{kept_in(words)}" for f in figures]
    glyphs = [line for line in found.err if "no font that figures use has the characters \N{ROBOT FACE}" in line]
    assert found.err == failed + glyphs
    assert len(glyphs) == any(TITLE in names for _ in figures)
    assert numbers <= found.before
    assert not found.before & set(figures)
    assert len(found.texts) == len(figures)
    for texts in found.texts:
        assert all(line.isprintable() for text in texts for line in text.split("\n"))
        for name in names:
            assert any(name[:20] in text.replace("\n", " ") for text in texts), (name, texts)


def test_a_blocked_force_shows_names_as_they_are() -> None:
    run = blocked_run()
    named = replace(run, title=TITLE, robot=replace(run.robot, name=ROBOT))
    with mpl.rc_context({"text.usetex": True}):
        figure = run_figure(view_of_run(named))
        with pytest.warns(MissingGlyphs):
            figure.canvas.draw()
    shown = [text.get_text() for text in figure.texts]
    assert shown[0] == TITLE
    assert ROBOT in shown[1]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("command", "count"), [("run run.toml", 4), ("design design.toml", 3), ("compare run.toml", 3), ("sweep", 4)]
)
def test_tables_and_headings_print_names_as_they_are(command: str, count: int, told: dict[str, Told]) -> None:
    (found,) = (t for words, t in told.items() if words.startswith(command))
    assert "".join(found.out.split()).count("".join(MARKS.split())) >= count


def test_a_label_is_one_printable_line_of_a_few_words() -> None:
    assert user_text("a $x_\\ b") == "a $x_\\ b"
    assert user_text("two\nlines\tand \x1b[31m") == "two lines and \\x1b[31m"
    assert user_text("_hidden from legends") == " _hidden from legends"
    assert user_text(1000 * "x", 12) == 11 * "x" + "…"


def test_a_row_of_a_table_is_a_line_whatever_is_in_it(capsys: pytest.CaptureFixture[str]) -> None:
    say_rows(["name", "number"], [["[red]two\nlines\x1b[31m", "1"]])
    assert capsys.readouterr().out.splitlines()[1:] == [r"[red]two\nlines\x1b[31m       1"]


def test_the_bar_of_a_sweep_shows_any_title(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    monkeypatch.setattr(screen, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stderr", screen)
    news = SweepProgress(done=1, poses=2, already=0, failed=1, seconds=1.0)
    with _Bar("[red]{x} %s") as bar:
        bar.show(news)
    assert "[red]{x} %s" in screen.getvalue()
