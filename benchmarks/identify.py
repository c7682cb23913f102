"""Identification: exact derivatives against a derivative-free search, and whether two-sigma intervals hold.

    python -m benchmarks.identify [DRAWS]

The same data and start for both: angle, elongation and tip of D25L60 at 9 pressures, k_e, k_b and phi free. The search
is scipy's Nelder-Mead around the forward solves of the rod, and once more around the closed-form poses that `identify`
uses, so that the ratio is not one of forward models alone. Each is compiled once, within its time. Then DRAWS (100)
draws with 1 % noise.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import BAR
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import robot
from softnlp.model.rod import Loads
from softnlp.statics.kept import pose_solver
from softnlp.studies.forward import forward
from softnlp.studies.identify import identify
from softnlp.studies.measurements import Measurements
from softnlp.studies.predicted import ArcPoses

Array = NDArray[np.float64]

ROBOT, SILICONE = robot("D25L60"), material("Ecoflex 00-50")
TRUE = Coefficients(elongation=0.6, bending=2.0, bore_fraction=0.2)
FREE = ("k_e", "k_b", "phi")
QUANTITIES = ("stiffening.elongation", "stiffening.bending", "corrections.bore_fraction")
CONSTANTS = np.array([0.6, 2.0, 0.2])
START = np.array([0.41, 1.23, 0.0])
P = BAR * np.array([[p * a, p * b, p * c] for a, b, c in ((1, 0, 0), (1, 1, 0), (1, 1, 1)) for p in (0.4, 0.8, 1.2)])
NOISE = 0.01


def seen(coefficients: Coefficients) -> Array:
    """Return tip, bending angle and elongation of every pose by forward solves, (rows, 5)."""
    poses = [s.pose for s in forward(ROBOT, SILICONE, P, coefficients=coefficients).steps]
    return np.array([[*p.tip_position, p.bending_angle, p.backbone_length - ROBOT.length] for p in poses if p])


def measured(values: Array) -> Measurements:
    """Return values as measurements."""
    angle = np.abs(values[:, 3])  # noise may turn the sign of a straight pose's
    return Measurements(ROBOT, P, tip_position=values[:, :3], bending_angle=angle, elongation=values[:, 4])


@dataclass(frozen=True)
class Timed:
    """How long a search took, how often it solved all poses, and how far it ended from the true constants."""

    seconds: float
    evaluations: int
    error: float


def by_derivatives(values: Array) -> Timed:
    """Identify with exact derivatives."""
    began = time.perf_counter()
    found = identify(measured(values), SILICONE, FREE)
    return Timed(time.perf_counter() - began, found.evaluations, float(np.max(np.abs(found.constants - CONSTANTS))))


def by_search(values: Array, make: Callable[[], Callable[[Array], Array]]) -> Timed:
    """Minimise the same sum of squares by Nelder-Mead, to the same constants; `make` compiles the model."""
    from scipy.optimize import minimize

    scale = np.sqrt(np.mean(values**2, axis=0))
    scale[:3] = np.linalg.norm(scale[:3])
    began = time.perf_counter()
    model = make()

    def cost(x: Array) -> float:
        return float(np.sum(((model(x) - values) / scale) ** 2)) if np.all(x >= 0) and x[2] <= 1 else np.inf

    done = minimize(cost, START, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-14, "maxfev": 2000})
    return Timed(time.perf_counter() - began, int(done.nfev), float(np.max(np.abs(done.x - CONSTANTS))))


def forward_solves() -> Callable[[Array], Array]:
    """Return the observables by forward solves of the rod, each pose started from the one before."""
    poses = pose_solver(Model(ROBOT, SILICONE), Numerics())

    def observables(x: Array) -> Array:
        solver, near, rows = poses.with_values(dict(zip(QUANTITIES, x, strict=True))), None, []
        for pressure in P:
            step, near = solver.solve(pressure, Loads(), near)
            if step.pose is None:
                return np.full((len(P), 5), np.nan)
            pose = step.pose
            rows.append([*pose.tip_position, pose.bending_angle, pose.backbone_length - ROBOT.length])
        return np.array(rows)

    return observables


def closed_form() -> Callable[[Array], Array]:
    """Return the observables by the closed form that `identify` uses."""
    poses = ArcPoses(pose_solver(Model(ROBOT, SILICONE), Numerics()), P, QUANTITIES)
    return lambda x: poses.evaluate(dict(zip(QUANTITIES, x, strict=True))).values[:, :5]


def coverage(draws: int) -> Array:
    """Return the part of the draws whose two-sigma intervals hold the true constants, one for each."""
    exact, random = seen(TRUE), np.random.default_rng(1)
    inside = []
    for _ in range(draws):
        found = identify(measured(exact * (1 + NOISE * random.standard_normal(exact.shape))), SILICONE, FREE)
        inside.append(np.abs(found.constants - CONSTANTS) <= 2 * found.uncertainty.standard_errors)
    return np.asarray(np.mean(inside, axis=0))


def main(draws: int = 100) -> None:
    """Print ratios and coverage."""
    import scipy.optimize  # noqa: F401  whose first import takes longer than either

    values = seen(TRUE)
    quick = by_derivatives(values)
    print(f"exact derivatives: {quick.evaluations} evaluations, error {quick.error:.1e}, {quick.seconds:.2f} s")
    searches = {"closed form": closed_form, "forward solves": forward_solves}
    for name, make in searches.items():
        slow = by_search(values, make)
        print(
            f"Nelder-Mead, {name}: {slow.evaluations} evaluations ({slow.evaluations / quick.evaluations:.0f} x), "
            f"error {slow.error:.1e}, time {slow.seconds / quick.seconds:.1f} x"
        )
    inside = coverage(draws)
    print(f"two-sigma intervals, {draws} draws with {100 * NOISE:g} % noise: " + ", ".join(
        f"{name} {100 * part:.0f} %" for name, part in zip(FREE, inside, strict=True)
    ))  # fmt: skip


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
