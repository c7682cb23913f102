"""The pose that a run begins at, and one step of time: Newton's method on the balance at all Gauss points, and IPOPT.

Engines are those of `softnlp.model.numerics`: with "ipopt" every solve is one of IPOPT on the whole program, with
"auto" IPOPT closes what Newton's method found where it is asked to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts are imported where they are first used
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import MILLIMETRE
from softnlp.dynamics.program import StepProgram
from softnlp.dynamics.rod import Acting, Placed, Rod, still
from softnlp.dynamics.rules import Balance, Instant, Rule, Trapezoid, at_end
from softnlp.dynamics.sections import Failed, Numbers
from softnlp.model.numerics import EngineName
from softnlp.nlp.solver import Engine, Ipopt

Array = NDArray[np.float64]

TOLERANCE = 1e-10
"""Largest residual of a step, in EI/L^2 and EI/L."""
_MOST = 12  # corrections of a step
_SLOW = 0.15  # what is left by a correction with an old slope, above which a new one is made
_ROUNDINGS = 8  # that a residual may be made of
_MOST_ROUNDING = 1e-6  # residual that counts as none at most
_LONGEST = 30  # of a correction, in the units of the residual
_MOST_IPOPT = 60  # iterations of a step
_LOAD_STEPS, _FINEST = 4, 2.0**-12  # of the way to a loaded static pose


class Solved(NamedTuple):
    """A solved step. residual : largest, in its units. iterations : corrections. ipopt : what it said, if asked."""

    instant: Instant
    balance: Balance
    residual: float
    iterations: int
    ipopt: Ipopt | None = None


@dataclass(eq=False)
class Stepper:
    """Solves steps with Newton's method; its slope is kept from step to step while it is good enough.

    engine, accuracy, options : as of `Numerics`; accuracy is by how much of the length IPOPT may move a tip.
    """

    rod: Rod
    tolerance: float = TOLERANCE
    engine: EngineName = "newton"
    accuracy: float = 1e-6
    options: Mapping[str, Any] | Sequence[tuple[str, Any]] = ()
    slopes: int = 0

    def __post_init__(self) -> None:
        self._factors: tuple[float, tuple[Array, Array]] | None = None
        self._programs: dict[bool, tuple[StepProgram, Engine]] = {}

    def forget(self) -> None:
        """Drop the slope, of other pressures perhaps."""
        self._factors = None

    def step(
        self, rule: Rule, t: float, guess: Array, numbers: Numbers, acting: Acting, *, close: bool = False
    ) -> Solved:
        """Return the instant at t. close : whether IPOPT has the last word with the engine "auto".

        Raises `Failed` where the engine does not arrive, or IPOPT does not confirm.
        """
        if self.engine == "ipopt":
            return self._by_ipopt(rule, t, guess, numbers, acting)
        found = self._by_newton(rule, t, guess, numbers, acting)
        return self._closed(rule, found, acting) if close and self.engine == "auto" else found

    def _closed(self, rule: Rule | None, found: Solved, acting: Acting) -> Solved:
        """Return IPOPT's solution from that of Newton's method."""
        now = found.instant
        try:
            closed = self._by_ipopt(rule, now.time, now.e, now.numbers, acting)
        except Failed as failure:
            raise Failed(Status.DISPUTED, failure.message) from None
        here, there = (one.at.position[-1] for one in (now, closed.instant))
        if not np.linalg.norm(there - here) <= self.accuracy * self.rod.length:
            tips = [", ".join(f"{v / MILLIMETRE:.6g}" for v in tip) for tip in (here, there)]
            raise Failed(
                Status.DISPUTED, f"the tip is at ({tips[0]}) mm by Newton's method and at ({tips[1]}) mm by IPOPT"
            )
        return closed._replace(iterations=found.iterations)

    def _by_ipopt(self, rule: Rule | None, t: float, guess: Array, numbers: Numbers, acting: Acting) -> Solved:
        """Return the instant at t, or the pose at rest, by IPOPT on the whole program. Raises `Failed`."""
        rod, trapezoid = self.rod, isinstance(rule, Trapezoid)
        if trapezoid not in self._programs:
            made = StepProgram(rod, trapezoid)
            engine = Engine(
                made.problem,
                ipopt_only=True,
                max_iterations=_MOST_IPOPT,
                tolerance=self.tolerance / 4,  # a step of the trapezoid counts twice
                options=self.options,
            )
            self._programs[trapezoid] = made, engine
        program, engine = self._programs[trapezoid]

        def balanced(e: Array) -> tuple[Placed, Balance]:
            at = rod.placed(numbers, e)
            if rule is None:
                return at, at_end(rod, e, at, still(rod.size), acting)
            return at, rule.balance(rod, e, at, numbers, acting)

        start = program.start(rule, guess, *balanced(guess), acting)
        found = engine.solve(program.values(rule, numbers, acting), start)
        e = program.resultants(found.x)
        at, balance = balanced(e)
        size = float(np.max(np.abs(balance.off)))
        if not size <= self._enough(0.0 if rule is None else rule.rate):
            raise Failed(Status.DIVERGED, f"IPOPT left a residual of {size:.2g} ({found.engine_status})")
        return Solved(Instant(t, e, at, balance.motion, numbers), balance, size, found.iterations, found.ipopt)

    def _enough(self, rate: float) -> float:
        """Return the residual that counts as none at a rate of the steps.

        Raises `Failed` where rounding alone leaves more than an answer may have.
        """
        rounding = _ROUNDINGS * self.rod.noise(rate)
        if not rounding <= _MOST_ROUNDING:
            words = f"rounding leaves a residual of {rounding:.2g}: the step is too short or the damping too large"
            raise Failed(Status.DIVERGED, words)
        return max(self.tolerance, rounding)

    def _by_newton(self, rule: Rule, t: float, guess: Array, numbers: Numbers, acting: Acting) -> Solved:
        rod, e = self.rod, guess
        before, fresh = np.inf, False
        enough = self._enough(rule.rate)
        for count in range(_MOST + 1):
            at = rod.placed(numbers, e)
            balance = rule.balance(rod, e, at, numbers, acting)
            size = float(np.max(np.abs(balance.off)))
            if size <= enough:
                return Solved(Instant(t, e, at, balance.motion, numbers), balance, size, count)
            if not size < 1e6 or count == _MOST:
                break
            known = self._factors is not None and self._factors[0] == rule.rate
            if not known or (size > _SLOW * before and not fresh):
                slope = rod.slope(at, balance.N, balance.M, rule.rate, acting)
                self._factors = rule.rate, _factors(slope)
                self.slopes += 1
                fresh = True
            else:
                fresh = False
            assert self._factors is not None
            change = _solved(self._factors[1], balance.off.ravel()).reshape(-1, 6)
            e = e - change
            before = size
        self.forget()
        raise Failed(Status.DIVERGED, f"Newton's method left a residual of {size:.2g}")

    def static(self, numbers: Numbers, acting: Acting, e: Array) -> Solved:
        """Return the pose at rest near e. Raises `Failed`."""
        if self.engine == "ipopt":
            return self._by_ipopt(None, 0.0, e, numbers, acting)
        rod, parts = self.rod, still(self.rod.size)
        for count in range(_MOST):
            at = rod.placed(numbers, e)
            balance = at_end(rod, e, at, parts, acting)
            off, N, M, _, motion = balance
            size = float(np.max(np.abs(off)))
            if size <= self.tolerance:
                return Solved(Instant(0.0, e, at, motion, numbers), balance, size, count)
            if not size < _LONGEST:
                break
            e = e - _solved(_factors(rod.slope(at, N, M, 0.0, acting)), off.ravel()).reshape(-1, 6)
        raise Failed(Status.DIVERGED, "no pose at rest was found")

    def pose(self, numbers: Numbers, acting: Acting) -> Solved:
        """Return the pose at rest under loads, which are applied after the pressure. Raises `Failed`."""
        found = self._loaded(numbers, acting)
        return self._closed(None, found, acting) if self.engine == "auto" else found

    def _loaded(self, numbers: Numbers, acting: Acting) -> Solved:
        e, done, part = np.zeros((self.rod.size, 6)), 0.0, 1.0
        if not (np.any(acting.force) or np.any(acting.moment) or np.any(acting.gravity)):
            return self.static(numbers, acting, e)
        last = e
        while done < 1.0:
            to = min(1.0, done + part)
            some = Acting(acting.force * to, acting.moment * to, acting.gravity * to, acting.mass)
            guess = e + (e - last) if done else e
            try:
                found = self.static(numbers, some, guess)
                if part > 1 / _LOAD_STEPS and self._jumped(found.instant, e):
                    raise Failed(Status.DIVERGED, "")
            except (Failed, np.linalg.LinAlgError):
                part /= 4 if part == 1.0 else 2
                if part < _FINEST:
                    said = f"no pose at rest was found beyond {100 * done:.3g} % of the loads"
                    raise Failed(Status.DIVERGED, said) from None
                continue
            last, e, done = e, found.instant.e, to
        return found

    def _jumped(self, found: Instant, e: Array) -> bool:
        """Whether a step at once went further than one that can be trusted to stay on its branch."""
        return bool(np.max(np.abs(found.e - e) / self.rod.units) > 1.0)


def _factors(slope: Array) -> tuple[Array, Array]:
    lu, pivots, info = scipy.linalg.lapack.dgetrf(slope)
    if info or not np.isfinite(lu).all():
        raise Failed(Status.DIVERGED, "the equations of a step are singular")
    return lu, pivots


def _solved(factors: tuple[Array, Array], b: Array) -> Array:
    found: Array = scipy.linalg.lapack.dgetrs(*factors, b)[0]
    return found
