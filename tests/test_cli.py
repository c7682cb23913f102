"""The command line: what it prints, writes and returns, for good input and bad, whole or cut short."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from broken_files import BROKEN, Broken

import softnlp
from softnlp.cli import console, main
from softnlp.cli.run import _COMMANDS
from softnlp.model.robot import ROBOTS
from softnlp.results import load_run
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.run import STUDIES

PROGRAM = [sys.executable, "-m", "softnlp"]
FILES = {"results.nc", "table.csv", "results.json", "versions.json", "figure.png", "scenario.toml"}
DOCUMENT_KEYS = {"softnlp", "title", "study", "conventions", "steps"}
STEP_KEYS = {
    *("pressure_bar", "status", "message", "stretch", "stable", "tip_position_mm", "tip_displacement_mm"),
    *("tip_rotation", "bending_angle_deg", "tilt_deg", "backbone_length_mm", "chamber_length_mm", "residual"),
    *("discretisation_error", "intervals", "iterations", "solve_time_s", "warnings"),
}
KEPT_UNSOLVED = {"pressure_bar", "t_s", "status", "message", "residual", "warnings", "certificate"}

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run every test in a folder of its own, without a terminal."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "COLUMNS"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def cli(capfd: pytest.CaptureFixture[str]) -> Run:
    """Return main as a function of words -> status, standard output, standard error, those of libraries included."""

    def call(*words: str | Path) -> tuple[int, str, str]:
        status = main([str(word) for word in words])
        return status, *capfd.readouterr()

    return call


def scenario(
    name: str = "quick.toml",
    *,
    pressure: str = "ramp = { sets = [1], to_bar = 1.0, steps = 3 }",
    model: str = "mooney-rivlin",
    silicone: str = "Ecoflex 00-50",
    more: str = "",
) -> Path:
    """Write a scenario that takes a moment to run."""
    path = Path(name)
    path.write_text(
        f'title = "three steps"\nstudy = "forward"\n[robot]\nname = "D25L60"\n'
        f'[material]\nname = "{silicone}"\nmodel = "{model}"\n[pressure]\n{pressure}\n'
        f"[solver]\nintervals = 10\naccuracy = 1e-3\n{more}"
    )
    return path


def beyond_the_last_equilibrium() -> Path:
    """Without stiffening this silicone has no equilibrium at the higher pressures."""
    return scenario(
        pressure="ramp = { sets = [1, 2, 3], to_bar = 2.1, steps = 4 }",
        model="yeoh",
        silicone="Ecoflex 00-30",
        more="[stiffening]\nelongation = 0\nbending = 0\n",
    )


def written() -> set[str]:
    return {str(path) for path in Path().rglob("*") if path.is_file()}


# --- a run that solves ---


def test_a_run_prints_a_table_and_writes_its_folder(cli: Run) -> None:
    path = scenario()
    status, out, err = cli("run", path)
    assert (status, err) == (0, "")
    assert written() == {"quick.toml", *(f"results/quick/{name}" for name in FILES)}
    lines = out.splitlines()
    assert lines[0] == "three steps: D25L60, Ecoflex 00-50 (mooney-rivlin)"
    assert lines[-1] == "results in results/quick"
    assert max(map(len, lines)) <= 100
    assert Path("results/quick/scenario.toml").read_text() == path.read_text()


def test_the_table_shows_the_numbers_of_the_document(cli: Run) -> None:
    _, out, _ = cli("run", scenario(), "--out", "kept")
    document = json.loads(Path("kept/results.json").read_text())
    rows = [line.split() for line in out.splitlines() if re.match(r"\s+\d+ ", line)]
    assert len(rows) == len(document["steps"]) == 3
    for number, (row, step) in enumerate(zip(rows, document["steps"], strict=True), start=1):
        x, y, z = step["tip_position_mm"]
        assert row[0] == str(number)
        assert [float(p) for p in row[1:4]] == step["pressure_bar"]
        assert row[4] == "solved"
        shown = [float(cell) for cell in row[5:10]]
        assert shown == pytest.approx([step["bending_angle_deg"], x, y, z, step["stretch"]], abs=6e-3)
        assert row[10] == ("yes" if step["stable"] else "no")
    assert document["steps"][2]["bending_angle_deg"] > 50  # the table is not one of zeros


def test_json_is_one_document_and_writes_nothing(cli: Run) -> None:
    status, out, err = cli("run", scenario(), "--json")
    assert (status, err) == (0, "")
    assert written() == {"quick.toml"}
    document = json.loads(out)
    assert set(document) >= DOCUMENT_KEYS
    assert document["softnlp"] == softnlp.__version__
    assert (document["study"], document["conventions"]) == ("forward", "reproduction")
    assert [step["pressure_bar"] for step in document["steps"]] == [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]]
    for step in document["steps"]:
        assert set(step) >= STEP_KEYS
        assert step["status"] == "solved"
        assert all(step[key] is not None for key in STEP_KEYS)


def test_json_with_a_folder_writes_the_same_document_there(cli: Run) -> None:
    status, out, _ = cli("run", scenario(), "--json", "--out", "deep/er")
    assert status == 0
    assert json.loads(out) == json.loads(Path("deep/er/results.json").read_text())
    assert written() == {"quick.toml", *(f"deep/er/{name}" for name in FILES)}


def test_a_run_replaces_its_own_results_and_nothing_else(cli: Run) -> None:
    cli("run", scenario(), "--out", "kept")
    Path("kept/notes.txt").write_text("mine")
    status, *_ = cli("run", scenario(pressure="sequence_bar = [[0.3, 0.0, 0.0]]"), "--out", "kept")
    assert status == 0
    assert Path("kept/notes.txt").read_text() == "mine"
    assert load_run("kept").pressure.shape == (1, 3)
    assert {p.name for p in Path("kept").iterdir()} == {*FILES, "notes.txt"}


def test_times_of_a_pressure_file_are_kept(cli: Run) -> None:
    Path("p.csv").write_text("t_s,p1_bar,p2_bar,p3_bar\n0,0,0,0\n2.5,0.2,0,0.1\n")
    status, out, _ = cli("run", scenario(pressure='file = "p.csv"'), "--json")
    assert status == 0
    assert [step["t_s"] for step in json.loads(out)["steps"]] == [0.0, 2.5]


# --- a run that does not, or not everywhere ---


def test_steps_without_a_solution_keep_the_others(cli: Run) -> None:
    status, out, err = cli("run", beyond_the_last_equilibrium(), "--json")
    assert (status, err) == (3, "")
    steps = json.loads(out)["steps"]
    assert [step["status"] for step in steps] == ["solved", "solved", "no_equilibrium", "no_equilibrium"]
    for step in steps:
        assert set(step) >= STEP_KEYS
        if step["status"] != "solved":
            assert all(step[key] is None for key in set(step) - KEPT_UNSOLVED)
            assert step["pressure_bar"]
    # Between the last that solved and the first that did not.
    last = re.search(r"last pressure with an equilibrium is ([\d.]+),", steps[2]["message"])
    assert last
    assert 0.7 < float(last[1]) < 1.4


def test_the_table_names_what_failed(cli: Run) -> None:
    status, out, _ = cli("run", beyond_the_last_equilibrium())
    assert status == 3
    row = next(line for line in out.splitlines() if line.lstrip().startswith("3 "))
    assert "no_equilibrium" in row
    assert row.split()[5:11] == ["-"] * 6
    assert "steps 3-4 no_equilibrium: " in out
    assert load_run("results/quick").solved == (0, 1)


def test_every_study_that_is_read_is_run() -> None:
    assert set(STUDIES) | set(_COMMANDS) == set(SCHEMAS)
    assert not set(STUDIES) & set(_COMMANDS)


# --- bad input: one line, exit status 2, nothing written ---


def complaint(status: int, out: str, err: str) -> str:
    """Return the one line of a refusal."""
    assert status == 2
    assert out == ""
    assert err.count("\n") == 1
    assert err.endswith("\n")
    assert err[:-1].isprintable()
    assert err.startswith("softnlp: ")
    return err.removeprefix("softnlp: ")[:-1]


@pytest.mark.parametrize("broken", BROKEN, ids=lambda broken: broken.name)
def test_a_broken_file_is_refused(broken: Broken, tmp_path: Path, cli: Run) -> None:
    path = broken.write(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    for words in (["run", path], ["run", path, "--json"]):
        line = complaint(*cli(*words))
        assert line.startswith(f"{path}: ")
        for name in broken.names:
            assert name in line
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("broken", [b for b in BROKEN if b.name in ("unknown robot", "not TOML")], ids=lambda b: b.name)
def test_a_broken_file_is_refused_by_the_process(broken: Broken, tmp_path: Path) -> None:
    path = broken.write(tmp_path)
    done = subprocess.run([*PROGRAM, "run", str(path)], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert str(path) in complaint(done.returncode, done.stdout, done.stderr)
    assert written() == set()


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["rnu"], ("rnu", "run")),
        (["run"], ("SCENARIO",)),
        (["run", "a.toml", "b.toml"], ("b.toml",)),
        (["run", "a.toml", "--jsn"], ("--jsn", "--json")),
        (["run", "a.toml", "--no-json"], ("--no-json",)),
        (["run", "nowhere.toml"], ("nowhere.toml", "no such file")),
        (["run", ""], ("directory",)),
        (["--nope"], ("--nope",)),
        (["plot", "sectoin"], ("sectoin", "section")),
        (["plot", "section", "D25"], ("D25", "D25L60")),
        (["plot", "section", "D25L60", "--stretch", "abc"], ("stretch", "abc")),
        (["plot", "section", "D25L60", "--stretch", "nan"], ("stretch", "nan")),
        (["plot", "section", "D25L60", "--stretch", "-1"], ("stretch", "-1")),
        (["plot", "section", "D25L60", "--out", "x.gif"], ("x.gif", ".png")),
        (["plot", "section", "D25L60", "--out", "no/such/x.png"], ("no/such/x.png",)),
        (["plot", "section", "nowhere.toml"], ("nowhere.toml", "no such file")),
        (["plot", "material", "Ecoflex"], ("Ecoflex",)),
        (["plot", "material", "--law", "ogdne"], ("ogden",)),
        (["plot", "material", "--file", "none.toml"], ("none.toml", "no such file")),
        (["plot", "material", "--stretch", "0.5"], ("stretch", "0.5")),
        (["plot", "run", "."], ("results.nc",)),
        (["materials", "--file", "none.toml"], ("none.toml", "no such file")),
        (["materials", "a\nb\x1b[31m"], ("a",)),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_a_command_does_not_take_is_refused(words: list[str], named: tuple[str, ...], cli: Run) -> None:
    line = complaint(*cli(*words))
    for name in named:
        assert name in line
    assert written() == set()


# --- where results go ---


@pytest.mark.parametrize("out", ["taken", "taken/deeper", "/dev/null/x"])
def test_a_file_in_the_place_of_the_folder_is_refused_before_the_solve(
    out: str, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def solve(*_: Any) -> None:
        raise AssertionError("solved")

    monkeypatch.setattr("softnlp.scenario.run.solve_steps", solve)
    Path("taken").write_text("a file")
    path = scenario()
    assert "expected a folder, got a file" in complaint(*cli("run", path, "--out", out))
    assert written() == {"quick.toml", "taken"}


@pytest.mark.parametrize("out", ["locked", "locked/deeper"])
def test_a_folder_that_cannot_be_written_is_refused_before_the_solve(
    out: str, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("locked").mkdir(mode=0o500)
    if os.geteuid() == 0:  # nothing is locked for root
        monkeypatch.setattr(os, "access", lambda path, mode: str(path) != "locked")
    assert complaint(*cli("run", scenario(), "--out", out)) == "locked: this folder cannot be written"
    assert written() == {"quick.toml"}


@pytest.mark.parametrize(
    ("out", "reason"),
    [
        (300 * "n", "not a possible file name"),
        (f"deeper/{300 * 'n'}/still", "not a possible file name"),
        ("a\0b", "not a possible file name"),
        ("/proc/nowhere", "this folder cannot be written"),
    ],
    ids=["long", "long and deeper", "NUL", "of the kernel"],
)
@pytest.mark.parametrize("command", ["run", "sensitivity"])
def test_a_folder_that_cannot_be_made_is_refused_before_the_solve(
    command: str, out: str, reason: str, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    if out.startswith("/proc") and not Path("/proc/self").is_dir():
        pytest.skip("there is no /proc")

    def solve(*_: Any, **__: Any) -> None:
        raise AssertionError("solved")

    monkeypatch.setattr("softnlp.scenario.run.solve_steps", solve)
    monkeypatch.setattr("softnlp.studies.report.sensitivity_report", solve)
    assert reason in complaint(*cli(command, scenario(), "--out", out))
    assert written() == {"quick.toml"}


@pytest.mark.parametrize(
    ("out", "reason"),
    [("there.stl", "there.stl: expected a file, got a folder"), (300 * "n" + ".stl", "not a possible file name")],
    ids=["folder", "long"],
)
def test_a_mesh_that_cannot_be_written_is_refused_before_the_solve(
    out: str, reason: str, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def solve(*_: Any) -> None:
        raise AssertionError("solved")

    monkeypatch.setattr("softnlp.scenario.run.solve_steps", solve)
    Path("there.stl").mkdir()
    assert reason in complaint(*cli("mesh", scenario(), "--out", out))
    assert written() == {"quick.toml"}


def test_results_that_cannot_be_written_are_shown(cli: Run) -> None:
    Path("kept/results.nc").mkdir(parents=True)
    status, out, err = cli("run", scenario(), "--out", "kept")
    assert status == 2
    assert err == "softnlp: kept/results.nc: cannot be written: Is a directory\n"
    assert out.count("solved") == 3
    assert "results in" not in out
    assert written() == {"quick.toml"}


# --- what the output meets ---


@pytest.mark.thorough
def test_a_reader_that_leaves_loses_no_results() -> None:
    """As `| head -1` does, only sooner."""
    scenario()
    process = subprocess.Popen(
        [*PROGRAM, "run", "quick.toml"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL
    )
    assert process.stdout
    process.stdout.close()
    assert process.stderr
    with process.stderr as errors:
        assert (errors.read(), process.wait()) == (b"", 0)
    assert written() == {"quick.toml", *(f"results/quick/{name}" for name in FILES)}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_behind_the_output_is_one_line() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([*PROGRAM, "robots"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == "softnlp: standard output: cannot be written: No space left on device\n"


def test_an_output_without_these_letters_gets_question_marks() -> None:
    Path("mine.toml").write_text("['Stöße'.neo-hookean]\nmu0_MPa = 0.02\n", encoding="utf-8")
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    words = [*PROGRAM, "materials", "--file", "mine.toml"]
    done = subprocess.run(words, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[1].startswith("St??e ")


# --- Ctrl-C ---


def interrupt_after(steps: int, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Press Ctrl-C when so many steps are done; return the counts that the progress bar was told."""
    seen: list[int] = []
    bar = console.progress_bar

    @contextmanager
    def pressing(total: int, title: str) -> Any:
        with bar(total, title) as (advance, describe):

            def press(done: int) -> None:
                seen.append(done)
                advance(done)
                if done == steps:
                    os.kill(os.getpid(), signal.SIGINT)

            yield press, describe

    monkeypatch.setattr(console, "progress_bar", pressing)
    return seen


