"""Pages that set this package beside the published paper; every number on them is computed when they are built.

    python -m docs.paper --out FOLDER

Each page is a module with `page(folder) -> str`, which writes its figures into a folder and returns Markdown. Pages are
kept by the content that they depend on, so building them again takes no time.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from pathlib import Path

from docs.paper.cache import cache_folder, digest

PAGES = ("bending", "blocked", "constraint", "workspace", "laparoscope", "times")
"""Modules of this package, in the order in which they are read."""
INDEX = "index"

Done = Callable[[int], None]


def build(folder: Path, names: Sequence[str] = PAGES, *, cache: Path | None = None, done: Done | None = None) -> None:
    """Write pages and their figures into a folder, with an index of all.

    names : of `PAGES`. cache : where finished pages are kept; by default of the user. done : called with the number of
    pages built so far.

    Raises
    ------
    ValueError
        For a name that is not a page.
    """
    if unknown := [name for name in names if name not in PAGES]:
        raise ValueError(f"unknown page {unknown[0]!r}; expected one of {', '.join(PAGES)}")
    folder.mkdir(parents=True, exist_ok=True)
    for count, name in enumerate(names, start=1):
        for file in sorted(built(name, cache or cache_folder()).iterdir()):
            shutil.copyfile(file, folder / file.name)
        if done is not None:
            done(count)
    (folder / f"{INDEX}.md").write_text(_index(), encoding="utf-8")


def pages(cache: Path | None = None) -> Iterator[tuple[str, str]]:
    """Yield the file name and the Markdown of every page, the index first; figures are written by `build`."""
    yield f"{INDEX}.md", _index()
    for name in PAGES:
        yield f"{name}.md", (built(name, cache or cache_folder()) / f"{name}.md").read_text(encoding="utf-8")


def titles() -> dict[str, str]:
    """Return the title of each page by its name."""
    return {name: title for name, (title, _) in _CONTENTS.items()}


def built(name: str, cache: Path) -> Path:
    """Return the folder of a finished page, building it where it is not kept."""
    kept = cache / f"{name}-{digest()}"
    if not kept.is_dir():
        kept.parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(_scratch(cache))
        try:
            text = import_module(f"docs.paper.{name}").page(fresh)
            (fresh / f"{name}.md").write_text(text, encoding="utf-8")
            for old in cache.glob(f"{name}-*"):
                shutil.rmtree(old, ignore_errors=True)
            fresh.rename(kept)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
    return kept


def _scratch(cache: Path) -> str:
    from tempfile import mkdtemp

    return mkdtemp(dir=cache, prefix=".building-")


def _index() -> str:
    """Return the page that lists the others."""
    lines = [f"- [{title}]({name}.md): {words}" for name, (title, words) in _CONTENTS.items()]
    return "\n".join(["# The paper, reproduced", "", _INTRODUCTION, "", *lines, ""])


_INTRODUCTION = (
    "What the paper simulated and measured, computed again with this package. Published and measured numbers come from "
    "[data files](../../scenarios/files/published.toml); all others are computed when the pages are built. Where we "
    "differ, the page says why."
)
_CONTENTS = {
    "bending": ("Bending and elongation", "the robots with one to three sets, every law, with and without stiffening"),
    "blocked": ("Blocked tip force", "all robots, hyperelastic laws, every closure, with RMSE and MAPE"),
    "constraint": ("The chamber constraint", "the blocked force with and without it"),
    "workspace": ("Workspace", "the tip along a sequence of pressures"),
    "laparoscope": ("Laparoscope", "published angles; choice of silicone and chambers"),
    "times": ("Run times", "beside the paper's method, and the published ones"),
}
