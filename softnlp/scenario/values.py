"""What tables and single keys of a scenario may hold: types of pydantic, and how they word what does not fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import hypot, isfinite
from typing import Annotated, Any
from unicodedata import category

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator, create_model
from pydantic_core import PydanticCustomError

from softnlp.base.errors import InputError
from softnlp.base.reading import BACKSLASH_HINT, as_typed, choices, shown
from softnlp.model.gravity import DIRECTIONS, unknown_direction

MOST_INTERVALS = 2000
LARGEST_COMPONENT = 1e300
MOST_STEPS = 1_000_000
LONGEST_LABEL = 200
LONGEST_FILE_NAME = 500


def wrong(message: str) -> PydanticCustomError:
    """Wrap a message of our own, which is passed on as it is."""
    return PydanticCustomError("own", "{text}", {"text": message})


def _direction(value: Any) -> tuple[float, float, float]:
    """Gravity's direction: one of the names, or a vector to be normalised."""
    if isinstance(value, str):
        if value not in DIRECTIONS:
            raise wrong(unknown_direction(value))
        return DIRECTIONS[value]
    if not isinstance(value, list):
        raise wrong(f"expected one of {choices(DIRECTIONS)}, or a vector of 3 numbers, got {shown(value)}")
    return _normal(value)


def _normal(value: Any) -> tuple[float, float, float]:
    """Normalise a list of three numbers."""
    if not isinstance(value, list) or len(value) != 3:
        raise wrong(f"expected a list of 3 numbers, got {shown(value)}")
    for component in value:
        if isinstance(component, bool) or not isinstance(component, (int, float)):
            raise wrong(f"expected a list of 3 numbers, got {shown(component)} in it")
        if not abs(component) <= LARGEST_COMPONENT:
            raise wrong(f"expected 3 finite numbers, got {shown(component)} among them")
    largest = max(abs(component) for component in value)
    if largest == 0:
        raise wrong("expected a direction, got a vector of length 0")
    x, y, z = (component / largest for component in value)  # first, so that no square vanishes or overflows
    length = hypot(x, y, z)
    return x / length, y / length, z / length


def intervals_of(value: Any) -> int | None:
    """Return the number of intervals, None for "auto"."""
    if value == "auto":
        return None
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= MOST_INTERVALS:
        raise wrong(f"expected 'auto' or a whole number from 1 to {MOST_INTERVALS}, got {shown(value)}")
    return value


def is_number(value: Any) -> bool:
    """Whether a value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def number_or_fit(value: Any) -> float | None:
    """Return a number, None for "fit"."""
    if value != "fit" and not is_number(value):
        raise wrong(f"expected a number or 'fit', got {shown(value)}")
    return None if value == "fit" else float(value)


def vector_or_fit(size: int, value: Any) -> list[float] | None:
    """Return so many numbers, None for "fit"."""
    if value != "fit" and not (isinstance(value, list) and len(value) == size and all(map(is_number, value))):
        raise wrong(f"expected a list of {size} numbers or 'fit', got {shown(value)}")
    return None if value == "fit" else [float(v) for v in value]


def deviation(value: Any) -> float | str:
    """Return a standard deviation as it is written: a number, or text that says what it is a part of."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise wrong(f"expected a number, or text such as '3%', got {shown(value)}")
    return value


def _file_name(value: str) -> str:
    r"""Refuse control characters, which are escapes that nobody meant: in TOML "data\table.csv" holds a tab."""
    if not value.strip():
        raise wrong(f"expected a path, got {shown(value)}")
    if controls := [c for c in value if category(c) == "Cc"]:
        escape = as_typed(controls[0])
        raise wrong(f"expected a path, got '{as_typed(value)}', where {escape} is one character: {BACKSLASH_HINT}")
    return value


def _label(value: str) -> str:
    """Put a name or a title on one line; control characters would reach a terminal or a figure."""
    label = " ".join(value.split())
    if not label or not label.isprintable():
        raise wrong(f"expected text without control characters, got {shown(value)}")
    return label


Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=1)]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Direction = Annotated[tuple[float, float, float], PlainValidator(_direction)]
Normal = Annotated[tuple[float, float, float], PlainValidator(_normal)]
Label = Annotated[str, Field(max_length=LONGEST_LABEL), AfterValidator(_label)]
FileName = Annotated[str, Field(max_length=LONGEST_FILE_NAME), AfterValidator(_file_name)]


class Table(BaseModel):
    """A table of the file: no unknown key, no conversion of types (but a whole number is a number), no nan or inf."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    def written(self, keys: Iterable[str]) -> list[str]:
        """Return which of some keys the file has, in their order."""
        return [key for key in keys if key in self.model_fields_set]

    def refuse(self, keys: Iterable[str], message: str, table: str | None = None) -> None:
        """Raise `InputError` for the first of some keys that the file has."""
        for key in self.written(keys):
            raise InputError(message, table=table, key=key)


def optional_keys(kinds: Mapping[str, Any]) -> Any:
    """Return a table whose keys may each be left out; kinds : of each."""
    fields: dict[str, Any] = {key: (kind | None, None) for key, kind in kinds.items()}
    return create_model("OptionalKeys", __base__=Table, **fields)
