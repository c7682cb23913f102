"""The identification tab: constants from measurements of robots, or a law from a tensile test."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import isfinite
from typing import Any

import numpy as np
from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress
from softnlp.app.conventions import is_energy
from softnlp.app.examples import empty_state
from softnlp.app.parts import Chart, NumberTable, csv_drop, downloads, marks, study_row
from softnlp.app.session import Session, Stage
from softnlp.app.tabs.importing import import_part, use_tensile
from softnlp.app.tabs.tensile import GREY, asked_with, from_files, tensile_part
from softnlp.base.columns import OUTPUTS
from softnlp.base.csv_columns import read_columns
from softnlp.base.errors import InputError, of_table
from softnlp.base.status import Status
from softnlp.figures.style import colour
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material
from softnlp.results.identify_document import identified_text, robot_table_text, scenario_tables
from softnlp.scenario.energy import NOT_OF_ENERGY
from softnlp.scenario.identify import run_robots
from softnlp.scenario.read import Scenario
from softnlp.studies.identified import COEFFICIENTS, Identified, file_name, free_constants
from softnlp.studies.measurements import OBSERVABLES, RobotTask, column_slice

Table = dict[str, Any]
Rows = list[list[Any]]

_GUESS = 40  # evaluations; most identifications need fewer
LETTERS: Mapping[str, str] = {
    "k_e": "k_e, stiffening in elongation",
    "k_b": "k_b, stiffening in bending",
    "k_a": "k_a, correction of the area",
    "k_i": "k_i, correction of the inertia",
    "phi": "phi, part of the liner that pressure acts on",
    "k_c": "k_c, chamber reaction at a wall",
    "c_m": "c_m, factor on the silicone's stress of the energy section",
}
_SIGMAS = {
    key: f"{OUTPUTS[name].label.capitalize()} [{unit}]"
    for name in OBSERVABLES
    for key, unit in (
        (OUTPUTS[name].key, OUTPUTS[name].unit.label),
        *([(f"{name}_percent", "%")] if name not in ("tip_position", "orientation") else []),
    )
}
_MEASURED = [OUTPUTS[e].measured for name, entries in OBSERVABLES.items() for e in entries if name != "orientation"]


def identify_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    session = stage.session
    aside: dict[str, Table] = {}

    def kind() -> str:
        return "tensile" if session.table("tensile") and not session.table("measurements") else "measurements"

    def choose(chosen: str | None) -> None:
        """Show a kind, with its table where that was put aside; without one the scenario stays as it is."""
        if chosen is None:
            return
        for name, box in boxes.items():
            box.set_visibility(name == chosen)
        if chosen in aside and not session.table(chosen):
            session.change_all(chosen, aside[chosen])

    def settle() -> None:
        """Put the table of the other kind aside, now that the chosen one has a table."""
        chosen = str(kinds.value)
        other = "tensile" if chosen == "measurements" else "measurements"
        if session.table(chosen) and session.table(other):
            aside[other] = session.table(other)
            session.change_all(other, None)

    def use_tips(name: str, content: bytes) -> None:
        kinds.set_value("measurements")
        robots.take(name, content)

    def use_test(name: str, content: bytes) -> None:
        kinds.set_value("tensile")
        use_tensile(session, name, content)

    with ui.column().classes("w-full gap-3 pt-2"):
        empty_state(session, "identify")
        import_part(session, {"tips": use_tips, "tensile": use_test})
        kinds = controls.toggle({"measurements": "Robots", "tensile": "Tensile test"}, "identify.kind", kind())
        boxes: dict[str, ui.column] = {}
        with ui.column().classes("w-full gap-3") as boxes["measurements"]:
            robots = _Measurements(session)
            ui.separator()
            _Identification(session)
        with ui.column().classes("w-full gap-3") as boxes["tensile"]:
            tensile_part(session)
    for name, box in boxes.items():
        box.set_visibility(name == kind())
    session.on_scenario(settle)
    kinds.on_value_change(lambda event: choose(event.value))


class _Measurements:
    """[measurements] and [sigma]: the file, the free constants and their bounds, the standard deviations."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._built: Any = None
        self._fields: dict[tuple[str, int], ui.number] = {}
        controls.heading("Measurements of robots")
        self._file = ui.label("").classes("text-sm").mark("measurements.file")
        csv_drop("measurements.drop", "Drop a CSV of measurements", self.take)
        ui.label(
            f"Columns p1_bar, p2_bar, … and any of {', '.join(_MEASURED)}; qx, qy, qz, qw of the tip's sensor, robot, "
            "weight and sigma_… if there are."
        ).classes(controls.HINT)
        with ui.column().classes("w-full gap-2") as self._more:
            self._free = controls.select({}, "measurements.free", "Free constants", multiple=True, look="use-chips")
            self._bounds = ui.column().classes("w-full gap-2")
            with ui.expansion("Standard deviations").classes("w-full").props("dense data-testid=sigma"):
                ui.label("One of each kind; without any, 1 % of each number.").classes(controls.HINT)
                with ui.grid(columns=2).classes("w-full gap-2"):
                    for key, label in _SIGMAS.items():
                        controls.number_field(session, "sigma", key, label, "")
        self._problem = controls.problem_label("measurements.problem")
        session.follow(self._refresh)
        self._free.on_value_change(lambda event: self._chosen(event.value or []))

    def _table(self) -> Table:
        return self._session.table("measurements")

    def _material(self) -> Material | None:
        scenario = self._session.scenario
        return None if scenario is None else scenario.material

    def _freed(self) -> list[str]:
        """Return the free constants by their names, where the file may have keys."""
        material = self._material()
        by_key = {} if material is None else {c.file_key: c.name for c in material.law.constants}
        return [by_key.get(name, name) for name in self._table().get("free", [])]

    def _refresh(self) -> None:
        table, material = self._table(), self._material()
        self._file.set_text(from_files(table))
        self._more.set_visibility(bool(table))
        choices = free_choices(material, is_energy(self._session.document))
        self._free.set_options(choices, value=[name for name in self._freed() if name in choices])
        if material is not None:
            self._show_bounds(bounds_of(table, material))
        words = controls.problem_of(self._session, "measurements", "sigma", "material", "contact")
        self._problem.set_text(words if table else "")

    def _show_bounds(self, bounds: dict[str, tuple[float | None, float | None, str]]) -> None:
        """Build the fields of each free constant where those changed, and fill them."""
        if self._built != tuple(bounds):
            self._built = tuple(bounds)
            self._bounds.clear()
            self._fields.clear()
            with self._bounds:
                for name, (*pair, unit) in bounds.items():
                    with ui.row().classes("w-full items-center gap-2 no-wrap"):
                        ui.label(name).classes("w-16 text-sm shrink-0")
                        for at, (label, value) in enumerate(zip(("from", "to"), pair, strict=True)):
                            look = 'debounce=400 placeholder="open" stack-label'
                            field = controls.number(label, f"measurements.bounds.{name}.{at}", unit, look, value=value)
                            field.on_value_change(partial(self._bounded, name))
                            self._fields[name, at] = field.classes("grow min-w-0")
        for (name, at), field in self._fields.items():
            bound = bounds[name][:2][at]
            if bound is not None:
                field.set_value(bound)

    def _bounded(self, name: str) -> None:
        """Write the bounds of a constant once both are there."""
        pair = [self._fields[name, at].value for at in (0, 1) if (name, at) in self._fields]
        if len(pair) == 2 and all(value is not None and isfinite(value) for value in pair):
            material = self._material()
            if material is not None and bounds_of(self._table(), material).get(name, ())[:2] != tuple(pair):
                self._session.put("measurements", with_bound(self._table(), name, pair))

    def _chosen(self, free: list[str]) -> None:
        table = self._table()
        if table and free and self._freed() != free:
            self._session.put("measurements", with_free(table, free))

    def take(self, name: str, content: bytes) -> None:
        """Take a file of measurements; one that cannot be read leaves the scenario as it was."""
        session, table = self._session, self._table()
        with of_table(""):
            header = read_columns(session.folder, session.keep(name, content)).header
        others = {key: value for key, value in table.items() if key != "files"}
        others["free"] = table.get("free") or (["c_m"] if is_energy(session.document) else first_free(header))

        def refused(problem: InputError) -> bool:
            return (problem.table or "").split(".")[0] in ("measurements", "robots")

        session.take_file("measurements", name, content, others, refused)


