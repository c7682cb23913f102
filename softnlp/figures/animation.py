"""A run as a GIF: its body cut open, seen from one place, step after step."""

from __future__ import annotations

import tempfile
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.figures.body import base_axes, draw_cut_open, frame, view_camera
from softnlp.figures.mesh.animation import frames_of
from softnlp.figures.style import GREY, SMALL, in_own_style, new_figure
from softnlp.results import RunView, write_whole

MOST = 60  # frames
_SHORTEST = 2.4  # of a GIF [s], to which a quicker run is slowed down
_DPI = 80


@in_own_style
def write_gif(view: RunView, path: str | PathLike[str]) -> Path:
    """Write the solved steps of a run as a GIF, whole; return its path.

    Raises
    ------
    InputError
        Where less than two steps have a body, or the file cannot be written.
    """
    from matplotlib.animation import PillowWriter

    if len(view.solved) < 2:
        raise InputError("expected at least two solved steps to move between")
    chosen = frames_of(view.solved, MOST)
    times = None if view.time is None else np.asarray(view.time, float)[chosen]
    lasts = _SHORTEST if times is None else max(float(times[-1] - times[0]), _SHORTEST)
    slower = 1.0 if times is None or times[-1] <= times[0] else lasts / float(times[-1] - times[0])
    words = "" if times is None else "as quick as it is" if slower < 1.01 else f"{slower:.3g} times slower than it is"
    figure = new_figure(5.4, 6.2, view.title or view.robot.name, words)
    camera = view_camera(view)
    axes, reach = base_axes(figure, (2.7, 3.05), view, camera)
    for k in chosen:
        body = view.bodies[k]
        assert body is not None
        wide = float(np.max(body.radii.outer))
        reach += [(body.position + s * wide * body.rotation[:, :, j]) / MILLIMETRE for j in (0, 1) for s in (-1, 1)]
    frame(axes, np.vstack(reach))
    said = figure.text(0.982, 0.053, "", size=SMALL, color=GREY, ha="right")
    kept = set(axes.get_children())
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.gif"
        writer = PillowWriter(fps=max(1, round(len(chosen) / lasts)))
        with writer.saving(figure, str(file), dpi=_DPI):
            for k in chosen:
                _clear(axes, kept)
                draw_cut_open(axes, view, k, camera.eye, camera.light, tip_frame=False)
                said.set_text(f"step {k + 1}" if view.time is None else f"t = {view.time[k]:.3f} s")
                writer.grab_frame()
        return write_whole(path, file.read_bytes())


def _clear(axes: Any, kept: set[object]) -> None:
    """Remove what the last frame has drawn."""
    for artist in [one for one in axes.get_children() if one not in kept]:
        artist.remove()
