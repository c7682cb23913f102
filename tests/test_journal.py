"""The journal keeps what it confirmed, byte for byte, and names what is wrong with it."""

from __future__ import annotations

import os
import sqlite3
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sweeps import GRID, in_child, made_up, plan, read_only

from softnlp.base.errors import InputError
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES, Block
from softnlp.sweep.journal import Journal

PLAN = plan()  # 27 poses in 7 chunks, the last of 3
VERSION = "1.2.3"


def opened(folder: Path, plan: Plan = PLAN, version: str = VERSION, *, resume: bool = True) -> Journal:
    return Journal(folder / "journal.sqlite", plan, version, resume=resume)


def filled(folder: Path, chunks: int = 7) -> Path:
    with opened(folder) as journal:
        for chunk in range(chunks):
            journal.add(made_up(PLAN, chunk))
    return folder / "journal.sqlite"


def same(one: Block, other: Block) -> bool:
    return (one.chunk, one.messages, one.rows.tobytes()) == (other.chunk, other.messages, other.rows.tobytes())


@st.composite
def any_blocks(draw: st.DrawFn) -> list[Block]:
    """Return some chunks of the plan, in any order, with any bytes that their type can hold."""
    blocks = []
    for chunk in draw(st.lists(st.integers(0, PLAN.chunks - 1), unique=True, max_size=PLAN.chunks)):
        numbers = PLAN.members(chunk)
        size = numbers.size * PLAN.row_type.itemsize
        rows = draw(hnp.arrays(np.uint8, size)).view(PLAN.row_type).copy()
        rows["pose"] = numbers
        rows["status"] = draw(hnp.arrays(np.int8, numbers.size, elements=st.integers(0, len(STATUSES) - 1)))
        text = st.text(st.characters(codec="utf-8"), max_size=20)
        told = draw(st.lists(st.tuples(st.sampled_from(numbers.tolist()), text), max_size=3))
        blocks.append(Block(chunk, rows, tuple(told)))
    return blocks


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(blocks=any_blocks(), cut=st.integers(0, 7))
def test_what_goes_in_comes_out(blocks: list[Block], cut: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Over two sessions, NaNs of every kind included."""
    folder = tmp_path_factory.mktemp("journal")
    for part in (blocks[:cut], blocks[cut:]):
        with opened(folder) as journal:
            for block in part:
                journal.add(block)
    with opened(folder) as journal:
        found = list(journal.blocks())
        assert [b.chunk for b in found] == sorted(b.chunk for b in blocks)
        assert all(same(b, next(o for o in blocks if o.chunk == b.chunk)) for b in found)
        assert set(np.flatnonzero(journal.done)) == {b.chunk for b in blocks}
        assert journal.poses == sum(b.rows.size for b in blocks)
        assert journal.failed == sum(not STATUSES[s].has_solution for b in blocks for s in b.rows["status"])
        assert list(journal.messages()) == [m for b in found for m in b.messages]


def test_named_chunks_alone_are_read(tmp_path: Path) -> None:
    filled(tmp_path)
    with opened(tmp_path) as journal:
        assert [b.chunk for b in journal.blocks([5, 2])] == [2, 5]


def dies(folder: Path, committed: int, more: int) -> None:
    journal = opened(folder)
    for chunk in range(committed + more):
        journal._waiting.append(made_up(PLAN, chunk))  # not `add`, which may commit by time
        if chunk == committed - 1:
            journal.commit()
    os._exit(0)


@pytest.mark.parametrize("committed", [0, 3, 7])
def test_a_process_that_ends_anyhow_keeps_what_was_committed_and_nothing_else(tmp_path: Path, committed: int) -> None:
    assert in_child(dies, tmp_path, committed, 7 - committed) == ""
    with opened(tmp_path) as journal:
        assert [b.chunk for b in journal.blocks()] == list(range(committed))
        assert journal.poses == min(27, 4 * committed)


def test_an_error_while_it_is_open_keeps_what_was_added(tmp_path: Path) -> None:
    with suppress(RuntimeError), opened(tmp_path) as journal:
        journal.add(made_up(PLAN, 1))
        raise RuntimeError
    with opened(tmp_path) as journal:
        assert journal.done.tolist() == [False, True, *[False] * 5]


def test_it_commits_by_itself_as_time_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr("softnlp.sweep.journal.time.monotonic", lambda: now)
    with opened(tmp_path) as journal:
        journal.add(made_up(PLAN, 0))
        assert not journal.tick()
        now = 0.3
        assert journal.tick()
        assert not journal.tick()
        assert journal.poses == 4
        now = 0.6
        journal.add(made_up(PLAN, 1))
        assert journal.poses == 8


def test_rows_of_another_plan_are_a_mistake_of_the_caller(tmp_path: Path) -> None:
    with opened(tmp_path) as journal, pytest.raises(ValueError, match="chunk 0"):
        journal.add(Block(0, made_up(PLAN, 0).rows[:3], ()))


# --- refusals: one line that names the file ---


def refused(folder: Path, *words: str, plan: Plan = PLAN, version: str = VERSION, resume: bool = True) -> str:
    with pytest.raises(InputError) as caught:
        opened(folder, plan, version, resume=resume)
    told = str(caught.value)
    assert told.startswith(f"{folder / 'journal.sqlite'}: ")
    assert "\n" not in told
    assert told.isprintable()
    for word in words:
        assert word in told
    return told


def try_to_open(folder: Path) -> str:
    with opened(folder) as journal:
        return f"{journal.poses} poses"


def test_one_sweep_at_a_time(tmp_path: Path) -> None:
    with opened(tmp_path) as journal:
        journal.add(made_up(PLAN, 0))
        journal.commit()
        assert "another sweep is writing here" in in_child(try_to_open, tmp_path)
        refused(tmp_path, "another sweep is writing here")
    assert in_child(try_to_open, tmp_path) == "4 poses"


def test_a_sweep_that_has_begun_is_not_begun_again(tmp_path: Path) -> None:
    filled(tmp_path, 2)
    told = refused(tmp_path, "2 of 7 chunks", "; resume=True continues it, another folder leaves it", resume=False)
    assert "--" not in told  # which Python does not have
    assert in_child(try_to_open, tmp_path) == "8 poses"


def test_a_file_that_was_killed_before_its_first_commit_begins_anew(tmp_path: Path) -> None:
    (tmp_path / "journal.sqlite").touch()
    with opened(tmp_path, resume=False) as journal:
        assert journal.poses == 0


@pytest.mark.parametrize(
    "other",
    [
        plan(GRID.replace("1.2", "1.25")),
        plan(chunk=5),
        plan(GRID + '[gravity]\ndirection = "-z"\n'),
        replace(PLAN, order=PLAN.order[::-1]),
    ],
    ids=["pressures", "chunk", "solver", "order"],
)
def test_a_changed_scenario_is_refused(tmp_path: Path, other: Plan) -> None:
    before = filled(tmp_path, 2).read_bytes()
    refused(tmp_path, "another scenario", plan=other)
    assert (tmp_path / "journal.sqlite").read_bytes() == before


def test_another_version_is_refused(tmp_path: Path) -> None:
    filled(tmp_path, 2)
    refused(tmp_path, "softnlp '1.2.3'", "this is 1.3.0", version="1.3.0")


def test_other_versions_beside_are_kept_and_told_and_change_nothing(tmp_path: Path) -> None:
    def written_with(casadi: str) -> list[dict[str, str]]:
        with Journal(tmp_path / "j.sqlite", PLAN, VERSION, resume=True, versions={"casadi": casadi}) as journal:
            return journal.earlier

    assert written_with("3.8.0") == []
    assert written_with("3.8.0") == []
    assert written_with("3.9.0") == [{"casadi": "3.8.0"}]
    assert written_with("3.8.0") == [{"casadi": "3.9.0"}]
    assert written_with("4.0.0") == [{"casadi": "3.8.0"}, {"casadi": "3.9.0"}]


def test_a_journal_of_version_0_1_is_refused_by_name(tmp_path: Path) -> None:
    """Its fingerprint may be another one for the same sweep."""
    path = filled(tmp_path, 2)
    with sqlite3.connect(path) as file:
        file.execute("PRAGMA user_version = 1")
        file.execute("UPDATE meta SET value = '0.1.0' WHERE key = 'softnlp'")
    file.close()
    refused(tmp_path, "a journal of format 1, of softnlp '0.1.0'", "finish it with that version or begin again")


def test_files_that_are_no_journal(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    for content in (
        b"my notes, long enough to be looked at as a database by sqlite\n" * 30,
        b"SQLite format 3\0" * 500,
    ):
        path.write_bytes(content)
        refused(tmp_path, "not the journal")
        assert path.read_bytes() == content
    path.unlink()
    with sqlite3.connect(path) as file:
        file.execute("CREATE TABLE mine (x)")
    file.close()
    refused(tmp_path, "not the journal of a sweep")
    path.unlink()
    path.mkdir()
    refused(tmp_path, "cannot be written")


def test_another_format_is_named(tmp_path: Path) -> None:
    path = filled(tmp_path, 1)
    with sqlite3.connect(path) as file:
        file.execute("PRAGMA user_version = 7")
    file.close()
    refused(tmp_path, "format 7")


def test_a_byte_that_changed_is_found(tmp_path: Path) -> None:
    path = filled(tmp_path)
    content = bytearray(path.read_bytes())
    rows = made_up(PLAN, 3).rows.tobytes()
    place = content.index(rows) + len(rows) // 2
    content[place] ^= 1
    path.write_bytes(bytes(content))
    refused(tmp_path, "damaged", "chunk 3")


def test_a_file_cut_short_is_found(tmp_path: Path) -> None:
    path = filled(tmp_path)
    path.write_bytes(path.read_bytes()[:-16_384])
    refused(tmp_path, "damaged")


def test_poses_of_another_chunk_are_found(tmp_path: Path) -> None:
    path = filled(tmp_path)
    with sqlite3.connect(path) as file:
        file.execute("DELETE FROM chunk WHERE number = 1")
        file.execute("UPDATE chunk SET number = 1 WHERE number = 2")
    file.close()
    refused(tmp_path, "damaged", "chunk 1")


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    with read_only(tmp_path):
        refused(tmp_path, "cannot be written")
    filled(tmp_path, 2)
    (tmp_path / "journal.sqlite").chmod(0o444)
    with read_only(tmp_path):
        refused(tmp_path, "cannot be written")
    (tmp_path / "journal.sqlite").chmod(0o644)
    assert in_child(try_to_open, tmp_path) == "8 poses"


def fill_up(folder: Path, wide: Plan) -> None:
    with Journal(folder / "journal.sqlite", wide, VERSION, resume=True) as journal:
        for chunk in np.flatnonzero(~journal.done):
            journal.add(made_up(wide, int(chunk)))
            journal.commit()


@pytest.mark.parametrize("size", [1_000, 40_000, 300_000, 700_000])
def test_a_full_disk_is_named_and_loses_nothing(tmp_path: Path, size: int) -> None:
    """The process may not make a file larger than `size`, which sqlite meets as it meets a full disk."""
    wide = plan(GRID.replace("levels = 3", "levels = 16"), chunk=256)
    told = in_child(fill_up, tmp_path, wide, file_size=size)
    assert told.startswith(f"InputError: {tmp_path / 'journal.sqlite'}: ")
    assert "disk" in told
    with Journal(tmp_path / "journal.sqlite", wide, VERSION, resume=True) as journal:
        kept = list(journal.blocks())
        assert size < 100_000 or kept
        assert all(same(block, made_up(wide, block.chunk)) for block in kept)
        assert len(kept) < wide.chunks
    fill_up(tmp_path, wide)
    with Journal(tmp_path / "journal.sqlite", wide, VERSION, resume=True) as journal:
        assert journal.done.all()
