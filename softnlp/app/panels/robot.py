"""The robot: from the library or in every dimension, drawn as it is typed, with the rules of manufacture beside it."""

from __future__ import annotations

from math import inf
from typing import Any

from nicegui import ui

from softnlp.app.fields import number_field, say_beside, tell_problem, typed
from softnlp.app.redraw import Redraw
from softnlp.app.robot_state import (
    OWN,
    RobotState,
    changed_keys,
    effective,
    library_table,
    library_value,
    own_table,
    robot_state,
)
from softnlp.app.section_svg import section_svg
from softnlp.app.session import Session
from softnlp.app.stretch import PoseStretch
from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.model.robot import ALLOWABLE, DIMENSIONS, MINIMUM_WALL, ROBOTS, Dimension

_LABELS = {
    "outer_diameter_mm": ("Outer diameter", 0.5),
    "lumen_diameter_mm": ("Lumen diameter", 0.5),
    "chamber_circle_diameter_mm": ("Chamber circle", 0.5),
    "chamber_diameter_mm": ("Chamber bore", 0.1),
    "chamber_wall_mm": ("Chamber wall", 0.05),
    "length_mm": ("Length", 1.0),
    "chamber_sets": ("Chamber sets", 1.0),
    "chambers_per_set": ("Chambers a set", 1.0),
    "chamber_angle_deg": ("Chamber angle", 1.0),
}
"""Label and step of each dimension."""
_WALL = "minimum_wall_mm"
_RULES = {
    "wall_thickness": "Allow thin walls",
    "chamber_overlap": "Allow chambers that overlap",
    "self_intersection": "Allow answers that pass through themselves",
}
_STRETCHED = "At the stretch of the pose"
_RESTING = 1.0 + 1e-9  # below it a section looks as made


def robot_panel(session: Session) -> None:
    """Build the panel in the current slot."""
    _RobotPanel(session)


