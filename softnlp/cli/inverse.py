"""`softnlp inverse`: the pressures for the targets of a scenario."""

from __future__ import annotations

from pathlib import Path

from softnlp.cli.run import run_steps
from softnlp.cli.study import AllErrors, Json, Legend, Out, say_legend, scenario_for


def inverse(
    scenario: Path, /, *, out: Out = None, json: Json = False, all_errors: AllErrors = False, legend: Legend = False
) -> int:
    """Find the pressures that bring the tip to the targets of a scenario file of study "inverse", in order.

    What `softnlp run` does with it, refusing other studies. A target that no pressure within the bounds reaches has
    status out_of_reach: its pressures are those of the nearest point, whose distance is given. The exit status is 0
    when every target is met, 3 when some are not, 2 for bad input, 130 when stopped by Ctrl-C.

    Parameters
    ----------
    scenario
        TOML file; docs/inverse.md lists what it may hold.
    """
    asked = scenario_for(scenario, "inverse", "expected study 'inverse', got {}", all_errors)
    return say_legend(asked.study) if legend else run_steps(asked, out, json)
