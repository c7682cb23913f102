"""Frozen data of arrays whose last axis counts poses: some of them, several put together, some replaced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
Index = NDArray[np.intp]


def _made(kind: type[T], arrays: dict[str, Any]) -> T:
    return kind(**arrays)


def _arrays(data: Any) -> dict[str, NDArray[Any]]:
    return {f.name: getattr(data, f.name) for f in fields(data)}


def some(data: T, poses: Any) -> T:
    """Return some poses, by their numbers or by a mask."""
    return _made(type(data), {name: values[..., poses] for name, values in _arrays(data).items()})


def joined(parts: Sequence[T]) -> T:
    """Return the poses of one behind those of the other."""
    every = [_arrays(part) for part in parts]
    return _made(type(parts[0]), {name: np.concatenate([a[name] for a in every], axis=-1) for name in every[0]})


def spread(data: T, numbers: Index, count: int) -> T:
    """Return the poses at their numbers among `count`, NaN elsewhere."""
    wide = {}
    for name, values in _arrays(data).items():
        wide[name] = np.full((*values.shape[:-1], count), np.nan)
        wide[name][..., numbers] = values
    return _made(type(data), wide)


def replaced(data: T, numbers: Index, others: T) -> T:
    """Return the poses with those of the given numbers replaced; `iterations`, where there are any, add up."""
    new, merged = _arrays(others), {}
    for name, values in _arrays(data).items():
        merged[name] = values.copy()
        merged[name][..., numbers] = new[name] + (values[..., numbers] if name == "iterations" else 0)
    return _made(type(data), merged)
