"""The force of a blocked tip."""

from docs.figures._shared import command

DONE = command("softnlp run scenarios/blocked/D25L60.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/D25L60/figure.png"
