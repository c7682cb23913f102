"""Figures of runs, cross-sections and silicones; each function returns a matplotlib `Figure`."""

from softnlp.figures.compare import compare_figures, observable_figure, tips_figure
from softnlp.figures.comparison import comparison_figure
from softnlp.figures.identify import identified_figure, tensile_figure
from softnlp.figures.material import material_figure
from softnlp.figures.rings import rings_figure
from softnlp.figures.run import blocked_figure, run_figure
from softnlp.figures.section import section_figure
from softnlp.figures.sparsity import sparsity_figure
from softnlp.figures.style import save_figure
from softnlp.figures.workspace import dexterity_figure, workspace_figure

__all__ = [
    "blocked_figure",
    "compare_figures",
    "comparison_figure",
    "dexterity_figure",
    "identified_figure",
    "material_figure",
    "observable_figure",
    "rings_figure",
    "run_figure",
    "save_figure",
    "section_figure",
    "sparsity_figure",
    "tensile_figure",
    "tips_figure",
    "workspace_figure",
]
