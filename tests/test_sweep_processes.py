"""Sweeps in processes of their own: killed, interrupted, on a cluster."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from sweeps import GRID, HEAD, QUICK

sys.path.insert(0, str(Path(__file__).parents[1]))  # benchmarks/ is not installed

from benchmarks import sweep_kill
from softnlp import __version__
from softnlp.batch.chunk import ChunkSolver
from softnlp.scenario.read import load_scenario
from softnlp.scenario.workspace import plan_of, run_sweep
from softnlp.sweep.dataset import data_hash
from softnlp.sweep.journal import Journal
from softnlp.sweep.run import JOURNAL_FILE, WORKSPACE_FILE


def written(folder: Path, tables: str) -> Path:
    path = folder / "grid.toml"
    path.write_text(HEAD + tables)
    return path


@pytest.mark.thorough
def test_a_sweep_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    """As soon as something more is confirmed, twice; `python -m benchmarks.sweep_kill` does it at random moments."""
    whole = sweep_kill.plan(4)
    run_sweep(whole, tmp_path / "whole")
    confirmed = 0
    for _ in range(2):
        killed = sweep_kill.run_child(tmp_path / "killed", 4, kill_at=confirmed + 1)
        assert killed.already >= confirmed
        assert max(1, confirmed) <= killed.confirmed
        assert not killed.orphans
        confirmed = killed.confirmed
    summary = run_sweep(whole, tmp_path / "killed", resume=True)
    assert summary.already >= confirmed
    assert data_hash(tmp_path / "killed" / WORKSPACE_FILE) == data_hash(tmp_path / "whole" / WORKSPACE_FILE)


def test_ctrl_c_keeps_what_was_solved(tmp_path: Path) -> None:
    """Of a real sweep in a process of its own, sent to all of its processes as a terminal does."""
    path = written(tmp_path, GRID.replace("levels = 3", "levels = 20") + QUICK)  # not done in a moment
    out = tmp_path / "out"
    words = [sys.executable, "-m", "softnlp", "sweep", str(path), "--out", str(out), "--workers", "2"]
    code = (
        "import sys, softnlp.scenario.workspace as planning; from softnlp.cli import main; "
        "from dataclasses import replace; own = planning.plan_of; "
        "planning.plan_of = lambda asked: replace(own(asked), chunk=8); sys.exit(main(sys.argv[1:]))"
    )
    process = subprocess.Popen(
        [words[0], "-c", code, *words[3:]],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    journal = out / f"{JOURNAL_FILE}-wal"
    end = time.monotonic() + 60
    while not (journal.exists() and journal.stat().st_size > 150_000) and time.monotonic() < end:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    told, error = process.communicate(timeout=60)
    assert process.returncode == 130, error
    match = re.fullmatch(r"(\d+) poses, 0 failed, [\d.]+ s, \d+ poses/s", told.splitlines()[-1])
    assert match
    assert 0 < int(match[1]) < 8000
    assert error == (
        f"softnlp: stopped after {match[1]} of 8000 poses, which are kept; "
        f"`softnlp sweep {path} --out {out} --resume` continues\n"
    )
    same = replace(plan_of(load_scenario(path)), chunk=8)
    with Journal(out / JOURNAL_FILE, same, __version__, resume=True) as kept:
        assert kept.poses == int(match[1])
        block = next(kept.blocks())
    again = ChunkSolver(same).solve(block.chunk)
    assert block.rows.tobytes() == again.rows.tobytes()


_ON_A_CLUSTER = """
import sys
from pathlib import Path
from distributed import LocalCluster
from softnlp.cli import main
from softnlp.sweep import pool
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        status = main([*sys.argv[1:], "--cluster", cluster.scheduler_address])
    pool.CONNECT_PATIENCE = "0.2s"
    for address in ("tcp://127.0.0.1:1", "nonsense://x"):
        assert main([*sys.argv[1:], "--cluster", address, "--resume"]) == 2
    sys.exit(status)
"""


@pytest.mark.thorough
def test_a_dask_cluster_gives_the_same_bits_and_one_that_is_not_there_is_named(tmp_path: Path) -> None:
    """In a process of its own: Dask leaves threads behind, with which nothing should be forked."""
    pytest.importorskip("distributed")
    path = written(tmp_path, "[workspace]\nlevels = 2\nto_bar = 0.5\n" + QUICK)
    words = [sys.executable, "-c", _ON_A_CLUSTER, "sweep", str(path), "--out", str(tmp_path / "out")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"8 poses, 0 failed, [\d.]+ s, \d+ poses/s", done.stdout.splitlines()[-1])
    unreachable = [line for line in done.stderr.splitlines() if line.startswith("softnlp: ")]
    assert [line[:52] for line in unreachable] == [
        "softnlp: --cluster: no Dask scheduler answers at 'tc",
        "softnlp: --cluster: no Dask scheduler answers at 'no",
    ]
    run_sweep(plan_of(load_scenario(path)), tmp_path / "here")
    assert data_hash(tmp_path / "out" / WORKSPACE_FILE) == data_hash(tmp_path / "here" / WORKSPACE_FILE)
