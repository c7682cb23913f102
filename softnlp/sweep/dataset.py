"""The result of a sweep as a self-describing netCDF file, made from its journal in little memory."""

from __future__ import annotations

import csv
import hashlib
import os
from collections.abc import Iterator, Mapping
from io import FileIO
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Index
from softnlp.base.columns import by_key
from softnlp.base.files import placed_whole
from softnlp.base.netcdf import as_characters, encoded, put, put_attributes, put_characters, said
from softnlp.batch.plan import Plan
from softnlp.batch.poses import Rows
from softnlp.model.inputs import file_attributes
from softnlp.model.obstacle_tables import obstacle_tables
from softnlp.sweep.columns import CONTACTS, LONGEST_STATUS, TEXT, Column, columns
from softnlp.sweep.journal import Journal

MEMORY = 128 * 2**20
"""Bytes of rows that are put in the order of the plan at once."""

_TEXTS_AT_ONCE = 65_536
_AXES = ("x", "y", "z")


def write_workspace(path: str | PathLike[str], plan: Plan, journal: Journal, about: Mapping[str, Any]) -> Path:
    """Write every pose of a finished journal as netCDF, whole or not at all; return its path.

    Dimensions: `pose`, `set` and `chamber` count from 1; `axis`, `row` (world) and `col` (body) are x, y, z; `unsolved`
    are the poses that ended otherwise than solved, with what was said of each. Poses stand in the order of the plan.

    Parameters
    ----------
    about : further attributes of the file.

    Raises
    ------
    InputError
        When the journal is damaged or the file cannot be written.
    """
    import h5netcdf

    listed = columns(plan)
    own: dict[str, Any] = {"varied": list(plan.varied)}
    if plan.obstacles:
        own["obstacles"] = obstacle_tables(plan.obstacles)
    asked = file_attributes("workspace", plan.model, plan.loads, plan.contact, own, fingerprint=plan.fingerprint())
    with placed_whole(path) as part, part.open("w+b", buffering=0) as raw:
        # HDF5 that writes to a full disk by itself ends the interpreter.
        sink = Sink(raw)
        try:
            with h5netcdf.File(sink, "w") as file:
                put_attributes(file, asked | dict(about))
                _declare(file, plan, listed)
                sink.check()
                for numbers, rows in _slabs(plan, journal, MEMORY):
                    for column in listed:
                        values = column.of(rows, numbers)
                        if column.kind == TEXT:
                            values = as_characters(values.astype(f"S{LONGEST_STATUS}"))
                        file.variables[column.name][numbers[0] : numbers[-1] + 1] = values
                        sink.check()
                _write_messages(file, journal, sink)
        finally:
            sink.check()  # what the disk said comes before what HDF5 made of it
    return Path(path)


