"""The witness's materials, robots and deformed section: numpy and scipy only, none of the package's physics.

Written from Table II and Eqs. (10), (11), (12), (21) to (24), (S1) to (S6) as printed, with tangent moduli
differentiated by hand. SI units and radians.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, floor, pi, radians, sin

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Array = NDArray[np.float64]


class NoRoot(ArithmeticError):
    """The stretch branch from zero pressure ends below this pressure."""


class Unstable(ArithmeticError):
    """E_t, EA, EI, GA or GJ is not positive, with pressure or of the silicone alone."""


@dataclass(frozen=True)
class Body:
    """Undeformed dimensions: D_r, D_i, D_cp, D_c, delta_c, L_0 [m], n1 sets of n2 chambers, alpha_1 [rad]."""

    D_r: float
    D_i: float
    D_cp: float
    D_c: float
    delta_c: float
    L_0: float
    n1: int
    n2: int
    alpha_1: float

    @property
    def chambers(self) -> int:
        """N = n1 n2."""
        return self.n1 * self.n2

    @property
    def angles(self) -> list[float]:
        """Angle of each chamber from +x (S1)."""
        beta = 2 * pi / self.n1 - self.n2 * self.alpha_1
        theta_1 = -self.alpha_1 * (self.n2 - 1) / 2
        return [theta_1 + self.alpha_1 * (n - 1) + beta * floor((n - 1) / self.n2) for n in range(1, self.chambers + 1)]


def _millimetres(dims: tuple[float, ...], L_0: float, n2: int, alpha_deg: float) -> Body:
    return Body(*(x / 1e3 for x in (*dims, L_0)), 3, n2, radians(alpha_deg))


BODIES: dict[str, Body] = {
    f"{name}L{length}": _millimetres(dims, length, 2, deg)
    for name, dims, deg in [
        ("D25", (25, 9, 17, 4.5, 0.5), 50),
        ("D20", (20, 7.2, 13.6, 3.6, 0.5), 50),
        ("D15", (15, 5.4, 10.2, 2.5, 0.5), 56),
        ("D10", (10, 3, 6.5, 1.5, 0.5), 60),
    ]
    for length in (40, 60)
} | {f"laparoscope-{3 * n2}": _millimetres((11.4, 4.7, 8.05, 1.5, 0.4), 45, n2, 40) for n2 in (1, 2, 3)}

# MPa where it is a stress: mu0 | C10, C01, C20 | C10, C20 | mu1, b1, mu2, b2
_PUBLISHED = {
    "Dragon Skin 10": (0.07980, (0.01848, 0.02958, 0.001657), (0.04112, -0.0005151), (1.413, 0.1295, 0.001185, 6.215)),
    "Ecoflex 00-50": (0.03091, (0.00376, 0.01558, 0.001047), (0.01569, -9.767e-5), (-3.88e-5, 7.513, -0.01479, -5.983)),
    "Ecoflex 00-30": (
        0.01971,
        (0.003321, 0.009057, 0.0004978),
        (0.01025, -0.0001674),
        (0.1186, 0.3701, 9.457e-5, 7.951),
    ),
    "Ecoflex 00-20": (0.01361, (0.002731, 0.00553, 0.0003398), (0.006964, -6.619e-5), (0.01257, 1.345, 0.01078, 1.349)),
    "Ecoflex 00-10": (
        0.00964,
        (-0.0009413, 0.007575, 0.0005407),
        (0.004857, -1.539e-5),
        (342.3, 6.518e-5, 6.371e-5, 7.67),
    ),
}
SILICONES = tuple(_PUBLISHED)
LAW_NAMES = ("linear", "neo-hookean", "mooney-rivlin", "yeoh", "ogden")


@dataclass(frozen=True)
class Rubber:
    """A law of Table II: `stress` is sigma_e(lam) [Pa], `modulus` is E_t(lam) [Pa] differentiated by hand."""

    stress: Callable[[float], float]
    modulus: Callable[[float], float]


def linear(E_l: float) -> Rubber:
    return Rubber(lambda lam: E_l * (lam - 1), lambda lam: E_l)


def neo_hookean(mu0: float) -> Rubber:
    # sigma_t = mu0 (lam^2 - 1/lam)
    return Rubber(lambda lam: mu0 * (lam - lam**-2), lambda lam: mu0 * (2 * lam + lam**-2))


def mooney_rivlin(C10: float, C01: float, C20: float) -> Rubber:
    def bracket(lam: float) -> float:
        return C10 + 2 * C20 * (lam**2 + 2 / lam - 3) + C01 / lam

    def modulus(lam: float) -> float:
        # product rule on sigma_t = 2 (lam^2 - 1/lam) bracket
        return 2 * (2 * lam + lam**-2) * bracket(lam) + 2 * (lam**2 - 1 / lam) * (
            2 * C20 * (2 * lam - 2 * lam**-2) - C01 * lam**-2
        )

    return Rubber(lambda lam: 2 * (lam - lam**-2) * bracket(lam), modulus)


def yeoh(C10: float, C20: float) -> Rubber:
    return mooney_rivlin(C10, 0.0, C20)


def ogden(mu1: float, b1: float, mu2: float, b2: float) -> Rubber:
    pairs = ((mu1, b1), (mu2, b2))
    return Rubber(
        lambda lam: sum(mu * (lam ** (b - 1) - lam ** (-b / 2 - 1)) for mu, b in pairs),
        lambda lam: sum(mu * b * (lam ** (b - 1) + 0.5 * lam ** (-b / 2 - 1)) for mu, b in pairs),
    )


LAWS: dict[str, Callable[..., Rubber]] = {
    "linear": linear,
    "neo-hookean": neo_hookean,
    "mooney-rivlin": mooney_rivlin,
    "yeoh": yeoh,
    "ogden": ogden,
}


def published(silicone: str, law: str = "mooney-rivlin") -> Rubber:
    """Return a published silicone; the linear law is the secant of Mooney-Rivlin at stretch 2."""
    mu0, mr, yh, og = _PUBLISHED[silicone]
    curve = mooney_rivlin(*(1e6 * c for c in mr))
    if law == "linear":
        return linear(curve.stress(2.0))
    if law == "neo-hookean":
        return neo_hookean(1e6 * mu0)
    if law == "yeoh":
        return yeoh(*(1e6 * c for c in yh))
    if law == "ogden":
        return ogden(1e6 * og[0], og[1], 1e6 * og[2], og[3])
    return curve


@dataclass(frozen=True)
class Choices:
    """Coefficients and readings; the defaults are the reproduction set."""

    k_e: float = 0.41
    k_b: float = 1.23
    k_a: float = 1.0
    k_i: float = 1.0
    phi: float = 0.0
    opposes: bool = True
    t_f: float = 0.0
    mean_pressure: bool = True


REPRODUCTION = Choices()
CALIBRATED = Choices(k_e=0.427, k_b=2.51, phi=0.369)
AS_PRINTED = Choices(opposes=False, t_f=0.1e-3, mean_pressure=False)


@dataclass(frozen=True)
class Section:
    """The rod's numbers at one pressure: what Eqs. (2) to (13) need and nothing else.

    PA : (N,) P_i A_c [N]. d : (N, 2) chamber centres, deformed [m]. EI : (x, y). A : wall area A_0/lambda [m^2].
    """

    stretch: float
    L: float
    A: float
    E_t: float
    EA: float
    GA: float
    EI: tuple[float, float]
    GJ: float
    PA: Array
    d: Array
    r_co: float
    r_ci: float
    pressures: Array

    @property
    def F_P(self) -> float:
        return float(self.PA.sum())

    @property
    def M_P(self) -> Array:
        """Sum of d_i x P_i A_c e3, body frame."""
        return np.array([self.d[:, 1] @ self.PA, -self.d[:, 0] @ self.PA, 0.0])


def _bore(body: Body, lam: float) -> float:
    r_co, r_ci0 = body.D_c / 2 + body.delta_c, body.D_c / 2
    return float(np.sqrt(r_co**2 - (r_co**2 - r_ci0**2) / lam))  # Eq. (22)


def _pressed_radius(body: Body, lam: float, choices: Choices) -> float:
    r_ci, r_co = _bore(body, lam), body.D_c / 2 + body.delta_c
    return r_ci + choices.phi * (r_co - r_ci)


def _wall_area(body: Body, choices: Choices) -> float:
    r_co = body.D_c / 2 + body.delta_c
    bracket = (body.D_r / 2) ** 2 - (body.D_i / 2) ** 2 - body.chambers * (body.D_c / 2) ** 2
    bracket -= body.chambers * ((r_co + choices.t_f) ** 2 - r_co**2)  # (S6)
    return choices.k_a * pi * bracket


def balance_pressure(body: Body, rubber: Rubber, lam: float, choices: Choices = REPRODUCTION) -> float:
    """Return the sum over chambers of P_i that Eqs. (10), (21), (23) hold in balance at the stretch lam [Pa]."""
    sign = -1.0 if choices.opposes else 1.0
    factor = 1 + sign * choices.k_e * (lam - 1)
    area = pi * _pressed_radius(body, lam, choices) ** 2
    if factor <= 0:
        return float("inf")
    return _wall_area(body, choices) * rubber.stress(lam) / (area * factor)


def solve_stretch(
    body: Body, rubber: Rubber, total: float, choices: Choices = REPRODUCTION, *, top: float = 6.0, scan: float = 1e-3
) -> float:
    """Return the stretch on the branch from zero pressure where the chambers' pressures sum to `total` [Pa].

    The balance gives the pressure as a function of the stretch, so the branch is followed by scanning the stretch
    upwards while that function rises; where it stops rising first, the branch has ended.

    Raises
    ------
    NoRoot
        The branch ends (or leaves the scanned range) below `total`; the message has its last pressure.
    """
    if total == 0:
        return 1.0
    low, p_low = 1.0, 0.0
    while low < top:
        high = low + scan
        p_high = balance_pressure(body, rubber, high, choices)
        if p_high >= total:
            if not np.isfinite(p_high):  # the stiffening factor lost its sign inside this interval
                high = brentq(lambda lam: 1 - choices.k_e * (lam - 1), low, high) - 1e-12
            return float(
                brentq(
                    lambda lam: balance_pressure(body, rubber, lam, choices) - total, low, high, xtol=1e-15, rtol=1e-15
                )
            )
        if p_high <= p_low:
            raise NoRoot(f"the branch ends at a total of {p_low:.6g} Pa, stretch {low:.4f}")
        low, p_low = high, p_high
    raise NoRoot(f"no root below stretch {top}")


def section(body: Body, rubber: Rubber, pressures: Sequence[float] | Array, choices: Choices = REPRODUCTION) -> Section:
    """Return the deformed section at one pressure a set [Pa]."""
    P = np.repeat(np.asarray(pressures, float), body.n2)
    N = body.chambers
    lam = solve_stretch(body, rubber, float(P.sum()), choices)
    shrink = lam**-0.5
    r_r, r_i, r_cp = body.D_r / 2 * shrink, body.D_i / 2 * shrink, body.D_cp / 2 * shrink
    r_co, r_ci, r_p = body.D_c / 2 + body.delta_c, _bore(body, lam), _pressed_radius(body, lam, choices)
    d = np.array([[r_cp * cos(a), r_cp * sin(a)] for a in body.angles])

    A = _wall_area(body, choices) / lam
    inertia = [pi * (r_r**4 - r_i**4) / 4] * 2
    J = pi * (r_r**4 - r_i**4) / 2 - N * pi * (r_ci**4 / 2 + r_ci**2 * r_cp**2)
    stiffening = [0.0, 0.0]
    r_f = r_co + choices.t_f
    for P_i, (x, y) in zip(P, d, strict=True):
        for axis, arm in ((0, y), (1, x)):
            inertia[axis] -= pi * (r_ci**4 / 4 + r_ci**2 * arm**2)
            inertia[axis] -= pi * (r_f**3 * choices.t_f + 2 * r_f * choices.t_f * arm**2)
            P_used = P.sum() / N if choices.mean_pressure else P_i
            stiffening[axis] += P_used * pi * (r_p**4 / 4 + r_p**2 * arm**2)
    J -= N * pi * (2 * r_f**3 * choices.t_f + 2 * r_f * choices.t_f * r_cp**2)

    E_t = rubber.modulus(lam)
    PA = P * pi * r_p**2
    EA = E_t * A + choices.k_e * PA.sum()
    EI = (
        E_t * choices.k_i * inertia[0] + choices.k_b * stiffening[0],
        E_t * choices.k_i * inertia[1] + choices.k_b * stiffening[1],
    )
    if min(E_t, A, J, *inertia, EA, *EI) <= 0:
        raise Unstable(f"E_t = {E_t:.4g} Pa, A = {A:.4g} m^2, J = {J:.4g}, I = {inertia} m^4 at stretch {lam:.4f}")
    G = E_t / 3
    return Section(lam, lam * body.L_0, A, E_t, float(EA), G * A, EI, G * J, PA, d, r_co, r_ci, P)
