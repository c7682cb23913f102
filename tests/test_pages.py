"""The pages of the documentation do what they show, in order, and reach what they link to."""

from __future__ import annotations

import json
import re
import shlex
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

import softnlp
from docs.tools.pages import blocks, saved
from softnlp import load_materials, load_scenario
from softnlp.base.columns import OUTPUTS
from softnlp.cli import main
from softnlp.scenario.read import scenario_from_text

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [
    "index",
    "tutorial",
    "extending",
    "nlp",
    "problem",
    *(f"how-to/{page.stem}" for page in sorted((DOCS / "how-to").glob("*.md")) if page.stem != "first-tasks"),
]
SCRIPTS = sorted((DOCS / "figures").glob("[!_]*.py"))
LONGEST_EXTENSION = 30
NAMED = re.compile(r"^::: softnlp\.([\w.]+)$", re.MULTILINE)
WRITTEN = sorted(path for path in DOCS.rglob("*.md") if path.parent.name not in ("paper", "__pycache__"))


def read_toml(name: str, code: str, saved: list[Path]) -> None:
    """Save a file that the page says to save, or add tables to the last one; what that makes can be read."""
    data = tomllib.loads(code)
    if "file" in data.get("material", {}):  # for a scenario beside what the last one leaves
        assert main(["run", str(saved[-1])]) == 0
        rest = 'study = "forward"\nrobot = { name = "D25L60" }\npressure = { sequence_bar = [[1, 0, 0]] }\n'
        assert scenario_from_text(rest + code, Path("results") / saved[-1].stem / "x.toml").material.name == "Batch 7"
        return
    if name:
        saved.append(Path(name))
        saved[-1].write_text(code)
    else:
        assert "study" not in data, "a scenario is saved under a name"
        saved[-1].write_text(saved[-1].read_text() + "\n" + code)
    if "study" in tomllib.loads(saved[-1].read_text()):
        assert load_scenario(saved[-1]).step_count > 0
    else:
        assert load_materials(saved[-1])


@pytest.mark.thorough
@pytest.mark.parametrize("page", PAGES)
def test_a_page_does_what_it_shows(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenarios").symlink_to(ROOT / "scenarios")
    names: dict[str, Any] = {}
    saved: list[Path] = []
    for name, language, code in blocks(page):
        if language == "toml":
            read_toml(name, code, saved)
        elif language == "bash":
            for line in code.splitlines():
                if line.startswith("mkdir -p "):
                    Path(line.split()[-1]).mkdir(parents=True, exist_ok=True)
                if line.startswith("softnlp "):
                    assert main(shlex.split(line)[1:]) == 0, line
        elif language == "python":
            exec(compile(code, f"{page}.md", "exec"), names)
        else:
            assert language == "text", f"{page}: a block of {language} is not run"
    assert "nan" not in capsys.readouterr().out
    left = {path.name for path in tmp_path.iterdir()} - {"scenarios", "results"} - set(map(str, saved))
    assert not left, "what a page leaves goes under results/, which git ignores"


def test_the_error_that_the_tutorial_shows_is_what_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    scenario = next(code for _, language, code in blocks("tutorial") if language == "toml")
    Path("my_robot.toml").write_text(scenario.replace("to_bar = 1.5", "to_bar = -1.5"))
    assert main(["run", "my_robot.toml"]) == 2
    (shown,) = (code for _, language, code in blocks("tutorial") if language == "text")
    assert capsys.readouterr().err == shown


def test_a_newcomer_adds_each_thing_as_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks of CONTRIBUTING: those that begin with a file's name are saved, the others run and import them."""
    monkeypatch.syspath_prepend(tmp_path)
    before, names, files = dict(OUTPUTS), dict[str, Any](), []
    try:
        for _, language, code in blocks("../CONTRIBUTING"):
            if language == "python" and (name := re.match(r"# (\w+)\.py\n", code)):
                (tmp_path / f"{name[1]}.py").write_text(code)
                files.append(name[1])
            elif language == "python":
                exec(compile(code, "CONTRIBUTING.md", "exec"), names)
    finally:
        OUTPUTS.clear()
        OUTPUTS.update(before)
        for file in files:
            sys.modules.pop(file, None)
    assert files == ["sharpest_bend", "follower", "leaf_spring"]


def test_every_extension_is_short() -> None:
    for _, language, code in blocks("extending"):
        assert len(code.splitlines()) < LONGEST_EXTENSION, code
        assert language in ("python", "toml")
    headings = re.findall(r"^## (.+)$", (DOCS / "extending.md").read_text(), re.MULTILINE)
    assert headings == ["A material", "A law", "A robot", "A closure", "A load", "A section", "A study"]


@pytest.mark.parametrize("page", [page for page in PAGES if saved(page)])
def test_what_a_page_shows_is_printed_by_the_file_above_it(page: str) -> None:
    """The scripts of its output run its own files, each of them, and no other scenario."""
    text = (DOCS / f"{page}.md").read_text()
    ran = set()
    for script in re.findall(r"figures/(\w+)\.py\)", text):
        code = (DOCS / "figures" / f"{script}.py").read_text()
        commands = re.findall(r'"softnlp (?:run|identify|design|inverse|sweep) ([^" ]+)', code)
        if commands:
            assert f'page="{page}"' in code, script
            ran |= set(commands)
    if page != "extending":
        assert ran == {name for name, code in saved(page).items() if "study" in tomllib.loads(code)}


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("how-to/")])
def test_a_scenario_of_a_how_to_runs_from_where_the_reader_stands(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenarios").symlink_to(ROOT / "scenarios")
    for name, code in saved(page).items():
        Path(name).write_text(code)
        assert load_scenario(name).step_count > 0


def test_output_that_is_printed_and_drawn_is_that_of_the_page_s_file() -> None:
    from docs.figures import run_inverse, run_loaded

    assert run_loaded.text().startswith("```text\n$ softnlp run loaded.toml\n")
    assert run_loaded.text().count(" solved ") == 5
    assert run_loaded.figure().read_bytes().startswith(b"\x89PNG")
    assert run_inverse.text().startswith("```text\n$ softnlp inverse targets.toml\n")
    assert run_inverse.text().count(" solved ") == 3


def test_what_is_installed_is_this_checkout_and_an_extra_keeps_it_editable() -> None:
    """The package is on no index, and an extra without -e would put a copy in the place of an editable checkout."""
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *WRITTEN]
    said = [command for page in pages for command in re.findall(r"pip install ([^`\n&#]+)", page.read_text())]
    asked = [command for command in said if "softnlp" in command or "." in command.split()]
    extras = [command for command in said if "[" in command]
    assert len(extras) >= 6
    for command in extras:
        assert re.fullmatch(r"""(-q )?-e (["'])\.\[[\w,]+\]\2""", command.strip()), command
    assert not [command for command in asked if "softnlp" in command]