def write_csv(path: str | PathLike[str], plan: Plan, journal: Journal) -> Path:
    """Write every pose of a finished journal as a row of CSV, whole or not at all; return its path.

    Columns are those of the netCDF file, `p1_bar`, `tip_position_x_mm`, `chamber_length_1_mm` and so on where it has
    several numbers a pose; what a pose without a solution does not have is empty.

    Raises
    ------
    InputError
        As `write_workspace`.
    """
    listed = columns(plan)
    sizes = _sizes(plan)
    with placed_whole(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["pose", *(name for column in listed for name in _names(column, sizes))])
        for numbers, rows in _slabs(plan, journal, MEMORY // 16):
            cells: list[list[Any]] = [(numbers + 1).tolist()]
            for column in listed:
                values = column.of(rows, numbers).reshape(rows.size, -1)
                cells += [_cells(entry) for entry in values.T]
            table.writerows(zip(*cells, strict=True))
    return Path(path)


def data_hash(path: str | PathLike[str]) -> str:
    """Return a digest of every variable of a netCDF file: names, dimensions, types and values, without attributes."""
    import h5netcdf

    digest = hashlib.sha256()
    with h5netcdf.File(path, "r", decode_vlen_strings=True) as file:
        for name in sorted(file.variables):
            variable = file.variables[name]
            digest.update(f"{name} {variable.dimensions} {variable.shape} {variable.dtype}\n".encode())
            for start in range(0, variable.shape[0], _TEXTS_AT_ONCE):
                values = np.asarray(variable[start : start + _TEXTS_AT_ONCE])
                if values.dtype.kind == "O":  # of a file of version 0.1
                    digest.update("\0".join(map(str, values.tolist())).encode())
                else:
                    digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def fingerprint_of(path: str | PathLike[str]) -> str | None:
    """Return the fingerprint of the plan that a result file belongs to, None where there is no such file."""
    import h5netcdf

    try:
        with h5netcdf.File(path, "r") as file:
            return str(file.attrs["fingerprint"])
    except (OSError, KeyError):
        return None


class Sink:
    """A file that HDF5 writes through Python: the first OSError is kept, and writing goes on as if into the void.

    An error inside HDF5's own calls leaves its library in a state in which closing the file can end the interpreter.
    `check` raises what was kept.
    """

    def __init__(self, file: FileIO) -> None:
        self._file = file
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the first error of the file."""
        if self._error is not None:
            raise self._error

    def write(self, content: Any) -> int:
        """Write all of it."""
        rest = memoryview(content).cast("B")
        size = len(rest)
        try:
            while rest and self._error is None:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self._error = error
        return size

    def read(self, size: int) -> bytes:
        """Return so many bytes; those that cannot be read are zero."""
        content = bytearray(size)
        self.readinto(content)
        return bytes(content)

    def readinto(self, buffer: Any) -> int:
        """Fill the buffer; what cannot be read is zero."""
        rest = memoryview(buffer).cast("B")
        size = len(rest)
        try:
            while rest and self._error is None and (count := self._file.readinto(rest)):
                rest = rest[count:]
        except OSError as error:
            self._error = error
        rest[:] = bytes(len(rest))
        return size

    def seek(self, position: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place of the file."""
        return self._file.seek(position, whence)

    def tell(self) -> int:
        """Return the place in the file."""
        return self._file.tell()

    def truncate(self, size: int) -> int:
        """Cut the file, or make it longer."""
        try:
            return self._file.truncate(size) if self._error is None else size
        except OSError as error:
            self._error = error
            return size

    def flush(self) -> None:
        """Nothing is kept back."""


def _sizes(plan: Plan) -> dict[str, int]:
    robot = plan.model.robot
    sizes = {"set": robot.chamber_sets, "axis": 3, "row": 3, "col": 3, "chamber": robot.chambers}
    return sizes | ({"obstacle": len(plan.obstacles)} if plan.obstacles else {})


def _declare(file: Any, plan: Plan, listed: tuple[Column, ...]) -> None:
    """Make the dimensions, their coordinates and every variable."""
    sizes = {"pose": plan.poses, **_sizes(plan)}
    file.dimensions = sizes
    for name, meaning in (("pose", "pose of the sweep"), ("set", "chamber set"), ("chamber", "chamber, set by set")):
        numbers = np.arange(1, sizes[name] + 1, dtype=np.int64)
        put(file, name, (name,), numbers, said("1", f"{meaning}, from 1"))
    for name, meaning in (("axis", "axis"), ("row", "world axis"), ("col", "body axis")):
        put(file, name, (name,), np.array(_AXES), said("1", meaning))
    if plan.obstacles:
        numbers = np.arange(1, sizes["obstacle"] + 1, dtype=np.int64)
        put(file, "obstacle", ("obstacle",), numbers, said("1", "obstacle, from 1 in the order of the attribute"))
    for column in listed:
        dims, attributes = ("pose", *column.dims), said(column.unit, column.meaning, **column.more)
        if column.kind == TEXT:
            put_characters(file, column.name, dims, LONGEST_STATUS, attributes)
        else:
            put_attributes(file.create_variable(column.name, dims, column.kind), attributes)


def _slabs(plan: Plan, journal: Journal, memory: int) -> Iterator[tuple[Index, Rows]]:
    """Yield the numbers and the rows of consecutive poses, in the order of the plan."""
    kind = plan.row_type
    size = max(plan.chunk, memory // kind.itemsize)
    place = np.empty(plan.poses, np.int64)
    place[plan.order] = np.arange(plan.poses)
    whole = f"V{kind.itemsize}"  # rows are moved as bytes, not field by field
    for start in range(0, plan.poses, size):
        stop = min(start + size, plan.poses)
        rows = np.empty(stop - start, kind)
        everything = stop - start == plan.poses
        for block in journal.blocks(None if everything else np.unique(place[start:stop] // plan.chunk).tolist()):
            numbers, given = block.rows["pose"], block.rows.view(whole)
            if not everything:
                inside = (numbers >= start) & (numbers < stop)
                numbers, given = numbers[inside], given[inside]
            rows.view(whole)[numbers - start] = given
        yield np.arange(start, stop, dtype=np.int64), rows


def _write_messages(file: Any, journal: Journal, sink: Sink) -> None:
    """Write what was said of poses that ended otherwise than solved, in the order in which they were walked."""
    lengths = [len(text.encode()) for _, text in journal.messages()]
    if not lengths:
        return
    file.dimensions["unsolved"] = len(lengths)
    poses = file.create_variable("unsolved_pose", ("unsolved",), "i8")
    put_attributes(poses, said("1", "pose that ended otherwise than solved, from 1"))
    about = said("1", "how it ended, in words")
    width = max(1, *lengths)
    texts = put_characters(file, "unsolved_message", ("unsolved",), width, about)
    told = journal.messages()
    for start in range(0, len(lengths), _TEXTS_AT_ONCE):
        part = list(islice(told, _TEXTS_AT_ONCE))
        poses[start : start + len(part)] = np.array([pose + 1 for pose, _ in part], np.int64)
        texts[start : start + len(part)] = as_characters(encoded((text for _, text in part), width))
        sink.check()


def _names(column: Column, sizes: Mapping[str, int]) -> list[str]:
    """Return the CSV columns of a variable; those with dimensions are outputs."""
    outputs = {output.key: output for output in CONTACTS}
    output = (by_key(column.name) or outputs.get(column.name)) if column.dims else None
    return [column.name] if output is None else output.keys(sizes)


def _cells(values: NDArray[Any]) -> list[Any]:
    """Return a column as Python values, None where there is no number."""
    cells: list[Any] = values.tolist()
    return cells if values.dtype.kind != "f" else [None if value != value else value for value in cells]
