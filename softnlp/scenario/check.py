"""Check the tables of a scenario against their schema, and say what does not fit in one line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, cast, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from softnlp.base.errors import InputError, first_of
from softnlp.base.ranges import numbers_outside
from softnlp.base.reading import choices, did_you_mean, one_line, shown
from softnlp.scenario.design import DesignFile
from softnlp.scenario.dynamic import DynamicFile
from softnlp.scenario.identify import IdentifyFile
from softnlp.scenario.inverse import InverseFile
from softnlp.scenario.near_keys import meant
from softnlp.scenario.obstacle_schema import AmongObstaclesFile, BlockedAmongObstaclesFile
from softnlp.scenario.outlined import of_outlines
from softnlp.scenario.schema import ScenarioFile
from softnlp.scenario.segments import OF_SEGMENTS, of_segment, of_segments
from softnlp.scenario.trajectory import TrajectoryFile
from softnlp.scenario.workspace import WorkspaceFile

SCHEMAS: Mapping[str, type[ScenarioFile]] = {
    "forward": AmongObstaclesFile,
    "blocked-force": BlockedAmongObstaclesFile,
    "inverse": InverseFile,
    "workspace": WorkspaceFile,
    "identify": IdentifyFile,
    "design": DesignFile,
    "dynamic": DynamicFile,
    "trajectory": TrajectoryFile,
}
"""The studies that this version runs, and the file of each."""

_INSTEAD = "obstacles stand in 'forward', 'blocked-force', 'inverse', 'workspace' and 'trajectory' so far"

HOW = ": --all-errors"
"""How to see all mistakes of a file."""

_TABLES = {
    "segment",
    "obstacle",
    "chamber",
    "body",
    *(name for schema in SCHEMAS.values() for name in schema.model_fields),
} - {
    "title",
    "study",
}


def parse(data: Mapping[str, Any]) -> ScenarioFile:
    """Return the tables of a scenario, checked one by one.

    Raises
    ------
    InputError
        For the first key that does not fit, with the others.
    """
    file, errors, _ = parse_parts(data)
    if errors:
        raise first_of(errors, HOW)
    return file


def parse_parts(data: Mapping[str, Any]) -> tuple[ScenarioFile, list[InputError], set[str]]:
    """Return the tables of a scenario, what does not fit, and the tables that it is in; those are not in the file.

    Raises
    ------
    InputError
        When the study is not one that this version runs.
    """
    study = _study(data)
    schema = schema_of(data, study)
    details, file = [], None
    try:
        file = schema.model_validate(data)
    except ValidationError as error:
        details = error.errors(include_url=False)
    wrong = [detail["loc"] for detail in details]
    for place, number, text in numbers_outside(data):
        if not any(loc[: len(place)] == place[: len(loc)] for loc in wrong):
            details.append({"type": "own", "loc": place, "msg": text, "input": number, "ctx": {"text": text}})
    bad = {str(detail["loc"][0]) for detail in details}
    return file or _without(schema, data, bad), list(_errors(study, schema, details)), bad


def _without(schema: type[ScenarioFile], data: Mapping[str, Any], bad: set[str]) -> ScenarioFile:
    """Return the file without the tables that do not fit."""
    good = {name: schema.model_fields[name] for name in schema.model_fields if name in data and name not in bad}
    tables = {
        name: TypeAdapter[Any](cast(Any, field.annotation)).validate_python(data[name]) for name, field in good.items()
    }
    return schema.model_construct(**tables)


def _study(data: Mapping[str, Any]) -> str:
    """Return the study, when it is one that this version runs."""
    study = data.get("study")
    if study is None:
        raise InputError(f"missing; expected {choices(SCHEMAS)}", key="study")
    if not isinstance(study, str) or study not in SCHEMAS:
        hint = did_you_mean(study, SCHEMAS) if isinstance(study, str) else ""
        raise InputError(f"expected {choices(SCHEMAS)}, got {shown(study)}{hint}", key="study")
    return study


def schema_of(data: Mapping[str, Any], study: str) -> type[ScenarioFile]:
    """Return the tables that a file of a study may hold: with [[segment]] in place of [robot] and [material].

    Raises
    ------
    InputError
        For segments in a study that does not take them, and a single table of that name.
    """
    if outlines := [name for name in ("chamber", "body") if name in data]:
        if "segment" in data:
            raise InputError(f"expected [[segment.{outlines[0]}]] of a [[segment]], got both", table=outlines[0])
        if study not in OF_SEGMENTS:
            text = f"study {study!r} takes the round layout of [robot] so far, not [[chamber]] and [body]"
            raise InputError(text, table=outlines[0])
        return of_outlines(SCHEMAS[study])
    if "segment" not in data:
        return SCHEMAS[study]
    if study not in OF_SEGMENTS:
        raise InputError(f"study {study!r} takes [robot] and [material] so far, not [[segment]]", table="segment")
    if not isinstance(data["segment"], list):
        raise InputError("expected one table [[segment]], in two brackets, for each segment", table="segment")
    return of_segments(SCHEMAS[study])


def _errors(study: str, schema: type[ScenarioFile], details: list[ErrorDetails]) -> Iterator[InputError]:
    """Yield an error of ours for each of pydantic's: unknown keys first, they explain missing ones."""
    aimed: set[tuple[int | str | None, ...]] = set()
    for detail in (d for d in details if d["type"] == "extra_forbidden"):
        *place, key = detail["loc"]
        if not place and key in _TABLES:
            instead = _INSTEAD if key == "obstacle" else "remove it"
            yield _placed(detail, f"this table is not used by study {study!r}; {instead}")
            continue
        name, words = meant(str(key), detail["input"], _model(schema, tuple(place)).model_fields)
        aimed |= {(*place, name)}
        if not place and isinstance(detail["input"], dict):
            words = words.replace("unknown key", "unknown table", 1)
        yield _placed(detail, words)
    for detail in (d for d in details if d["type"] != "extra_forbidden"):
        if detail["type"] != "missing" or detail["loc"] not in aimed:
            yield _placed(detail, _message(schema, detail))


