"""Every law fitted to a tensile test."""

from docs.figures._shared import command

DONE = command("softnlp identify scenarios/identify/tensile.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/tensile/figure.png"
