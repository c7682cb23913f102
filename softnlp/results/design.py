"""A design study as a JSON document, a CSV table, a table for the terminal, and its best candidate as a scenario."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import TYPE_CHECKING, Any

from softnlp.base import columns
from softnlp.base.columns import DEG, MM, ONE, Output
from softnlp.base.files import toml_key, toml_text
from softnlp.base.units import BAR
from softnlp.model.gravity import gravity_lines
from softnlp.model.inputs import asked_tables, contact_table, robot_table, tidy
from softnlp.model.materials import Material
from softnlp.model.quantities import Model
from softnlp.model.robot import DIMENSIONS, Robot
from softnlp.results.document import csv_text, document_head, document_text, engine_table, number
from softnlp.studies.design import Design
from softnlp.studies.design_candidate import Candidate
from softnlp.studies.design_problem import Active
from softnlp.studies.design_task import FORCE, OUTPUTS, PressureSteps, Range

if TYPE_CHECKING:
    from rich.console import Group

_FILE = {d.field: (f"robot.{d.file_key}", d.scale) for d in DIMENSIONS}

_KEPT = ("stiffening", "corrections", "gravity", "tip_load", "solver", "mould")  # tables of the best candidate


def design_document(done: Design) -> dict[str, Any]:
    """Return a design as plain dicts, lists, strings, numbers and None; no NaN or infinity."""
    setting, task, best = done.setting, done.task, done.best
    limits = {
        OUTPUTS[name].key: {
            key: tidy(value, OUTPUTS[name].scale)
            for key, value in (("at_least", limit.lower), ("at_most", limit.upper))
            if isfinite(value)
        }
        for name, limit in task.requirements.items()
    }
    found = None if best is None else candidate_table(done, best)
    if found is not None and done.free_closure_force is not None:
        found[f"{FORCE}_free_closure_{OUTPUTS[FORCE].unit}"] = done.free_closure_force
    return {
        **document_head(done.title, "design", setting.conventions.name),
        **asked_tables(
            Model(setting.robot, setting.material, setting.coefficients, setting.conventions), setting.loads
        ),
        **({"contact": contact_table(setting.contact)} if task.needs_force else {}),
        "objective": {"maximise" if task.maximise else "minimise": task.objective.key},
        "requirements": limits,
        "sets": [k + 1 for k in task.sets],
        "best": found,
        "candidates": [candidate_table(done, candidate) for candidate in done.candidates],
    }


def design_json(done: Design) -> str:
    """Return the document as text, ending in a newline."""
    return document_text(design_document(done))


def candidate_table(done: Design, candidate: Candidate) -> dict[str, Any]:
    """Return a candidate in the units of files."""
    outputs = {o.key: number(candidate.outputs.get(o.name), o.scale) for o in known_outputs(done)}
    return {
        "number": candidate.number,
        "choices": choices_table(candidate.choices),
        "status": candidate.status,
        "reasons": list(candidate.reasons),
        "outputs": outputs,
        "robot": robot_table(candidate.robot),
        "active": [active_table(done, active) for active in candidate.active],
        "starts": candidate.starts,
        "agreeing": candidate.agreeing,
        "optimal": candidate.optimal,
        "iterations": candidate.iterations,
        "intervals": candidate.intervals,
        "residual": number(candidate.step.residual if candidate.step else None),
        **engine_table(*((step.engine, step.ipopt) if (step := candidate.step) else (None, None))),
        "warnings": list(candidate.warnings),
        columns.OUTPUTS["solve_time"].key: candidate.solve_time,
    }


def known_outputs(done: Design) -> list[Output]:
    """Return the outputs that candidates of a study have."""
    return [o for o in OUTPUTS.values() if o.name != FORCE or done.task.needs_force]


def choices_table(choices: Mapping[str, Any]) -> dict[str, Any]:
    """Return choices under the keys of [choices]; whole robots and silicones by their names."""
    table: dict[str, Any] = {}
    for name, value in choices.items():
        if isinstance(value, Material):
            table |= {"material.name": value.name, "material.model": value.law.name}
        elif isinstance(value, Robot):
            table["robot.name"] = value.name
        elif name == "pressure":
            table[OUTPUTS[name].key] = tidy(value, BAR)
        else:
            key, scale = _FILE[name]
            table[key] = int(value) if scale is None else tidy(value, scale)
    return table


def active_table(done: Design, active: Active) -> dict[str, Any]:
    """Return a limit that holds the objective back; the gain is per unit of the file."""
    scale, unit = _unit_of(active.name)
    objective = done.task.objective
    return {
        "limit": OUTPUTS[active.name].key if active.name in OUTPUTS else active.name,
        "side": active.side,
        "value": number(active.limit, scale),
        "unit": unit,
        "gain_per_unit": None if not isfinite(active.limit) else number(active.rate * scale, objective.scale),
        "gain_unit": objective.unit.label,
    }


def _unit_of(name: str) -> tuple[float, str]:
    """Return the scale and the unit in which a limit is written."""
    if name in OUTPUTS:
        return OUTPUTS[name].scale, OUTPUTS[name].unit.label
    unit = DEG if name == "chamber_angle" else MM
    return unit.scale, unit.label


def design_csv(done: Design) -> str:
    """Return the candidates as CSV, a row each; cells of what is not known are empty."""
    keys = list(dict.fromkeys(key for c in done.candidates for key in choices_table(c.choices)))
    outputs = [o.key for o in known_outputs(done)]
    header = ["number", "status", *(f"choice {key}" for key in keys), *outputs, "reasons", "warnings", "optimal"]
    rows = []
    for candidate in done.candidates:
        table = candidate_table(done, candidate)
        cells = [table["choices"].get(key) for key in keys] + [table["outputs"][key] for key in outputs]
        known = "" if candidate.optimal is None else str(candidate.optimal).lower()
        words = ["; ".join(table[name]) for name in ("reasons", "warnings")]
        rows.append([table["number"], table["status"], *cells, *words, known])
    return csv_text(header, rows)


def label(done: Design, candidate: Candidate) -> str:
    """Return the discrete choices of a candidate in a few words; "design" where there are none."""
    words = []
    for name, value in candidate.choices.items():
        if name not in done.task.lists:
            continue
        if isinstance(value, Material):
            several = len({m.law.name for m in done.task.lists["material"]}) > 1
            words.append(f"{value.name} ({value.law.name})" if several else value.name)
        elif isinstance(value, Robot):
            words.append(value.name)
        elif name == "chambers_per_set":
            words.append(f"{candidate.robot.chambers} chambers")
        else:
            ((key, entry),) = choices_table({name: value}).items()
            stem, _, unit = key.removeprefix("robot.").rpartition("_")
            words.append(
                f"{stem.replace('_', ' ')} {entry:g} {unit}" if unit in ("mm", "deg") else f"{key[6:]} {entry}"
            )
    return ", ".join(words) or "design"


def design_lines(done: Design) -> Group:
    """Return a table of the candidates, the best one and what holds it back; print it with rich."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), show_edge=False)
    table.add_column("", justify="right", no_wrap=True)
    table.add_column("candidate", overflow="fold")
    table.add_column("status", no_wrap=True)
    columns = shown_outputs(done)
    for output in columns:
        table.add_column(Text(f"{output.label}\n[{output.unit}]"), justify="right", no_wrap=True)
    for c in done.candidates:
        cells = [_digits(c.outputs.get(o.name), o.scale) for o in columns]
        style = "bold green" if c is done.best else "" if c.is_feasible else "bright_black"
        status = f"{c.status}, not optimal" if c.optimal is False else c.status
        table.add_row(str(c.number), Text(label(done, c)), status, *cells, style=style)
    return Group(table, *(Text(line, style) for line, style in _notes(done)))


