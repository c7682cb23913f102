"""The potential of an energy section as numbers among the rod's, and its strains by compiled functions of these."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import casadi as ca

from softnlp.model.potential import Answer, Potential, Pull, Strains
from softnlp.model.quadrature import Layout
from softnlp.model.stretch_curve import BODY_SIZE, LINER_SIZE

_CALLED: dict[str, Any] = {"never_inline": True, "is_diff_in": [False], "cse": True}
FOUND = 10
"""Numbers of what `_refine` takes and returns."""


def as_strains(potential: Potential, at: Strains, force: Any, moment: Any) -> tuple[Any, Any]:
    """Return v and u per length without loads."""
    s, t = potential.compliance(at.v)
    unit = potential.start[0]
    v = ca.vertcat(force[0] * s, force[1] * s, at.v)
    return v / unit, ca.vertcat(at.b_2, -at.b_1, moment[2] * t) / unit


def _sizes(layout: Layout) -> tuple[int, ...]:
    """Return how many numbers the parts of `SectionState.own` have."""
    n, N, K = BODY_SIZE, len(layout.liners), layout.kinds
    return (n - 1, *(LINER_SIZE - 1,) * K, n, n, 1, 1, 1, 1, 1, K, 2 * N, N, 3, 6, 10)


def known(own: Sequence[Any], layout: Layout) -> Potential:
    """Return the potential that `EnergySection.at` put into the constants of the rod."""
    parts, start, K = [], 0, layout.kinds
    for size in _sizes(layout):
        parts.append(own[start : start + size])
        start += size
    body, *liners, arms, slip = (ca.vertcat(*part) for part in parts[: 3 + K])
    GA, gyration, outer, lumen, chamber = (part[0] for part in parts[3 + K : 8 + K])
    poles, flat, push, unbent, compliance, third = parts[8 + K :]
    return Potential(
        body, tuple(liners), arms, slip, GA, gyration, outer, lumen, chamber, tuple(poles),
        centres=tuple(zip(flat[::2], flat[1::2], strict=True)),
        push=tuple(push),
        layout=layout,
        start=(unbent[0], unbent[1], unbent[2]),
        answer=Answer(tuple(c / GA for c in compliance), tuple(third)),
    )  # fmt: skip


def curves(potential: Potential) -> list[tuple[Any, str]]:
    """Return what does not depend on the stretch, as numbers with the names of their units."""
    return [
        *((potential.body[k], "Pa") for k in range(BODY_SIZE - 1)),
        *((liner[k], "N") for liner in potential.liners for k in range(LINER_SIZE - 1)),
        *((potential.arms[k], "1") for k in range(BODY_SIZE)),
        *((potential.slip[k], "1") for k in range(BODY_SIZE)),
        (potential.GA, "N"),
        (potential.gyration, "m"),
        (potential.outer, "m"),
        (potential.lumen, "m"),
        (potential.chamber, "m"),
        *((pole, "1") for pole in potential.poles),
        *((x, "m") for centre in potential.centres for x in centre),
        *((push, "N") for push in potential.push),
    ]


@lru_cache(maxsize=8)
def bent(layout: Layout) -> ca.Function:
    """Return [curves, stretch] -> bending near to that without moments [1]."""
    size = sum(_sizes(layout)[:-3])
    given = ca.SX.sym("given", size + 1)
    potential = known([*(given[k] for k in range(size)), *[0.0] * sum(_sizes(layout)[-3:])], layout)
    at = potential.unbent(given[size])
    found = ca.vertcat(at.b_1 * potential.outer, at.b_2 * potential.outer)
    return ca.Function("bent", [given], [found], _CALLED)


@lru_cache(maxsize=8)
def _refine(layout: Layout) -> ca.Function:
    """Return [own numbers, pull, found] -> found, which is [GA H^-1 in (v, r b), strains (v, r b), last change]."""
    sizes = (sum(_sizes(layout)), len(Pull._fields), FOUND)
    given = [ca.SX.sym(name, size) for name, size in zip(("own", "pull", "at"), sizes, strict=True)]
    own, pull, at = ([part[k] for k in range(part.numel())] for part in given)
    potential = known(own, layout)
    r = potential.outer
    found, inverse, change = potential.refined(Strains(at[6], at[7] / r, at[8] / r), Pull(*pull))
    scaled = [c * potential.GA * unit for c, unit in zip(inverse, (1, r, r, r**2, r**2, r**2), strict=True)]
    rows = ca.vertcat(*scaled, found.v, found.b_1 * r, found.b_2 * r, change)
    return ca.Function("refine", [ca.vertcat(*given)], [rows], _CALLED)


@lru_cache(maxsize=8)
def near_strains(layout: Layout, passes: int) -> ca.Function:
    """Return [own numbers, pull] -> found, see `_refine`; called where it is used, as it is long."""
    own = ca.SX.sym("own", sum(_sizes(layout)))
    pull = ca.SX.sym("pull", len(Pull._fields))
    potential = known([own[k] for k in range(own.numel())], layout)
    at = potential.started(Pull(*(pull[k] for k in range(pull.numel()))))
    r = potential.outer
    found = ca.vertcat(ca.SX.zeros(6), at.v, at.b_1 * r, at.b_2 * r, 1.0)
    for _ in range(passes):
        found = _refine(layout)(ca.vertcat(own, pull, found))
    return ca.Function(f"near_{passes}", [ca.vertcat(own, pull)], [found], _CALLED)
