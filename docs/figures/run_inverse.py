"""The pressures that lead the tip around a circle."""

from docs.figures._shared import command

DONE = command("softnlp inverse scenarios/inverse/circle.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/circle/figure.png"
