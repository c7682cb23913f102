"""Each settled choice of the model against the alternative, on the five published laparoscope angles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import casadi as ca
import numpy as np
from scipy.optimize import brentq, least_squares

from docs.figures._shared import PUBLISHED, Simulated, markdown
from softnlp import BAR, DEGREE, REPRODUCTION, Coefficients, Conventions, Material, material, robot
from softnlp.model.round_chambers import deform

LAPAROSCOPE = robot("laparoscope-6")


@dataclass(frozen=True)
class Reading:
    """One way to read the equations. area(section) -> the pressure's area, where it is not that of the section."""

    words: str
    conventions: Conventions = REPRODUCTION
    modulus: Callable[..., object] | None = None
    undeformed_bore: bool = False


def _engineering_slope(stretch, **constants):
    """Return d sigma_e / d lambda of the Mooney-Rivlin law [Pa]."""
    law = material("Ecoflex 00-50").law
    x = ca.SX.sym("x")
    symbols = {name: ca.SX.sym(name) for name in constants}
    slope = ca.jacobian(law.formula(x, **symbols), x)
    return ca.Function("slope", [x, *symbols.values()], [slope])(stretch, *constants.values())


READINGS = (
    Reading("as settled"),
    Reading(
        "stiffening force adds to the pressure in Eq. (10)", replace(REPRODUCTION, stiffening_opposes_pressure=False)
    ),
    Reading("each chamber's own pressure in Eq. (12)", replace(REPRODUCTION, mean_pressure=False)),
    Reading("fibre thickness of 0.1 mm in (S3), (S4), (S6)", replace(REPRODUCTION, fibre_thickness=0.1e-3)),
    Reading("E_t = d sigma_e / d lambda in Eq. (24)", modulus=_engineering_slope),
    Reading("pressure acts on the undeformed bore", undeformed_bore=True),
)


@cache
def section_function(case: Simulated, reading: Reading) -> ca.Function:
    """Return (stretch, k_e, k_b) -> axial imbalance, pressure moment (2), bending stiffness (2) of a case."""
    silicone = material(case.silicone)
    if reading.modulus is not None:
        silicone = Material(silicone.name, replace(silicone.law, modulus=reading.modulus), silicone.constants)
    stretch, k_e, k_b = (ca.SX.sym(name) for name in ("stretch", "k_e", "k_b"))
    r_co, r_0 = LAPAROSCOPE.chamber_radius, LAPAROSCOPE.bore_radius
    r_ci = ca.sqrt(r_co**2 - (r_co**2 - r_0**2) / stretch)
    phi = (r_0 - r_ci) / (r_co - r_ci) if reading.undeformed_bore else 0.0
    coefficients = Coefficients(elongation=k_e, bending=k_b, bore_fraction=phi)
    found = deform(LAPAROSCOPE, silicone, [case.pressure * BAR, 0.0, 0.0], stretch, coefficients, reading.conventions)
    balance = found.imbalance
    return ca.Function(
        "section", [stretch, k_e, k_b], [ca.vertcat(balance, *found.pressure_moment, *found.bending_stiffness)]
    )


def angle(case: Simulated, reading: Reading, elongation: float, bending: float) -> float:
    """Return the bending angle [deg] of one set at the case's pressure; NaN where the stretch has no root."""
    function = section_function(case, reading)
    stretches = np.linspace(1.0, 2.5, 61)
    above = np.flatnonzero(np.asarray(function(stretches[None, :], elongation, bending))[0] > 0)
    if not above.size:
        return float("nan")
    low, high = stretches[above[0] - 1], stretches[above[0]]
    stretch = brentq(lambda x: float(function(x, elongation, bending)[0]), low, high, xtol=1e-13)
    _, M_x, M_y, EI_x, EI_y = np.asarray(function(stretch, elongation, bending)).ravel()
    return float(np.hypot(M_x / EI_x, M_y / EI_y)) * stretch * LAPAROSCOPE.length / DEGREE


def errors(reading: Reading, elongation: float, bending: float) -> list[float]:
    """Return simulated less published angle of each case [deg]."""
    return [angle(case, reading, elongation, bending) - case.angle for case in PUBLISHED]


def fitted(reading: Reading) -> tuple[float, float, float]:
    """Return k_e and k_b that suit the reading best, and the largest error that is left [deg]."""
    start = (0.41, 1.23)
    if not np.all(np.isfinite(errors(reading, *start))):
        start = (0.05, 1.23)
    found = least_squares(
        lambda k: np.nan_to_num(errors(reading, *k), nan=1e3), start, bounds=([0, 0], [5, 20]), diff_step=1e-4
    )
    return float(found.x[0]), float(found.x[1]), float(np.abs(found.fun).max())


def text() -> str:
    """Return the readings with their largest error, as they are and with coefficients of their own."""
    rows = []
    for reading in READINGS:
        worst = float(np.max(np.abs(errors(reading, 0.41, 1.23))))
        k_e, k_b, left = fitted(reading)
        shown = f"{worst:.2f}" if np.isfinite(worst) else "no root"
        rows.append([reading.words, shown, f"{left:.2f}", f"{k_e:.2f}, {k_b:.2f}"])
    header = ["reading", "largest error [deg]", "left with k_e, k_b fitted to it [deg]", "those k_e, k_b"]
    return markdown(header, rows)


if __name__ == "__main__":
    print(text())
