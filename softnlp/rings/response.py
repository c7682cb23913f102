"""What the rings do to a section at each stretch, in two exponents that depend on its geometry and on no constant.

The finite elements give the mean of T = |F|^2 in the plane. Written as the plane stretches lambda^(-1/2 + H) and
lambda^(-1/2 - H) it gives the energy of every law at once; H = 0 is uniaxial stress and H = 1/2 leaves one direction
its length. Centres of rings move as lambda^-A, where (S2) has A = 1/2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan2, cos, hypot, log, pi, sin
from typing import Any

import casadi as ca
import numpy as np

from softnlp.model.energies import PlaneEnergy, mooney_rivlin
from softnlp.model.robot import Robot
from softnlp.rings.curve import Curve, fitted, nodes
from softnlp.rings.equilibrium import Balance, Equilibrium, Failed
from softnlp.rings.mesher import Mesh, mesh
from softnlp.rings.outline import Array, PlaneSection, RingError, of_robot

STRETCHES = (0.8, 3.0)
_NODES, _ORDER = 10, 7  # stretches that are solved, order of the polynomials through them
_STEP, _SMALLEST = 0.16, 0.005  # of ln(stretch) on the way


@dataclass(frozen=True)
class RingResponse:
    """A section's response to a stretch, as smooth functions of numbers, arrays or symbols.

    Attributes
    ----------
    low, high
        Range of stretch in which it was solved; outside, the exponents go on as `Curve` says.
    stops
        Why the range is shorter than what was asked for, "" where it is not.
    error
        Largest distance of the exponents' curves from the solutions.
    shear
        H, whose stretches in the plane have the mean of T.
    arms
        A of each ring: the distance of its centre from (0, 0) goes as lambda^-A.
    turns
        By what the direction of each ring's centre turns, over ln(lambda) [rad].
    chambers
        For each ring of the whole section: which of these it is, and 1 or, as a mirror image, -1. Rings of a sector
        and of its images are counted counter-clockwise from the first image: as a robot's chambers are.
    """

    low: float
    high: float
    stops: str
    error: float
    shear: Curve
    arms: tuple[Curve, ...]
    turns: tuple[Curve, ...]
    chambers: tuple[tuple[int, float], ...]

    def plane_stretches(self, stretch: Any) -> tuple[Any, Any]:
        """Return the stretches lambda^(-1/2 + H) and lambda^(-1/2 - H) in the plane of the body outside the rings.

        The mean energy there is W(lambda, these two), for each law W of principal stretches.
        """
        H = self.shear(stretch)
        return stretch ** (H - 0.5), stretch ** (-H - 0.5)

    def arm(self, stretch: Any) -> Any:
        """Return A, the mean of the rings' exponents; raise `RingError` where thread is round the whole body alone."""
        if not self.chambers:
            raise RingError("the section has no ring inside its body, so that no centres are known")
        return sum(self.arms[ring](stretch) for ring, _ in self.chambers) / len(self.chambers)

    def circle_ratio(self, stretch: Any) -> Any:
        """Return a = r_cp / r_cp0 = stretch^-A."""
        return stretch ** -self.arm(stretch)

    def fibre_stretch(self, stretch: Any, bend: tuple[Any, Any], cast: tuple[Any, Any]) -> Any:
        """Return the stretch of a fibre in bending, to second order in the bend.

        Beside the arm a X, the section itself curves: it narrows where it is stretched and widens where it is not, as
        a prism of Poisson's ratio A does, which moves a fibre along the bend too.

        Parameters
        ----------
        stretch
            v_3, of the axis.
        bend
            (2,) u_1 and u_2, per length as cast [1/m].
        cast
            (2,) place X of the fibre as cast [m].

        Returns
        -------
        number, array or symbol
            v_3 + a k . X - A a^2 / v_3 ((k . X)^2 - k^2 X^2 / 2) with k = (-u_2, u_1).
        """
        (u_1, u_2), (x, y), A = bend, cast, self.arm(stretch)
        a, along = stretch**-A, u_1 * y - u_2 * x
        curved = along**2 - (u_1**2 + u_2**2) * (x**2 + y**2) / 2
        return stretch + a * along - A * a**2 / stretch * curved

    def centres(self, cast: Sequence[tuple[Any, Any]], stretch: Any) -> list[tuple[Any, Any]]:
        """Return where the rings' centres are.

        Parameters
        ----------
        cast
            (N, 2) centres of the section as cast, in its order [m].
        stretch
            Of the section.

        Returns
        -------
        list
            (N, 2) centres [m].
        """
        library = np if isinstance(stretch, (int, float, np.ndarray)) else ca
        moved = []
        for (x, y), (ring, side) in zip(cast, self.chambers, strict=True):
            ratio = stretch ** -self.arms[ring](stretch)
            turn = side * self.turns[ring](stretch) * library.log(stretch)
            c, s = ratio * library.cos(turn), ratio * library.sin(turn)
            moved.append((c * x - s * y, s * x + c * y))
        return moved

    def energy_ratio(self, energy: PlaneEnergy) -> Curve:
        """Return e, the energy of the body over its energy in uniaxial stress, of a law with constants of numbers.

        e has no 0/0 at stretch 1; the force is the derivative of e times the uniaxial energy.
        """
        stretches = nodes(self.low, self.high, 3 * _NODES)
        p, q = self.plane_stretches(stretches)
        ratio = energy.derivatives(p**2 + q**2, stretches)[0] / energy.uniaxial(stretches)
        return fitted(stretches, ratio, self.low, self.high, _ORDER + 2)

    def margin(self, stretch: Any) -> Any:
        """Return how far a stretch is within the range, negative outside."""
        smaller = np.minimum if isinstance(stretch, (int, float, np.ndarray)) else ca.fmin
        return smaller(stretch - self.low, self.high - stretch)


