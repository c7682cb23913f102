"""Kill a sweep at random moments with SIGKILL and continue it: nothing confirmed is lost, and the result is the same.

    python -m benchmarks.sweep_kill --kills 20

Each sweep is a process of its own with two workers. It is killed once at a random moment, from its start to after its
end, and continued; the digest of the data must be that of a sweep that nothing disturbed.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from softnlp.batch.plan import Plan
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.workspace import plan_of, run_sweep
from softnlp.sweep.dataset import data_hash
from softnlp.sweep.run import WORKSPACE_FILE, SweepProgress

SCENARIO = """study = "workspace"
robot = { name = "D25L60" }
material = { name = "Ecoflex 00-50", model = "mooney-rivlin" }
gravity = { direction = "-z" }
solver = { intervals = 10, accuracy = 1e-3 }
workspace = { levels = LEVELS, to_bar = 1.2 }
"""
CHUNK = 4
WORKERS = 2


def plan(levels: int) -> Plan:
    """Return a plan of small chunks, so that many are confirmed in a short time."""
    asked = scenario_from_text(SCENARIO.replace("LEVELS", str(levels)), "sweep_kill.toml")
    return replace(plan_of(asked), chunk=CHUNK)


def child(folder: Path, levels: int) -> None:
    """Run or continue a sweep; print how many poses were there, then each number of confirmed poses."""

    def told(news: SweepProgress) -> None:
        print(news.already, news.done, flush=True)

    summary = run_sweep(plan(levels), folder, workers=WORKERS, resume=True, progress=told)
    print(summary.already, summary.done, flush=True)
    print("end", flush=True)


@dataclass(frozen=True)
class Outcome:
    """What a process said before it ended.

    already : poses that were there. confirmed : at last. finished : whether it came to its end. orphans : workers of it
    that still ran after a while.
    """

    already: int
    confirmed: int
    finished: bool
    orphans: int


def run_child(folder: Path, levels: int, kill_after: float | None = None, kill_at: int | None = None) -> Outcome:
    """Run a sweep in a process, killed after so many seconds or as soon as so many poses are confirmed."""
    command = [sys.executable, "-m", "benchmarks.sweep_kill", "--child", str(folder), "--levels", str(levels)]
    slow = {**os.environ, "SOFTNLP_COMPILE": "0"}  # compiled, it would be over before it can be killed
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[1], env=slow)
    assert process.stdout is not None
    workers: list[int] = []
    lines: list[str] = []
    if kill_after is not None:
        time.sleep(kill_after)
    while kill_at is not None and (line := process.stdout.readline().strip()):
        lines.append(line)
        if line == "end" or int(line.split()[-1]) >= kill_at:
            break
    if kill_after is not None or kill_at is not None:
        workers = children(process.pid)
        process.send_signal(signal.SIGKILL)
    lines += process.communicate()[0].splitlines()
    news = [tuple(map(int, line.split())) for line in lines if line != "end"]
    if kill_after is None and kill_at is None and (process.returncode or not news):
        raise RuntimeError(f"the sweep ended with {process.returncode}")
    return Outcome(
        already=news[0][0] if news else 0,
        confirmed=max((done for _, done in news), default=0),
        finished="end" in lines,
        orphans=left_over(workers),
    )


def children(process: int) -> list[int]:
    """Return the direct children of a process."""
    with suppress(OSError):
        return [int(n) for n in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    return []


def left_over(processes: list[int], patience: float = 5.0) -> int:
    """Return how many processes still run after a while."""
    end = time.monotonic() + patience
    while (running := sum(map(_runs, processes))) and time.monotonic() < end:
        time.sleep(0.05)
    return running


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--levels", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--child", type=Path)
    given = parser.parse_args()
    if given.child is not None:
        child(given.child, given.levels)
        return 0
    rng = random.Random(given.seed)
    with tempfile.TemporaryDirectory() as folder:
        began = time.monotonic()
        run_child(Path(folder, "whole"), given.levels)
        whole = time.monotonic() - began
        wanted = data_hash(Path(folder, "whole", WORKSPACE_FILE))
        print(f"{given.levels**3} poses, {whole:.1f} s undisturbed, data {wanted[:12]}")
        print("kill  after [s]  confirmed  there on resume  orphans  same data")
        wrong = 0
        for number in range(1, given.kills + 1):
            place = Path(folder, str(number))
            moment = rng.uniform(0.0, 1.1 * whole)
            killed = run_child(place, given.levels, moment)
            resumed = run_child(place, given.levels)
            same = data_hash(place / WORKSPACE_FILE) == wanted
            wrong += not (same and resumed.already >= killed.confirmed and not killed.orphans)
            print(
                f"{number:4}  {moment:9.2f}  {killed.confirmed:9}  {resumed.already:15}  {killed.orphans:7}  "
                f"{'yes' if same else 'NO':>9}",
                flush=True,
            )
        print(f"{given.kills - wrong} of {given.kills} as they should be")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
