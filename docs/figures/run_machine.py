"""Two laws from a testing machine's file as it is."""

from docs.figures._shared import command

DONE = command("softnlp identify scenarios/identify/machine_test.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/machine_test/figure.png"
