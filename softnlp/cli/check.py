"""`softnlp check`: whether a scenario can be run, without solving anything."""

from __future__ import annotations

from pathlib import Path

from softnlp.cli.console import SOLVED, say
from softnlp.cli.study import AllErrors, scenario_at
from softnlp.model.gravity import gravity_lines


def check(scenario: Path, /, *, all_errors: AllErrors = False) -> int:
    """Read a scenario and the files that it names, and say what it asks for; nothing is solved or written.

    The exit status is 0, or 2 where something is wrong, which is one line.

    Parameters
    ----------
    scenario
        TOML file of any study.
    """
    asked = scenario_at(scenario, all_errors)
    model = (
        "" if asked.study == "identify" else f": {asked.robot.name}, {asked.material.name} ({asked.material.law.name})"
    )
    say(f"{asked.title}{model}")
    say(f"study {asked.study}, {asked.step_count} {'step' if asked.step_count == 1 else 'steps'}")
    for line in (*gravity_lines(asked.loads.gravity), *(f"warning: {words}" for words in asked.warnings)):
        say(line)
    say(f"{scenario} can be run")
    return SOLVED
