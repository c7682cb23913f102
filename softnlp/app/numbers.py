"""The numbers of a step as the page shows them, taken from the document that `softnlp run --json` prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from softnlp.base.columns import OUTPUTS, TABLES, written
from softnlp.results import to_json
from softnlp.statics.step import Run

NOTHING = "–"
_STABILITY = {
    True: "",
    False: " The equilibrium is not stable.",
    None: " Its stability is undefined: a dead tip moment has no potential.",
}


@dataclass(frozen=True)
class Line:
    """A number with its name and unit. key : of the JSON document, with the index of an entry, `tip_position_mm.0`."""

    key: str
    label: str
    text: str
    unit: str


@dataclass(frozen=True)
class Lines:
    """The numbers of a step. numbers : without a solution each is a dash. chambers : of each chamber."""

    numbers: list[Line]
    chambers: list[Line]


def step_lines(run: Run) -> Lines:
    """Return what the document of a run says of its only step."""
    step = to_json(run)["steps"][0]
    return Lines(_numbers(run, step), _chambers(run, step))


def _numbers(run: Run, step: dict[str, Any]) -> list[Line]:
    names = [*TABLES["page"]]
    if any(run.loads.tip_force) or any(run.loads.tip_moment) or any(run.loads.gravity):
        names += TABLES["page, loads"]
    longer = OUTPUTS["elongation"]
    backbone, length = step[OUTPUTS["backbone_length"].key], longer.shown(run.robot.length)
    elongation = None if backbone is None else backbone - length
    lines = _lines({**step, longer.key: elongation}, [*names, *TABLES["page, wall"]], run)
    relative = written(None if elongation is None else 100 * elongation / length, ".2f", NOTHING)
    at = 1 + next(k for k, line in enumerate(lines) if line.key == longer.key)
    return [*lines[:at], Line(f"{longer.name}_percent", lines[at - 1].label, relative, "% of L₀"), *lines[at:]]


def _chambers(run: Run, step: dict[str, Any]) -> list[Line]:
    """Return the length of each chamber, and of a blocked force the reaction of each."""
    return _lines(step, TABLES["page, chambers"], run)


def _lines(step: dict[str, Any], names: Sequence[str], run: Run) -> list[Line]:
    """Return the lines of the outputs that the document of a step has."""
    lines = []
    for output in (OUTPUTS[name] for name in names if OUTPUTS[name].key in step):
        found, title = step[output.key], output.title or output.label.capitalize()
        if not output.dims:
            lines.append(Line(output.key, title, written(found, output.page, NOTHING), output.unit.sign))
            continue
        indices = list("xyz") if output.dims == ("axis",) else [str(n + 1) for n in range(run.robot.chambers)]
        for k, index in enumerate(indices):
            entry = None if found is None or k >= len(found) else found[k]
            text = written(entry, output.page, NOTHING)
            lines.append(Line(f"{output.key}.{k}", title.format(index), text, output.unit.sign))
    return lines


def certificate_words(run: Run) -> str:
    """Return in plain words how a step ended and how well its equations hold, or what to do next."""
    step = run.steps[0]
    if not step.status.has_solution or step.residual is None:
        return f"{step.status.value.replace('_', ' ').capitalize()}: {step.message}."
    stable = "" if step.pose is None else _STABILITY[step.pose.stable]
    error = "" if step.discretisation_error is None else f", tip within {step.discretisation_error:.0e} L₀"
    lead = "Solved" if step.status.value == "solved" else "No contact: the robot does not reach the wall"
    return f"{lead}, residual {step.residual:.0e}{error}, {step.intervals} intervals.{stable}"
