"""Checks of measured tips against the model: the rest tip, clock, order and mirror of the sets, what is left."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import permutations
from math import inf

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.model.robot import Robot
from softnlp.studies.check import Check
from softnlp.studies.measurements import Data
from softnlp.studies.registration import Registration

Array = NDArray[np.float64]
Tips = Callable[[Array], Array]
"""The model's tips (rows, 3) [m] at pressures (rows, sets) [Pa]."""

_ANY = (-inf, inf)
_BETTER = 0.5  # of what is left: another order of the sets has to leave less than this
_MOST_SETS = 4
_FEWEST = 6


def tip_checks(
    data: Data, after: Array, registration: Registration | None, tips: Tips | None, framed: bool, sigma_given: bool
) -> tuple[Check, ...]:
    """Return the checks of the tips that were measured of one robot.

    after : (rows, 3) of the model, where the sensor is, with the constants found [m]. registration : as it was found.
    tips : of the model at the constants that the search began with, None where they cost much. framed : whether the
    frame was not fitted.
    """
    known = np.isfinite(data.values[:, :3]).all(axis=1) & np.isfinite(after).all(axis=1)
    if np.sum(known) < _FEWEST:
        return ()
    P, seen, model = data.pressure[known], data.values[known, :3], after[known]
    found = [_residual(seen, model, data.sigma[known, :3], sigma_given)]
    if framed:
        found += frame_checks(P, seen, model, data.robot, registration, tips)
    return tuple(found)


def frame_checks(
    P: Array, seen: Array, model: Array, robot: Robot, registration: Registration | None, tips: Tips | None
) -> list[Check]:
    """Return the checks of a frame that was not fitted.

    P : (rows, sets) [Pa]. seen, model : (rows, 3) where the sensor is [m], measured and by the model. tips : as in
    `tip_checks`.
    """
    if len(P) < _FEWEST or not np.isfinite(model).all():
        return []
    placed = registration or Registration()
    seen, model = placed.in_base(seen), placed.in_base(model)
    rest = np.array([0.0, 0.0, float(robot.length)]) + np.asarray(placed.tip_offset)
    found = [*_rest(P, seen, rest), *_orders(P, seen, model, tips, placed)]
    moved = float(np.linalg.norm(np.ptp(seen, axis=0))) / MILLIMETRE
    if np.ptp(P) > 1e4:
        likely = "the tip does not move while the pressure does: a wrong sensor, unit or valve"
        found.append(Check("motion of the tip", moved, (1.0, 1e4), _ANY, likely, "mm"))
    return found


def _rest(P: Array, seen: Array, expected: Array) -> Iterator[Check]:
    """Yield the check of the tip without pressure."""
    rest = np.max(P, axis=1) < 2e3
    if np.any(rest):
        away = float(np.linalg.norm(np.median(seen[rest], axis=0) - expected)) / MILLIMETRE
        likely = (
            "the tip at rest is not at (0, 0, length): the origin is not at the base, or the sensor is not at the tip; "
            '[registration] frame = "fit" or tip_offset_mm = "fit"'
        )
        limit = 0.02 * float(expected[2]) / MILLIMETRE
        yield Check("rest tip, away from (0, 0, length)", away, (0.0, limit), _ANY, likely, "mm")


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


def _orders(P: Array, seen: Array, model: Array, tips: Tips | None, placed: Registration) -> Iterator[Check]:
    """Yield the check of the clock, and of the order of the sets where another one does far better."""
    if tips is not None:  # constants that were fitted to another order are not to be trusted
        model = tips(P)
    if not np.isfinite(model).all():
        return
    clock, error, left = _turn(seen, model)
    plain = float(np.sum((seen - model) ** 2))
    sets = P.shape[1]
    best = _best_order(P, seen, tips) if tips is not None and 2 <= sets <= _MOST_SETS else None
    if best is not None and best[0] < _BETTER * left:
        order = [placed.set_order[k] if placed.set_order else int(k) + 1 for k in np.argsort(best[2])]
        turned = f" with clock_deg = {best[1] / DEGREE:.1f}" if best[1] else ""
        mirror = ", the mirror image of the sets" if _is_mirror(best[2]) else ""
        likely = f"looks like set_order = {order} in [registration]{turned}{mirror}"
        yield Check("order of the sets: what another one leaves", best[0] / plain, (_BETTER, inf), _ANY, likely)
    else:
        limit = max(2.0, 4 * error / DEGREE)
        if left > _BETTER * plain:  # a turn explains too little to be what is wrong
            return
        likely = (
            f'the sets are turned about the base\'s axis; [registration] clock_deg = {clock / DEGREE:.1f}, or "fit"'
        )
        yield Check("clock of the sets", clock / DEGREE, (-limit, limit), _ANY, likely, "deg")


def _best_order(P: Array, seen: Array, tips: Tips) -> tuple[float, float, tuple[int, ...]] | None:
    """Return the squares left by the best order of the sets, with the turn about z that it needs, and the order.

    Several orders with turns of their own are the same robot; one that needs no turn comes first.
    """
    found: list[tuple[float, float, tuple[int, ...]]] = []
    for order in permutations(range(P.shape[1])):
        other = tips(P[:, list(order)])
        if np.isfinite(other).all():
            turned, _, remains = _turn(seen, other)
            found += [(remains, turned, order), (float(np.sum((seen - other) ** 2)), 0.0, order)]
    if not found:
        return None
    least = min(squares for squares, _, _ in found)
    return min((one for one in found if one[0] <= 2 * least), key=lambda one: (one[1] != 0, one[0]))


def _is_mirror(order: Sequence[int]) -> bool:
    """Whether an order runs round the other way."""
    n = len(order)
    steps = {(order[(k + 1) % n] - order[k]) % n for k in range(n)}
    return n > 2 and steps == {n - 1}


def _turn(seen: Array, model: Array) -> tuple[float, float, float]:
    """Return the turn about z that brings the model's tips nearest, its standard error, and the squares then left."""
    a, b = model[:, :2], seen[:, :2]
    dot, cross = float(np.sum(a * b)), float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))
    angle = float(np.arctan2(cross, dot))
    c, s = np.cos(angle), np.sin(angle)
    turned = np.column_stack([c * a[:, 0] - s * a[:, 1], s * a[:, 0] + c * a[:, 1], model[:, 2]])
    left = float(np.sum((turned - seen) ** 2))
    spread = np.sqrt(left / max(1, 3 * len(seen) - 4))
    return angle, float(spread / max(np.sqrt(np.sum(a**2)), 1e-12)), left
