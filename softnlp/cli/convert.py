"""`softnlp convert`: a scenario of one study made into one of another."""

from __future__ import annotations

from pathlib import Path

from softnlp.cli.console import say
from softnlp.cli.new import require_study, write_begun
from softnlp.cli.study import AllErrors, require_file, scenario_at


def convert(
    scenario: Path, /, *, study: str, out: Path | None = None, force: bool = False, all_errors: AllErrors = False
) -> None:
    """Write a scenario as one of another study, and say what was dropped and what is missing.

    What the other study uses too stays, with its comments. What it needs beside is filled by an example with every key
    explained, so that the result runs; put your own in its place.

    Parameters
    ----------
    scenario
        TOML file of any study; it stays as it is.
    study
        forward, blocked-force, workspace, inverse, identify, design or dynamic.
    out
        The new scenario; by default NAME_STUDY.toml beside the old one.
    force
        Replace files that are there.
    """
    from softnlp.scenario.convert import converted
    from softnlp.scenario.template import MEASURED

    require_study(study, "--study")
    scenario_at(scenario, all_errors)
    target = out or scenario.with_name(f"{scenario.stem}_{study}.toml")
    require_file(target)
    data = f"{target.stem}_{MEASURED}"
    found = converted(scenario, study, target, data)
    write_begun(target, found.text, data, study, force)
    for what in found.dropped:
        say(f"dropped: {what}, which study {study!r} does not use")
    for what in found.missing:
        say(f"missing: {what}, filled by an example; put your own in its place")
