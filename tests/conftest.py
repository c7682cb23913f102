"""Options, how hypothesis searches, and what changes where tests run against mutants of the code (docs/mutation.md)."""

from __future__ import annotations

import os
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
LONG = "test_units_only_change_the_numbers"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--pictures", type=Path, help="folder that keeps the screenshots of the app")


@pytest.fixture
def pictures(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Return where screenshots go: to the folder asked for, or away with the test."""
    folder: Path = request.config.getoption("--pictures") or tmp_path
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give each file to one worker, in the order of their names: what a file compiles or opens is made once."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False  # the browser's tests take longest, and begin early so
    return LoadFileScheduling(config, log)


def pytest_configure(config: pytest.Config) -> None:
    """Run all tests of the mutated module, whichever of them were seen to call the function.

    What a law gives is traced once and kept, so the first test to use it would else be the only one.
    """
    if _is_mutated():
        module = os.environ["MUTANT_UNDER_TEST"].split(".")[1]
        config.args = [f"tests/{name}" for name in TESTS_OF.get(module, (f"test_{module}.py",))]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run last what takes many examples, or long, where the first failure ends the run."""
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
