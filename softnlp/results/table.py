"""A run as tables: CSV, one row a step with the unit in each column's name, and a table for the terminal."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.columns import OUTPUTS, TABLES, Output, written
from softnlp.base.files import write_whole
from softnlp.base.units import BAR
from softnlp.model.gravity import gravity_lines
from softnlp.model.inputs import pressure_bar, tidy
from softnlp.results.document import csv_text
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import (
    BLOCKED_FORCE,
    closure_of,
    left_by_weights,
    sizes_of,
    solved_pose,
    table_outputs,
    value,
)

if TYPE_CHECKING:
    from rich.console import Group

NONE = "-"


def write_table(run: Run, path: str | PathLike[str]) -> Path:
    """Write a run as CSV; pressures are in columns p1_bar, p2_bar, … as in a pressure file.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    return write_whole(path, table_text(run).encode())


def table_text(run: Run) -> str:
    """Return the text of `write_table`."""
    timed = any(step.time is not None for step in run.steps)
    weighted = {line.equation: line.unit for step in run.steps for line in left_by_weights(step)}
    header = ["step"] + ["t_s"] * timed
    header += [f"p{k + 1}_bar" for k in range(run.robot.chamber_sets)]
    columns = {output: output.keys(sizes_of(run), "") for output in table_outputs(run)}
    header += ["status", *(key for keys in columns.values() for key in keys)]
    header += ["closure"] * (run.study == BLOCKED_FORCE)
    header += ["_".join(["weighted_residual", *name.split(), unit.replace(" ", "")]) for name, unit in weighted.items()]
    header += ["residual", "message", "warnings"]
    rows = (list(_row(k, step, run, timed, columns, list(weighted))) for k, step in enumerate(run.steps, start=1))
    return csv_text(header, rows)


def _row(
    number: int, step: Step, run: Run, timed: bool, columns: Mapping[Output, Sequence[str]], weighted: list[str]
) -> Iterator[Any]:
    yield number
    if timed:
        yield None if step.time is None else tidy(step.time)
    yield from pressure_bar(step.pressure)
    yield step.status.value
    for output, keys in columns.items():
        found = value(output, step)
        yield from ([None] * len(keys) if found is None else map(_cell, np.ravel(found).tolist()))
    if run.study == BLOCKED_FORCE:
        yield closure_of(run, step)
    left = {line.equation: line.value for line in left_by_weights(step)}
    yield from (_cell(left.get(equation)) for equation in weighted)
    yield _cell(step.residual)
    yield step.message
    yield "; ".join(step.warnings)


def _cell(found: Any) -> Any:
    """Return a number as CSV has it: true and false, nothing for NaN."""
    if isinstance(found, bool):
        return "true" if found else "false"
    return found if found == found else None


