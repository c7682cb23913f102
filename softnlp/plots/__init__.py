"""Figures of runs, cross-sections and silicones; each function returns a matplotlib `Figure`."""

from softnlp.plots.blocked import blocked_figure
from softnlp.plots.compare import compare_figures, observable_figure
from softnlp.plots.compare_tips import tips_figure
from softnlp.plots.comparison import comparison_figure
from softnlp.plots.dexterity import dexterity_figure
from softnlp.plots.identify import identified_figure, tensile_figure
from softnlp.plots.material import material_figure
from softnlp.plots.run import run_figure
from softnlp.plots.section import section_figure
from softnlp.plots.style import save_figure
from softnlp.plots.workspace import workspace_figure

__all__ = [
    "blocked_figure",
    "compare_figures",
    "comparison_figure",
    "dexterity_figure",
    "identified_figure",
    "material_figure",
    "observable_figure",
    "run_figure",
    "save_figure",
    "section_figure",
    "tensile_figure",
    "tips_figure",
    "workspace_figure",
]
