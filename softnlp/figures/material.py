"""Stress and modulus of silicones against stretch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.units import KILOPASCAL
from softnlp.figures.style import GREY, INK, colour, in_own_style, legend, mark, new_figure, plain, user_text
from softnlp.model.materials import Material

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 241
LINE_STYLES = {
    "mooney-rivlin": "-",
    "neo-hookean": "--",
    "yeoh": "-.",
    "ogden": ":",
    "linear": (0, (6, 1.5, 1, 1.5, 1, 1.5)),
}
OWN_LINE_STYLES = ((0, (10, 2)), (0, (1, 4)), (0, (3, 4)))
_COLUMNS, _LINE = 6, 0.25  # of the legends: entries a line, height of a line [inch]
CLIP = 1.25  # panels reach this far beyond the fitted range's values


@in_own_style
def material_figure(materials: Sequence[Material], stretch_range: tuple[float, float] = (1.0, 2.2)) -> Figure:
    """Draw engineering stress, true stress and tangent modulus [kPa] against stretch.

    One colour a silicone, one line style a law. The fitted range that all share is shaded; the panels' heights follow
    the values in the fitted ranges, so that a law that runs away beyond them does not hide the others.

    Raises
    ------
    InputError
        When there is no material or the range is not two increasing stretches above 0.
    """
    low, high = stretch_range
    if not materials:
        raise InputError("expected at least one material to draw")
    if not 0 < low < high or not np.isfinite(high):
        raise InputError(f"expected a range of stretch such as 1.0 to 2.2, got {low:g} to {high:g}")
    stretch = np.linspace(low, high, POINTS)
    names = list(dict.fromkeys(m.name for m in materials))
    styles = line_styles(materials)
    fitted = (max(m.fitted_stretch[0] for m in materials), min(m.fitted_stretch[1] for m in materials))

    lines = -(-len(names) // _COLUMNS) + -(-len(styles) // _COLUMNS)
    bottom = 0.2 + _LINE * lines
    height = 3.75 + bottom
    shaded = "  ·  shaded where the constants were fitted" if fitted[0] < fitted[1] else ""
    figure = new_figure(11.0, height, "Silicones in uniaxial tension", f"incompressible{shaded}")
    quantities = (
        ("engineering stress [kPa]", "engineering_stress"),
        ("true stress [kPa]", "true_stress"),
        ("tangent modulus [kPa]", "tangent_modulus"),
    )
    for k, (label, method) in enumerate(quantities):
        axes = figure.add_axes((0.065 + 0.327 * k, (bottom + 0.5) / height, 0.26, 2.5 / height))
        plain(axes, "stretch [-]", label)
        if fitted[0] < fitted[1]:
            axes.axvspan(*fitted, color="#F0F0F0", zorder=0, label="fitted range")
        inside = []
        for material in materials:
            values = getattr(material, method)(stretch) / KILOPASCAL
            look: dict[str, Any] = {"color": colour(names.index(material.name)), "linestyle": styles[material.law.name]}
            axes.plot(stretch, values, linewidth=1.5, label=f"{material.name}, {material.law.name}", **look)
            within = (stretch >= material.fitted_stretch[0]) & (stretch <= material.fitted_stretch[1])
            inside.append(values[within] if within.any() else values)
        reached = np.concatenate(inside)
        reached = reached[np.isfinite(reached)]
        axes.set_xlim(low, high)
        axes.set_ylim(min(0.0, CLIP * reached.min()), CLIP * reached.max())
        axes.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
    _legends(figure, names, styles, bottom / height)
    return figure


def line_styles(materials: Sequence[Material]) -> dict[str, Any]:
    """Return the line style of each law, in order of appearance; a built-in law has the same in every figure."""
    styles: dict[str, Any] = {}
    for name in dict.fromkeys(m.law.name for m in materials):
        own = sum(law not in LINE_STYLES for law in styles)
        styles[name] = LINE_STYLES.get(name, OWN_LINE_STYLES[own % len(OWN_LINE_STYLES)])
    return styles


def _legends(figure: Figure, names: list[str], laws: dict[str, Any], top: float) -> None:
    colours = [mark(user_text(name), colour(k), line="-", linewidth=3) for k, name in enumerate(names)]
    styles = [mark(user_text(law), INK, line=style) for law, style in laws.items()]
    below = top - _LINE * -(-len(names) // _COLUMNS) / figure.get_figheight()
    for handles, upper in ((colours, top), (styles, below)):
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.045, upper), "ncols": _COLUMNS}
        legend(figure, handles, handlelength=3.2, **place)
