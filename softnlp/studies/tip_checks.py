"""Checks of measured tips against the model: the rest tip, clock, order and mirror of the sets, what is left."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from math import inf

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.studies.check import Check
from softnlp.studies.measurements import Data, Observed, column_slice
from softnlp.studies.registered import fitted, sensor_places
from softnlp.studies.registration import Registration, across, turned

Array = NDArray[np.float64]
Tips = Callable[[Array, Loads], tuple[Array, Array]]
"""The model's tips (rows, 3) [m] at pressures (rows, sets) [Pa] and loads, and their rotations by columns (rows, 9)."""

_ANY = (-inf, inf)
_BETTER = 0.5  # of what is left: another order of the sets has to leave less than this
_MOST_SETS = 4
_FEWEST = 6
_MOST_ROWS, _MOST_LOADED = 100, 24  # that are taken for the order of the sets, without loads and with them
_FOLLOWS = 0.02  # of the squared motion: a model that leaves less has the right order
_TURNS = 3  # how often loads across the axis are turned with the clock that they change


def tip_checks(
    data: Data,
    after: Array,
    placed: Registration,
    fit: Sequence[str],
    tips: Tips,
    loads: Loads,
    sigma_given: bool,
) -> tuple[Check, ...]:
    """Return the checks of the tips that were measured of one robot.

    after : (rows, 9) of the model with the constants found, as `COLUMNS`. placed : the registration as it
    was found. fit : what it fitted. tips : of the model at the constants that the search began with. loads : in the
    frame of the base.
    """
    oriented = _orientations(data, after)
    known = np.isfinite(data.values[:, :3]).all(axis=1) & np.isfinite(after[:, :3]).all(axis=1)
    if np.sum(known) < _FEWEST:
        return oriented
    P, seen, model = data.pressure[known], data.values[known, :3], after[known, :3]
    return (
        *oriented,
        _residual(seen, model, data.sigma[known, :3], sigma_given),
        *frame_checks(P, seen, model, data.robot, placed, fit, tips, loads),
    )


def _orientations(data: Data, after: Array) -> tuple[Check, ...]:
    """Return the check of what is left of orientations over their noise."""
    where = column_slice("orientation")
    left = (after[:, where] / data.sigma[:, where])[data.measured[:, where]]
    if left.size < _FEWEST:
        return ()
    likely = (
        "the axes of the sensor are turned on the tip ([registration] tip_sensor_quat_xyzw), or the quaternions have "
        "another order or sense, or their noise in [sigma] is another"
    )
    ratio = float(np.sqrt(np.mean(left**2)))
    return (Check("residual of the orientations over their noise", ratio, (0.0, 3.0), _ANY, likely),)


def frame_checks(
    P: Array,
    seen: Array,
    model: Array,
    robot: Robot,
    placed: Registration,
    fit: Sequence[str],
    tips: Tips,
    loads: Loads,
) -> list[Check]:
    """Return the checks of where tips are.

    P : (rows, sets) [Pa]. seen, model : (rows, 3) where the sensor is [m], measured and by the model. The others are as
    in `tip_checks`.
    """
    if len(P) < _FEWEST or not np.isfinite(model).all():
        return []
    found: list[Check] = []
    here, there = placed.in_base(seen), placed.in_base(model)
    if "frame" not in fit:
        unloaded = np.array([0.0, 0.0, float(robot.length)]) + np.asarray(placed.tip_offset)
        found += _rest(P, here, there, None if loads.act else unloaded, float(robot.length))
    follows = np.sum((model - seen) ** 2) < _FOLLOWS * np.sum((seen - seen.mean(axis=0)) ** 2)
    fit = tuple(name for name in fit if name != "tip_sensor")  # orientations say nothing of the order
    found += _orders(_places(robot, P, seen, loads.act), placed, fit, tips, loads, bool(follows))
    moved = float(np.linalg.norm(np.ptp(here, axis=0))) / MILLIMETRE
    if np.ptp(P) > 1e4:
        likely = "the tip does not move while the pressure does: a wrong sensor, unit or valve"
        found.append(Check("motion of the tip", moved, (1.0, 1e4), _ANY, likely, "mm"))
    return found


def _rest(P: Array, seen: Array, model: Array, unloaded: Array | None, length: float) -> Iterator[Check]:
    """Yield the check of the tip without pressure, by the model's where loads act."""
    rest = np.max(P, axis=1) < 2e3
    if np.any(rest):
        expected, where = (
            (unloaded, "(0, 0, length)") if unloaded is not None else (model[rest].mean(axis=0), "the model's")
        )
        away = float(np.linalg.norm(np.median(seen[rest], axis=0) - expected)) / MILLIMETRE
        likely = (
            f"the tip at rest is not at {where}: the origin is not at the base, or the sensor is not at the tip; "
            '[registration] frame = "fit" or tip_offset_mm = "fit"'
        )
        yield Check(f"rest tip, away from {where}", away, (0.0, 0.02 * length / MILLIMETRE), _ANY, likely, "mm")


