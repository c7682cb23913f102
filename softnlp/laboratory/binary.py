"""TDMS files by npTDMS, and MAT files by scipy and mat-io: named columns of numbers, and nothing that runs code."""

from __future__ import annotations

import io
import logging
import tempfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softnlp.base.csv_columns import MOST_COLUMNS
from softnlp.base.errors import InputError, listed
from softnlp.base.reading import one_line, shown
from softnlp.laboratory.choices import Choices
from softnlp.laboratory.table import RawTable
from softnlp.laboratory.units import Unit, split_unit, unit_named

Array = NDArray[np.float64]

_HDF, _COMPRESSED, _HEADER = b"\x89HDF", 15, 128
_MOST = 20_000_000  # numbers of one variable


def tdms_tables(label: str, content: bytes, choices: Choices) -> list[RawTable]:
    """Return the channels of the group that is asked for, or of the one group that there is.

    Raises
    ------
    InputError
        Without npTDMS, for a file that is not valid, and where several groups need a choice.
    """
    try:
        from nptdms import TdmsFile
        from nptdms.log import log_manager
    except ImportError:
        raise InputError("a TDMS file needs npTDMS: pip install 'softnlp[lab]'") from None
    log_manager.set_level(logging.CRITICAL)  # a file that is wrong is one line
    try:
        file = TdmsFile.read(io.BytesIO(content))
        groups = {group.name: list(group.channels()) for group in file.groups() if len(group.channels())}
        name = _chosen("group", groups, choices)
        columns = {c.name: (_numbers(c[:]), unit_named(str(c.properties.get("unit_string", "")))) for c in groups[name]}
        step = next((c.properties["wf_increment"] for c in groups[name] if "wf_increment" in c.properties), None)
    except InputError:
        raise
    except Exception as error:  # npTDMS has no exception of its own for a file that is cut or wrong
        raise InputError(f"not a valid TDMS file: {one_line(f'{type(error).__name__}: {error}', 80)}") from None
    known = {key: (v, unit) for key, (v, unit) in columns.items() if v is not None and v.ndim == 1 and v.size}
    table = _table(label, {key: v for key, (v, _) in known.items()}, {key: u for key, (_, u) in known.items()})
    if step is None or any("time" in name.lower() for name in table.names):
        return [table]
    time = Unit("time", 1.0, "s")
    names, units = ("Time", *table.names), (time, *table.units)
    columns_in_time = (float(step) * np.arange(table.rows), *table.columns)
    return [RawTable(label, names, units, columns_in_time, table.repeat, {}, ())]


def matlab_tables(label: str, content: bytes, choices: Choices) -> list[RawTable]:
    """Return the variables of a MAT file that have as many rows as most, a column each, or those of one table.

    Raises
    ------
    InputError
        For a file that is not valid, a variable that is an opaque object, links out of the file, and no numbers.
    """
    hdf = _HDF in (content[:4], content[512:516])  # what the header says of the version is not always true
    try:
        found = _matlab_7(content) if hdf else _matlab_5(content)
    except InputError:
        raise
    except Exception as error:  # scipy, h5py and mat-io raise many kinds for a file that is cut or wrong
        raise InputError(f"not a valid MAT file: {one_line(f'{type(error).__name__}: {error}', 80)}") from None
    frames = {name: value for name, value in found.items() if hasattr(value, "columns")}
    if frames:
        name = _chosen("variable", frames, choices)
        return [_frame(label, frames[name])]
    arrays = {name: a for name, value in found.items() if (a := _numbers(value)) is not None and a.size > 1}
    objects = [name for name, value in found.items() if type(value).__name__ in ("MatlabOpaque", "MatlabOpaqueArray")]
    if not arrays:
        what = f"opaque objects of MATLAB ({listed(objects)}), which only MATLAB reads; " if objects else ""
        raise InputError(f"{what}no numbers in rows; save them as a matrix, a table or a timetable")
    return [_matrices(label, arrays)]


def _chosen(key: str, known: Mapping[str, Any], choices: Choices) -> str:
    """Return the one that is asked for, or the only one."""
    if not known:
        raise InputError("expected numbers, got none")
    asked = choices.get(key)
    if asked is None and len(known) > 1:
        raise InputError(f"several could be meant: {listed(known)}; say --set {key}={shown(next(iter(known)))}")
    if asked is not None and asked not in known:
        raise InputError(f"expected {listed(known)}, got {shown(asked)}", key=key)
    return str(asked) if asked is not None else next(iter(known))


def _matlab_5(content: bytes) -> dict[str, Any]:
    """Return the variables of a MAT file of version 5; their sizes are looked at before any is read."""
    from scipy.io import loadmat, whosmat

    _refuse_growth(content)
    try:
        listing = whosmat(io.BytesIO(content))
    except TypeError:  # it does not know the shape of a table
        return _by_matio(content)
    plain = {"double", "single", "logical", "char", *(f"{s}int{n}" for s in ("", "u") for n in (8, 16, 32, 64))}
    for name, shape, _ in listing:
        if np.prod([float(n) for n in shape]) > _MOST:
            raise InputError(f"variable {shown(name)} would hold more than {_MOST} numbers")
    if any(kind in ("opaque", "object", "unknown") for _, _, kind in listing):
        return _by_matio(content)
    names = [name for name, _, kind in listing if kind in plain]
    return dict(loadmat(io.BytesIO(content), variable_names=names)) if names else {}


