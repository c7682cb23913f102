"""`softnlp plot FOLDER`: the figures of every study are drawn again from its files, pixel for pixel."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from softnlp.cli import main

SHIPPED = Path(__file__).parents[1] / "scenarios"
MEASURED = str(SHIPPED / "files/measured_angles.csv")
EVERY = {
    "run": ["run", "D25L60_loaded_tip.toml"],
    "blocked": ["run", "blocked/D25L60.toml"],
    "inverse": ["run", "inverse/direction.toml"],
    "tensile": ["identify", "identify/tensile.toml"],
    "own law": ["identify", "identify/tensile_own_law.toml"],
    "identify": ["identify", "identify/measured_forces.toml"],
    "tips": ["identify", "identify/tracked_tips.toml"],
    "design": ["design", "design/D25L60_dimensions.toml"],
    "candidates": ["design", "design/laparoscope_paper.toml"],
    "compare": ["compare", "compare/angles.toml", MEASURED, "--law", "all", "--coefficients", "reproduction",
                "--coefficients", "calibrated"],
    "sensitivity": ["sensitivity", "D25L60_loaded_tip.toml", "--tolerance", "length_mm=0.2", "--samples", "4"],
}  # fmt: skip
QUICK = ("tensile", "sensitivity", "compare", "candidates")


def results(name: str, folder: Path) -> Path:
    command, scenario, *words = EVERY[name]
    assert main([command, str(SHIPPED / scenario), *words, "--out", str(folder)]) == 0
    return folder


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.thorough) for n in EVERY])
def test_figures_are_drawn_again(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = results(name, tmp_path / "first")
    before = {path.name: path.read_bytes() for path in folder.glob("*.png")}
    moved = tmp_path / "moved"
    shutil.move(folder, moved)
    for path in moved.glob("*.png"):
        path.unlink()
    capsys.readouterr()
    assert main(["plot", str(moved)]) == 0
    assert sorted(capsys.readouterr().out.splitlines()) == [f"drawn in {moved / n}" for n in sorted(before)]
    for figure, content in before.items():
        assert (moved / figure).read_bytes() == content, figure


def test_a_workspace_is_drawn_as_its_own_command_does(tmp_path: Path) -> None:
    text = (SHIPPED / "workspace/D25L60_grid.toml").read_text().replace("levels = 22", "levels = 4")
    (tmp_path / "x.toml").write_text(text)
    folder = tmp_path / "out"
    assert main(["sweep", str(tmp_path / "x.toml"), "--out", str(folder), "--workers", "1"]) == 0
    assert main(["workspace", str(folder)]) == 0
    before = {path.name: path.read_bytes() for path in folder.glob("*.png")}
    assert set(before) == {"workspace.png", "dexterity.png"}
    assert main(["plot", str(folder), "--out", str(tmp_path / "again")]) == 0
    for figure, content in before.items():
        assert (tmp_path / "again" / figure).read_bytes() == content


def test_another_format(tmp_path: Path) -> None:
    folder = results("sensitivity", tmp_path / "s")
    assert main(["plot", str(folder), "--format", "pdf", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "sensitivity.pdf").read_bytes().startswith(b"%PDF")
    assert main(["plot", str(folder), "--format", "gif"]) == 2


def test_nothing_to_draw_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plot", str(tmp_path)]) == 2
    assert capsys.readouterr().err == (
        f"softnlp: {tmp_path}: nothing to draw: none of results.nc, workspace.nc, identified.json, design.json, "
        "comparison.json, sensitivity.json is there\n"
    )
    assert main(["plot", str(tmp_path / "no")]) == 2
    assert "there is no such folder" in capsys.readouterr().err
    for text in ("{", "{}"):
        (tmp_path / "identified.json").write_text(text)
        assert main(["plot", str(tmp_path)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert str(tmp_path / "identified.json") in line
    assert main(["plot"]) in (0, 2)