def test_every_name_of_the_interface_is_on_its_page() -> None:
    pages = {page.name: NAMED.findall(page.read_text()) for page in sorted((DOCS / "api").glob("*.md"))}
    shown = [path for paths in pages.values() for path in paths]
    listed = {path.rpartition(".")[2] for path in shown}
    missing = set(softnlp.__all__) - listed - {"__version__"}
    assert not missing, f"add `::: softnlp.MODULE.{sorted(missing)[0]}` to a page of docs/api"
    assert len(shown) == len(set(shown))
    for path in shown:
        module, _, name = path.rpartition(".")
        __import__(f"softnlp.{module}")
        assert hasattr(sys.modules[f"softnlp.{module}"], name), path
    rows = re.findall(r"^\| \[[^\]]+\]\((\w+\.md)\) \| (.+) \|$", (DOCS / "api" / "index.md").read_text(), re.MULTILINE)
    index = {page: re.findall(r"`(\w+)`", names) for page, names in rows}
    assert index == {page: [path.rpartition(".")[2] for path in paths] for page, paths in pages.items() if paths}


def test_every_script_of_a_figure_is_shown_by_a_page() -> None:
    shown = {name for page in WRITTEN for name in re.findall(r"\]\((?:\.\./)?figures/(\w+)\.py\)", page.read_text())}
    assert shown == {script.stem for script in SCRIPTS}


def test_a_figure_is_seen_where_the_repository_is_read() -> None:
    """Each script with a figure has its picture kept beside the pages, and the pages show it."""
    seen = {
        name
        for page in WRITTEN
        for name in re.findall(r"\[!\[[^\]]+\]\((?:\.\./)*images/figures/(\w+)\.png\)\]\(", page.read_text())
    }
    drawn = {s.stem for s in SCRIPTS if re.search(r"^def figure|^text, figure", s.read_text(), re.MULTILINE)}
    assert seen == drawn == {path.stem for path in (DOCS / "images" / "figures").glob("*.png")}


def test_every_page_is_in_the_navigation() -> None:
    written = {page.relative_to(DOCS).as_posix() for page in WRITTEN} - {"mutation.md"}  # CONTRIBUTING leads there
    written |= {f"notebooks/{notebook.stem}.md" for notebook in (DOCS / "notebooks").glob("*.ipynb")}
    listed = set(re.findall(r"([\w/-]+\.md)\s*$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE))
    assert written <= listed
    assert "mutation.md" not in listed


def test_links_between_pages_lead_somewhere() -> None:
    for page in [*WRITTEN, *(DOCS / "notebooks").glob("*.ipynb")]:
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text()):
            assert target.startswith("http") or (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.thorough
@pytest.mark.parametrize("notebook", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs_from_top_to_bottom(notebook: Path) -> None:
    from docs.tools import notebooks

    notebooks.make_one(notebook)  # what is kept of an earlier run was made from the same sources
    page = notebooks.made()[f"notebooks/{notebook.stem}.md"].decode()
    images = re.findall(r"\]\((\w+\.png)\)", page)
    frames = re.findall(r'<iframe src="(\w+\.html)"', page)
    assert len(images) + len(frames) >= 2
    assert all(notebooks.made()[f"notebooks/{image}"].startswith(b"\x89PNG") for image in images)
    assert all(b"softnlp-view" in notebooks.made()[f"notebooks/{frame}"] for frame in frames)
    assert len(frames) == ("NotebookView(" in notebook.read_text())
    assert "Error" not in page


@pytest.mark.parametrize("notebook", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs(notebook: Path) -> None:
    cells = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
    assert cells
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells)