def shown_outputs(done: Design) -> list[Output]:
    """Return the outputs worth a column: the objective, pressure, angle, and what is required of a robot's doing."""
    task = done.task
    wanted = dict.fromkeys([task.objective.name, "pressure", "bending_angle", "stretch", *task.requirements])
    return [OUTPUTS[name] for name in wanted if OUTPUTS[name].group != "robot" or name == task.objective.name]


def _notes(done: Design) -> Iterator[tuple[str, str]]:
    """Yield what is to be said below the table, with a style."""
    yield from ((line, "") for line in gravity_lines(done.setting.loads.gravity))
    for candidate in done.candidates:
        if not candidate.is_feasible:
            yield f"{candidate.number} {candidate.status}: {'; '.join(candidate.reasons)}", "bright_black"
    best = done.best
    if best is None:
        yield "no candidate is feasible", "red"
        return
    objective = done.task.objective
    value = _digits(best.objective, objective.scale)
    unit = "" if objective.unit is ONE else f" {objective.unit}"
    yield f"best: {best.number} {label(done, best)}, {objective.key} {value}{unit}", "bold green"
    chosen = {key: value for key, value in choices_table(best.choices).items() if not isinstance(value, str)}
    if chosen:
        yield "  " + ", ".join(f"{key} {value:.6g}" for key, value in chosen.items()), ""
    if done.free_closure_force is not None:
        yield f"  without the chambers' reaction (closure free) the force is {done.free_closure_force:.4g} N", ""
    for words in held_back(done, best):
        yield f"  held back by {words}", ""
    for warning in best.warnings:
        yield f"  warning: {warning}", "yellow"


