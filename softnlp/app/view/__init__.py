"""The 3-D view of a robot in the browser.

`Frame` and `frame_of` need no browser library; `RobotView` needs the extra `gui` and is imported when it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softnlp.app.view.frame import Arrow, Frame, Tube, frame_of

if TYPE_CHECKING:
    from softnlp.app.view.robot_view import RobotView

__all__ = ["Arrow", "Frame", "RobotView", "Tube", "frame_of"]


def __getattr__(name: str) -> Any:
    if name != "RobotView":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from softnlp.app.view.robot_view import RobotView

    return RobotView