@lru_cache(maxsize=128)
def ring_response(
    section: PlaneSection, stretches: tuple[float, float] = STRETCHES, layers: float = 2.0
) -> RingResponse:
    """Return the response of a section, from finite elements; kept in memory by section.

    Parameters
    ----------
    section
        With at least one ring.
    stretches
        Range of stretch around 1.
    layers
        As of `softnlp.rings.mesher.mesh`.

    Returns
    -------
    RingResponse
        Over a shorter range where Newton's method does not reach its ends, with the reason.

    Raises
    ------
    RingError
        For a section that cannot be meshed, or without a solution beside stretch 1.
    """
    return response_on(section, mesh(section, layers), stretches)


def robot_response(robot: Robot, stretches: tuple[float, float] = STRETCHES) -> RingResponse:
    """Return `ring_response` of a robot of numbers, on the sector between two mirror lines; of one shape it is one."""
    return ring_response(of_robot(robot), stretches)


def response_on(
    section: PlaneSection, on: Mesh, stretches: tuple[float, float] = STRETCHES, count: int = _NODES
) -> RingResponse:
    """Return the response of a section on a mesh of it, from `count` stretches."""
    equilibrium, found, (low, high), stops = balances_on(section, on, stretches, count)
    at = np.array([b.stretch for b in found])
    values = [np.arccosh([b.square * b.stretch / 2 for b in found]) / 2 / np.abs(np.log(at))]
    places = np.array([_centres(equilibrium, b, section) for b in found])
    cast = np.array([centre for _, centre, *_ in equilibrium.freedom.rings])
    for (x, y), way in zip(cast, np.moveaxis(places, 1, 0), strict=True):
        if hypot(x, y) < 1e-6 * section.outer.area**0.5:  # a ring in the middle stays there
            values += [np.full(at.shape, 0.5), np.zeros(at.shape)]
        else:
            ratio = (way[:, 0] + 1j * way[:, 1]) / (x + 1j * y)
            values += [-np.log(np.abs(ratio)) / np.log(at), np.angle(ratio) / np.log(at)]
    curves = [fitted(at, v, low, high, min(_ORDER, len(at) - 3)) for v in values]
    error = max(float(np.abs(curve(at) - v).max()) for curve, v in zip(curves, values, strict=True))
    return RingResponse(
        low, high, stops, error, curves[0], tuple(curves[1::2]), tuple(curves[2::2]), _chambers(section, cast)
    )


