"""Which package calls which from a scenario file to the answer, and how often; base and model serve all of them."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from types import FrameType

import softnlp
from docs.figures._shared import SCENARIOS
from softnlp import load_scenario, run_scenario

PACKAGE = Path(softnlp.__file__).parent
DOWN = ("scenario", "studies", "statics", "nlp")


def entered(path: Path) -> Counter[tuple[str, str, str]]:
    """Return how often a package calls a function of another one while a scenario runs a second time."""
    found: Counter[tuple[str, str, str]] = Counter()

    def package(frame: FrameType | None) -> str:
        name = Path(frame.f_code.co_filename) if frame is not None else Path()
        return name.relative_to(PACKAGE).parts[0] if name.is_relative_to(PACKAGE) else ""

    def noted(frame: FrameType, event: str, _: object) -> None:
        if event != "call" or not (own := package(frame)):
            return
        caller = frame.f_back
        while caller is not None and not package(caller):
            caller = caller.f_back
        if (before := package(caller)) != own:
            found[before, own, frame.f_code.co_qualname] += 1

    run_scenario(load_scenario(path))
    sys.setprofile(noted)
    try:
        run_scenario(load_scenario(path))
    finally:
        sys.setprofile(None)
    return found


def text() -> str:
    """Return the trace of a loaded pose, five steps."""
    found = entered(SCENARIOS / "D25L60_loaded_tip.toml")
    lines = ["a script"]
    for depth, (before, own) in enumerate(zip(("", *DOWN), DOWN, strict=False), start=1):
        called = sorted((name, count) for (a, b, name), count in found.items() if (a, b) == (before, own))
        lines += [f"{'  ' * depth}{own}: {', '.join(f'{name} x{count}' for name, count in called)}"]
    return "\n".join(["```text", *lines, "```"])
