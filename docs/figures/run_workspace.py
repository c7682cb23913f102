"""A workspace, solved, measured and drawn."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp sweep grid.toml",
    "softnlp workspace results/grid",
    drawn="results/grid/workspace.png",
    page="how-to/workspace",
)
