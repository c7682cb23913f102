"""The robot that bends most and still pushes with 1 N."""

from docs.figures._shared import command

DONE = command("softnlp design scenarios/design/D25L60_dimensions.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/D25L60_dimensions/figure.png"
