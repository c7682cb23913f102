"""The pressures that lead the tip to three points."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp inverse targets.toml",
    drawn="results/targets/figure.png",
    page="how-to/inverse",
)
