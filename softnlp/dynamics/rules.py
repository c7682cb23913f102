"""Rules in time: what is off at the end of a step, of what is there and what was before.

The trapezoid takes the balance as a mean over the step: mean resultants, turned with it so that their work is the
change of elastic energy, on one side; the change of momentum on the other. Of a linear system that is the trapezoid
to the last bit, and accelerations need not be known, so a jump needs nothing. Where strains are not linear in the
resultants the mean of these is corrected along their change (Gonzalez's discrete gradient), so that it keeps the energy
as well.
BDF2 takes the balance at the end of the step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softnlp.dynamics.rod import Acting, Inertia, Motion, Placed, Rod, cross, rotated, turned_by
from softnlp.dynamics.sections import Numbers

Array = NDArray[np.float64]
RuleName = Literal["trapezoid", "bdf2"]

STILL = 1e-8  # of EI/L^2: work of a change so small that its defect is rounding alone


@dataclass(frozen=True, eq=False)
class Instant:
    """A solved instant of a run.

    time : [s]. e : (n, 6) elastic resultants. at : the shape. motion : its rates. numbers : the sections.
    """

    time: float
    e: Array
    at: Placed
    motion: Motion
    numbers: Numbers


class Balance(NamedTuple):
    """off : (n, 6) the residual in units of the rod. N, M : (n, 3) asked for, world frame. inertia, motion : its."""

    off: Array
    N: Array
    M: Array
    inertia: Inertia
    motion: Motion


def at_end(rod: Rod, e: Array, at: Placed, parts: tuple[Motion, Inertia], acting: Acting) -> Balance:
    """Return the balance at an instant: what e gives, less what inertia and loads ask for, in the body frame."""
    motion, inertia = parts
    N, m = rod.required(at, at, inertia, acting)
    stress, R_T = rod.stress(e, motion.strain_rate), at.rotation.transpose(0, 2, 1)
    off = np.hstack([stress[:, :3] - rotated(R_T, N), stress[:, 3:] - m])
    return Balance(off / rod.units, N, rotated(at.rotation, m), inertia, motion)


@dataclass(frozen=True, eq=False)
class Trapezoid:
    """A step of the trapezoid to t. last : the instant before. begun : loads there, behind a jump."""

    t: float
    last: Instant
    begun: Acting

    @property
    def rate(self) -> float:
        """What a rate at the end gains by the quantity there [1/s]."""
        return 2 / (self.t - self.last.time)

    def acting(self, end: Acting) -> Acting:
        """Return the mean loads."""
        return Acting((end.force + self.begun.force) / 2, (end.moment + self.begun.moment) / 2, end.gravity, end.mass)

    def balance(self, rod: Rod, e: Array, at: Placed, numbers: Numbers, acting: Acting) -> Balance:
        """Return twice the mean balance over the step, in the body frame of its end."""
        last, was, c = self.last, self.last.at, self.rate
        theta = turned_by(was.turn[:-1], at.turn[:-1])
        strain_rate = c / 2 * (at.strains - was.strains)
        velocity = c * (at.position - was.position) - last.motion.velocity
        spin = c * theta - last.motion.spin
        J = rod.inertia
        momentum = rotated(at.rotation, J * spin) - rotated(was.rotation, J * last.motion.spin)
        inertia = Inertia(c / 2 * (velocity - last.motion.velocity), c / 2 * momentum)
        N, m = rod.required(was, at, inertia, self.acting(acting))
        stress = rod.stress(self.mean(rod, e, at, numbers), strain_rate)
        force = rotated((at.rotation + was.rotation) / 2, stress[:, :3])
        off = 2 * np.hstack([rotated(at.rotation.transpose(0, 2, 1), force - N), stress[:, 3:] - m])
        return Balance(off / rod.units, N, rotated(at.rotation, m), inertia, Motion(velocity, spin, strain_rate))

    def mean(self, rod: Rod, e: Array, at: Placed, numbers: Numbers) -> Array:
        """Return (n, 6) the elastic resultants whose work on the change of the strains is that of the elastic energy.

        The defect of their mean is de . (mean strains - integral of the strains along de), by Simpson's rule.
        """
        last, mean = self.last, (e + self.last.e) / 2
        if rod.sections.linear or not np.array_equal(last.numbers.rest, numbers.rest):
            return mean
        middle, more = rod.sections.strains(numbers, mean)[0], e - last.e
        defect = ((at.strains + last.at.strains) / 2 - middle) * more
        work = (more * (at.strains - last.at.strains)).sum(axis=1) + STILL * rod.units[0]
        found: Array = mean + (2 / 3 * defect.sum(axis=1) / work)[:, None] * more
        return found


@dataclass(frozen=True, eq=False)
class Backward:
    """A step of a backward rule to t. weights : of the instants before, the last first; their sum less is the end's."""

    t: float
    before: tuple[Instant, ...]
    weights: tuple[float, ...]

    @property
    def last(self) -> Instant:
        """The instant before."""
        return self.before[0]

    @property
    def rate(self) -> float:
        """What a rate at the end gains by the quantity there [1/s]."""
        return -sum(self.weights)

    def acting(self, end: Acting) -> Acting:
        """Return the loads that count: those at the end."""
        return end

    def balance(self, rod: Rod, e: Array, at: Placed, numbers: Numbers, acting: Acting) -> Balance:
        """Return the balance at the end of the step."""
        c = self.rate
        velocity, strain_rate, spin = c * at.position, c * at.strains, np.zeros((rod.size, 3))
        for w, one in zip(self.weights, self.before, strict=True):
            velocity = velocity + w * one.at.position
            strain_rate = strain_rate + w * one.at.strains
            spin = spin - w * turned_by(one.at.turn[:-1], at.turn[:-1])
        acceleration, spin_rate = c * velocity, c * spin
        for w, one in zip(self.weights, self.before, strict=True):
            acceleration = acceleration + w * one.motion.velocity
            spin_rate = spin_rate + w * one.motion.spin
        J = rod.inertia
        turning = rotated(at.rotation, J * spin_rate + cross(spin, J * spin))
        parts = Motion(velocity, spin, strain_rate), Inertia(acceleration, turning)
        return at_end(rod, e, at, parts, acting)


Rule = Trapezoid | Backward


def rule(name: RuleName, before: list[Instant], t: float, begun: Acting) -> Rule:
    """Return the rule of a step that ends at t. before : since the last jump, the last instant first.

    begun : loads at the step's beginning. BDF2 begins with a step of the backward Euler rule.
    """
    h = t - before[0].time
    if name == "trapezoid":
        return Trapezoid(t, before[0], begun)
    if len(before) == 1:
        return Backward(t, (before[0],), (-1 / h,))
    g = before[0].time - before[1].time
    return Backward(t, (before[0], before[1]), (-(h + g) / (h * g), h / (g * (h + g))))


ERROR: dict[RuleName, float] = {"trapezoid": 1 / 12, "bdf2": 2 / 9}
"""Of h^3 times a third derivative: what a step is off."""