def _residual(seen: Array, model: Array, sigma: Array, sigma_given: bool) -> Check:
    """Return the check of what is left against the noise, or against how far the tip moves."""
    left = np.linalg.norm(model - seen, axis=1)
    if sigma_given:
        ratio = float(np.sqrt(np.mean(((model - seen) / sigma) ** 2)))
        likely = "the model or its frame does not follow the tips, or [sigma] is another"
        return Check("residual of the tips over their noise", ratio, (0.3, 3.0), _ANY, likely)
    size = float(np.sqrt(np.mean(np.sum((seen - seen.mean(axis=0)) ** 2, axis=1))))
    likely = "the model or its frame does not follow the tips; see the checks of clock, order and rest tip"
    return Check(
        "residual of the tips over their motion", float(np.sqrt(np.mean(left**2))) / size, (0, 0.2), _ANY, likely
    )


@dataclass(frozen=True)
class _Order:
    """An order of the sets: what it leaves, the clock that it needs beyond the given one, and the error of that."""

    squares: float
    turn: float
    error: float
    order: tuple[int, ...]


def _orders(
    o: Observed, placed: Registration, fit: Sequence[str], tips: Tips, loads: Loads, settled: bool
) -> Iterator[Check]:
    """Yield the check of the clock, and of the order of the sets where another one does far better.

    All by the constants that the search began with: those that were fitted to another order are not to be trusted.
    settled : whether no other order is to be tried.
    """
    framed, sets = "frame" not in fit, o.pressure.shape[1]
    given = tuple(range(sets))
    as_given = _left(o, given, placed, fit, tips, loads, turns=False)
    with_turn = _left(o, given, placed, fit, tips, loads) if framed else as_given
    if as_given is None or with_turn is None:
        return
    found = [as_given, with_turn]
    for order in permutations(given) if 2 <= sets <= _MOST_SETS and not settled else ():
        if order != given:
            each = [_left(o, order, placed, fit, tips, loads, turns=turns) for turns in {framed, False}]
            found += [one for one in each if one is not None]
    least = min(one.squares for one in found)
    best = min((one for one in found if one.squares <= 2 * least), key=lambda one: (one.turn != 0, one.squares))
    sets_of = [placed.set_order[k] if placed.set_order else int(k) + 1 for k in np.argsort(best.order)]
    if best.squares < _BETTER * with_turn.squares:
        clock = f" with clock_deg = {(placed.clock + best.turn) / DEGREE:.1f}" if best.turn else ""
        mirror = ", the mirror image of the sets" if _is_mirror(best.order) else ""
        likely = f"looks like set_order = {sets_of} in [registration]{clock}{mirror}"
        share = best.squares / as_given.squares
        yield Check("order of the sets: what another one leaves", share, (_BETTER, inf), _ANY, likely)
    elif framed and "clock" not in fit and with_turn.squares <= _BETTER * as_given.squares:
        # a turn that explains too little is not what is wrong
        limit = max(2.0, 4 * with_turn.error / DEGREE)
        clock = f"{(placed.clock + with_turn.turn) / DEGREE:.1f}"
        likely = f'the sets are turned about the base\'s axis; [registration] clock_deg = {clock}, or "fit"'
        if best.order != given:
            likely += f"; or they stand in another order, set_order = {sets_of}, which leaves as little"
        yield Check("clock of the sets", with_turn.turn / DEGREE, (-limit, limit), _ANY, likely, "deg")


def _places(robot: Robot, P: Array, seen: Array, loaded: bool) -> Observed:
    """Return some rows of places that were measured, without orientations."""
    rows = np.linspace(0, len(P) - 1, min(len(P), _MOST_LOADED if loaded else _MOST_ROWS)).round().astype(int)
    return Observed(robot, "", P[rows], seen[rows], np.zeros((len(rows), 9)), np.full(len(rows), np.nan))


def _left(
    o: Observed,
    order: tuple[int, ...],
    placed: Registration,
    fit: Sequence[str],
    tips: Tips,
    loads: Loads,
    turns: bool = True,
) -> _Order | None:
    """Return what the model in an order of the sets leaves, with what is fitted and, where it turns, the clock."""
    asked = replace(placed, fit=(*fit, "clock") if turns and "clock" not in fit else tuple(fit))
    clock = placed.clock
    for _ in range(_TURNS if across(loads) and "clock" in asked.fit else 1):
        model, rotations = tips(o.pressure[:, list(order)], turned(loads, -clock))
        if not np.isfinite(model).all():
            return None
        if turns:  # half a turn away no small one does better
            (x, y), (u, v) = model[:, :2].T, placed.in_base(o.values)[:, :2].T
            asked = replace(asked, clock=placed.clock + float(np.arctan2(x @ v - y @ u, x @ u + y @ v)))
        found = fitted(asked, model, rotations, o)
        clock = found.clock
    left = float(np.sum((sensor_places(found, model, rotations) - o.values) ** 2))
    spread = np.sqrt(left / max(1, o.values.size - len(asked.names)))
    size = np.linalg.norm(model[:, :2])
    turn = (clock - placed.clock + np.pi) % (2 * np.pi) - np.pi
    return _Order(left, float(turn) if turns else 0.0, float(spread / max(size, 1e-12)), order)


def _is_mirror(order: Sequence[int]) -> bool:
    """Whether an order runs round the other way."""
    n = len(order)
    steps = {(order[(k + 1) % n] - order[k]) % n for k in range(n)}
    return n > 2 and steps == {n - 1}
