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
    "problem",
    *(f"how-to/{page.stem}" for page in sorted((DOCS / "how-to").glob("*.md"))),
]
SCRIPTS = sorted((DOCS / "figures").glob("[!_]*.py"))
LONGEST_EXTENSION = 30
_BLOCK = re.compile(r"^```(?P<language>\w+)\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)
_SAVE_AS = re.compile(r"Save this as `([\w.]+)`[^`]*$")


def blocks(page: str) -> list[tuple[str, str, str]]:
    """Return (what stands before it, language, code) of each block of a page, "../CONTRIBUTING" among them."""
    text = (DOCS / f"{page}.md").read_text()
    found, end = [], 0
    for match in _BLOCK.finditer(text):
        found.append((text[end : match.start()], match["language"], match["code"]))
        end = match.end()
    return found


def read_toml(before: str, code: str, saved: list[Path]) -> None:
    """Save a file that the page says to save, add tables to the last one, or check a scenario as it stands."""
    if name := _SAVE_AS.search(before):
        saved.append(Path(name[1]))
        saved[-1].write_text(code)
    elif "study" not in tomllib.loads(code):
        saved[-1].write_text(saved[-1].read_text() + "\n" + code)
    else:
        study = tomllib.loads(code)["study"]
        folder = ROOT / "scenarios" / ("identify" if study == "identify" else "")
        assert scenario_from_text(code, folder / "page.toml").study == study
        return
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
    for before, language, code in blocks(page):
        if language == "toml":
            read_toml(before, code, saved)
        elif language == "bash":
            for line in code.splitlines():
                if line.startswith("softnlp "):
                    assert main(shlex.split(line)[1:]) == 0, line
        elif language == "python":
            exec(compile(code, f"{page}.md", "exec"), names)
        else:
            assert language == "text", f"{page}: a block of {language} is not run"
    assert "nan" not in capsys.readouterr().out


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
    for before, language, code in blocks("extending"):
        assert len(code.splitlines()) < LONGEST_EXTENSION, before
        assert language in ("python", "toml")
    headings = re.findall(r"^## (.+)$", (DOCS / "extending.md").read_text(), re.MULTILINE)
    assert headings == ["A material", "A law", "A robot", "A closure", "A load", "A section", "A study"]


def test_the_scenario_of_a_how_to_is_the_one_that_its_figure_runs() -> None:
    """What the page shows differs from the shipped file at most in its title and comments, unless it says otherwise."""
    shipped = {
        "forward": "D25L60_two_sets.toml",
        "loaded": "D25L60_loaded_tip.toml",
        "blocked-force": "blocked/D25L60.toml",
        "design": "design/D25L60_dimensions.toml",
        "identify": "identify/measured_angles.toml",
    }
    for page, name in shipped.items():
        shown = tomllib.loads([code for _, language, code in blocks(f"how-to/{page}") if language == "toml"][-1])
        real = tomllib.loads((ROOT / "scenarios" / name).read_text())
        assert {**shown, "title": ""} == {**real, "title": ""}, page


def test_every_name_of_the_interface_is_on_its_page() -> None:
    shown = re.findall(r"^::: softnlp\.([\w.]+)$", (DOCS / "api.md").read_text(), re.MULTILINE)
    listed = {path.rpartition(".")[2] for path in shown}
    missing = set(softnlp.__all__) - listed - {"__version__"}
    assert not missing, f"add `::: softnlp.MODULE.{sorted(missing)[0]}` to docs/api.md"
    assert len(shown) == len(set(shown))
    for path in shown:
        module, _, name = path.rpartition(".")
        __import__(f"softnlp.{module}")
        assert hasattr(sys.modules[f"softnlp.{module}"], name), path


def test_every_script_of_a_figure_is_shown_by_a_page() -> None:
    pages = [*DOCS.glob("*.md"), *(DOCS / "how-to").glob("*.md")]
    shown = {name for page in pages for name in re.findall(r"\]\((?:\.\./)?figures/(\w+)\.py\)", page.read_text())}
    assert shown == {script.stem for script in SCRIPTS}


def test_every_page_is_in_the_navigation() -> None:
    written = {page.relative_to(DOCS).as_posix() for page in [*DOCS.glob("*.md"), *(DOCS / "how-to").glob("*.md")]}
    written |= {f"notebooks/{notebook.stem}.md" for notebook in (DOCS / "notebooks").glob("*.ipynb")}
    listed = set(re.findall(r"([\w/-]+\.md)\s*$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE))
    assert written <= listed


def test_links_between_pages_lead_somewhere() -> None:
    for page in [*(DOCS / "how-to").glob("*.md"), *(DOCS / "notebooks").glob("*.ipynb")]:
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text()):
            assert target.startswith("http") or (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.thorough
@pytest.mark.parametrize("notebook", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs_from_top_to_bottom(notebook: Path) -> None:
    from docs.tools import notebooks

    notebooks.make_one(notebook)  # what is kept of an earlier run was made from the same sources
    page = notebooks.made()[f"notebooks/{notebook.stem}.md"].decode()
    images = re.findall(r"\]\((\w+\.png)\)", page)
    assert len(images) >= 3
    assert all(notebooks.made()[f"notebooks/{image}"].startswith(b"\x89PNG") for image in images)
    assert "Error" not in page


@pytest.mark.parametrize("notebook", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_is_stored_without_outputs(notebook: Path) -> None:
    cells = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
    assert cells
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells)
