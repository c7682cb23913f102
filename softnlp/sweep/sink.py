"""A file for HDF5 to write to that tells its errors afterwards."""

from __future__ import annotations

import os
from io import FileIO
from typing import Any


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
