"""Running sweeps: the same result whoever solves and whatever happens, and everything that goes wrong named."""

from __future__ import annotations

import csv
import json
import multiprocessing
import os
import re
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from sweeps import GRID, HEAD, QUICK, MadeUpSolver, in_child, made_up, plan, read_only

sys.path.insert(0, str(Path(__file__).parents[1]))  # benchmarks/ is not installed

from softnlp.base.errors import InputError, reworded
from softnlp.base.status import Status
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.batch.plan import Plan
from softnlp.batch.poses import Block
from softnlp.cli import main
from softnlp.cli.sweep import _OPTIONS
from softnlp.model.rod import Loads
from softnlp.scenario.read import load_scenario
from softnlp.scenario.workspace import run_sweep
from softnlp.statics.solver import PoseSolver
from softnlp.sweep import pool
from softnlp.sweep.audit import Audit
from softnlp.sweep.dataset import data_hash, write_csv, write_workspace
from softnlp.sweep.journal import Journal
from softnlp.sweep.run import CSV_FILE, JOURNAL_FILE, WORKSPACE_FILE, SweepError, SweepProgress

VARIED = (
    "[workspace]\nlevels = 2\nto_bar = 0.9\nsets = [1]\n[workspace.vary]\n"
    'robot.length_mm = { from = 40, to = 60, levels = 3 }\n"tip_load.force_z_N" = { values = [0.0, -0.05] }\n'
)
REAL = plan(VARIED + QUICK, chunk=3)  # 12 poses in 4 chunks
MADE_UP = plan(GRID, chunk=4)  # 27 poses in 7 chunks
Cli = Callable[..., tuple[int, str, str]]