def test_ctrl_c_keeps_the_steps_that_are_done(cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = interrupt_after(2, monkeypatch)
    before = signal.getsignal(signal.SIGINT)
    status, out, err = cli("run", scenario(pressure="ramp = { sets = [1], to_bar = 1.0, steps = 9 }"))
    assert (status, seen) == (130, [1, 2])
    assert err == "softnlp: stopped after 2 of 9 steps; those are in results/quick\n"
    assert "warning: stopped by the user after 2 of 9 steps" in out
    assert load_run("results/quick").solved == (0, 1)
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_with_json_prints_the_document_of_the_steps_that_are_done(
    cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_after(1, monkeypatch)
    status, out, err = cli("run", scenario(), "--json")
    assert (status, err) == (130, "softnlp: stopped after 1 of 3 steps\n")
    assert len(json.loads(out)["steps"]) == 1
    assert written() == {"quick.toml"}


def test_ctrl_c_in_the_last_step_changes_nothing(cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    interrupt_after(3, monkeypatch)
    status, out, err = cli("run", scenario())
    assert (status, err) == (0, "")
    assert "stopped" not in out


def test_ctrl_c_before_the_first_step_writes_nothing(cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def load(path: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("softnlp.scenario.read.load_scenario", load)
    assert cli("run", scenario()) == (130, "", "softnlp: stopped\n")
    assert written() == {"quick.toml"}


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_ctrl_c_in_the_middle_of_a_long_run_in_a_terminal() -> None:
    rows = "".join(f"{k},{k / 4000},0,0\n" for k in range(4000))
    Path("long.csv").write_text("t_s,p1_bar,p2_bar,p3_bar\n" + rows)
    scenario("long.toml", pressure='file = "long.csv"')
    terminal, side = os.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    process = subprocess.Popen(
        [*PROGRAM, "run", "long.toml"], stdout=subprocess.PIPE, stderr=side, text=True, env=environment
    )
    os.close(side)
    shown = b""
    while not re.search(rb"[1-9]\d*/4000", shown):
        shown += os.read(terminal, 1024)
    process.send_signal(signal.SIGINT)
    after = b""
    with suppress(OSError):  # the other side is closed
        while more := os.read(terminal, 1024):
            after += more
    out, _ = process.communicate(timeout=60)
    os.close(terminal)
    assert process.returncode == 130
    last = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", after.decode()).splitlines()[-1]
    match = re.search(r"softnlp: stopped after (\d+) of 4000 steps; those are in results/long$", last)
    assert match, last
    assert "Traceback" not in after.decode()
    assert len(load_run("results/long").status) == int(match[1]) < 4000
    assert out.splitlines()[-1] == "results in results/long"


# --- branches ---


def test_branches_belong_to_a_blocked_force_at_each_pressure(cli: Run) -> None:
    status, out, err = cli("run", scenario(), "--branches", "3")
    assert (status, out) == (2, "")
    assert err == "softnlp: --branches: expected only for study 'blocked-force'; quick.toml is of study 'forward'\n"
    curve = scenario("curve.toml", pressure="sequence_bar = [[1.0, 0, 0]]", more="[contact]\noffsets_mm = [0, -5]\n")
    curve.write_text(curve.read_text().replace('"forward"', '"blocked-force"'))
    status, out, err = cli("run", curve, "--branches", "3")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "offsets_mm" in err
    status, out, err = cli("run", curve, "--branches", "-1")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert written() == {"quick.toml", "curve.toml"}


@pytest.mark.thorough
def test_branches_of_a_blocked_force_leave_its_result(cli: Run) -> None:
    path = scenario("blocked.toml", pressure="ramp = { sets = [1], to_bar = 1.0, steps = 3 }")
    path.write_text(path.read_text().replace('"forward"', '"blocked-force"'))
    plain, tried = (json.loads(cli("run", path, "--json", *more)[1]) for more in ((), ("--branches", "2")))
    forces = [[step["blocked_force_N"] for step in document["steps"]] for document in (plain, tried)]
    assert forces[0] == forces[1]
    assert forces[0][2] > forces[0][1] > 0


# --- the other commands ---


def test_the_version(cli: Run) -> None:
    assert cli("--version") == (0, f"{softnlp.__version__}\n", "")


@pytest.mark.parametrize(
    "words",
    [[], ["run"], ["robots"], ["materials"], ["plot"], ["plot", "section"], ["plot", "material"], ["plot", "run"]],
    ids=lambda words: " ".join(words) or "softnlp",
)
def test_help(words: list[str], cli: Run) -> None:
    status, out, err = cli(*words, "--help")
    assert (status, err) == (0, "")
    assert out.startswith(f"Usage: {' '.join(['softnlp', *words])}")
    named = {
        "": ["run", "robots", "materials", "plot", "--version"],
        "run": ["SCENARIO", "--out", "--json", "--branches", "results/NAME"],
        "plot": ["section", "material", "run"],
        "plot section": ["ROBOT", "--stretch", "--out"],
        "plot material": ["NAMES", "--law", "--file", "--stretch", "--out"],
        "plot run": ["RESULTS", "--out"],
    }
    for name in named.get(" ".join(words), []):
        assert name in out


def test_no_command_shows_the_help(cli: Run) -> None:
    assert cli() == cli("--help")


def test_robots(cli: Run) -> None:
    status, out, err = cli("robots")
    assert (status, err) == (0, "")
    header, *rows = [line.split() for line in out.splitlines()]
    assert [row[0] for row in rows] == list(ROBOTS)
    d25 = dict(zip(header, rows[list(ROBOTS).index("D25L60")], strict=True))
    assert d25["outer_diameter_mm"] == "25"
    assert d25["chamber_angle_deg"] == "50"
    assert d25["chamber_sets"] == "3"


def test_materials(cli: Run) -> None:
    status, out, err = cli("materials")
    assert (status, err) == (0, "")
    rows = out.split("\n\n")[0].splitlines()[1:]  # where each set comes from stands below
    paper = [row for row in rows if " shi-2025 " in row]
    assert len(paper) == 25
    assert len(rows) > 25
    line = next(row for row in rows if row.startswith("Ecoflex 00-50") and "mooney-rivlin" in row and row in paper)
    assert "C10_MPa = 0.00376, C01_MPa = 0.01558, C20_MPa = 0.001047" in line
    assert "(derived: secant" in next(row for row in rows if " linear " in row)


def test_materials_of_a_file(cli: Run) -> None:
    Path("mine.toml").write_text("[mine.soft]\nformula = 'c * (stretch - 1)'\nconstants = { c = 0.02 }\n")
    assert cli("materials", "--file", "mine.toml")[1].splitlines()[1].split() == [
        "mine",
        "default",
        "soft",
        "1070",
        "c",
        "=",
        "0.02",
    ]


PNG = b"\x89PNG"


@pytest.mark.parametrize("name", ["laparoscope-9", "own.toml"])
def test_plot_section(name: str, cli: Run) -> None:
    scenario("own.toml")
    text = Path("own.toml").read_text().replace('name = "D25L60"', 'name = "D25L60"\nchamber_diameter_mm = 7.5')
    Path("own.toml").write_text(text)  # a robot that cannot be made
    status, out, err = cli("plot", "section", name)
    assert (status, err) == (0, "")
    drawn = Path(out.removeprefix("drawn in ").strip())
    assert drawn.read_bytes().startswith(PNG)
    assert re.fullmatch(r"section-[-\w]+\.png", drawn.name)


def test_plot_material(cli: Run) -> None:
    assert cli("plot", "material", "Ecoflex 00-50", "--law", "yeoh", "--law", "ogden") == (
        0,
        "drawn in materials.png\n",
        "",
    )
    assert Path("materials.png").read_bytes().startswith(PNG)
    assert cli("plot", "material", "--law", "all", "--out", "all.svg")[0] == 0
    assert "Dragon Skin 10" in Path("all.svg").read_text()


def test_plot_run_draws_the_figure_again(cli: Run) -> None:
    cli("run", scenario())
    figure = Path("results/quick/figure.png")
    first = figure.read_bytes()
    figure.unlink()
    assert cli("plot", "run", "results/quick") == (0, "drawn in results/quick/figure.png\n", "")
    assert figure.read_bytes() == first
    assert cli("plot", "run", "results/quick/results.nc", "--out", "again.pdf")[0] == 0
    assert Path("again.pdf").read_bytes().startswith(b"%PDF")
