"""A robot's motion as a function of its damping, lag and a factor of its modulus."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softnlp.dynamics.drive import Series
from softnlp.dynamics.modes import Vibration, vibration
from softnlp.dynamics.motion import Stepper
from softnlp.dynamics.rod import Acting
from softnlp.dynamics.sections import Failed
from softnlp.dynamics.simulation import Dynamics, Simulation
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.model.segments import body_of
from softnlp.studies.dynamic import chosen_intervals
from softnlp.studies.trace import Trace, simulated_tips, times_of
from softnlp.studies.uncertainty import scalable, scaling_constants

Array = NDArray[np.float64]


@dataclass(eq=False)
class Motion:
    """A robot's motion as a function of what is free. step : of time [s]."""

    robot: Robot
    material: Material
    coefficients: Coefficients
    conventions: Conventions
    loads: Loads
    asked: Dynamics
    pressures: Series
    force: Series
    numerics: Numerics
    names: tuple[str, ...]
    step: float = 0.0
    intervals: int | None = None
    evaluations: int = 0

    def with_values(self, values: Array) -> tuple[Dynamics, Material, Coefficients]:
        """Return the motion that is asked for, silicone and coefficients with some values."""
        found = dict(zip(self.names, (float(v) for v in values), strict=True))
        asked = replace(
            self.asked,
            step=self.step,
            damping=found.get("damping_s", self.asked.damping),
            lag=found.get("lag_s", self.asked.lag),
        )
        factor = found.get("modulus_factor")
        if factor is None:
            return asked, self.material, self.coefficients
        if self.conventions.energy:
            return asked, self.material, replace(self.coefficients, modulus_factor=factor)
        return asked, stiffer(self.material, factor), self.coefficients

    def tips(self, values: Array, trace: Trace, numerics: Numerics | None = None) -> Array:
        """Return the tips (rows, 3) at the times of a trace. Raises `Failed`."""
        self.evaluations += 1
        asked, material, coefficients = self.with_values(values)
        body = body_of(Model(self.robot, material, coefficients, self.conventions))
        both = self.pressures, self.force
        if self.intervals is None:
            self.intervals, _ = chosen_intervals(body, self.loads, both, self.numerics)
        tolerance = min(self.numerics.tolerance, 1e-8) / 10
        simulation = Simulation(
            body, self.loads, asked, *both, intervals=self.intervals, tolerance=tolerance,
            numerics=self.search if numerics is None else numerics, kept=times_of(trace),
        )  # fmt: skip
        return simulated_tips(simulation, trace.times.size)

    @property
    def search(self) -> Numerics:
        """What a search is made with: Newton's method alone, but with the engine "ipopt"."""
        return self.numerics if self.numerics.engine == "ipopt" else self.numerics.without_ipopt()

    def modes(self, values: Array) -> Vibration | None:
        """Return how it swings about the pose at rest of the last pressures, None where there is none."""
        asked, material, coefficients = self.with_values(values)
        body = body_of(Model(self.robot, material, coefficients, self.conventions))
        last = self.pressures.values[-1]
        held = Series(np.zeros(1), last[None])
        one = Simulation(body, self.loads, replace(asked, step=None), held, self.force, intervals=self.intervals)
        gravity, none = np.asarray(self.loads.gravity, float), np.zeros(3)
        try:
            acting = Acting(none, none, gravity, asked.tip_mass)
            return vibration(Stepper(one.rod), last, acting, float(self.robot.outer_diameter) / 2)
        except Failed:
            return None


def stiffer(material: Material, factor: float) -> Material:
    """Return a silicone whose stress is so many times that of another one."""
    made = scalable(material)
    scaled = {name: made.constants[name] * factor for name in scaling_constants(made)}
    return replace(made, constants={**made.constants, **scaled}, set="")
