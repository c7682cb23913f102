"""Imports go down one list only, physics stays symbolic, importing the package is cheap, and no file has grown long."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import softnlp

PACKAGE = Path(softnlp.__file__).parent
FILES = sorted(PACKAGE.rglob("*.py"))
# A package imports only what stands before it, and itself.
PACKAGES = ("base", "model", "rings", "nlp", "native", "statics", "dynamics", "batch", "studies", "laboratory")
PACKAGES += ("sweep", "scenario", "results", "figures", "mould", "app", "cli")
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
            # `from softnlp import rod` names a module, `from softnlp.model.rod import Loads` does not
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            head, _, rest = name.partition(".")
            if head == "softnlp" and rest != "__version__":
                found.add(rest if rest in MODULES else rest.rpartition(".")[0])
    return found


@cache
def all_imports() -> dict[str, set[str]]:
    """Return what each module imports."""
    return {name: imported(file) for name, file in MODULES.items() if name}


def rank(module: str) -> int:
    """Return the place of a module's package; the package itself, and what starts the command, stand after all."""
    package = module.split(".")[0]
    return len(PACKAGES) if package == "__main__" else PACKAGES.index(package)


@pytest.mark.parametrize("module", sorted(filter(None, MODULES)))
def test_a_module_imports_only_from_above(module: str) -> None:
    for other in all_imports()[module]:
        assert other, "import from the module, not from the package"
        assert rank(other) <= rank(module), f"{module} imports {other}"


def test_there_is_no_cycle() -> None:
    assert len(list(TopologicalSorter(all_imports()).static_order())) >= len(all_imports())


def test_the_order_was_read_from_the_files() -> None:
    """The tests above would pass without imports; these are known."""
    assert {"model.materials", "model.robot"} <= all_imports()["model.round_chambers"]
    assert "model.section" in all_imports()["model.rod"]
    assert "model.rod" in all_imports()["statics.loadcase"]  # from softnlp.model import rod
    assert {"scenario.run", "results", "cli.console"} <= all_imports()["cli.run"]  # within functions


@pytest.mark.parametrize("module", ["model.round_chambers", "model.rod"])
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
    [
        ("model.robot", "Robot"),
        *(("model.laws", f) for f in ("_linear", "_neo_hookean", "_mooney_rivlin", "_yeoh", "_ogden")),
    ],
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


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'softnlp' has no attribute 'robots'"):
        _ = softnlp.robots
