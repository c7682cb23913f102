"""The tutorial's first run."""

from docs.figures._shared import as_shown

text, figure = as_shown(
    "softnlp run my_robot.toml",
    drawn="results/my_robot/figure.png",
    page="tutorial",
)
