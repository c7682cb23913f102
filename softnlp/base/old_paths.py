"""Modules under the names that they had in version 0.1: they still import, with a warning, until version 0.3."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

# Package of then, package of now, the modules that went from one to the other; then those with a new name of their own.
_MOVED = (
    ("", "base", "errors palette processes ranges reading status units"),
    ("", "model", "contact_settings conventions formula gravity laws material_reading materials numerics quantities"),
    ("", "model", "robot rod rules section tip"),
    ("", "nlp", "continuation implicit optimality problem solver transcription"),
    ("", "scenario", "measured_rows pressures schema_design schema_identify schema_inverse schema_workspace"),
    ("", "statics", "body branch condensed loadcase stability unloaded"),
    ("evaluation", "base", "statistics"),
    ("evaluation", "studies", "compare comparison variants"),
    ("results", "base", "files netcdf"),
    ("results", "model", "inputs"),
    ("results", "studies", "fields"),
    ("studies", "nlp", "bounded"),
    ("studies", "statics", "arc attempts blocked blocked_grid blocked_step free_shape multistart pose pose_grid step"),
    ("studies", "statics", "wall weighted"),
    ("workspace", "batch", "blocked_lane chunk plan pose_lane poses"),
    ("workspace", "scenario", "planning"),
)
_RENAMED = {
    "columns": "base.csv_columns",
    "evaluation.observed": "studies.comparison",
    "evaluation.simulated": "studies.compare",
    "results.targets": "studies.fields",
    "runner": "scenario.run",
    "runner_blocked": "scenario.run_blocked",
    "runner_compare": "scenario.compare",
    "runner_design": "scenario.run_design",
    "runner_identify": "scenario.run_identify",
    "runner_inverse": "scenario.run_inverse",
    "runner_run": "scenario.partial",
    "scenario_check": "scenario.check",
    "scenario_contact": "scenario.contact",
    "scenario_design": "scenario.design",
    "scenario_identify": "scenario.identify",
    "scenario_inverse": "scenario.inverse",
    "scenario_schema": "scenario.schema",
    "scenario_workspace": "scenario.workspace",
    "studies.aiming": "studies.targets",
    "studies.design_search": "studies.design",
    "studies.free_constants": "studies.identified",
    "studies.identify_task": "studies.measurements",
    "studies.implicit": "nlp.implicit",
    "studies.inverse_task": "studies.targets",
    "studies.predicted_force": "studies.predicted",
    "studies.predicted_pose": "studies.predicted",
    "studies.statics": "statics.solver",
    "studies.tip_map": "studies.targets",
    "studies.trial": "studies.predicted",
}
_FOLDERS = {"workspace": "sweep", "plots": "figures", "mesh": "figures.mesh", "evaluation": "studies"}
# Names that left a module which is still there.
_NAMES = {
    "loadcase": {"Equation": "nlp.case"},
    "quantities": {"Quantity": "base.quantity", "quantity": "base.quantity"},
    "workspace.run": {"run_sweep": "scenario.run_workspace"},
}

_NEW = {f"{before}.{m}".lstrip("."): f"{now}.{m}" for before, now, modules in _MOVED for m in modules.split()}
_NEW |= _RENAMED | _FOLDERS


def new_name(old: str) -> str | None:
    """Return the module of today for one of version 0.1, both without the package's own name; None for any other."""
    if old in _NEW:
        return _NEW[old]
    package, _, module = old.rpartition(".")
    return f"{_FOLDERS[package]}.{module}" if package in _FOLDERS else None


class _OldPaths(MetaPathFinder, Loader):
    """Finds modules by their old names, before the finders that would load a file twice, under both names."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> Any:
        """Return how to load a module of an old name, None for any other."""
        package, _, old = fullname.partition(".")
        if package != _PACKAGE or new_name(old) is None:
            return None
        return ModuleSpec(fullname, self, is_package=old in _FOLDERS)

    def exec_module(self, module: ModuleType) -> None:
        """Put today's module, or what offers its names and those that left it, in the place of an old one."""
        old = module.__name__.partition(".")[2]
        now = f"{_PACKAGE}.{new_name(old)}"
        warnings.warn(
            f"{module.__name__} is now {now}; the old name goes with version 0.3", DeprecationWarning, stacklevel=2
        )
        found = import_module(now)
        if old in _FOLDERS or old in _NAMES:
            # A module of its own: importing a module sets it as an attribute of the package that it is found in.
            offered = {key: value for key, value in vars(found).items() if not isinstance(value, ModuleType)}
            module.__dict__.update({key: value for key, value in offered.items() if not key.startswith("__")})
            for name, home in _NAMES.get(old, {}).items():
                setattr(module, name, getattr(import_module(f"{_PACKAGE}.{home}"), name))
        else:
            sys.modules[module.__name__] = found


_PACKAGE = __name__.partition(".")[0]


def install() -> None:
    """Let old names be imported."""
    if not any(isinstance(finder, _OldPaths) for finder in sys.meta_path):
        sys.meta_path.insert(0, _OldPaths())
