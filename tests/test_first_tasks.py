"""Three new users reach their goals by the steps of docs/how-to/first-tasks.md alone, in at most ten each."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from docs.tools.steps import action, steps
from softnlp.cli import main

PAGE = "how-to/first-tasks"
TASKS = (
    "From your own robot to its silicone",
    "Your own program, with IPOPT's log",
    "Only the app: design, pin, compare, report",
)
MOST_STEPS = 10


@pytest.mark.parametrize("task", TASKS)
def test_a_task_has_at_most_ten_steps(task: str) -> None:
    found = steps(PAGE, task)
    assert 5 <= len(found) <= MOST_STEPS
    assert all(step.words.endswith((".", ":", "?")) for step in found), [step.words for step in found]


@pytest.mark.thorough
def test_a_maker_chooses_the_silicone_of_his_own_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for step in steps(PAGE, TASKS[0]):
        if step.language == "toml":
            (name,) = re.findall(r"Save this as `([\w.]+)`", step.words)
            Path(name).write_text(step.code)
        for line in step.code.splitlines() if step.language == "bash" else []:
            assert main(shlex.split(line)[1:]) == 0, line
    printed = capsys.readouterr().out
    # the table that --fit prints is what the scenario has
    (fitted,) = re.findall(r"^\[robot\]\n((?:\w+ = .+\n)+)", printed, re.MULTILINE)
    scenario = Path("silicone.toml").read_text()
    for key, number in re.findall(r"^(\w+) = (.+)$", fitted, re.MULTILINE):
        (written,) = re.findall(rf"^{key} = (.+)$", scenario, re.MULTILINE)
        assert float(number) == float(written)
    found = json.loads(Path("results/silicone/design.json").read_text())
    assert [c["status"] for c in found["candidates"]].count("feasible") >= 2
    best = found["best"]
    forces = [c["outputs"]["blocked_force_N"] for c in found["candidates"] if c["status"] == "feasible"]
    assert best["outputs"]["blocked_force_N"] == max(forces)
    assert best["outputs"]["bending_angle_deg"] >= 60 - 1e-3
    assert Path("section-my-robot.png").read_bytes().startswith(b"\x89PNG")
    assert Path("results/free/figure.png").exists()
    assert list(Path("results").rglob("sensitivity.json"))


@pytest.mark.thorough
def test_a_researcher_frees_a_quantity_and_reads_the_log(tmp_path: Path) -> None:
    code = "\n".join(step.code for step in steps(PAGE, TASKS[1]) if step.language == "python")
    told = "print('checked', answer.status, answer['robot.length'][0], answer['tip_position'][0])"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{told}"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    _, status, length, x = done.stdout.splitlines()[-1].split()
    assert status == "solved"
    assert float(x) == pytest.approx(-0.03, abs=1e-9)
    assert float(length) == pytest.approx(0.07, abs=1e-9)  # the longest allowed needs the least pressure
    assert re.search(r"^iter +objective +inf_pr +inf_du", done.stderr, re.MULTILINE)
    assert "EXIT: Optimal Solution Found." in done.stderr
    assert (tmp_path / "sparsity.png").read_bytes().startswith(b"\x89PNG")


def test_each_step_in_the_app_names_what_to_press() -> None:
    assert [action(step) for step in steps(PAGE, TASKS[2])] == [
        ("Press", "Pin", ""),
        ("Open the tab", "Design", ""),
        ("Press", "Open an example", ""),
        ("Press", "Find the best design", ""),
        ("Press", "Use this design", ""),
        ("Press", "Pin", ""),
        ("Put", "Set 1", "0.5"),
        ("Press", "Export", ""),
        ("Choose", "Report, HTML", ""),
    ]
