"""`softnlp modes`: natural frequencies, shapes and damping about the last pose of a scenario, and its linear system."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, complain, say, say_rows
from softnlp.cli.study import AllErrors, Json, require_writable, scenario_at

_STUDIES = ("forward", "dynamic")
OutModes = Annotated[
    Path | None, Parameter(help="Folder for modes.nc, linear.mat and linear.npz; by default none is written.")
]


def modes(
    scenario: Path, /, *, count: int = 12, out: OutModes = None, json: Json = False, all_errors: AllErrors = False
) -> int:
    """Find how a robot swings about the pose at rest of a scenario's last pressures and loads.

    Prints natural frequency, damping ratio and kind of the lowest modes. With --out the shapes and the matrices A, B,
    C, D of the linear system from pressures and tip force to the tip are written for a control designer. Damping, lag
    and tip mass are those of [dynamic]. The exit status is 0 when there is a pose, 3 when there is none, 2 for bad
    input.

    Parameters
    ----------
    scenario
        TOML file of study "forward" or "dynamic".
    count
        How many modes are told of.
    """
    from softnlp.results.document import document_text
    from softnlp.results.modes import files, modes_document, modes_rows
    from softnlp.scenario.data import require_no_obstacles
    from softnlp.scenario.dynamic import modes_of

    asked = scenario_at(scenario, all_errors)
    if asked.study not in _STUDIES:
        raise InputError(
            f"expected study 'forward' or 'dynamic', got {asked.study!r}", source=str(scenario), key="study"
        )
    require_no_obstacles(asked, "softnlp modes")
    if count < 1:
        raise InputError(f"expected a number of at least 1, got {count}", key="--count")
    if out is not None:
        require_writable(out)
    found = modes_of(asked)
    document = modes_document(found, asked.title, asked.conventions.name, count)
    if out is not None and found.found is not None:
        from softnlp.results.folder import write_files

        texts: dict[str, str | bytes] = {"modes.json": document_text(document), **files(found, asked.title, count)}
        write_files(out, texts, asked.text)
    if json:
        say(document_text(document).rstrip("\n"))
    elif found.found is not None:
        say_rows(*modes_rows(found.found, count))
    for warning in (*asked.warnings, *found.warnings):
        complain(f"warning: {warning}")
    if found.found is None:
        complain(f"{found.status.value}: {found.message}")
        return SOME_UNSOLVED
    if out is not None and not json:
        say(f"results in {out}")
    return SOLVED