@pytest.fixture
def no_solving(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make rows up in this process and in those that are forked from it."""
    use(monkeypatch, MadeUpSolver)


def use(monkeypatch: pytest.MonkeyPatch, solver: type[Any]) -> None:
    monkeypatch.setattr("softnlp.sweep.run.ChunkSolver", solver)
    monkeypatch.setattr("softnlp.sweep.pool.ChunkSolver", solver)
    monkeypatch.setattr("softnlp.sweep.pool._solvers", {})
    monkeypatch.setattr("softnlp.sweep.run.audit", lambda plan, journal, stop: Audit())  # IPOPT would not confirm them
    monkeypatch.setattr(pool, "process_context", lambda: multiprocessing.get_context("fork"))


@pytest.fixture
def cli(capfd: pytest.CaptureFixture[str]) -> Cli:
    def call(*words: str | Path) -> tuple[int, str, str]:
        status = main([str(word) for word in words])
        return status, *capfd.readouterr()

    return call


def opened(folder: Path) -> xr.Dataset:
    return xr.load_dataset(folder / WORKSPACE_FILE, engine="h5netcdf")


# --- the same result, whoever solves ---


@pytest.fixture(scope="module")
def solved_here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweep") / "here"
    summary = run_sweep(REAL, folder, workers=1)
    assert (summary.poses, summary.done, summary.failed, summary.already) == (12, 12, 0, 0)
    assert not summary.stopped
    assert summary.written == (folder / WORKSPACE_FILE,)
    return folder


def test_two_workers_give_the_same_bits(solved_here: Path, tmp_path: Path) -> None:
    run_sweep(REAL, tmp_path, workers=2)
    assert data_hash(tmp_path / WORKSPACE_FILE) == data_hash(solved_here / WORKSPACE_FILE)


def test_workers_that_are_not_forked_give_the_same_bits(solved_here: Path, tmp_path: Path) -> None:
    """As where threads run already; the plan is then pickled."""
    ended = threading.Event()
    thread = threading.Thread(target=ended.wait)
    thread.start()
    try:
        assert pool.process_context().get_start_method() != "fork"
        run_sweep(REAL, tmp_path, workers=2)
    finally:
        ended.set()
        thread.join()
    assert data_hash(tmp_path / WORKSPACE_FILE) == data_hash(solved_here / WORKSPACE_FILE)


@pytest.mark.parametrize("kind", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_any_executor_will_do(kind: Any, tmp_path: Path, no_solving: None) -> None:
    with kind(2) as executor:
        run_sweep(MADE_UP, tmp_path / "a", executor=executor)
        assert executor.submit(abs, -1).result() == 1  # it is left open
    run_sweep(MADE_UP, tmp_path / "b")
    assert data_hash(tmp_path / "a" / WORKSPACE_FILE) == data_hash(tmp_path / "b" / WORKSPACE_FILE)


def test_dask_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"install softnlp\[cluster\]"), pool.cluster_executor("tcp://x:1"):
        pass


def test_advice_and_keys_are_told_as_the_options_of_the_command() -> None:
    for error, told in (
        (
            InputError("it is so; resume=True continues it", key="executor"),
            "--cluster: it is so; --resume continues it",
        ),
        (
            SweepError("the executor lost its workers; resume=True goes on"),
            "the executor lost its workers; --resume goes on",
        ),
    ):
        with pytest.raises(type(error)) as caught, reworded(_OPTIONS):
            raise error
        assert str(caught.value) == told


# --- what the file holds ---


def test_every_pose_is_the_one_that_the_statics_solve(solved_here: Path) -> None:
    """Checked against poses that are solved each from nothing, for the robot and the load that its variables name."""
    found = opened(solved_here)
    assert (found.status == "solved").all()
    assert sorted(set(found.robot_length_mm.values)) == [40, 50, 60]
    assert sorted(set(found.tip_load_force_z_N.values)) == [-0.05, 0]
    model = REAL.model
    for k in (5, 10):
        pose = found.isel(pose=k)
        robot = replace(model.robot, length=float(pose.robot_length_mm) * MILLIMETRE)
        force = [float(pose[f"tip_load_force_{x}_N"]) for x in "xyz"]
        solver = PoseSolver(replace(model, robot=robot), REAL.numerics)
        step, _ = solver.solve(pose.pressure_bar.values * BAR, Loads(force, (0.0, 0.0, 0.0), REAL.loads.gravity))
        assert step.status is Status.SOLVED
        assert step.pose is not None
        np.testing.assert_allclose(pose.tip_position_mm, step.pose.tip_position / MILLIMETRE, atol=1e-5)
        np.testing.assert_allclose(pose.tip_rotation, step.pose.tip_rotation, atol=1e-7)
        np.testing.assert_allclose(pose.chamber_length_mm, step.pose.chamber_length / MILLIMETRE, atol=1e-5)
        np.testing.assert_allclose(
            [pose.bending_angle_deg, pose.tilt_deg], np.rad2deg([step.pose.bending_angle, step.pose.tilt]), atol=1e-5
        )
        assert float(pose.residual) <= 1e-8
        assert int(pose.stable) == step.pose.stable


def test_every_variable_says_what_it_is(solved_here: Path) -> None:
    found = opened(solved_here)
    for name, variable in found.variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs["units"], name
    assert dict(found.sizes) == {"pose": 12, "set": 3, "axis": 3, "row": 3, "col": 3, "chamber": 6}
    assert found.attrs["fingerprint"] == REAL.fingerprint()
    assert found.attrs["study"] == "workspace"
    assert json.loads(found.attrs["robot"])["outer_diameter_mm"] == 25
    assert found.tip_position_mm.dims == ("pose", "axis")
    assert found.pressure_bar.dims == ("pose", "set")


def filled(folder: Path, plan: Plan) -> Journal:
    journal = Journal(folder / JOURNAL_FILE, plan, "1", resume=False)
    for chunk in reversed(range(plan.chunks)):
        journal.add(made_up(plan, chunk))
    journal.commit()
    return journal


@pytest.mark.parametrize("memory", [1, 2**30], ids=["a chunk at a time", "all at once"])
@pytest.mark.parametrize(
    "tables", [GRID, GRID + '[contact]\nclosure = "free"\n', "[workspace]\nsamples = 23\nto_bar = 1\n"]
)
def test_rows_stand_in_the_order_of_the_plan(
    tables: str, memory: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("softnlp.sweep.dataset.MEMORY", memory)
    wanted = plan(tables)
    assert not np.array_equal(wanted.order, np.arange(wanted.poses))
    with filled(tmp_path, wanted) as journal:
        write_workspace(tmp_path / WORKSPACE_FILE, wanted, journal, {"scenario": "x" * 100_000})
        write_csv(tmp_path / CSV_FILE, wanted, journal)
    rows = np.concatenate([made_up(wanted, chunk).rows for chunk in range(wanted.chunks)])
    rows = rows[np.argsort(rows["pose"])]
    found = opened(tmp_path)
    assert len(found.attrs["scenario"]) == 100_000
    np.testing.assert_array_equal(found.pose, np.arange(1, wanted.poses + 1))
    np.testing.assert_allclose(found.pressure_bar, wanted.pressures() / BAR, rtol=1e-12)
    np.testing.assert_array_equal(found.tip_position_mm, rows["tip_position"] / MILLIMETRE)
    np.testing.assert_array_equal(found.residual, rows["residual"])
    np.testing.assert_array_equal(found.status == "solved", rows["pose"] % 5 != 4)
    assert set(found.status.values[4::5]) == {"diverged"}
    assert np.isnan(found.bending_angle_deg.values[4::5]).all()
    assert ("blocked_force_N" in found) == (wanted.contact is not None)
    if wanted.contact is not None:
        np.testing.assert_array_equal(found.gap_mm, rows["gap"] / MILLIMETRE)
    assert sorted(found.unsolved_pose.values - 1) == list(range(4, wanted.poses, 5))
    for pose, text in zip(found.unsolved_pose.values, found.unsolved_message.values, strict=True):
        assert text == f"pose {pose - 1} did not, ∂x\n"
    with (tmp_path / CSV_FILE).open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == wanted.poses
    for k in (0, 4, 13):
        assert lines[k]["status"] == str(found.status.values[k])
        assert float(lines[k]["p2_bar"]) == found.pressure_bar.values[k, 1]
        for name, value in (
            ("tip_position_y_mm", found.tip_position_mm.values[k, 1]),
            ("chamber_length_6_mm", found.chamber_length_mm.values[k, 5]),
            ("tip_rotation_z_x", found.tip_rotation.values[k, 2, 0]),
        ):
            assert lines[k][name] == ("" if np.isnan(value) else repr(float(value)))


def test_the_hash_sees_every_number(tmp_path: Path) -> None:
    hashes = set()
    for k, wanted in enumerate((MADE_UP, plan(GRID, chunk=5), plan(GRID.replace("1.2", "1.1")))):
        folder = tmp_path / str(k)
        folder.mkdir()
        with filled(folder, wanted) as journal:
            write_workspace(folder / WORKSPACE_FILE, wanted, journal, {"created": str(k)})
            write_workspace(folder / "again.nc", wanted, journal, {"created": "else"})
        hashes.add(data_hash(folder / WORKSPACE_FILE))
        assert data_hash(folder / "again.nc") in hashes
    assert len(hashes) == 3


# --- stopped, killed, continued ---


def test_a_stopped_sweep_goes_on_and_ends_in_the_same_file(tmp_path: Path, no_solving: None) -> None:
    single = replace(MADE_UP, chunk=1)  # so many chunks that they are not all given out at once
    run_sweep(single, tmp_path / "whole")
    for workers, answers in ((1, [False, False, True]), (2, [True])):
        folder = tmp_path / str(workers)
        asked = iter(answers + [True] * 99)
        summary = run_sweep(single, folder, workers=workers, stop=lambda asked=asked: next(asked))
        assert summary.stopped
        assert summary.written == ()
        assert summary.done < 27
        news: list[SweepProgress] = []
        summary = run_sweep(single, folder, workers=workers, resume=True, progress=news.append)
        assert summary.done == 27
        assert summary.failed == 5
        assert summary.statuses == {"solved": 22, "diverged": 5}
        assert (news[-1].done, news[-1].failed, news[-1].poses) == (27, 5, 27)
        assert news[0].done == summary.already
        assert data_hash(folder / WORKSPACE_FILE) == data_hash(tmp_path / "whole" / WORKSPACE_FILE)


def test_a_finished_sweep_is_not_done_again(tmp_path: Path, no_solving: None) -> None:
    run_sweep(MADE_UP, tmp_path)
    stamp = (tmp_path / WORKSPACE_FILE).stat().st_mtime_ns
    summary = run_sweep(MADE_UP, tmp_path, resume=True)
    assert (summary.already, summary.written, summary.rate) == (27, (), 0)
    assert (tmp_path / WORKSPACE_FILE).stat().st_mtime_ns == stamp
    (tmp_path / WORKSPACE_FILE).unlink()  # the journal has everything
    assert run_sweep(MADE_UP, tmp_path, resume=True, csv=True).written == (
        tmp_path / WORKSPACE_FILE,
        tmp_path / CSV_FILE,
    )


def test_what_a_killed_process_was_writing_is_cleared(tmp_path: Path, no_solving: None) -> None:
    (tmp_path / f".{WORKSPACE_FILE}.12345.part").write_text("half")
    run_sweep(MADE_UP, tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {JOURNAL_FILE, WORKSPACE_FILE}


class Immediate(Executor):
    """Has done everything by the time that anybody asks."""

    def submit(self, function: Any, /, *given: Any, **more: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(function(*given, **more))
        return future


def test_a_stop_that_comes_too_late_changes_nothing(tmp_path: Path, no_solving: None) -> None:
    summary = run_sweep(MADE_UP, tmp_path, executor=Immediate(), stop=lambda: True)
    assert not summary.stopped
    assert summary.done == 27


# --- workers that die, solvers that raise ---


class Deadly(MadeUpSolver):
    """Ends its process where there is a file that says so, and takes one away."""

    folder = Path()

    def solve(self, chunk: int) -> Block:
        for file in self.folder.glob(f"kill-{chunk}-*"):
            file.unlink()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().solve(chunk)


@pytest.mark.parametrize("deaths", [1, 2])
def test_a_worker_that_dies_is_replaced(deaths: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Deadly, "folder", tmp_path)
    use(monkeypatch, Deadly)
    for death in range(deaths):
        (tmp_path / f"kill-3-{death}").touch()
    run_sweep(MADE_UP, tmp_path / "two", workers=2)
    assert not list(tmp_path.glob("kill*"))
    run_sweep(MADE_UP, tmp_path / "one")
    assert data_hash(tmp_path / "one" / WORKSPACE_FILE) == data_hash(tmp_path / "two" / WORKSPACE_FILE)


def test_a_chunk_that_kills_every_worker_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Deadly, "folder", tmp_path)
    use(monkeypatch, Deadly)
    for death in range(9):
        (tmp_path / f"kill-3-{death}").touch()
    with pytest.raises(SweepError, match=r"died 3 times, the last one while solving chunk 3 .* at .* bar"):
        run_sweep(MADE_UP, tmp_path / "two", workers=2)
    for file in tmp_path.glob("kill*"):
        file.unlink()
    assert run_sweep(MADE_UP, tmp_path / "two", workers=2, resume=True).already > 0


def test_an_executor_that_loses_its_workers_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Deadly, "folder", tmp_path)
    use(monkeypatch, Deadly)
    (tmp_path / "kill-3-0").touch()
    with ProcessPoolExecutor(2) as executor, pytest.raises(SweepError, match="lost its workers"):
        run_sweep(MADE_UP, tmp_path / "two", executor=executor)
    assert run_sweep(MADE_UP, tmp_path / "two", resume=True).done == 27


class Raises(MadeUpSolver):
    def solve(self, chunk: int) -> Block:
        if chunk == 3:
            raise ZeroDivisionError("a mistake")
        return super().solve(chunk)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_mistake_in_a_solver_keeps_what_was_solved(
    workers: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use(monkeypatch, Raises)
    with pytest.raises(SweepError, match=r"chunk 3 .*ZeroDivisionError: a mistake"):
        run_sweep(MADE_UP, tmp_path, workers=workers)
    use(monkeypatch, MadeUpSolver)
    assert run_sweep(MADE_UP, tmp_path, resume=True).already >= (12 if workers == 1 else 0)


def test_few_chunks_start_no_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_solving: None) -> None:
    def refuse(*_: Any) -> None:
        raise AssertionError("a pool was started")

    monkeypatch.setattr(pool.ProcessCrew, "__init__", refuse)
    assert run_sweep(plan(GRID, chunk=14), tmp_path, workers=2).done == 27
    with pytest.raises(AssertionError):
        run_sweep(MADE_UP, tmp_path / "more", workers=2)


def test_the_chunks_given_out_at_once_are_bounded(tmp_path: Path, no_solving: None) -> None:
    class Counting(ThreadPoolExecutor):
        most = now = 0

        def submit(self, *given: Any, **more: Any) -> Any:
            self.now += 1
            self.most = max(self.most, self.now)
            future = super().submit(*given, **more)
            future.add_done_callback(lambda _: setattr(self, "now", self.now - 1))
            return future

    with Counting(2) as executor:
        run_sweep(plan(GRID, chunk=1), tmp_path, executor=executor)
    assert 2 <= executor.most <= 6


# --- disks ---


@pytest.mark.parametrize("size", [0, 100, 2_000, 9_000, 20_000])
def test_a_disk_that_fills_up_under_the_result_is_named(size: int, tmp_path: Path, no_solving: None) -> None:
    """HDF5 would end the process; a full disk is met as files that may not grow."""
    with filled(tmp_path, MADE_UP) as journal:
        path = tmp_path / WORKSPACE_FILE
        path.write_text("old")
        told = in_child(write_workspace, path, MADE_UP, journal, {}, file_size=size)
        assert told == f"InputError: {path}: cannot be written: File too large"
        assert path.read_text() == "old"
        assert {p.name.split("-")[0] for p in tmp_path.iterdir()} == {JOURNAL_FILE, WORKSPACE_FILE}
        write_workspace(path, MADE_UP, journal, {})
    assert path.stat().st_size > size
    assert opened(tmp_path).sizes["pose"] == 27


def test_a_folder_that_cannot_be_written(tmp_path: Path, no_solving: None) -> None:
    run_sweep(MADE_UP, tmp_path / "before")  # so that everything is imported
    with read_only(tmp_path):
        with pytest.raises(InputError, match="cannot make this folder"):
            run_sweep(MADE_UP, tmp_path / "new")
        with pytest.raises(InputError, match="cannot be written: its folder is read-only"):
            run_sweep(MADE_UP, tmp_path)


# --- the command ---


def written(folder: Path, tables: str = GRID + QUICK, head: str = HEAD) -> Path:
    path = folder / "grid.toml"
    path.write_text(head + tables)
    return path


def test_the_command_sweeps_refuses_and_goes_on(tmp_path: Path, cli: Cli) -> None:
    path, out = written(tmp_path), tmp_path / "out"
    status, told, error = cli("sweep", path, "--out", out, "--csv")
    assert (status, error) == (0, "")
    last = told.splitlines()[-1]
    match = re.fullmatch(r"27 poses, 0 failed, ([\d.]+) s, (\d+) poses/s", last)
    assert match
    assert float(match[2]) == pytest.approx(27 / float(match[1]), rel=0.05, abs=1)
    files = {"journal.sqlite", "workspace.nc", "workspace.csv", "scenario.toml", "versions.json"}
    assert {p.name for p in out.iterdir()} == files
    assert opened(out).attrs["scenario"] == path.read_text() == (out / "scenario.toml").read_text()

    status, told, error = cli("sweep", path, "--out", out)
    assert (status, told) == (2, "")
    assert error.count("\n") == 1
    assert "are solved); --resume continues it, another --out leaves it alone, or remove this file" in error

    stamps = {p.name: p.stat().st_mtime_ns for p in out.iterdir() if p.name != JOURNAL_FILE}
    status, told, error = cli("sweep", path, "--out", out, "--resume")
    assert (status, error) == (0, "")
    assert "finished already" in told
    assert re.fullmatch(r"27 poses, 0 failed, [\d.]+ s, 0 poses/s", told.splitlines()[-1])
    assert {p.name: p.stat().st_mtime_ns for p in out.iterdir() if p.name != JOURNAL_FILE} == stamps

    written(tmp_path, GRID.replace("1.2", "1.1") + QUICK)
    status, told, error = cli("sweep", path, "--out", out, "--resume")
    assert (status, told) == (2, "")
    assert "another scenario" in error


def test_run_sweeps_too(tmp_path: Path, cli: Cli, no_solving: None) -> None:
    path = written(tmp_path)
    status, told, _ = cli("run", path, "--json")
    document = json.loads(told)
    assert status == 3
    assert (document["study"], document["poses"], document["failed"]) == ("workspace", 27, 5)
    assert document["statuses"] == {"solved": 22, "diverged": 5}
    assert document["file"] is None
    assert sorted(p.name for p in tmp_path.iterdir()) == ["grid.toml"]
    status, told, _ = cli("run", path, "--out", tmp_path / "out")
    assert status == 3
    assert "ended otherwise than solved: 5 diverged" in told
    assert re.fullmatch(r"27 poses, 5 failed, .*", told.splitlines()[-1])
    assert json.loads(cli("run", path, "--json", "--out", tmp_path / "out")[1])["already"] == 27


def test_warnings_of_the_robot_are_told_and_kept(tmp_path: Path, cli: Cli, no_solving: None) -> None:
    thin = HEAD.replace('"D25L60"', '"D25L60"\nminimum_wall_mm = 3.0\nallow = ["wall_thickness"]')
    path, out = written(tmp_path, head=thin), tmp_path / "out"
    _, told, _ = cli("sweep", path, "--out", out)
    assert told.splitlines()[2].startswith("warning: wall_thickness: ")
    (warning,) = json.loads(opened(out).attrs["warnings"])
    assert warning.startswith("wall_thickness: ")


def test_a_sweep_goes_on_with_another_casadi_and_says_so(
    tmp_path: Path, cli: Cli, no_solving: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out = written(tmp_path), tmp_path / "out"
    for casadi in ("3.8.0", "3.9.0"):
        monkeypatch.setattr("softnlp.sweep.run.package_version", {"casadi": casadi, "numpy": "2.4.0"}.get)
        run_sweep(load_scenario(path), out, resume=True, stop=lambda: True)
    status, told, _ = cli("sweep", path, "--out", out, "--resume")
    assert status == 3  # every fifth pose is made up as failed
    assert told.splitlines()[2] == "warning: the sweep was begun with casadi 3.8.0 and goes on with 3.9.0"
    assert json.loads(opened(out).attrs["versions_before"]) == [{"casadi": "3.8.0", "numpy": "2.4.0"}]


def test_what_a_full_disk_left_out_is_written_when_it_is_continued(tmp_path: Path, cli: Cli, no_solving: None) -> None:
    path, out = written(tmp_path), tmp_path / "out"
    cli("sweep", path, "--out", out)
    (out / "scenario.toml").unlink()
    cli("sweep", path, "--out", out, "--resume")
    assert (out / "scenario.toml").read_text() == path.read_text()


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--workers", "0"], "--workers"),
        (["--workers", "2", "--cluster", "tcp://x:1"], "--workers"),
        (["--wrokers", "2"], "--wrokers"),
    ],
)
def test_what_the_command_does_not_take(words: list[str], named: str, tmp_path: Path, cli: Cli) -> None:
    status, told, error = cli("sweep", written(tmp_path), "--out", tmp_path / "out", *words)
    assert (status, told) == (2, "")
    assert named in error
    assert not (tmp_path / "out").exists()


def test_a_scenario_of_another_study_is_refused(tmp_path: Path, cli: Cli) -> None:
    forward = HEAD.replace("workspace", "forward")
    path = written(tmp_path, "[pressure]\nsequence_bar = [[0.0, 0.0, 0.0]]\n", head=forward)
    status, _, error = cli("sweep", path)
    assert status == 2
    assert "study 'workspace'" in error
