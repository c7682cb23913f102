"""Imports go down one list only, physics stays symbolic, importing the package is cheap, and no file has grown long."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from fnmatch import fnmatch
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import softnlp

PACKAGE = Path(softnlp.__file__).parent
FILES = sorted(PACKAGE.rglob("*.py"))
# A module imports only what stands above it; the modules of MIXED may import each other within their package.
LAYERS = (
    *("errors", "status", "units", "conventions", "numerics", "reading", "ranges", "contact_settings"),
    *("formula", "laws", "material_reading", "materials", "robot", "section", "rod", "tip", "transcription"),
    *("quantities", "loadcase", "unloaded", "problem", "branch", "solver", "condensed", "continuation", "stability"),
    "implicit",
    *("evaluation", "evaluation.statistics"),
    *(
        "studies",
        "studies.step",
        "studies.pose",
        "studies.pose_grid",
        "studies.attempts",
        "studies.statics",
        "studies.arc",
        "studies.forward",
        "studies.wall",
        "studies.weighted",
    ),
    *(
        "studies.fit_statistics",
        "studies.tensile",
        "studies.measurements",
        "studies.free_constants",
        "studies.implicit",
    ),
    *("studies.free_shape", "studies.blocked_grid", "studies.blocked_step", "studies.blocked", "studies.multistart"),
    *(
        "studies.trial",
        "studies.predicted_pose",
        "studies.predicted_force",
        "studies.identify_task",
        "studies.identified",
    ),
    *(
        "studies.force_inversion",
        "studies.derivatives",
        "studies.sensitivity",
        "studies.tolerances",
        "studies.ellipsoids",
    ),
    *("studies.tip_map", "studies.bounded", "studies.inverse_task", "studies.aiming", "studies.inverse_nlp"),
    *("studies.inverse_solver", "studies.weight_sensitivity"),
    *("studies.design_task", "studies.design_evaluate", "studies.design_problem", "studies.design_optimise"),
    *("studies.design_candidate", "studies.design_search", "studies.design", "studies.*"),
    *("batch", "batch.arrays", "batch.predictor", "batch.csource", "batch.interpreted", "batch.compiled"),
    *("batch.shooting", "batch.grids", "batch.reduced", "batch.reduced_contact", "batch.stretches", "batch.*"),
    *("workspace", "workspace.poses", "workspace.plan", "workspace.pose_lane", "workspace.blocked_lane"),
    *("workspace.chunk", "workspace.task", "workspace.table", "workspace.manufacture"),
    *("evaluation.variants", "evaluation.observed", "evaluation.simulated", "evaluation.comparison"),
    "evaluation.compare",
    "scenario_schema",
    *("schema_workspace", "schema_inverse", "schema_identify", "schema_design"),
    *("scenario_check", "pressures", "columns", "measured_rows", "scenario_contact"),
    *("scenario_workspace", "scenario_inverse", "scenario_identify", "scenario_design"),
    "scenario",
    *("workspace.planning", "workspace.journal", "workspace.worker", "workspace.pool"),
    *(
        "runner_run",
        "runner_blocked",
        "runner_inverse",
        "runner",
        "runner_design",
        "runner_identify",
        "runner_compare",
        "results",
    ),
    *("workspace.columns", "workspace.sink", "workspace.dataset", "workspace.run"),
    *("workspace.read", "workspace.boundary", "workspace.dexterity", "workspace.summary", "workspace.export"),
    *("workspace.measured", "workspace.again", "workspace.comparison"),
    "palette",
    "mesh",
    *("plots", "app", "cli", "__main__"),
)
MIXED = ("results", "mesh", "plots", "app", "cli")
LONGEST_FILE = 400
HEAVY = ("casadi", "numpy", "scipy", "matplotlib", "pydantic", "cyclopts", "rich", "xarray", "h5netcdf", "h5py")


def module_name(file: Path) -> str:
    """Return the module of a file as the layers name it; "" is the package itself."""
    parts = file.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(file): file for file in FILES}


def imported(file: Path) -> set[str]:
    """Return the modules of this package that a file imports anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            # `from softnlp import rod` names a module, `from softnlp.rod import Loads` does not
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            head, _, rest = name.partition(".")
            if head == "softnlp" and rest != "__version__":
                found.add(rest if rest in MODULES else rest.rpartition(".")[0])
    return found


