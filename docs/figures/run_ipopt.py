"""A loaded robot, solved by IPOPT alone."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp run scenarios/D25L60_ipopt.toml",
    drawn="results/D25L60_ipopt/figure.png",
)