def _message(schema: type[ScenarioFile], detail: ErrorDetails) -> str:
    """Say what was expected and what was found."""
    kind, value, limits = detail["type"], detail["input"], detail.get("ctx", {})
    if kind == "own":
        return str(limits["text"])
    if kind == "missing":
        expected = _field(schema, detail["loc"]).description
        return f"missing; expected {expected}" if expected else "missing"
    if kind == "literal_error":
        known = get_args(_field(schema, detail["loc"]).annotation)
        words = [word for word in known if isinstance(word, str)]
        hint = did_you_mean(value, words) if isinstance(value, str) else ""
        return f"expected {choices(known)}, got {shown(value)}{hint}"
    if kind == "string_too_long":
        return f"expected at most {limits['max_length']} characters, got {len(value)}"
    expected = _EXPECTED[kind].format(**limits) if kind in _EXPECTED else one_line(detail["msg"])
    return f"expected {expected}, got {shown(value)}"


_EXPECTED = {
    "too_short": "a list of at least {min_length}",
    "too_long": "a list of at most {max_length}",
    "greater_than": "a number above {gt:.10g}",
    "greater_than_equal": "a number of at least {ge:.10g}",
    "less_than": "a number below {lt:.10g}",
    "less_than_equal": "a number of at most {le:.10g}",
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
}


def _placed(detail: ErrorDetails, message: str) -> InputError:
    """Name the table and the key: ("pressure", "sequence_bar", 2, 0) is row 3, column 1."""
    if len(detail["loc"]) > 1 and detail["loc"][0] == "segment":
        _, number, *rest = detail["loc"]
        inner = _placed({**detail, "loc": tuple(rest)}, message) if rest else InputError(message)
        return of_segment(int(number), inner)
    *path, last = [part for part in detail["loc"] if isinstance(part, str)]
    numbers = [part + 1 for part in detail["loc"] if isinstance(part, int)]
    where = [f"{word} {n}" for word, n in zip(("row", "column"), numbers, strict=False)]
    if len(numbers) == 1 and last != "sequence_bar":
        where = [f"item {numbers[0]}"]
    message = f"{' '.join(where)}: {message}" if where else message
    whole_table = not path and (last in _TABLES or isinstance(detail["input"], dict))
    if whole_table:
        return InputError(message, table=last)
    table, *keys = [*path, last] if path else ["", last]
    return InputError(message, table=table or None, key=".".join(keys))


def _field(schema: type[BaseModel], loc: tuple[int | str, ...]) -> Any:
    """Return pydantic's field at a place of the file."""
    *path, key = [part for part in loc if isinstance(part, str)]
    return _model(schema, tuple(path)).model_fields[key]


def _model(schema: type[BaseModel], loc: tuple[int | str, ...]) -> type[BaseModel]:
    """Return the table at a place of the file."""
    for part in loc:
        if part not in schema.model_fields:
            continue  # a name that a person gave, as in [robots.NAME]
        annotation = schema.model_fields[str(part)].annotation
        candidates = (annotation, *get_args(annotation))
        schema = next((a for a in candidates if isinstance(a, type) and issubclass(a, BaseModel)), schema)
    return schema