def held_back(done: Design, candidate: Candidate) -> Iterator[str]:
    """Yield in words each limit that holds the objective back and what loosening it would gain."""
    for active in (active_table(done, a) for a in candidate.active):
        if active["value"] is None:
            yield str(active["limit"])
            continue
        side = "at least" if active["side"] == "lower" else "at most"
        unit = "" if active["unit"] == "1" else f" {active['unit']}"
        gain = f"{active['gain_per_unit']:+.4g} {active['gain_unit']} for each{unit or ' 1'} looser"
        yield f"{active['limit']} {side} {active['value']:.6g}{unit}: {gain}"


def best_scenario(done: Design, asked: Mapping[str, Any]) -> str | None:
    """Return the best candidate as the text of a scenario that can be run, or None where nothing is feasible.

    asked : the scenario of the design as it was parsed; [robot], [material] and what the pressure is are replaced.
    """
    best = done.best
    if best is None:
        return None
    robot, material = candidate_tables(best, asked)
    force = done.task.needs_force
    highest = tidy(best.outputs["pressure"], BAR)
    tables: dict[str, Any] = {
        "title": f"{done.title}: {label(done, best)}"[:200],
        "study": "blocked-force" if force else "forward",
        "robot": robot,
        "material": material,
        **{key: asked[key] for key in _KEPT if key in asked},
        **({"contact": asked["contact"]} if force and "contact" in asked else {}),
        "pressure": {"ramp": {"sets": [k + 1 for k in done.task.sets], "to_bar": highest, "steps": 11}},
    }
    lines = []
    for key, value in tables.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]", *(f"{toml_key(name)} = {toml_text(item)}" for name, item in value.items())]
        else:
            lines.append(f"{key} = {toml_text(value)}")
    return "\n".join(lines) + "\n"


def candidate_tables(candidate: Candidate, asked: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the [robot] and the [material] of a candidate, of a scenario `asked` that was parsed."""
    material = dict(asked["material"])
    if "material" in candidate.choices:
        kept = {key: material[key] for key in ("set", "file", "density_kg_m3") if key in material}
        material = {"name": candidate.material.name, "model": candidate.material.law.name, **kept}
    rules = {key: asked["robot"][key] for key in ("allow", "minimum_wall_mm") if key in asked["robot"]}
    return robot_table(candidate.robot) | rules, material


def pressure_words(pressure: float | Range | PressureSteps) -> str:
    """Return what was asked of the pressure in a few words."""
    if isinstance(pressure, Range):
        return f"{pressure.lower / BAR:g} to {pressure.upper / BAR:g} bar"
    if isinstance(pressure, PressureSteps):
        return f"lowest step of {pressure.step / BAR:g} bar, up to {pressure.highest / BAR:g} bar"
    return f"{pressure / BAR:g} bar"


def _digits(value: float | None, scale: float) -> str:
    found = number(value, scale)
    return "-" if found is None else f"{found:.4g}"
