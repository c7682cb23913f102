"""The robot: from the library or in every dimension, drawn as it is typed, with the rules of manufacture beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import Any

from nicegui import ui

from softnlp.app.asking import sentence
from softnlp.app.controls import BOX, button, dashed, number_field, say_beside, select, tell_problem, typed
from softnlp.app.inputs import Inputs, Tables
from softnlp.app.live_view import PoseStretch
from softnlp.app.mending import mending_words, range_words
from softnlp.app.section_svg import section_svg
from softnlp.app.theme import Redraw
from softnlp.base.errors import InputError, RobotError
from softnlp.base.ranges import SIZE
from softnlp.base.reading import shown
from softnlp.base.units import MILLIMETRE
from softnlp.model.fit import fit_robot
from softnlp.model.inputs import robot_table
from softnlp.model.robot import (
    ALLOWABLE,
    DIMENSIONS,
    LENGTH_LIMITS,
    MINIMUM_WALL,
    ROBOTS,
    Dimension,
    Robot,
    Violation,
    is_number,
    metres_hint,
    touching_stretch,
    violations,
)

OWN = "own robot"
"""The name that a robot of one's own starts with."""

_WALLS = ("outer_diameter_mm", "lumen_diameter_mm")
_CHAMBERS = ("chamber_circle_diameter_mm", "chamber_diameter_mm", "chamber_wall_mm")
RULE_FIELDS: Mapping[str, tuple[str, ...]] = {
    "wall_thickness": (*_WALLS, "chamber_diameter_mm", "minimum_wall_mm"),
    "chamber_overlap": (*_CHAMBERS, "chamber_angle_deg", "chamber_sets", "chambers_per_set"),
    "chambers_inside_wall": (*_CHAMBERS, *_WALLS),
}
"""The keys of [robot] that each rule of manufacture depends on, the most likely one first."""

_ROOMY = replace(ROBOTS["D25L60"], outer_diameter=LENGTH_LIMITS[1], chamber_sets=1, chambers_per_set=1)
"""A robot in which any possible dimension is possible."""
_WALL = "minimum_wall_mm"
_FIELDS = {
    "outer_diameter_mm": ("Outer diameter", 0.5),
    "lumen_diameter_mm": ("Lumen diameter", 0.5),
    "chamber_circle_diameter_mm": ("Chamber circle", 0.5),
    "chamber_diameter_mm": ("Chamber bore", 0.1),
    "chamber_wall_mm": ("Chamber wall", 0.05),
    "length_mm": ("Length", 1.0),
    "chamber_sets": ("Chamber sets", 1.0),
    "chambers_per_set": ("Chambers per set", 1.0),
    "chamber_angle_deg": ("Chamber angle", 1.0),
    _WALL: ("Thinnest wall", 0.1),
}
"""Label and step of each field, two in a row."""
_DIMENSIONS = {d.file_key: d for d in DIMENSIONS}
_RULES = {
    "wall_thickness": "Allow thin walls",
    "chamber_overlap": "Allow chambers that overlap",
    "self_intersection": "Allow answers that pass through themselves",
}
_STRETCHED = "At the stretch of the pose"
_RESTING = 1.0 + 1e-9  # below it a section looks as made
_RED, _ORANGE = "text-xs text-red-700 dark:text-red-300", "text-xs text-orange-800 dark:text-orange-300"


def robot_panel(session: Inputs) -> None:
    """Build the panel in the current slot."""
    _RobotPanel(session)


