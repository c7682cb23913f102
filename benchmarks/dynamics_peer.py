"""A cantilever let fall sideways from rest: what a tip error of 1e-3 of its length costs here and elsewhere.

The rod has the stiffnesses and the mass of D25L60 in Ecoflex 00-50 at rest, no damping, and its weight across it from
t = 0 on, over two periods of its first mode. Each is given coarser and coarser grids and steps as long as the tip stays
within the error of a fine solution at 41 times; the cheapest is timed, the best of three, compiling left out.
`python -m benchmarks.dynamics_peer`; of PyElastica and SoRoMoX (its geometric variable strain) what is not installed is
skipped.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp import Body, Loads, Segment, material, robot
from softnlp.dynamics.drive import Series
from softnlp.dynamics.simulation import Dynamics, Simulation
from softnlp.studies.modes import modes

Array = NDArray[np.float64]

ERROR = 1e-3  # of the length
GRAVITY = (9.80665, 0.0, 0.0)
OUTPUTS = 40
MADE, RUBBER = robot("D25L60"), material("Ecoflex 00-50")


def duration() -> float:
    """Return two periods of the first mode [s]."""
    found = modes(MADE, RUBBER, [0.0, 0.0, 0.0]).found
    assert found is not None
    return 2 / found.modes[0].frequency


def here(T: float, step: float, intervals: int, points: int) -> Callable[[], Array]:
    """Return what gives the tip (outputs + 1, 3)."""
    none = Series(np.zeros(1), np.zeros((1, 3)))
    asked = Dynamics(T, step, output_step=T / OUTPUTS, start="rest")

    def run() -> Array:
        simulation = Simulation(
            Body([Segment(MADE, RUBBER)]), Loads(gravity=GRAVITY), asked, none, none, intervals, points, tolerance=1e-7
        )
        return np.array([output.instant.at.position[-1] for output in simulation.run()])

    return run


def pyelastica(T: float, elements: int, part: float) -> Callable[[], Array]:
    """Return the same by PyElastica. part : of the time in which a compression wave crosses an element."""
    ea: Any = import_module("elastica")

    class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):  # type: ignore[misc]
        """A clamp and a weight."""

    stiff, mass, inertia = section()
    GA, EA, EI, GJ = stiff[0, 0], stiff[2, 2], stiff[3, 3], stiff[5, 5]
    length, radius = float(MADE.length), float(MADE.outer_radius)
    element = length / elements

    def run() -> Array:
        up, across = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
        density = mass / (np.pi * radius**2)
        rod = ea.CosseratRod.straight_rod(
            elements, np.zeros(3), up, across, length, radius, density, youngs_modulus=1e5, shear_modulus=3e4
        )
        rod.shear_matrix[0, 0], rod.shear_matrix[1, 1], rod.shear_matrix[2, 2] = GA, GA, EA
        rod.bend_matrix[0, 0], rod.bend_matrix[1, 1], rod.bend_matrix[2, 2] = EI, EI, GJ
        for k in range(3):
            rod.mass_second_moment_of_inertia[k, k] = inertia[k] * element
            rod.inv_mass_second_moment_of_inertia[k, k] = 1 / (inertia[k] * element)
        simulator = Simulator()
        simulator.append(rod)
        simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
        simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=np.array(GRAVITY))
        simulator.finalize()
        stepper, now = ea.PositionVerlet(), np.float64(0.0)
        steps = int(np.ceil(T / OUTPUTS / (part * element / np.sqrt(EA / mass))))
        h, tips = np.float64(T / OUTPUTS / steps), [rod.position_collection[:, -1].copy()]
        for _ in range(OUTPUTS):
            for _ in range(steps):
                now = stepper.step(simulator, now, h)
            tips.append(rod.position_collection[:, -1].copy())
        return np.array(tips)

    return run


def soromox(T: float, order: int, tolerance: float) -> Callable[[], Array]:
    """Return the same by SoRoMoX's geometric variable strain. order : of the Legendre polynomials of its strains.

    tolerance : of its explicit Runge-Kutta rule with chosen steps (Tsit5), its default solver; 64-bit numbers. Its rod
    lies along its own x axis, so strains are kappa_x, _y, _z, sigma_x, _y, _z; the stiffness is given as a matrix.
    """
    jax: Any = import_module("jax")
    jax.config.update("jax_enable_x64", True)
    jnp: Any = import_module("jax.numpy")
    diffrax: Any = import_module("diffrax")
    gvs: Any = import_module("soromox.systems.gvs")
    parts: Any = import_module("soromox.systems.components")
    bases: Any = import_module("soromox.systems.gvs.strain_bases")
    base: Any = import_module("soromox.systems")
    stiff, mass, inertia = section()
    length = float(MADE.length)
    radius = 2 * np.sqrt(inertia[0] / mass)  # of the rotary inertia across the axis
    mask, orders = [0, 1, 1, 1, 1, 1], [order] * 6  # without torsion, which nothing excites here
    dofs = 5 * (order + 1)
    x, w = np.polynomial.legendre.leggauss(order + 2)
    diagonal = np.diag([stiff[5, 5], stiff[3, 3], stiff[4, 4], stiff[2, 2], stiff[0, 0], stiff[1, 1]])
    K = np.zeros((dofs, dofs))
    for place, weight in zip((x + 1) / 2, w / 2 * length, strict=True):
        B = np.asarray(bases.B_LegendrePolynomial(place, jnp.array(mask), jnp.array(orders), dofs))
        K += weight * B.T @ diagonal @ B
    link = parts.LinkSpec.circular(
        length=length,
        density=mass / (np.pi * radius**2),
        radius=radius,
        stiffness=jnp.array(K),
        reference_strain=jnp.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
    )
    made = gvs.GVSSegment(link, parts.JointSpec("fixed"), gvs.StrainBasisSpec("legendre", mask, orders), order + 5)
    robot_ = gvs.GVS.from_segments([made], gravity=jnp.array(GRAVITY))
    start = jnp.zeros(robot_.state_size)
    times = jnp.linspace(0.0, T, OUTPUTS + 1)
    control = diffrax.PIDController(rtol=tolerance, atol=tolerance)

    def rolled() -> Any:
        """Return the tips."""
        state = base.SystemState(t=jnp.array(0.0), y=start)
        found = robot_.rollout_to(
            state, t1=T, solver_dt=1e-5, save_ts=times, stepsize_controller=control, max_steps=10_000_000
        )
        return jax.vmap(lambda one: robot_.forward_kinematics(one, jnp.array(length))[:3, 3])(found.y[:, :dofs])

    compiled = jax.jit(rolled)
    return lambda: np.asarray(compiled())


def section() -> tuple[Array, float, Array]:
    """Return stiffness (6, 6), mass per length and inertia (3,) of the rod at rest."""
    none = Series(np.zeros(1), np.zeros((1, 3)))
    rod = Simulation(Body([Segment(MADE, RUBBER)]), Loads(), Dynamics(1.0), none, none).rod
    return rod.at_rest.stiffness[0], float(rod.mass[0]), rod.inertia[0]


def cheapest(T: float, choices: dict[str, Callable[[], Array]], exact: Array) -> dict[str, Any]:
    """Return the cheapest of the choices whose error is small enough."""
    best: dict[str, Any] = {"seconds": np.inf}
    every = {}
    for name, run in choices.items():
        error = float(np.max(np.linalg.norm(run() - exact, axis=1))) / float(MADE.length)
        every[name] = error
        if not error <= ERROR:
            continue
        times = []
        for _ in range(3):
            began = time.process_time()
            run()
            times.append(time.process_time() - began)
        if min(times) < best["seconds"]:
            best = {"choice": name, "seconds": min(times), "error": error}
    return {**best, "errors": every}


def main() -> None:
    """Print all of them and their ratios."""
    T = duration()
    exact = here(T, T / 4000, 4, 4)()
    own = {
        f"{steps} steps, {k} x {d} points": here(T, T / steps, k, d)
        for steps in (40, 80, 120, 160)
        for k, d in ((1, 3), (1, 4), (2, 3), (3, 4))
    }
    other = {
        f"{n} elements, {part} of a wave": partial(pyelastica, T, n, part)
        for n, part in ((40, 0.9), (160, 0.9), (640, 0.9), (800, 0.9), (800, 0.5))
    }
    gvs = {
        f"order {order}, tolerance {tolerance:g}": partial(soromox, T, order, tolerance)
        for order, tolerance in ((1, 1e-4), (2, 1e-4), (2, 1e-6), (3, 1e-4), (4, 1e-5))
    }
    found: dict[str, Any] = {"softnlp": cheapest(T, own, exact)}
    for name, choices in (("PyElastica", other), ("SoRoMoX", gvs)):
        try:
            found[name] = cheapest(T, {key: make() for key, make in choices.items()}, exact)
            found[name]["ratio"] = found[name]["seconds"] / found["softnlp"]["seconds"]
        except ModuleNotFoundError as error:
            found[name] = f"skipped: {error.name} is not installed"
    print(json.dumps({"two_periods_s": T, **found}, indent=2))


if __name__ == "__main__":
    main()
