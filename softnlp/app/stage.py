"""What panels and tabs of one page share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from softnlp.app.session import Session
    from softnlp.app.view import RobotView


@dataclass(frozen=True, eq=False)
class Stage:
    """One browser tab: its scenario and its 3-D view."""

    session: Session
    view: RobotView
