"""Workers leave the script alone that asked for them, wherever it came from and whatever threads it has."""

from __future__ import annotations

import subprocess
import sys
import threading
from multiprocessing import spawn
from pathlib import Path
from typing import Any

import pytest
from sweeps import HEAD, QUICK

from softnlp import InputError, load_scenario, run_design, run_scenario, run_sweep
from softnlp.base import processes
from softnlp.scenario.read import scenario_from_text

LIGHT = """
import threading, time
from concurrent.futures import ProcessPoolExecutor
from softnlp.base.processes import begin_worker, process_context
threading.Thread(target=time.sleep, args=(60,), daemon=True).start()  # as an editor or a notebook has
print("top level", flush=True)
with ProcessPoolExecutor(2, mp_context=process_context(), initializer=begin_worker) as pool:
    print(list(pool.map(abs, [-1, -2])))
"""
TABLES = HEAD + "[workspace]\nlevels = 2\nto_bar = 0.5\n" + QUICK
STUDIES = f"""
import threading, time
from dataclasses import replace
from softnlp import BAR, DesignTask, Material, at_most, design, function_law, material, robot, run_sweep
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.workspace import plan_of
threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
print("top level", flush=True)
asked = scenario_from_text({TABLES!r}, "x.toml")
own = Material("mine", function_law("mine", lambda stretch, c: c * (stretch - stretch**-2), ["c"]), {{"c": 0.03}})
plan = replace(plan_of(asked), model=replace(asked.model, material=own), chunk=2)
summary = run_sweep(plan, "swept", workers=2)
print(summary.done, summary.failed)
silicones = [own, material("Dragon Skin 10")]
task = DesignTask({{"material": silicones}}, 1.0 * BAR, requirements={{"stretch": at_most(2.0)}}, maximise="stretch")
inside = []
ask = threading.Thread(target=lambda: inside.append(design(robot("D25L60"), own, task, workers=2)))
ask.start()
ask.join()
print([c.material.name for c in inside[0].feasible])
"""


@pytest.mark.parametrize("way", ["file", "module", "standard input", "-c"])
def test_a_script_without_a_guard_runs_once(way: str, tmp_path: Path) -> None:
    (tmp_path / "plain.py").write_text(LIGHT)
    words = {"file": ["plain.py"], "module": ["-m", "plain"], "standard input": ["-"], "-c": ["-c", LIGHT]}[way]
    told = LIGHT if way == "standard input" else None
    done = subprocess.run(
        [sys.executable, *words], input=told, capture_output=True, text=True, cwd=tmp_path, timeout=120
    )
    assert (done.stdout, done.stderr) == ("top level\n[1, 2]\n", "")


@pytest.mark.thorough
def test_a_sweep_and_a_design_run_from_a_script_whose_law_is_its_own(tmp_path: Path) -> None:
    """The law is a lambda of the script, which no other process can import; the design is asked for in a thread."""
    done = subprocess.run(
        [sys.executable, "-"], input=STUDIES, capture_output=True, text=True, cwd=tmp_path, timeout=300
    )
    assert done.stderr == ""
    assert done.stdout == "top level\n8 0\n['mine', 'Dragon Skin 10']\n"


def test_processes_that_others_start_meanwhile_are_told_their_main(monkeypatch: pytest.MonkeyPatch) -> None:
    main = sys.modules["__main__"]
    monkeypatch.setattr(main, "__spec__", None)  # a script, however the tests were started
    monkeypatch.setattr(main, "__file__", "script.py", raising=False)
    told: dict[str, set[str]] = {}

    def ask(who: str) -> None:
        told[who] = {key for key in spawn.get_preparation_data("a process") if key.startswith("init_main")}

    ask("before")
    with processes._without_main():
        ask("ours")
        other = threading.Thread(target=ask, args=("theirs",))
        other.start()
        other.join()
    ask("after")
    assert told["ours"] == set()
    assert told["before"] == told["theirs"] == told["after"] != set()


@pytest.mark.parametrize("workers", ["2", None, 0, -1, 2.5, True, 1_000_000, [2]])
def test_what_is_no_number_of_workers_is_refused_before_anything_is_done(workers: Any, tmp_path: Path) -> None:
    design_scenario = load_scenario(Path(__file__).parents[1] / "scenarios" / "design" / "laparoscope_paper.toml")
    swept = scenario_from_text(TABLES, str(tmp_path / "s.toml"))
    for call in (
        lambda: run_design(design_scenario, workers=workers),
        lambda: run_sweep(swept, tmp_path / "o", workers=workers),
        lambda: run_scenario(swept, workers=workers),
    ):
        with pytest.raises(InputError, match="workers: expected a whole number from 1 to 1024, got "):
            call()
    assert not (tmp_path / "o").exists()
