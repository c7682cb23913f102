"""Steps of time closed by IPOPT: the program of the package, and one that shares nothing with it, as its witness.

With the witness the section and the field of statics are all that is shared with the steps of a run: all states p, R,
N, M at every node and Gauss point are unknown, rotations are matrices, and no slope is written by hand.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from softnlp import BAR, Body, Loads, Numerics, Segment, material, robot
from softnlp.base.status import Status
from softnlp.dynamics.drive import Series
from softnlp.dynamics.grid import gauss
from softnlp.dynamics.motion import Stepper
from softnlp.dynamics.rod import matrices
from softnlp.dynamics.rules import Instant
from softnlp.dynamics.sections import Failed
from softnlp.dynamics.simulation import Dynamics, Output, Simulation
from softnlp.model import rod
from softnlp.model.section import RodSection, rod_section
from tests.moving_bodies import TWO, Stiffening

Array = NDArray[np.float64]


def turned(before: Array, R: Any) -> Any:
    """Return Cayley's vector of the rotation from one matrix to another, body frame."""
    Q = ca.DM(before).T @ R
    return 2 * ca.vertcat(Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]) / (1 + ca.trace(Q))


def closed_by_ipopt(simulation: Simulation, last: Instant, h: float) -> Array:
    """Return the positions at the Gauss points after one step of the backward Euler rule."""
    grid, own = simulation.grid, simulation.rod
    model, d = simulation.body.models[0], simulation.grid.points
    P = simulation.chambers.at(h)
    stretch = float(own.sections.at(P).stretch[0])
    state = model.section.at(model.numbers, list(P), stretch)
    section: RodSection = rod_section(state, stretch * simulation.body.length, 1.0, 1.0)
    acting = simulation.acting(h)
    force_unit, moment_unit = own.units[0], own.units[3]
    size = ca.DM([own.length] * 3 + [1.0] * 9 + [force_unit] * 3 + [moment_unit] * 3)
    _, b, A = gauss(d)
    before = matrices(last.at.turn[:-1])

    def rate(x: Any, k: int) -> Any:
        """Return dx/dS per length as cast at a Gauss point."""
        p, R, _, _ = rod.unpack(x)
        v, u = model.section.strains(section, [], *rod.in_body(x))
        velocity = (p - last.at.position[k]) / h
        a = (velocity - last.motion.velocity[k]) / h
        spin = turned(before[k], R) / h
        J = ca.DM(own.inertia[k])
        turning = R @ (J * (spin - last.motion.spin[k]) / h + ca.cross(spin, J * spin))
        force = own.mass[k] / stretch * (acting.gravity - a)
        return stretch * rod.field(x, v, u, force, -turning / stretch)

    intervals = grid.of_interval.size
    nodes, points = ca.MX.sym("nodes", 18, intervals + 1), ca.MX.sym("points", 18, intervals * d)
    rows = [rod.base_balance(size * nodes[:, 0])]
    for i in range(intervals):
        length = float(grid.ends[i + 1] - grid.ends[i])
        stages = [size * points[:, i * d + j] for j in range(d)]
        rates = [rate(stages[j], i * d + j) for j in range(d)]
        first = size * nodes[:, i]
        for j in range(d):
            rows.append((stages[j] - first - length * sum(A[j, m] * rates[m] for m in range(d))) / size)
        rows.append((size * nodes[:, i + 1] - first - length * sum(b[m] * rates[m] for m in range(d))) / size)
    tip = rod.tip_balance(size * nodes[:, -1], ca.DM(acting.force), ca.DM(acting.moment))
    rows.append(tip / size[12:])
    x, g = ca.vertcat(ca.vec(nodes), ca.vec(points)), ca.vertcat(*rows)
    assert x.numel() == g.numel()
    solver = ca.nlpsol(
        "step", "ipopt", {"x": x, "f": 0, "g": g}, {"print_time": False, "ipopt": {"print_level": 0, "tol": 1e-11}}
    )
    straight = [
        np.concatenate([[0, 0, s], np.eye(3).ravel(), np.zeros(6)]) / np.asarray(size).ravel()
        for s in (*grid.ends, *grid.place)
    ]
    found = solver(x0=np.concatenate(straight), lbg=0, ubg=0)
    assert solver.stats()["success"]
    solution = np.asarray(found["x"]).reshape(-1, 18)[intervals + 1 :]
    positions: Array = solution[:, :3] * own.length
    return positions


