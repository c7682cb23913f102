"""What the document on workspaces shows runs, and its numbers are those that come out."""

from __future__ import annotations

import inspect
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from arc_workspaces import arcs, grid, write_workspace

from softnlp.base.units import MILLIMETRE
from softnlp.cli import main
from softnlp.cli.workspace import _body
from softnlp.cli.workspace import workspace as command
from softnlp.sweep.boundary import alpha_shape, convex_hull, reach

DOCUMENT = Path(__file__).parents[1] / "docs" / "workspace_figures.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", DOCUMENT.read_text(), re.MULTILINE | re.DOTALL)


@pytest.mark.thorough
def test_the_document_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("softnlp.figures.style.DPI", 30)  # quicker, and as good here
    write_workspace(Path("results/D25L60"), grid(4))
    write_workspace(Path("results/D25L60_loaded"), grid(4), move=np.array([1e-3, 0, 0]))
    Path("measured.csv").write_text(blocks("csv")[0])
    commands = [line for line in blocks("bash")[0].splitlines() if line.startswith("softnlp ")]
    assert len(commands) == 3
    for line in commands:
        assert main(shlex.split(line)[1:]) == 0, line
    # a file for the figure names the others
    assert {"tip.svg", "tip-dexterity.svg", "poses.csv"} <= {f.name for f in Path().iterdir()}
    assert {"workspace.png", "comparison.csv"} <= {f.name for f in Path("results/D25L60").iterdir()}
    (example,) = blocks("python")
    exec(compile(example, str(DOCUMENT), "exec"), {})
    assert Path("stretch.png").exists()
    assert Path("comparison.png").exists()


def test_the_numbers_of_the_document_are_those_of_the_closed_form() -> None:
    """The table of the document, of 22 levels a set."""
    tips = arcs(grid(22))["tip_position"]
    found = reach(tips)
    mm = [v / MILLIMETRE for v in (found.farthest_from_axis, found.nearest_to_base, found.lowest, found.highest)]
    table = blocks("text")[0]
    for value in mm:
        assert f"{value:.2f}" in table
    assert f"convex hull               {_body(convex_hull(tips))}\n" in table
    assert f"boundary                  {_body(alpha_shape(tips))}\n" in table


def test_options_are_documented() -> None:
    text = DOCUMENT.read_text()
    for name in inspect.signature(command).parameters:
        if name != "results":
            assert f"`--{name.replace('_', '-')}" in text
    assert (DOCUMENT.parent / "images" / "workspace.png").exists()
