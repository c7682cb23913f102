"""Figures of runs, cross-sections and silicones; each function returns a matplotlib `Figure`."""

from softnlp.figures.blocked import blocked_figure
from softnlp.figures.compare import compare_figures, observable_figure
from softnlp.figures.compare_tips import tips_figure
from softnlp.figures.comparison import comparison_figure
from softnlp.figures.dexterity import dexterity_figure
from softnlp.figures.identify import identified_figure, tensile_figure
from softnlp.figures.material import material_figure
from softnlp.figures.run import run_figure
from softnlp.figures.section import section_figure
from softnlp.figures.sparsity import sparsity_figure
from softnlp.figures.style import save_figure
from softnlp.figures.workspace import workspace_figure

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
    "sparsity_figure",
    "tensile_figure",
    "tips_figure",
    "workspace_figure",
]
