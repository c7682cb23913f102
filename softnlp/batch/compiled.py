"""C compiled to a library that is kept by its content, or nothing where there is no compiler."""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

_FLAGS = ("-O1", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")
_LONGEST_BUILD = 120.0  # seconds


def library(source: str, *, build: bool = True) -> ctypes.CDLL | None:
    """Return the compiled source, from the cache if it was compiled before.

    build : whether to compile what the cache does not hold. None where it is not there, there is no C compiler, or it
    fails: compiled code is only faster.
    """
    folder = cache_folder()
    if folder is None:
        return None
    command = compiler()
    told = "\n".join([source, *_FLAGS, *(command or ()), _processor()])
    path = folder / f"{hashlib.sha256(told.encode()).hexdigest()[:32]}.so"
    if not path.exists() and not (build and command is not None and _build(source, command, path)):
        return None
    try:
        return ctypes.CDLL(str(path))
    except OSError:  # a library of another machine, or cut short
        with suppress(OSError):
            path.unlink()
        return None


def compiler() -> tuple[str, ...] | None:
    """Return the command of the C compiler, $CC or cc; None where there is none or SOFTNLP_COMPILE is 0."""
    if os.environ.get("SOFTNLP_COMPILE") == "0":
        return None
    words = os.environ.get("CC", "cc").split()
    return tuple(words) if words and shutil.which(words[0]) else None


def cache_folder() -> Path | None:
    """Return the folder of compiled libraries, None where it cannot be made or is not only the user's."""
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folder = Path(base) / "softnlp"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError:
        return None
    mine = not hasattr(os, "getuid") or status.st_uid == os.getuid()
    return folder if mine and not status.st_mode & 0o022 and os.access(folder, os.W_OK) else None


@lru_cache(maxsize=1)
def _processor() -> str:
    """Return what -march=native depends on."""
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return "\n".join(next((line for line in lines if line.startswith(key)), "") for key in ("model name", "flags"))
    return f"{platform.machine()} {platform.processor()} {platform.node()}"


def _build(source: str, command: tuple[str, ...], path: Path) -> bool:
    """Compile to a file beside the target and put it in place in one move."""
    try:
        with tempfile.TemporaryDirectory(dir=path.parent) as work:
            text, made = Path(work) / "steps.c", Path(work) / "steps.so"
            text.write_text(source)
            done = subprocess.run(
                [*command, *_FLAGS, str(text), "-o", str(made), "-lm"],
                capture_output=True,
                timeout=_LONGEST_BUILD,
                check=False,
            )
            if done.returncode:
                return False
            os.replace(made, path)
    except (OSError, subprocess.SubprocessError):
        return False
    return True