def _refuse_growth(content: bytes) -> None:
    """Raise `InputError` for a file of version 5 whose compressed variables would take too much memory."""
    order: Literal["little", "big"] = "little" if content[126:128] == b"IM" else "big"
    at, left = _HEADER, 8 * _MOST
    while at + 8 <= len(content):
        kind, size = (int.from_bytes(content[at + k : at + k + 4], order) for k in (0, 4))
        if kind == _COMPRESSED:
            left -= len(zlib.decompressobj().decompress(content[at + 8 : at + 8 + size], max(1, left) + 1))
        if left < 0:
            raise InputError(f"its variables would hold more than {_MOST} numbers")
        at += 8 + max(size, 0)


def _matlab_7(content: bytes) -> dict[str, Any]:
    """Return the variables of a MAT file of version 7.3, which is HDF5: its links and sizes are looked at first."""
    import h5py

    with h5py.File(io.BytesIO(content), "r") as file:
        waiting, seen = [file], 0
        while waiting:
            group = waiting.pop()
            for name in group:
                seen += 1
                link = group.get(name, getlink=True)
                if seen > 10_000:
                    raise InputError("more than 10,000 objects in the file")
                if not isinstance(link, h5py.HardLink):
                    raise InputError(f"{shown(name)} is a link, perhaps out of the file, which is not followed")
                value = group[name]
                if isinstance(value, h5py.Group):
                    waiting.append(value)
                elif value.external or value.is_virtual:
                    raise InputError(f"{shown(name)} keeps its numbers in another file, which is not read")
                elif value.size is not None and value.size > _MOST:
                    raise InputError(f"variable {shown(name)} would hold more than {_MOST} numbers")
    return _by_matio(content)


def _by_matio(content: bytes) -> dict[str, Any]:
    """Return variables with tables, timetables and objects among them, of a file of this process's own."""
    try:
        from matio import load_from_mat
    except ImportError:
        raise InputError("this MAT file needs mat-io: pip install 'softnlp[lab]'") from None
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy.mat"
        copy.write_bytes(content)
        return dict(load_from_mat(str(copy)))


def _numbers(value: Any) -> Array | None:
    """Return an array of numbers, None where a value is something else."""
    array = np.asarray(value)
    if array.dtype.kind == "m":
        return np.asarray(array / np.timedelta64(1, "ns"), float) * 1e-9
    if array.dtype.kind == "M":
        return np.asarray((array - array.ravel()[0]) / np.timedelta64(1, "ns"), float) * 1e-9 if array.size else None
    return np.asarray(array, float) if array.dtype.kind in "biuf" and array.ndim <= 2 else None


def _frame(label: str, frame: Any) -> RawTable:
    """Return the columns of a table or timetable; the times of its rows come first."""
    columns: dict[str, Array] = {}
    units: dict[str, Unit | None] = {}
    if np.asarray(frame.index).dtype.kind in "mM":
        times = _numbers(np.asarray(frame.index))
        if times is not None:
            columns["Time"], units["Time"] = times, Unit("time", 1.0, "s")
    for name in frame.columns:
        values = _numbers(frame[name].to_numpy())
        if values is not None:
            columns[str(name)], units[str(name)] = values, None
    return _table(label, columns, units)


def _matrices(label: str, arrays: Mapping[str, Array]) -> RawTable:
    """Return the columns of matrices; those with as many rows as the longest belong together."""
    shaped = {name: a.reshape(-1, 1) if a.ndim < 2 or 1 in a.shape else a for name, a in arrays.items()}
    rows = max(len(a) for a in shaped.values())
    columns: dict[str, Array] = {}
    for name, a in shaped.items():
        if len(a) != rows:
            continue
        plain, unit = split_unit(name)
        ending = "" if unit is None else f"_{unit.name}"
        letters = "xyz" if a.shape[1] == 3 and unit is not None and unit.kind == "length" else ""
        for k in range(a.shape[1]):
            part = "" if a.shape[1] == 1 else letters[k] if letters else f"{k + 1}"
            columns[f"{plain}{part and '_'}{part}{ending}" if part and not letters else f"{part or plain}{ending}"] = a[
                :, k
            ]
    return _table(label, columns, {})


def _table(label: str, columns: Mapping[str, Array], units: Mapping[str, Unit | None]) -> RawTable:
    if not columns:
        raise InputError("expected columns of numbers, got none")
    if len(columns) > MOST_COLUMNS:
        raise InputError(f"expected at most {MOST_COLUMNS} columns, got {len(columns)}")
    rows = max(map(len, columns.values()))
    kept = {name: values for name, values in columns.items() if len(values) == rows}
    split = {name: split_unit(one_line(name, 200)) for name in kept}
    return RawTable(
        file=label,
        names=tuple(split[name][0] for name in kept),
        units=tuple(units.get(name) or split[name][1] for name in kept),
        columns=tuple(kept.values()),
        repeat=np.zeros(rows),
        values={},
        preamble=(),
    )