class _RobotPanel:
    """The controls of one page, and what was last said beside them."""

    def __init__(self, session: Inputs) -> None:
        self.session = session
        self.stretch = PoseStretch(session)
        self.before: dict[str, Any] = {}
        self.latest: str | None = None
        self.fields: dict[str, ui.number] = {}
        self.lines: dict[str, ui.label] = {}
        with ui.column().classes("w-full gap-2").props("data-testid=robot-panel") as self.root:
            self._choice()
            self.picture = dashed(ui.html(sanitize=False).classes("w-full max-w-80 mx-auto"), "robot.section")
            self.caption = dashed(ui.label().classes("text-xs opacity-80 w-full"), "robot.caption")
            self.stretched = self._switch(_STRETCHED, "robot.stretched", lambda _: self._draw())
            with ui.element("div").classes("grid grid-cols-2 gap-x-2 gap-y-2 w-full items-start"):
                keys = list(_FIELDS)
                for pair in zip(keys[::2], keys[1::2], strict=True):
                    for build in (self._field, self._line):
                        for key in pair:
                            build(key)
            words = "Place the chambers evenly"
            place = button(words, "blur_circular", "robot.place", self._place, test="robot-place")
            place.tooltip("Chamber circle in the middle of the wall, chambers evenly around")
            self.rules = {
                rule: self._switch(_RULES[rule], f"robot.allow.{rule}", partial(self._allow, rule))
                for rule in ALLOWABLE
            }
            self.warning = dashed(ui.label().classes(f"{_ORANGE} leading-tight"), "robot.warning")
        self.redraw = Redraw(self.root, self._draw)
        session.on_scenario(self._changed)
        session.on_pressure(lambda: self.redraw() if self.stretched.value else None)
        self._show()
        self._draw()

    # --- controls -----------------------------------------------------------------------------------------------------

    def _choice(self) -> None:
        options = {name: name for name in ROBOTS} | {OWN: "Own dimensions"}
        self.choice = select(options, "robot.name", "Robot", test="robot-name", on_change=self._chosen)
        self.own_name = dashed(ui.input("Name", on_change=self._named).without_auto_validation(), "robot.own_name")
        self.own_name.props(f"{BOX} debounce=250 maxlength=200").classes("w-full")
        with ui.row().classes("w-full items-center justify-between no-wrap gap-2") as self.changed_row:
            self.changed_text = ui.label().classes("text-xs opacity-80").props("data-testid=robot-changed")
            button("Library values", "restart_alt", "robot.reset", self._reset, test="robot-reset")

    @staticmethod
    def _switch(words: str, name: str, act: Callable[[bool], None]) -> ui.switch:
        switch = dashed(ui.switch(words, on_change=lambda event: act(event.value)), name)
        return switch.props("dense size=sm").classes("text-xs")

    def _field(self, key: str) -> None:
        label, step = _FIELDS[key]
        dimension = _DIMENSIONS.get(key)
        default = None if dimension is None else lambda: library_value(self._table, dimension)
        field = number_field(self.session, "robot", key, label, default=default, step=step, test=f"robot-{key}")
        self.fields[key] = field.props("no-error-icon")

    def _line(self, key: str) -> None:
        look = f"col-span-2 {_RED} leading-tight whitespace-pre-line -mt-1"
        self.lines[key] = dashed(ui.label().classes(look).props("role=alert"), f"robot.{key}.said")

    # --- what a person does -------------------------------------------------------------------------------------------

    @property
    def _table(self) -> dict[str, Any]:
        return self.session.table("robot")

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

    def _place(self) -> None:
        """Put the chambers where they have most room."""
        try:
            placed = placed_table(self._table)
        except RobotError as error:
            ui.notify(sentence(error.message), type="warning", multi_line=True)
            return
        self.session.change_all("robot", placed)

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
        if chosen == OWN and isinstance(name, str):
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
            line.set_text(f"{_FIELDS[key][0]}: {message}" if message else "")
            line.set_visibility(bool(message))
            say_beside(self.fields[key], "")  # the line has room for it, the field has not
            self.fields[key].props.set_bool("error", bool(message))
        tell_problem(self.session, self.own_name, "robot", "name")
        if messages or state.broken:  # then that is what stands below
            say_beside(self.own_name, "")
        allowed = [sentence(v.message) for v in state.broken if v.rule in state.allowed]
        self.warning.set_text(" ".join(allowed))
        self.warning.set_visibility(bool(allowed))

    def _draw(self) -> None:
        state = robot_state(self.session.document)
        stretch = self.stretch() if self.stretched.value else None
        if stretch is None or not stretch > _RESTING:
            stretch = 1.0
        self.stretched.set_text(_STRETCHED if stretch == 1.0 else f"{_STRETCHED}, {stretch:.3g}")
        drawing, caption = '<div class="text-center text-xs opacity-70 py-8">No section to draw</div>', ""
        if (robot := state.robot) is not None:
            try:
                drawing = section_svg(robot, state.red_chambers(stretch), stretch)
            except InputError as error:
                caption = error.message
            else:
                wall = (robot.chamber_wall + robot.outer_wall) / MILLIMETRE
                touch = f" · chambers touch from stretch {state.touching:.3g}" if 1.0 <= state.touching < inf else ""
                caption = f"Wall {wall:.3g} mm{touch}"
        ranges = range_words(state.robot, state.minimum_wall, state.allowed)
        for key, field in self.fields.items():
            field.props.set_optional("hint", ranges.get(key))
        self.picture.set_content(drawing)
        self.caption.set_text(caption)