IMPORTS = {name: imported(file) for name, file in MODULES.items() if name}


def rank(module: str) -> int:
    """Return the line of a module in the layers."""
    name = next((package for package in MIXED if module.split(".")[0] == package), module)
    lines = [k for k, line in enumerate(LAYERS) if line == name] or [
        k for k, p in enumerate(LAYERS) if fnmatch(name, p)
    ]
    assert lines, f"{module} is new: give it a place in LAYERS"
    return lines[0]


@pytest.mark.parametrize("module", sorted(IMPORTS))
def test_a_module_imports_only_from_above(module: str) -> None:
    assert rank(module) >= 0
    for other in IMPORTS[module]:
        assert other, "import from the module, not from the package"
        same = module.split(".")[0] == other.split(".")[0] and module.split(".")[0] in MIXED
        assert same or rank(other) < rank(module), f"{module} imports {other}"


def test_there_is_no_cycle() -> None:
    assert len(list(TopologicalSorter(IMPORTS).static_order())) >= len(IMPORTS)


def test_the_order_was_read_from_the_files() -> None:
    """The tests above would pass without imports; these are known."""
    assert {"materials", "robot"} <= IMPORTS["section"]
    assert "section" in IMPORTS["rod"]
    assert "rod" in IMPORTS["loadcase"]  # from softnlp import rod
    assert {"runner", "results", "scenario", "cli.console"} <= IMPORTS["cli.run"]  # within functions


@pytest.mark.parametrize("module", ["section", "rod"])
def test_physics_uses_no_function_that_a_symbol_cannot_pass(module: str) -> None:
    """math.sqrt of a symbol is nan without a word."""
    tree = ast.parse(MODULES[module].read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            assert not {alias.name.split(".")[0] for alias in node.names} & {"math", "numpy", "scipy"}
        if isinstance(node, ast.ImportFrom):
            assert str(node.module).split(".")[0] not in ("math", "numpy", "scipy")


@pytest.mark.parametrize(
    ("module", "owner"),
    [("robot", "Robot"), *(("laws", f) for f in ("_linear", "_neo_hookean", "_mooney_rivlin", "_yeoh", "_ogden"))],
)
def test_what_may_hold_symbols_uses_numbers_of_math_only(module: str, owner: str) -> None:
    tree = ast.parse(MODULES[module].read_text())
    math_functions = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == "math"
        for alias in node.names
    } - {"pi", "inf"}
    body = next(n for n in tree.body if isinstance(n, ast.ClassDef | ast.FunctionDef) and n.name == owner)
    used = {n.id for n in ast.walk(body) if isinstance(n, ast.Name)}
    assert not used & (math_functions | {"math", "np"})


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(PACKAGE)))
def test_no_file_is_long(file: Path) -> None:
    assert len(file.read_text().splitlines()) <= LONGEST_FILE


def modules_after(code: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter has after some code."""
    words = f"{code}; import sys; print(*{{m.partition('.')[0] for m in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_importing_the_package_imports_nothing_heavy() -> None:
    assert not modules_after("import softnlp") & set(HEAVY)
    assert "casadi" in modules_after("from softnlp import robot")  # the list above can be reached


def test_the_version_is_printed_without_heavy_imports() -> None:
    assert not modules_after("from softnlp.cli import main; main(['--version'])") & set(HEAVY)


def test_solving_needs_neither_figures_nor_files() -> None:
    assert not modules_after("from softnlp import forward, material, robot") & {"matplotlib", "xarray", "pydantic"}


@pytest.mark.parametrize("name", softnlp.__all__)
def test_every_name_of_the_interface_is_there(name: str) -> None:
    assert getattr(softnlp, name) is not None
    assert name in dir(softnlp)


def test_the_interface_wins_over_a_submodule_of_the_same_name() -> None:
    importlib.import_module("softnlp.robot")
    assert callable(softnlp.robot)
    code = "import softnlp.section; from softnlp import Loads, robot; print(robot('D25L60').name)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "D25L60\n", done.stderr


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'softnlp' has no attribute 'robots'"):
        _ = softnlp.robots
