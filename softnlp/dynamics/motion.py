"""The pose that a run begins at, and one step of time: Newton's method on the balance at all Gauss points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy  # its parts are imported where they are first used
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.dynamics.rod import Acting, Rod, still
from softnlp.dynamics.rules import Balance, Instant, Rule, at_end
from softnlp.dynamics.sections import Failed, Numbers

Array = NDArray[np.float64]

TOLERANCE = 1e-10
"""Largest residual of a step, in EI/L^2 and EI/L."""
_MOST = 12  # corrections of a step
_SLOW = 0.15  # what is left by a correction with an old slope, above which a new one is made
_ROUNDINGS = 8  # that a residual may be made of
_LONGEST = 30  # of a correction, in the units of the residual
_LOAD_STEPS, _FINEST = 4, 2.0**-12  # of the way to a loaded static pose


class Solved(NamedTuple):
    """A solved step. residual : largest, in its units. iterations : corrections."""

    instant: Instant
    balance: Balance
    residual: float
    iterations: int


@dataclass(eq=False)
class Stepper:
    """Solves steps with Newton's method; its slope is kept from step to step while it is good enough."""

    rod: Rod
    tolerance: float = TOLERANCE
    slopes: int = 0

    def __post_init__(self) -> None:
        self._factors: tuple[float, tuple[Array, Array]] | None = None

    def forget(self) -> None:
        """Drop the slope, of other pressures perhaps."""
        self._factors = None

    def step(self, rule: Rule, t: float, guess: Array, numbers: Numbers, acting: Acting) -> Solved:
        """Return the instant at t. Raises `Failed` where Newton's method does not arrive."""
        rod, e = self.rod, guess
        before, fresh = np.inf, False
        enough = max(self.tolerance, _ROUNDINGS * rod.noise(rule.rate))
        for count in range(_MOST + 1):
            at = rod.placed(numbers, e)
            balance = rule.balance(rod, e, at, acting)
            size = float(np.max(np.abs(balance.off)))
            if size <= enough:
                return Solved(Instant(t, e, at, balance.motion), balance, size, count)
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

    def static(self, numbers: Numbers, acting: Acting, e: Array) -> tuple[Instant, float]:
        """Return the pose at rest near e, by Newton's method. Raises `Failed`."""
        rod, parts = self.rod, still(self.rod.size)
        for _ in range(_MOST):
            at = rod.placed(numbers, e)
            off, N, M, _, motion = at_end(rod, e, at, parts, acting)
            size = float(np.max(np.abs(off)))
            if size <= self.tolerance:
                return Instant(0.0, e, at, motion), size
            if not size < _LONGEST:
                break
            e = e - _solved(_factors(rod.slope(at, N, M, 0.0, acting)), off.ravel()).reshape(-1, 6)
        raise Failed(Status.DIVERGED, "no pose at rest was found")

    def pose(self, numbers: Numbers, acting: Acting) -> tuple[Instant, float]:
        """Return the pose at rest under loads, which are applied after the pressure."""
        e, done, part = np.zeros((self.rod.size, 6)), 0.0, 1.0
        if not (np.any(acting.force) or np.any(acting.moment) or np.any(acting.gravity)):
            return self.static(numbers, acting, e)
        last = e
        while done < 1.0:
            to = min(1.0, done + part)
            some = Acting(acting.force * to, acting.moment * to, acting.gravity * to, acting.mass)
            guess = e + (e - last) if done else e
            try:
                found, size = self.static(numbers, some, guess)
                if part > 1 / _LOAD_STEPS and self._jumped(found, e, done):
                    raise Failed(Status.DIVERGED, "")
            except (Failed, np.linalg.LinAlgError):
                part /= 4 if part == 1.0 else 2
                if part < _FINEST:
                    said = f"no pose at rest was found beyond {100 * done:.3g} % of the loads"
                    raise Failed(Status.DIVERGED, said) from None
                continue
            last, e, done = e, found.e, to
        return found, size

    def _jumped(self, found: Instant, e: Array, done: float) -> bool:
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
