"""The force of a blocked tip."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp run blocked.toml",
    drawn="results/blocked/figure.png",
    page="how-to/blocked-force",
)
