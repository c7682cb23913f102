"""The robot that bends most and still pushes with 1 N."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp design wanted.toml",
    drawn="results/wanted/figure.png",
    page="how-to/design",
)
