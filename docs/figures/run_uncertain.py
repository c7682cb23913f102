"""A ramp of pressure with standard deviations."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp run scenarios/D25L60_uncertain.toml",
    drawn="results/D25L60_uncertain/figure.png",
)
