"""Figures of runs, cross-sections and silicones; each function returns a matplotlib `Figure`."""

from softnlp.plots.blocked import blocked_figure
from softnlp.plots.identify import identified_figure, tensile_figure
from softnlp.plots.material import material_figure
from softnlp.plots.run import run_figure
from softnlp.plots.section import section_figure
from softnlp.plots.style import save_figure

__all__ = [
    "blocked_figure",
    "identified_figure",
    "material_figure",
    "run_figure",
    "save_figure",
    "section_figure",
    "tensile_figure",
]
