"""How far the sets of constants of each silicone lie apart."""

from __future__ import annotations

from docs.figures._shared import markdown
from softnlp import load_materials
from softnlp.results.materials import STRETCHES, compared_sets

LAWS = ("neo-hookean", "mooney-rivlin", "yeoh")


def text() -> str:
    """Return the stress by the first set over that by the other, at some stretches."""
    rows = [
        [one.silicone, one.law, *(f"{ratio:.2f}" for ratio in one.ratio)]
        for one in compared_sets(load_materials())
        if one.law in LAWS
    ]
    return markdown(["silicone", "law", *(f"stretch {x:g}" for x in STRETCHES)], rows)


if __name__ == "__main__":
    print(text())