@pytest.mark.parametrize("bars", [(0.0, 0.0, 0.0), (0.6, 0.2, 0.0)])
def test_ipopt_closes_a_step_where_newton_found_it(bars: tuple[float, ...]) -> None:
    h = 0.01
    asked = Dynamics(h, h, rule="bdf2", output_step=h, release=True)
    loads = Loads((0.03, 0.02, 0.02), (1e-4, 0.0, 2e-4), (1.0, 0.0, 9.0))
    held, none = Series(np.zeros(1), np.array([bars]) * BAR), Series(np.zeros(1), np.zeros((1, 3)))
    body = Body([Segment(robot("D25L60"), material("Ecoflex 00-50"))])
    simulation = Simulation(body, loads, asked, held, none)
    first, last = list(simulation.run())
    moved = np.linalg.norm(last.instant.at.position[-1] - first.instant.at.position[-1])
    assert moved > 0.005 * body.length
    found = closed_by_ipopt(simulation, first.instant, h)
    assert np.allclose(found, last.instant.at.position[:-1], rtol=0, atol=5e-8 * body.length)


# --- the engines ------------------------------------------------------------------------------------------------------

RUBBER = material("Ecoflex 00-50")
ENERGY_LIKE = Body([Segment(robot("D25L60"), RUBBER, Stiffening)])
BODIES = {
    "one": (Body([Segment(robot("D25L60"), RUBBER)]), (0.5, 0.2, 0.0)),
    "segments": (Body(TWO.segments), (0.4, 0.1, 0.0, 0.2, 0.0, 0.3)),
    "strains not linear": (ENERGY_LIKE, (0.5, 0.2, 0.0)),
}


def followed(which: str, rule: Any, engine: Any, steps: int = 2, **more: Any) -> tuple[Simulation, list[Output]]:
    """Return a release under a ramp of pressure, with a mass at the tip and damping."""
    body, bars = BODIES[which]
    rows = np.array([[0.5], [1.0]]) * np.array([bars]) * BAR
    asked = Dynamics(5e-3 * steps, 5e-3, rule=rule, damping=2e-3, output_step=5e-3, release=True, tip_mass=2e-3)
    loads = Loads((0.01, 0.005, 0.008), (5e-5, 0.0, 1e-4), (1.0, 0.0, 9.0))
    pressures = Series(np.array([0.0, 5e-3 * steps]), rows)
    force = Series(np.array([0.0, 0.1]), np.array([[0.0] * 3, [0.02, 0.0, 0.01]]))
    made = Simulation(body, loads, asked, pressures, force, numerics=Numerics(engine=engine), **more)
    return made, list(made.run())


@pytest.mark.parametrize("rule", ["trapezoid", "bdf2"])
@pytest.mark.parametrize("which", BODIES)
def test_three_engines_agree(which: str, rule: Any) -> None:
    """From the pose at rest on: by Newton's method, by IPOPT on the whole program, and the one by the other."""
    body = BODIES[which][0]
    by_newton, by_ipopt, both = (followed(which, rule, engine)[1] for engine in ("newton", "ipopt", "auto"))
    for one, other, third in zip(by_newton, by_ipopt, both, strict=True):
        here = one.instant.at.position
        assert np.allclose(other.instant.at.position, here, rtol=0, atol=1e-9 * body.length)
        assert np.allclose(third.instant.at.position, here, rtol=0, atol=1e-9 * body.length)
        assert one.ipopt is None
        assert other.ipopt is not None
        assert third.ipopt is not None
        assert other.ipopt.status == third.ipopt.status == "Solve_Succeeded"
        assert other.ipopt.iterations >= third.ipopt.iterations
        assert max(other.residual, third.residual) < 1e-9
    assert np.linalg.norm(by_newton[-1].instant.at.position[-1] - by_newton[0].instant.at.position[-1]) > 1e-4


def test_auto_closes_some_steps_of_a_long_run() -> None:
    """The pose at the beginning, the last step, and about twenty between."""
    outputs = followed("one", "trapezoid", "auto", steps=50)[1]
    closed = [k for k, output in enumerate(outputs) if output.ipopt is not None]
    assert closed == [0, *range(3, 50, 3), 50]


def test_what_ipopt_does_not_confirm_is_disputed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step of Newton's method that is off, as if its equations were others: both tips are said."""
    plain = Stepper._by_newton

    def off(self: Stepper, *given: Any) -> Any:
        found = plain(self, *given)
        e = found.instant.e * 1.001
        at = self.rod.placed(found.instant.numbers, e)
        return found._replace(instant=replace(found.instant, e=e, at=at))

    monkeypatch.setattr(Stepper, "_by_newton", off)
    with pytest.raises(Failed, match=r"at t = .*by Newton's method and at .*by IPOPT") as caught:
        followed("one", "trapezoid", "auto")
    assert caught.value.status is Status.DISPUTED
