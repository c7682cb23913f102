"""The balance of energy of a run, step by step.

elastic is the energy of wall and held pressures together, counted from the unloaded pose at the pressures of the
moment; pressure_work is what changes of pressure add to it. So a release at held pressures has none.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from softnlp.dynamics.motion import Solved
from softnlp.dynamics.rod import Acting, Rod, rotated, turned_by
from softnlp.dynamics.rules import Instant, Rule, Trapezoid
from softnlp.dynamics.sections import Numbers

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Energy:
    """Energies at an instant and what was exchanged until then [J].

    Attributes
    ----------
    kinetic
        Of the silicone and of the mass at the tip.
    elastic
        Of wall and held pressures, zero in the unloaded pose at the pressures of the moment.
    gravity
        Of the weight, against t = 0.
    pressure_work
        What changes of pressure have done, that of a jump at t = 0 among them.
    load_work
        What the loads at the tip have done.
    dissipated
        By damping.
    numerical
        By the rule in time where it is BDF2; the trapezoid has none.
    imbalance
        What is missing: kinetic + elastic + gravity + dissipated + numerical - pressure_work - load_work, less the
        first sum.
    exchanged
        The largest of the terms so far, against which the imbalance counts.
    """

    kinetic: float = 0.0
    elastic: float = 0.0
    gravity: float = 0.0
    pressure_work: float = 0.0
    load_work: float = 0.0
    dissipated: float = 0.0
    numerical: float = 0.0
    imbalance: float = 0.0
    exchanged: float = 0.0

    def as_numbers(self) -> dict[str, float]:
        """Return all of them by name."""
        return {field.name: float(getattr(self, field.name)) for field in fields(self)}


class Ledger:
    """Keeps the energies of a run."""

    def __init__(self, rod: Rod, first: Instant, numbers: Numbers, acting: Acting, jump: float) -> None:
        self._rod = rod
        self._gravity_0 = self._weight(first, acting)
        kinetic, elastic = self._kinetic(first, acting), self._elastic(first, numbers)
        self._begun = kinetic + elastic - jump
        self.now = Energy(kinetic, elastic, pressure_work=jump, exchanged=max(kinetic, elastic, abs(jump)))

    def _kinetic(self, one: Instant, acting: Acting) -> float:
        rod, motion = self._rod, one.motion
        density = rod.mass * (motion.velocity[:-1] ** 2).sum(axis=1) + (rod.inertia * motion.spin**2).sum(axis=1)
        return float(rod.w @ density + acting.mass * (motion.velocity[-1] ** 2).sum()) / 2

    def _elastic(self, one: Instant, numbers: Numbers) -> float:
        rod = self._rod
        return float(rod.w @ ((one.e * one.at.strains).sum(axis=1) - rod.sections.complement(numbers, one.e)))

    def _weight(self, one: Instant, acting: Acting) -> float:
        rod, p = self._rod, one.at.position
        return -float(acting.gravity @ ((rod.w * rod.mass) @ p[:-1] + acting.mass * p[-1]))

    def jump(self, before: Numbers, after: Numbers, one: Instant, kept: Instant) -> None:
        """Take a jump of the pressures at held strains; one, kept : the instant behind and before it."""
        work = self._elastic(one, after) - self._elastic(kept, before)
        self._book(self.now.kinetic, self.now.elastic + work, self.now.gravity, pressure=work)

    def step(self, rule: Rule, solved: Solved, held: tuple[Numbers, Numbers], acting: tuple[Acting, Acting]) -> None:
        """Take a step. held, acting : sections and loads at its beginning and end."""
        rod, one, last, w, was = self._rod, solved.instant, rule.last, self._rod.w, self.now
        h = one.time - last.time
        kinetic, elastic = self._kinetic(one, acting[1]), self._elastic(one, held[1])
        gravity = self._weight(one, acting[1]) - self._gravity_0
        pressure = 0.0
        if held[0] is not held[1]:
            pressure = self._pressed(rule, one, held)
        rate, dissipated, numerical = one.motion.strain_rate, 0.0, 0.0
        if rod.damping_s:
            dissipated = h * float(w @ (rate * rotated(rod.viscosity, rate)).sum(axis=1))
        if isinstance(rule, Trapezoid):
            load = (acting[0].force + acting[1].force) / 2 @ (one.at.position[-1] - last.at.position[-1])
            turned = turned_by(last.at.turn[-1:], one.at.turn[-1:])
            load += (acting[0].moment + acting[1].moment) / 2 @ rotated(one.at.tip_rotation, turned)[0]
        else:
            load = h * (acting[1].force @ one.motion.velocity[-1])
            for weight, then in zip(rule.weights, rule.before, strict=True):
                turned = turned_by(then.at.turn[-1:], one.at.turn[-1:])
                load -= h * weight * (acting[1].moment @ rotated(one.at.tip_rotation, turned)[0])
            numerical = h * self._power(solved, acting[1]) + pressure
            numerical -= kinetic + elastic + gravity - was.kinetic - was.elastic - was.gravity
        self._book(kinetic, elastic, gravity, pressure, float(load), dissipated, numerical)

    def _pressed(self, rule: Rule, one: Instant, held: tuple[Numbers, Numbers]) -> float:
        """Return what the change of the pressures adds: less the change of the complementary energy at held resultants.

        The trapezoid's is what its mean resultants leave of the change of elastic energy, so that the sum closes: the
        strains' mean along the change of the resultants, less the change of the complementary energy.
        """
        last, complement, w = rule.last, self._rod.sections.complement, self._rod.w
        if isinstance(rule, Trapezoid):
            along = ((one.e - last.e) * (one.at.strains + last.at.strains)).sum(axis=1) / 2
            return float(w @ (along - complement(held[1], one.e) + complement(held[0], last.e)))
        more = sum(complement(held[1], e) - complement(held[0], e) for e in (last.e, one.e))
        return -float(w @ np.asarray(more)) / 2

    def _power(self, solved: Solved, acting: Acting) -> float:
        """Return the power that goes into kinetic, elastic and gravity energy, of the equations at an instant."""
        rod, one, inertia = self._rod, solved.instant, solved.balance.inertia
        v, a = one.motion.velocity, inertia.acceleration - acting.gravity
        density = rod.mass * (v[:-1] * a[:-1]).sum(axis=1)
        density += (rotated(one.at.rotation, one.motion.spin) * inertia.turning).sum(axis=1)
        density += (one.e * one.motion.strain_rate).sum(axis=1)
        return float(rod.w @ density + acting.mass * (v[-1] @ a[-1]))

    def _book(
        self,
        kinetic: float,
        elastic: float,
        gravity: float,
        pressure: float = 0.0,
        load: float = 0.0,
        dissipated: float = 0.0,
        numerical: float = 0.0,
    ) -> None:
        was = self.now
        pressure, load = was.pressure_work + pressure, was.load_work + load
        dissipated, numerical = was.dissipated + dissipated, was.numerical + numerical
        total = kinetic + elastic + gravity + dissipated + numerical - pressure - load
        terms = (kinetic, elastic, gravity, pressure, load, dissipated, numerical)
        self.now = Energy(
            kinetic=kinetic,
            elastic=elastic,
            gravity=gravity,
            pressure_work=pressure,
            load_work=load,
            dissipated=dissipated,
            numerical=numerical,
            imbalance=total - self._begun,
            exchanged=max(was.exchanged, *map(abs, terms)),
        )
