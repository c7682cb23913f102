"""Scenarios of several segments, as text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from softnlp import load_scenario, run_scenario, to_json

BAR_STEP = "[pressure]\nsequence_bar = [{rows}]\n"


def segment(robot: str = 'name = "D25L60"\nlength_mm = 30.0', material: str = "Ecoflex 00-50", own: str = "") -> str:
    """Return one [[segment]]."""
    silicone = f'name = "{material}"\nmodel = "mooney-rivlin"'
    return f"[[segment]]\n{own}\n[segment.robot]\n{robot}\n[segment.material]\n{silicone}\n"


def scenario(segments: list[str], rows: str, more: str = "", study: str = "forward") -> str:
    """Return a scenario of segments. rows : of pressures, as in sequence_bar."""
    pressure = f"[pressure]\nsequence_bar = [{rows}]\n" if rows else ""
    return f'study = "{study}"\n' + "".join(segments) + pressure + more


def solved(folder: Path, text: str) -> list[dict[str, Any]]:
    """Return the steps of the JSON document of a scenario."""
    file = folder / "scenario.toml"
    file.write_text(text)
    steps: list[dict[str, Any]] = to_json(run_scenario(load_scenario(file)))["steps"]
    return steps
