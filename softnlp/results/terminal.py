"""A run as a table for the terminal."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.model.gravity import gravity_lines
from softnlp.results.targets import INVERSE
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import BLOCKED_FORCE, solved_pose

if TYPE_CHECKING:
    from rich.console import Group

NONE = "-"


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
    numbers, names = _KINDS.get(run.study, (_numbers, _HEADERS))
    titles = list(names)
    if moving:  # the offset tells what the gap does
        titles[:2] = ["offset\n[mm]", titles[0]]
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
        found = numbers(step)
        if moving:
            found[:2] = [_offset(run, step), found[0]]
        table.add_row(*cells, Text(step.status.value, style), *found)

    lines = [Text(line, style) for line, style in _notes(run)]
    return Group(table, *lines)


_STABLE = {True: "yes", False: "no", None: "undef."}
_TIP = ("bending\n[deg]", "tip x\n[mm]", "y\n[mm]", "z\n[mm]")
_HEADERS: tuple[str, ...] = (*_TIP, "stretch", "stable", "resid.", "error", "time\n[s]")
_BLOCKED_HEADERS = ("force\n[N]", "gap\n[mm]", *_TIP, "resid.")


def _numbers(step: Step) -> list[str]:
    """Return what follows the status; residual and time are known of failed steps as well."""
    pose = solved_pose(step)
    residual = _short(step.residual)
    if pose is None:
        return [*[NONE] * 6, residual, NONE, f"{step.solve_time:.3g}"]
    return [
        f"{pose.bending_angle / DEGREE:.2f}",
        *(_millimetres(v) for v in pose.tip_position),
        f"{pose.stretch:.3f}",
        _STABLE[pose.stable],
        residual,
        _short(step.discretisation_error),
        f"{step.solve_time:.3f}",
    ]


def _blocked_numbers(step: Step) -> list[str]:
    """Return what follows the status of a blocked force; dashes where there is no wall.

    What is not stable is a warning below the table, so that the table fits 80 columns.
    """
    plain = _numbers(step)
    wall = [NONE, NONE]
    if step.contact is not None and step.status.has_solution:
        gap = _millimetres(step.contact.gap) if step.contact.normal.any() else NONE
        wall = [f"{step.contact.force:.4f}", gap]
    return [*wall, *plain[:4], plain[6]]


_INVERSE_HEADERS = ("left\n[mm]", "off\n[deg]", *_TIP, "stable", "resid.", "time\n[s]")


def _inverse_numbers(step: Step) -> list[str]:
    """Return what follows the status of a target; what is left of it and the nearest tip are known out of reach too."""
    plain, aimed = _numbers(step), step.aimed
    left, off = NONE, NONE
    if aimed is not None:
        left = NONE if aimed.distance is None else f"{aimed.distance / MILLIMETRE:.4f}"
        off = NONE if aimed.angle is None else f"{aimed.angle / DEGREE:.4f}"
        if aimed.tip_position is not None:
            plain[1:4] = [_millimetres(v) for v in aimed.tip_position]
    return [left, off, *plain[:4], plain[5], plain[6], plain[8]]


_KINDS: Mapping[str, tuple[Callable[[Step], list[str]], tuple[str, ...]]] = {
    BLOCKED_FORCE: (_blocked_numbers, _BLOCKED_HEADERS),
    INVERSE: (_inverse_numbers, _INVERSE_HEADERS),
}


def _wall_moves(run: Run) -> bool:
    """Whether steps differ in where the wall stands."""
    points = [step.contact.wall_point for step in run.steps if step.contact is not None and step.contact.normal.any()]
    return any((point != points[0]).any() for point in points)


def _offset(run: Run, step: Step) -> str:
    """Return where the wall stands along x, or for one given by a point how far it was moved the way it pushes."""
    if step.contact is None:
        return NONE
    given = run.contact.wall_point if run.contact is not None else None
    if given is None:
        return _millimetres(float(step.contact.wall_point[0]))
    return _millimetres(float(step.contact.normal @ (step.contact.wall_point - given)))


def _notes(run: Run) -> Iterator[tuple[str, str]]:
    """Yield (line, style) of gravity, failures and warnings, neighbouring steps with the same words on one line."""
    yield from ((line, "") for line in gravity_lines(run.loads.gravity))
    failed = [(k, f"{s.status.value}: {s.message}") for k, s in enumerate(run.steps, start=1) if s in run.failed]
    warned = [(k, f"warning: {text}") for k, s in enumerate(run.steps, start=1) for text in s.warnings]
    yield from ((line, "red") for line in _grouped(failed))
    yield from ((f"step {k} {text}", "") for k, text in _sensitivities(run))
    yield from ((f"warning: {text}", "yellow") for text in run.warnings)
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


def _millimetres(value: float) -> str:
    text = f"{value / MILLIMETRE:.2f}"
    return text.removeprefix("-") if float(text) == 0 else text


def _short(value: float | None) -> str:
    return NONE if value is None or value != value else f"{value:.0e}"


def _alike(values: Sequence[float], most: int) -> str:
    """Return one format for all values: as many decimals as they need, at most `most`."""
    for decimals in range(most):
        if all(abs(value - round(value, decimals)) < 1e-9 for value in values):
            return f".{decimals}f"
    return f".{most}f"
