"""What was published and measured, in the forms that the pages of this folder use."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measured import ANGLES, ELONGATIONS, FORCES, PRESSURE
from benchmarks.measured import published as published

ROOT = Path(__file__).parents[2]


def citation() -> str:
    """Return the source as one line of Markdown."""
    source = published()["source"]
    return f"{source['authors']}, *{source['title']}*, {source['journal']}, [doi {source['doi']}](https://doi.org/{source['doi']})"


def measured_angles() -> dict[tuple[str, int], float]:
    """Return the measured bending angle [deg] by robot and number of pressurised sets."""
    return {(name, sets): angle for name, pair in ANGLES.items() for sets, angle in enumerate(pair, start=1)}


def measured_forces() -> dict[str, float]:
    """Return the measured blocked force [N] with one set at `measured_pressure` by robot."""
    return dict(FORCES)


def measured_pressure() -> float:
    """Return the pressure of every measurement [bar]."""
    return PRESSURE


def elongation_range(robot: str) -> tuple[float, float]:
    """Return the measured range of the elongation [mm] with three sets, over the robots as long as this one."""
    return ELONGATIONS[robot[-3:]]


def mean_error(simulated: Mapping[Any, float], measured: Mapping[Any, float]) -> float:
    """Return the mean absolute difference over what was measured."""
    return float(np.mean([abs(simulated[key] - value) for key, value in measured.items()]))
