"""`softnlp mould`: the moulds of a robot, with a bill and a page of steps."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, complain, say
from softnlp.cli.study import AllErrors, require_writable, scenario_at, stepwise, stopped_after

if TYPE_CHECKING:
    from softnlp.scenario.read import Scenario


def mould(scenario: Path, /, *, out: Path | None = None, design: bool = False, all_errors: AllErrors = False) -> int:
    """Write the moulds of a robot: STL and 3MF of every part, an exploded GLB, a bill and a page of steps.

    What holds of the moulds is measured before anything is written. Nothing is solved. The exit status is 2 where the
    robot cannot be moulded.

    Parameters
    ----------
    scenario
        TOML file, with [mould] where the defaults do not suit; or the folder of a run, or of a finished design study,
        whose best candidate is made.
    out
        Folder; mould/NAME by default.
    design
        Of a scenario of study "design": find the best candidate first, and make it.
    """
    from softnlp.figures.mesh import require
    from softnlp.scenario.read import placed

    name = scenario.resolve().name if scenario.is_dir() else scenario.stem
    folder = out or Path("mould") / name
    require_writable(folder)
    require(96)
    asked = _asked(scenario, all_errors)
    if design:
        best = _best(asked)
        if not isinstance(best, str):
            return best
        from softnlp.scenario.read import scenario_from_text

        asked = scenario_from_text(best, asked.path)
    try:
        _write(asked, name, folder)
    except InputError as error:
        raise error if error.source else placed(error, str(asked.path)) from None
    return SOLVED


def _asked(path: Path, all_errors: bool) -> Scenario:
    """Return the scenario of a file, of a run's folder, or of the best candidate in a design's."""
    if not path.is_dir():
        return scenario_at(path, all_errors)
    best, run = path / "best.toml", path / "scenario.toml"
    if (path / "design.json").exists() and not best.exists():
        raise InputError("this design study has no feasible candidate to make", source=str(path))
    found = best if best.exists() else run
    if not found.exists():
        raise InputError("expected the folder of a run or of a design study", source=str(path))
    return scenario_at(found, all_errors)


def _best(asked: Scenario) -> str | int:
    """Return the best candidate of a design study as a scenario, or the exit status where there is none."""
    from softnlp.cli.design import best_text
    from softnlp.scenario.design import finished_design, run_design

    if asked.study != "design":
        raise InputError(f"--design takes 'design', got {asked.study!r}", source=str(asked.path), key="study")
    total = asked.step_count
    workers = os.cpu_count() or 1 if total >= 24 else 1
    candidates, whole = stepwise(asked, total, lambda keep: run_design(asked, keep, workers))
    if whole is None:
        return stopped_after(len(candidates), total, "candidates", None)
    text = best_text(finished_design(asked, candidates), asked)
    if text is None:
        complain("no feasible candidate to make; nothing was written")
        return SOME_UNSOLVED
    return text


def _write(asked: Scenario, name: str, folder: Path) -> None:
    """Make every file, then write them, and say what is in them."""
    from softnlp.base.files import make_folder, write_whole
    from softnlp.mould import mould_files, moulds

    for warning in asked.warnings:
        complain(f"warning: {warning}")
    made = moulds(asked.robot, asked.mould)
    files, checks = mould_files(made, name, asked.title, float(asked.material.density), asked.material.name)
    make_folder(folder)
    for file, content in files.items():
        write_whole(folder / file, content)
    for note in made.notes:
        say(f"note: {note}")
    if left := left_over(folder, name, set(files)):
        say(f"note: {folder} has files of earlier moulds too, which do not belong to these: {', '.join(left)}")
    count = sum(part.count for part in made.parts)
    methods = " and ".join(dict.fromkeys(segment.sizes.method for segment in made.segments))
    say(f"{asked.robot.name}: {count} pieces of {len(made.parts)} parts, {methods} cores; {len(checks)} checks hold")
    say(f"moulds in {folder}; begin with {name}-steps.html")


def left_over(folder: Path, name: str, written: set[str]) -> list[str]:
    """Return what an earlier run with other settings left: parts of this name that were not written now."""
    return sorted(
        one.name
        for one in folder.iterdir()
        if one.name.startswith(f"{name}-") and one.suffix in (".stl", ".3mf") and one.name not in written
    )
