"""Thread rings that do not shrink: what they do to a stretched section, by plane finite elements.

Its names are imported when they are asked for, since few runs need finite elements.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from softnlp.base.lazy import names_of

if TYPE_CHECKING:
    from softnlp.model.energies import PlaneEnergy as PlaneEnergy
    from softnlp.model.energies import energy_of as energy_of
    from softnlp.model.energies import invariant_energy as invariant_energy
    from softnlp.rings.curve import Curve as Curve
    from softnlp.rings.outline import Circle as Circle
    from softnlp.rings.outline import PlaneSection as PlaneSection
    from softnlp.rings.outline import Polygon as Polygon
    from softnlp.rings.outline import RingError as RingError
    from softnlp.rings.outline import of_robot as of_robot
    from softnlp.rings.response import RingResponse as RingResponse
    from softnlp.rings.response import ring_response as ring_response
    from softnlp.rings.response import robot_response as robot_response
    from softnlp.rings.section_values import ALL_CONVENTIONS as ALL_CONVENTIONS
    from softnlp.rings.section_values import ENERGY as ENERGY
    from softnlp.rings.surrogate import RingSurrogate as RingSurrogate
    from softnlp.rings.surrogate import proportions as proportions
    from softnlp.rings.surrogate import ranges as ranges
    from softnlp.rings.surrogate import ring_surrogate as ring_surrogate

_HOMES = {
    "softnlp.model.energies": ("PlaneEnergy", "energy_of", "invariant_energy"),
    "softnlp.rings.curve": ("Curve",),
    "softnlp.rings.outline": ("Circle", "PlaneSection", "Polygon", "RingError", "of_robot"),
    "softnlp.rings.response": ("RingResponse", "ring_response", "robot_response"),
    "softnlp.rings.section_values": ("ALL_CONVENTIONS", "ENERGY"),
    "softnlp.rings.surrogate": ("RingSurrogate", "proportions", "ranges", "ring_surrogate"),
}
__all__ = sorted(name for names in _HOMES.values() for name in names)
__getattr__ = names_of(__name__, _HOMES)
