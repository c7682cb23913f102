"""What is said of speed and of how far a command is."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from softnlp.cli import main
from softnlp.cli.figures import draw
from softnlp.cli.sweep import COMPILING, _Bar
from softnlp.native import jit
from softnlp.sweep.run import SweepProgress

GRID = """study = "workspace"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[workspace]
levels = 2
to_bar = 0.5
sets = [1]
"""


class Screen(io.StringIO):
    """A terminal."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def terminal(monkeypatch: pytest.MonkeyPatch) -> Screen:
    """Return what stands for standard error; called in a test, since pytest puts its own there after fixtures."""
    made = Screen()
    monkeypatch.setattr(sys, "stderr", made)
    monkeypatch.setenv("COLUMNS", "300")
    return made


def swept(tmp_path: Path, more: str = "") -> int:
    (tmp_path / "x.toml").write_text(GRID + more)
    return main(["sweep", str(tmp_path / "x.toml"), "--out", str(tmp_path / "out"), "--workers", "1"])


def test_a_sweep_says_that_it_has_no_compiled_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SOFTNLP_COMPILE", "0")
    assert swept(tmp_path) == 0
    told = capsys.readouterr().err
    assert (
        told
        == "softnlp: warning: no compiled code (SOFTNLP_COMPILE is 0): the same numbers, some 10 to 20 times slower\n"
    )


@pytest.mark.parametrize("solver", ['engine = "ipopt"', 'transcription = "collocation"'])
def test_poses_that_are_solved_alone_say_nothing_of_it(
    solver: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SOFTNLP_COMPILE", "0")
    assert swept(tmp_path, f"[solver]\n{solver}\n") == 0
    assert capsys.readouterr().err == ""


def test_a_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SOFTNLP_COMPILE", raising=False)
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    assert jit.why_interpreted() == "llvmlite is not installed"
    assert not jit.can_compile()


def test_the_bar_says_that_code_is_being_built_until_poses_come(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal(monkeypatch)
    with _Bar("title", COMPILING) as bar:
        bar.show(SweepProgress(done=0, poses=20, already=0, failed=0, seconds=0.1))
        assert bar._shown.tasks[0].description == COMPILING
        bar.show(SweepProgress(done=10, poses=20, already=0, failed=0, seconds=1.0))
        assert bar._shown.tasks[0].description == ""


def test_figures_have_a_fraction_and_the_time_left(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    screen = terminal(monkeypatch)
    from matplotlib.figure import Figure

    assert len(draw({tmp_path / f"{k}.png": lambda: Figure((1, 1)) for k in range(3)})) == 3
    shown = screen.getvalue()
    assert "figures" in shown
    assert "/3" in shown
