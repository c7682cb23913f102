"""Thread rings that do not shrink: what they do to a stretched section, by plane finite elements."""

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
