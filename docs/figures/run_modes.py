"""Modes about the last pose of a step of pressure."""

from docs.figures._shared import command
from docs.tools.pages import saved

_done = command("softnlp modes step.toml", files=saved("dynamics"))


def text() -> str:
    """Return what the command prints."""
    return _done.block
