"""Choices the paper leaves open or misprints, and the semi-empirical coefficients, as named data (model section 7)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

Rings = Callable[[Any, Sequence[float]], tuple[Any, Any]]
"""What thread that keeps its radius does to a robot's section: (robot, stretches) -> lambda T / 2 and a, (n,) each."""

Pressed = Callable[[Any], tuple[Any, Any]]
"""What thread around a robot's body leaves to the pressures: (robot) -> (N,) areas [m^2] and (N, 2) centres [m]."""


@dataclass(frozen=True)
class Conventions:
    """How ambiguous equations are read.

    Attributes
    ----------
    name
        Shown in every result.
    stiffening_opposes_pressure
        Sign of the stiffening force in Eq. (10); the printed sign adds to the pressure.
    fibre_thickness
        t_f of (S3), (S4), (S6) [m].
    mean_pressure
        Eq. (12) with the mean pressure over all chambers, or with each chamber's own.
    rings
        Of the energy section: what the rings of thread do to it; None takes them for absent.
    pressed
        Of the energy section: what the pressures of chambers in a wound body work on.
    """

    name: str
    stiffening_opposes_pressure: bool
    fibre_thickness: float
    mean_pressure: bool
    rings: Rings | None = field(default=None, repr=False, compare=False)
    pressed: Pressed | None = field(default=None, repr=False, compare=False)

    @property
    def energy(self) -> bool:
        """Whether the section is that of one potential, which none of the other readings is about."""
        return self.name == "energy"


REPRODUCTION = Conventions("reproduction", True, 0.0, True)
"""The readings that reproduce the published simulations; the default."""

AS_PRINTED = Conventions("as_printed", False, 0.1e-3, False)
"""The equations as they are printed."""

UNIAXIAL = Conventions("energy", True, 0.0, True)
"""The energy section with its body in uniaxial stress, as if the rings of thread shrank with it."""

CONVENTIONS = {c.name: c for c in (REPRODUCTION, AS_PRINTED)}


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Dimensionless coefficients; each may be a number or a symbol.

    Attributes
    ----------
    elongation
        k_e, axial stiffening, Eqs. (10), (11); a number [1].
    bending
        k_b, bending stiffening, Eq. (12); a number [1].
    area
        k_a, multiplies A_0; a number [1].
    inertia
        k_i, multiplies the material's I; a number [1].
    bore_fraction
        phi in 0..1, how far beyond the bore towards the thread the pressure acts; a number [1].
    chamber_reaction
        k_c of the `compliant` closure of the blocked force; a number [1].
    modulus_factor
        c_m, multiplies the silicone's stress; of the energy section, which takes no other coefficient; a number [1].
    """

    elongation: Any = 0.41
    bending: Any = 1.23
    area: Any = 1.0
    inertia: Any = 1.0
    bore_fraction: Any = 0.0
    chamber_reaction: Any = 1.45
    modulus_factor: Any = 1.0


COEFFICIENT_SETS = {
    "reproduction": Coefficients(),
    "calibrated": Coefficients(elongation=0.427, bending=2.51, bore_fraction=0.369, chamber_reaction=0.943),
}
"""By name: "reproduction" is the default, "calibrated" was fitted to the measured forces and angles together."""