@dataclass(frozen=True, eq=False)
class RobotState:
    """A robot as far as the document gives one.

    robot : where every dimension is a possible number, else None. said : by key of [robot], what is wrong with it.
    broken : rules of manufacture that it breaks. allowed : rules that may be broken. minimum_wall : delta_s [m].
    """

    robot: Robot | None
    said: Mapping[str, str]
    broken: tuple[Violation, ...]
    allowed: frozenset[str]
    minimum_wall: float = MINIMUM_WALL

    @property
    def touching(self) -> float:
        """Stretch above which neighbouring chambers touch; infinite where there are none."""
        try:
            return inf if self.robot is None else touching_stretch(self.robot)
        except RobotError:  # a lumen wider than the body, which is drawn all the same
            return inf

    def red_chambers(self, stretch: float = 1.0) -> frozenset[int]:
        """Return the chambers, from 0, that break a rule, whether it is allowed or not, or touch at this stretch."""
        red = frozenset(n for violation in self.broken for n in violation.chambers)
        if self.robot is None or not stretch > self.touching:
            return red
        return red | frozenset(range(self.robot.chambers))

    def said_beside(self, latest: str | None = None) -> dict[str, str]:
        """Return messages by key: of values, and one of the rules that are broken, at a key that they depend on.

        latest : the key changed last, which has the message where a rule depends on it.
        """
        messages = dict(self.said)
        broken = [violation for violation in self.broken if violation.rule not in self.allowed]
        if broken and self.robot is not None:
            fields = [key for violation in broken for key in RULE_FIELDS[violation.rule]]
            key = latest if latest in fields else fields[0]
            words = mending_words(self.robot, broken, self.minimum_wall, self.allowed)
            messages[key] = "\n".join([messages[key], words] if key in messages else [words])
        return messages


def robot_state(document: Tables) -> RobotState:
    """Read the robot of a document; nothing is raised."""
    table = document.table("robot")
    allow = table.get("allow")
    allowed = frozenset(rule for rule in ALLOWABLE if isinstance(allow, list) and rule in allow)
    values = {d.field: effective(table, d) for d in DIMENSIONS}
    said = {d.file_key: problem for d in DIMENSIONS if (problem := _problem(d, values[d.field]))}
    wall = table.get("minimum_wall_mm", MINIMUM_WALL / MILLIMETRE)
    if not is_number(wall) or not SIZE.low <= wall <= SIZE.high:
        said["minimum_wall_mm"] = f"expected a length of {SIZE.low:g} to {SIZE.high:g} mm, got {shown(wall)}"
        wall = MINIMUM_WALL / MILLIMETRE
    if any(d.file_key in said for d in DIMENSIONS):
        return RobotState(None, said, (), allowed)
    name = table.get("name")
    sizes = {d.field: values[d.field] * (d.scale or 1) for d in DIMENSIONS}
    robot = Robot(name=name if isinstance(name, str) else OWN, **sizes)
    try:
        return RobotState(robot, said, violations(robot, wall * MILLIMETRE), allowed, wall * MILLIMETRE)
    except RobotError as error:  # two dimensions that do not go together
        key = next((d.file_key for d in DIMENSIONS if d.field == error.key), "chamber_sets")
        hint = metres_hint(robot).removeprefix("; ")  # which then is what is wrong
        words = f"Expected mm: {hint}" if hint else error.message
        said = {**said, "outer_diameter_mm" if hint else key: words}
        return RobotState(robot if error.key == "lumen_diameter" else None, said, (), allowed)