class _RobotPanel:
    """The controls of one page, and what was last said beside them."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.stretch = PoseStretch(session)
        self.before: dict[str, Any] = {}
        self.latest: str | None = None
        self.fields: dict[str, ui.number] = {}
        self.lines: dict[str, ui.label] = {}
        with ui.column().classes("w-full gap-2").props("data-testid=robot-panel") as self.root:
            self._choice()
            self._drawing()
            with ui.element("div").classes("grid grid-cols-2 gap-x-2 gap-y-2 w-full items-start"):
                self._dimensions()
            self._allowed()
        self.redraw = Redraw(self.root, self._draw)
        session.on_scenario(self._changed)
        session.on_pressure(self._pose_changed)
        self._show()
        self._draw()

    # --- controls -----------------------------------------------------------------------------------------------------

    def _choice(self) -> None:
        options = {name: name for name in ROBOTS} | {OWN: "Own dimensions"}
        self.choice = ui.select(options, label="Robot", on_change=self._chosen)
        self.choice.props("dense outlined options-dense hide-bottom-space data-testid=robot-name")
        self.choice.without_auto_validation().classes("w-full").mark("robot.name")
        self.own_name = ui.input("Name", on_change=self._named)
        self.own_name.props("dense outlined debounce=250 hide-bottom-space maxlength=200 data-testid=robot-own_name")
        self.own_name.without_auto_validation().classes("w-full").mark("robot.own_name")
        with ui.row().classes("w-full items-center justify-between no-wrap gap-2") as self.changed_row:
            self.changed_text = ui.label().classes("text-xs opacity-80").props("data-testid=robot-changed")
            reset = ui.button("Library values", icon="restart_alt", on_click=self._reset)
            reset.props("flat dense no-caps size=sm data-testid=robot-reset").mark("robot.reset")

    def _drawing(self) -> None:
        self.picture = ui.html(sanitize=False).classes("w-full").props("data-testid=robot-section")
        self.picture.mark("robot.section")
        self.caption = (
            ui.label().classes("text-xs opacity-80 w-full").props("data-testid=robot-caption").mark("robot.caption")
        )
        self.stretched = ui.switch(_STRETCHED, on_change=lambda: self._draw())
        self.stretched.props("dense size=sm data-testid=robot-stretched").classes("text-xs").mark("robot.stretched")

    def _dimensions(self) -> None:
        rows: list[list[Dimension]] = [list(DIMENSIONS[i : i + 2]) for i in range(0, len(DIMENSIONS), 2)]
        for row in rows:
            for dimension in row:
                self._field(dimension)
            if len(row) == 1:
                self._wall()
            for dimension in row:
                self._line(dimension.file_key)
        self._line(_WALL)

    def _field(self, dimension: Dimension) -> None:
        key = dimension.file_key
        label, step = _LABELS[key]
        unit = "" if dimension.scale is None else "mm" if key.endswith("_mm") else "°"

        def default() -> float | None:
            return library_value(self.session.document.table("robot"), dimension)

        field = number_field(
            self.session,
            "robot",
            key,
            label,
            unit,
            default=default,
            step=step,
            whole=dimension.scale is None,
        )
        self._keep(key, field)

    def _wall(self) -> None:
        field = number_field(
            self.session,
            "robot",
            _WALL,
            "Thinnest wall",
            "mm",
            default=lambda: MINIMUM_WALL / MILLIMETRE,
            step=0.1,
        )
        self._keep(_WALL, field)

    def _keep(self, key: str, field: ui.number) -> None:
        field.props(f"data-testid=robot-{key} no-error-icon")
        self.fields[key] = field

    def _line(self, key: str) -> None:
        line = (
            ui.label()
            .classes("col-span-2 text-xs text-red-700 dark:text-red-300 leading-tight whitespace-pre-line -mt-1")
            .mark(f"robot.{key}.said")
        )
        line.props(f"data-testid=robot-{key}-said role=alert")
        self.lines[key] = line

    def _allowed(self) -> None:
        self.rules = {}
        for rule in ALLOWABLE:
            switch = ui.switch(_RULES[rule], on_change=lambda event, rule=rule: self._allow(rule, event.value))
            switch.props(f"dense size=sm data-testid=robot-allow-{rule}").classes("text-xs")
            self.rules[rule] = switch.mark(f"robot.allow.{rule}")
        self.warning = (
            ui.label()
            .classes("text-xs text-orange-800 dark:text-orange-300 leading-tight")
            .props("data-testid=robot-warning")
        )
        self.warning.mark("robot.warning")

    # --- what a person does -------------------------------------------------------------------------------------------

    @property
    def _table(self) -> dict[str, Any]:
        return self.session.document.table("robot")

    def _chosen(self, event: Any) -> None:
        if event.value is None or event.value == self._shown_choice():
            return
        table = own_table(self._table) if event.value == OWN else library_table(self._table, event.value)
        self.session.change_all("robot", table)

    def _named(self, event: Any) -> None:
        name = typed(event.value)
        if self._shown_choice() == OWN and name != self._table.get("name", ""):
            self.session.change("robot", "name", name or None)

    def _reset(self) -> None:
        self.session.change_all("robot", library_table(self._table, self._table["name"]))

    def _allow(self, rule: str, wanted: bool) -> None:
        allowed = robot_state(self.session.document).allowed
        if wanted != (rule in allowed):
            kept = [r for r in ALLOWABLE if (r in allowed or r == rule) and (wanted or r != rule)]
            self.session.change("robot", "allow", kept or None)

    # --- what is shown ------------------------------------------------------------------------------------------------

    def _shown_choice(self) -> str:
        name = self._table.get("name")
        return name if isinstance(name, str) and name in ROBOTS else OWN

    def _changed(self) -> None:
        """Show the document; the drawing follows a moment later."""
        self._show()
        self.redraw()

    def _show(self) -> None:
        state, chosen, changed = robot_state(self.session.document), self._shown_choice(), changed_keys(self._table)
        self.choice.set_value(chosen)
        self.own_name.set_visibility(chosen == OWN)
        name = self._table.get("name", "")
        if chosen == OWN and self.own_name.value != name and isinstance(name, str):
            self.own_name.set_value(name)
        self.changed_row.set_visibility(bool(changed))
        self.changed_text.set_text(f"{len(changed)} dimension{'s' if len(changed) > 1 else ''} of {chosen} changed")
        for rule, switch in self.rules.items():
            switch.set_value(rule in state.allowed)
        self._note_latest()
        self._say(state)

    def _note_latest(self) -> None:
        """Find out which one value changed since the last time."""
        table = self._table
        values = {d.file_key: effective(table, d) for d in DIMENSIONS} | {_WALL: table.get(_WALL)}
        changed = [key for key in values if values[key] != self.before.get(key)]
        if changed:
            self.latest = changed[0] if len(changed) == 1 else None
        self.before = values

    def _say(self, state: RobotState) -> None:
        messages = state.said_beside(self.latest)
        for key, line in self.lines.items():
            message = messages.get(key, "")
            line.set_text(f"{_LABELS.get(key, ('Thinnest wall',))[0]}: {message}" if message else "")
            line.set_visibility(bool(message))
            say_beside(self.fields[key], "")  # the line has room for it, the field has not
            self.fields[key].props.set_bool("error", bool(message))
        tell_problem(self.session, self.own_name, "robot", "name")
        if messages or state.broken:  # then that is what stands below
            say_beside(self.own_name, "")
        allowed = [v.message for v in state.broken if v.rule in state.allowed]
        self.warning.set_text(" ".join(f"{m[0].upper()}{m[1:]}." for m in allowed))
        self.warning.set_visibility(bool(allowed))

    def _pose_changed(self) -> None:
        if self.stretched.value:
            self.redraw()

    def _draw(self) -> None:
        state = robot_state(self.session.document)
        stretch = self._drawn_stretch()
        self.stretched.set_text(_STRETCHED if stretch == 1.0 else f"{_STRETCHED}, {stretch:.3g}")
        if state.robot is None:
            self._no_drawing("")
            return
        try:
            drawing = section_svg(state.robot, state.red_chambers(stretch), stretch)
        except InputError as error:
            self._no_drawing(error.message)
            return
        self.picture.set_content(drawing)
        wall = (state.robot.chamber_wall + state.robot.outer_wall) / MILLIMETRE
        touch = f" · chambers touch from stretch {state.touching:.3g}" if 1.0 <= state.touching < inf else ""
        self.caption.set_text(f"Wall {wall:.3g} mm{touch}")

    def _no_drawing(self, why: str) -> None:
        self.picture.set_content('<div class="text-center text-xs opacity-70 py-8">No section to draw</div>')
        self.caption.set_text(why)

    def _drawn_stretch(self) -> float:
        value = self.stretch() if self.stretched.value else None
        return value if value is not None and value > _RESTING else 1.0
