"""Dimensions of a scenario that vary along s: a number, a pair at base and tip, or a table of fractions and values."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, NamedTuple, TypeVar

from pydantic import ValidatorFunctionWrapHandler, WrapValidator

from softnlp.base.reading import shown
from softnlp.scenario.values import is_number, wrong

T = TypeVar("T")

MOST_KNOTS = 50
"""Of one dimension; between each two stands a part of the rod, which is compiled."""


class Varying(NamedTuple):
    """A dimension that varies along s: values at fractions of the length, linear between them."""

    s: tuple[float, ...]
    value: tuple[float, ...]


def _along(value: Any, plain: ValidatorFunctionWrapHandler) -> Any:
    """Return a dimension: a number as it is; what varies along s as fractions of the length and values there."""
    if isinstance(value, list):
        if len(value) != 2:
            raise wrong(f"expected a number, or two, at the base and at the tip, got {shown(value)}")
        value = {"s": [0.0, 1.0], "value": value}
    if not isinstance(value, dict):
        return plain(value)
    for key in value:
        if key not in ("s", "value"):
            raise wrong(f"unknown key {shown(key)}; expected {{s = [0, ..., 1], value = [...]}}")
    s, numbers = value.get("s"), value.get("value")
    for key, found in (("s", s), ("value", numbers)):
        if not isinstance(found, list) or not found or not all(map(is_number, found)):
            raise wrong(f"expected {key} with a list of numbers, got {shown(found)}")
    assert s is not None
    assert numbers is not None
    rising = all(a < b for a, b in pairwise(s))
    if len(s) < 2 or s[0] != 0 or s[-1] != 1 or not rising:
        raise wrong(f"expected s from 0 to 1, rising, got {shown(s)}")
    if len(s) > MOST_KNOTS:
        raise wrong(f"expected at most {MOST_KNOTS} fractions of the length, got {len(s)}")
    if len(numbers) != len(s):
        raise wrong(f"expected as many values as s has, {len(s)}, got {len(numbers)}")
    for number in numbers:
        plain(number)
    return Varying(tuple(map(float, s)), tuple(map(float, numbers)))


Along = Annotated[T | None, WrapValidator(_along)]
"""A number of a kind, or one that varies, which is a `Varying`."""
