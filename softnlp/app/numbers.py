"""The numbers of a step as the page shows them, taken from the document that `softnlp run --json` prints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from softnlp.base.units import MILLIMETRE
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
    length = run.robot.length / MILLIMETRE
    lines = [Line(f"tip_position_mm.{k}", f"Tip {axis}", _fixed(_entry(step, "tip_position_mm", k), 3), "mm")
             for k, axis in enumerate("xyz")]  # fmt: skip
    lines.append(Line("bending_angle_deg", "Bending angle", _fixed(step["bending_angle_deg"], 3), "°"))
    lines.append(Line("tilt_deg", "Tip tilt", _fixed(step["tilt_deg"], 3), "°"))
    backbone = step["backbone_length_mm"]
    lines.append(Line("backbone_length_mm", "Backbone length", _fixed(backbone, 3), "mm"))
    longer = None if backbone is None else backbone - length
    relative = None if longer is None else 100 * longer / length
    lines.append(Line("elongation_mm", "Elongation", _fixed(longer, 3), "mm"))
    lines.append(Line("elongation_percent", "Elongation", _fixed(relative, 2), "% of L₀"))
    lines.append(Line("stretch", "Stretch from pressure", _fixed(step["stretch"], 5), ""))
    if any(run.loads.tip_force) or any(run.loads.tip_moment) or any(run.loads.gravity):
        lines += [Line(f"tip_displacement_mm.{k}", f"Moved by loads, {axis}",
                       _fixed(_entry(step, "tip_displacement_mm", k), 3), "mm")
                  for k, axis in enumerate("xyz")]  # fmt: skip
    return [*lines, *_contact(step)]


def _chambers(run: Run, step: dict[str, Any]) -> list[Line]:
    """Return the length of each chamber, and of a blocked force the reaction of each."""
    lines = [Line(f"chamber_length_mm.{n}", f"Chamber {n + 1}", _fixed(_entry(step, "chamber_length_mm", n), 3), "mm")
             for n in range(run.robot.chambers)]  # fmt: skip
    if "chamber_reaction_N" in step:
        lines += [Line(f"chamber_reaction_N.{n}", f"Reaction {n + 1}",
                       _fixed(_entry(step, "chamber_reaction_N", n), 4), "N")
                  for n in range(run.robot.chambers)]  # fmt: skip
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


def _contact(step: dict[str, Any]) -> Iterator[Line]:
    if "blocked_force_N" not in step:
        return
    yield Line("blocked_force_N", "Blocked force", _fixed(step["blocked_force_N"], 4), "N")
    yield Line("gap_mm", "Gap of the free shape", _fixed(step["gap_mm"], 3), "mm")
    yield Line("free_bending_angle_deg", "Bending angle, free", _fixed(step["free_bending_angle_deg"], 3), "°")
    yield Line("length_error_mm", "Length error e_L", _fixed(step["length_error_mm"], 4), "mm")


def _entry(step: dict[str, Any], key: str, index: int) -> float | None:
    values = step[key]
    return None if values is None or index >= len(values) else values[index]


def _fixed(value: float | None, decimals: int) -> str:
    """Return a number with a true minus sign left to the browser's font, and no negative zero."""
    if value is None:
        return NOTHING
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0 else text