class _Identification:
    """The search for the constants, and what it found."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._found: Identified | None = None
        self._row = study_row("identify", "Identify", self._asked, self._finish)
        with ui.column().classes("w-full gap-2") as self._box:
            self._constants = NumberTable("identify.constants")
            with ui.row().classes("gap-1 items-center"):
                controls.use_button("Use these constants", "identify.use", self._use)
                self._texts = downloads(
                    ("identified.toml", "identify.toml", "text/plain"), ("table.csv", "identify.csv", "text/csv")
                )
            self._misfits = NumberTable("identify.misfits")
            self._what = controls.select({}, "identify.observable", on_change=self._draw)
            self._chart = Chart("identify.chart", "measured", "model", height="18rem")
            self._warnings = ui.label("").classes("text-sm whitespace-pre-line break-words").mark("identify.warnings")
        self._box.set_visibility(False)

    def _asked(self) -> Callable[[Progress], tuple[Scenario, RobotTask, Identified]]:
        if self._session.table("dynamic"):
            raise InputError("This page fits poses, `softnlp identify` fits motions; remove [dynamic] to fit poses.")
        named = bool(self._session.table("measurements"))
        asked, task = asked_with(self._session, RobotTask, "measurements", named)

        def work(progress: Progress) -> tuple[Scenario, RobotTask, Identified]:
            def tell(evaluations: int, error: float) -> None:
                words = f"{evaluations} evaluations, root mean square of the residuals {error:.4g} sigma"
                progress(min(evaluations, _GUESS - 1), _GUESS, words)

            return asked, task, run_robots(asked, tell)

        return work

    def _finish(self, done: tuple[Scenario, RobotTask, Identified]) -> None:
        asked, task, found = done
        self._found = found
        if found.status is not Status.SOLVED:
            self._box.set_visibility(False)
            self._row.warn(f"{found.message}.")
            return
        self._row.say(f"Found after {found.evaluations} evaluations: {found.message}.")
        self._texts["identified.toml"] = lambda: identified_text(asked, found)
        self._texts["table.csv"] = lambda: robot_table_text(task, found)
        self._constants.show(*constant_rows(found), "constants.csv")
        self._misfits.show(*misfit_rows(found), "misfit.csv")
        choices = {key: OUTPUTS[key].axis for key in found.errors(False)}
        self._what.set_options(choices, value=next(iter(choices), None))
        self._warnings.set_text("\n".join(found.warnings))
        self._box.set_visibility(True)
        self._draw()

    def _draw(self) -> None:
        if self._found is not None and self._what.value in OBSERVABLES:
            key = str(self._what.value)
            label = OUTPUTS[key].axis
            self._chart.show(compared(self._found, key), x_label=f"measured {label}", y_label=f"model {label}")

    def _use(self) -> None:
        """Write the constants into the scenario."""
        if self._found is None:
            return
        document = self._session.document
        for table, values in scenario_tables(self._found).items():
            document.replace(table, values if table == "material" else {**document.table(table), **values})
        self._session.reread()
        ui.notify("The scenario has these constants now", position="bottom-right", timeout=2000)


def free_choices(material: Material | None, energy: bool = False) -> dict[str, str]:
    """Return the constants that may be free, by name, with what they are. energy : by the energy section."""
    own = () if material is None else material.law.constants
    letters = {name: words for name, words in LETTERS.items() if (name in NOT_OF_ENERGY) != energy}
    return {**letters, **{c.name: f"{c.name} of {material.law.name}" for c in own if material is not None}}


def first_free(header: Sequence[str]) -> list[str]:
    """Return which constants to free at first, by what a file has measured."""
    *poses, force = (name in header for name in _MEASURED)
    return ["k_e", "k_b"] * any(poses) + ["k_c"] * force or ["k_e", "k_b"]


def with_free(table: Table, free: Sequence[str]) -> Table:
    """Return the table with other free constants, and the bounds of those only."""
    bounds = {name: pair for name, pair in dict(table.get("bounds", {})).items() if name in free}
    kept = {key: value for key, value in table.items() if key not in ("free", "bounds")}
    return {**kept, "free": list(free), **({"bounds": bounds} if bounds else {})}


def with_bound(table: Table, name: str, pair: Sequence[float]) -> Table:
    """Return the table with the bounds of a constant, in the unit of files."""
    return {**table, "bounds": {**dict(table.get("bounds", {})), name: list(pair)}}


def bounds_of(table: Mapping[str, Any], material: Material) -> dict[str, tuple[float | None, float | None, str]]:
    """Return the bounds of each free constant in the unit of files, None where it has none, and that unit."""
    given = dict(table.get("bounds", {}))
    known = {c.name: c for c in material.law.constants} | {c.file_key: c for c in material.law.constants}
    found: dict[str, tuple[float | None, float | None, str]] = {}
    for name in table.get("free", []):
        constant = None if name in COEFFICIENTS else known.get(name)
        if constant is None and name not in COEFFICIENTS:
            continue
        unit = "MPa" if constant is not None and constant.file_key.endswith("_MPa") else ""
        pair = given.get(name)
        if not (isinstance(pair, list) and len(pair) == 2):
            plain = free_constants([constant.name if constant else name], material, Coefficients())
            pair = [float(plain.lower[0]), float(plain.upper[0])]  # a silicone's constants have none of their own
        low, high = (float(x) if isfinite(x) else None for x in pair)
        found[name] = (low, high, unit)
    return found


def constant_rows(found: Identified) -> tuple[list[str], Rows]:
    """Return header and rows of the constants found, in the unit of files."""
    rows: Rows = []
    for k, name in enumerate(found.free.names):
        key, scale = file_name(name, found.material)
        error = float(found.uncertainty.standard_errors[k] / scale)
        row = [float(found.free.start[k] / scale), float(found.constants[k] / scale), error]
        rows.append([key, *row, found.notes[name]])
    return ["constant", "start", "found", "standard error", "note"], rows


def misfit_rows(found: Identified) -> tuple[list[str], Rows]:
    """Return header and rows of how far the model is from each observable, before and after."""
    before, after = found.errors(False), found.errors()
    rows: Rows = []
    for key in after:
        scale = OUTPUTS[key].scale
        row = [OUTPUTS[key].axis, after[key].count, *(m[key].rmse / scale for m in (before, after))]
        rows.append([*row, *(m[key].mape for m in (before, after))])
    return ["observable", "numbers", "rms before", "rms after", "mean before [%]", "mean after [%]"], rows


def compared(found: Identified, observable: str) -> list[dict[str, Any]]:
    """Return the traces of model against measurement: grey before, in colour after, a marker a robot."""
    scale, where = OUTPUTS[observable].scale, column_slice(observable)
    traces: list[dict[str, Any]] = []
    ends: list[float] = []
    for k, data in enumerate(found.data):
        measured = (data.of(observable) / scale).ravel()
        known = np.isfinite(measured)
        if not known.any():
            continue
        for after, values, paint in ((False, found.before, GREY), (True, found.after, colour(k))):
            model = (values[k][:, where] / scale).ravel()[known]
            ends += [float(v) for v in (*measured[known], *model) if isfinite(v)]
            named = after or not traces
            name = data.label if after else "before" if named else ""
            trace = marks(measured[known], model, paint, name, size=8, symbol=k % 8 + (0 if after else 100))
            traces.append(trace | {"showlegend": named})
    if ends:
        line = {"color": GREY, "width": 1, "dash": "dot"}
        same = [min(ends), max(ends)]
        traces.append({"type": "scatter", "mode": "lines", "x": same, "y": same, "line": line, "showlegend": False})
    return traces
