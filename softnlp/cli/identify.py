"""`softnlp identify`: constants from a tensile test or from measurements of robots."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.cli.console import SOLVED, SOME_UNSOLVED, STOPPED, complain, say, say_rows
from softnlp.cli.motion import identify_from_motion
from softnlp.cli.report import Report, library_section, write_report
from softnlp.cli.study import (
    AllErrors,
    Json,
    Legend,
    Out,
    Stopped,
    require_file,
    results_folder,
    say_legend,
    scenario_for,
    searched,
    show,
    write_results,
)
from softnlp.model.gravity import gravity_lines

if TYPE_CHECKING:
    from softnlp.results.report_page import Section
    from softnlp.scenario.read import Scenario
    from softnlp.studies.identified import Identified
    from softnlp.studies.measurements import TensileTask
    from softnlp.studies.tensile import TensileFit


def identify(
    scenario: Path,
    /,
    *,
    out: Out = None,
    json: Json = False,
    report: Report = None,
    all_errors: AllErrors = False,
    legend: Legend = False,
) -> int:
    """Find constants from a tensile test, from measurements of robots or from a motion, as a scenario asks.

    Prints the constants with their standard errors and what is left of the data; writes identified.json, table.csv,
    tables to paste into a scenario (material.toml of a tensile test, else identified.toml), figure.png, versions.json
    and a copy of the scenario. The exit status is 0, 3 when nothing was found or a constant is
    not plausible, 2 for bad input, 130 when stopped.

    Parameters
    ----------
    scenario
        TOML file; docs/identify.md lists what it may hold.
    """
    asked = scenario_for(scenario, "identify", "expected 'identify', got {}; softnlp run runs it", all_errors)
    return say_legend(asked.study) if legend else run_study(asked, out, json, report)


def run_study(asked: Scenario, out: Path | None, json: bool, report: Path | None = None) -> int:
    """Identify what a scenario asks for, print it and write the results; return the exit status."""
    from softnlp.scenario.motion import MotionTask
    from softnlp.studies.measurements import TensileTask

    folder = results_folder(out, json, asked.path.stem)
    tensile = isinstance(asked.task, TensileTask)
    if report is not None:
        require_file(report)
    if isinstance(asked.task, MotionTask):
        return identify_from_motion(asked, folder, json, report)
    return _tensile(asked, folder, json, report) if tensile else _robots(asked, folder, json, report)


def _tensile(asked: Scenario, folder: Path | None, json: bool, report: Path | None) -> int:
    from softnlp.results import identify_document as results
    from softnlp.results.document import document_text
    from softnlp.scenario.tensile import run_tensile
    from softnlp.studies.measurements import TensileTask

    task = asked.task
    assert isinstance(task, TensileTask)
    fit = run_tensile(asked)
    document = document_text(results.tensile_document(asked, task, fit), compact=False)

    def write(to: Path) -> None:
        from softnlp.figures import tensile_figure

        tables = {
            "table.csv": results.tensile_table_text(task, fit),
            "material.toml": results.material_file_text(task, fit),
        }
        figure = partial(tensile_figure, fit, task.name, task.before)
        write_results(to, asked, {"identified.json": document, **tables}, {"figure": figure})

    for problem in fit.problems:  # first: what follows of such a fit means nothing
        complain(f"{asked.path}: [tensile] {problem}")
    show(folder, json, write, lambda: document, lambda: _say_tensile(task, fit))
    if report is not None:
        from softnlp.figures import tensile_figure

        figures = {"Laws and points": partial(tensile_figure, fit, task.name, task.before)}
        best = fit.best.material if fit.best is not None else None
        beside = [] if best is None else [library_section(best)]
        write_report(report, asked, document, figures, beside, quiet=json)
    return SOME_UNSOLVED if fit.problems else SOLVED


def _say_tensile(task: TensileTask, fit: TensileFit) -> None:
    """Print the constants of every law."""
    say(f"{task.name}: {task.about}{task.left_out}")
    if task.before is not None:
        from softnlp.studies.tensile import tensile_misfit

        old = tensile_misfit(task.before, task.stretch, task.stress)
        say(
            f"before, {task.before.name} ({task.before.law.name}): rmse {old.rmse / 1e3:.4g} kPa, mape {old.mape:.3g} %"
        )
    rows = []
    for f in fit.fits.values():
        constants = ", ".join(
            f"{c.file_key} = {f.constants[c.name] / c.scale:.6g} +- {f.standard_errors[c.name] / c.scale:.2g}"
            + (f.notes[c.name] and f" ({f.notes[c.name]})")
            for c in f.law.constants
        )
        numbers = f"{f.r_squared:.6f}", f"{f.misfit.rmse / 1e3:.4g}", f"{f.misfit.mape:.3g}"
        rows.append([f.law.name, f.status, *numbers, constants])
    say_rows(["law", "status", "R^2", "rmse_kPa", "mape_percent", "constants"], rows)
    if fit.best is not None:
        say(f"best: {fit.best.law.name}")
    for note in task.notes:
        say(f"note: {note}")
    for warning in fit.warnings:
        say(f"warning: {warning}")


def _robots(asked: Scenario, folder: Path | None, json: bool, report: Path | None) -> int:
    from softnlp.base.status import Status
    from softnlp.results import identify_document as results
    from softnlp.results.document import document_text
    from softnlp.scenario.identify import run_robots
    from softnlp.studies.measurements import RobotTask

    task = asked.task
    assert isinstance(task, RobotTask)
    try:
        found = searched(asked, run_robots)
    except Stopped:
        complain("stopped; an identification that is not finished leaves no constants")
        return STOPPED
    solved = found.status is Status.SOLVED
    document = document_text(results.robot_document(asked, task, found), compact=False)

    def write(to: Path) -> None:
        from softnlp.figures import identified_figure

        texts = {"identified.json": document, "table.csv": results.robot_table_text(task, found)}
        if solved:
            texts["identified.toml"] = results.identified_text(asked, found)
        figures = {"figure": partial(identified_figure, found, asked.title)}
        write_results(to, asked, texts, figures if solved else {})

    show(folder, json, write, lambda: document, lambda: _say_robots(asked, found))
    if report is not None:
        from softnlp.figures import identified_figure

        figures = {"Measured and model": partial(identified_figure, found, asked.title)} if solved else {}
        texts = {"Tables to paste into a scenario": results.identified_text(asked, found)} if solved else {}
        sections = [_read_section(found), library_section(found.material)]
        write_report(report, asked, document, figures, sections, quiet=json, texts=texts)
    for problem in found.problems:
        complain(f"{asked.path}: [measurements] {problem}")
    return SOLVED if solved and not found.problems else SOME_UNSOLVED


def _read_section(found: Identified) -> Section:
    """Return what was read of each robot."""
    from softnlp.base.units import BAR
    from softnlp.results.report_page import Section
    from softnlp.studies.measurements import OBSERVABLES, column_slice

    rows = []
    for d in found.data:
        counts = {
            name.replace("_", " "): int(d.measured[:, column_slice(name)].any(axis=1).sum()) for name in OBSERVABLES
        }
        seen = ", ".join(f"{count} of {name}" for name, count in counts.items() if count)
        rows.append([d.label, str(len(d.pressure)), seen, f"0 to {d.pressure.max() / BAR:.4g}"])
    return Section("What was read", ("robot", "rows", "measured", "pressures [bar]"), rows)


def _say_robots(asked: Scenario, found: Identified) -> None:
    """Print constants and misfits."""
    from softnlp.base.columns import OUTPUTS
    from softnlp.studies.check import messages
    from softnlp.studies.identified import file_name

    say(f"{asked.title}: {', '.join(d.label for d in found.data)}; {asked.material.name} ({asked.material.law.name})")
    for line in gravity_lines(asked.loads.gravity):
        say(line)
    if found.status != "solved":
        say(f"{found.status}: {found.message}")
        return
    rows = []
    for k, name in enumerate(found.free.names):
        key, scale = file_name(name, found.material)
        error = found.uncertainty.standard_errors[k] / scale
        values = (found.constants[k] / scale, error, found.free.start[k] / scale)
        rows.append([key, *(f"{v:.6g}" for v in values), found.notes[name]])
    say_rows(["constant", "value", "standard_error", "start", "note"], rows)
    before, after = found.errors(False), found.errors()
    misfits = ("rmse_before", "rmse_after", "mape_before_percent", "mape_after_percent")
    say_rows(
        ["observable", "unit", "numbers", *misfits, "sigma"],
        [
            [
                OUTPUTS[key].key,
                str(OUTPUTS[key].unit),
                str(after[key].count),
                *(f"{m[key].rmse / OUTPUTS[key].scale:.4g}" for m in (before, after)),
                *(f"{m[key].mape:.3g}" for m in (before, after)),
                _sigma_text(found, key),
            ]
            for key in after
        ],
    )
    for line in found.registration.lines() if found.registration is not None else ():
        say(line)
    for warning in (*found.warnings, *messages(found.checks, "warned")):
        say(f"warning: {warning}")


def _sigma_text(found: Identified, key: str) -> str:
    """Return the range of standard deviations that the residuals of an observable were divided by."""
    import numpy as np

    from softnlp.base.columns import OUTPUTS
    from softnlp.studies.measurements import column_slice

    parts = [d.sigma[:, column_slice(key)][np.isfinite(d.of(key))] for d in found.data]
    used = OUTPUTS[key].shown(np.concatenate(parts))
    low, high = float(np.min(used)), float(np.max(used))
    return f"{low:.3g}" if high <= low * 1.0001 else f"{low:.3g} to {high:.3g}"
