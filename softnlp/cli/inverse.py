"""`softnlp inverse`: the pressures for the targets of a scenario."""

from __future__ import annotations

from pathlib import Path

from softnlp.base.errors import InputError


def inverse(scenario: Path, /, *, out: Path | None = None, json: bool = False) -> int:
    """Find the pressures that bring the tip to the targets of a scenario file of study "inverse", in order.

    What `softnlp run` does with it, refusing other studies. A target that no pressure within the bounds reaches has
    status out_of_reach: its pressures are those of the nearest point, whose distance is given. The exit status is 0
    when every target is met, 3 when some are not, 2 for bad input, 130 when stopped by Ctrl-C.

    Parameters
    ----------
    scenario
        TOML file; docs/inverse.md lists what it may hold.
    out
        Folder for the results; by default results/NAME, where NAME is that of the scenario file.
    json
        Print one JSON document and nothing else; no files are written unless --out is given.
    """
    from softnlp.cli.run import run
    from softnlp.scenario.read import load_scenario

    asked = load_scenario(scenario)
    if asked.study != "inverse":
        raise InputError(f"expected study 'inverse', got {asked.study!r}", source=str(scenario), key="study")
    return run(scenario, out=out, json=json)
