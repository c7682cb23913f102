"""What a design study is asked: choices, requirements and what is best, as data in SI units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise, product
from math import inf, isfinite, prod
from numbers import Integral
from typing import Any

from softnlp.base import columns
from softnlp.base.columns import Output
from softnlp.base.errors import InputError, nearest
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.robot import ALLOWABLE, DIMENSIONS, MINIMUM_WALL, Robot, is_number
from softnlp.model.rod import Loads

MOST_PRESSURES = 10_000  # of `PressureSteps`
MOST_ENUMERATED = 5000  # combinations above which a search takes the place of enumeration
COUNTS = tuple(d.field for d in DIMENSIONS if d.scale is None)
SIZES = tuple(d.field for d in DIMENSIONS if d.scale is not None)

FORCE = "blocked_force"
_LAYOUT = ("chamber_circle_diameter", "chamber_diameter", "chamber_wall")
_MOVED_BY = {"outer_wall": {"outer_diameter", *_LAYOUT}, "inner_wall": {"lumen_diameter", *_LAYOUT}}


_OF_THE_BODY = ("stretch", "elongation", "tip_x", "tip_y", "tip_z", "tip_deflection", "chamber_gap", "pressure")
OUTPUTS: Mapping[str, Output] = {
    **{name: columns.OUTPUTS[name] for name in ("bending_angle", FORCE, *_OF_THE_BODY)},
    **{output.name: output for output in columns.outputs("robot")},
}
"""By name: `tip_deflection` is the tip's distance from the z axis, `chamber_gap` the smallest one between neighbouring
reinforced chambers under pressure, `outer_wall` and `inner_wall` what is left between their threads and the surface or
the lumen, `wall` is delta_c + delta_r of Eq. (1), for which the chambers are taken to be in the middle."""


@dataclass(frozen=True)
class Range:
    """A continuous choice, chosen by optimisation: lower <= value <= upper.

    Attributes
    ----------
    lower, upper
        Of the quantity chosen [SI].
    """

    lower: float
    upper: float


@dataclass(frozen=True)
class PressureSteps:
    """A pressure that is the lowest multiple of `step` up to `highest` at which every requirement holds.

    Attributes
    ----------
    step, highest
        Gauge pressures [Pa].
    """

    step: float
    highest: float

    def values(self) -> list[float]:
        """Return the pressures in order, `highest` among them only where it is a multiple.

        Returns
        -------
        list
            (levels,) from `step` on [Pa].
        """
        return [k * self.step for k in range(1, int(self.highest / self.step + 1e-9) + 1)]


@dataclass(frozen=True)
class Limits:
    """A requirement: lower <= output <= upper.

    Attributes
    ----------
    lower, upper
        Of the output required [SI].
    """

    lower: float = -inf
    upper: float = inf


def at_least(value: float) -> Limits:
    """Return the requirement that an output be at least a value.

    Parameters
    ----------
    value
        Of the output required [SI].

    Returns
    -------
    Limits
        With this lower end.
    """
    return Limits(lower=value)


def at_most(value: float) -> Limits:
    """Return the requirement that an output be at most a value.

    Parameters
    ----------
    value
        Of the output required [SI].

    Returns
    -------
    Limits
        With this upper end.
    """
    return Limits(upper=value)


@dataclass(frozen=True, eq=False)
class DesignTask:
    """What may be chosen, what is required and what is best.

    Attributes
    ----------
    choices
        By name, a `Range` or a sequence of values (choices,) [SI]. The names are those of the dimensions of
        `softnlp.Robot`,
        "robot" for whole robots and "material" for silicones. Counts and whole things take sequences only.
    pressure
        In each of `sets`, the same [Pa]: a number, a `Range` or `PressureSteps`.
    sets
        Counted from 0; the others are at 0.
    requirements
        `Limits` by name of `OUTPUTS`.
    maximise, minimise
        One of them, a name of `OUTPUTS`.
    allow
        Rules of manufacture that may be broken; "self_intersection" for shapes that pass through themselves.
    minimum_wall
        delta_s, the least wall of Eq. (1) and, see `softnlp.model.rules.rules`, of the outer and of the inner wall
        each, unless `requirements` has a least one of its own [m].
    starts
        First guesses of each optimisation; None is 4, and 2 where one number alone is free.
    trials
        Of the search, where there are more than `MOST_ENUMERATED` combinations.
    """

    choices: Mapping[str, Range | Sequence[Any]]
    pressure: float | Range | PressureSteps
    sets: tuple[int, ...] = (0,)
    requirements: Mapping[str, Limits] = field(default_factory=dict)
    maximise: str | None = None
    minimise: str | None = None
    allow: tuple[str, ...] = ()
    minimum_wall: float = MINIMUM_WALL
    starts: int | None = None
    trials: int = 500

    @property
    def objective(self) -> Output:
        """The output that is maximised or minimised."""
        return OUTPUTS[self.maximise or self.minimise or ""]

    @property
    def sign(self) -> float:
        """1 where the objective is maximised, -1 where it is minimised [1]."""
        return 1.0 if self.maximise else -1.0

    @property
    def needs_force(self) -> bool:
        """Whether the blocked shape has to be solved."""
        return FORCE in (self.objective.name, *self.requirements)

    @property
    def ranges(self) -> dict[str, Range]:
        """The continuous choices of dimensions by name."""
        return {name: values for name, values in self.choices.items() if isinstance(values, Range)}

    @property
    def lists(self) -> dict[str, Sequence[Any]]:
        """The discrete choices by name, each (choices,) [SI]."""
        return {name: values for name, values in self.choices.items() if not isinstance(values, Range)}

    @property
    def walls(self) -> dict[str, bool]:
        """The walls that must leave delta_s, and whether a choice moves each: those without a least one required."""
        asked = {name for name, limits in self.requirements.items() if limits.lower > -inf}
        return {name: not keys.isdisjoint(self.choices) for name, keys in _MOVED_BY.items() if name not in asked}

    @property
    def is_continuous(self) -> bool:
        """Whether anything is left to an optimisation."""
        return bool(self.ranges) or isinstance(self.pressure, Range)

    @property
    def first_guesses(self) -> int:
        """How many first guesses each optimisation has."""
        return self.starts or (4 if len(self.ranges) + isinstance(self.pressure, Range) > 1 else 2)

    def combinations(self) -> Iterator[dict[str, Any]]:
        """Yield every combination of the discrete choices, the last one changing first.

        Returns
        -------
        iterator
            A value by the name of each choice (choices,) [SI].
        """
        for values in product(*self.lists.values()):
            yield dict(zip(self.lists, values, strict=True))

    def step_count(self, pressures: int = 0) -> int:
        """Return how many candidates there are.

        Parameters
        ----------
        pressures
            Steps of the scenario's pressures, which change nothing.

        Returns
        -------
        int
            Combinations, or trials of a search.
        """
        every = prod(len(values) for values in self.lists.values())
        return every if every <= MOST_ENUMERATED else min(self.trials, every)


@dataclass(frozen=True, eq=False)
class Setting:
    """Everything that no choice changes, and what the choices start from.

    Attributes
    ----------
    robot, material, coefficients, conventions, loads, contact, numerics
        As `softnlp.design`.
    """

    robot: Robot
    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION
    loads: Loads = Loads()
    contact: ContactSettings = ContactSettings()
    numerics: Numerics = Numerics()


def with_choices(setting: Setting, combination: Mapping[str, Any]) -> tuple[Robot, Material]:
    """Return the robot and the silicone of a combination; the robot is not checked."""
    base = combination.get("robot", setting.robot)
    changed = {name: value for name, value in combination.items() if name not in ("robot", "material")}
    differs = any(getattr(base, name) != value for name, value in changed.items())
    name = base.name if not differs or base.name.endswith("(modified)") else f"{base.name} (modified)"
    return replace(base, **changed, name=name), combination.get("material", setting.material)


def check_task(task: DesignTask, setting: Setting) -> None:
    """Refuse a task that cannot be meant.

    Raises
    ------
    InputError
        With the key, for the first thing that is not right.
    """
    for key in ("choices", "requirements"):
        if not isinstance(getattr(task, key), Mapping):
            raise InputError("expected a table by name", key=key)
    for name, values in task.choices.items():
        _check_choice(name, values)
    _check_pressure(task.pressure)
    if not task.choices and not isinstance(task.pressure, Range):
        raise InputError("expected something to choose", key="choices")
    if (task.maximise is None) == (task.minimise is None):
        raise InputError("expected one of maximise, minimise", key="objective")
    way = "maximise" if task.maximise else "minimise"
    _known(task.maximise or task.minimise or "", way)
    if task.objective.name == "chamber_gap":
        raise InputError("the gap may be required but not optimised: it is the smallest of several", key=way)
    for name, limits in task.requirements.items():
        _known(name, f"requirements.{name}")
        if not isinstance(limits, Limits) or not _ordered(limits.lower, limits.upper) or limits == Limits():
            raise InputError("expected a least value, a largest one above it, or both", key=f"requirements.{name}")
        if name == "chamber_gap" and limits.upper < inf:
            raise InputError("expected a least value only", key=f"requirements.{name}")
    counts = [*(r.chamber_sets for r in task.lists.get("robot", (setting.robot,))), *task.lists.get("chamber_sets", ())]
    fewest = min(task.lists.get("chamber_sets", counts))
    whole = isinstance(task.sets, Sequence) and all(_is_whole(k) and 0 <= k < fewest for k in task.sets)
    if not task.sets or not whole or len(set(task.sets)) < len(task.sets):
        got = list(task.sets) if isinstance(task.sets, Sequence) else task.sets
        raise InputError(f"expected different sets of 0 to {fewest - 1}, got {got}", key="sets")
    for rule in task.allow:
        if rule not in ALLOWABLE:
            raise InputError(f"expected rules of {', '.join(ALLOWABLE)}, got {rule!r}", key="allow")
    for key, value in (("starts", task.starts), ("trials", task.trials)):
        if value is not None and not (_is_whole(value) and value >= 1):
            raise InputError(f"expected a number of at least 1, got {value}", key=key)
    if setting.conventions.energy and task.is_continuous:
        text = "expected lists of choices: ranges are not searched with conventions energy so far"
        raise InputError(text, key=next(iter(task.ranges), "pressure"))
    if task.needs_force and task.is_continuous and setting.contact.closure == "weighted":
        raise InputError(
            "expected 'free', 'compliant' or 'rigid' where something continuous is chosen by the force: 'weighted' "
            "minimises something of its own",
            key="closure",
        )


def _known(name: str, key: str) -> None:
    if name not in OUTPUTS:
        raise InputError(f"unknown output{nearest(str(name), OUTPUTS)}", key=key)


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _ordered(*values: Any) -> bool:
    """Whether values are numbers, none smaller than the one before."""
    return all(map(is_number, values)) and all(a <= b for a, b in pairwise(values))


def _check_choice(name: str, values: Any) -> None:
    key = f"choices.{name}"
    known = ("material", "robot", *COUNTS, *SIZES)
    if name not in known:
        raise InputError(f"cannot be chosen{nearest(name, known)}", key=key)
    if isinstance(values, Range):
        if name not in SIZES:
            raise InputError("expected a list of values", key=key)
        _check_range(values, key)
        return
    if not isinstance(values, Sequence) or isinstance(values, str) or not values:
        raise InputError("expected a list of values" if name not in SIZES else "expected a list or a range", key=key)
    kinds: dict[str, Any] = {"material": Material, "robot": Robot}
    for value in values:
        if name in kinds:
            right = isinstance(value, kinds[name])
        elif name in COUNTS:
            right = _is_whole(value) and int(value) >= 1
        else:
            right = is_number(value) and isfinite(value) and value > 0
        if not right:
            expected = (
                kinds[name].__name__ if name in kinds else "whole number" if name in COUNTS else "positive number"
            )
            raise InputError(f"expected each value to be a {expected}, got {value!r}", key=key)


def _check_range(values: Range, key: str) -> None:
    low, high = values.lower, values.upper
    if not _ordered(0, low, high) or low == high or high == inf:
        got = f"{low:g} to {high:g}" if is_number(low) and is_number(high) else f"{low!r} to {high!r}"
        raise InputError(f"expected 0 <= from < to, got {got}", key=key)


def _check_pressure(pressure: Any) -> None:
    if isinstance(pressure, Range):
        _check_range(pressure, "pressure")
    elif isinstance(pressure, PressureSteps):
        if not _ordered(0, pressure.step, pressure.highest) or pressure.step == 0 or pressure.highest == inf:
            raise InputError("expected 0 < step <= highest", key="pressure")
        if pressure.highest / pressure.step > MOST_PRESSURES:
            raise InputError(
                f"expected at most {MOST_PRESSURES} steps of pressure, got {pressure.highest / pressure.step:.6g}",
                key="pressure",
            )
    elif not (is_number(pressure) and 0 < pressure < inf):
        raise InputError(f"expected a pressure above 0, a range or steps, got {pressure!r}", key="pressure")
