"""Energy densities of incompressible silicones for a section whose fibres along the axis have a given stretch.

In the plane of the section the gradient F has det F = 1 / lambda, so that T = |F|^2 says all of an isotropic law:
I1 = T + lambda^2, I2 = lambda^2 T + lambda^-2. Mooney-Rivlin is then (C10 + lambda^2 C01) T and a constant: at one
stretch everywhere, the plane deformation is the same for each ratio of its constants, and only its energy is not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.materials import Material

Array = NDArray[np.float64]

ENERGIES = ("neo-hookean", "mooney-rivlin", "yeoh", "ogden")
"""Laws whose first column of Table II is an energy of principal stretches; any other is known in uniaxial tension."""

_GAUSS = [((1 + x) / 2, weight / 2) for x, weight in zip(*np.polynomial.legendre.leggauss(12), strict=True)]
_BESIDE = 1e-6  # laws of principal stretches are taken so far from equal ones, where their derivatives are 0/0


@dataclass(frozen=True, eq=False)
class PlaneEnergy:
    """An energy density by T and lambda.

    Attributes
    ----------
    density
        density(T, stretch) -> energy of a unit of volume [Pa], of operators and casadi functions only; 0 at rest.
    """

    density: Callable[[Any, Any], Any]
    _mapped: dict[int, Any] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _derivatives(self) -> Any:
        T, stretch = ca.SX.sym("T"), ca.SX.sym("stretch")
        w = ca.SX(self.density(T, stretch))
        first = ca.jacobian(w, ca.vertcat(T, stretch))
        second = ca.jacobian(first, ca.vertcat(T, stretch))
        return ca.Function("w", [T, stretch], [w, *ca.horzsplit(first), second[0, 0], second[0, 1], second[1, 1]])

    def derivatives(self, T: Array, stretch: Array) -> list[Array]:
        """Return w, w_T, w_l, w_TT, w_Tl, w_ll at points, each of the shape of T [Pa]."""
        if T.size not in self._mapped:
            self._mapped[T.size] = self._derivatives.map(T.size)
        rows = self._mapped[T.size](T.reshape(1, -1), np.broadcast_to(stretch, T.shape).reshape(1, -1))
        return [row.full().reshape(T.shape) for row in rows]

    def uniaxial(self, stretch: Array) -> Array:
        """Return the energy densities in uniaxial stress [Pa]."""
        return self.derivatives(2 / stretch, stretch)[0]


def invariant_energy(W: Callable[[Any, Any], Any]) -> PlaneEnergy:
    """Return the energy of a law W(I1, I2) [Pa]."""
    return PlaneEnergy(lambda T, stretch: W(T + stretch**2, stretch**2 * T + stretch**-2))


def mooney_rivlin(C10: Any, C01: Any, C20: Any = 0.0) -> PlaneEnergy:
    """Return C10 (I1 - 3) + C01 (I2 - 3) + C20 (I1 - 3)^2; constants [Pa]."""
    return invariant_energy(lambda I1, I2: C10 * (I1 - 3) + C01 * (I2 - 3) + C20 * (I1 - 3) ** 2)


def ogden(*terms: tuple[Any, Any]) -> PlaneEnergy:
    """Return the sum of mu / b (l1^b + l2^b + lambda^b - 3) over (mu, b); mu [Pa].

    With l1 l2 = 1 / lambda and l1^2 + l2^2 = T, l1^b + l2^b = 2 lambda^(-b/2) cosh(b/2 arcosh(lambda T / 2)).
    """

    def density(T: Any, stretch: Any) -> Any:
        total = 0
        for mu, b in terms:
            n = b / 2
            beside = T * stretch / 2 - 1 - _BESIDE
            below = ca.fmin(beside, 0)  # a guess may hold the volume badly; the function goes on by its series
            plane = ca.cosh(n * ca.acosh(1 + _BESIDE + ca.fmax(beside, 0))) + n**2 * below
            plane += n**2 * (n**2 - 1) / 6 * below**2
            total += mu / b * (2 * stretch**-n * plane + stretch**b - 3)
        return total

    return PlaneEnergy(density)


def uniaxial_energy(stress: Callable[[Any], Any], stretch: Any) -> Any:
    """Return the energy of a law known in uniaxial tension: its stress integrated from stretch 1, by Gauss's rule.

    stress : stress(stretch) -> engineering stress [Pa].
    """
    return (stretch - 1) * sum(weight * stress(1 + at * (stretch - 1)) for at, weight in _GAUSS)


def from_uniaxial(stress: Callable[[Any], Any], modulus: Any) -> PlaneEnergy:
    """Return the energy of a law known in uniaxial tension only: that of the uniaxial stretch with the same I1.

    stress : stress(stretch) -> engineering stress [Pa]. modulus : its slope at stretch 1 [Pa].
    """

    def density(T: Any, stretch: Any) -> Any:
        I1 = T + stretch**2
        above = ca.fmax(I1, 3 + _BESIDE)
        # The root of s^2 + 2 / s = I1 above 1.
        equivalent = 2 * ca.sqrt(above / 3) * ca.cos(ca.acos(-((3 / above) ** 1.5)) / 3)
        return uniaxial_energy(stress, equivalent) + modulus / 6 * ca.fmin(I1 - 3 - _BESIDE, 0)

    return PlaneEnergy(density)


def energy_of(material: Material) -> PlaneEnergy:
    """Return the energy of a silicone, whose constants may be symbols.

    That of Table II for neo-Hookean, Mooney-Rivlin, Yeoh and Ogden, `from_uniaxial` for every other law.
    """
    c, law = material.constants, material.law.name
    if law == "mooney-rivlin":
        return mooney_rivlin(c["C10"], c["C01"], c["C20"])
    if law == "yeoh":
        return mooney_rivlin(c["C10"], 0.0, c["C20"])
    if law == "neo-hookean":
        return mooney_rivlin(c["mu0"] / 2, 0.0)
    if law == "ogden":
        return ogden((c["mu1"], c["b1"]), (c["mu2"], c["b2"]))
    return from_uniaxial(material.engineering_stress, material.tangent_modulus(1.0))


def fibre_energy(material: Material) -> Callable[[Any, Any], Any]:
    """Return energy(T, stretch) of a fibre of the body [Pa]; not for stretch 1 itself, where it may be 0/0.

    For the laws of Table II that are energies, theirs. A law known in uniaxial tension only is integrated along that
    path, tension or compression, and multiplied by what rings add to the energy of a neo-Hookean body.
    """
    if material.law.name in ENERGIES:
        return energy_of(material).density

    def energy(T: Any, stretch: Any) -> Any:
        own = uniaxial_energy(material.engineering_stress, stretch)
        return own * (T + stretch**2 - 3) / (2 / stretch + stretch**2 - 3)

    return energy


def shear_modulus(material: Material, stretch: Any) -> Any:
    """Return 2 (W1 + W2 / lambda) of a uniaxial stretch, which is sigma_e / (lambda - lambda^-2) of each law [Pa].

    Written with the mean slope of the stress between 1 and the stretch, so that there is no 0/0 at 1.
    """
    at, constants = ca.SX.sym("at"), [ca.SX.sym("c") for _ in material.constants]
    slope = ca.jacobian(material.law.functions.engineering_stress(at, *constants), at)
    of = ca.Function("slope", [at, *constants], [slope])
    given = list(material.constants.values())
    mean = sum(weight * of(1 + place * (stretch - 1), *given) for place, weight in _GAUSS)
    return mean * stretch**2 / (stretch**2 + stretch + 1)
