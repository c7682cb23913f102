"""The journal of a sweep: solved chunks in one sqlite file, kept whatever happens to the process.

A chunk is confirmed once the transaction with it is committed; WAL mode keeps what was committed when the process is
killed at any moment. The file is locked for as long as the sweep runs.
"""

from __future__ import annotations

import json
import os
import sqlite3
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import one_line, shown
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES, Block

FORMAT = 2  # 1, of version 0.1, has fingerprints that change with CasADi
APPLICATION_ID = 0x736E6C70  # "snlp", in the header of the file
COMMIT_EVERY = 0.25  # [s]
_PAGE = 16_384  # bytes; a chunk has some hundred thousand
_FAILED = [k for k, status in enumerate(STATUSES) if not status.has_solution]

_TABLES = (
    "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "CREATE TABLE chunk (number INTEGER PRIMARY KEY, rows BLOB NOT NULL, messages TEXT NOT NULL, "
    "checksum INTEGER NOT NULL)",
)


def identity(plan: Plan, version: str) -> dict[str, str]:
    """Return what a journal must agree with before a sweep is continued, by key of its table `meta`."""
    return {
        "fingerprint": plan.fingerprint(),
        "poses": str(plan.poses),
        "chunk": str(plan.chunk),
        "row_type": json.dumps(plan.row_type.descr),
        "softnlp": version,
    }


class Journal:
    """The open journal of one plan; a context manager, which keeps what was added when it is left.

    path : of the file. done : (chunks,) whether a chunk is confirmed. counts : (statuses,) confirmed poses by how they
    ended, in the order of `STATUSES`. earlier : versions of other packages with which it was written before this time.
    self_intersecting : how many of the confirmed poses pass through themselves.
    """

    def __init__(
        self, path: Path, plan: Plan, version: str, *, resume: bool, versions: Mapping[str, str] = MappingProxyType({})
    ) -> None:
        """Begin a journal, or with `resume` continue one where there is one; `versions` are kept, and may differ.

        Raises
        ------
        InputError
            Where the file cannot be written, is locked by another sweep, is damaged, is not a journal, or is that of
            another plan or version; and without `resume` where a sweep has begun.
        """
        self.path = path
        self._plan = plan
        self._type = plan.row_type
        self._waiting: list[Block] = []
        self._committed = time.monotonic()
        self.done: NDArray[np.bool_] = np.zeros(plan.chunks, bool)
        self.counts: NDArray[np.int64] = np.zeros(len(STATUSES), np.int64)
        self.earlier: list[dict[str, str]] = []
        self.self_intersecting = 0
        with self._named():
            self._file = sqlite3.connect(path, timeout=0.0, isolation_level=None)
        try:
            with self._named():
                self._lock()
                if self._begun():
                    self._compare(identity(plan, version), resume)
                    self._count()
                else:
                    self._begin(identity(plan, version))
                self._keep_versions(dict(versions))
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
            return
        with suppress(InputError):  # the first error says what is wrong
            self.close()

    @property
    def poses(self) -> int:
        """The number of confirmed poses."""
        return int(self.counts.sum())

    @property
    def failed(self) -> int:
        """The number of confirmed poses without a solution."""
        return int(self.counts[_FAILED].sum())

    def add(self, block: Block) -> None:
        """Take the rows of a chunk; they are committed within `COMMIT_EVERY` of each other, at the latest by `commit`.

        Raises
        ------
        InputError
            Where they cannot be written; what was committed before is kept.
        """
        if block.rows.dtype != self._type or block.rows.size != self._plan.members(block.chunk).size:
            raise ValueError(f"rows of another kind than the plan's in chunk {block.chunk}")
        self._waiting.append(block)
        self.tick()

    def tick(self) -> bool:
        """Commit when it is time; return whether something was committed."""
        if self._waiting and time.monotonic() - self._committed >= COMMIT_EVERY:
            self.commit()
            return True
        return False

    def commit(self) -> None:
        """Commit what was added."""
        if not self._waiting:
            return
        with self._named(), self._transaction():
            self._file.executemany("INSERT INTO chunk VALUES (?, ?, ?, ?)", map(_record, self._waiting))
        for block in self._waiting:
            self._confirm(block)
        self._waiting.clear()
        self._committed = time.monotonic()

    def close(self) -> None:
        """Commit what was added and release the file."""
        try:
            self.commit()
        finally:
            with self._named():
                self._file.close()

    def blocks(self, chunks: Iterable[int] | None = None) -> Iterator[Block]:
        """Yield confirmed chunks, all or those named, in the order of their numbers.

        Raises
        ------
        InputError
            For a chunk whose checksum does not match, or which is not there.
        """
        select = "SELECT number, rows, messages, checksum FROM chunk"
        with self._named():
            if chunks is None:
                for record in self._file.execute(f"{select} ORDER BY number"):
                    yield self._block(record)
                return
            for chunk in sorted(chunks):
                found = self._file.execute(f"{select} WHERE number = ?", (chunk,)).fetchone()
                if found is None:
                    raise self._damaged(f"chunk {chunk} is missing")
                yield self._block(found)

    def messages(self) -> Iterator[tuple[int, str]]:
        """Yield (pose, text) of every pose that ended otherwise than solved, chunk by chunk."""
        with self._named():
            for (text,) in self._file.execute("SELECT messages FROM chunk WHERE messages != '[]' ORDER BY number"):
                for pose, message in json.loads(text):
                    yield int(pose), str(message)

    def _lock(self) -> None:
        """Take the file for as long as it is open."""
        for setting in (
            "locking_mode = EXCLUSIVE",
            f"page_size = {_PAGE}",
            "journal_mode = WAL",
            "synchronous = NORMAL",
        ):
            self._file.execute(f"PRAGMA {setting}").fetchall()
        with self._transaction():
            pass

    def _begun(self) -> bool:
        """Whether the file is a journal already; one that was killed before its first commit is not."""
        tables = self._file.execute("SELECT name FROM sqlite_master").fetchall()
        if not tables:
            return False
        if self._pragma("application_id") != APPLICATION_ID:
            raise self._error("this sqlite file is not the journal of a sweep; choose another folder")
        if (found := self._pragma("user_version")) != FORMAT:
            raise self._error(
                f"a journal of format {found}, of softnlp {shown(self._meta().get('softnlp'))}; this version continues "
                f"format {FORMAT}: finish it with that version or begin again in another folder"
            )
        return True

    def _begin(self, told: Mapping[str, str]) -> None:
        with self._transaction():
            for statement in (f"PRAGMA application_id = {APPLICATION_ID}", f"PRAGMA user_version = {FORMAT}", *_TABLES):
                self._file.execute(statement)
            self._file.executemany("INSERT INTO meta VALUES (?, ?)", told.items())

    def _keep_versions(self, now: dict[str, str]) -> None:
        known = json.loads(self._meta().get("versions", "[]"))
        self.earlier = [versions for versions in known if versions != now]
        if now not in known:
            self._file.execute("INSERT OR REPLACE INTO meta VALUES ('versions', ?)", (json.dumps([*known, now]),))

    def _compare(self, told: Mapping[str, str], resume: bool) -> None:
        """Refuse the journal of something else, and one that was not asked for."""
        found = self._meta()
        if not resume:
            count = self._file.execute("SELECT count(*) FROM chunk").fetchone()[0]
            raise self._error(
                f"a sweep has begun here ({count} of {_chunks_of(found)} chunks are solved); resume=True continues it, "
                "another folder leaves it alone, or remove this file to begin again"
            )
        version = found.get("softnlp")
        if version != told["softnlp"]:
            raise self._error(
                f"begun by softnlp {shown(version)}, this is {told['softnlp']}, and results could differ; finish it "
                "with that version or begin again in another folder"
            )
        if any(found.get(key) != value for key, value in told.items()):
            raise self._error(
                "the sweep begun here is of another scenario: something that its results depend on has changed; undo "
                "the change to continue it, or begin again in another folder"
            )

    def _count(self) -> None:
        """Count what is there, which checks every checksum."""
        for block in self.blocks():
            self._confirm(block)

    def _confirm(self, block: Block) -> None:
        self.done[block.chunk] = True
        self.counts += np.bincount(block.rows["status"], minlength=len(STATUSES))
        self.self_intersecting += int(np.count_nonzero(block.rows["self_intersecting"] == 1))

    def _block(self, record: tuple[Any, ...]) -> Block:
        """Return a chunk of a record."""
        chunk, content, messages, checksum = record
        known = isinstance(chunk, int) and 0 <= chunk < self._plan.chunks and isinstance(content, bytes)
        if not known or _checksum(chunk, content, str(messages)) != checksum:
            raise self._damaged(f"the checksum of chunk {chunk} does not match")
        rows = np.frombuffer(content, self._type)
        if not np.array_equal(rows["pose"], self._plan.members(chunk)):
            raise self._damaged(f"chunk {chunk} has other poses than the plan")
        return Block(chunk, rows, tuple((int(pose), str(text)) for pose, text in json.loads(messages)))

    def _meta(self) -> dict[str, str]:
        return dict(self._file.execute("SELECT key, value FROM meta").fetchall())

    def _pragma(self, name: str) -> Any:
        return self._file.execute(f"PRAGMA {name}").fetchone()[0]

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Commit at the end, or nothing at all."""
        self._file.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._file.execute("COMMIT")
        except BaseException:
            with suppress(sqlite3.Error):
                self._file.execute("ROLLBACK")
            raise

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Turn what sqlite raises into one line that says what to do."""
        try:
            yield
        except sqlite3.Error as error:
            raise self._error(self._reason(error)) from None

    def _reason(self, error: sqlite3.Error) -> str:
        name = getattr(error, "sqlite_errorname", "") or ""
        kept = f"{self.poses} poses are kept, and resume=True goes on from them"
        if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
            return "another sweep is writing here; wait for it, or choose another folder"
        if name == "SQLITE_FULL":
            return f"cannot be written, the disk is full; {kept}"
        if not _writable(self.path.parent):
            return "cannot be written: its folder is read-only"
        if name.startswith(("SQLITE_CANTOPEN", "SQLITE_READONLY", "SQLITE_PERM")):
            return f"cannot be written ({one_line(str(error))})"
        if name.startswith(("SQLITE_NOTADB", "SQLITE_CORRUPT")):
            return f"damaged or not the journal of a sweep ({one_line(str(error))}); choose another folder"
        if name.startswith("SQLITE_IOERR"):
            return f"cannot be read or written ({one_line(str(error))}): the disk may be full or failing; {kept}"
        return f"cannot be used ({one_line(str(error))})"

    def _damaged(self, what: str) -> InputError:
        return self._error(f"damaged: {what}; move it away to begin again")

    def _error(self, message: str) -> InputError:
        return InputError(message, source=str(self.path))


def _writable(folder: Path) -> bool:
    """Whether this process may write into a folder."""
    return os.access(folder, os.W_OK | os.X_OK, effective_ids=os.access in os.supports_effective_ids)


def _record(block: Block) -> tuple[int, bytes, str, int]:
    content, messages = block.rows.tobytes(), json.dumps(block.messages)
    return block.chunk, content, messages, _checksum(block.chunk, content, messages)


def _checksum(chunk: int, content: bytes, messages: str) -> int:
    return zlib.crc32(messages.encode(), zlib.crc32(content, chunk & 0xFFFFFFFF))


def _chunks_of(meta: Mapping[str, str]) -> str:
    """Return the number of chunks that a journal's plan has."""
    try:
        return str(-(-int(meta["poses"]) // int(meta["chunk"])))
    except (KeyError, ValueError, ZeroDivisionError):
        return "?"
