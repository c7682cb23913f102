"""How this version's times stand to those of version 0.1, both in one run on one machine.

    python -m benchmarks.before [--only PART] [--repeats N] [--out docs/benchmarks/before.md]

Version 0.1 is taken out of the repository's history and runs with the packages that are installed here; without a
history there is nothing to compare, and the program says so. Scenarios are those that version 0.1 shipped, with
`engine = "newton"` and `engine = "auto"` beside it. Times are processor time, of a process of its own each: "cold" is
the process's first run, "warm" the least of those that follow in it, and "command" the whole process. The two
versions take turns, and the least of the turns counts.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import resource
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks import machine
from softnlp.cli.console import say

COMMIT = "22b2c47"
ROOT = Path(__file__).parents[1]
SCENARIOS = (
    *("D25L60_one_set", "D25L60_loaded_tip", "D15L60_hanging", "blocked/D25L60", "blocked/D25L60_weighted"),
    *("blocked/D25L60_constrained", "blocked/D25L60_force", "inverse/circle", "inverse/circle_loaded"),
)
OTHERS = ("identify/measured_angles", "identify/measured_forces", "design/D25L60_dimensions")
SWEEPS = ("workspace/D25L60_grid", "workspace/D25L60_blocked")
COMMANDS = {"import softnlp": ["-c", "import softnlp"], "softnlp --version": ["-m", "softnlp", "--version"]}
_SOLVE = """
import json, sys, time
from softnlp import load_scenario, run_scenario
times = []
for _ in range(int(sys.argv[2])):
    began = time.process_time()
    run_scenario(load_scenario(sys.argv[1]))
    times.append(time.process_time() - began)
print(json.dumps([times[0], min(times[1:])]))
"""


@dataclass(frozen=True)
class Timed:
    """A line: processor seconds of version 0.1, and of this one with each engine."""

    what: str
    before: float
    newton: float
    auto: float


def main() -> int:
    """Print the table, and write it where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="lines whose name contains this")
    parser.add_argument("--repeats", type=int, default=3, help="turns, 3 by default")
    parser.add_argument("--out", type=Path, help="a file for the table")
    asked = parser.parse_args()
    taken = subprocess.run(["git", "archive", COMMIT], cwd=ROOT, capture_output=True, check=False)
    if taken.returncode:
        say(f"version 0.1 (commit {COMMIT}) is not in this checkout's history: nothing to compare")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        old = Path(folder) / "version 0.1"
        with tarfile.open(fileobj=io.BytesIO(taken.stdout)) as archive:
            archive.extractall(old, filter="data")
        lines = []
        for line in timed(old, asked.only, asked.repeats):
            say(f"{line.what}: {line.before:.3f} s, newton {line.newton:.3f} s, auto {line.auto:.3f} s")
            lines.append(line)
    page = table(lines)
    if asked.out:
        asked.out.write_text(page, encoding="utf-8")
    say(f"\n{page}")
    return 0


def timed(old: Path, only: str, repeats: int) -> Iterator[Timed]:
    """Yield one line after the other."""
    for what, arguments in COMMANDS.items():
        if only in what:
            before, now = _least([(old, arguments), (ROOT, arguments)], repeats)
            yield Timed(what, before, now, now)
    for name in (*SCENARIOS, *OTHERS, *SWEEPS):
        path = old / "scenarios" / f"{name}.toml"
        if only not in name or not path.exists():
            continue
        files = {engine: _with_engine(path, engine) for engine in ("newton", "auto")}
        verb = "sweep" if name in SWEEPS else "run"
        runs = []
        for root, file in ((old, path), (ROOT, files["newton"]), (ROOT, files["auto"])):
            out = ["--out", "out"] if verb == "sweep" else ["--json"]
            runs.append((root, ["-m", "softnlp", verb, str(file), *out]))
        yield Timed(f"{name}, command", *_least(runs, repeats))
        if name in SCENARIOS:  # what version 0.1 runs from Python
            solves = [(root, ["-c", _SOLVE, arguments[3], "4"]) for root, arguments in runs]
            turns = [[json.loads(_process(root, arguments)[1]) for root, arguments in solves] for _ in range(repeats)]
            for k, kind in enumerate(("cold", "warm")):
                yield Timed(f"{name}, {kind}", *(min(turn[j][k] for turn in turns) for j in range(3)))


def _least(runs: list[tuple[Path, list[str]]], repeats: int) -> list[float]:
    """Return the least processor time of each process, in turns."""
    turns = [[_process(root, arguments)[0] for root, arguments in runs] for _ in range(repeats)]
    return [min(column) for column in zip(*turns, strict=True)]


def _process(root: Path, arguments: list[str]) -> tuple[float, str]:
    """Run Python with one version of the package; return its processor time and what it prints."""
    environment: Mapping[str, str] = {**os.environ, "PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as work:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [sys.executable, *arguments], cwd=work, env=environment, capture_output=True, text=True, check=False
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{' '.join(arguments[:3])} with {root.name}: {done.stderr.strip().splitlines()[-1]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def _with_engine(path: Path, engine: str) -> Path:
    """Return a copy beside a scenario that names an engine."""
    text = path.read_text(encoding="utf-8")
    head = "[solver]\n"
    line = f'engine = "{engine}"\n'
    chosen = text.replace(head, head + line) if "solver" in tomllib.loads(text) else f"{text}\n{head}{line}"
    copy = path.with_name(f"{path.stem}_{engine}.toml")
    copy.write_text(chosen, encoding="utf-8")
    return copy


def table(lines: list[Timed]) -> str:
    """Return the lines as a page of Markdown."""
    rows = [
        f"| {t.what} | {t.before:.3f} | {t.newton:.3f} | {t.newton / t.before:.2f} | {t.auto:.3f} | "
        f"{t.auto / t.before:.2f} |"
        for t in lines
    ]
    head = "| what | 0.1 [s] | newton [s] | to 0.1 | auto [s] | to 0.1 |\n|---|--:|--:|--:|--:|--:|\n"
    said = ", ".join(f"{name} {value}" for name, value in machine.described().items())
    return f"# Beside version 0.1\n\n{said}.\n\n{head}" + "\n".join(rows) + "\n"


if __name__ == "__main__":
    sys.exit(main())
