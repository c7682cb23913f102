"""Notebooks, stored without outputs, run and turned into pages with them."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from html import unescape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from docs.tools import cache
from docs.tools.work import Job


def _folder(notebook: Path) -> Path:
    return cache.kept(f"notebooks/{notebook.stem}", [notebook])


def jobs() -> list[Job]:
    """Return what is to be done for the notebooks whose result is not kept."""
    return [(make_one, (path,)) for path in _notebooks() if not _folder(path).is_dir()]


def make_one(path: Path) -> None:
    """Run a notebook, if its result is not kept, and keep it as a page with its images; raises as `run`."""
    cache.make(_folder(path), lambda folder: _build(path, folder))


def _notebooks() -> list[Path]:
    return sorted((cache.ROOT / "docs" / "notebooks").glob("*.ipynb"))


def run(path: Path) -> Any:
    """Return a notebook after running it top to bottom in the top folder of the repository.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        Where a cell raises.
    """
    import nbformat
    from jupyter_client import AsyncKernelManager
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    where = {"metadata": {"path": str(cache.ROOT)}}
    with TemporaryDirectory() as folder:
        # The sockets stand beside this file; without it those of two notebooks would be the same
        file = f"{folder}/kernel.json"
        kernel = AsyncKernelManager(kernel_name="python3", transport="ipc", connection_file=file)
        NotebookClient(notebook, km=kernel, timeout=120, resources=where).execute()
    return notebook


def _build(path: Path, folder: Path) -> None:
    parts = []
    for number, cell in enumerate(run(path).cells):
        if cell.cell_type == "markdown":
            parts.append(re.sub(r"(\]\(\w+)\.ipynb\)", r"\1.md)", cell.source))
            continue
        parts.append(f"```python\n{cell.source}\n```")
        for k, output in enumerate(_joined(cell.outputs)):
            parts.append(_shown(output, folder, f"{path.stem}_{number}_{k}"))
    (folder / f"{path.stem}.md").write_text("\n\n".join(parts) + "\n")


def _joined(outputs: Sequence[Any]) -> list[Any]:
    """Return the outputs of a cell with what was printed in pieces as one, however long it took to come."""
    joined: list[Any] = []
    for output in outputs:
        if joined and output.output_type == "stream" and joined[-1].get("name") == output.name:
            joined[-1].text += output.text
        else:
            joined.append(output)
    return joined


def _shown(output: Any, folder: Path, name: str) -> str:
    """Return the Markdown of an output of a cell; an image is written into the folder."""
    data = output.get("data", {})
    if "image/png" in data:
        (folder / f"{name}.png").write_bytes(base64.b64decode(data["image/png"]))
        return f"![Output of the cell above]({name}.png)"
    if (html := data.get("text/html", "")).startswith("<iframe srcdoc="):
        return _framed(html, folder, name)
    if html.startswith("<div>"):  # of the package; that of others may hold scripts
        return f'<div class="cell">{html}</div>'
    text = output.get("text") or data.get("text/markdown") or data.get("text/plain", "")
    return text if "text/markdown" in data else f"```text\n{text.rstrip()}\n```"


def _framed(html: str, folder: Path, name: str) -> str:
    """Return a frame whose page is a file of its own: it is read where the frame is seen, and searched nowhere."""
    page = re.match(r'<iframe srcdoc="([^"]*)"', html)
    assert page is not None
    (folder / f"{name}.html").write_text(unescape(page[1]))
    return html.replace(f'srcdoc="{page[1]}"', f'src="{name}.html" loading="lazy"')


def made() -> dict[str, bytes]:
    """Return pages and images by their place in the site."""
    found = {}
    for notebook in _notebooks():
        for path in sorted(_folder(notebook).glob("*")):
            found[f"notebooks/{path.name}"] = path.read_bytes()
    return found
