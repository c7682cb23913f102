"""The candidates of a design as they come: a table, a plot, why one is not feasible, and the one that is used."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import Any

import numpy as np
from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress, Stopped, few_enough, scenario_with, sentence
from softnlp.app.parts import Chart, NumberTable, downloads, marks, study_row
from softnlp.app.session import Stage
from softnlp.base.columns import ONE, Output
from softnlp.base.processes import processors
from softnlp.base.units import BAR
from softnlp.figures.design import across, design_figure
from softnlp.figures.style import COLOURS
from softnlp.results.design import (
    best_scenario,
    candidate_tables,
    design_csv,
    design_json,
    held_back,
    label,
    shown_outputs,
)
from softnlp.scenario.design import design_so_far, finished_design, run_design
from softnlp.scenario.read import Scenario
from softnlp.studies.design import Design
from softnlp.studies.design_candidate import Candidate

STUDY = "design"
MOST_CANDIDATES = 5000
_GREY = "#8a8f98"
_LOOK_S = 0.2  # between two looks whether a person stops


@dataclass
class Found:
    """What a run has found so far. asked : its scenario. candidates : those done. whole : the design, at the end."""

    asked: Scenario
    candidates: list[Candidate] = field(default_factory=list)
    whole: Design | None = None

    def design(self) -> Design:
        """Return the design of what is done."""
        return design_so_far(self.asked, self.candidates) if self.whole is None else self.whole


def workers() -> int:
    """Return how many processes work: never this one, so that the page is alive meanwhile."""
    return max(2, processors())


def work_of(found: Found) -> Callable[[Progress], Found]:
    """Return the work of a design. Stopped, it ends at once and keeps the candidates that are done."""

    def work(progress: Progress) -> Found:
        ended, problems, total = Event(), list[Exception](), found.asked.step_count

        def done(number: int, candidate: Candidate) -> None:
            if progress.stopping:
                raise Stopped
            found.candidates.append(candidate)
            if number < total:
                progress(number, total, f"{number} of {total} candidates")

        def run() -> None:
            try:
                found.whole = run_design(found.asked, done, workers())
            except Stopped:
                pass
            except Exception as error:
                problems.append(error)
            finally:
                ended.set()

        # In a thread of its own: the candidate at work when a person stops is not waited for, and is thrown away.
        Thread(target=run, name="design", daemon=True).start()
        while not ended.wait(_LOOK_S) and not progress.stopping:
            pass
        if problems:
            raise problems[0]
        if found.whole is None:
            found.whole = finished_design(found.asked, tuple(found.candidates))
        return found

    return work


def candidates_part(stage: Stage) -> None:
    """Build what runs a design and shows it."""
    _Candidates(stage)


class _Candidates:
    def __init__(self, stage: Stage) -> None:
        self._stage, self._session = stage, stage.session
        self._found: Found | None = None
        self._drawn = 0
        self._chosen: Candidate | None = None
        self._order: list[Candidate] = []
        self._row = study_row("design", "Find the best design", self._asked, self._finish, self._watch)
        self._why = controls.named(ui.label("").classes("text-sm break-words whitespace-pre-line w-full"), "design.why")
        with ui.row().classes("gap-2") as self._use_row:
            self._use = controls.use_button("Use this design", "design.use", self._take)
            controls.button("Make its moulds", "view_in_ar", "design.make", self._make, controls.USE).classes("px-2")
        self._use_row.set_visibility(False)
        self._chart = Chart("design.chart", "", "")
        self._table = NumberTable("design.table", self._choose, height="20rem")
        with ui.row().classes("gap-1") as self._files:
            self._texts = downloads(
                ("design.json", "design.json", "application/json"), ("best.toml", "design.best", "application/toml")
            )
        self._files.set_visibility(False)

    def _asked(self) -> Callable[[Progress], Found]:
        asked = scenario_with(self._session, STUDY)
        few_enough(asked, MOST_CANDIDATES, "candidates", "softnlp design")
        self._found, self._drawn = Found(asked), -1
        self._chosen = None
        self._use_row.set_visibility(False)
        self._why.set_text("")
        return work_of(self._found)

    def _watch(self) -> None:
        """Show the candidates that have come since the last look."""
        if self._found is not None and len(self._found.candidates) != self._drawn and self._found.candidates:
            self._drawn = len(self._found.candidates)
            self._show(self._found.design())

    def _finish(self, found: Found) -> None:
        if found.whole is None or not found.candidates:
            self._row.say("Stopped before the first candidate was done.")
            return
        design, total = found.whole, found.asked.step_count
        self._show(design)
        told = f"{len(design.feasible)} of {len(design.candidates)} candidates feasible."
        if len(design.candidates) < total:
            told = f"Stopped after {len(design.candidates)} of {total} candidates. {told}"
        self._row.say(f"{told} A click on a row chooses one and says why." if len(design.candidates) > 1 else told)
        self._texts["design.json"] = lambda: design_json(design)
        self._files.set_visibility(True)
        self._stage.figures["Design"] = {"": lambda: design_figure(design)}
        best = best_scenario(design, self._session.document.own())
        if best is not None:
            self._texts["best.toml"] = lambda: best
        self._choose_candidate(design, design.best or design.candidates[0])

    def _show(self, design: Design) -> None:
        columns = shown_outputs(design)
        header = ["no.", "feasible", "candidate", *(_axis(o) for o in columns)]
        self._order = in_order(design)
        rows = [[c.number, verdict(design, c), label(design, c), *(_value(c, o) for o in columns)] for c in self._order]
        failed = [not c.is_feasible for c in self._order]
        self._table.show(header, rows, "candidates.csv", csv=design_csv(design), failed=failed)
        x, y = across(design), design.task.objective
        self._chart.show(traces(design, x, y), x_label=_axis(x), y_label=_axis(y))

    def _choose(self, row: int) -> None:
        design = None if self._found is None else self._found.design()
        if design is not None and row < len(self._order):
            self._choose_candidate(design, self._order[row])

    def _choose_candidate(self, design: Design, candidate: Candidate) -> None:
        """Say what holds a candidate back or why it is not feasible, and offer it."""
        self._chosen = candidate
        self._why.set_text(why(design, candidate))
        self._use_row.set_visibility(bool(candidate.outputs))
        best = candidate is design.best
        self._use.set_text("Use this design" if best else f"Use candidate {candidate.number}")

    def _take(self) -> None:
        """Make the candidate the robot on the screen, at its pressure."""
        found, chosen = self._found, self._chosen
        if found is None or chosen is None:
            return
        session = self._session
        own = session.document.own()
        robot, material = candidate_tables(chosen, {"robot": own.get("robot", {}), "material": own.get("material", {})})
        if material != session.table("material"):
            session.change_all("material", material)
        session.change_all("robot", robot)
        task = found.design().task
        pressure = np.zeros(chosen.robot.chamber_sets)
        pressure[list(task.sets)] = chosen.outputs["pressure"]
        session.use_pressure(pressure)
        ui.notify(f"the robot is that of candidate {chosen.number}", type="positive")

    def _make(self) -> None:
        """Make the candidate the robot on the screen, and its moulds on their tab."""
        self._take()
        self._stage.asked.add("mould")
        self._stage.open_tab("mould")


def in_order(design: Design) -> list[Candidate]:
    """Return the candidates, the best first, those that are not feasible last."""
    return [*design.feasible, *(c for c in design.candidates if not c.is_feasible)]


def verdict(design: Design, candidate: Candidate) -> str:
    """Return in a word whether a candidate is feasible."""
    if candidate is design.best:
        return "best"
    if candidate.is_feasible:
        return "yes" if candidate.optimal is not False else "yes, not optimal"
    return "failed" if candidate.status == "failed" else "no"


def why(design: Design, candidate: Candidate) -> str:
    """Return what is to be known of a candidate: why it is not feasible, or what it reaches and what holds it back."""
    name = f"Candidate {candidate.number}, {label(design, candidate)}"
    if not candidate.is_feasible:
        return "\n".join([f"{name}: not feasible.", *map(sentence, candidate.reasons)])
    objective = design.task.objective
    unit = "" if objective.unit is ONE else f" {objective.unit.sign or objective.unit.label}"
    bar = candidate.outputs["pressure"] / BAR
    lines = [f"{name}: {objective.label} {candidate.objective / objective.scale:.4g}{unit} at {bar:.4g} bar."]
    lines += [f"Held back by {words}." for words in held_back(design, candidate)]
    return "\n".join([*lines, *map(sentence, candidate.warnings)])


def traces(design: Design, x: Output, y: Output) -> list[dict[str, Any]]:
    """Return the candidates as marks: crosses are not feasible, the star is the best."""
    best = design.best
    groups: Sequence[tuple[str, list[Candidate], str, dict[str, Any]]] = (
        ("not feasible", [c for c in design.candidates if not c.is_feasible], _GREY, {"symbol": "x", "size": 7}),
        ("feasible", [c for c in design.feasible if c is not best], COLOURS[0], {"size": 8}),
        ("best", [best] if best else [], COLOURS[1], {"symbol": "star", "size": 14}),
    )
    found = []
    for name, members, colour, look in groups:
        known = [c for c in members if x.name in c.outputs and y.name in c.outputs]
        if known:
            across_, up = ([c.outputs[o.name] / o.scale for c in known] for o in (x, y))
            trace = marks(across_, up, colour, name, **look)
            found.append(trace | {"text": [label(design, c) for c in known]})
    return found


def _value(candidate: Candidate, output: Output) -> float | None:
    found = candidate.outputs.get(output.name)
    return None if found is None else found / output.scale


def _axis(output: Output) -> str:
    unit = output.unit.sign or ("" if output.unit is ONE else output.unit.label)
    return f"{output.label} [{unit}]" if unit else output.label
