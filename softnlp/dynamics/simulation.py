"""A run in time: from its first instant through steps, jumps and outputs to the end, or to where it fails."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import ceil
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import choices, shown
from softnlp.base.status import Status
from softnlp.dynamics.drive import Chambers, Series
from softnlp.dynamics.energy import Energy, Ledger
from softnlp.dynamics.grid import grid_of
from softnlp.dynamics.modes import grows
from softnlp.dynamics.motion import TOLERANCE, Solved, Stepper
from softnlp.dynamics.rod import Acting, Rod, still
from softnlp.dynamics.rules import ERROR, Instant, RuleName, rule
from softnlp.dynamics.sections import Failed, Numbers, Sections
from softnlp.model.body import Body
from softnlp.model.numerics import Numerics
from softnlp.model.rod import Loads
from softnlp.nlp.solver import Ipopt

Array = NDArray[np.float64]

STARTS = Literal["static", "rest"]
_HALVINGS = 8  # of a step that fails
_GROWTH, _SHRINKING = 2.0, 0.2  # of a step that is chosen
_SAFE = 0.9
_FIRST, _FIRST_SWING = 1e-3, 1e-2  # parts of the duration and of the slowest swing, of the first step that is chosen
LONGEST = 1e5  # duration [s]; times of a run are told apart to a billionth of it
_LEAST = 1e-9  # part of the duration below which no step is taken
_ROUND = 1e-9
_KEPT = 6  # times whose sections are kept
_GUESSED = 4  # instants that the next one is guessed from
_CLOSED, _UNHEARD = 20, 1000  # steps closed by IPOPT in a run, about; most steps between two of them, then an output
NEWTON = Numerics(engine="newton")


def require_number(key: str, value: Any, *, above_0: bool = False) -> None:
    """Raise `InputError` with the key for what is not a finite number of at least 0, or above it."""
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not (number and np.isfinite(value) and (value > 0 if above_0 else value >= 0)):
        raise InputError(f"expected a number {'above' if above_0 else 'of at least'} 0, got {shown(value)}", key=key)


@dataclass(frozen=True, eq=False)
class Dynamics:
    """How a run in time is to be made.

    Attributes
    ----------
    duration
        [s].
    step
        The longest step, None to choose it by the estimated error [s].
    rule
        "trapezoid" or "bdf2".
    damping
        Kelvin-Voigt time of all strains [s].
    lag, dead_time
        Between regulator and chambers [s].
    output_step
        Between the instants that are kept [s].
    start
        "static", the pose of the first row, or "rest", straight, without strain, pressure or load.
    release
        Whether the loads at the tip end at t = 0.
    tip_mass
        Beside the silicone's own [kg].
    accuracy
        Of a step that is chosen: largest estimated error of a position in one step, of the length [1].
    """

    duration: float
    step: float | None = None
    rule: RuleName = "trapezoid"
    damping: float = 0.0
    lag: float = 0.0
    dead_time: float = 0.0
    output_step: float = 0.01
    start: STARTS = "static"
    release: bool = False
    tip_mass: float = 0.0
    accuracy: float = 1e-5

    def __post_init__(self) -> None:
        """Refuse what no run can have.

        Raises
        ------
        InputError
            For a number that is not finite or has the wrong sign, a duration too long, and an unknown word.
        """
        positive = {"duration": self.duration, "output_step": self.output_step, "accuracy": self.accuracy}
        if self.step is not None:
            positive["step"] = self.step
        for key, value in positive.items():
            require_number(key, value, above_0=True)
        for key in ("damping", "lag", "dead_time", "tip_mass"):
            require_number(key, getattr(self, key))
        if self.duration > LONGEST:
            raise InputError(f"expected at most {LONGEST:g} s, got {self.duration:g} s", key="duration")
        for key, words in (("rule", get_args(RuleName)), ("start", get_args(STARTS))):
            if getattr(self, key) not in words:
                raise InputError(f"expected {choices(words)}, got {shown(getattr(self, key))}", key=key)

    @property
    def outputs(self) -> Array:
        """The times that are kept, from 0 to the duration (outputs,) [s]."""
        count = ceil(self.duration / self.output_step - 1e-6)
        return np.append(self.output_step * np.arange(count), self.duration)


@dataclass(frozen=True, eq=False)
class Output:
    """An instant that is kept. residual : the largest since the last one. steps, iterations : since the last one.

    ipopt : what IPOPT said since then, its iterations together; None where it took no part.
    """

    instant: Instant
    numbers: Numbers
    acting: Acting
    pressure: Array
    regulator: Array
    energy: Energy
    residual: float
    steps: int
    iterations: int
    ipopt: Ipopt | None


@dataclass
class _Count:
    steps: int = 0
    iterations: int = 0
    residual: float = 0.0
    ipopt: Ipopt | None = None

    def add(self, solved: Solved) -> None:
        self.steps, self.iterations = self.steps + 1, self.iterations + solved.iterations
        self.heard(solved)

    def heard(self, solved: Solved) -> None:
        self.residual = max(self.residual, solved.residual)
        if solved.ipopt is not None:
            before = 0 if self.ipopt is None else self.ipopt.iterations
            self.ipopt = replace(solved.ipopt, iterations=solved.ipopt.iterations + before)


@dataclass(eq=False)
class Simulation:
    """A body driven over time.

    body, loads : as statics take them; of the loads force and moment act at the tip. pressures : at the regulators
    (columns: sets). force : at the tip, beside that of the loads (3 columns) [N]. intervals : to a segment. points :
    Gauss points to one. numerics : whose engine counts, its options and its accuracy; with "auto" IPOPT closes the pose
    that it begins at, and the last step before every so many outputs. kept : times of outputs in place of those asked
    for, from 0 to the duration [s]. refused : steps that were taken again, shorter. recent : the last instants since a
    jump, the last one first.
    """

    body: Body
    loads: Loads
    asked: Dynamics
    pressures: Series
    force: Series
    intervals: int | None = None
    points: int | None = None
    tolerance: float = TOLERANCE
    numerics: Numerics = NEWTON
    kept: Array | None = None
    refused: int = 0
    warnings: list[str] = field(default_factory=list)
    recent: list[Instant] = field(default_factory=list)

    def __post_init__(self) -> None:
        asked, body = self.asked, self.body
        self.grid = grid_of(body, self.intervals, *([self.points] if self.points else []))
        self.rod = Rod(Sections(body, self.grid), self.grid, asked.damping)
        numerics = self.numerics
        self.stepper = Stepper(self.rod, self.tolerance, numerics.engine, numerics.accuracy, numerics.ipopt)
        regulator = self.pressures.delayed(asked.dead_time) if asked.dead_time else self.pressures
        rest = asked.start == "rest"
        first = np.zeros(body.sets) if rest else self.pressures.at(0.0, after=False)
        self.chambers = Chambers(regulator, asked.lag, first)
        self._known: dict[tuple[float, bool], Numbers] = {}

    def acting(self, t: float, *, after: bool = True) -> Acting:
        """Return the loads at a time."""
        gone = self.asked.release and (t > 0 or after)
        scale = 0.0 if gone else 1.0
        force = scale * np.asarray(self.loads.tip_force, float)
        moment = scale * np.asarray(self.loads.tip_moment, float)
        gravity = np.asarray(self.loads.gravity, float)
        return Acting(force + self.force.at(t, after=after), moment, gravity, self.asked.tip_mass)

    @property
    def outputs(self) -> Array:
        """The times that are kept [s]."""
        return self.asked.outputs if self.kept is None else self.kept

    @property
    def shortest(self) -> float:
        """The step that is begun with where steps are chosen, at t = 0 and behind a jump [s]."""
        return min(_FIRST * self.asked.duration, _FIRST_SWING * self.rod.period)

    @property
    def jumps(self) -> Array:
        """The times behind t = 0 at which something jumps [s]."""
        found = np.union1d(self.chambers.jumps, self.force.jumps)
        return found[(found > 0) & (found < self.asked.duration)]

    def landings(self) -> Array:
        """Return the times that steps end at [s]."""
        found = np.union1d(self.outputs, self.jumps)
        if self.asked.step is None:
            kinks = np.union1d(self.chambers.kinks, self.force.times)
            found = np.union1d(found, kinks[(kinks > 0) & (kinks < self.asked.duration)])
        apart = np.append(True, np.diff(found) > _ROUND * self.asked.duration)
        landed: Array = found[apart]
        return landed

    def first(self, count: _Count) -> tuple[Instant, Numbers, float]:
        """Return the first instant with the rates behind t = 0, its sections, the work of a jump; take it down."""
        sections, asked = self.rod.sections, self.asked
        if asked.start == "rest":
            numbers = sections.at(np.zeros(self.body.sets))
            e = np.zeros((self.rod.size, 6))
            begun = Instant(0.0, e, self.rod.placed(numbers, e), still(self.rod.size)[0], numbers)
        else:
            numbers = sections.at(self.chambers.at(0.0, after=False))
            found = self.stepper.pose(numbers, before := self.acting(0.0, after=False))
            begun = found.instant
            count.heard(found)
            if grows(self.rod, begun, before):
                self.warnings.append("the pose at rest that it begins at is not stable: the least push makes it buckle")
        held, numbers = numbers, sections.at(self.chambers.at(0.0))
        if numbers is held:
            return begun, numbers, 0.0
        one, acting = self._behind(begun, numbers), self.acting(0.0)
        after = Ledger(self.rod, one, numbers, acting, 0.0).now.elastic
        return one, numbers, after - Ledger(self.rod, begun, held, acting, 0.0).now.elastic

    def _behind(self, one: Instant, numbers: Numbers) -> Instant:
        """Return an instant with the resultants behind a jump, its shape and speeds as they are."""
        e = self.rod.sections.resultants(numbers, one.at.strains)
        at = self.rod.shape(*self.rod.sections.strains(numbers, e))
        return replace(one, e=e, at=at, numbers=numbers)

    def run(self) -> Iterator[Output]:
        """Yield what is kept, in order. Raises `Failed` where a step cannot be solved, its message with the time."""
        asked = self.asked
        count = _Count()
        one, numbers, jump = self.first(count)
        ledger = self.ledger = Ledger(self.rod, one, numbers, self.acting(0.0), jump)
        outputs, jumps = self.outputs, self.jumps
        yield self._output(one, numbers, ledger, count)
        self.recent = before = [one]
        kept, count, unheard = 1, _Count(), 0
        every = ceil(outputs.size / _CLOSED)
        h = asked.step or min(self.shortest, asked.output_step)
        landings = self.landings()
        for start, end in pairwise(landings):
            here = kept < outputs.size and abs(end - outputs[kept]) <= _ROUND * asked.duration
            close = here and (kept % every == 0 or kept == outputs.size - 1 or unheard + count.steps >= _UNHEARD)
            try:
                before, h = self._across(before, float(start), float(end), h, ledger, count, close)
            except Failed as error:
                raise Failed(error.status, f"at t = {self.recent[0].time:.6g} s: {error.message}") from None
            numbers = self.sections(float(end), after=False)
            if here:
                yield self._output(before[0], numbers, ledger, count)
                unheard = 0 if close else unheard + count.steps
                kept, count = kept + 1, _Count()
            if np.any(np.abs(jumps - end) <= _ROUND * asked.duration):
                after = self.rod.sections.at(self.chambers.at(end))
                behind = self._behind(before[0], after)
                ledger.jump(numbers, after, behind, before[0])
                self.recent = before = [behind]
                if asked.step is None:
                    h = min(h, self.shortest)

    def _across(
        self, before: list[Instant], start: float, end: float, h: float, ledger: Ledger, count: _Count, close: bool
    ) -> tuple[list[Instant], float]:
        """Go from one landing to the next in equal steps of at most h, shorter ones where they fail or err."""
        asked, refusals, at = self.asked, 0, start
        while end - at > _ROUND * asked.duration:
            steps = max(1, ceil((end - at) / h - 1e-6))
            t = end if steps == 1 else at + (end - at) / steps
            try:
                now = self._one(before, t, close=close and steps == 1)
            except (Failed, np.linalg.LinAlgError) as error:
                refusals += 1
                disputed = isinstance(error, Failed) and error.status is Status.DISPUTED
                if disputed or refusals > _HALVINGS:
                    if isinstance(error, Failed):
                        raise
                    raise Failed(Status.DIVERGED, "the equations of a step are singular") from None
                h = (t - at) / 2
                continue
            if asked.step is None and len(before) > 2:  # before, nothing can be said, so the step stays short
                off = self._error(before, now.instant)
                factor = _SAFE * (asked.accuracy / max(off, 1e-300)) ** (1 / 3)
                factor = min(max(factor, _SHRINKING), _GROWTH)
                if off > asked.accuracy and t - at > _LEAST * asked.duration:
                    self.refused += 1
                    h = factor * (t - at)
                    continue
                if factor > 1.3 or factor < 1.0:
                    h = max(factor * (t - at), h if steps == 1 and factor >= 1.0 else 0.0)
            held, loads = self._ends(before[0].time, t)
            ledger.step(rule(asked.rule, before, t, loads[0]), now, held, loads)
            count.add(now)
            before, at = [now.instant, *before[: _GUESSED - 1]], t
            self.recent = before
        return before, (asked.step or h)

    def sections(self, t: float, *, after: bool = True) -> Numbers:
        """Return the sections at a time; those of the last few are kept. Raises `Failed`."""
        key = t, after
        if key not in self._known:
            self._known[key] = self.rod.sections.at(self.chambers.at(t, after=after))
            while len(self._known) > _KEPT:
                del self._known[next(iter(self._known))]
        return self._known[key]

    def _ends(self, a: float, b: float) -> tuple[tuple[Numbers, Numbers], tuple[Acting, Acting]]:
        """Return sections and loads at both ends of a step."""
        return (self.sections(a), self.sections(b, after=False)), (self.acting(a), self.acting(b, after=False))

    def _one(self, before: list[Instant], t: float, *, close: bool) -> Solved:
        """Return the instant at t, begun from what is extrapolated."""
        numbers = self.sections(t, after=False)
        guess = _extrapolated(before, t, [one.e for one in before])
        step = rule(self.asked.rule, before, t, self.acting(before[0].time))
        return self.stepper.step(step, t, guess, numbers, self.acting(t, after=False), close=close)

    def _error(self, before: list[Instant], now: Instant) -> float:
        """Return the estimated error of the positions in a step behind three others, over the length."""
        guess = _extrapolated(before, now.time, [one.at.position for one in before[:3]])
        h = now.time - before[0].time
        spread = np.prod([now.time - one.time for one in before[:3]])
        third = 6 * np.linalg.norm(now.at.position - guess, axis=1).max() / spread
        return float(ERROR[self.asked.rule] * h**3 * third / self.rod.length)

    def _output(self, one: Instant, numbers: Numbers, ledger: Ledger, count: _Count) -> Output:
        t = one.time
        behind = t == 0.0
        return Output(
            instant=one,
            numbers=numbers,
            acting=self.acting(t, after=behind),
            pressure=self.chambers.at(t, after=behind),
            regulator=self.pressures.at(t, after=behind),
            energy=ledger.now,
            residual=count.residual,
            steps=count.steps,
            iterations=count.iterations,
            ipopt=count.ipopt,
        )


def _extrapolated(before: list[Instant], t: float, values: list[Array]) -> Array:
    """Return the polynomial through the last values, as many as are given, at t."""
    times = [one.time for one in before[: len(values)]]
    found = np.zeros_like(values[0])
    for j, a in enumerate(times):
        weight = 1.0
        for k, b in enumerate(times):
            if k != j:
                weight *= (t - b) / (a - b)
        found = found + weight * values[j]
    return found


Progress = Callable[[Output], None]
