"""One potential of a section, U(v, u) per unit of length as cast, whose gradients are force and moment.

    U = sum over the body    W(lambda, lambda^(-1/2 + H), lambda^(-1/2 - H)) dA_0       (H = 0 without rings)
      + sum over the liners  W(lambda_i, lambda_theta, 1 / (lambda_i lambda_theta)) dA_0, lambda_theta = r / R, Eq. (22)
      - sum over chambers    P_i pi r_co^2 lambda_i
      + GA (v_1^2 + v_2^2) / 2 + GJ u_3^2 / 2
    lambda(X, Y) = v_3 + a(v_3) (u_1 Y - u_2 X), of the section as cast; lambda_i at a chamber's centre

All that the silicone says is four curves of a stretch, see `softnlp.model.stretch_curve`. Strains and lengths are those
of the section as cast: v_3 is the whole stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import nan
from typing import Any, NamedTuple

import casadi as ca

from softnlp.model.quadrature import Disc, Layout, Sums, at_point, first_over_disc, over_disc, placed, value_over
from softnlp.model.stretch_curve import (
    BODY,
    BODY_SIZE,
    LINER_SIZE,
    Place,
    Scale,
    evaluated,
    liner_scale,
    slope_of,
    slopes_of,
)

OUTER, LUMEN, CHAMBER = 6, 4, 3
"""Points of the rules over the outer disc, the lumen and a chamber."""
_LONGEST = 0.35  # change of a fibre's stretch that one pass may make
PASSES, MOST_PASSES = 4, 6
"""Of Newton's method before the last step; machine code leaves out those that are not needed, and may take more."""
_BENT_PASSES = 5  # the same where nothing is known yet
_GRAIN = 2.0**-44  # to which a start is rounded
_SETTLED = 1e-4  # change of a stretch in the last pass from which the strains are not believed


class Strains(NamedTuple):
    """What bends and stretches a section: v_3 and b = (-u_2, u_1), so that lambda = v_3 + a b . X."""

    v: Any
    b_1: Any
    b_2: Any


class Pull(NamedTuple):
    """What pulls and bends it: n_3 and (-m_2, m_1); shear2 = n_1^2 + n_2^2, twist2 = m_3^2."""

    n: Any
    h_1: Any
    h_2: Any
    shear2: Any
    twist2: Any


NOTHING = Pull(0.0, 0.0, 0.0, 0.0, 0.0)


class Tangent(NamedTuple):
    """First derivatives of U less the pull, and second ones, by v_3, b_1 and b_2."""

    g: tuple[Any, ...]  # (3,)
    H: tuple[Any, ...]  # vv, v1, v2, 11, 12, 22


class Answer(NamedTuple):
    """How strains (v_3, r_r b) answer to a pull (n, h / r_r) at those without a load, to second order.

    compliance : inverse of the second derivatives, its upper part row by row (6,) [1/N]. third : third derivatives, by
    vvv, vv1, vv2, v11, v12, v22, 111, 112, 122, 222 [N].
    """

    compliance: tuple[Any, ...]
    third: tuple[Any, ...]

    def strains(self, n: Any, h_1: Any, h_2: Any) -> tuple[Any, Any, Any]:
        """Return the change of strains."""
        d = _times(self.compliance, (n, h_1, h_2))
        reach = ca.fabs(d[0]) + ca.fabs(d[1]) + ca.fabs(d[2])
        part = ca.fmin(1.0, _LONGEST / (reach + 1e-30))
        v, x, y = (part * one for one in d)
        t = self.third
        vv, vx, vy, xx, xy, yy = v * v, 2 * v * x, 2 * v * y, x * x, 2 * x * y, y * y
        bent = (
            t[0] * vv + t[1] * vx + t[2] * vy + t[3] * xx + t[4] * xy + t[5] * yy,
            t[1] * vv + t[3] * vx + t[4] * vy + t[6] * xx + t[7] * xy + t[8] * yy,
            t[2] * vv + t[4] * vx + t[5] * vy + t[7] * xx + t[8] * xy + t[9] * yy,
        )
        c = _times(self.compliance, bent)
        return v - c[0] / 2, x - c[1] / 2, y - c[2] / 2


