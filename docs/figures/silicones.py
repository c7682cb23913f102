"""The five laws of Ecoflex 00-50."""

from softnlp import load_materials
from softnlp.figures import material_figure


def figure():
    """Draw stress and modulus against stretch."""
    return material_figure(list(load_materials()["Ecoflex 00-50"].models.values()))
