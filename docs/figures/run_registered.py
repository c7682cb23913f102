"""Constants of the model and the frame of a tracker, in one fit."""

from docs.figures._shared import command

DONE = command("softnlp identify scenarios/identify/tracked_tips.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/tracked_tips/figure.png"
