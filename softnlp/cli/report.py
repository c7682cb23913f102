"""`--report FILE.html`: one page of what a study read, found and drew."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from softnlp.base.reading import IMPORTED
from softnlp.cli.console import say
from softnlp.cli.figures import draw

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softnlp.model.materials import Material
    from softnlp.results.report_page import Section
    from softnlp.scenario.read import Scenario

Report = Annotated[Path | None, Parameter(help="Write a report as one HTML page that needs no other file.")]


def write_report(
    file: Path | None,
    asked: Scenario,
    document: str,
    figures: Mapping[str, Callable[[], Figure]],
    sections: Sequence[Section] = (),
    quiet: bool = False,
    texts: Mapping[str, str] | None = None,
) -> None:
    """Write a report, if one is asked for; document : JSON of the study, figures and texts : by caption."""
    if file is None:
        return
    from softnlp.base.files import write_whole
    from softnlp.results.report_page import report_page

    with tempfile.TemporaryDirectory() as folder:
        paths = {Path(folder) / f"{k}.png": name for k, name in enumerate(figures)}
        drawn = draw({path: figures[name] for path, name in paths.items()})
        images = {paths[path]: path.read_bytes() for path in drawn}
    every = {**(texts or {}), "Scenario": asked.text, **_imports(asked)}
    page = report_page(asked.title, json.loads(document), images, every, sections)
    write_whole(file, page.encode())
    if not quiet:
        say(f"report in {file}")


def _imports(asked: Scenario) -> dict[str, str]:
    """Return the import files that a scenario names, by their names."""
    import tomllib

    tables = [table for table in tomllib.loads(asked.text).values() if isinstance(table, dict)]
    named = [table["file"] for table in tables if str(table.get("file", "")).endswith(IMPORTED)]
    paths = {name: asked.path.parent / name for name in named}
    return {f"Conversion {name}": path.read_text(encoding="utf-8") for name, path in paths.items() if path.is_file()}


def library_section(found: Material) -> Section:
    """Return the stiffness of a silicone beside those of the library, with the ratio."""
    from softnlp.model.materials import load_materials
    from softnlp.results.report_page import Section

    own = float(found.shear_modulus(1.0)) / 1e6
    rows = [[found.name, found.law.name, f"{own:.4g}", "1"]]
    for name, silicone in load_materials().items():
        for law, model in silicone.models.items():
            size = float(model.shear_modulus(1.0)) / 1e6
            rows.append([name, law, f"{size:.4g}", f"{own / size:.3g}" if size else ""])
    return Section("Beside the library", ("silicone", "law", "shear modulus at stretch 1 [MPa]", "ratio"), rows)
