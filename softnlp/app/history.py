"""What happened on the screen: states of a tab in order, what changed between them, and the way back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from softnlp.base.reading import one_line
from softnlp.base.units import BAR
from softnlp.model.inputs import robot_table
from softnlp.model.robot import ROBOTS

MOST_STATES = 200
_FEW = 3  # values of a table that are told one by one
_NOTHING: Mapping[str, Any] = {}


@dataclass(frozen=True, eq=False)
class State:
    """What is on the screen at one time.

    own : the tables of the document, of every study. pressure : (sets,) shown [Pa]. name : of the file. kept, files :
    as `Session.kept` and `kept_files` give them. what : how it came about, in words.
    """

    own: Mapping[str, Any]
    pressure: tuple[float, ...]
    name: str
    kept: str
    files: str
    what: str = "opened"

    def is_same(self, other: State) -> bool:
        """Whether both show the same."""
        return (self.own, self.pressure, self.name) == (other.own, other.pressure, other.name)


class History:
    """The states of a tab, oldest first; after a step back, a new state takes the place of those that were undone."""

    def __init__(self, first: State) -> None:
        """Begin with the state of an opened page."""
        self._states = [first]
        self._at = 0

    @property
    def states(self) -> Sequence[State]:
        """All states, oldest first."""
        return tuple(self._states)

    @property
    def at(self) -> int:
        """The place of the present one."""
        return self._at

    @property
    def back(self) -> State | None:
        """The state that a step back shows; None at the first."""
        return self._states[self._at - 1] if self._at > 0 else None

    @property
    def forth(self) -> State | None:
        """The state that a step forth shows; None at the last."""
        return self._states[self._at + 1] if self._at + 1 < len(self._states) else None

    def note(self, state: State) -> bool:
        """Take in what the screen shows now; return whether that is new. A look at another tab is not."""
        present = self._states[self._at]
        if state.is_same(present):
            self._states[self._at] = replace(state, what=present.what)  # the tab looked at is another
            return False
        words = f"opened {state.name}" if state.name != present.name else "; ".join(changes(present, state))
        self._states[self._at + 1 :] = [replace(state, what=words)]
        del self._states[:-MOST_STATES]
        self._at = len(self._states) - 1
        return True

    def go(self, place: int) -> State:
        """Make one of the states the present one and return it."""
        self._at = min(max(place, 0), len(self._states) - 1)
        return self._states[self._at]


def changes(before: State, after: State) -> list[str]:
    """Return in words what differs between two states."""
    found = list(_tables(before.own, after.own))
    found += _pressures(before.pressure, after.pressure)
    return found or ["pressures of the file"]


def _tables(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[str]:
    for name in dict.fromkeys((*before, *after)):
        old, new = before.get(name), after.get(name)
        if old == new:
            continue
        if name == "pressure":
            yield "pressures of the file"
        elif _are_rows(old) and _are_rows(new):
            yield from _rows(name, old or [], new or [])
        elif not isinstance(old or {}, Mapping) or not isinstance(new or {}, Mapping):
            yield f"{_words(name)} {_value(old)} → {_value(new)}"
        else:
            whole = _whole_robot if name == "robot" else dict
            yield from _table(name, dict(_flat(whole(old or _NOTHING))), dict(_flat(whole(new or _NOTHING))))


def _are_rows(value: Any) -> bool:
    """Whether a value is a list of tables, or none."""
    return value is None or (isinstance(value, list) and all(isinstance(row, Mapping) for row in value))


def _rows(name: str, old: Sequence[Mapping[str, Any]], new: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield what differs in a list of tables: rows that came and went, else what changed in each."""
    if len(old) == len(new):
        for k, (before, after) in enumerate(zip(old, new, strict=True)):
            yield from _table(f"{name} {k + 1}", dict(_flat(before)), dict(_flat(after)))
        return
    short, long = sorted((old, new), key=len)
    places = [k for k, row in enumerate(long) if row not in short][: len(long) - len(short)]
    for k in places or range(len(short), len(long)):
        yield f"{name} {k + 1} {'added' if len(new) > len(old) else 'taken away'}"


def _whole_robot(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return [robot] with the dimensions that its name stands for."""
    name = table.get("name")
    return {**(robot_table(ROBOTS[name]) if isinstance(name, str) and name in ROBOTS else {}), **table}


def _table(name: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    """Yield what differs in a table; another robot or silicone by its name alone."""
    changed = [key for key in dict.fromkeys((*old, *new)) if old.get(key) != new.get(key)]
    head = name.replace("_", " ")
    if "name" in changed:
        yield f"{head} {_value(old.get('name'))} → {_value(new.get('name'))}"
    elif len(changed) > _FEW:
        yield f"{head}: {len(changed)} values"
    else:
        for key in changed:
            unit = _unit(key)
            yield f"{head}: {_words(key)} {_value(old.get(key))} → {_value(new.get(key))}{unit}"


def _pressures(before: Sequence[float], after: Sequence[float]) -> Iterator[str]:
    if len(before) != len(after):
        return
    moved = [k for k in range(len(after)) if before[k] != after[k]]
    if len(moved) > _FEW:
        yield "pressures"
        return
    for k in moved:
        yield f"set {k + 1}: {before[k] / BAR:.4g} → {after[k] / BAR:.4g} bar"


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


_UNITS = {"_mm": "mm", "_bar": "bar", "_deg": "°", "_N": "N", "_Nmm": "N mm", "_MPa": "MPa"}


def _unit(key: str) -> str:
    return next((f" {unit}" for suffix, unit in _UNITS.items() if key.endswith(suffix)), "")


def _words(key: str) -> str:
    for suffix in _UNITS:
        key = key.removesuffix(suffix) if key.endswith(suffix) else key
    return key.replace("_", " ").replace(".", " ")


def _value(value: Any) -> str:
    if value is None:
        return "default"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return one_line("[" + ", ".join(map(_value, value)) + "]", 40)
    return one_line(str(value), 40)
