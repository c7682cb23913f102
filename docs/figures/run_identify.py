"""Coefficients from eight measured angles."""

from docs.figures._shared import command

DONE = command("softnlp identify scenarios/identify/measured_angles.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/measured_angles/figure.png"
