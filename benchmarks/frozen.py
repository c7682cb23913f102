"""The numbers of every shipped scenario, written once and compared later: they stay where only the code is moved.

    python -m benchmarks.frozen numbers.json.gz --write    # of the code that is right
    python -m benchmarks.frozen numbers.json.gz            # of today's; exit status 1 where something differs

A key that is not in the file yet is no difference. Numbers agree to 1e-9 of themselves or of the largest one of their
key in the document. Left out: times, iterations, grids, residuals and estimates of errors, what solved it, and the
digits of messages. Of a fit the sum of squares counts, and the constants to a thousandth of their standard errors; of a
design the best candidate and its objective to 1e-6.
"""

from __future__ import annotations

import argparse
import gzip
import io
import json
import math
import re
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from softnlp import load_scenario, run_sweep
from softnlp.cli import main as command

SCENARIOS = Path(__file__).parents[1] / "scenarios"
MEASURED = {"compare/angles": "measured_angles", "compare/forces": "measured_forces"}
POSES = 200  # of a sweep, that are kept
CLOSE = 1e-9
LEFT_OUT = {
    *("solve_time_s", "seconds", "iterations", "evaluations", "intervals", "residual", "certificate"),
    *("discretisation_error", "engine", "ipopt_status", "ipopt_iterations", "ipopt_multipliers", "softnlp", "versions"),
    *("residual_by_equation", "time_s", "optimality", "kkt", "left_by_weights", "material_set"),
}


def numbers(path: Path) -> Any:
    """Return the document of a scenario, as the command prints it; of a sweep some of its poses."""
    name = path.relative_to(SCENARIOS).with_suffix("").as_posix()
    if tomllib.loads(path.read_text())["study"] == "workspace":
        return _poses(path)
    measured = MEASURED.get(name)
    words = ["compare", str(path), str(SCENARIOS / "files" / f"{measured}.csv")] if measured else ["run", str(path)]
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = command([*words, "--json"])
    return {"exit status": status, "document": json.loads(out.getvalue()) if out.getvalue() else err.getvalue()}


def _poses(path: Path) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        result = run_sweep(load_scenario(path), folder).written[0]
        with h5py.File(result) as data:
            every = {name: np.asarray(variable) for name, variable in data.items()}
    step = max(1, len(every["status"]) // POSES)
    return {name: values[::step].tolist() for name, values in every.items() if values.dtype.kind in "fiu"}


def leaves(value: Any, key: str = "", path: str = "") -> Iterator[tuple[str, str, Any]]:
    """Yield the place, the key and the value of everything that counts in a document."""
    if isinstance(value, dict):
        for name, item in value.items():
            if name not in LEFT_OUT:
                yield from leaves(item, name, f"{path}.{name}")
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from leaves(item, key, f"{path}[{k}]")
    else:
        yield path, key, _words(value) if isinstance(value, str) else value


def _words(text: str) -> str:
    """Return a message without its numbers and without the folder of the checkout."""
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", re.sub(r"/\S*/scenarios/", "scenarios/", text))


def differences(old: Any, new: Any, close: float) -> list[str]:
    """Return what differs between two documents of one scenario, a line each. close : of numbers that agree."""
    study = old.get("document", {}).get("study") if isinstance(old.get("document"), dict) else None
    if study == "design":
        return _of_designs(old["document"], new["document"])
    before, after = ({path: (key, v) for path, key, v in leaves(d)} for d in (old, new))
    errors = _standard_errors(old["document"]) if study == "identify" else {}
    largest: dict[str, float] = {}
    for key, v in before.values():
        if isinstance(v, float) and math.isfinite(v):
            largest[_scale(key)] = max(largest.get(_scale(key), 0.0), abs(v))
    known = {_without_places(path) for path in before}  # a key that is new is no difference
    added = {path for path in set(after) - set(before) if _without_places(path) in known}
    found = [f"{path}: only in one" for path in sorted(set(before) - set(after) | added)]
    for path, (key, a) in before.items():
        b = after.get(path, (key, a))[1]
        if isinstance(a, int | float) and isinstance(b, int | float) and not isinstance(a, bool):
            least = 1.0 if key.endswith("_deg") else 0.0  # a degree, where nothing bends
            allowed = max(close * max(abs(a), largest.get(_scale(key), 0.0), least), errors.get(path, 0.0))
            if not (abs(a - b) <= allowed or (math.isnan(a) and math.isnan(b))):
                found.append(f"{path}: {a!r} -> {b!r}")
        elif a != b:
            found.append(f"{path}: {a!r} -> {b!r}")
    return found


def _without_places(path: str) -> str:
    """Return a place without the numbers of entries of lists."""
    return re.sub(r"\[\d+\]", "", path)


def _scale(key: str) -> str:
    """Return whose size a number is held against: a displacement against the robot, whose digits it is made of."""
    made_of = {"tip_displacement_mm": "tip_position_mm", "distance_mm": "tip_position_mm"}
    return {**made_of, "direction_error_deg": "bending_angle_deg"}.get(key, key)


def _standard_errors(document: Any) -> dict[str, float]:
    """Return what each constant of a fit, and all that follows from it, may move by."""
    return {
        path: 1e-3 * abs(v) if key.startswith(("standard_error", "std")) else 1e-6 * abs(v)
        for path, key, v in leaves({"document": document})
        if isinstance(v, float)
    }


def _of_designs(old: Any, new: Any) -> list[str]:
    a, b = (d["best"] for d in (old, new))
    found = [] if a.get("choices", {}).keys() == b.get("choices", {}).keys() else ["best: other choices"]
    for (path, _, v), (_, _, w) in zip(leaves(a), leaves(b), strict=False):
        if isinstance(v, str) and v != w:
            found.append(f"best{path}: {v!r} -> {w!r}")
        if isinstance(v, float) and "objective" in path and abs(v - w) > 1e-6 * abs(v):
            found.append(f"best{path}: {v!r} -> {w!r}")
    return found


def main() -> int:
    """Write or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, help="of the numbers, .json.gz")
    parser.add_argument("--write", action="store_true", help="write it, or what --only chooses of it, and compare not")
    parser.add_argument("--close", type=float, default=CLOSE, help="of numbers that agree, where the grid decides")
    parser.add_argument("--only", default="", help="scenarios whose path contains this")
    asked = parser.parse_args()
    kept = json.loads(gzip.decompress(asked.file.read_bytes())) if asked.file.exists() else {}
    found, bad = {}, 0
    for path in sorted(SCENARIOS.rglob("*.toml")):
        name = path.relative_to(SCENARIOS).with_suffix("").as_posix()
        if "study" not in tomllib.loads(path.read_text()) or asked.only not in name:
            continue
        began = time.process_time()
        found[name] = json.loads(json.dumps(numbers(path)))
        lines = differences(kept[name], found[name], asked.close) if name in kept and not asked.write else []
        bad += bool(lines)
        print(f"{name}: {time.process_time() - began:.1f} s, {len(lines)} differences", flush=True)
        for line in lines[:5]:
            print(f"    {line}")
        if asked.write:
            kept[name] = found[name]
            asked.file.write_bytes(gzip.compress(json.dumps(kept).encode(), mtime=0))
    print(f"{len(found)} scenarios, {bad} of them differ")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
