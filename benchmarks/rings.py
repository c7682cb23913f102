"""The rings of thread in bending: sums over points, as the energy section has, beside the whole plane problem.

    python -m benchmarks.rings [--robots D25L60 ...]

For each robot: the bending stiffness at given stretches, and elongation and angles without load. `points` is the sum
over points with uniaxial stress and arms by (S2); `rings` the same with e and a of the rings; `curved` the same, where
the section curves too; `plane` the finite elements of the section, bent, where the pull of a bent chamber also pushes
its ring sideways; `slack` the same, where chambers without pressure are free bores, because their thread cannot push.
One factor on the silicone's stress for each way, from the mean elongation. Prints Markdown.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import degrees, log
from typing import Any

import numpy as np
from scipy.optimize import brentq, root

from docs.figures._shared import MEASURED_ELONGATION, markdown, measured
from softnlp import BAR, Robot, material, robot
from softnlp.cli.console import say
from softnlp.rings import PlaneSection, energy_of, of_robot, robot_response
from softnlp.rings.equilibrium import Balance, Equilibrium
from softnlp.rings.mesher import mesh
from softnlp.rings.outline import Circle
from softnlp.rings.response import follow

ROBOTS = ("D25L60", "D20L60", "D15L60", "D10L60")
ELONGATION = sum(MEASURED_ELONGATION["L60"]) / 2  # of three sets at 1.5 bar [mm]
LAW = energy_of(material("Ecoflex 00-50"))
Array = np.ndarray[Any, np.dtype[np.float64]]


def liner_force(made: Robot, stretch: Array) -> Array:
    """Return the axial force of a liner of Eq. (22), by its stretch [N]."""
    r_co, r_ci = made.chamber_radius, made.bore_radius
    x, w = np.polynomial.legendre.leggauss(12)
    R = (r_co + r_ci) / 2 + (r_co - r_ci) / 2 * x

    def energy(of: Array) -> Array:
        hoop = np.sqrt(r_co**2 - (r_co**2 - R**2) / of[:, None]) / R
        T = hoop**2 + (hoop * of[:, None]) ** -2
        density = LAW.derivatives(T, np.broadcast_to(of[:, None], T.shape))[0]
        return np.asarray((density * R * w).sum(axis=1) * np.pi * (r_co - r_ci))

    h = 1e-4
    of = np.atleast_1d(stretch)
    return np.asarray((energy(of + h) - energy(of - h)) / (2 * h))


@dataclass(frozen=True)
class Bent:
    """What a way of reckoning says of a robot without load: mean stretch of the axis and curvature [1/m]."""

    stretch: float
    curvature: float

    def angle(self, made: Robot) -> float:
        """Bending angle [deg]; the curvature is per length as cast."""
        return degrees(abs(self.curvature) * made.length)


class Points:
    """The sum over the points of a section; with rings by e and a.

    curved : whether the section's own curvature counts, with rings: `RingResponse.fibre_stretch`.
    """

    def __init__(self, made: Robot, rings: bool, curved: bool = False) -> None:
        section = of_robot(made, mirrors=1)
        el = Equilibrium(section, on := mesh(section), LAW).elements
        self.made = made
        self.X = np.einsum("qn,mni->mqi", el.shape, on.nodes[on.triangles]).reshape(-1, 2)
        self.weight = 2 * el.weight.ravel()
        self.centres = np.array([[float(x), float(y)] for x, y in made.chamber_centres()])
        self.response = robot_response(made)
        self.e = self.response.energy_ratio(LAW) if rings else (lambda stretch: 1.0)
        self.a: Callable[[Any], Any] = self.response.circle_ratio if rings else (lambda stretch: stretch**-0.5)
        self.curved = curved

    def density_slope(self, stretch: Array) -> Array:
        """Return d(e W)/d(stretch)."""
        h = 1e-4
        up, down = (self.e(s) * LAW.uniaxial(s) for s in (stretch + h, stretch - h))
        return np.asarray((up - down) / (2 * h))

    def stretches(self, stretch: float, curvature: float, at: Array) -> Array:
        """Return the stretches of fibres at (n, 2) places as cast."""
        if self.curved:
            return np.asarray(self.response.fibre_stretch(stretch, (0.0, -curvature), (at[:, 0], at[:, 1])))
        return np.asarray(stretch + curvature * self.a(stretch) * at[:, 0])

    def balance(self, stretch: float, curvature: float, pressures: Array) -> Array:
        """Return the derivatives of the potential by stretch and curvature, with (N,) pressures [Pa]."""
        body = self.density_slope(self.stretches(stretch, curvature, self.X)) * self.weight
        pull = liner_force(self.made, self.stretches(stretch, curvature, self.centres))
        pull -= pressures * np.pi * self.made.chamber_radius**2
        found = []
        for h in (np.array([1e-5, 0.0]), np.array([0.0, 1e-3 / self.made.outer_radius])):
            total = 0.0
            for force, at in ((body, self.X), (pull, self.centres)):
                high, low = (self.stretches(*(np.array([stretch, curvature]) + side * h), at) for side in (1, -1))
                total += float((force * (high - low)).sum()) / (2 * float(h.sum()))
            found.append(total)
        return np.array(found)

    def solve(self, pressures: Array, start: Bent) -> Bent:
        """Return the shape near a start."""
        return _root(self, pressures, start)


class Plane:
    """Half of a section with its rings, bent; chambers of `slack` are bores without a thread."""

    def __init__(self, made: Robot, slack: Sequence[int] = ()) -> None:
        section = of_robot(made, mirrors=1)
        upper = [n for n, (_, y) in enumerate(made.chamber_centres()) if float(y) > -1e-12]
        loose = [k for k, n in enumerate(upper) if n in slack]
        bores = [Circle(*section.rings[k].centre, float(made.bore_radius)) for k in loose]
        self.tight = [n for n in upper if n not in slack]
        rings = tuple(ring for k, ring in enumerate(section.rings) if k not in loose)
        self.section: PlaneSection = replace(section, rings=rings, holes=(*section.holes, *bores))
        self.equilibrium = Equilibrium(self.section, mesh(self.section), LAW)
        self.made, self.state = made, self.equilibrium.rest()
        self.share = np.where(np.abs([y for _, y in (ring.centre for ring in rings)]) < 1e-12, 0.5, 1.0)

    def pull(self, state: Balance, pressures: Array) -> Array:
        """Return the axial force on each ring: its pressure's less its liner's [N]."""
        stretch = state.stretch + state.rings[:, 0] * state.curvature[0]
        force = pressures[self.tight] * np.pi * self.made.chamber_radius**2 - liner_force(self.made, stretch)
        return np.asarray(self.share * force)

    def balance(self, stretch: float, curvature: float, pressures: Array) -> Array:
        """Return the total axial force and moment at a stretch and curvature."""
        state = replace(self.state, stretch=stretch, curvature=np.array([curvature, 0.0]), slope=0 * self.state.slope)
        for _ in range(2):  # the pull depends on where the rings are
            sideways = np.outer(self.pull(state, pressures), [curvature, 0.0])
            state = self.equilibrium.solve(state, stretch, (curvature, 0.0), sideways)
        self.state = state
        pull = self.pull(state, pressures)
        return 2 * np.array([state.force - pull.sum(), state.moment[0] - (pull * state.rings[:, 0]).sum()])

    def solve(self, pressures: Array, start: Bent) -> Bent:
        """Return the shape near a start, to which the state has been led."""
        return _root(self, pressures, start)


def _root(way: Points | Plane, pressures: Array, start: Bent) -> Bent:
    r = way.made.outer_radius
    unit = np.array([1.0, r]) * LAW.uniaxial(np.array([2.0]))[0] * r**2  # of force and moment
    found = root(
        lambda q: way.balance(q[0], q[1] / r, pressures) / unit, [start.stretch, start.curvature * r],
        tol=1e-6, options={"eps": 1e-6, "factor": 0.1},
    )  # fmt: skip
    if np.abs(found.fun).max() > 1e-5:
        raise RuntimeError(found.message)
    return Bent(float(found.x[0]), float(found.x[1]) / r)


def path(way: Points | Plane, pressures: Array, steps: int = 5) -> Bent:
    """Return the shape at pressures, followed from zero."""
    at = Bent(1.0, 0.0)
    for share in np.linspace(0, 1, steps + 1)[1:]:
        at = way.solve(share * pressures, at)
    return at


def on_sets(made: Robot, pressures: Sequence[float]) -> Array:
    """Return the (N,) pressures of the chambers."""
    return np.array([pressures[k] for k in made.set_of_chamber])


def stiffness(way: Points | Plane, stretch: float) -> float:
    """Return the bending stiffness at a stretch that one pressure in all chambers holds, with liners [N m^2]."""
    made, none = way.made, np.zeros(way.made.chambers)
    if isinstance(way, Plane):
        way.state = follow(way.equilibrium, way.equilibrium.rest(), stretch)
    area = made.chambers * np.pi * made.chamber_radius**2
    pressures = none + way.balance(stretch, 0.0, none)[0] / area
    h = 0.02 / made.outer_radius
    return float(np.diff([way.balance(stretch, k, pressures)[1] for k in (-h, h)])[0] / (2 * h))


def factor(robots: Sequence[Robot], rings: bool) -> float:
    """Return the factor on the stress at which the mean elongation of three sets at 1.5 bar is the measured one."""
    ways = [Points(made, rings) for made in robots]

    def beyond(logarithm: float) -> float:
        ends = [path(way, np.full(way.made.chambers, 1.5 * BAR / np.exp(logarithm))) for way in ways]
        elongations = [(end.stretch - 1) * way.made.length * 1e3 for end, way in zip(ends, ways, strict=True)]
        return float(np.mean(elongations)) - ELONGATION

    return float(np.exp(brentq(beyond, log(1.15), log(1.7), xtol=1e-3)))


def stiffnesses(robots: Sequence[Robot], stretches: Sequence[float] = (1.001, 1.2, 1.4, 1.6)) -> str:
    """Return a table of bending stiffnesses."""
    rows = []
    for made in robots:
        ways = Points(made, False), Points(made, True), Plane(made)
        for at in stretches:
            found = [1e6 * stiffness(way, at) for way in ways]
            rows.append(
                [made.name, f"{at:.1f}", *(f"{value:.1f}" for value in found), f"{found[1] / found[2] - 1:+.1%}"]
            )
    return markdown(["robot", "stretch", "points [N mm²]", "rings [N mm²]", "plane [N mm²]", "rings over plane"], rows)


def angles(robots: Sequence[Robot]) -> str:
    """Return a table of bending angles at 1.5 bar, and the mean of their errors."""
    factors = {rings: factor(robots, rings) for rings in (False, True)}
    rows, errors = [], []
    for name, pressures, seen in measured("measured_angles.csv", "bending_angle_deg"):
        made = next((of for of in robots if of.name == name), None)
        if made is None:
            continue
        # Two sets bend about a line between them: the half with the x axis has the third alone.
        one = pressures[1] == 0
        at = on_sets(made, [pressures[0], 0, 0] if one else [0, pressures[0], pressures[1]])
        idle = [int(n) for n in np.flatnonzero(at == 0)]
        ways = (
            *(Points(made, False), Points(made, True), Points(made, True, curved=True)),
            *(Plane(made), Plane(made, slack=idle)),
        )
        found = [path(way, at / factors[k > 0]).angle(made) for k, way in enumerate(ways)]
        errors.append([abs(angle - seen) for angle in found])
        rows.append([name, "one" if one else "two", f"{seen:.0f}", *(f"{angle:.0f}" for angle in found)])
    rows.append(["mean error", "", "", *(f"{error:.1f}" for error in np.mean(errors, axis=0))])
    header = ["robot", "sets", "measured", "points", "rings", "curved", "plane", "slack"]
    said = (
        f"Factors on the stress: {factors[False]:.3f} of points, {factors[True]:.3f} of the others. Angles in degrees."
    )
    return f"{said}\n\n{markdown(header, rows)}"


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--robots", nargs="+", default=ROBOTS)
    robots = [robot(name) for name in parser.parse_args().robots]
    say(stiffnesses(robots))
    say("")
    say(angles(robots))


if __name__ == "__main__":
    main()
