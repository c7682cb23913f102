"""What the published angles and forces (Ecoflex 00-50, Mooney-Rivlin) say of the constants; the tables of identify.md.

    python -m benchmarks.identify_measured

Angles at 1.5 bar, one and two sets, of four robots: constants of each robot, then shared ones, with and without phi and
with terms that the default conventions leave out. Then forces along the curve of eight robots and the angles together,
from the set `calibrated`. Minutes on one core, most of them for the forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.identify_data import ANGLES, CURVE, FORCES, HIGHEST
from softnlp.conventions import COEFFICIENT_SETS, REPRODUCTION, Coefficients, Conventions
from softnlp.materials import material
from softnlp.robot import robot
from softnlp.rod import Loads
from softnlp.studies.identify import Identified, identify
from softnlp.studies.measurements import Measurements
from softnlp.units import BAR, DEGREE, STANDARD_GRAVITY

SILICONE = material("Ecoflex 00-50")
CALIBRATED = COEFFICIENT_SETS["calibrated"]
OWN_PRESSURE = replace(REPRODUCTION, name="own pressure in Eq. (12)", mean_pressure=False)
HANGING = Loads(gravity=(0.0, 0.0, STANDARD_GRAVITY))
ANGLE_SIGMA, FORCE_SIGMA = 30 * DEGREE, 0.09  # what `calibrated` leaves of each


def angles(name: str) -> Measurements:
    """Return the two measured angles of a robot, with equal weight."""
    P = BAR * HIGHEST * np.array([[1, 0, 0], [1, 1, 0]])
    measured = np.array(ANGLES[name]) * DEGREE
    return Measurements(robot(name), P, bending_angle=measured, sigma={"bending_angle": ANGLE_SIGMA})


def both(name: str) -> Measurements:
    """Return the forces of a robot along the curve and its angles, where there are any."""
    has_angles = name in ANGLES
    P = BAR * np.array([[p, 0, 0] for p in CURVE] + ([[HIGHEST, HIGHEST, 0]] if has_angles else []))
    force = np.full(len(P), np.nan)
    force[: len(CURVE)] = FORCES[name] * np.array(CURVE) / HIGHEST
    angle = np.full(len(P), np.nan)
    if has_angles:
        angle[len(CURVE) - 1 :] = np.array(ANGLES[name]) * DEGREE
    sigma = {"blocked_force": FORCE_SIGMA * force, "bending_angle": ANGLE_SIGMA}
    return Measurements(robot(name), P, bending_angle=angle, blocked_force=force, sigma=sigma)


@dataclass(frozen=True)
class Variant:
    """One way to read the data."""

    label: str
    free: tuple[str, ...]
    conventions: Conventions = REPRODUCTION
    loads: Loads = Loads()


SHARED = (
    Variant("k_e, k_b", ("k_e", "k_b")),
    Variant("with phi", ("k_e", "k_b", "phi")),
    Variant("with phi, own pressure in Eq. (12)", ("k_e", "k_b", "phi"), OWN_PRESSURE),
    Variant("with phi, hanging", ("k_e", "k_b", "phi"), loads=HANGING),
    Variant("with phi, own pressure, hanging", ("k_e", "k_b", "phi"), OWN_PRESSURE, HANGING),
    Variant("with phi, C10, C01", ("k_e", "k_b", "phi", "C10", "C01")),
)
TOGETHER = (
    Variant("k_e, k_b, phi, k_c", ("k_e", "k_b", "phi", "k_c")),
    Variant("the same, own pressure in Eq. (12)", ("k_e", "k_b", "phi", "k_c"), OWN_PRESSURE),
    Variant("with C10, C01", ("k_e", "k_b", "phi", "k_c", "C10", "C01")),
    Variant("with C10, C01, own pressure", ("k_e", "k_b", "phi", "k_c", "C10", "C01"), OWN_PRESSURE),
)
POSITIVE = {"C10": (0.0, 1e5), "C01": (0.0, 1e5)}  # [Pa]: so that the law stays stable


def found(variant: Variant, measurements: Sequence[Measurements]) -> Identified:
    """Identify one variant, from `calibrated`, or from `reproduction` where phi stays 0."""
    bounds = {name: limits for name, limits in POSITIVE.items() if name in variant.free}
    return identify(
        measurements,
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


def main() -> None:
    """Print everything."""
    print("angles, each robot alone: k_e, k_b")
    for name in ANGLES:
        result = found(Variant(name, ("k_e", "k_b")), [angles(name)])
        print(f"  {name}: {describe(result)}; {shown_angles(result)}; mean error {mean_angle_error(result):.1f} deg")
    print("angles, shared by four robots")
    every = [angles(name) for name in ANGLES]
    for variant in SHARED:
        result = found(variant, every)
        print(f"  {variant.label}: {describe(result)}; mean error {mean_angle_error(result):.1f} deg", flush=True)
        print(f"    {shown_angles(result)}; strongest correlation {strongest(result)}")
    print("forces along the curve and angles, from `calibrated`")
    rows = [both(name) for name in FORCES]
    for variant in TOGETHER:
        result = found(variant, rows)
        force = result.errors()["blocked_force"]
        if variant is TOGETHER[0]:
            before = result.errors(False)["blocked_force"].mape
            print(f"  calibrated: forces {before:.1f} %, angles {mean_angle_error(result, False):.1f} deg")
        print(f"  {variant.label}: {describe(result)}", flush=True)
        print(
            f"    forces {force.mape:.1f} %, angles {mean_angle_error(result):.1f} deg; {shown_angles(result)}; "
            f"strongest correlation {strongest(result)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
