"""netCDF that other programs read as well: text as characters of a fixed length, in UTF-8, never as type `string`."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Variable = tuple[tuple[str, ...], Any, dict[str, Any]]
"""Dimensions, values and attributes."""


def said(unit: str, meaning: str, **more: Any) -> dict[str, Any]:
    """Return the attributes of a variable; `unit` is one that both UDUNITS and Pint read, such as `1/m`."""
    return {"units": unit, "long_name": meaning, **more}


def flag_attributes(names: Mapping[str, int]) -> dict[str, Any]:
    """Return the attributes that name the values of a variable of flags."""
    return {"flag_values": np.array(list(names.values()), np.int8), "flag_meanings": " ".join(names)}


def file_bytes(
    variables: Mapping[str, Variable], coordinates: Mapping[str, Variable], attributes: Mapping[str, Any]
) -> bytes:
    """Return a netCDF file, made in memory."""
    import h5netcdf

    content = io.BytesIO()
    every = {
        name: (dims, np.asarray(values), about) for name, (dims, values, about) in {**variables, **coordinates}.items()
    }
    sizes = {name: size for dims, values, _ in every.values() for name, size in zip(dims, values.shape, strict=True)}
    beside = {name: set(dims) for name, (dims, _, _) in coordinates.items() if name not in sizes}
    with h5netcdf.File(content, "w") as file:
        put_attributes(file, attributes)
        file.dimensions = sizes
        for name, (dims, values, about) in every.items():
            own = [] if name in coordinates else [c for c, of in beside.items() if of <= set(dims)]
            more = {"coordinates": " ".join(own)} if own else {}
            put(file, name, dims, values, about | more)
    return content.getvalue()


def put_attributes(target: Any, attributes: Mapping[str, Any]) -> None:
    """Give a file or a variable of h5netcdf attributes, text as characters."""
    import h5py

    for name, value in attributes.items():
        if isinstance(value, str):
            text = value.encode()
            value = np.array(text, h5py.string_dtype("utf-8", max(1, len(text))))
        target.attrs[name] = value


def put(file: Any, name: Any, dims: Any, values: Any, attributes: Mapping[str, Any]) -> None:
    """Write a variable, of numbers or of text."""
    if values.dtype.kind in "OU":
        texts = encoded(values.tolist())
        put_characters(file, name, dims, texts.itemsize, attributes)[...] = as_characters(texts)
    else:
        put_attributes(file.create_variable(name, dims, values.dtype, data=values), attributes)


def put_characters(file: Any, name: str, dims: tuple[str, ...], width: int, attributes: Mapping[str, Any]) -> Any:
    """Declare a variable of texts of at most `width` bytes; return it."""
    length = f"string{width}"
    if length not in file.dimensions:
        file.dimensions[length] = width
    variable = file.create_variable(name, (*dims, length), "S1")
    put_attributes(variable, {**attributes, "_Encoding": "utf-8"})
    return variable


def encoded(texts: Iterable[str], width: int = 0) -> NDArray[np.bytes_]:
    """Return texts in UTF-8, of `width` bytes or, without it, as long as the longest."""
    return np.array([text.encode() for text in texts], f"S{width or ''}")


def as_characters(texts: NDArray[np.bytes_]) -> NDArray[np.bytes_]:
    """Return texts (N,) as single characters (N, width)."""
    return texts.view("S1").reshape(*texts.shape, texts.itemsize)
