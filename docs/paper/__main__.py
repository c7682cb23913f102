"""Build the pages: `python -m docs.paper --out FOLDER [--page NAME]`."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

from docs.paper import INDEX, PAGES, build
from docs.paper.cache import cache_folder
from softnlp.cli.console import progress, say


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the pages and say what was written and how long it took."""
    parser = argparse.ArgumentParser(prog="python -m docs.paper", description="Build the pages about the paper.")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="where the pages are written")
    parser.add_argument("--page", choices=PAGES, action="append", metavar="NAME", help=f"one of {', '.join(PAGES)}")
    parser.add_argument("--cache", type=Path, metavar="FOLDER", help=f"finished pages (default: {cache_folder()})")
    given = parser.parse_args(arguments)
    names = given.page or PAGES
    began = time.perf_counter()
    with progress(len(names), "pages of the paper") as (advance, _):
        build(given.out, names, cache=given.cache, done=advance)
    written = ", ".join(f"{name}.md" for name in (*names, INDEX))
    say(f"{written} in {given.out}, {time.perf_counter() - began:.1f} s")


if __name__ == "__main__":
    main()
