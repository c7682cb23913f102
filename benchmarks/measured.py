"""What was measured of the paper's robots, read from `scenarios/files/published.toml`, which has the source."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

FILE = Path(__file__).parents[1] / "scenarios" / "files" / "published.toml"


@cache
def published() -> Mapping[str, Any]:
    """Return every table of the file, in the units of its keys."""
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def _pairs(table: str) -> dict[str, tuple[float, float]]:
    return {name: (low, high) for name, (low, high) in published()[table].items()}


SILICONE: str = published()["measured"]["material"]
PRESSURE: float = published()["measured"]["pressure_bar"]
"""Of every measurement but those of the laparoscope [bar]."""
ANGLES: Mapping[str, tuple[float, float]] = _pairs("measured_bending_angle_deg")
"""With one set and with two sets [deg]."""
ELONGATIONS: Mapping[str, tuple[float, float]] = _pairs("measured_elongation_mm")
"""With three sets: least and largest of the robots of one length ("L60", "L40") [mm]."""
FORCES: Mapping[str, float] = dict(published()["measured_blocked_force_N"])
"""Blocked with one set [N]; linear in pressure from `CURVE[0]` on."""
CURVE = (0.3, 0.6, 0.9, 1.2, 1.5)
"""Pressures at which forces were measured [bar]."""