def table_lines(run: Run) -> Group:
    """Return a table of the steps and, below it, why steps failed and what to be warned of; print it with rich.

    With three chamber sets it fits 100 columns, of a blocked force 80. Colours are added to words, never instead of
    them.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    steps, sets = run.steps, run.robot.chamber_sets
    timed = any(step.time is not None for step in steps)
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=0, show_edge=False)
    table.add_column("step", justify="right", no_wrap=True)
    headers = ["t\n[s]"] * timed + [f"p{k + 1}\n[bar]" for k in range(sets)]
    for header in headers:
        table.add_column(Text(header), justify="right", no_wrap=True)
    table.add_column("status", overflow="fold", min_width=6)
    blocked = run.study == BLOCKED_FORCE
    moving = blocked and _wall_moves(run)
    titles = [heading for output in _shown(run.study) for heading in output.headings]
    if moving:  # the offset tells what the gap does
        titles[:2] = [titles[1].replace("gap", "offset"), titles[0]]
    for header in titles:
        table.add_column(Text(header), justify="right", no_wrap=True)

    pressures = _alike([p / BAR for step in steps for p in step.pressure], most=3)
    times = _alike([step.time for step in steps if step.time is not None], most=2)
    for k, step in enumerate(steps):
        cells = [str(k + 1)]
        if timed:
            cells.append(NONE if step.time is None else format(step.time, times))
        cells += [format(p / BAR, pressures) for p in step.pressure]
        style = "" if step.status.has_solution else "red"
        found = _numbers(run.study, step)
        if moving:
            found[:2] = [_offset(run, step), found[0]]
        table.add_row(*cells, Text(step.status.value, style), *found)

    lines = [Text(line, style) for line, style in _notes(run)]
    return Group(table, *lines)


_STABLE = {True: "yes", False: "no", None: "undef."}


def _numbers(study: str, step: Step) -> list[str]:
    """Return what follows the status: dashes where there is no solution, except for what is known of failed steps.

    What is not stable in a blocked force is a warning below the table, so that the table fits 80 columns.
    """
    cells: list[str] = []
    for output in _shown(study):
        if output.name == "solve_time" and solved_pose(step) is None:
            cells.append(f"{step.solve_time:.3g}")
        elif output.name == "stable":
            pose = solved_pose(step)
            cells.append(NONE if pose is None else _STABLE[pose.stable])
        else:
            found = value(output, step)
            entries = [found] * len(output.headings) if found is None else np.ravel(found).tolist()
            cells += [written(entry, output.form) + _spread(output, step, k) for k, entry in enumerate(entries)]
    return cells


def _spread(output: Output, step: Step, entry: int) -> str:
    """Return the standard deviation of an entry of an output, in words, where there is one."""
    scatter = OUTPUTS.get(f"std_{output.name}")
    found = None if scatter is None or step.deviation is None else value(scatter, step)
    spread = "" if found is None else written(float(np.ravel(found)[entry]), output.form, "")
    return f" ± {spread}" if spread else ""


def _shown(study: str) -> list[Output]:
    """Return the outputs that the table of a study shows."""
    return [OUTPUTS[name] for name in TABLES.get(study, TABLES["forward"])]


def _wall_moves(run: Run) -> bool:
    """Whether steps differ in where the wall stands."""
    points = [step.contact.wall_point for step in run.steps if step.contact is not None and step.contact.normal.any()]
    return any((point != points[0]).any() for point in points)


def _offset(run: Run, step: Step) -> str:
    """Return where the wall stands along x, or for one given by a point how far it was moved the way it pushes."""
    if step.contact is None:
        return NONE
    gap = OUTPUTS["gap"]
    given = run.contact.wall_point if run.contact is not None else None
    if given is None:
        moved = float(step.contact.wall_point[0])
    else:
        moved = float(step.contact.normal @ (step.contact.wall_point - given))
    return written(gap.shown(moved), gap.form)


def _notes(run: Run) -> Iterator[tuple[str, str]]:
    """Yield (line, style) of gravity, failures and warnings, neighbouring steps with the same words on one line."""
    yield from ((line, "") for line in gravity_lines(run.loads.gravity))
    failed = [(k, f"{s.status.value}: {s.message}") for k, s in enumerate(run.steps, start=1) if s in run.failed]
    warned = [(k, f"warning: {words}") for k, s in enumerate(run.steps, start=1) for words in s.warnings]
    yield from ((line, "red") for line in _grouped(failed))
    yield from ((f"step {k} {words}", "") for k, words in _sensitivities(run))
    yield from ((f"warning: {words}", "yellow") for words in run.warnings)
    yield from ((line, "yellow") for line in _grouped(warned))


def _sensitivities(run: Run) -> Iterator[tuple[int, str]]:
    """Yield how the force of `weighted` answers to its weights, where that was asked for."""
    for k, step in enumerate(run.steps, start=1):
        if step.contact is not None and step.contact.sensitivity:
            parts = [f"{line.elasticity:+.3f} % ({line.weight})" for line in step.contact.sensitivity]
            yield k, f"force per 1 % of a weight: {', '.join(parts)}"


def _grouped(notes: Sequence[tuple[int, str]]) -> Iterator[str]:
    """Yield "steps 3-5 …" for neighbouring steps whose words differ in numbers only; those of the first are shown."""
    alike: dict[str, list[tuple[int, str]]] = {}
    for number, text in notes:
        alike.setdefault(re.sub(r"\d[\d.]*(e[+-]?\d+)?", "#", text), []).append((number, text))
    found = []
    for group in alike.values():
        # Steps that count up together share the difference to their place in the list.
        for _, pairs in groupby(enumerate(group), key=lambda pair: pair[1][0] - pair[0]):
            found.append([note for _, note in pairs])
    for members in sorted(found):
        (first, text), (last, last_text) = members[0], members[-1]
        if first == last:
            yield f"step {first} {text}"
        else:
            yield f"steps {first}-{last} {text}" + (f" (numbers of step {first})" if last_text != text else "")


def _alike(values: Sequence[float], most: int) -> str:
    """Return one format for all values: as many decimals as they need, at most `most`."""
    for decimals in range(most):
        if all(abs(value - round(value, decimals)) < 1e-9 for value in values):
            return f".{decimals}f"
    return f".{most}f"
