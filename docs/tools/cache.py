"""Files kept from one build to the next under the hash of everything they were made from."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable, Iterable
from fcntl import LOCK_EX, flock
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / ".cache" / "docs"


@cache
def package_hash() -> str:
    """Return a hash of what any figure may depend on: the package, its materials, the scenarios, the benchmarks."""
    found = [ROOT / "materials.toml", ROOT / "docs" / "tools" / "pages.py", *(ROOT / "docs" / "figures").glob("_*.py")]
    found += [p for folder in ("softnlp", "scenarios", "benchmarks") for p in (ROOT / folder).rglob("*")]
    return hash_of(p for p in found if p.suffix in (".py", ".toml", ".csv"))


def hash_of(files: Iterable[Path]) -> str:
    """Return a hash of the names and contents of files, in whatever order they come."""
    digest = hashlib.sha256()
    for path in sorted(set(files)):
        digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def kept(name: str, sources: Iterable[Path]) -> Path:
    """Return the folder of what is made from sources and the package; it is there when it was made."""
    return FOLDER / name / hashlib.sha256((hash_of(sources) + package_hash()).encode()).hexdigest()[:24]


def make(folder: Path, build: Callable[[Path], None]) -> None:
    """Build into a folder that appears whole, in place of those of older sources."""
    partial, lock = folder.with_name(f"{folder.name}.partial"), folder.parent.with_suffix(".lock")
    lock.parent.mkdir(parents=True, exist_ok=True)
    with lock.open("w") as held:
        flock(held, LOCK_EX)  # another process that makes it is waited for
        if folder.is_dir():
            return
        shutil.rmtree(folder.parent, ignore_errors=True)
        partial.mkdir(parents=True)
        build(partial)
        partial.rename(folder)
