"""The cantilever by SoRoMoX: strain-based rods in JAX, of piecewise constant (PCS) and of polynomial strain (GVS).

SoRoMoX 0.5 has no solver for statics, so its equilibrium is written with what it has: elastic_force(q) is to equal the
tip's Jacobian transposed times the load, solved by Newton's method with JAX's own derivative, all of it in one compiled
function in double precision, from the straight rod until the step is below 1e-10. That is to its benefit: its dynamics
damped to rest would take far longer. PCS is its planar model, three strains a segment; GVS its spatial one with the
three strains of the plane as Legendre polynomials over the whole rod. Compiling is told apart ("first").
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

STEP = 1e-10  # of strain, the curvature times the length
_MOST_ITERATIONS = 50
_DENSITY = 1000.0


def entries(c: Cantilever) -> list[Entry]:
    """Return both models at two resolutions."""
    pcs = [
        Entry("SoRoMoX, PCS", f"{n} segments", lambda n=n: piecewise_constant(c, n), module="soromox")  # type: ignore[misc]
        for n in (10, 40)
    ]
    gvs = [
        Entry("SoRoMoX, GVS", f"order {n}", lambda n=n: polynomial(c, n), module="soromox")  # type: ignore[misc]
        for n in (3, 6)
    ]
    return [*pcs, *gvs]


def piecewise_constant(c: Cantilever, segments: int) -> Callable[[], Array]:
    """Return what solves the planar model; its base points along y, so x is across it."""
    jnp = _jax_numpy()
    sm: Any = import_module("soromox")

    h = c.length / segments
    link = sm.LinkSpec.circular(
        length=h,
        radius=c.radius,
        density=_DENSITY,
        reference_strain=[0.0, 1.0, 0.0],
        stiffness=h * np.diag([c.EI, c.EA, c.GA]),
    )
    rod = sm.PlanarPCS.from_links(
        [link] * segments, gravity=jnp.zeros(2), structure=sm.PlanarPCSStructure(num_gauss_points=1)
    )
    wrench, tip = jnp.array([0.0, c.force, 0.0]), jnp.asarray(c.length)
    newton = _newton(lambda q: rod.elastic_force(q) - rod.jacobian(q, tip).T @ wrench, 3 * segments, h)

    def solve() -> Array:
        pose = np.asarray(rod.forward_kinematics(newton(), tip))
        return pose[1:]

    return solve


def polynomial(c: Cantilever, order: int) -> Callable[[], Array]:
    """Return what solves the spatial model; its base points along z, and the force is along y."""
    jnp = _jax_numpy()
    sm: Any = import_module("soromox")

    link = sm.LinkSpec.circular(
        length=c.length,
        radius=c.radius,
        density=_DENSITY,
        reference_strain=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        young_modulus=c.youngs_modulus,
        shear_modulus=c.shear_modulus,
    )
    basis = sm.StrainBasisSpec("legendre", ("kappa_z", "sigma_x", "sigma_y"), order)
    rod = sm.GVS.from_segments([sm.GVSSegment(link, sm.JointSpec.fixed(), basis, 2 * order + 4)], gravity=jnp.zeros(3))
    wrench, tip = jnp.zeros(6).at[4].set(c.force), jnp.asarray(c.length)
    newton = _newton(
        lambda q: rod.elastic_force(q) - rod.jacobian_inertialframe(q, tip).T @ wrench, 3 * (order + 1), c.length
    )

    def solve() -> Array:
        pose = np.asarray(rod.forward_kinematics(newton(), tip))
        return pose[[1, 2], 3]

    return solve


def _newton(residual: Callable[[Any], Any], size: int, length: float) -> Callable[[], Any]:
    """Return Newton's method from zero strain, compiled.

    What it returns raises RuntimeError where it does not converge.
    """
    jax: Any = import_module("jax")

    jnp = _jax_numpy()

    def step(state: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
        q, k, _ = state
        change = jnp.linalg.solve(jax.jacfwd(residual)(q), -residual(q))
        return q + change, k + 1, length * jnp.abs(change).max()

    def goes_on(state: tuple[Any, Any, Any]) -> Any:
        return (state[2] > STEP) & (state[1] < _MOST_ITERATIONS)

    compiled = jax.jit(lambda q: jax.lax.while_loop(goes_on, step, (q, 0, jnp.inf)))

    def solve() -> Any:
        q, iterations, _ = compiled(jnp.zeros(size))
        if not int(iterations) < _MOST_ITERATIONS or not bool(jnp.all(jnp.isfinite(q))):
            raise RuntimeError("Newton's method did not converge")
        return q

    return solve


def _jax_numpy() -> Any:
    """Return JAX's NumPy, in double precision."""
    jax: Any = import_module("jax")

    jax.config.update("jax_enable_x64", True)
    return jax.numpy