@dataclass(frozen=True, eq=False)
class Potential:
    """The numbers of U at one set of pressures, N chambers with K kinds of liners.

    body : derivative of W's curve [Pa]. liners : (K,) of a liner's energy per length [N]. arms : a's curve [1].
    slip : curve of GA at rest over GA [1]. GA : at rest [N]. gyration : radius of, for GJ = GA gyration^2 / v_3 [m].
    outer, lumen, chamber : r_r, r_i, r_co [m]. poles : (K,) stretches at which a bore would vanish [1].
    centres : (N, 2) as cast [m]. push : (N,) P_i pi r_co^2 [N].
    layout : see `Layout`.
    start : (3,) strains without a load. answer : how strains answer to a load there, see `Answer`.
    """

    body: Any
    liners: tuple[Any, ...]
    arms: Any
    slip: Any
    GA: Any
    gyration: Any
    outer: Any
    lumen: Any
    chamber: Any
    poles: tuple[Any, ...]
    centres: tuple[tuple[Any, Any], ...]
    push: tuple[Any, ...]
    layout: Layout
    start: tuple[Any, Any, Any] = (1.0, 0.0, 0.0)
    answer: Answer | None = None

    @property
    def discs(self) -> list[Disc]:
        """The body's, of which holes are taken away; none of a body that is summed over points."""
        if self.layout.points:
            return []
        return [
            Disc((0.0, 0.0), self.outer, OUTER),
            Disc((0.0, 0.0), self.lumen, LUMEN, -1),
            *(Disc(centre, self.chamber, CHAMBER, -1) for centre in self.centres),
        ]

    @property
    def _points(self) -> list[tuple[tuple[Any, Any], Any]]:
        """Places of the body and the areas that they stand for, where it is not of discs."""
        return placed(self.layout.points, self.outer, self.outer**2)

    def _lined(self) -> list[tuple[int, Scale, Any, list[tuple[tuple[Any, Any], Any]]]]:
        """Return each chamber that has a liner with its scale, its curve, and places with weights whose sum is 1."""
        found = []
        for n, (kind, centre) in enumerate(zip(self.layout.liners, self.centres, strict=True)):
            if kind >= 0:
                spread = self.layout.spread[kind]
                places = placed(spread, self.outer, 1.0) if spread else [(centre, 1.0)]
                found.append((n, liner_scale(self.poles[kind]), self.liners[kind], places))
        return found

    def tangent(self, at: Strains, pull: Pull) -> Tangent:
        """Return the derivatives of U at strains, with the shear and the twist that the pull makes there."""
        given = [self.body, *self.liners, self.arms, self.slip, *(getattr(self, name) for name in _NUMBERS)]
        flat = [x for centre in self.centres for x in centre]
        found = _tangent(self.layout)(ca.vertcat(*given, *self.poles, *flat, *self.push, *at, *pull))
        g, H = (tuple(found[k] for k in rows) for rows in (range(3), range(3, 9)))
        return Tangent(g, H)

    def _tangent(self, at: Strains, pull: Pull) -> Tangent:
        """Return the same, operation by operation."""
        here = BODY.place(at.v)
        a, a1, a2 = evaluated(self.arms, here)
        b = (at.b_1, at.b_2)
        sums = self._sums(at.v, (a * b[0], a * b[1]))
        (k_1, k_2), (vk_1, vk_2), (kk_11, kk_12, kk_22) = sums.k, sums.vk, sums.kk
        Kb = (kk_11 * b[0] + kk_12 * b[1], kk_12 * b[0] + kk_22 * b[1])
        bk = b[0] * k_1 + b[1] * k_2
        s, s1, s2 = (value / self.GA for value in evaluated(self.slip, here))
        t1, t2 = (s + at.v * s1) / self.gyration**2, (2 * s1 + at.v * s2) / self.gyration**2
        p, p_1, p_2 = self._held_push
        g = (
            sums.v + a1 * bk - (pull.shear2 * s1 + pull.twist2 * t1) / 2 - pull.n - p,
            a * k_1 - pull.h_1 - p_1,
            a * k_2 - pull.h_2 - p_2,
        )
        vv = sums.vv + 2 * a1 * (b[0] * vk_1 + b[1] * vk_2) + a1**2 * (b[0] * Kb[0] + b[1] * Kb[1]) + a2 * bk
        H = (
            vv - (pull.shear2 * s2 + pull.twist2 * t2) / 2,
            a * vk_1 + a * a1 * Kb[0] + a1 * k_1,
            a * vk_2 + a * a1 * Kb[1] + a1 * k_2,
            a**2 * kk_11,
            a**2 * kk_12,
            a**2 * kk_22,
        )
        return Tangent(g, H)

    def _sums(self, v: Any, k: tuple[Any, Any]) -> Sums:
        """Return those over body and chambers."""
        total = Sums(0.0, (0.0, 0.0), 0.0, (0.0, 0.0), (0.0, 0.0, 0.0))
        for disc in self.discs:
            total = total + over_disc(disc, lambda stretch: slopes_of(self.body, BODY.place(stretch)), v, k)
        for (x, y), area in self._points:
            first, second = slopes_of(self.body, BODY.place(v + k[0] * x + k[1] * y))
            total = total + at_point((x, y), area * first, area * second)
        for n, scale, curve, places in self._lined():
            push = self.push[n]
            for (x, y), weight in places:
                first, second = slopes_of(curve, scale.place(v + k[0] * x + k[1] * y))
                if len(places) == 1:
                    total = total + at_point((x, y), first - push, second)
                else:
                    total = total + at_point((x, y), weight * first, weight * second)
            if len(places) > 1:
                total = total + at_point(self.centres[n], -push, 0.0)
        return total

    @property
    def _held_push(self) -> tuple[Any, Any, Any]:
        """What pressures add to v_3, b_1 and b_2 where the body's thread keeps the chambers' places."""
        if not self.layout.held:
            return 0.0, 0.0, 0.0
        pairs = list(zip(self.push, self.centres, strict=True))
        return sum(p for p, _ in pairs), sum(p * x for p, (x, _) in pairs), sum(p * y for p, (_, y) in pairs)

    def started(self, pull: Pull) -> Strains:
        """Return the strains under a pull to second order."""
        r = self.outer
        assert self.answer is not None
        v, x, y = self.answer.strains(pull.n, pull.h_1 / r, pull.h_2 / r)
        return Strains(self.start[0] + v, self.start[1] + x / r, self.start[2] + y / r)

    def refined(self, at: Strains, pull: Pull) -> tuple[Strains, tuple[Any, ...], Any]:
        """Return strains nearer to those under a pull, H^-1 (6,) at the given ones, and the largest fibre's change."""
        tangent = self.tangent(at, pull)
        C, det = adjugate(tangent.H)
        inverse = tuple(c / det for c in C)
        change = _times(inverse, tangent.g)
        reach = ca.fabs(change[0]) + self.outer * (ca.fabs(change[1]) + ca.fabs(change[2]))
        part = ca.fmin(1.0, _LONGEST / (reach + 1e-30))
        return Strains(*(value - part * d for value, d in zip(at, change, strict=True))), inverse, reach

    def followed(self, near: Strains, inverse: tuple[Any, ...], change: Any, off: tuple[Any, ...]) -> Strains:
        """Return strains a step further with the last inverse, whose derivative is that of the step; nan if not near.

        inverse, change : of the last `refined`. off : what vanishes at the strains (3,).
        """
        lost = ca.if_else(change < _SETTLED, 0.0, nan)
        found = _times(inverse, off)
        return Strains(*(value - d + lost for value, d in zip(near, found, strict=True)))

    def gradient(self, at: Strains, pull: Pull) -> tuple[Any, ...]:
        """Return the first derivatives of `tangent` alone, of fibres within the range of their law (3,)."""
        a, a1, _ = evaluated(self.arms, BODY.place(at.v))
        k = (a * at.b_1, a * at.b_2)
        by_v, by_k = 0.0, [0.0, 0.0]
        parts = [first_over_disc(disc, self._slope, at.v, k) for disc in self.discs]
        for (x, y), area in self._points:
            first = area * self._slope(at.v + k[0] * x + k[1] * y)
            parts.append((first, (x * first, y * first)))
        for n, scale, curve, places in self._lined():
            for (x, y), weight in places:
                first = slope_of(curve, scale.place(at.v + k[0] * x + k[1] * y))
                first = first - self.push[n] if len(places) == 1 else weight * first
                parts.append((first, (x * first, y * first)))
            if len(places) > 1:
                x, y = self.centres[n]
                parts.append((-self.push[n], (-x * self.push[n], -y * self.push[n])))
        for v, (k_1, k_2) in parts:
            by_v, by_k = by_v + v, [by_k[0] + k_1, by_k[1] + k_2]
        _, s1, _ = (value / self.GA for value in evaluated(self.slip, BODY.place(at.v)))
        s = evaluated(self.slip, BODY.place(at.v)).value / self.GA
        t1 = (s + at.v * s1) / self.gyration**2
        along = a1 * (at.b_1 * by_k[0] + at.b_2 * by_k[1]) - (pull.shear2 * s1 + pull.twist2 * t1) / 2
        p, p_1, p_2 = self._held_push
        return by_v + along - pull.n - p, a * by_k[0] - pull.h_1 - p_1, a * by_k[1] - pull.h_2 - p_2

    def _slope(self, stretch: Any) -> Any:
        return slope_of(self.body, BODY.place(stretch))

    def answering(self, at: Strains) -> Answer:
        """Return how the strains answer to a load, at those without one."""
        r = self.outer
        given = ca.SX.sym("strains", 3)
        H = self.tangent(Strains(given[0], given[1] / r, given[2] / r), NOTHING).H
        column = ca.vertcat(H[0], H[1] / r, H[2] / r, H[3] / r**2, H[4] / r**2, H[5] / r**2)
        by = ca.jacobian(column, given)
        third = [by[0, 0], by[1, 0], by[2, 0], by[3, 0], by[4, 0], by[5, 0], by[3, 1], by[4, 1], by[5, 1], by[5, 2]]
        every = ca.substitute(ca.vertcat(column, *third), given, ca.vertcat(at.v, at.b_1 * r, at.b_2 * r))
        C, det = adjugate(tuple(every[k] for k in range(6)))
        return Answer(tuple(c / det for c in C), tuple(every[6 + k] for k in range(10)))

    def unbent(self, v: Any) -> Strains:
        """Return the strains without loads at a stretch, so near that one pass is left, see `bent`."""
        at = Strains(v, 0.0, 0.0)
        for _ in range(_BENT_PASSES):
            _, d_1, d_2 = self._bending(at)
            part = ca.fmin(1.0, _LONGEST / (self.outer * (ca.fabs(d_1) + ca.fabs(d_2)) + 1e-30))
            at = Strains(v, at.b_1 - part * d_1, at.b_2 - part * d_2)
        return at

    def bent(self, near: Strains) -> tuple[Strains, Tangent]:
        """Return the strains without moments at the stretch of near ones, in one pass as `polished`, and the tangent.

        The slope of its first entry by the stretch is that with the bending that follows.
        """
        at = Strains(near.v, *(rounded(b * self.outer) / self.outer for b in (near.b_1, near.b_2)))
        _, d_1, d_2 = self._bending(at)
        at = Strains(near.v, at.b_1 - d_1, at.b_2 - d_2)
        return at, self.tangent(at, NOTHING)

    def _bending(self, at: Strains) -> tuple[Tangent, Any, Any]:
        """Return the tangent and the change of b with which no moment is left, at the same stretch."""
        tangent = self.tangent(at, NOTHING)
        (_, g_1, g_2), (_, _, _, a, b, c) = tangent.g, tangent.H
        det = a * c - b * b
        return tangent, (c * g_1 - b * g_2) / det, (a * g_2 - b * g_1) / det

    def compliance(self, v: Any) -> tuple[Any, Any]:
        """Return 1 / GA and 1 / GJ at a stretch."""
        s = evaluated(self.slip, BODY.place(v)).value / self.GA
        return s, s * v / self.gyration**2

    def value(self, at: Strains, v_1: Any = 0.0, v_2: Any = 0.0, u_3: Any = 0.0) -> Any:
        """Return U [N], 0 as cast without pressure but for the pressures' part."""
        a = evaluated(self.arms, BODY.place(at.v)).value
        k = (a * at.b_1, a * at.b_2)
        total = value_over(self.discs, lambda stretch: _summed(self.body, BODY.place(stretch)), at.v, k)
        for (x, y), area in self._points:
            total += area * _summed(self.body, BODY.place(at.v + k[0] * x + k[1] * y))
        for _, scale, curve, places in self._lined():
            for (x, y), weight in places:
                total += weight * _summed(curve, scale.place(at.v + k[0] * x + k[1] * y))
        e = (at.b_1, at.b_2) if self.layout.held else k
        total -= sum(p * (at.v + e[0] * x + e[1] * y) for p, (x, y) in zip(self.push, self.centres, strict=True))
        s, t = self.compliance(at.v)
        return total + (v_1**2 + v_2**2) / (2 * s) + u_3**2 / (2 * t)


