"""A robot that carries a weight, and its own."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp run loaded.toml",
    drawn="results/loaded/figure.png",
    page="how-to/loaded",
)
