"""A laboratory's files on the page: how they were read and why, or what has to be known before they can be."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from softnlp.app.parts import line
from softnlp.app.taken import checked_content, plain_name
from softnlp.base.columns import BAR_, MM, N, S
from softnlp.base.errors import InputError
from softnlp.base.reading import LONGEST_NAME, one_line
from softnlp.figures.style import colour
from softnlp.laboratory.choices import Choices, settings_from_words
from softnlp.laboratory.formats import read_tables
from softnlp.laboratory.imported import Imported
from softnlp.laboratory.importing import import_files, kind_of
from softnlp.laboratory.tips import FRAMES

Rows = list[list[Any]]

SHOWN = 20  # rows of a table on the page
MOST_FILES = 8
GREY = "#909090"
KINDS: Mapping[str, str] = {
    "": "What the columns' names say",
    "tensile": "Tensile test",
    "tips": "Tips of a robot",
    "pressure": "Pressures",
    "force": "Forces",
}
_OF_FRAME = ("frame", "base_sensor_mm", "rotation_world_from_base_quat_xyzw", "translation_mm")
_LABELS = {"tips": f"tip [{MM.sign}]", "pressure": f"gauge pressure [{BAR_.sign}]", "force": f"force [{N.sign}]"}
_DRAWN = {"tips": r"[xyz]_mm", "pressure": r"p\d+_bar", "force": r"f.*_N"}


class Setting(NamedTuple):
    """A setting of an import that has a field of its own. words : that it may be, none for what is typed."""

    key: str
    label: str
    words: tuple[str, ...] = ()


SETTINGS: Mapping[str, tuple[Setting, ...]] = {
    "tensile": (
        Setting("gauge_length_mm", "Gauge length [mm]"),
        Setting("area_mm2", "Area [mm²]"),
        Setting("width_mm", "Width [mm]"),
        Setting("thickness_mm", "Thickness [mm]"),
        Setting("diameter_mm", "Diameter [mm]"),
        Setting("cycle", "Cycle: first loading, 2, unloading, all"),
        Setting("stretch", "Stretch range, as [1, 2]"),
        Setting("extension", "Stretch from", ("stretch", "strain", "displacement", "true strain")),
        Setting("stress", "Stress from", ("engineering", "true", "force")),
        Setting("tare", "Tare: start, or a force [N]"),
        Setting("preload_N", "Preload [N]"),
        Setting("toe", "Toe: auto, or a stretch"),
        Setting("unit.displacement", "Unit of displacement"),
        Setting("unit.strain", "Unit of strain"),
        Setting("unit.stress", "Unit of stress"),
        Setting("unit.force", "Unit of force"),
    ),
    "tips": (
        Setting("frame", "Frame", FRAMES),
        Setting("base_sensor_mm", "Base sensor at, as [x, y, z] [mm]"),
        Setting("tip", "Sensor of the tip"),
        Setting("base", "Sensor of the base"),
        Setting("tip_offset_mm", "Sensor on the tip at [x, y, z] [mm]"),
        Setting("quaternion", "Order of the quaternion", ("wxyz", "xyzw")),
        Setting("up", "Up in the tracker's frame", ("z", "y", "x", "-z", "-y", "-x")),
        Setting("length_mm", "Length of the robot [mm]"),
        Setting("rows", "Rows", ("plateaus", "samples")),
        Setting("lag_s", "Lag of the pressures [s]"),
        Setting("unit.position", "Unit of position"),
        Setting("unit.pressure", "Unit of pressure"),
    ),
    "pressure": (
        Setting("sets", 'Columns of the sets, as ["a", "b"]'),
        Setting("unit.pressure", "Unit of pressure"),
        Setting("zero", "Zero: absolute, gauge, tare, or [bar]"),
        Setting("atmosphere_bar", "Pressure of the air [bar]"),
        Setting("calibration", "Calibration: [zero, bar a unit]"),
        Setting("deadband_bar", "Deadband [bar]"),
        Setting("rate_Hz", "Samples a second"),
    ),
    "force": (
        Setting("unit.force", "Unit of force"),
        Setting("counts_per_N", "Counts a newton"),
        Setting("tare_N", "Bias, as [x, y, z] [N]"),
        Setting("lag_s", "Lag of the pressures [s]"),
    ),
}


@dataclass(frozen=True)
class Asked:
    """What is to be read. folder : of the files. kind : None for what the columns say. settings : as `import_files`."""

    folder: Path
    files: tuple[str, ...]
    kind: str | None
    settings: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Reading:
    """What was read, or what it lacks.

    kind : "" where nothing tells it. header, rows : the first of the import, or of the file as it is without one.
    imported, csv : None and "" where something has to be known. problem : what, as `softnlp import` says it.
    """

    kind: str
    header: Sequence[str]
    rows: Rows
    imported: Imported | None = None
    csv: str = ""
    problem: str = ""


def placed(folder: Path, contents: Iterable[tuple[str, bytes]]) -> tuple[str, ...]:
    """Put files into a new folder, and return their names without folders.

    Raises
    ------
    InputError
        For files that are too large or too many, and for the recipe of an import.
    """
    named = {plain_name(name): checked_content(name, content) for name, content in contents}
    if not 1 <= len(named) <= MOST_FILES:
        raise InputError(f"expected 1 to {MOST_FILES} files of one test, got {len(named)}")
    folder.mkdir(parents=True)
    for name, content in named.items():
        (folder / name).write_bytes(content)
    return tuple(named)


def settings_of(typed: Mapping[str, str], chosen: Mapping[str, str], further: str) -> dict[str, Any]:
    """Return the settings of the fields. further : a KEY=VALUE a line, also as messages show it, after --set.

    Raises
    ------
    InputError
        For a line without "=".
    """
    lines = [text.strip().removeprefix("--set").strip() for text in further.splitlines()]
    words = [re.sub(r"^([^=]+)='(.*)'$", r"\1=\2", text) for text in lines if text]  # quotes for a shell
    words += [f"{key}={text.strip()}" for key, text in typed.items() if text.strip()]
    return {**settings_from_words(words), **{key: word for key, word in chosen.items() if word}}


def read(asked: Asked) -> Reading:
    """Import files; what they lack is told beside the table as it stands in them."""
    try:
        imported = import_files(asked.files, asked.kind, asked.settings, asked.folder)
    except InputError as error:
        return _as_it_is(asked, str(error))
    units: Any = imported.document()["units"]
    header = [name if unit == "1" else f"{name.removesuffix(f'_{unit}')} [{unit}]" for name, unit in units.items()]
    rows = [[float(column[k]) for column in imported.columns.values()] for k in range(min(SHOWN, imported.rows))]
    return Reading(imported.kind, header, rows, imported, imported.csv())


def _as_it_is(asked: Asked, problem: str) -> Reading:
    """Return the table of the first file with the names and units that stand there, as far as it can be read."""
    choices = Choices(asked.settings)
    try:
        tables = [table for file in asked.files for table in read_tables(asked.folder, file, choices)]
    except InputError:
        return Reading(asked.kind or "", [], [], problem=problem)
    try:
        kind = asked.kind or kind_of(tables, choices)
    except InputError:
        kind = ""
    table = tables[0]
    header = [n if u is None else f"{n} [{u.name}]" for n, u in zip(table.names, table.units, strict=True)]
    rows = [[_cell(column[k]) for column in table.columns] for k in range(min(SHOWN, table.rows))]
    return Reading(kind, header, rows, problem=problem)


def _cell(value: Any) -> Any:
    return one_line(value, LONGEST_NAME) if isinstance(value, str) else float(value)


def setting_rows(imported: Imported) -> tuple[list[str], Rows]:
    """Return header and rows of what decided: each setting, and why it was guessed where nobody gave it."""
    choices = imported.choices
    reasons = dict.fromkeys(choices.given, "given") | {guess.key: guess.reason for guess in choices.guesses}
    rows = [[key, str(value), reasons.get(key, "as the file has it")] for key, value in choices.used.items()]
    return ["setting", "value", "why"], rows


def check_rows(imported: Imported) -> tuple[list[str], Rows]:
    """Return header and rows of the checks, those with something to say first."""
    checks = sorted(imported.checks, key=lambda check: check.verdict == "passed")
    rows = [[c.name, f"{c.value:.4g} {c.unit}".strip(), c.verdict] for c in checks]
    return ["check", "value", "verdict"], rows


def told(imported: Imported) -> str:
    """Return what is unusual, what was left out and why, and what is reported of the files, a line each."""
    lines = [f"Warning: {warning}" for warning in imported.warnings]
    lines += [f"Note: {note}" for note in imported.choices.notes]
    lines += [f"Left out: {count} {reason}" for reason, count in imported.choices.dropped.items()]
    return "\n".join((*lines, *(f"{name}: {value:.5g}" for name, value in imported.numbers.items())))


def traces(imported: Imported) -> tuple[list[dict[str, Any]], str, str]:
    """Return the curves of an import, the part that is used in colour, and the labels of the axes."""
    columns = imported.columns
    if imported.path is not None:
        whole = line(imported.path[:, 0], imported.path[:, 1], GREY, "as measured", mode="markers")
        used = line(columns["stretch"], columns["stress_MPa"], colour(0), "used", mode="markers")
        return [whole, used], "stretch [-]", "engineering stress [MPa]"
    x = columns.get("t_s", np.arange(1.0, imported.rows + 1))
    names = [name for name in columns if re.fullmatch(_DRAWN[imported.kind], name)]
    drawn = [line(x, columns[name], colour(k), name.rpartition("_")[0]) for k, name in enumerate(names)]
    return drawn, f"time [{S.sign}]" if "t_s" in columns else "row", _LABELS[imported.kind]


def result_name(imported: Imported) -> str:
    """Return the name for the results, which is not that of a file that they were made of."""
    return f"{Path(imported.files[0]).stem}_imported"


def registration_for(imported: Imported, before: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table [registration] that goes with tips: what the import has done is not done again."""
    used = imported.choices.used
    frame = used.get("frame", "given")
    done = (*(_OF_FRAME if frame != "given" else ()), *(("tip_offset_mm",) if "tip_offset_mm" in used else ()))
    kept = {key: value for key, value in before.items() if key not in done}
    return {**kept, "frame": "fit"} if frame == "fit" else kept
