"""The cantilever by PyElastica, a dynamic simulation of Cosserat rods, damped until it rests.

Chosen to its benefit, none of which changes where it comes to rest: its damping is 1.3 times the critical one of the
slowest bending mode (0.5, 1 and 2 times need more steps), the time step is 0.9 of the time in which a compression wave
crosses an element (1.1 diverges), and the rotational inertia is raised until the shear waves allow that step too; as it
is, a rod as slender as this asks for a step several times shorter. The load is applied over half a radian of the
slowest mode. It stops when no node moves faster than 1e-6 lengths in a radian of the slowest mode, which is about how
far it then is from rest. Shear and bending stiffness are set to the numbers of the rod that is compared, with no shear
correction.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.paper_method import Array
from benchmarks.race import Entry

if TYPE_CHECKING:
    from benchmarks.cantilever import Cantilever

REST = 1e-6  # lengths in a radian of the slowest mode
WAVE = 0.9  # of the time in which a compression wave crosses an element
DAMPING = 1.3  # of the critical one of the slowest mode
RAMP = 0.5  # radians of the slowest mode
DENSITY = 1000.0
_CHECK = 200  # steps between two looks at the velocities
_MOST_STEPS = 300_000
_SLOWEST_MODE = 3.516  # of a cantilever, L^2 sqrt(rho A / EI)


def entries(c: Cantilever) -> list[Entry]:
    """Return it at two resolutions."""
    return [
        Entry("PyElastica", f"{n} elements", lambda n=n: prepared(c, n), module="elastica")  # type: ignore[misc]
        for n in (20, 100)
    ]


def prepared(c: Cantilever, elements: int) -> Callable[[], Array]:
    """Return what simulates from the straight rod to rest."""
    return lambda: simulate(c, elements)


def simulate(c: Cantilever, elements: int) -> Array:
    """Return the tip (x, z) [m] at rest.

    Raises
    ------
    RuntimeError
        Where it does not come to rest.
    """
    ea: Any = import_module("elastica")

    class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc]
        """What PyElastica is told of: a clamp, a force, a damper."""

    area = np.pi * c.radius**2
    slowest = _SLOWEST_MODE / c.length**2 * np.sqrt(c.EI / (DENSITY * area))
    element = c.length / elements
    step = WAVE * element / np.sqrt(c.youngs_modulus / DENSITY)
    simulator = Simulator()
    rod = straight_rod(c, elements)
    simulator.append(rod)
    simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    force = np.array([c.force, 0.0, 0.0])
    simulator.add_forcing_to(rod).using(ea.EndpointForces, np.zeros(3), force, ramp_up_time=RAMP / slowest)
    rate = 2 * DAMPING * slowest
    simulator.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=rate, time_step=step)
    simulator.finalize()
    stepper, now = ea.PositionVerlet(), np.float64(0.0)
    for k in range(1, _MOST_STEPS):
        now = stepper.step(simulator, now, step)
        if k % _CHECK == 0 and now * slowest > 2 * RAMP:
            fastest = np.abs(rod.velocity_collection).max() / (slowest * c.length)
            if not np.isfinite(fastest):
                raise RuntimeError("the simulation diverged")
            if fastest <= REST:
                return np.array(rod.position_collection[[0, 2], -1])
    raise RuntimeError(f"not at rest after {_MOST_STEPS} steps")


def straight_rod(c: Cantilever, elements: int) -> Any:
    """Return PyElastica's rod along z with the stiffnesses of the cantilever."""
    ea: Any = import_module("elastica")

    up, across = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    moduli = {"youngs_modulus": c.youngs_modulus, "shear_modulus": c.shear_modulus}
    rod = ea.CosseratRod.straight_rod(elements, np.zeros(3), up, across, c.length, c.radius, DENSITY, **moduli)
    rod.shear_matrix[0, 0], rod.shear_matrix[1, 1], rod.shear_matrix[2, 2] = c.GA, c.GA, c.EA
    rod.bend_matrix[0, 0] = rod.bend_matrix[1, 1] = c.EI
    raised = max(1.0, (2 * c.length / elements / c.radius) ** 2)
    rod.mass_second_moment_of_inertia *= raised
    rod.inv_mass_second_moment_of_inertia /= raised
    return rod
