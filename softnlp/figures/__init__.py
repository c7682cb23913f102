"""Figures of runs, cross-sections and silicones; each function returns a matplotlib `Figure`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softnlp.base.lazy import names_of

if TYPE_CHECKING:
    from softnlp.figures.compare import compare_figures as compare_figures
    from softnlp.figures.compare import observable_figure as observable_figure
    from softnlp.figures.compare import tips_figure as tips_figure
    from softnlp.figures.comparison import comparison_figure as comparison_figure
    from softnlp.figures.identify import identified_figure as identified_figure
    from softnlp.figures.identify import tensile_figure as tensile_figure
    from softnlp.figures.material import material_figure as material_figure
    from softnlp.figures.rings import rings_figure as rings_figure
    from softnlp.figures.run import blocked_figure as blocked_figure
    from softnlp.figures.run import run_figure as run_figure
    from softnlp.figures.section import section_figure as section_figure
    from softnlp.figures.sparsity import sparsity_figure as sparsity_figure
    from softnlp.figures.style import save_figure as save_figure
    from softnlp.figures.workspace import dexterity_figure as dexterity_figure
    from softnlp.figures.workspace import workspace_figure as workspace_figure

_HOMES = {
    "softnlp.figures.compare": ("compare_figures", "observable_figure", "tips_figure"),
    "softnlp.figures.comparison": ("comparison_figure",),
    "softnlp.figures.identify": ("identified_figure", "tensile_figure"),
    "softnlp.figures.material": ("material_figure",),
    "softnlp.figures.rings": ("rings_figure",),
    "softnlp.figures.run": ("blocked_figure", "run_figure"),
    "softnlp.figures.section": ("section_figure",),
    "softnlp.figures.sparsity": ("sparsity_figure",),
    "softnlp.figures.style": ("save_figure",),
    "softnlp.figures.workspace": ("dexterity_figure", "workspace_figure"),
}
__all__ = sorted(name for names in _HOMES.values() for name in names)
__getattr__ = names_of(__name__, _HOMES)
