"""The potential of the energy section by other means: energies of principal stretches, many points, no fitted curves.

Written with numpy alone from the energies of Table II; the rod of it with CasADi's gradients, and minimised by scipy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import minimize

from softnlp import Material, Robot

BASIS, STEPS = 12, 48


def density(material: Material) -> Any:
    """Return W(l1, l2, l3) [Pa] for the laws that are energies."""
    c, law = material.constants, material.law.name
    if law == "ogden":
        return lambda *s: sum(c[f"mu{k}"] / c[f"b{k}"] * (sum(one ** c[f"b{k}"] for one in s) - 3) for k in (1, 2))
    C10 = c["mu0"] / 2 if law == "neo-hookean" else c["C10"]
    C01, C20 = c.get("C01", 0.0), c.get("C20", 0.0)

    def W(a: Any, b: Any, d: Any) -> Any:
        I1, I2 = a**2 + b**2 + d**2, (a * b) ** 2 + (b * d) ** 2 + (d * a) ** 2
        return C10 * (I1 - 3) + C01 * (I2 - 3) + C20 * (I1 - 3) ** 2

    return W


def disc(radius: float, centre: tuple[float, float], rings: int, spokes: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 2) and weights (n,) of a polar rule."""
    x, w = np.polynomial.legendre.leggauss(rings)
    r = radius * np.sqrt((1 + x) / 2)
    angle = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    points = np.stack([np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel()], axis=1)
    return points + np.array(centre), np.repeat(np.pi * radius**2 * w / 2 / spokes, spokes)


