"""Scenarios, CSV and material files made from valid ones by structural changes, and what the command makes of them."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import random
import re
import tomllib
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from softnlp.base.reading import DEEPEST, LARGEST_TOML
from softnlp.cli import main

SHIPPED = Path(__file__).parents[1] / "scenarios"
COMPARED = ("compare/angles", "compare/forces")
MAIN = "scenario.toml"

LONGEST = 5.0  # seconds of the processor, for a refusal and for an answer of few steps, on an idle machine

Tables = dict[str, Any]

MOULDED, LONGEST_MOULD = "mould (command)", 60.0  # which makes and checks every solid
LONGEST_PATH = 60.0  # of which no target is met: three programs, one of them elastic
LONGEST_RINGS = 20.0  # finite elements of a section that is new each time
_BALL = 'kind = "sphere"\ncentre_mm = [-30.0, 0.0, 40.0]\nradius_mm = 10.0'
_MOVING = "[dynamic]\nduration_s = 0.02\nstep_s = 0.005\ndamping_s = 0.002\noutput_step_s = 0.005\n\n"
_BLOCKED = '[contact]\nclosure = "free"\n\n'
# name: (shipped scenario, what is replaced in it, by what)
MADE: dict[str, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "made/plane": ("contact/sphere", (_BALL,), ('kind = "plane"\npoint_mm = [-20.0, 0, 0]\nnormal = [1, 0, 0]',)),
    "made/capsule": (
        "contact/sphere",
        (_BALL,),
        ('kind = "capsule"\nfrom_mm = [-30.0, -9.0, 40.0]\nto_mm = [-30.0, 9.0, 40.0]\nradius_mm = 8.0',),
    ),
    "made/tube": (
        "contact/sphere",
        (_BALL,),
        ('kind = "tube"\nfrom_mm = [0, 0, 0]\nto_mm = [0, 0, 80]\nradius_mm = 16',),
    ),
    "made/trocar": (
        "contact/sphere",
        (_BALL,),
        ('kind = "trocar"\npoint_mm = [0, 0, 20]\naxis = [0, 0, 1]\nradius_mm = 15\nlength_mm = 6\npart = "body"',),
    ),
    "made/segments blocked": (
        "two_segments",
        ('"forward"', "[pressure]"),
        ('"blocked-force"', _BLOCKED + "[pressure]"),
    ),
    "made/segments dynamic": (
        "two_segments",
        ('"forward"', "[pressure]"),
        ('"dynamic"', _MOVING + "[solver]\nintervals = 2\n\n[pressure]\nt_s = [0.0, 0.1, 0.2, 0.3]"),
    ),
    "made/energy dynamic": (
        "D25L60_energy",
        ('"forward"', "ramp = { sets = [1], to_bar = 1.5, steps = 6 }"),
        ('"dynamic"', "sequence_bar = [[0, 0, 0], [0.4, 0, 0]]\nt_s = [0.0, 0.01]\n\n" + _MOVING),
    ),
}


@dataclass(frozen=True)
class Case:
    """One fuzzed input. name : what was changed of what. files : by name. command : of softnlp, in their folder."""

    name: str
    files: Mapping[str, bytes]
    command: tuple[str, ...]

    def write(self, folder: Path) -> None:
        for name, content in self.files.items():
            (folder / name).write_bytes(content)


# --- valid inputs -----------------------------------------------------------------------------------------------------


def small_scenarios() -> dict[str, tuple[Tables, dict[str, str], tuple[str, ...]]]:
    """Return the shipped scenarios by name with the files that they name, cut down to a few steps, and the command."""
    found = {}
    for name, path, text in _valid_texts():
        tables = tomllib.loads(text)
        files: dict[str, str] = {}
        _bring_files(tables, path.parent, files)
        _cut(tables)
        command = ("run", MAIN, "--json")
        if name in COMPARED:
            measured = f"measured_{path.stem}.csv"
            files[measured] = _few_rows((SHIPPED / "files" / measured).read_text())
            command = ("compare", MAIN, measured, "--json")
        found[name] = tables, files, command
    found[MOULDED] = *found["mould"][:2], ("mould", MAIN, "--out", "out")
    return found


def _valid_texts() -> Iterator[tuple[str, Path, str]]:
    """Yield name, file and text of the shipped scenarios, and of those made of them for what none of them has."""
    texts = {}
    for path in sorted(SHIPPED.rglob("*.toml")):
        name, text = path.relative_to(SHIPPED).with_suffix("").as_posix(), path.read_text()
        # a path of several segments that is nowhere met takes a minute
        if "study" in tomllib.loads(text) and path.parent.name != "paper" and path.stem != "trocar_and_sphere":
            texts[name] = path, text
    for name, (base, old, new) in MADE.items():
        path, text = texts[base]
        for before, after in zip(old, new, strict=True):
            assert before in text, name
            text = text.replace(before, after)
        texts[name] = path, text
    for name, (path, text) in texts.items():
        yield name, path, text


def _bring_files(value: Any, folder: Path, files: dict[str, str]) -> None:
    """Put the files that tables name beside them."""
    for key, item in list(value.items()):
        if isinstance(item, dict):
            _bring_files(item, folder, files)
        elif key == "file":
            text = (folder / item).read_text()
            value[key] = Path(item).name
            whole = "import" in value or not item.endswith(".csv")
            files[value[key]] = text if whole else _few_rows(text)
        elif key == "files":
            value["files"] = [Path(name).name for name in item]
            files.update({Path(name).name: (folder / name).read_text() for name in item})


def _few_rows(text: str) -> str:
    lines = text.splitlines()
    if lines[0].startswith("t_s,x_mm"):  # a trace, whose rows follow each other closely
        return "\n".join(lines[:13]) + "\n"
    rows = 12 if lines[0].startswith(("stretch", "displacement")) else 4
    return "\n".join([lines[0], *lines[1 :: max(1, len(lines[1:]) // rows)][:rows]]) + "\n"


def _cut(tables: Tables) -> None:
    """Leave few steps, poses, targets and candidates of a scenario."""
    pressure = tables.get("pressure", {})
    pressure.update({key: pressure[key][-2:] for key in ("sequence_bar", "t_s") if key in pressure})
    for ramp in (pressure.get("ramp"), tables.get("contact", {}).get("offset_ramp")):
        if ramp is not None:
            ramp["steps"] = 2
    contact = tables.get("contact", {})
    contact.update({"offsets_mm": contact["offsets_mm"][:2]} if "offsets_mm" in contact else {})
    target = tables.get("target", {})
    few = 1 if "obstacle" in tables else 2
    target.update({key: rows[:few] for key, rows in target.items() if isinstance(rows, list)})
    path = tables.get("trajectory", {})
    path.update({key: rows[:3] for key, rows in path.items() if isinstance(rows, list)})
    if "obstacle" in tables or ("segment" in tables and "contact" in tables):
        tables.setdefault("solver", {})["accuracy"] = 1e-3
    workspace = tables.get("workspace", {})
    workspace.update({key: size for key, size in (("levels", 2), ("samples", 6)) if key in workspace})
    for entry in workspace.get("vary", {}).values():
        entry.update({"levels": 2} if "levels" in entry else {})
    if "dynamic" in tables and tables["study"] == "dynamic":
        tables["dynamic"]["duration_s"] = 0.02
    elif "dynamic" in tables:
        tables["dynamic"]["step_s"] = 0.02
        tables["measurements"]["free"] = ["lag_s"]
    if "measurements" in tables:
        tables["solver"] = {"accuracy": 1e-3}
        tables["measurements"]["free"] = tables["measurements"]["free"][:2]
    if workspace and "contact" in tables:
        del workspace["vary"]
        workspace["to_bar"] = 0.5
    if "objective" in tables:
        tables["objective"] |= {"trials": 3, "starts": 1}
        tables["requirements"].pop("blocked_force_N", None)
        for choices in tables["choices"].values():
            choices.update({key: value[:1] for key, value in choices.items() if isinstance(value, list)})
            for key in [key for key, value in choices.items() if isinstance(value, dict)][2:]:
                del choices[key]


def as_toml(tables: Tables) -> str:
    """Return tables as TOML, one key of the top a line."""
    return "".join(f"{_key(key)} = {_value(item)}\n" for key, item in tables.items())


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps(value)


# --- changes ----------------------------------------------------------------------------------------------------------

ODD = (
    *(0, 1, -1, 2, 3, 1e-300, -1e-300, 1e-9, 1e9, 1e300, -1e300, 5e-324, 10**30, -(2**63), 10**400, 0.5, 1e-3, 1e4),
    *(math.nan, math.inf, -math.inf, True, False, "", "x", "1.0", "$^_{}\\", "a\tb", "é\u2028", "x" * 300, [], {}),
    *([0], [1, 2], [[0, 0, 0]], [[]], {"a": 1}, {"from": 1, "to": 2}, ["x"], [None] * 0, [1e300] * 3, [True]),
)
NAMES = ("name", "file", "study", "model", "levels", "constants", "x", "__class__", "", "a b", "p1_bar", "length_mm")


def places(value: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the path of every key and item."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path for key, item in items for path in ((*above, key), *places(item, (*above, key)))]


def _holder(tables: Tables, path: tuple[Any, ...]) -> Any:
    for key in path[:-1]:
        tables = tables[key]
    return tables


def change_tables(tables: Tables, rng: random.Random) -> str:
    """Change one thing of tables and return what."""
    path = rng.choice(places(tables))
    holder, key = _holder(tables, path), path[-1]
    kind = rng.choice(("odd", "odd", "odd", "drop", "rename", "wrap", "repeat", "nest", "swap", "deep"))
    value = holder[key]
    if isinstance(value, int | float) and not isinstance(value, bool) and rng.random() < 0.6:
        kind, holder[key] = "scale", value * rng.choice((-1, 1e-12, 1e-3, 0.1, 0.5, 1.1, 3, 10, 1e3, 1e12))
    elif kind == "drop":
        del holder[key]
    elif kind == "rename" and isinstance(holder, dict):
        holder[rng.choice((f"{key}s", f"{key}"[1:], *NAMES))] = holder.pop(key)
    elif kind == "wrap":
        holder[key] = rng.choice(([value], {"value": value}, [value] * 3, [[value]]))
    elif kind == "repeat" and isinstance(value, list):
        holder[key] = value * rng.choice((0, 2, 40)) + value[:1]
    elif kind == "nest":
        holder[key] = {rng.choice(NAMES): value}
    elif kind == "swap":
        other = rng.choice(places(tables))
        holder[key] = json.loads(json.dumps(_holder(tables, other)[other[-1]]))
    elif kind == "deep":
        for _ in range(rng.choice((3, 20, 60))):
            value = [value]
        holder[key] = value
    else:
        kind = "odd"
        holder[key] = rng.choice(ODD)
    return f"{kind} {'.'.join(map(str, path))}"


def change_bytes(content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """Return the bytes of a file with one thing changed, and what."""
    at = rng.randrange(len(content)) if content else 0
    changes: dict[str, Callable[[], bytes]] = {
        "empty": lambda: rng.choice((b"", b" \n", b"\n\n", b"# x\n")),
        "cut": lambda: content[:at],
        "byte": lambda: (
            content[:at]
            + rng.choice((b"\xff", b"\0", b"\x1b", b'"', b"'", b"[", b"{", b"=", b"\\", b"#"))
            + content[at:]
        ),
        "gone": lambda: content[:at] + content[at + rng.choice((1, 3, 10)) :],
        "BOM": lambda: b"\xef\xbb\xbf" + content,
        "CRLF": lambda: content.replace(b"\n", b"\r\n"),
        "CR": lambda: content.replace(b"\n", b"\r"),
        "UTF-16": lambda: content.decode().encode("utf-16"),
        "twice": lambda: content + content,
        "long": lambda: content + b"#" * LARGEST_TOML,
        "deep": lambda: content + b"z = " + b"[" * rng.choice((DEEPEST + 1, 5000)),
        "dots": lambda: content + b"a." * rng.choice((DEEPEST, 5000)) + b"a = 1\n",
        "line": lambda: b"\n".join(sorted(content.split(b"\n"), key=lambda line: rng.random())),
        "digits": lambda: re.sub(rb"\d", lambda m: rng.choice((m[0], m[0] * 30)), content, count=rng.choice((1, 5))),
    }
    kind = rng.choice(list(changes))
    return changes[kind](), kind


def change_csv(text: str, rng: random.Random) -> tuple[str, str]:
    """Return a CSV table with one thing changed, and what."""
    rows = [row for row in csv.reader(io.StringIO(text)) if row]
    r = rng.randrange(len(rows))
    c = rng.randrange(len(rows[r]))  # rows above a header may be shorter
    separator = ","
    kind = rng.choice(
        ("cell", "cell", "cell", "blank", "extra", "twice", "drop", "short", "separator", "header", "noise")
    )
    if kind == "cell":
        rows[r][c] = rng.choice(
            ("nan", "inf", "-1", "1e300", "-1e300", "1e-300", "1_0", "0x1", "1,5", "x", '"', "=1+1")
        )
    elif kind == "blank":
        rows[r][c] = rng.choice(("", " "))
    elif kind == "extra":
        rows = [[*row, rng.choice(("", "1", "x"))] for row in rows]
    elif kind == "twice":
        rows = [[*row, *row[c : c + 1]] for row in rows]
    elif kind == "drop":
        rows = [row[:c] + row[c + 1 :] for row in rows]
    elif kind == "short":
        rows[r] = rows[r][:c]
    elif kind == "separator":
        separator = rng.choice((";", "\t", " ", "|"))
    elif kind == "header":
        rows[0][rng.randrange(len(rows[0]))] = rng.choice(
            ("t_s", "p1_bar", "p9_bar", "x", "", "robot", "weight", "sigma_bending_angle_deg")
        )
    else:
        rows[r or -1][-1] = rng.choice(("-0.003", "-0.05", "-0.051", "-0.0"))
    out = io.StringIO()
    csv.writer(out, delimiter=separator, lineterminator="\n").writerows(rows)
    return out.getvalue(), kind


def cases(seed: int, count: int) -> Iterator[Case]:
    """Yield as many cases, always the same ones of a seed."""
    bases = small_scenarios()
    named = sorted({name for _, texts, _ in bases.values() for name in texts})
    for number in range(count):
        rng = random.Random(f"{seed} {number}")  # so that no case changes with those before it
        way = rng.choice(("tables", "tables", "tables", "bytes", "file", "file"))
        name = rng.choice(named)
        base = rng.choice([key for key in bases if way != "file" or name in bases[key][1]])
        tables, texts, command = json.loads(json.dumps(bases[base][0])), bases[base][1], bases[base][2]
        files = {name: text.encode() for name, text in texts.items()}
        told = []
        if way == "tables":
            told = [change_tables(tables, rng) for _ in range(rng.choice((1, 1, 2)))]
        files[MAIN] = as_toml(tables).encode("utf-8", "surrogatepass")
        if way == "file":
            told, files[name] = _changed_file(name, texts[name], rng)
            if name.endswith(".toml") and rng.random() < 0.5:
                command = ("materials", "--file", name)
        elif way == "bytes":
            files[MAIN], kind = change_bytes(files[MAIN], rng)
            told = [f"bytes: {kind}"]
        if command[0] == "run" and number % 8 == 0:
            command = (*command, "--out", "out")
        yield Case(f"{number} {base}: {', '.join(told)}", files, command)


def _changed_file(name: str, text: str, rng: random.Random) -> tuple[list[str], bytes]:
    if rng.random() < 0.3:
        content, kind = change_bytes(text.encode(), rng)
        return [f"{name}: {kind}"], content
    if name.endswith(".csv"):
        text, kind = change_csv(text, rng)
        return [f"{name}: {kind}"], text.encode()
    tables = tomllib.loads(text)
    return [f"{name}: {change_tables(tables, rng)}"], as_toml(tables).encode("utf-8", "surrogatepass")


# --- what comes out ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Outcome:
    """How a command ended. seconds : of the processor, of this process and those that it waited for."""

    status: int
    out: str
    err: str
    seconds: float
    written: tuple[str, ...]


def outcome(case: Case, folder: Path) -> Outcome:
    """Run a case in this process, in its own folder."""
    case.write(folder)
    before, out, err = os.getcwd(), io.StringIO(), io.StringIO()
    os.chdir(folder)
    began = sum(os.times()[:4])
    try:
        with redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("always")
            status = main(case.command)
    finally:
        os.chdir(before)
    seconds = sum(os.times()[:4]) - began
    written = sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))
    return Outcome(status, out.getvalue(), err.getvalue(), seconds, tuple(written))


def wrong_with(case: Case, found: Outcome) -> str | None:
    """Return what is not as it has to be: bad input is one line and writes nothing, all else is a right answer."""
    lines = found.err.splitlines()
    longest = LONGEST_MOULD if case.command[0] == "mould" else LONGEST
    if "half_cylinder" in case.name and found.status != 2:
        longest = LONGEST_RINGS
    if "trajectory/" in case.name and found.status == 3:
        longest = LONGEST_PATH
    if found.seconds > longest:
        return f"{found.seconds:.1f} s of the processor"
    if found.status == 2:
        if len(lines) != 1 or not found.err.startswith("softnlp: ") or len(found.err) > 2000 or found.out:
            return f"not one line of refusal: {found.err[:300]!r}"
        return None if set(found.written) == set(case.files) else f"refused and wrote {found.written}"
    if found.status not in (0, 3):
        return f"exit status {found.status}"
    if any(not line.startswith("softnlp: ") for line in lines):
        return f"on standard error: {found.err[:300]!r}"
    if "--json" not in case.command:
        return None
    try:
        document = json.loads(found.out, parse_constant=lambda name: float(f"no {name}"))
    except ValueError as error:
        return f"no JSON document: {error}"
    steps = document.get("steps", [])
    if found.status == 0 and any(step["status"] not in ("solved", "no_contact") for step in steps):
        return "a step did not solve and the exit status is 0"
    for step in steps:
        if step["status"] == "solved" and not 0 <= step["residual"] <= 1e-4:
            return f"solved with a residual of {step['residual']}"
    return None
