"""`softnlp sensitivity`: what a step of a forward scenario is sensitive to, as tables and a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, complain, progress, say, say_rows
from softnlp.cli.figures import draw
from softnlp.cli.study import AllErrors, Json, Out, results_folder, scenario_for
from softnlp.model.gravity import gravity_lines


def sensitivity(
    scenario: Path,
    /,
    *,
    step: int | None = None,
    tolerance: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = (),
    samples: int = 200,
    out: Out = None,
    json: Json = False,
    all_errors: AllErrors = False,
) -> int:
    """Differentiate the tip and shape of one step of a forward scenario, and draw what follows from it.

    Prints the tip's Jacobian by pressure, its compliance, manipulability and stiffness, and with tolerances the error
    bars they leave, checked by sampling; writes sensitivity.json and sensitivity.png. The exit status is 0 when the
    step solved, 3 when it did not, 2 for bad input.

    Parameters
    ----------
    scenario
        TOML file of study "forward".
    step
        Of its pressures, from 1; the last by default.
    tolerance
        Standard deviations, NAME=VALUE, in the unit of the name, or VALUE% of what the scenario has: a dimension or a
        constant by its key in a scenario (length_mm=0.2, C10_MPa=3%), density_kg_m3, elongation, bending, area,
        inertia, bore_fraction, pressure_bar (each set), tip force (force_N) and moment (moment_Nmm, each component).
    samples
        Draws of the check; 0 leaves it out.
    """
    from softnlp.model.outlined import require_round_layout
    from softnlp.model.segments import require_one_segment
    from softnlp.results.document import document_text
    from softnlp.results.sensitivity import sensitivity_document, table_rows
    from softnlp.scenario.data import require_no_obstacles
    from softnlp.studies.report import named_tolerances, sensitivity_report

    asked = scenario_for(scenario, "forward", "expected study 'forward', got {}", all_errors)
    count = len(asked.pressures)
    chosen = count if step is None else step
    if not 1 <= chosen <= count:
        raise InputError(f"expected a step from 1 to {count}, got {chosen}", key="--step")
    if samples < 0 or samples == 1:
        raise InputError(f"expected 0, or at least 2 samples, got {samples}", key="--samples")
    require_one_segment(asked.robot, "softnlp sensitivity")
    require_round_layout(asked.robot, "softnlp sensitivity")
    require_no_obstacles(asked, "softnlp sensitivity")
    folder = results_folder(out, json, scenario.stem)
    pressure = asked.pressures[chosen - 1]
    model = (asked.robot, asked.material, asked.coefficients)
    tolerances = named_tolerances(tolerance, *model, pressure, asked.conventions)
    with progress(max(samples, 1) if tolerances else 1, asked.title) as (advance, _):
        report = sensitivity_report(
            asked.robot,
            asked.material,
            pressure,
            tolerances,
            samples=samples,
            progress=advance,
            **asked.settings,
        )
    document = sensitivity_document(report, asked.title, chosen, asked.warnings)
    if folder is not None:
        from softnlp.base.files import make_folder, write_whole
        from softnlp.figures.sensitivity import sensitivity_figure

        kept = make_folder(folder)
        write_whole(kept / "sensitivity.json", document_text(document).encode())
        draw({kept / "sensitivity.png": lambda: sensitivity_figure(report, f"{asked.title}, step {chosen}")}, folder)
    if json:
        say(document_text(document).rstrip("\n"))
    elif report.solved:
        for line in gravity_lines(report.loads.gravity):
            say(line)
        for heading, header, rows in table_rows(report):
            say(f"\n{heading}")
            say_rows(header, rows)
    for warning in document["warnings"]:
        complain(f"warning: {warning}")
    if not report.solved:
        complain(f"step {chosen}: {report.sensitivities.step.status.value}: {report.sensitivities.step.message}")
        return SOME_UNSOLVED
    if folder is not None and not json:
        say(f"\nresults in {folder}")
    return SOLVED