@dataclass
class Witness:
    """U of a robot at pressures (sets,) [Pa]. rings : (square, circle) as functions of the stretch, None without."""

    robot: Robot
    material: Material
    pressure: Any
    factor: float = 1.0
    rings: Any = None

    def __post_init__(self) -> None:
        robot, W = self.robot, density(self.material)
        self.centres = [(float(x), float(y)) for x, y in robot.chamber_centres()]
        parts = [(1, disc(robot.outer_radius, (0, 0), 6, 14)), (-1, disc(robot.lumen_radius, (0, 0), 3, 8))]
        parts += [(-1, disc(robot.chamber_radius, centre, 3, 8)) for centre in self.centres]
        self.points = np.concatenate([points for _, (points, _) in parts])
        self.weights = np.concatenate([sign * weights for sign, (_, weights) in parts])
        self.W = W
        r_co, r_ci = robot.chamber_radius, robot.bore_radius
        x, w = np.polynomial.legendre.leggauss(12)
        self.R = (r_co + r_ci) / 2 + (r_co - r_ci) / 2 * x
        self.dA = 2 * np.pi * self.R * w * (r_co - r_ci) / 2
        self.A_0 = np.pi * (robot.outer_radius**2 - robot.lumen_radius**2 - robot.chambers * r_ci**2)
        self.J_0 = np.pi * (robot.outer_radius**4 - robot.lumen_radius**4) / 2 - robot.chambers * np.pi * (
            r_ci**4 / 2 + r_ci**2 * robot.chamber_circle_radius**2
        )

    def shear(self, v: Any) -> Any:
        """Return 2 (W1 + W2 / v) of a uniaxial stretch [Pa]; of Ogden's law sigma / (v - v^-2), beside v = 1."""
        c, law = self.material.constants, self.material.law.name
        if law == "ogden":
            return sum(c[f"mu{k}"] * (v ** (c[f"b{k}"] - 1) - v ** (-c[f"b{k}"] / 2 - 1)) for k in (1, 2)) / (v - v**-2)
        if law == "neo-hookean":
            return c["mu0"]
        return 2 * (c["C10"] + 2 * c.get("C20", 0.0) * (v**2 + 2 / v - 3) + c.get("C01", 0.0) / v)

    def U(self, v: Any, u: Any) -> Any:
        """Return U [N] at strains v, u (3,) per length as cast; numbers or symbols."""
        v_3 = v[2]
        square, circle = self.rings if self.rings is not None else (lambda s: 1.0, lambda s: s**-0.5)
        a = circle(v_3)
        total = 0.0
        for (X, Y), weight in zip(self.points, self.weights, strict=True):
            stretch = v_3 + a * (u[0] * Y - u[1] * X)
            half = square(stretch)  # lambda T / 2, the cosh of twice the difference of logarithms
            more = half + ca.sqrt(half**2 - 1 + 1e-26)
            p = ca.sqrt(more / stretch)
            total += weight * self.factor * self.W(stretch, p, 1 / (p * stretch))
        r_co = self.robot.chamber_radius
        for (X, Y), k in zip(self.centres, self.robot.set_of_chamber, strict=True):
            stretch = v_3 + a * (u[0] * Y - u[1] * X)
            for R, dA in zip(self.R, self.dA, strict=True):
                hoop = ca.sqrt(r_co**2 - (r_co**2 - R**2) / stretch) / R
                total += dA * self.factor * self.W(stretch, hoop, 1 / (stretch * hoop))
            total -= self.pressure[k] * np.pi * r_co**2 * stretch
        GA = self.factor * self.shear(v_3) * self.A_0
        return total + GA * (v[0] ** 2 + v[1] ** 2) / 2 + GA * self.J_0 / self.A_0 / v_3 * u[2] ** 2 / 2

    def minimised(self, force: Any, gravity: Any, start: Any) -> np.ndarray:
        """Return the tip [m] of the rod of least energy: strains are polynomials in S, rotations found by RK4.

        start : (6,) strains v, u to begin from, the same all along.
        """
        L = float(self.robot.length)
        strains, x = ca.SX.sym("strains", 6), ca.SX.sym("x", 12)
        U = ca.Function("U", [strains], [self.U(strains[:3], strains[3:] / L)], {"cse": True})
        R, u = ca.reshape(x[3:], 3, 3), strains[3:]
        hat = ca.vertcat(ca.horzcat(0, -u[2], u[1]), ca.horzcat(u[2], 0, -u[0]), ca.horzcat(-u[1], u[0], 0))
        rates = ca.Function("rates", [x, strains], [ca.vertcat(L * R @ strains[:3], ca.vec(R @ hat))])
        a, b, c, d, e = (ca.SX.sym(name, 6) for name in "abcde")
        h = 1 / (2 * STEPS)

        def step(y: Any, first: Any, middle: Any, last: Any) -> Any:
            k1 = rates(y, first)
            k2 = rates(y + h / 2 * k1, middle)
            k3 = rates(y + h / 2 * k2, middle)
            k4 = rates(y + h * k3, last)
            return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

        half = step(x, a, b, c)
        whole = step(half, c, d, e)
        mean = (x[:3] + 4 * half[:3] + whole[:3]) / (6 * STEPS)
        y = ca.SX.sym("y", 15)
        moved = ca.substitute(ca.vertcat(whole, y[12:] + mean), x, y[:12])
        onward = ca.Function("onward", [y, ca.vertcat(a, b, c, d, e)], [moved])

        q = ca.MX.sym("q", 6 * BASIS)
        Q = ca.reshape(q, 6, BASIS)

        def at(places: Any) -> Any:
            return Q @ ca.DM(np.polynomial.legendre.legvander(2 * np.asarray(places) - 1, BASIS - 1).T)

        every = at(np.arange(4 * STEPS + 1) / (4 * STEPS))
        fives = ca.vertcat(*(every[:, k : 4 * STEPS - 3 + k : 4] for k in range(5)))
        path = onward.mapaccum(STEPS)(ca.vertcat(ca.DM.zeros(3), ca.vec(ca.DM.eye(3)), ca.DM.zeros(3)), fives)
        gauss, weights = np.polynomial.legendre.leggauss(14)
        stored = L * (U.map(14)(at((1 + gauss) / 2)) @ ca.DM(weights / 2))
        weight = self.material.density * self.A_0 * L * ca.DM(gravity)
        total = 1e3 * (stored - ca.dot(ca.DM(force), path[:3, -1]) - ca.dot(weight, path[12:, -1]))
        hessian, gradient = ca.hessian(total, q)
        f = ca.Function("f", [q], [total, gradient, hessian, path[:3, -1]])
        begin = np.zeros((6, BASIS))
        begin[:, 0] = np.asarray(start) * np.array([1, 1, 1, L, L, L])
        found = minimize(
            lambda z: float(f(z)[0]),
            begin.T.ravel(),
            jac=lambda z: np.asarray(f(z)[1]).ravel(),
            hess=lambda z: np.asarray(f(z)[2]),
            method="trust-exact",
            options={"gtol": 1e-10, "initial_trust_radius": 0.3, "max_trust_radius": 2.0},
        )
        return np.asarray(f(found.x)[3]).ravel()
