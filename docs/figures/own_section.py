"""The section of the tutorial's robot."""

from __future__ import annotations

from docs.figures._shared import command
from docs.tools.pages import saved


def figure():
    """Return what `softnlp plot section` draws."""
    done = command("softnlp plot section my_robot.toml --out section.png", files=saved("tutorial"))
    return done.folder / "section.png"
