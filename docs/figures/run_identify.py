"""Coefficients from eight measured angles."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp identify angles.toml",
    drawn="results/angles/figure.png",
    page="how-to/identify",
)