def effective(table: Mapping[str, Any], dimension: Dimension) -> Any:
    """Return what holds for a dimension, in the unit of the file: as written, or of the library, or None."""
    value = table.get(dimension.file_key)
    return library_value(table, dimension) if value is None else value


def library_value(table: Mapping[str, Any], dimension: Dimension) -> float | None:
    """Return a dimension of the library's robot that the table names, in the unit of the file, or None."""
    name = table.get("name")
    if not isinstance(name, str) or name not in ROBOTS:
        return None
    value = getattr(ROBOTS[name], dimension.field)
    return int(value) if dimension.scale is None else float(f"{value / dimension.scale:.12g}")


def placed_table(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table with its chambers in the middle of the wall, evenly around; raises `RobotError` without room."""
    given = {d.field: effective(table, d) for d in DIMENSIONS}
    if not all(map(is_number, given.values())):
        raise RobotError("expected numbers for every dimension")
    sizes = {d.field: given[d.field] * (d.scale or 1) for d in DIMENSIONS}
    wall = table.get(_WALL, MINIMUM_WALL / MILLIMETRE) * MILLIMETRE
    names = ("outer_diameter", "lumen_diameter", "chamber_diameter", "chamber_sets", "chambers_per_set")
    more = {name: sizes[name] for name in ("chamber_wall", "length")}
    made = robot_table(fit_robot(*(sizes[name] for name in names), **more, minimum_wall=wall).robot)
    keys = ("chamber_circle_diameter_mm", "chamber_angle_deg")
    return {**table, **{key: made[key] for key in keys}}


def changed_keys(table: Mapping[str, Any]) -> list[str]:
    """Return the dimensions that differ from those of the library's robot."""
    return [d.file_key for d in DIMENSIONS if library_value(table, d) not in (None, effective(table, d))]


def library_table(table: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return the table with a robot of the library in place of its dimensions; rules stay."""
    return {"name": name, **_rules(table)}


def own_table(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table with every dimension in full, under a name that is not the library's."""
    full = {d.file_key: effective(table, d) for d in DIMENSIONS}
    return {"name": OWN, **{key: value for key, value in full.items() if value is not None}, **_rules(table)}


def _rules(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: table[key] for key in ("minimum_wall_mm", "allow") if key in table}


def _problem(dimension: Dimension, value: Any) -> str | None:
    """Return why a value is no possible dimension of any robot, or None."""
    if value is None:
        return "missing; a robot of your own needs every dimension"
    if not is_number(value):
        return f"expected a number, got {shown(value)}"
    scaled: Any = value if dimension.scale is None else _times(value, dimension.scale)
    if dimension.scale is None and isinstance(value, float):
        return f"expected a whole number, got {shown(value)}"
    try:
        changed: dict[str, Any] = {dimension.field: scaled}
        violations(replace(_ROOMY, **changed))
    except RobotError as error:
        return error.message if error.key in (dimension.field, "chamber_sets") else None
    return None


def _times(value: Any, scale: float) -> float:
    try:
        return float(value * scale)
    except OverflowError:  # an integer beyond the largest float
        return float("inf")