_NUMBERS = ("GA", "gyration", "outer", "lumen", "chamber")


@lru_cache(maxsize=8)
def _tangent(layout: Layout) -> ca.Function:
    """Return `Potential._tangent` of a section of a layout; a call copies it, which is quick."""
    chambers, kinds = len(layout.liners), layout.kinds
    sizes = [BODY_SIZE - 1, *[LINER_SIZE - 1] * kinds, BODY_SIZE, BODY_SIZE]
    sizes += [len(_NUMBERS), kinds, 2 * chambers, chambers, 3, 5]
    given = ca.SX.sym("given", sum(sizes))
    parts = ca.vertsplit(given, [sum(sizes[:k]) for k in range(len(sizes) + 1)])
    body, *liners, arms, slip = parts[: 3 + kinds]
    numbers, poles, flat, push, at, pull = ([part[k] for k in range(part.numel())] for part in parts[3 + kinds :])
    centres = tuple(zip(flat[::2], flat[1::2], strict=True))
    every: list[Any] = [body, tuple(liners), arms, slip, *numbers, tuple(poles), centres, tuple(push), layout]
    potential = Potential(*every)
    found = potential._tangent(Strains(*at), Pull(*pull))
    return ca.Function("tangent", [given], [ca.vertcat(*found.g, *found.H)], {"cse": True})


