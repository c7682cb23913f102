"""Modules under the names that they had in version 0.1: they still import, with a warning, until version 0.3."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.abc import Loader, MetaPathFinder

    class _Finder(MetaPathFinder, Loader): ...
else:
    _Finder = object  # importing `importlib.abc` takes a third of what importing this package does

# Package of then, package of now, the modules that went from one to the other; then those of today that came of others.
_MOVED = (
    ("", "base", "errors palette processes ranges reading status units"),
    ("", "model", "contact_settings conventions formula gravity laws material_reading materials numerics quantities"),
    ("", "model", "robot rod rules section tip"),
    ("", "nlp", "continuation implicit optimality problem solver transcription"),
    ("", "scenario", "measured_rows pressures"),
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
)
_MERGED = {
    "base.csv_columns": "columns",
    "figures.compare": "plots.compare_tips",
    "figures.compare_parts": "plots.boxes",
    "figures.mesh.solid": "mesh.export",
    "figures.run": "plots.blocked plots.inverse",
    "figures.series": "plots.abscissa",
    "figures.space": "plots.cloud",
    "figures.workspace": "plots.dexterity",
    "nlp.implicit": "studies.implicit",
    "results.folder": "results.view",
    "results.table": "results.csv_table results.terminal",
    "scenario.blocked_force": "runner_blocked scenario_contact",
    "scenario.check": "scenario_check",
    "scenario.compare": "runner_compare",
    "scenario.data": "runner_run",
    "scenario.design": "runner_design scenario_design schema_design",
    "scenario.identify": "runner_identify scenario_identify schema_identify",
    "scenario.inverse": "runner_inverse scenario_inverse schema_inverse",
    "scenario.run": "runner",
    "scenario.schema": "scenario_schema",
    "scenario.workspace": "scenario_workspace schema_workspace workspace.planning",
    "statics.solver": "studies.statics",
    "studies.compare": "evaluation.simulated",
    "studies.comparison": "evaluation.observed",
    "studies.design": "studies.design_search",
    "studies.fields": "results.targets",
    "studies.identified": "studies.free_constants",
    "studies.inverse_problem": "studies.inverse_nlp",
    "studies.measurements": "studies.identify_task",
    "studies.predicted": "studies.predicted_force studies.predicted_pose studies.trial",
    "studies.targets": "studies.aiming studies.inverse_task studies.tip_map",
    "sweep.comparison": "workspace.again",
    "sweep.dataset": "workspace.sink",
    "sweep.pool": "workspace.worker",
    "sweep.read": "workspace.export",
    "sweep.task": "workspace.table",
}
_RENAMED = {old: now for now, modules in _MERGED.items() for old in modules.split()}
_FOLDERS = {"workspace": "sweep", "plots": "figures", "mesh": "figures.mesh", "evaluation": "studies"}
# Names that left a module which is still there.
_NAMES = {
    "section": dict.fromkeys(("deform", "reference_area"), "model.round_chambers"),
    "loadcase": {"Equation": "nlp.case"},
    "problem": {"Constraint": "nlp.constraint"},
    "quantities": {"Quantity": "base.quantity", "quantity": "base.quantity"},
    "workspace.run": {"run_sweep": "scenario.workspace"},
}

_NEW = {f"{before}.{m}".lstrip("."): f"{now}.{m}" for before, now, modules in _MOVED for m in modules.split()}
_NEW |= _RENAMED | _FOLDERS


def new_name(old: str) -> str | None:
    """Return the module of today for one of version 0.1, both without the package's own name; None for any other."""
    if old in _NEW:
        return _NEW[old]
    package, _, module = old.rpartition(".")
    return f"{_FOLDERS[package]}.{module}" if package in _FOLDERS else None


class _OldPaths(_Finder):
    """Finds modules by their old names, before the finders that would load a file twice, under both names."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> Any:
        """Return how to load a module of an old name, None for any other."""
        package, _, old = fullname.partition(".")
        if package != _PACKAGE or new_name(old) is None:
            return None
        return ModuleSpec(fullname, self, is_package=old in _FOLDERS)

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to the interpreter."""

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
