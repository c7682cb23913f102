"""Options, how hypothesis searches, and what changes where tests run against mutants of the code (docs/mutation.md)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, settings

# How long an example takes says nothing where several programs share the processors.
settings.register_profile("project", deadline=None)
settings.load_profile("project")
# For mutants: always the same examples, and no time spent on making a failure small.
settings.register_profile(
    "mutation",
    deadline=None,
    derandomize=True,
    database=None,
    phases=(Phase.explicit, Phase.generate),
    report_multiple_bugs=False,
)

# A mutant has to be found by the tests of its own module, test_<module>.py, and not by a solve somewhere above it.
MATERIALS = ("test_material_lines.py", "test_formula.py", "test_materials.py")
TESTS_OF = dict.fromkeys(("formula", "laws", "material_reading", "materials"), MATERIALS)
TESTS_OF["round_chambers"] = ("test_section.py",)
LONG = "test_units_only_change_the_numbers"

# Files of five seconds and more, tests that take long among them, in the order of what they take.
LONGEST = (
    *("app_studies", "app_browser", "app_journey", "app_access", "engine", "identify", "workspace_lane", "cli"),
    *("docs", "solver", "inverse"),
    *("sweep", "blocked_force", "forward", "sensitivity", "sweep_processes", "witness_blocked", "design"),
    *("shipped_blocked", "results", "shipped_scenarios", "plots", "workspace_docs", "compare_figures"),
    *("varying", "inverse_solver", "app_workspace", "pages", "view", "tensile", "paper", "problem", "app_session"),
    *("app_material", "app_robot", "app_blocked", "compare", "scenario", "blocked_paths", "blocked_problem"),
    *("user_text", "netcdf", "stability", "workspace_document", "app_inverse", "processes", "random_poses"),
    *("fuzz", "app_sequence", "app_identify", "paper_method", "witness", "figures", "branch", "loads", "rings"),
)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--pictures", type=Path, help="folder that keeps the screenshots of the app")


@pytest.fixture
def pictures(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Return where screenshots go: to the folder asked for, or away with the test."""
    folder: Path = request.config.getoption("--pictures") or tmp_path
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="module")
def opener() -> Iterator[Any]:
    """Yield a function that opens an address in a tab of the file's one Chromium."""
    from tests.browser import browser

    with browser() as open_tab:
        yield open_tab


@pytest.fixture(scope="module")
def new_tab(opener: Any) -> Iterator[Any]:
    """Yield a function that opens a tab on the file's one server of the app."""
    from benchmarks.app import served

    with served() as (address, _):
        yield lambda: opener(address)


@pytest.fixture
def tab(new_tab: Any) -> Iterator[Any]:
    """Yield a tab that shows the app at rest, and hold that it asked for nothing outside and has no errors."""
    opened = new_tab()
    opened.settled()
    yield opened
    assert not opened.outside, "the page asked for something outside of this machine"
    assert not opened.complaints, "the browser's console has errors"
    opened.page.close()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give each file to one worker, in the order of the collection: what a file compiles or opens is made once."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False
    return LoadFileScheduling(config, log)


def pytest_configure(config: pytest.Config) -> None:
    """Run all tests of the mutated module, whichever of them were seen to call the function.

    What a law gives is traced once and kept, so the first test to use it would else be the only one.
    """
    if _is_mutated():
        module = os.environ["MUTANT_UNDER_TEST"].split(".")[1]
        config.args = [f"tests/{name}" for name in TESTS_OF.get(module, (f"test_{module}.py",))]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take longest, so that no worker is left alone with one at the end.

    Of mutants, run last what takes many examples, or long, where the first failure ends the run.
    """
    places = {name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(item.path.stem.removeprefix("test_"), len(LONGEST)))
    if _is_mutated():
        items.sort(
            key=lambda item: (item.name.startswith(LONG), hasattr(getattr(item, "function", None), "hypothesis"))
        )


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Call a mutant found that stops the tests from being imported; interrupted is what pytest calls that."""
    if _is_mutated() and session.testsfailed:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _is_mutated() -> bool:
    return os.environ.get("MUTANT_UNDER_TEST", "").startswith("softnlp.")
