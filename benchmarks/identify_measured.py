"""What the published angles and forces (Ecoflex 00-50, Mooney-Rivlin) say of the constants; the tables of identify.md.

    python -m benchmarks.identify_measured [alone] [shared] [together]

Angles at 1.5 bar, one and two sets, of four robots: constants of each robot, then shared ones, with and without phi and
with terms that the default conventions leave out. Then forces along the curve of eight robots and the angles together,
from the set `calibrated`; with the published elongations too where that is said. "own pressure" reads Eq. (12) with the
pressure of each chamber, as printed. Minutes on one core, most of them for the forces and for hanging robots.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.identify_data import ANGLES, CURVE, FORCES, HIGHEST
from softnlp.conventions import COEFFICIENT_SETS, REPRODUCTION, Coefficients, Conventions
from softnlp.materials import material
from softnlp.robot import robot
from softnlp.rod import Loads
from softnlp.studies.identified import Identified
from softnlp.studies.identify import identify
from softnlp.studies.measurements import Measurements
from softnlp.units import BAR, DEGREE, MILLIMETRE, STANDARD_GRAVITY

SILICONE = material("Ecoflex 00-50")
CALIBRATED = COEFFICIENT_SETS["calibrated"]
OWN_PRESSURE = replace(REPRODUCTION, name="own pressure in Eq. (12)", mean_pressure=False)
HANGING = Loads(gravity=(0.0, 0.0, STANDARD_GRAVITY))
ELONGATION: Mapping[str, tuple[float, float]] = {"L60": (35.03, 42.31), "L40": (22.70, 25.11)}  # [mm] at 1.5 bar
ANGLE_SIGMA, FORCE_SIGMA = 30 * DEGREE, 0.09  # what `calibrated` leaves of each


def measurements(name: str, *, forces: bool, elongation: bool) -> Measurements:
    """Return what was measured of a robot: its angles, if any, and if asked forces along the curve and elongation.

    The elongation with three sets is published as the range over the robots of one length; each gets its middle, with
    half of its width as standard deviation.
    """
    rows: list[tuple[list[float], float, float, float]] = []  # pressures, angle, force, elongation
    one, two = ANGLES.get(name, (np.nan, np.nan))
    if forces:
        rows += [([p, 0, 0], one if p == HIGHEST else np.nan, FORCES[name] * p / HIGHEST, np.nan) for p in CURVE]
    elif name in ANGLES:
        rows.append(([HIGHEST, 0, 0], one, np.nan, np.nan))
    if name in ANGLES:
        rows.append(([HIGHEST, HIGHEST, 0], two, np.nan, np.nan))
    low, high = ELONGATION[name[-3:]]
    if elongation:
        rows.append(([HIGHEST] * 3, np.nan, np.nan, (low + high) / 2))
    P, angle, force, length = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
    sigma = {
        "bending_angle": ANGLE_SIGMA,
        "blocked_force": FORCE_SIGMA * force,
        "elongation": (high - low) / 2 * MILLIMETRE,
    }
    return Measurements(
        robot(name),
        P * BAR,
        bending_angle=angle * DEGREE,
        blocked_force=force,
        elongation=length * MILLIMETRE,
        sigma=sigma,
    )


@dataclass(frozen=True)
class Variant:
    """One way to read the data."""

    label: str
    free: tuple[str, ...]
    conventions: Conventions = REPRODUCTION
    loads: Loads = Loads()
    elongation: bool = False


STIFFENING, ALL = ("k_e", "k_b", "phi"), ("k_e", "k_b", "phi", "k_c")
SHARED = (
    Variant("k_e, k_b", ("k_e", "k_b")),
    Variant("with phi", STIFFENING),
    Variant("with phi, own pressure", STIFFENING, OWN_PRESSURE),
    Variant("with phi, hanging", STIFFENING, loads=HANGING),
    Variant("with phi, own pressure, hanging", STIFFENING, OWN_PRESSURE, HANGING),
    Variant("with phi, elongations", STIFFENING, elongation=True),
    Variant("with phi, elongations, own pressure", STIFFENING, OWN_PRESSURE, elongation=True),
    Variant("with phi, elongations, own pressure, hanging", STIFFENING, OWN_PRESSURE, HANGING, True),
)
TOGETHER = (
    Variant("k_e, k_b, phi, k_c", ALL),
    Variant("own pressure", ALL, OWN_PRESSURE),
    Variant("with C10, C01", (*ALL, "C10", "C01")),
    Variant("elongations", ALL, elongation=True),
    Variant("elongations, own pressure", ALL, OWN_PRESSURE, elongation=True),
)
POSITIVE = {"C10": (0.0, 1e5), "C01": (0.0, 1e5)}  # [Pa]: so that the law stays stable


def found(variant: Variant, data: Sequence[Measurements]) -> Identified:
    """Identify one variant, from `calibrated`, or from `reproduction` where phi stays 0."""
    bounds = {name: limits for name, limits in POSITIVE.items() if name in variant.free}
    return identify(
        data,
        SILICONE,
        variant.free,
        coefficients=CALIBRATED if "phi" in variant.free else Coefficients(),
        bounds=bounds,
        conventions=variant.conventions,
        loads=variant.loads,
    )


def mean_angle_error(result: Identified, after: bool = True) -> float:
    """Return the mean absolute error of the angles [deg]."""
    values = result.after if after else result.before
    errors = np.concatenate([(v - d.values)[:, 3] for v, d in zip(values, result.data, strict=True)])
    return float(np.nanmean(np.abs(errors)) / DEGREE)


def describe(result: Identified) -> str:
    """Return the constants with their standard errors."""
    parts = []
    for k, name in enumerate(result.free.names):
        error = result.uncertainty.standard_errors[k]
        how = "bound" if name in result.at_bound else f"+- {error:.2g}" if np.isfinite(error) else "no error"
        parts.append(f"{name} = {result.constants[k]:.4g} ({how})")
    return ", ".join(parts)


def shown_angles(result: Identified) -> str:
    """Return the modelled angles, robot by robot [deg]."""
    pieces = []
    for d, v in zip(result.data, result.after, strict=True):
        values = v[:, 3][np.isfinite(d.values[:, 3])] / DEGREE
        if values.size:
            pieces.append(f"{d.label} {' / '.join(f'{a:.1f}' for a in values)}")
    return ", ".join(pieces)


def strongest(result: Identified) -> str:
    """Return the pair of constants that the data tell apart least."""
    C, names = np.abs(np.tril(result.uncertainty.correlation, -1)), result.free.names
    if not np.any(np.isfinite(C) & (C > 0)):
        return "-"
    i, j = np.unravel_index(np.nanargmax(C), C.shape)
    return f"{names[j]}, {names[i]}: {result.uncertainty.correlation[i, j]:.3f}"


def told(result: Identified) -> str:
    """Return the errors that are left, and what the model gives."""
    left = result.errors()
    parts = [f"angles {mean_angle_error(result):.1f} deg"]
    if "blocked_force" in left:
        parts.insert(0, f"forces {left['blocked_force'].mape:.1f} %")
    if "elongation" in left:
        values = np.concatenate(
            [v[:, 4][np.isfinite(d.values[:, 4])] for v, d in zip(result.after, result.data, strict=True)]
        )
        parts.append(f"elongations {np.min(values) / MILLIMETRE:.1f} to {np.max(values) / MILLIMETRE:.1f} mm")
    return f"{', '.join(parts)}; {shown_angles(result)}; strongest correlation {strongest(result)}"


def main(parts: Sequence[str] = ("alone", "shared", "together")) -> None:
    """Print the parts asked for."""
    if "alone" in parts:
        print("angles, each robot alone: k_e, k_b")
        for name in ANGLES:
            result = found(Variant(name, ("k_e", "k_b")), [measurements(name, forces=False, elongation=False)])
            print(f"  {name}: {describe(result)}\n    {told(result)}", flush=True)
    groups = {"shared": (SHARED, tuple(ANGLES)), "together": (TOGETHER, tuple(FORCES))}
    for part, (variants, names) in groups.items():
        if part not in parts:
            continue
        print(
            "angles, shared by four robots" if part == "shared" else "forces along the curve and angles, eight robots"
        )
        for variant in variants:
            rows = [measurements(n, forces=part == "together", elongation=variant.elongation) for n in names]
            result = found(variant, rows)
            if variant is TOGETHER[0]:
                before = result.errors(False)["blocked_force"].mape
                print(f"  `calibrated`: forces {before:.1f} %, angles {mean_angle_error(result, False):.1f} deg")
            print(f"  {variant.label}: {describe(result)}\n    {told(result)}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ("alone", "shared", "together"))
