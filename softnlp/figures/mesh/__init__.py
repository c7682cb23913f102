"""Bodies as meshes: triangles for live display, and watertight solids for printing and moulds."""

from softnlp.figures.mesh.display import DisplayMesh, Part, display_mesh
from softnlp.figures.mesh.rings import natural_body, resampled
from softnlp.figures.mesh.solid import (
    FACETS,
    HOLES,
    Solid,
    body_solid,
    cores,
    format_of,
    mould_body,
    require,
    write_solids,
)

__all__ = [
    "FACETS",
    "HOLES",
    "DisplayMesh",
    "Part",
    "Solid",
    "body_solid",
    "cores",
    "display_mesh",
    "format_of",
    "mould_body",
    "natural_body",
    "require",
    "resampled",
    "write_solids",
]
