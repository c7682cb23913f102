"""The 3-D view of a robot in the browser.

`Frame` and `frame_of` need no browser library; `RobotView`, for a page of NiceGUI, and `NotebookView`, for a cell of a
notebook, need the extra `gui` and are imported when they are asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softnlp.app.view.frame import Arrow, Frame, Tube, frame_of

if TYPE_CHECKING:
    from softnlp.app.view.notebook import NotebookView
    from softnlp.app.view.robot_view import RobotView

__all__ = ["Arrow", "Frame", "NotebookView", "RobotView", "Tube", "frame_of"]


def __getattr__(name: str) -> Any:
    if name == "RobotView":
        from softnlp.app.view.robot_view import RobotView

        return RobotView
    if name == "NotebookView":
        from softnlp.app.view.notebook import NotebookView

        return NotebookView
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
