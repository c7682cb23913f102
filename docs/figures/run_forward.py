"""A robot with two sets under pressure."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp run two_sets.toml",
    drawn="results/two_sets/figure.png",
    page="how-to/forward",
)
