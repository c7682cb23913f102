"""Every law fitted to a tensile test."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp identify tensile.toml",
    drawn="results/tensile/figure.png",
    page="how-to/identify",
)
