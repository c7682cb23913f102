"""What a run was measured on and with."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

LIBRARIES = ("softnlp", "casadi", "numpy", "scipy", "pyelastica", "numba", "soromox", "jax")


def described() -> dict[str, str]:
    """Return processor, cores, system, Python, versions of the libraries and date, as text by name."""
    said = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
    }
    for name in LIBRARIES:
        try:
            said[name] = version(name)
        except PackageNotFoundError:
            said[name] = "not installed"
    return said | {"date": f"{datetime.now(UTC):%Y-%m-%d}"}


def _processor() -> str:
    """Return the model of the processor; Linux says more than Python does."""
    names: dict[str, str] = {}
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            key, _, value = line.partition(":")
            names.setdefault(key.strip(), value.strip())
    except OSError:
        return platform.processor() or "unknown"
    family = f"family {names.get('cpu family', '?')}, model {names.get('model', '?')}"
    clock = f"{float(names['cpu MHz']) / 1e3:.2g} GHz" if "cpu MHz" in names else "clock unknown"
    return f"{names.get('model name', platform.machine())} ({family}, {clock})"
