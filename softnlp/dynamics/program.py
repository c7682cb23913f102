"""A step of time, or the pose at rest, as a square nonlinear program with every state as an unknown, for IPOPT.

Unknown are the quaternion q, the position p, the force N and the costate x of q at every node and Gauss point, and the
elastic resultants e at the Gauss points; the last instants are quantities of the case. It is the same discretisation as
that of Newton's method in `softnlp.dynamics.rules`, whose unknowns are the resultants alone, written again with
symbols: the costate carries to the base what moments ask of the curvatures.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity, quantity
from softnlp.dynamics.rod import Acting, Placed, Rod, rotated
from softnlp.dynamics.rules import STILL, Backward, Balance, Rule, Trapezoid
from softnlp.dynamics.sections import Numbers
from softnlp.nlp.case import Equation
from softnlp.nlp.problem import CompiledProblem, compile_problem

Array = NDArray[np.float64]

_STATES = {"q": 4, "p": 3, "N": 3, "x": 4}
_E3 = ca.DM([0, 0, 1])


@dataclass(frozen=True, eq=False)
class StepCase:
    """The case of a step, see `softnlp.nlp.case.Case`."""

    symbols: tuple[ca.MX, ...]
    residuals: ca.MX
    equations: tuple[Equation, ...]
    length_unit: ca.MX
    force_unit: ca.MX
    name: str = "step"
    once_differentiable: bool = False

    @property
    def constants(self) -> ca.MX:
        """None."""
        return ca.MX(0, 1)

    @property
    def column(self) -> ca.MX:
        """None: a step is begun from another step."""
        return ca.MX(0, 1)

    @property
    def outputs(self) -> dict[str, ca.MX]:
        """None: the shape is made of the resultants again."""
        return {}

    @property
    def fine_residuals(self) -> ca.MX:
        """The same: a step of time has no finer one."""
        return self.residuals

    @cached_property
    def slope(self) -> ca.MX:
        """Their Jacobian by the unknowns."""
        return ca.jacobian(self.residuals, ca.vertcat(*self.symbols))


def _times(a: Any, b: Any) -> Any:
    """Return the product of quaternions."""
    return ca.vertcat(a[0] * b[0] - ca.dot(a[1:], b[1:]), a[0] * b[1:] + b[0] * a[1:] + ca.cross(a[1:], b[1:]))


def _conjugate(q: Any) -> Any:
    return ca.vertcat(q[0], -q[1:])


def _rotation(q: Any) -> Any:
    """Return the rotation of a quaternion of any length."""
    w, v = q[0], q[1:]
    turned = (w * w - ca.dot(v, v)) * ca.SX.eye(3) + 2 * v @ v.T + 2 * w * ca.skew(v)
    return turned / ca.dot(q, q)


def _turned(before: Any, after: Any) -> Any:
    """Return Cayley's vector of the rotation from one quaternion to another, body frame."""
    q = _times(_conjugate(before), after)
    return 2 * q[1:] / q[0]


def _costate(work: Any, before: Any, after: Any) -> Any:
    """Return what a moment on the turn between two quaternions is for the quaternion."""
    return _times(ca.vertcat(0, 2 / ca.dot(before, after) * work), (before + after) / 2)


