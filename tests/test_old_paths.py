"""Modules of version 0.1 still import under their old names, with a warning, and are today's."""

from __future__ import annotations

import importlib
import subprocess
import sys
from types import ModuleType

import pytest

import softnlp
from softnlp.base.old_paths import _FOLDERS, _MOVED, _RENAMED, new_name

OLD = [
    *(f"{before}.{module}".lstrip(".") for before, _, modules in _MOVED for module in modules.split()),
    *_RENAMED,
    *("workspace", "workspace.read", "plots", "plots.style", "mesh", "mesh.solid"),
]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("old", OLD)
def test_an_old_name_is_today_s_module(old: str) -> None:
    now = new_name(old)
    assert now is not None
    assert now != old
    assert new_name(now) is None
    sys.modules.pop(f"softnlp.{old}", None)
    with pytest.warns(DeprecationWarning, match=f"softnlp.{old} is now softnlp.{now}; the old name goes with"):
        found = importlib.import_module(f"softnlp.{old}")
    today = importlib.import_module(f"softnlp.{now}")
    public = {name for name, value in vars(today).items() if not (name[:2] == "__" or isinstance(value, ModuleType))}
    assert found is today or public <= set(vars(found))


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_names_that_left_their_module_are_found_where_they_were() -> None:
    from softnlp.quantities import Model, Quantity, quantity
    from softnlp.workspace.run import WORKSPACE_FILE, run_sweep

    from softnlp.scenario import load_scenario

    assert run_sweep is softnlp.run_sweep
    assert WORKSPACE_FILE == "workspace.nc"
    assert quantity("x", "1", 2.0).nominal == 2.0
    assert (Model.__module__, Quantity.__module__) == ("softnlp.model.model", "softnlp.base.quantity")
    assert load_scenario is softnlp.load_scenario


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_an_old_module_takes_the_place_of_no_module_of_today() -> None:
    import softnlp.sweep.run

    today = softnlp.sweep.run
    for old in ("workspace", "workspace.run", "workspace.read"):
        sys.modules.pop(f"softnlp.{old}", None)
    from softnlp.workspace import run

    assert hasattr(run, "run_sweep")
    assert softnlp.sweep.run is sys.modules["softnlp.sweep.run"] is today


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_name_that_was_never_there_is_none() -> None:
    with pytest.warns(DeprecationWarning, match="softnlp.scenario.load_scenario is now softnlp.scenario.read"):
        importlib.import_module("softnlp.scenario").load_scenario  # noqa: B018
    with pytest.raises(ImportError, match="cannot import name 'load'"):
        from softnlp.scenario import load  # noqa: F401


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_no_other_name_is_found() -> None:
    assert set(_FOLDERS) == {"workspace", "plots", "mesh", "evaluation"}
    for unknown in ("softnlp.robots", "softnlp.studies.nothing", "softnlp.plots.nothing"):
        with pytest.raises(ModuleNotFoundError):
            importlib.import_module(unknown)


def test_the_interface_wins_over_an_old_module_of_the_same_name() -> None:
    code = "import softnlp.robot, softnlp; from softnlp import Loads, robot; print(robot('D25L60').name, softnlp.robot)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.startswith("D25L60 <function robot"), done.stderr
