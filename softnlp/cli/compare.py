"""`softnlp compare`: a scenario's robot simulated at measured pressures, and how far it is from what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, complain, progress, say, say_rows
from softnlp.cli.motion import compare_motion
from softnlp.cli.report import Report, write_report
from softnlp.cli.study import (
    AllErrors,
    Json,
    Legend,
    require_file,
    results_folder,
    say_legend,
    scenario_at,
    show,
    write_results,
)
from softnlp.model.gravity import gravity_lines

if TYPE_CHECKING:
    from softnlp.scenario.compare import CompareTask
    from softnlp.studies.comparison import Comparison


def compare(
    scenario: Path,
    measured: Path,
    /,
    *,
    law: tuple[str, ...] = (),
    coefficients: tuple[str, ...] = (),
    conventions: tuple[str, ...] = (),
    closure: tuple[str, ...] = (),
    shape: str = "free",
    out: Path | None = None,
    json: Json = False,
    report: Report = None,
    all_errors: AllErrors = False,
    legend: Legend = False,
) -> int:
    """Compare a model with measured tips, bending angles, elongations, tilts or blocked forces.

    Prints RMSE, MAPE, mean, median and maximum of the errors, and writes them with every row, figures, versions.json
    and copies of both files. The exit status is 0, 3 when rows have no solution, 2 for bad input, 130 when stopped.

    Parameters
    ----------
    scenario
        TOML file of study forward, blocked-force or workspace: silicone, loads, wall, and the robot of rows that name
        none. The pressures are those of the measurements; its own are not solved. Or of study dynamic, whose motion
        under its own pressures is compared with a tip over time.
    measured
        CSV file with columns p1_bar, p2_bar, ... and what was measured: x_mm, y_mm, z_mm, bending_angle_deg,
        elongation_mm, tilt_deg, blocked_force_N; docs/compare.md has the others. Of a motion: t_s, x_mm, y_mm, z_mm.
    law
        A stress-stretch law of the scenario's silicone, or all; may be repeated.
    coefficients
        reproduction, calibrated, none (no stiffening) or scenario; may be repeated.
    conventions
        reproduction or as_printed; may be repeated.
    closure
        Of blocked forces: free, compliant, weighted or rigid; may be repeated.
    shape
        Whether tips, angles and elongations are those of the free robot, or those of the blocked one.
    out
        Folder for the results; by default results/NAME_compare, where NAME is that of the scenario file.
    """
    from softnlp.results.comparison import comparison_document, require_free_names
    from softnlp.results.document import document_text
    from softnlp.scenario.compare import Asked, compare_task

    asked = scenario_at(scenario, all_errors)
    if legend:
        return say_legend("compare")
    if asked.study == "dynamic":
        chosen = {"--law": law, "--coefficients": coefficients, "--conventions": conventions, "--closure": closure}
        for key in (key for key, value in chosen.items() if value):
            raise InputError("not used with study 'dynamic': a trace is compared with the scenario as it is", key=key)
        return compare_motion(asked, measured, out, json, report)
    task = compare_task(asked, measured, Asked(law, coefficients, conventions, closure, shape))
    folder = results_folder(out, json, f"{scenario.stem}_compare")
    if folder is not None:
        require_free_names(task)
    if report is not None:
        require_file(report)
    found = _compared(task)
    document = document_text(comparison_document(task, found), compact=False)
    write, table = (lambda to: _write(to, task, found, document)), (lambda: _say(task, found))
    show(folder, json, write, lambda: document, table, gap="\n")
    if report is not None:
        from softnlp.figures.compare import figure_makers

        write_report(report, asked, document, figure_makers(task, found), quiet=json)
    lost = sum(found.lost(v) for v in range(len(found.variants)))
    return SOME_UNSOLVED if lost else SOLVED


def _compared(task: CompareTask) -> Comparison:
    """Compare with a progress bar."""
    from softnlp.scenario.compare import run_compare

    rows, variants = len(task.columns.rows), len(task.variants)
    with progress(rows * variants, task.scenario.title) as (advance, stop_asked):

        def told(done: int, total: int) -> None:
            advance(round(done / total * rows * variants))
            if stop_asked():
                raise KeyboardInterrupt

        return run_compare(task, told)


def _say(task: CompareTask, found: Comparison) -> None:
    """Print the statistics of each variant, and the mean error by robot where there are several."""
    from softnlp.scenario.compare import comparison_checks
    from softnlp.studies.check import messages
    from softnlp.studies.comparison import OBSERVABLES

    robots = ", ".join(o.label for o in found.observed)
    say(f"{task.scenario.title}: {robots}; {task.scenario.material.name}; {len(task.columns.rows)} rows measured")
    for line in gravity_lines(task.scenario.loads.gravity):
        say(line)
    for name in found.observables:
        what = OBSERVABLES[name]
        say(f"\n{what.axis}: {found.measured(name)} measured")
        header = ["variant", "count", "rmse", "mape_%", "mean", "median", "max", "bias"]
        say_rows(header, [_cells(found, v, name) for v in range(len(found.variants))])
        if len(found.observed) > 1:
            say(f"mean error by robot [{what.unit}]")
            told = [k for k in range(len(found.observed)) if found.measured(name, k)]
            rows = [
                [label, *(_text(found.statistics(v, name, k).mean / what.scale) for k in told)]
                for v, label in enumerate(found.labels)
            ]
            say_rows(["variant", *(found.observed[k].label for k in told)], rows)
    if found.best is not None and len(found.variants) > 1:
        say(f"\nleast error: {found.labels[found.best]}")
    for note in task.notes:
        say(f"note: {note}")
    for warning in (*task.warnings, *messages(comparison_checks(task, found), "warned")):
        say(f"warning: {warning}")
    _complain_of_lost(found)


def _cells(found: Comparison, v: int, name: str) -> list[str]:
    from softnlp.studies.comparison import OBSERVABLES

    s, scale = found.statistics(v, name), OBSERVABLES[name].scale
    numbers = [_text(x / scale) for x in (s.mean, s.median, s.largest, s.bias)]
    return [found.labels[v], str(s.count), _text(s.rmse / scale), _text(s.mape, 3), *numbers]


def _text(value: float, digits: int = 4) -> str:
    return "-" if value != value else f"{value:.{digits}g}"


def _complain_of_lost(found: Comparison) -> None:
    """Say for each variant how many rows have no solution, by status, or a shape that no body can take."""
    for v, label in enumerate(found.labels):
        lost = [s.value for solved in found.simulated[v] for s in solved.status if s is not None and not s.has_solution]
        if lost:
            counts = ", ".join(f"{lost.count(status)} {status}" for status in dict.fromkeys(lost))
            complain(f"{label}: {len(lost)} of {found.rows} rows have no solution and no errors ({counts})")
        if through := found.self_intersecting(v):
            complain(f"{label}: the simulated body passes through itself in {through} of {found.rows} rows")


def _write(folder: Path, task: CompareTask, found: Comparison, document: str) -> None:
    """Write the numbers and then the figures."""
    from softnlp.figures.compare import figure_makers
    from softnlp.results.comparison import rows_text, summary_text

    texts = {
        "comparison.json": document,
        "rows.csv": rows_text(task, found),
        "summary.csv": summary_text(found),
        "measured.csv": task.text,
    }
    write_results(folder, task.scenario, texts, figure_makers(task, found))
