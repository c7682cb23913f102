"""The 3-D view of a robot in the browser.

`Frame` and `frame_of` need no browser library; `RobotView`, for a page of NiceGUI, and `NotebookView`, for a cell of a
notebook, need the extra `gui` and are imported when they are asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softnlp.app.view.frame import Arrow, Frame, Tube, frame_of
from softnlp.base.lazy import names_of

if TYPE_CHECKING:
    from softnlp.app.view.notebook import NotebookView
    from softnlp.app.view.robot_view import RobotView

__all__ = ["Arrow", "Frame", "NotebookView", "RobotView", "Tube", "frame_of"]

__getattr__ = names_of(
    __name__, {"softnlp.app.view.robot_view": ("RobotView",), "softnlp.app.view.notebook": ("NotebookView",)}
)