def balances_on(
    section: PlaneSection, on: Mesh, stretches: tuple[float, float] = STRETCHES, count: int = _NODES
) -> tuple[Equilibrium, list[Balance], tuple[float, float], str]:
    """Return the equations of a section on a mesh, its balances by rising stretch, their range, and why it is shorter.

    Raises
    ------
    RingError
        For a section without a ring, a range that has not 1 in it, or no solution beside stretch 1.
    """
    if not (section.rings or section.outer_ring):
        raise RingError("the section has no ring: its stress is uniaxial")
    if not 0 < stretches[0] < 1 < stretches[1]:
        raise RingError(f"expected a range of stretch around 1, got {stretches[0]:g} to {stretches[1]:g}")
    # At one stretch everywhere the plane deformation of neo-Hookean is that of Mooney-Rivlin, and nearly that of all.
    equilibrium = Equilibrium(section, on, mooney_rivlin(1.0, 0.0))
    wanted = nodes(*stretches, count)
    rest = equilibrium.rest()
    down, low, why_low = _branch(equilibrium, rest, wanted[wanted < 1][::-1])
    up, high, why_high = _branch(equilibrium, rest, wanted[wanted > 1])
    found = [*down[::-1], *up]
    if len(found) < 4:
        raise RingError(f"the section has no equilibrium near stretch 1: {why_low or why_high}")
    return equilibrium, found, (low, high), "; ".join(text for text in (why_low, why_high) if text)


def follow(equilibrium: Equilibrium, start: Balance, stretch: float) -> Balance:
    """Return the balance at a stretch, in steps as large as Newton's method takes.

    Raises
    ------
    Failed
        With a step that has become too small; its argument is the last balance.
    """
    state, step = start, _STEP
    while state.stretch != stretch:
        left = log(stretch / state.stretch)
        target = stretch if abs(left) <= step else state.stretch * np.exp(np.copysign(step, left))
        try:
            state = equilibrium.solve(state, float(target))
        except Failed:
            step = min(step, abs(left)) / 2
            if step < _SMALLEST:
                raise Failed(state) from None
    return state


def _branch(equilibrium: Equilibrium, rest: Balance, wanted: Array) -> tuple[list[Balance], float, str]:
    """Return the balances at stretches that lead away from 1, the end of the range, and why it ends early."""
    found: list[Balance] = []
    state = rest
    for stretch in wanted:
        try:
            state = follow(equilibrium, state, float(stretch))
        except Failed as failed:
            last: Balance = failed.args[0]
            if last.stretch not in (state.stretch, 1.0):
                found.append(last)
            return found, last.stretch, f"no equilibrium was found beyond stretch {last.stretch:.3g}"
        found.append(state)
    return found, state.stretch, ""


def _centres(equilibrium: Equilibrium, balance: Balance, section: PlaneSection) -> Array:
    """Return (rings, 2) centres; of a whole section with its middle and its mean direction where they were."""
    centres = balance.rings[:, :2]
    if section.mirrors > 1:
        return centres
    el, triangles = equilibrium.elements, equilibrium.mesh.triangles
    both = (equilibrium.mesh.nodes, balance.places)
    X, x = (np.einsum("qn,mni->mqi", el.shape, places[triangles]).reshape(-1, 2) for places in both)
    weight = el.weight.ravel() / el.weight.sum()
    cast, now = weight @ X, weight @ x
    if section.mirrors:  # half a section moves along its only line
        return np.asarray(centres + (cast * balance.stretch**-0.5 - now) * [1, 0])
    X, x = X - cast, x - now
    turn = -atan2(float(weight @ (X[:, 0] * x[:, 1] - X[:, 1] * x[:, 0])), float(weight @ (X * x).sum(axis=1)))
    rotation = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
    return np.asarray((centres - now) @ rotation.T + cast * balance.stretch**-0.5)


def _chambers(section: PlaneSection, cast: Array) -> tuple[tuple[int, float], ...]:
    """Return which solved ring each ring of the whole section is: in a robot's order, sets one after another."""
    if not section.mirrors:
        return tuple((ring, 1.0) for ring in range(len(section.rings)))
    cast = cast[: len(cast) - section.outer_ring]
    high = pi / section.mirrors
    found: list[tuple[float, int, float]] = []  # angle from the middle of the set
    for ring, (x, y) in enumerate(cast):
        angle = atan2(y, x)
        found.append((angle, ring, 1.0))
        if 1e-9 < angle < high - 1e-9:
            found.append((-angle, ring, -1.0))
    return tuple((ring, side) for _, ring, side in sorted(found)) * section.mirrors
