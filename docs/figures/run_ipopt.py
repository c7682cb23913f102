"""A loaded robot, solved by IPOPT alone."""

from docs.figures._shared import command

DONE = command("softnlp run scenarios/D25L60_ipopt.toml")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/D25L60_ipopt/figure.png"