class StepProgram:
    """The program of steps of one rule on a rod. trapezoid : else a backward rule, or the pose at rest."""

    def __init__(self, rod: Rod, trapezoid: bool) -> None:
        self.rod, self.trapezoid = rod, trapezoid
        n, grid = rod.size, rod.grid
        self.K = grid.of_interval.size
        sizes = {"v0": 3, "a0": 3, "s0": 6, "q1": 4}
        sizes |= {"w0": 3, "t0": 3, "slope": 3, "V": 6, "e0": 6} if trapezoid else {"q2": 4, "b0": 3}
        self._sizes = sizes
        per_tip = {"tip_v0": 3, "tip_a0": 3, "tip_q1": 4}
        if grid.joints.size:
            per_tip |= {"joint_q1": 4 * grid.joints.size, "joint_offset": 3 * grid.joints.size}
        shapes = {name: size * n for name, size in sizes.items()} | per_tip
        shapes |= {"rates": 4, "force": 3, "moment": 3, "gravity": 3, "mass": 1, "same": 1}
        for k, own in enumerate(rod.sections.stations):
            if own.strains is None:
                shapes |= {f"rest_{k}": 6 * own.rows.size, f"compliance_{k}": 36 * own.rows.size}
            else:
                shapes |= {f"given_{k}": own.strains.numel_in(0) * own.rows.size, f"stretch_{k}": own.rows.size}
        self.given: tuple[Quantity, ...] = tuple(quantity(name, "", [0.0] * size) for name, size in shapes.items())
        self._symbols = {q.name: q.symbol for q in self.given}

    @cached_property
    def problem(self) -> CompiledProblem:
        """The program, compiled."""
        return compile_problem(self.given, [self._case()])

    def _of(self, name: str, rows: int) -> ca.MX:
        return ca.reshape(self._symbols[name], rows, -1)

    def _strains(self, e: ca.MX) -> ca.MX:
        """Return strains (6, n) of resultants (6, n), in the base's axes."""
        sections, parts = self.rod.sections, []
        for k, own in enumerate(sections.stations):
            mine, m = e[:, own.rows[0] : own.rows[-1] + 1], own.rows.size
            if own.strains is None:
                rest, C = self._of(f"rest_{k}", 6), ca.horzsplit(self._of(f"compliance_{k}", 6), 6)
                bent = [C[j].T @ mine[:, j] for j in range(m)]
                parts.append(rest + ca.horzcat(*bent))
                continue
            both = ca.diagcat(ca.DM(sections.axes[k]), ca.DM(sections.axes[k]))
            given, stretch = self._of(f"given_{k}", own.strains.size1_in(0)), self._of(f"stretch_{k}", 1)
            parts.append(both @ own.strains.map(m)(given, stretch, both.T @ mine)[0])
        return ca.horzcat(*parts)

    def _point(self) -> ca.Function:
        """Return what one Gauss point gives: rates of q, p, what N and the costate gain towards the tip, what is off.

        inputs : the states, strains and mean resultants; the section's mass, inertia and damping; histories; rates
        (of velocity, of acceleration, weights of the spin) and gravity.
        """
        e, q, p, N, x = (ca.SX.sym(name, size) for name, size in (("e", 6), *_STATES.items()))
        strains, mean, mass, J = ca.SX.sym("s", 6), ca.SX.sym("m", 6), ca.SX.sym("mass"), ca.SX.sym("J", 3)
        D = ca.SX.sym("D", 6, 6)
        h = {name: ca.SX.sym(name, size) for name, size in self._sizes.items()}
        rates, gravity = ca.SX.sym("rates", 4), ca.SX.sym("gravity", 3)
        R, R1 = _rotation(q), _rotation(h["q1"])
        slope, U = R @ strains[:3], strains[3:]
        force = mass * (rates[1] * (rates[0] * p + h["v0"]) + h["a0"] - gravity)
        stress = mean + D @ (rates[1] * strains + h["s0"])
        spin = rates[2] * _turned(h["q1"], q)
        if self.trapezoid:
            spin += h["w0"]
            turning = rates[1] * R @ (J * spin) - h["t0"]
            before, held, curved, pulled = h["q1"], (slope + h["slope"]) / 2, (U + h["V"][3:]) / 2, (R + R1) / 2
        else:
            spin += rates[3] * _turned(h["q2"], q)
            turning = R @ (J * (rates[1] * spin + h["b0"]) + ca.cross(spin, J * spin))
            before, held, curved, pulled = q, slope, U, R
        there = _costate(ca.cross(held, N) - turning, before, q) - _times(x, ca.vertcat(0, curved)) / 2
        asked = _times(_conjugate((before + q) / 2), x)[1:] / 2
        off = ca.vertcat(R.T @ (pulled @ stress[:3] - N), stress[3:] - asked)
        inputs = [e, q, p, N, x, strains, mean, mass, J, D, *h.values(), rates, gravity]
        return ca.Function("point", inputs, [_times(q, ca.vertcat(0, U)) / 2, slope, force, there, off])

    def _case(self) -> StepCase:
        rod, grid, symbols, K = self.rod, self.rod.grid, self._symbols, self.K
        n, d = rod.size, grid.points
        units = {"q": 1.0, "p": rod.length, "N": rod.units[0], "x": rod.units[3]}
        e = ca.MX.sym("e", 6 * n)
        nodes = {name: ca.MX.sym(f"{name}_nodes", size * (K + 1)) for name, size in _STATES.items()}
        points = {name: ca.MX.sym(f"{name}_points", size * n) for name, size in _STATES.items()}
        at = {name: units[name] * ca.reshape(symbol, -1, n) for name, symbol in points.items()}
        end = {name: ca.horzsplit(units[name] * ca.reshape(symbol, -1, K + 1)) for name, symbol in nodes.items()}
        resultants = ca.reshape(e, 6, n) * ca.DM(np.tile(rod.units[:, None], (1, n)))
        strains = self._strains(resultants)
        mean = self._mean(resultants, strains) if self.trapezoid else resultants
        rates, gravity, mass = symbols["rates"], symbols["gravity"], symbols["mass"]
        dampings = ca.DM(np.hstack(list(np.broadcast_to(rod.viscosity, (n, 6, 6)))))
        own = [ca.DM(rod.mass[None]), ca.DM(rod.inertia.T), dampings]
        histories = [self._of(name, size) for name, size in self._sizes.items()]
        r, slope, f, there, off = self._point().map(n)(
            resultants, *(at[name] for name in _STATES), strains, mean, *own, *histories,
            ca.repmat(rates, 1, n), ca.repmat(gravity, 1, n),
        )  # fmt: skip
        rows: dict[str, list[ca.MX]] = {name: [] for name in _STATES}
        rows["q"].append(end["q"][0] - ca.DM([1, 0, 0, 0]))
        rows["p"].append(end["p"][0])
        to_point, to_end = rod.P, rod.w
        joints = {int(k): j for j, k in enumerate(grid.joints)}
        # behind a node, where a connector may follow it
        offsets, passed = dict[int, ca.MX](), dict[int, ca.MX]()
        for k, j in joints.items():
            offsets[k], passed[k] = self._connector(j, end["q"][k], end["N"][k])
        for i in range(K):
            mine = slice(i * d, (i + 1) * d)
            A, b, B = ca.DM(to_point[mine, mine].T), ca.DM(to_end[mine]), ca.DM(rod.B[mine, mine].T)
            first = {"q": end["q"][i], "p": end["p"][i] + offsets.get(i, 0)}
            last = {"N": end["N"][i + 1], "x": end["x"][i + 1] + passed.get(i + 1, 0)}
            for name, rate in (("q", r), ("p", slope)):
                rows[name].append(at[name][:, mine] - ca.repmat(first[name], 1, d) - rate[:, mine] @ A)
                rows[name].append(end[name][i + 1] - first[name] - rate[:, mine] @ b)
            for name, rate in (("N", -f), ("x", there)):
                rows[name].append(at[name][:, mine] - ca.repmat(last[name], 1, d) - rate[:, mine] @ B)
                rows[name].append(end[name][i] - last[name] - rate[:, mine] @ b)
        tip = end["p"][K] + offsets.get(K, 0)
        a = rates[1] * (rates[0] * tip + symbols["tip_v0"]) + symbols["tip_a0"]
        rows["N"].append(end["N"][K] - symbols["force"] + mass * (a - gravity))
        before = symbols["tip_q1"] if self.trapezoid else end["q"][K]
        work, q0, q1 = ca.SX.sym("w", 3), ca.SX.sym("a", 4), ca.SX.sym("b", 4)
        pair = ca.Function("pair", [work, q0, q1], [_costate(work, q0, q1)])
        rows["x"].append(end["x"][K] - pair(symbols["moment"], before, end["q"][K]))
        off = off / ca.DM(np.tile(rod.units[:, None], (1, n)))
        groups = [(name, ca.vertcat(*map(ca.vec, group)) / units[name]) for name, group in rows.items()]
        groups.append(("balance of the resultants", ca.vec(off)))
        names = {"q": "rotation along the rod", "p": "position along the rod", "N": "force along the rod"}
        equations, start = [], 0
        for name, group in groups:
            size = group.numel()
            said = names.get(name, "moment along the rod" if name == "x" else name)
            equations.append(Equation(said, np.arange(start, start + size), "", ca.MX(units.get(name, 1.0))))
            start += size
        every = (e, *nodes.values(), *points.values())
        force, length = ca.MX(float(rod.units[0])), ca.MX(rod.length)
        return StepCase(every, ca.vertcat(*(g for _, g in groups)), tuple(equations), length, force)

    def _connector(self, j: int, q: ca.MX, N: ca.MX) -> tuple[ca.MX, ca.MX]:
        """Return the offset of a connector, and what the force on its far end is for the costate."""
        length = float(self.rod.grid.connectors[j])
        a, b, F, was = ca.SX.sym("a", 4), ca.SX.sym("b", 4), ca.SX.sym("F", 3), ca.SX.sym("was", 3)
        offset = length * _rotation(b) @ _E3
        work = ca.cross((offset + was) / 2, F)
        both = ca.Function("connector", [a, b, F, was], [offset, _costate(work, a, b)])
        if not self.trapezoid:
            free = ca.Function("free", [b, F], [offset, _costate(ca.cross(offset, F), b, b)])
            return tuple(free(q, N))  # type: ignore[return-value]
        before = self._of("joint_q1", 4)[:, j]
        return tuple(both(before, q, N, self._of("joint_offset", 3)[:, j]))  # type: ignore[return-value]

    def _mean(self, e: ca.MX, strains: ca.MX) -> ca.MX:
        """Return the mean resultants of a step, as `Trapezoid.mean`."""
        before = self._of("e0", 6)
        mean, more = (e + before) / 2, e - before
        if self.rod.sections.linear:
            return mean
        was = self._of("V", 6)
        defect = ca.sum1(((strains + was) / 2 - self._strains(mean)) * more)
        work = ca.sum1(more * (strains - was)) + STILL * self.rod.units[0]
        found: ca.MX = mean + self._symbols["same"] * ca.repmat(2 / 3 * defect / work, 6, 1) * more
        return found

    def values(self, rule: Rule | None, numbers: Numbers, acting: Acting) -> Array:
        """Return the quantities of a step, or of the pose at rest where there is no rule."""
        rod, n = self.rod, self.rod.size
        mean = acting if rule is None else rule.acting(acting)
        given: dict[str, Any] = {name: getattr(mean, name) for name in ("gravity", "mass", "force", "moment")}
        for k, own in enumerate(rod.sections.stations):
            if own.strains is None:
                # C is transposed in a row of columns
                given |= {f"rest_{k}": numbers.rest[own.rows], f"compliance_{k}": numbers.compliance[own.rows]}
            else:
                given |= {f"given_{k}": numbers.own[2 * k], f"stretch_{k}": numbers.own[2 * k + 1]}
        if isinstance(rule, Trapezoid):
            last, was, c = rule.last, rule.last.at, rule.rate
            velocity = last.motion.velocity
            v0, a0 = -c * was.position - velocity, -c / 2 * velocity
            given |= {"s0": -c / 2 * was.strains, "w0": -last.motion.spin, "V": was.strains, "e0": last.e}
            given |= {"t0": c / 2 * rotated(was.rotation, rod.inertia * last.motion.spin), "slope": was.slope}
            given |= {"rates": [c, c / 2, c, 0.0], "same": float(np.array_equal(last.numbers.rest, numbers.rest))}
            befores = [was]
        elif isinstance(rule, Backward):
            c, weights = rule.rate, [*rule.weights, 0.0][:2]
            instants = [rule.before[0], rule.before[min(1, len(rule.before) - 1)]]
            pairs = list(zip(weights, instants, strict=True))
            v0, a0 = np.zeros((n + 1, 3)), np.zeros((n + 1, 3))
            for w, one in pairs:
                v0, a0 = v0 + w * one.at.position, a0 + w * one.motion.velocity
            given["s0"] = sum(w * one.at.strains for w, one in pairs)
            given["b0"] = sum(w * one.motion.spin for w, one in pairs)
            given["rates"] = [c, c, -weights[0], -weights[1]]
            befores = [one.at for one in instants]
        else:
            v0 = a0 = np.zeros((n + 1, 3))
            befores = []
            given["q1"] = given["q2"] = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
            given["tip_q1"] = [1.0, 0.0, 0.0, 0.0]
        given |= {"v0": v0[:n], "a0": a0[:n], "tip_v0": v0[n], "tip_a0": a0[n]}
        for k, at in enumerate(befores, start=1):
            given[f"q{k}"] = at.collocated[:n]
            if k == 1:
                given["tip_q1"] = at.collocated[n]
                if rod.grid.joints.size:
                    given |= {"joint_q1": at.collocated[n + 1 :], "joint_offset": at.offsets}
        return self.problem.pack({name: np.ravel(value) for name, value in given.items()})

    def start(self, rule: Rule | None, e: Array, at: Placed, balance: Balance, acting: Acting) -> Array:
        """Return the unknowns at resultants: their shape, and what is asked for there."""
        rod, was = self.rod, rule.last.at if isinstance(rule, Trapezoid) else at
        mean = acting if rule is None else rule.acting(acting)
        f, N_tip = rod.pulled(balance.inertia, mean)
        work = rod.work(was, at, balance.N, balance.inertia, mean)
        x, x_nodes = rod.costates(was, at, work)

        def reached(rate: Array) -> Array:
            """Return the integrals of a rate from the base to the ends of the intervals."""
            parts = (rod.w[:, None] * rate).reshape(self.K, -1, rate.shape[1]).sum(axis=1)
            return np.vstack([np.zeros(rate.shape[1]), np.cumsum(parts, axis=0)])

        q, p, N = reached(at.turn_rate), reached(at.slope), reached(f)
        q[:, 0] += 1.0
        for joint, offset in zip(rod.grid.joints, at.offsets, strict=True):
            p[joint + 1 :] += offset
        n, L, (force, moment) = rod.size, rod.length, rod.units[[0, 3]]
        nodes = q, p / L, (N_tip - N[-1] + N) / force, x_nodes / moment
        points = at.collocated[:n], at.position[:n] / L, balance.N / force, x / moment
        return np.concatenate([np.ravel(e / rod.units), *map(np.ravel, nodes), *map(np.ravel, points)])

    def resultants(self, x: Array) -> Array:
        """Return the resultants (n, 6) of the unknowns."""
        found: Array = x[: 6 * self.rod.size].reshape(-1, 6) * self.rod.units
        return found
