"""A workspace, measured and drawn."""

from docs.figures._shared import command

DONE = command(
    "softnlp sweep scenarios/workspace/D25L60_grid.toml --out results/grid", "softnlp workspace results/grid"
)


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/grid/workspace.png"
