"""What every key of a scenario is, read off the schema: unit, default, meaning and an example of each.

The meaning is the key's line in the docstring of its table, `KEY : MEANING; by default TEXT; as in VALUE`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from inspect import cleandoc
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from softnlp.base.columns import OUTPUTS, by_key
from softnlp.base.files import toml_text
from softnlp.model.ipopt_options import IPOPT_OPTIONS
from softnlp.scenario.schema import RobotTable

UNITS: Mapping[str, str] = {
    **{"_per_Nmm": "1/(N mm)", "_per_mm": "1/mm", "_per_N": "1/N", "_kg_m3": "kg/m^3", "_mm2": "mm^2"},
    **{"_Nmm": "N mm", "_mm": "mm", "_bar": "bar", "_N": "N", "_MPa": "MPa", "_deg": "deg", "_s": "s"},
    **{"_percent": "%"},
}
"""The unit of a key by how it ends, longer endings first."""

_LINE = re.compile(r"^(\w+) : (.*(?:\n +.*)*)", re.MULTILINE)
_FEW = 4  # keys of a table that is written on one line


@dataclass(frozen=True)
class Key:
    """One key of a table.

    unit : "" where it has none. default : TOML or words, "" where it has none. example : TOML of a value that it takes.
    words : those that it takes, if only some. table : the schema of its own keys; named : each under a name of its own.
    several : whether there may be more than one table of it, in two brackets.
    """

    name: str
    unit: str
    default: str
    meaning: str
    example: str
    words: tuple[str, ...]
    required: bool
    table: type[BaseModel] | None
    named: bool
    several: bool = False

    @property
    def is_short(self) -> bool:
        """Whether it is written on one line."""
        return self.table is None or (len(self.table.model_fields) <= _FEW and not (self.named or self.several))

    @property
    def comment(self) -> str:
        """Unit, meaning and default in one line."""
        known = [toml_text(word) for word in self.words]
        words = "" if all(word in self.meaning for word in known) else f": {', '.join(known)}"
        default = f" (default {self.default})" if self.default else ""
        return f"{f'[{self.unit}] ' if self.unit else ''}{self.meaning}{words}{default}"


def about(table: type[BaseModel]) -> str:
    """Return the first sentence of a table's docstring, without its name."""
    first = cleandoc(table.__doc__ or "").split("\n\n")[0].replace("\n", " ")
    return re.sub(r"^\[[\w.]+\]:? ?", "", first).strip().removesuffix(".")


def keys_of(table: type[BaseModel]) -> list[Key]:
    """Return every key of a table, in order."""
    return [_key(table, name, field) for name, field in table.model_fields.items()]


def _key(table: type[BaseModel], name: str, field: FieldInfo) -> Key:
    lines = _lines(table)
    text = lines.get(name) or field.description or _registered(name)
    text, _, example = text.rpartition("; as in ") if "; as in " in text else (text, "", "")
    if text.startswith("as in "):
        text, example = "", text.removeprefix("as in ")
    meaning, _, default = text.partition("; by default ")
    inner, named = _table_in(field.annotation)
    several = inner is not None and get_origin(field.annotation) is list
    if inner is not None and not meaning:
        meaning = about(inner)
    if not default and not field.is_required() and not isinstance(field.default, BaseModel | None):
        default = toml_text(field.default) if field.default_factory is None else ""
    words = _words(field.annotation)
    if not example and inner is not None and not named:
        keys = keys_of(inner)
        chosen = [key for key in keys if key.required] or keys[:1]
        example = "{ " + ", ".join(f"{key.name} = {key.example}" for key in chosen) + " }"
    if several:
        example, default = f"[{example}]", ""
    example = example or _example(default, words)
    unit = next((unit for end, unit in UNITS.items() if name.endswith(end)), "")
    return Key(name, unit, default, meaning, example, words, field.is_required(), inner, named, several)


def _example(default: str, words: tuple[str, ...]) -> str:
    return default or (toml_text(words[0]) if words else "1.0")


def _lines(table: type[BaseModel]) -> dict[str, str]:
    """Return what the docstrings of a table, and of those that it is made of, say of each key."""
    found: dict[str, str] = {}
    for one in reversed(table.__mro__):
        if issubclass(one, BaseModel):
            lines = _LINE.findall(cleandoc(one.__doc__ or ""))
            found |= {name: " ".join(text.split()) for name, text in lines}
    return found


def _registered(name: str) -> str:
    """Return what a key is that several tables have: a dimension, an output, an option of IPOPT."""
    if name in IPOPT_OPTIONS:
        option = IPOPT_OPTIONS[name]
        tried = (*option.words, *((100, 1) if option.whole else (1e-8, 60.0, 0.5, 1.5)))
        example = toml_text(next(value for value in tried if option.takes(value)))
        return f"{option.meaning}, {option.expected}; as in {example}"
    if name in RobotTable.model_fields:
        return _lines(RobotTable)[name].partition("; as in ")[0]
    output = by_key(name) or OUTPUTS.get(name.removesuffix("_percent"))
    return "" if output is None else output.meaning or output.label


def _table_in(annotation: Any) -> tuple[type[BaseModel] | None, bool]:
    """Return the table that a key holds, and whether it holds several by name."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, False
    found = (_table_in(part)[0] for part in get_args(annotation))
    return next((table for table in found if table is not None), None), get_origin(annotation) is dict


def _words(annotation: Any) -> tuple[str, ...]:
    """Return the words that a key takes."""
    if get_origin(annotation) is Literal:
        return tuple(map(str, get_args(annotation)))
    return next((words for part in get_args(annotation) if (words := _words(part))), ())
