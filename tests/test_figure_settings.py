"""Figures are drawn under the project's own settings, and leave those of the user as they were."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

import matplotlib as mpl
import pytest
from cycler import cycler
from matplotlib import font_manager
from matplotlib.figure import Figure

from softnlp import ROBOTS, InputError
from softnlp.cli.figures import draw
from softnlp.figures import save_figure, section_figure
from softnlp.figures.canvas import EAST_ASIAN, MissingGlyphs, OwnFigure, own_settings
from softnlp.figures.style import in_own_style, new_figure

THEIRS: dict[Any, Any] = {
    "text.usetex": True,
    "savefig.dpi": 30,
    "savefig.bbox": "tight",
    "savefig.transparent": True,
    "figure.figsize": (2.0, 2.0),
    "font.size": 31.0,
    "axes.grid": True,
    "lines.linewidth": 9.0,
    "axes.prop_cycle": cycler(color=["pink"]),
}
BROKEN = "text.usetex: \udcff\nno colon\nno.key: 1\nfont.size: large and round\n"


@pytest.fixture(scope="module")
def section(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return the figure of a section as matplotlib's defaults give it."""
    return save_figure(section_figure(ROBOTS["D25L60"]), tmp_path_factory.mktemp("plain") / "s.png").read_bytes()


@in_own_style
def titled(title: str) -> Figure:
    return new_figure(4.0, 1.0, title, "")


def test_the_users_settings_change_no_figure_and_come_back(section: bytes, tmp_path: Path) -> None:
    with mpl.rc_context(THEIRS):
        before = dict(mpl.rcParams)
        figure = section_figure(ROBOTS["D25L60"])
        assert save_figure(figure, tmp_path / "s.png").read_bytes() == section
        figure.savefig(tmp_path / "again.png")
        assert dict(mpl.rcParams) == before
    assert (tmp_path / "again.png").read_bytes() == section
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


def test_a_thread_waits_until_another_has_put_the_settings_back() -> None:
    before = dict(mpl.rcParams)
    entered: list[bool] = []

    @in_own_style
    def enter() -> None:
        entered.append(True)

    other = Thread(target=enter)
    with own_settings():
        other.start()
        other.join(0.1)
        assert not entered
    other.join()
    assert entered
    assert dict(mpl.rcParams) == before


def test_a_figure_outside_the_settings_is_a_mistake_of_ours() -> None:
    with pytest.raises(RuntimeError, match="decorator"):
        new_figure(1.0, 1.0, "", "")


def test_a_command_takes_nothing_from_broken_settings(section: bytes, tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_bytes(BROKEN.encode("utf-8", "surrogateescape"))
    (tmp_path / "no folder").write_text("")
    environment = {**os.environ, "MPLBACKEND": "nonsense", "MPLCONFIGDIR": "no folder", "MATPLOTLIBRC": "matplotlibrc"}
    words = [sys.executable, "-m", "softnlp", "plot", "section", "D25L60", "--out", "s.png"]
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "drawn in s.png\n", "")
    assert (tmp_path / "s.png").read_bytes() == section


def test_characters_without_a_font_are_said_once(tmp_path: Path) -> None:
    with pytest.warns(MissingGlyphs) as heard:
        save_figure(titled("a \N{ROBOT FACE} and a \N{ROBOT FACE}, \N{BOWLING}"), tmp_path / "s.png")
    (warning,) = heard
    assert "has the characters \N{ROBOT FACE}\N{BOWLING}, boxes" in str(warning.message)


def test_a_font_for_other_scripts_is_used_where_it_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stix = font_manager.findfont("STIXGeneral")
    entry = font_manager.FontEntry(fname=stix, name=EAST_ASIAN[-1])
    monkeypatch.setattr(font_manager.fontManager, "ttflist", [*font_manager.fontManager.ttflist, entry])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save_figure(titled("only STIX has \N{MATHEMATICAL BOLD SCRIPT SMALL A}"), tmp_path / "s.png")


def refused() -> Figure:
    raise InputError("expected another thing")


def failing(error: type[BaseException]) -> Callable[[], Figure]:
    def fail() -> Figure:
        raise error("a\nreason")

    return fail


def test_a_figure_that_fails_is_one_line_and_leaves_no_old_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = tmp_path / "first.png", tmp_path / "second.png"
    first.write_text("of an earlier run")
    names = ("one \N{ROBOT FACE}", "two \N{ROBOT FACE}\N{BOWLING}")
    figures = {first: failing(MemoryError)} | {
        tmp_path / f"{k}.png": (lambda name=name: titled(name)) for k, name in enumerate(names)
    }
    assert draw({**figures, second: failing(ZeroDivisionError)}, tmp_path) == [tmp_path / "0.png", tmp_path / "1.png"]
    assert not first.exists()
    out, err = capsys.readouterr()
    assert not out
    drawn_not, again, glyphs = err.splitlines()
    kept = f"; the results are in {tmp_path}"
    assert drawn_not == rf"softnlp: the figure could not be drawn: first.png: MemoryError: a\nreason{kept}"
    assert again == rf"softnlp: the figure could not be drawn: second.png: ZeroDivisionError: a\nreason{kept}"
    assert "the characters \N{ROBOT FACE}\N{BOWLING}, boxes" in glyphs


def test_what_was_asked_wrongly_and_a_second_interrupt_go_on(tmp_path: Path) -> None:
    for error, figure in ((InputError, refused), (KeyboardInterrupt, failing(KeyboardInterrupt))):
        with pytest.raises(error):
            draw({tmp_path / "s.png": figure}, tmp_path)


def test_a_figure_of_ours_is_drawn_by_no_window() -> None:
    figure = titled("a $ sign")
    assert isinstance(figure, OwnFigure)
    assert type(figure.canvas).__module__ == "matplotlib.backends.backend_agg"
    assert not any(text.get_parse_math() for text in figure.texts)
