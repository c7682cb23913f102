"""The 3-D view in a cell of a notebook: one page that holds its scripts and frames, and asks nobody for anything."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Iterator
from functools import cache
from html import escape
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.app.view.frame import Frame, cloud_message, frame_message, frame_of, pieces_message
from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.base.files import write_whole
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.results import RunView, view_of_run
from softnlp.statics.step import Run
from softnlp.statics.wall import Wall

_SCRIPTS = Path(__file__).parent / "js"
_PAGE = Path(__file__).with_name("notebook.html")
_LEAST_FULL = 0.05 * BAR  # a run without pressure still needs a scale of colours


class NotebookView:
    """A run as a robot to turn, with a slider over its steps; a notebook shows it as the result of a cell.

    Attributes
    ----------
    page
        The HTML page, which needs no other file.
    height
        Of the cell [px].
    """

    def __init__(self, run: Run | RunView, *, height: int = 420) -> None:
        """Make the page of a run's solved steps.

        Raises
        ------
        InputError
            Without the extra `gui`, which brings three.js; for several segments, and a run without a solution.
        """
        view = view_of_run(run) if isinstance(run, Run) else run
        if "" not in view.robot.parts:
            raise InputError("the view in a notebook takes a robot of one segment", key="run")
        if not view.solved:
            raise InputError("the view in a notebook needs a step with a solution, and this run has none", key="run")
        self.page = _page(view)
        self.height = height

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the page; raises `InputError` when that cannot be."""
        return write_whole(path, self.page.encode())

    def _repr_html_(self) -> str:
        """Return the cell: a frame of its own, so that its styles and scripts do not meet those of the notebook."""
        return (
            f'<iframe srcdoc="{escape(self.page)}" title="The robot of each step, to turn" '
            f'style="width:100%;height:{self.height}px;border:0"></iframe>'
        )


def _page(view: RunView) -> str:
    full = max(float(np.nanmax(view.pressure)), _LEAST_FULL) / BAR
    frames = [
        frame_message(frame, number, full) | {"said": words} for number, (frame, words) in enumerate(_frames(view), 1)
    ]
    targets = None if view.targets is None else cloud_message(view.targets.position / MILLIMETRE, None)
    data = {"robot": pieces_message(view.robot), "frames": frames, "targets": targets}
    filled = {
        "title": escape(view.title or view.robot.name),
        "imports": json.dumps({"imports": _modules()}),
        # text that ends a script would end this one
        "data": json.dumps(data).replace("</", "<\\/"),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda place: filled[place[1]], _PAGE.read_text())


def _frames(view: RunView) -> Iterator[tuple[Frame, str]]:
    """Yield the frame of each solved step, and its line of words."""
    contact = view.contact
    for k in view.solved:
        body = view.bodies[k]
        assert body is not None
        wall: dict[str, Any] = {}
        if contact is not None:
            wall = {"ghost": contact.free[k], "tip_cap": contact.tip_cap}
            if contact.has_wall:
                wall |= {"wall": Wall(contact.wall_point[k], contact.normal[k]), "wall_force": float(contact.force[k])}
        loads = view.loads
        acting = {"tip_force": loads.tip_force, "tip_moment": loads.tip_moment, "gravity": loads.gravity}
        frame = frame_of(view.robot, body, view.pressure[k], **acting, **wall)
        bars = ", ".join(f"{p / BAR:.3g}" for p in view.pressure[k])
        bending = OUTPUTS["bending_angle"].shown(view.bending_angle[k])
        words = f"step {k + 1} of {len(view.status)}: {bars} bar, bending {bending:.1f}°"
        if wall.get("wall_force") is not None:
            words += f", force {wall['wall_force']:.3g} N"
        yield frame, words


@cache
def _modules() -> dict[str, str]:
    """Return the scripts of the view and three.js by the names that they import each other by, as data addresses."""
    spec = find_spec("nicegui")
    homes = [] if spec is None else spec.submodule_search_locations or []
    found = [place for home in homes if (place := Path(home) / "elements/scene/dist/index.js").is_file()]
    if not found:
        raise InputError("the view in a notebook needs the extra gui: pip install -e '.[gui]' in the folder of softnlp")
    modules = {"nicegui-scene": found[0].read_text()}
    for script in sorted(_SCRIPTS.glob("*.js")):  # a data address has no folder to which ./ could point
        modules[f"softnlp-view/{script.name}"] = script.read_text().replace('from "./', 'from "softnlp-view/')
    return {name: "data:text/javascript;base64," + b64encode(text.encode()).decode() for name, text in modules.items()}
