"""What was published and measured, read from the data files in `scenarios/files`."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
FILES = ROOT / "scenarios" / "files"


@cache
def published() -> Mapping[str, Any]:
    """Return the tables of `published.toml`, in the units of its keys."""
    return tomllib.loads((FILES / "published.toml").read_text(encoding="utf-8"))


def citation() -> str:
    """Return the source as one line of Markdown."""
    source = published()["source"]
    return f"{source['authors']}, *{source['title']}*, {source['journal']}, [doi {source['doi']}](https://doi.org/{source['doi']})"


def measured_angles() -> dict[tuple[str, int], float]:
    """Return the measured bending angle [deg] by robot and number of pressurised sets."""
    return {(row["robot"], _sets(row)): float(row["bending_angle_deg"]) for row in _rows("measured_angles.csv")}


def measured_forces() -> dict[str, float]:
    """Return the measured blocked force [N] with one set at `measured_pressure` by robot."""
    return {row["robot"]: float(row["blocked_force_N"]) for row in _rows("measured_forces.csv")}


def measured_pressure() -> float:
    """Return the pressure of every measurement [bar]."""
    (pressure,) = {float(row["p1_bar"]) for name in ("angles", "forces") for row in _rows(f"measured_{name}.csv")}
    return pressure


def elongation_range(robot: str) -> tuple[float, float]:
    """Return the measured range of the elongation [mm] with three sets, over the robots as long as this one."""
    low, high = published()["measured_elongation_mm"][robot[-3:]]
    return low, high


def mean_error(simulated: Mapping[Any, float], measured: Mapping[Any, float]) -> float:
    """Return the mean absolute difference over what was measured."""
    return float(np.mean([abs(simulated[key] - value) for key, value in measured.items()]))


@cache
def _rows(name: str) -> list[dict[str, str]]:
    with (FILES / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _sets(row: Mapping[str, str]) -> int:
    """Return how many sets have pressure in a row."""
    return sum(float(cell) > 0 for key, cell in row.items() if key.startswith("p"))