def _summed(derivative: Any, at: Place) -> Any:
    """Return the energy whose derivative by y has these coefficients, but for a constant."""
    p = 0.0
    for k in range(derivative.numel() - 1, -1, -1):
        p = (p + derivative[k] / (k + 1)) * at.y
    slope, second = slopes_of(derivative, at)
    x = at.beyond
    return p + (slope - second * x) * x + second * x**2 / 2


def rounded(value: Any) -> Any:
    """Return a value whose derivative is zero."""
    return ca.floor(value / _GRAIN) * _GRAIN


def _solved(tangent: Tangent) -> tuple[Any, Any, Any]:
    """Return H^-1 g."""
    C, det = adjugate(tangent.H)
    return _times(tuple(c / det for c in C), tangent.g)


def _times(C: tuple[Any, ...], g: tuple[Any, ...]) -> tuple[Any, Any, Any]:
    """Return a symmetric 3x3 matrix, its upper part row by row, times a vector."""
    return (
        C[0] * g[0] + C[1] * g[1] + C[2] * g[2],
        C[1] * g[0] + C[3] * g[1] + C[4] * g[2],
        C[2] * g[0] + C[4] * g[1] + C[5] * g[2],
    )


def adjugate(H: tuple[Any, ...]) -> tuple[tuple[Any, ...], Any]:
    """Return the adjugate of a symmetric 3x3 matrix, as its upper part row by row, and the determinant."""
    a, b, c, d, e, f = H
    C = (d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b)
    return C, a * C[0] + b * C[1] + c * C[2]
