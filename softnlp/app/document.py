"""The scenario on the screen: a TOML document that keeps its comments while controls change single keys."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import InlineTable, Table

from softnlp.app.rows import Row, in_line, inner_tables, put_rows, rows_of
from softnlp.app.time_rows import STEP, timed
from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.base.reading import one_line
from softnlp.model.robot import ROBOTS
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.identify import UNUSED_BY_TENSILE
from softnlp.scenario.read import parse_toml

START = """\
title = "D25L60, one chamber set"
study = "forward"

[robot]
name = "D25L60"

[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"

[pressure]
sequence_bar = [[0.8, 0.0, 0.0]]
"""
"""What a new tab shows."""

_NEEDED: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "workspace": {"workspace": {"levels": 8, "to_bar": 1.2}},
    "inverse": {"target": {"tip_position_mm": [[-20.0, 0.0, 62.0]]}, "bounds": {"pressure_bar": [0.0, 1.5]}},
    "dynamic": {"dynamic": {"duration_s": 0.6, "damping_s": 0.004, "lag_s": 0.03}},
    "design": {
        "choices": {"robot": {"chamber_diameter_mm": {"from": 3.0, "to": 5.0}}},
        "actuation": {"sets": [1], "pressure_bar": 0.8},
        "objective": {"maximise": OUTPUTS["bending_angle"].key},
    },
}
"""Tables without which a study cannot start, as the app first shows them."""
_TOP = ""
_DEEP, _DOTTED = ("choices", "requirements", "actuation"), ("robot", "material")  # of [choices]
MOST_SETS = 24


class Document:
    """Every table of the scenario, also those of studies that are not on the screen now.

    `text` writes the file of one study: with the tables that this study has, and with its comments.

    offered : tables that a study started with, which nobody has changed. sweeps_wall : whether a workspace pushes
    against the wall of the blocked force, which may be there for that alone.
    """

    def __init__(self, text: str = START) -> None:
        """Parse a scenario; raises `InputError` for text that is not TOML or has a table where a value belongs."""
        parse_toml(text)  # says the same of a broken file as the commands
        try:
            self._tables: Any = tomlkit.parse(text)
        except (TOMLKitError, ValueError, RecursionError) as error:
            raise InputError(f"not valid TOML: {one_line(str(error)) or 'nested too deeply'}") from None
        study = self._tables.get("study")
        self.study = str(study) if isinstance(study, str) else "forward"
        self.offered: set[str] = set()
        self.sweeps_wall = self.study == "workspace" and "contact" in self._tables

    def get(self, table: str, key: str, default: Any = None) -> Any:
        """Return a value as plain Python, or the default; the table "" is the top level."""
        found = self._tables if table == _TOP else self._tables.get(table)
        value = found.get(key) if isinstance(found, Mapping) else None
        return default if value is None else getattr(value, "unwrap", lambda: value)()

    def table(self, name: str) -> dict[str, Any]:
        """Return a whole table as plain Python; empty where there is none."""
        found = self._tables.get(name)
        return dict(found.unwrap()) if isinstance(found, Table | InlineTable) else {}

    def rows(self, name: str) -> list[Row]:
        """Return a list of tables, [[name]], as plain Python; empty where there is none."""
        return rows_of(self._tables, name)

    def replace_rows(self, name: str, rows: Sequence[Mapping[str, Any]]) -> None:
        """Put rows in place of a list of tables, or take it out for none. Comments of what stays stay."""
        put_rows(self._tables, name, rows)

    def holds(self, name: str) -> bool:
        """Whether there is a table or a list of tables of a name."""
        return name in self._tables

    def own(self) -> dict[str, Any]:
        """Return as plain Python what a person has put into the document, of every study."""
        every: dict[str, Any] = self._tables.unwrap()
        return {key: value for key, value in every.items() if key != "study" and key not in self.offered}

    def source(self) -> str:
        """Return everything that the document holds, of every study."""
        return tomlkit.dumps(self._tables)

    def files(self) -> list[str]:
        """Return the files that the scenario names, in any of its tables."""
        found = []
        for name in self._tables:
            values = self.table(name)
            found += [values["file"]] if isinstance(values.get("file"), str) else []
            found += [f for f in values.get("files", []) if isinstance(f, str)]
            inner = inner_tables(self.rows(name))
            found += [part["file"] for part in inner if isinstance(part.get("file"), str)]
        return found

    def rename_files(self, rename: Callable[[str], str]) -> None:
        """Give the files that the scenario names other names."""
        for name in self._tables:
            values = self.table(name)
            if isinstance(values.get("file"), str):
                self.set(name, "file", rename(values["file"]))
            if isinstance(values.get("files"), list):
                self.set(name, "files", [rename(f) if isinstance(f, str) else f for f in values["files"]])
            rows = self.rows(name)
            for part in inner_tables(rows):
                if isinstance(part.get("file"), str):
                    part["file"] = rename(part["file"])
            if rows:
                self.replace_rows(name, rows)

    def set(self, table: str, key: str, value: Any) -> None:
        """Set a key, or remove it for None; a table that this leaves empty is removed too."""
        self.offered.discard(table)
        if value is not None:
            if table == _TOP:
                self._tables[key] = value
                return
            if not isinstance(self._tables.get(table), Table | InlineTable):
                self._tables[table] = tomlkit.table()
            self._tables[table][key] = value
            return
        if table == _TOP:
            self._tables.pop(key, None)
        elif isinstance(self._tables.get(table), Table | InlineTable):
            self._tables[table].pop(key, None)
            if not self._tables[table]:
                self._tables.remove(table)

    def replace(self, table: str, values: Mapping[str, Any] | None) -> None:
        """Put these keys in place of those that the table has; None removes it. Comments of kept keys stay."""
        self.offered.discard(table)
        if not values:
            self._tables.pop(table, None)
            return
        if table in _DEEP:  # of which single keys cannot be replaced
            if self.table(table) != values:
                self._tables[table] = _new_table(values)
            return
        for key in self.table(table):
            if key not in values:
                self.set(table, key, None)
        for key, value in values.items():
            if self.get(table, key) != value:
                self.set(table, key, value)

    def text(self, study: str | None = None) -> str:
        """Return the scenario file of a study (of the one on the screen), without the tables that it does not use."""
        study = study or self.study
        wanted = deepcopy(self._tables)
        schema = SCHEMAS.get(study)
        if schema is not None:
            every = {name for known in SCHEMAS.values() for name in known.model_fields}
            for name in [key for key in wanted if key in every and key not in schema.model_fields]:
                wanted.remove(name)
            for name, values in _NEEDED.get(study, {}).items():
                if name not in wanted and not (name == "workspace" and "pressure" in wanted):
                    wanted[name] = _new_table(self._offer(name, values))
            own = wanted.get("workspace")
            unused: list[str] = []
            if study == "workspace" and isinstance(own, Mapping) and ("levels" in own or "samples" in own):
                unused.append("pressure")  # of another tab, where a sweep has a grid or samples of its own
            if study == "workspace" and not self.sweeps_wall:
                unused.append("contact")
            if study == "identify" and "tensile" in wanted and "measurements" not in wanted:
                unused += [*UNUSED_BY_TENSILE, "solver"]  # whose grid means nothing there
            if study == "identify" and self.study != "identify":
                unused.append("dynamic")  # of the tab Time
            if study == "identify" and ("dynamic" in unused or "dynamic" not in wanted):
                unused.append("pressure")  # of motions only
            for name in unused:
                wanted.pop(name, None)
            if not (study == "identify" and "dynamic" in wanted):
                self._time(study, wanted)
        if wanted.get("study") != study:
            wanted["study"] = study
        return tomlkit.dumps(wanted)

    def _offer(self, name: str, values: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return a table to begin with; the energy section takes lists of dimensions and no ranges."""
        if name != "choices" or self.get("corrections", "conventions") != "energy":
            return values
        return {"robot": {key: [range_["from"], range_["to"]] for key, range_ in values["robot"].items()}}

    def _time(self, study: str, wanted: Any) -> None:
        """Give the pressures of a file of a study times, or take them away."""
        before = wanted["pressure"].unwrap() if isinstance(wanted.get("pressure"), Table | InlineTable) else {}
        after = {key: value for key, value in before.items() if key != "t_s"}
        if study == "dynamic":
            duration = (
                wanted["dynamic"].unwrap().get("duration_s") if isinstance(wanted.get("dynamic"), Table) else None
            )
            long = float(duration) if isinstance(duration, int | float) and duration > 0 else 1.0
            after = timed(before, long, self.sets() or 1, step=STEP in self.offered)
        if after != before:
            wanted["pressure"] = _new_table(after)

    def start(self, study: str) -> None:
        """Turn to a study, and add the tables that it cannot do without."""
        self.study = study
        if study == "dynamic" and study not in self._tables:
            self.offered.add(STEP)
        for name, values in _NEEDED.get(study, {}).items():
            if name not in self._tables:
                self._tables[name] = _new_table(self._offer(name, values))
                self.offered.add(name)
        schema = SCHEMAS.get(study)
        if schema is not None and "pressure" in schema.model_fields and "pressure" not in self._tables:
            self._tables["pressure"] = _new_table({"sequence_bar": [[0.0]]})
            self.fit_pressures()
            self.offered.add("pressure")

    def sets(self) -> int | None:
        """Return how many chamber sets the robot has, of all segments together; None where that makes no sense."""
        robots = [row.get("robot") for row in self.rows("segment")] or [self.table("robot")]
        counts = [sets_of(robot) if isinstance(robot, Mapping) else None for robot in robots]
        total = sum(count or 0 for count in counts)
        return total if all(counts) and total <= MOST_SETS * len(counts) else None

    def fit_pressures(self) -> None:
        """Give each row of pressures as many columns as the robot has sets: zeros are added, columns left out."""
        rows, sets = self.get("pressure", "sequence_bar"), self.sets()
        if sets is None:
            return
        rows = rows if isinstance(rows, list) and all(isinstance(row, list) for row in rows) else []
        if any(len(row) != sets for row in rows):
            self.set("pressure", "sequence_bar", [(row + [0.0] * sets)[:sets] for row in rows])
        ramp = self.get("pressure", "ramp")
        if isinstance(ramp, dict) and isinstance(ramp.get("sets"), list):
            kept = [k for k in ramp["sets"] if not isinstance(k, int) or k <= sets]
            if kept != ramp["sets"]:
                self.set("pressure", "ramp", ramp | {"sets": kept or [1]})


def sets_of(robot: Mapping[str, Any]) -> int | None:
    """Return the chamber sets of a table [robot], None where that is no possible number."""
    name = robot.get("name")
    library = ROBOTS.get(name) if isinstance(name, str) else None
    sets = robot.get("chamber_sets") or (None if library is None else library.chamber_sets)
    return sets if isinstance(sets, int) and not isinstance(sets, bool) and 1 <= sets <= MOST_SETS else None


def _new_table(values: Mapping[str, Any]) -> Table:
    """Return a table as a person would write it: inner tables by dotted keys, innermost ones in a line."""
    table = tomlkit.table()
    for name, value in values.items():
        if isinstance(value, Mapping) and name in _DOTTED:
            for key, inner in value.items():
                table.append(tomlkit.key([name, key]), in_line(inner))
        else:
            table[name] = in_line(value)
    return table
