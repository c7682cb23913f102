"""Analytic elastica: an inextensible, unshearable cantilever under a dead force across its undeformed axis."""

from __future__ import annotations

from math import asin, pi, sin, sqrt

from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc


def cantilever(load: float) -> tuple[float, float, float]:
    """Return (x/L, z/L, tip slope) of a cantilever of length L along z pushed by `load` = F L^2 / EI > 0 along +x.

    With tip slope psi, k^2 = (1 + sin psi) / 2 and sin phi = 1 / (k sqrt 2), the load is (K(k) - F(phi, k))^2.
    """

    def modulus_and_amplitude(psi: float) -> tuple[float, float]:
        m = (1 + sin(psi)) / 2  # scipy's parameter m = k^2
        return m, asin(min(1.0, 1 / sqrt(2 * m)))

    def root_load(psi: float) -> float:
        m, phi = modulus_and_amplitude(psi)
        return float(ellipk(m) - ellipkinc(phi, m))

    psi = brentq(lambda a: root_load(a) - sqrt(load), 0.0, pi / 2 - 1e-9, xtol=1e-15)
    m, phi = modulus_and_amplitude(psi)
    alpha = sqrt(load)
    x = 1 - 2 * float(ellipe(m) - ellipeinc(phi, m)) / alpha
    z = sqrt(2 * sin(psi)) / alpha
    return x, z, float(psi)
