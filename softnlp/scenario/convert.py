"""A scenario of one study made into one of another: what both use stays, with its comments."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import AoT, InlineTable, Table

from softnlp.base.errors import InputError
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.robot import robot as library_robot
from softnlp.model.segments import SegmentedRobot
from softnlp.scenario.check import SCHEMAS, schema_of
from softnlp.scenario.read import load_scenario, scenario_from_text
from softnlp.scenario.schema import ForwardFile
from softnlp.scenario.segments import OF_SEGMENTS
from softnlp.scenario.template import ROBOT, begun, example_table


@dataclass(frozen=True)
class Converted:
    """A scenario of another study.

    text : the file. dropped : what that study does not use. missing : tables that it needs, filled by an example.
    """

    text: str
    dropped: tuple[str, ...]
    missing: tuple[str, ...]


def converted(source: Path, study: str, target: Path, data: str) -> Converted:
    """Return a scenario as one of another study; data : the file that an example of `identify` reads.

    Raises
    ------
    InputError
        As `load_scenario`, where it is of that study already, and for what cannot be left out.
    """
    asked = load_scenario(source)
    if asked.study == study:
        raise InputError(f"it is of study {study!r} already", source=str(source), key="study")
    document = tomlkit.parse(asked.text)
    segments = study in OF_SEGMENTS
    fields = (schema_of(document, study) if segments else SCHEMAS[study]).model_fields
    own = isinstance(asked.robot, SegmentedRobot | OutlinedRobot)
    made = asked.robot if segments or not own else library_robot(ROBOT)
    silicone = asked.material if made is asked.robot else None
    values = begun(study, made, data, silicone)
    of_motions = ("dynamic", "pressure") if study == "identify" else ()
    dropped = [name for name in document if name not in fields or name in of_motions]
    for name in dropped:
        document.remove(name)
    dropped = [f"[{name}]" for name in dropped]
    document["study"] = study

    def needed() -> list[str]:
        absent = (name for name in values if name not in document)
        known = (name for name in absent if name in fields)
        return [name for name in known if name not in ForwardFile.model_fields or fields[name].is_required()]

    missing = needed() if any(f.is_required() and name not in document for name, f in fields.items()) else []

    def text() -> str:
        parts = [tomlkit.dumps(document).rstrip()]
        for name in missing:
            note = f"# [{name}] was not in {source.name}: this is an example, put your own in its place."
            parts.append(f"{note}\n{example_table(study, name, values, made)}")
        return "\n\n".join(parts) + "\n"

    while (error := _mistake(text(), source, missing)) is not None:
        table, key = error.table or "", error.key or ""
        found = document.get(table)
        if isinstance(found, Table | InlineTable) and key in found:
            found.remove(key)
            dropped.append(f"[{table}] {key}")
        elif table in values and table not in document and table not in missing:
            missing = [name for name in values if name in (*missing, *needed(), table)]
        elif table in values and table in document and table not in missing:  # it says something else there
            document.remove(table)
            dropped.append(f"[{table}]")
            missing = [name for name in values if name in (*missing, *needed(), table)]
        else:
            raise error
    _move_files(document, source.parent, target.parent)
    return Converted(text(), tuple(dropped), tuple(f"[{name}]" for name in missing))


def _mistake(text: str, path: Path, filled: list[str]) -> InputError | None:
    """Return the first mistake of a scenario outside the tables of an example, whose data may not be there yet."""
    try:
        scenario_from_text(text, path)
    except InputError as error:
        every = error.every or (error,)
        return next((one for one in every if one.table not in filled or "no such file" not in one.message), None)
    return None


def _move_files(table: Any, source: Path, target: Path) -> None:
    """Name the files of a scenario, in any of its tables, from another folder."""
    if source.resolve() == target.resolve():
        return

    def moved(name: Any) -> Any:
        return Path(os.path.relpath(source / name, target)).as_posix() if isinstance(name, str) else name

    for key, value in table.items():
        if key == "file":
            table[key] = moved(value)
        elif key == "files" and isinstance(value, list):
            table[key] = [moved(name) for name in value]
        else:
            for inner in value if isinstance(value, AoT) else (value,):
                if isinstance(inner, Table | InlineTable):
                    _move_files(inner, source, target)
