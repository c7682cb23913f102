"""What the published angles and forces (Ecoflex 00-50, Mooney-Rivlin) say of the constants; the tables of identify.md.

    python -m benchmarks.identify_measured [alone] [shared] [proposals] [together]

Angles at 1.5 bar, one and two sets, of four robots: constants of each robot, then shared ones, with and without phi and
with terms that the default conventions leave out. Then forces along the curve of eight robots and the angles together,
from the set `calibrated`; with the published elongations too where that is said. "own pressure" reads Eq. (12) with the
pressure of each chamber, as printed. Minutes on one core, most of them for the forces and for hanging robots.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.identify_data import HIGHEST
from benchmarks.measured import ANGLES, CURVE, ELONGATIONS, FORCES
from softnlp.base.units import BAR, DEGREE, MILLIMETRE, STANDARD_GRAVITY
from softnlp.model.conventions import COEFFICIENT_SETS, REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import robot
from softnlp.model.rod import Loads
from softnlp.statics.kept import pose_solver
from softnlp.studies.identified import Identified
from softnlp.studies.identify import identify
from softnlp.studies.measurements import Measurements
from softnlp.studies.predicted import ArcPoses

Array = NDArray[np.float64]

SILICONE = material("Ecoflex 00-50")
CALIBRATED = COEFFICIENT_SETS["calibrated"]
OWN_PRESSURE = replace(REPRODUCTION, name="own pressure in Eq. (12)", mean_pressure=False)
HANGING = Loads(gravity=(0.0, 0.0, STANDARD_GRAVITY))
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
    low, high = ELONGATIONS[name[-3:]]
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
        label=name,
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


def search(
    conventions: Conventions,
    own: Callable[[str, Array], dict[str, float]],
    more: Sequence[tuple[float, float, float]],
    elongation: bool,
) -> tuple[Array, float]:
    """Return k_e, k_b and further unknowns that fit the angles of four robots, and the mean error of the angles [deg].

    own : values of quantities of a robot, by its name and the further unknowns. more : (start, lower, upper) of those.
    """
    from scipy.optimize import least_squares

    rows = [measurements(name, forces=False, elongation=elongation) for name in ANGLES]
    models = [Model(m.robot, SILICONE, CALIBRATED, conventions) for m in rows]
    poses = [
        ArcPoses(pose_solver(model, Numerics()), np.asarray(m.pressure), ())
        for m, model in zip(rows, models, strict=True)
    ]

    def residuals(z: Array) -> Array:
        parts = []
        for m, arcs in zip(rows, poses, strict=True):
            values = {"stiffening.elongation": z[0], "stiffening.bending": z[1], **own(m.label, z[2:])}
            seen = arcs.evaluate(values).values
            parts.append((seen[:2, 3] - m.bending_angle[:2]) / ANGLE_SIGMA)
            parts.append((seen[2:, 4] - m.elongation[2:]) / m.sigma["elongation"])
        return np.concatenate(parts)

    start, low, high = np.array([(0.4, 0.0, 20.0), (2.5, 0.0, 50.0), *more]).T
    done = least_squares(residuals, start, bounds=(low, high), xtol=1e-12, ftol=1e-12)
    width = 3 if elongation else 2
    angles = done.fun.reshape(len(rows), width)[:, :2]
    return np.asarray(done.x), float(np.mean(np.abs(angles)) * ANGLE_SIGMA / DEGREE)


def proposals() -> None:
    """Print what would explain D20L60 and D10L60: a phi of each, one that grows with the wall, the thread elsewhere."""
    names = list(ANGLES)

    def each(name: str, z: Array) -> dict[str, float]:
        return {"corrections.bore_fraction": float(z[names.index(name)])}

    def wall_over_bore(name: str, z: Array) -> dict[str, float]:
        r = robot(name)
        return {"corrections.bore_fraction": min(float(z[0] * r.chamber_wall / r.bore_radius), 1.0)}

    def thread(name: str, z: Array) -> dict[str, float]:
        moved = dict(zip(("D20L60", "D10L60"), z[1:], strict=True)).get(name, 0.0) * MILLIMETRE
        return {"corrections.bore_fraction": float(z[0]), "robot.chamber_wall": robot(name).chamber_wall + moved}

    fraction, factor, place = (0.4, 0.0, 1.0), (0.6, 0.0, 3.0), (0.0, -0.45, 0.45)
    asked = (
        ("phi of each robot", each, [fraction] * 4),
        ("phi = c delta_c / r_ci", wall_over_bore, [factor]),
        ("phi, thread of D20L60 and D10L60 moved [mm]", thread, [fraction, place, place]),
    )
    for label, own, more in asked:
        for conventions in (REPRODUCTION, OWN_PRESSURE):
            for elongation in (False, True):
                x, error = search(conventions, own, more, elongation)
                data = "angles, elongations" if elongation else "angles"
                print(f"  {label}; {conventions.name}; {data}: {np.round(x, 3).tolist()}, {error:.1f} deg", flush=True)


PARTS = ("alone", "shared", "proposals", "together")


def main(parts: Sequence[str] = PARTS) -> None:
    """Print the parts asked for."""
    if "alone" in parts:
        print("angles, each robot alone: k_e, k_b")
        for name in ANGLES:
            result = found(Variant(name, ("k_e", "k_b")), [measurements(name, forces=False, elongation=False)])
            print(f"  {name}: {describe(result)}\n    {told(result)}", flush=True)
    if "proposals" in parts:
        print("what would explain D20L60 and D10L60: k_e, k_b and what is named")
        proposals()
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
    main(sys.argv[1:] or PARTS)
