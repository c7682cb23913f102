"""Figures and tables that scripts of docs/figures make.

A script has `figure()`, which returns a matplotlib figure or the path of a PNG file, or `text()`, which returns
Markdown, or both. A page shows them by a link to the script that stands alone in a paragraph, `[What it
shows](figures/name.py)`, or, where there is a figure, `[![What it shows](images/figures/name.png)](figures/name.py)`:
readers of the repository see the kept picture and reach the script, readers of the site see what it makes now.

`python -m docs.tools.figures` keeps the pictures of the last build of the site, smaller, in docs/images/figures.
"""

from __future__ import annotations

import re
import runpy
import shutil
from pathlib import Path

from docs.tools import cache
from docs.tools.work import Job

DPI = 160
KEPT = cache.ROOT / "docs" / "images" / "figures"
WIDEST = 1000  # of a kept picture [px]
_LINK = re.compile(
    r"^\[(?:!\[(?P<seen>[^\]]+)\]\([^)]+\)|(?P<text>[^\]!]+))\]\((?P<up>(?:\.\./)*)figures/(?P<name>\w+)\.py\)$",
    re.MULTILINE,
)


def _folder(script: Path) -> Path:
    pages = [cache.ROOT / "docs" / f"{page}.md" for page in re.findall(r'page="([^"]+)"', script.read_text())]
    return cache.kept(f"figures/{script.stem}", [script, *pages])


def make_one(script: Path, kept: Path) -> None:
    """Run a script and keep what it makes in a folder: figure.png and text.md."""

    def build(folder: Path) -> None:
        names = runpy.run_path(str(script))
        if "text" in names:
            (folder / "text.md").write_text(names["text"]().strip() + "\n")
        if "figure" in names:
            drawn = names["figure"]()
            if isinstance(drawn, Path):
                shutil.copyfile(drawn, folder / "figure.png")
            else:
                drawn.savefig(folder / "figure.png", dpi=DPI)

    cache.make(kept, build)


def jobs() -> list[Job]:
    """Return what is to be done for the scripts whose result is not kept."""
    folders = ((script, _folder(script)) for script in _scripts())
    return [(make_one, (script, folder)) for script, folder in folders if not folder.is_dir()]


def _scripts() -> list[Path]:
    return sorted((cache.ROOT / "docs" / "figures").glob("[!_]*.py"))


def made() -> dict[str, bytes]:
    """Return the images by their place in the site."""
    files = {f"figures/{script.stem}.png": _folder(script) / "figure.png" for script in _scripts()}
    return {uri: path.read_bytes() for uri, path in files.items() if path.is_file()}


def shown(markdown: str, uri: str) -> str:
    """Return a page with figures and tables in place of the links to their scripts."""

    def replace(match: re.Match[str]) -> str:
        folder = _folder(cache.ROOT / "docs" / "figures" / f"{match['name']}.py")
        text, image = folder / "text.md", folder / "figure.png"
        parts = [text.read_text()] if text.is_file() else []
        if image.is_file():
            link = f"{match['up']}figures/{match['name']}.png"
            parts.append(f"[![{match['seen'] or match['text']}]({link})]({link})")
        return "\n".join(parts)

    return _LINK.sub(replace, markdown)


def keep() -> None:
    """Keep the figures of the last build in the repository, in few colours and no wider than `WIDEST`."""
    from PIL import Image

    KEPT.mkdir(parents=True, exist_ok=True)
    for script in _scripts():
        drawn = sorted(_folder(script).parent.glob("*/figure.png"), key=lambda path: path.stat().st_mtime)
        if drawn:
            picture = Image.open(drawn[-1]).convert("RGB")
            picture.thumbnail((WIDEST, 10 * WIDEST))
            picture.quantize(128).save(KEPT / f"{script.stem}.png", optimize=True)


if __name__ == "__main__":
    keep()
