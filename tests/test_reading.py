"""One function reads every file of a person: regular files of a stated size, text in UTF-8, TOML of a stated depth."""

from __future__ import annotations

import json
import os
import socket
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from broken_files import MATERIAL, ROBOT, STUDY

from softnlp.base.errors import InputError
from softnlp.base.reading import DEEPEST, LARGEST_DATA, LARGEST_TOML, read_bytes, read_text, toml_tables
from softnlp.cli import main
from softnlp.model.materials import load_materials
from softnlp.scenario.read import load_scenario, scenario_from_text


def pipe(path: Path) -> None:
    os.mkfifo(path)


def dangling(path: Path) -> None:
    path.symlink_to("nowhere")


def in_dangling_folder(path: Path) -> None:
    path.symlink_to("no_folder/p.csv")


def loop(path: Path) -> None:
    path.with_name("other").symlink_to(path)
    path.symlink_to("other")


def unix_socket(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # a socket's name may not be long
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


def to(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


def large(path: Path) -> None:
    path.touch()
    os.truncate(path, LARGEST_DATA + 1)


SPECIAL = {
    "a pipe": (pipe, "got a pipe"),
    "a directory": (Path.mkdir, "got a directory"),
    "a socket": (unix_socket, "got a socket"),
    "a device": (to("/dev/zero"), "got a device"),
    "a link to a pipe": (lambda path: (pipe(path.with_name("f")), path.symlink_to("f")), "got a pipe"),
    "a file of /proc": (to("/proc/self/status"), "longer than its size"),
    "a link to nothing": (dangling, "link to something that does not exist"),
    "a link into no folder": (in_dangling_folder, "link to something that does not exist"),
    "a loop of links": (loop, "cannot be read: Too many levels of symbolic links"),
    "a large file": (large, "at most 64 MB"),
}


@pytest.mark.parametrize("kind", SPECIAL)
def test_only_regular_files_are_read_and_none_is_waited_for(kind: str, tmp_path: Path) -> None:
    make, words = SPECIAL[kind]
    path = tmp_path / "p.csv"
    make(path)
    with pytest.raises(InputError, match=words):
        read_bytes(path)
    scenario = tmp_path / "s.toml"
    scenario.write_text(STUDY + ROBOT + MATERIAL + "[pressure]\nfile = 'p.csv'\n")
    with pytest.raises(InputError, match=words) as caught:
        load_scenario(scenario)
    assert str(caught.value).startswith(f"{scenario}: [pressure] file: p.csv: ")
    assert "did you mean" not in str(caught.value)


def test_every_command_that_names_a_file_refuses_a_pipe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("f.toml", "f.csv", "f.nc"):
        pipe(Path(name))
    base = STUDY + ROBOT + "[pressure]\nsequence_bar = [[0, 0, 0]]\n"
    Path("m.toml").write_text(base + MATERIAL + "file = 'f.toml'\n")
    Path("s.toml").write_text(base + MATERIAL)
    for measured in ("measurements", "tensile"):
        free = "free = ['k_b']\n" if measured == "measurements" else ""
        table = f"study = 'identify'\n[{measured}]\nfile = 'f.csv'\n{free}"
        Path(f"{measured}.toml").write_text(table + (MATERIAL + ROBOT if free else ""))
    commands = (
        *(["run", "f.toml"], ["run", "m.toml"], ["run", "measurements.toml"], ["run", "tensile.toml"]),
        *(["materials", "--file", "f.toml"], ["plot", "material", "--file", "f.toml", "--out", "o.png"]),
        *(["compare", "s.toml", "f.csv"], ["workspace", "f.nc"], ["plot", "run", "f.nc"], ["sweep", "f.toml"]),
    )
    before = sorted(os.listdir())
    for command in commands:
        assert main(command) == 2, command
        told = capsys.readouterr()
        assert len(told.err.splitlines()) == 1
        assert told.out == ""
    assert sorted(os.listdir()) == before


def test_a_link_is_named_and_not_suggested(tmp_path: Path) -> None:
    (tmp_path / "p.csv").symlink_to("nowhere")
    with pytest.raises(InputError, match=r"p\.csv' is a link to something that does not exist: '.*nowhere'"):
        read_text(tmp_path / "p.csv")
    with pytest.raises(InputError, match=r"^no such file$"):
        read_text(tmp_path / "q.csv")  # the link of a near name is no file either
    (tmp_path / "real.csv").write_text("x")
    (tmp_path / "good.csv").symlink_to("real.csv")
    assert read_text(tmp_path / "good.csv") == "x"


def test_sizes(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_bytes(b"#" * LARGEST_TOML)
    assert len(read_text(path, LARGEST_TOML)) == LARGEST_TOML
    path.write_bytes(b"#" * (LARGEST_TOML + 1))
    for read in (load_scenario, load_materials):
        with pytest.raises(InputError, match="too large: expected at most 1 MB"):
            read(path)


@pytest.mark.parametrize(
    ("deep", "too_deep"),
    [
        (".".join("a" * DEEPEST) + " = 1", ".".join("a" * (DEEPEST + 1)) + " = 1"),
        (f"[{'.'.join('a' * (DEEPEST - 1))}]\nb = 1", f"[{'.'.join('a' * DEEPEST)}]\nb = 1"),
        (f"a = {'[' * 15}{']' * 15}", f"a = {'[' * 16}{']' * 16}"),
        (f"a = {'{a=' * 15}1{'}' * 15}", f"a = {'{a=' * 5000}1{'}' * 5000}"),
        ('"a" . "b" = 1', " . ".join(['"a"'] * 5000) + " = 1"),
        ("[a.b.c.d.e.f.g.h]\na.b.c.d.e.f.g.h = 1", "[a.b.c.d.e.f.g.h]\na.b.c.d.e.f.g.h.i = 1"),
    ],
)
def test_depth(deep: str, too_deep: str) -> None:
    assert toml_tables(deep) == tomllib.loads(deep)
    with pytest.raises(InputError, match=f"at most {DEEPEST} deep"):
        toml_tables(too_deep)


def test_what_only_looks_deep_is_read() -> None:
    """Points and brackets in texts, comments and numbers are no depth."""
    text = (
        f'a = \'{"x." * 40}{"[" * 40}\'\nb = "{"[." * 40}\\"{"[" * 40}" # {"[." * 40}\n'
        f'c = \'\'\'\n{"[." * 40}\'\'\'\nd = """{"[." * 40}\\""""\ne = [{", ".join(["1.5"] * 40)}]\n'
    )
    assert toml_tables(text) == tomllib.loads(text)


PATH_KEYS = {
    "pressure": STUDY + ROBOT + MATERIAL + "[pressure]\nfile = {}\n",
    "material": STUDY + ROBOT + MATERIAL + "file = {}\n[pressure]\nsequence_bar = [[0, 0, 0]]\n",
    "measurements": f"study = 'identify'\n{ROBOT}{MATERIAL}[measurements]\nfree = ['k_b']\nfile = {{}}\n",
    "tensile": "study = 'identify'\n[tensile]\nfiles = [{}]\n",
}


@pytest.mark.parametrize("table", PATH_KEYS)
def test_a_path_with_an_escape_shows_what_was_typed(table: str) -> None:
    for escape in (r"\t", r"\n", r"\b", r"\f", r"\r", r"\u0007", r"\u0000"):
        with pytest.raises(InputError) as caught:
            scenario_from_text(PATH_KEYS[table].format(rf'"data{escape}able.csv"'), "s.toml")
        line = str(caught.value)
        assert line.startswith(f"s.toml: [{table}] file")
        assert rf"got 'data{escape}able.csv', where {escape} is one character" in line
        assert "'…' or with /" in line
    with pytest.raises(InputError, match="no such file"):  # nothing is wrong with the path itself
        scenario_from_text(PATH_KEYS[table].format(r"'data\table.csv'"), "s.toml")


@pytest.mark.parametrize("path", [r'"data\p.csv"', r'"C:\Users\me\p.csv"', r'"data\x\p.csv"', '"data\\"'])
def test_a_backslash_that_is_no_escape(path: str) -> None:
    with pytest.raises(InputError, match=r"(?s)line 8.*a backslash in .* write a path in single quotes '…' or with /"):
        scenario_from_text(PATH_KEYS["pressure"].format(path), "s.toml")
    with pytest.raises(InputError, match="not valid TOML") as caught:
        scenario_from_text(PATH_KEYS["pressure"].format("data"), "s.toml")
    assert "backslash" not in str(caught.value)


def test_the_file_that_a_backslash_means_is_offered(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "p.csv").write_text("p1_bar,p2_bar,p3_bar\n0,0,0\n")
    path = tmp_path / "s.toml"
    path.write_text(PATH_KEYS["pressure"].format(r"'data\p.csv'"))
    with pytest.raises(InputError, match=r"no such file; there is one with / in place of"):
        load_scenario(path)


def test_white_space_in_a_title_is_a_space() -> None:
    text = r'title = "data\table\nx"' + "\n" + STUDY + ROBOT + MATERIAL + "[pressure]\nsequence_bar = [[0, 0, 0]]\n"
    assert scenario_from_text(text, "s.toml").title == "data able x"
    with pytest.raises(InputError, match="without control characters"):
        scenario_from_text(text.replace(r"\t", r"\b"), "s.toml")


def test_json_names_what_the_reader_took_as_zero(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.csv").write_text("p1_bar,p2_bar,p3_bar\n-0.003,0,0\n0.5,-0.0001,0\n")
    Path("s.toml").write_text(PATH_KEYS["pressure"].format("'p.csv'") + "[solver]\nintervals = 10\naccuracy = 1e-3\n")
    assert main(["run", "s.toml", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [step["pressure_bar"] for step in document["steps"]] == [[0, 0, 0], [0.5, 0, 0]]
    assert len(document["warnings"]) == 1
    assert "2 pressure readings below 0, the lowest -0.003 bar" in document["warnings"][0]
