"""From the bytes of a file to its tables: what kind it is by its first bytes, whatever its name says."""

from __future__ import annotations

import re
from pathlib import Path

from softnlp.base.errors import InputError, located
from softnlp.base.reading import LONGEST_NAME, one_line, read_bytes
from softnlp.laboratory.choices import Choices, NamedError
from softnlp.laboratory.table import RawTable
from softnlp.laboratory.text import text_table

LARGEST = 400_000_000  # bytes
_KNOWN: tuple[tuple[bytes, str], ...] = (
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls); save it as .xlsx or .csv"),
    (b"\x1f\x8b", "a gzip archive; unpack it first"),
    (b"7z\xbc\xaf", "a 7z archive; unpack it first"),
    (b"Rar!", "a rar archive; unpack it first"),
    (b"PAR1", "a Parquet file; write it as .csv"),
    (b"SQLite format 3", "an SQLite database; write its table as .csv"),
    (b"\x93NUMPY", "a NumPy array without names; write it as .csv"),
    (b"#ROSBAG", "a ROS bag; write its topics as .csv"),
    (b"%PDF", "a PDF; the numbers are in the machine's own file"),
    (b"\x89PNG", "a picture"),
    (b"\xff\xd8\xff", "a picture"),
)


def read_tables(folder: Path, file: str, choices: Choices) -> list[RawTable]:
    """Return the tables of a file of any format that is known.

    Raises
    ------
    AskError
        Where it can be read in more than one way.
    InputError
        For a file that cannot be read, or whose format is not one of these; the text names the format.
    """
    label = one_line(file, LONGEST_NAME)
    with located(source=label):
        if file.endswith(".toml"):
            raise NamedError("this is no file of measurements; a recipe of an import names its own and stands alone")
        content = read_bytes(folder / file, LARGEST)
        return _tables(label, content, choices)


def _tables(label: str, content: bytes, choices: Choices) -> list[RawTable]:
    head = content[:600]
    if not content.strip():
        raise InputError("expected rows of numbers, got an empty file")
    if head.startswith(b"version https://git-lfs"):
        size = re.search(rb"size (\d+)", head)
        bytes_of = f" of {int(size[1])} bytes" if size else ""
        raise NamedError(f"a Git LFS pointer to a file{bytes_of}, not the file; git lfs pull fetches it")
    for mark, what in _KNOWN:
        if head.startswith(mark):
            raise NamedError(f"expected text, got binary data: {what}")
    if head[:1] == b"\x80" and head[1:2] in b"\x02\x03\x04\x05":
        raise NamedError("expected text, got binary data: a Python pickle, which could run code; it is never read")
    if head.startswith(b"PK\x03\x04"):
        from softnlp.laboratory.workbook import workbook_tables

        return workbook_tables(label, content, choices)
    if head.startswith(b"TDSm"):
        from softnlp.laboratory.binary import tdms_tables

        return tdms_tables(label, content, choices)
    if head.startswith(b"MATLAB ") or head.startswith(b"\x89HDF") or content[512:516] == b"\x89HDF":
        from softnlp.laboratory.binary import matlab_tables

        return matlab_tables(label, content, choices)
    if label.lower().endswith((".xls", ".xlsx", ".xlsm")):
        choices.take("format", "text", f"it is named {Path(label).suffix} and holds text, no workbook")
    return [text_table(label, content, choices)]
