"""A slender cantilever under a transverse dead load at its tip, by everything that can solve it.

The rod is the section of D10L60 in Ecoflex 00-50 without pressure, half a metre long: about fifty times its own
diameter, of constant EI, EA and GA, and the load is 4 EI / L^2, which turns the tip by 64 degrees. Every tool is given
those numbers and the same load, starts from the straight rod, and is judged by the distance of its tip from `truth`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from benchmarks import paper_method, scipy_bvp
from benchmarks.paper_method import Array, Rod
from benchmarks.race import Entry
from benchmarks.rods import Rods
from softnlp import Loads, Numerics, material, robot
from softnlp.model.quantities import Model
from softnlp.statics.solver import PoseSolver

MODEL = Model(replace(robot("D10L60"), length=0.5), material("Ecoflex 00-50"))
LOAD = 4.0  # F L^2 / EI


@dataclass(frozen=True)
class Cantilever:
    """A straight rod, clamped at one end. length [m], EI [N m^2], EA, GA [N], force: across it, at the tip [N]."""

    length: float
    EI: float
    EA: float
    GA: float
    force: float

    @property
    def radius(self) -> float:
        """Of the solid round section with this EI and EA [m]."""
        return 2.0 * float(np.sqrt(self.EI / self.EA))

    @property
    def youngs_modulus(self) -> float:
        """Of that section [Pa]."""
        return self.EA / (np.pi * self.radius**2)

    @property
    def shear_modulus(self) -> float:
        """Of that section, with no shear correction [Pa]."""
        return self.GA / (np.pi * self.radius**2)


def rod() -> Rod:
    """Return the rod as the paper's method takes it."""
    return Rods(MODEL).at(np.zeros(3))


def cantilever(load: float = LOAD) -> Cantilever:
    """Return the cantilever of `MODEL` under `load` EI / L^2."""
    r = rod()
    return Cantilever(r.length, r.EI[1], r.EA, r.GA, load * r.EI[1] / r.length**2)


def truth(c: Cantilever) -> Array:
    """Return the tip (x along the load, z along the undeformed axis) [m] to about 1e-12 of the length.

    The planar rod with shear and extension is an initial value problem with one unknown, the moment at the base: DOP853
    and bisection, independent of every tool that is compared. It tends to the elastica where EA and GA grow.
    """
    F, EA, GA = c.force * c.length**2 / c.EI, c.EA * c.length**2 / c.EI, c.GA * c.length**2 / c.EI

    def rates(s: float, y: Array) -> list[float]:
        _, _, turn, m = y
        sin, cos = np.sin(turn), np.cos(turn)
        stretch, shear = 1.0 + F * sin / EA, F * cos / GA
        dz = stretch * cos - shear * sin
        return [stretch * sin + shear * cos, dz, m, -F * dz]

    def tip(moment: float) -> Array:
        start = [0.0, 0.0, 0.0, moment]
        return np.asarray(solve_ivp(rates, (0.0, 1.0), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1])

    moment = brentq(lambda m: tip(m)[3], 0.0, 1.5 * F, xtol=1e-14, rtol=1e-14)
    return tip(moment)[:2] * c.length


def tip_error(tip: Array, exact: Array) -> float:
    """Return the distance of a tip (x, z) [m] from the exact one, over the length."""
    return float(np.linalg.norm(np.asarray(tip) - exact)) / float(MODEL.robot.length)


def ours(intervals: int | None) -> Callable[[], Array]:
    """Return a solver of this package that has its grid compiled; each solve starts cold from the straight rod."""
    solver = PoseSolver(MODEL, Numerics(intervals=intervals))
    loads = Loads(tip_force=(cantilever().force, 0.0, 0.0))

    def solve() -> Array:
        step, _ = solver.solve(np.zeros(3), loads)
        if step.pose is None:
            raise RuntimeError(step.message)
        return step.pose.tip_position[[0, 2]]

    return solve


def paper(steps: int) -> Callable[[], Array]:
    """Return the paper's method, its field in Python floats."""
    r, force = rod(), (cantilever().force, 0.0, 0.0)

    def solve() -> Array:
        found = paper_method.solve_pose(r, force, start="arc", steps=steps)
        if not found.residual <= 1e-6:
            raise RuntimeError(f"ended at a residual of {found.residual:.1e}")
        return found.tip.p[[0, 2]]

    return solve


def bvp(tolerance: float) -> Callable[[], Array]:
    """Return scipy's solver of boundary value problems."""
    r, force = rod(), (cantilever().force, 0.0, 0.0)
    return lambda: scipy_bvp.solve_pose(r, force, tolerance=tolerance)[[0, 2]]


def entries() -> list[Entry]:
    """Return every tool at two resolutions, and ours at its default too."""
    from benchmarks import peer_pyelastica, peer_soromox

    c = cantilever()
    listed = [Entry("softnlp", f"{n} intervals", lambda n=n: ours(n), reference=n == 40) for n in (10, 40)]  # type: ignore[misc]
    listed.append(Entry("softnlp", "auto (1e-6 L)", lambda: ours(None)))
    listed += [Entry("paper's method, floats", f"{n} steps", lambda n=n: paper(n)) for n in (10, 40)]  # type: ignore[misc]
    listed += [Entry("scipy solve_bvp", f"tol {t:g}", lambda t=t: bvp(t)) for t in (1e-3, 1e-6)]  # type: ignore[misc]
    return [*listed, *peer_soromox.entries(c), *peer_pyelastica.entries(c)]
