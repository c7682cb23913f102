"""What changes where the tests run against mutants of the code (docs/mutation.md); nothing otherwise."""

from __future__ import annotations

import os
from collections.abc import Sequence

import pytest
from hypothesis import Phase, settings

# Always the same examples, and no time spent on making a failure small.
settings.register_profile("mutation", derandomize=True, database=None, phases=(Phase.explicit, Phase.generate))

# A mutant has to be found by the tests of its own module, not by a solve somewhere above it that happens to change.
TESTS_OF = {
    "formula": ("test_formula.py", "test_materials.py"),
    "laws": ("test_materials.py", "test_formula.py"),
    "material_reading": ("test_materials.py",),
}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the tests of the mutated module, in the order of the files; all of them where nothing is mutated."""
    mutant = os.environ.get("MUTANT_UNDER_TEST", "")
    if not mutant.startswith("softnlp."):
        return
    module = mutant.split(".")[1]
    files: Sequence[str] = TESTS_OF.get(module, (f"test_{module}.py",))
    kept = [item for name in files for item in items if item.path.name == name]
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = kept
