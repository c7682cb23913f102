"""Tips over time on the command line: what `softnlp identify` and `softnlp compare` do with a motion."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.units import MILLIMETRE
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, STOPPED, complain, say, say_rows
from softnlp.cli.report import library_section, write_report
from softnlp.cli.study import Stopped, require_file, results_folder, searched, show, write_results
from softnlp.model.gravity import gravity_lines

if TYPE_CHECKING:
    from softnlp.scenario.read import Scenario
    from softnlp.studies.identify_motion import MotionFit
    from softnlp.studies.trace import TraceErrors


def identify_from_motion(asked: Scenario, folder: Path | None, json: bool, report: Path | None) -> int:
    """Find what a scenario asks of a trace, print it and write the results; return the exit status."""
    from softnlp.base.status import Status
    from softnlp.results import motion_document as results
    from softnlp.results.document import document_text
    from softnlp.scenario.motion import MotionTask, run_motion

    task = asked.task
    assert isinstance(task, MotionTask)
    try:
        found = searched(asked, run_motion)
    except Stopped:
        complain("stopped; an identification that is not finished leaves no constants")
        return STOPPED
    solved = found.status is Status.SOLVED
    document = document_text(results.motion_document(asked, task, found), compact=False)
    tips = {"before": found.before, "after": found.after}

    def figures() -> dict[str, object]:
        from softnlp.figures.trace import trace_figure

        return {"figure": partial(trace_figure, asked.title, found.trace, tips, found.errors_after)} if solved else {}

    def write(to: Path) -> None:
        texts = {"identified.json": document, "table.csv": results.trace_table_text(found.trace, tips)}
        if solved:
            texts["identified.toml"] = results.motion_text(asked, found)
        write_results(to, asked, texts, figures())  # type: ignore[arg-type]

    show(folder, json, write, lambda: document, lambda: _say(asked, found))
    if report is not None:
        drawn = {"Measured and model": figures()["figure"]} if solved else {}
        texts = {"Keys to paste into a scenario": results.motion_text(asked, found)} if solved else {}
        beside = [library_section(asked.material)]
        write_report(report, asked, document, drawn, beside, quiet=json, texts=texts)  # type: ignore[arg-type]
    for problem in found.problems:
        complain(f"{asked.path}: [measurements] {problem}")
    return SOLVED if solved and not found.problems else SOME_UNSOLVED


def _say(asked: Scenario, found: MotionFit) -> None:
    """Print the values and how far the motion is from the trace."""
    from softnlp.studies.check import messages

    say(f"{asked.title}: {asked.robot.name}; {asked.material.name} ({asked.material.law.name})")
    for line in gravity_lines(asked.loads.gravity):
        say(line)
    if found.status != "solved":
        say(f"{found.status}: {found.message}")
        return
    errors = found.uncertainty.standard_errors
    columns = zip(found.names, found.values, errors, found.start, strict=True)
    rows = [[name, *(f"{v:.6g}" for v in numbers), found.notes[name]] for name, *numbers in columns]
    say_rows(["constant", "value", "standard_error", "start", "note"], rows)
    pairs = (("before", found.errors_before), ("after", found.errors_after))
    say_errors({when: errors for when, errors in pairs if errors is not None})
    for warning in (*found.warnings, *messages(found.checks, "warned")):
        say(f"warning: {warning}")


def say_errors(every: dict[str, TraceErrors]) -> None:
    """Print how far motions are from a trace."""
    import numpy as np

    rows = []
    for when, errors in every.items():
        first = errors.harmonic
        tip = [f"{value / MILLIMETRE:.4g}" for value in (errors.rmse, errors.largest, errors.movement)]
        if first is None:
            rows.append([when, *tip, "-", "-", "-", "-"])
            continue
        both = [f"{abs(value) / MILLIMETRE:.4g}" for value in (first.measured, first.simulated)]
        rows.append([when, *tip, f"{first.frequency:.4g}", *both, f"{np.rad2deg(first.phase):.3g}"])
    header = ["", "rmse_mm", "largest_mm", "movement_mm", "first_Hz", "measured_mm", "simulated_mm", "phase_deg"]
    say_rows(header, rows)


def compare_motion(asked: Scenario, measured: Path, out: Path | None, json: bool, report: Path | None) -> int:
    """Compare a motion with a trace, print how far they are apart and write the results; return the exit status."""
    from softnlp.base.reading import read_text
    from softnlp.results import motion_document as results
    from softnlp.results.document import document_text
    from softnlp.scenario.motion import compared_trace

    folder = results_folder(out, json, f"{asked.path.stem}_compare")
    if report is not None:
        require_file(report)
    trace, tips, errors, notes = compared_trace(asked, measured)
    document = document_text(results.trace_document(asked, measured.name, trace, tips, errors, notes), compact=False)

    def figures() -> dict[str, object]:
        from softnlp.figures.trace import trace_figure

        return {"figure": partial(trace_figure, asked.title, trace, {"simulated": tips}, errors)}

    def write(to: Path) -> None:
        rows = results.trace_table_text(trace, {"simulated": tips})
        texts = {"comparison.json": document, "rows.csv": rows, "measured.csv": read_text(measured)}
        write_results(to, asked, texts, figures())  # type: ignore[arg-type]

    def table() -> None:
        say(f"{asked.title}: {asked.robot.name}; {asked.material.name}; {trace.times.size} rows measured")
        say_errors({"simulated": errors})
        for note in notes:
            say(f"note: {note}")

    show(folder, json, write, lambda: document, table)
    if report is not None:
        write_report(report, asked, document, figures(), quiet=json)  # type: ignore[arg-type]
    return SOLVED
