"""From a scenario file to the study that it asks for."""

from __future__ import annotations

from typing import Any


def __getattr__(name: str) -> Any:
    """Return what version 0.1 had in the module of this name; it warns, until version 0.3."""
    import warnings
    from importlib import import_module

    read = import_module("softnlp.scenario.read")
    if name.startswith("__") or not hasattr(read, name):
        raise AttributeError(f"module 'softnlp.scenario' has no attribute '{name}'")
    warnings.warn(
        f"softnlp.scenario.{name} is now softnlp.scenario.read.{name}; the old name goes with version 0.3",
        DeprecationWarning,
        stacklevel=2,
    )
    return getattr(read, name)
