"""A step of pressure through a lag."""

from docs.figures._shared import as_shown

text, figure = as_shown("softnlp run step.toml", drawn="results/step/figure.png", page="dynamics")
