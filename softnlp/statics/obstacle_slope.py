"""The Jacobian of a pose among obstacles in numbers, with the intervals in machine code, and what solves with it.

The states between are eliminated interval by interval, as in `softnlp.statics.condensed`. The pushes of nodes that
touch stay unknown beside N(0), M(0); each of the others follows from the state at its own node.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.evaluation import evaluated
from softnlp.nlp.linear import SparseSolver
from softnlp.nlp.problem import CompiledProblem
from softnlp.statics.condensed import LARGEST
from softnlp.statics.obstructed import SMOOTHING, STEPS, STIFFNESS, ObstructedCase
from softnlp.statics.tangents import tangents

Array = NDArray[np.float64]

_POSE = slice(0, 12)
_HEAD = 13  # rows before the intervals: the stretch and the base
_TOUCHES = 0.5  # slope of a contact row by its push, below which that stays unknown
_MOST_TOUCHING = 16
"""Unknown pushes up to which states are eliminated: of a long row of nodes that lie on something, errors would grow."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """The Jacobian in pieces, of K intervals, n = 18 and m obstacles.

    balance : of the stretch's equation. states, pushes, stretch : (K, n, n), (K, n, m), (K, n), what an interval does
    to a change of its first node, of the pushes there and of the stretch. tip : (6, n + m + 1), by the last state, the
    pushes there and the stretch. touch : (P, n + 2), the contact rows by their node, the stretch and their push.
    """

    balance: float
    states: Array
    pushes: Array
    stretch: Array
    tip: Array
    touch: Array


class ObstacleSlope:
    """The Jacobian of one pose among obstacles, every quantity fixed: `softnlp.nlp.linear.LinearSolver`."""

    def __init__(self, case: ObstructedCase, problem: CompiledProblem) -> None:
        self._case, self._problem = case, problem
        self._tangents = tangents(case.functions)
        self._K, self._count = case.intervals, len(case.obstacles)
        self._node_of, self._obstacle_of = (np.array([push[i] for push in case.pushes], int) for i in (0, 1))
        self._sparse = SparseSolver(problem, self._entries)
        starts = np.cumsum([0, *(q.size for q in problem.fixed)])
        places = {q.name: slice(a, a + q.size) for q, a in zip(problem.fixed, starts, strict=False)}
        self._smoothing, self._steps = places[SMOOTHING], places[STEPS]

    @cached_property
    def _functions(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        return _section(self._case, self._problem), _tip(self._case, self._problem), _node(self._case)

    def blocks(self, x: Array, p: Array) -> Blocks | None:
        """Return the Jacobian in pieces; None until it is worth machine code."""
        if not self._tangents.ready(self._K):
            return None
        section, tip, node = self._functions
        K, n, count = self._K, STATE_SIZE, self._count
        nc = self._case.functions.field.size1_in(1)
        fields, along, balance = (part.ravel() for part in evaluated(section, x[:1], p))
        F = x[1 + n * (K + 1) :]
        pushes = np.zeros((count, K + 1))
        pushes[self._obstacle_of, self._node_of] = F
        nodes = x[1 : 1 + n * (K + 1)].reshape(K + 1, n).T
        both = np.tile(fields[:, None], K + 1), np.tile(along[:, None], K + 1)
        behind, by_pose, by_push, by_stretch, G, G_pose, G_stretch = evaluated(node, nodes, pushes, *both)
        by_pose = by_pose.reshape(6, K + 1, 12).transpose(1, 0, 2)
        by_push = by_push.reshape(6, K + 1, count).transpose(1, 0, 2)
        G_pose = G_pose.reshape(count, K + 1, 12)
        moved, stretched = self._tangents.maps(behind[:, :K], fields[:nc], along[:nc], p[self._steps])
        kicked = moved[:, :, 12:]  # by a change of N, M
        moved[:, :, _POSE] += kicked @ by_pose[:K]
        (by_tip,) = evaluated(tip, behind[:, K], x[:1], p)
        push = by_tip[:, 12:n]
        of_tip = [by_tip[:, _POSE] + push @ by_pose[K], push, push @ by_push[K]]
        of_tip.append((by_tip[:, n] + push @ by_stretch[:, K])[:, None])

        at = self._obstacle_of, self._node_of
        gap = STIFFNESS * G[at]
        root = np.sqrt(gap**2 + F**2 + 2 * p[self._smoothing] ** 2)
        held = STIFFNESS * (1 - gap / root)
        touch = np.zeros((F.size, n + 2))
        touch[:, _POSE] = held[:, None] * G_pose[at]
        touch[:, n], touch[:, n + 1] = held * G_stretch[at], 1 - F / root
        added = np.matmul(kicked, by_stretch[:, :K].T[:, :, None])[:, :, 0]
        return Blocks(float(balance[0]), moved, kicked @ by_push[:K], stretched + added, np.hstack(of_tip), touch)

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx of J dx = -g. Raises `numpy.linalg.LinAlgError` where J is singular or not finite."""
        with np.errstate(all="ignore"):
            blocks = self.blocks(x, p)
            if blocks is None or np.sum(blocks.touch[:, -1] < _TOUCHES) > _MOST_TOUCHING:
                return self._sparse.solve(x, p, g)
            return self._condensed(blocks, g)

    def _condensed(self, blocks: Blocks, g: Array) -> Array:
        K, n, node, obstacle = self._K, STATE_SIZE, self._node_of, self._obstacle_of
        P = node.size
        contact, along = g[g.size - P :], g[_HEAD : _HEAD + n * K].reshape(K, n)
        d_stretch = -g[0] / blocks.balance
        free = blocks.touch[:, n + 1]
        unknown = np.flatnonzero(free < _TOUCHES)
        known = np.flatnonzero(free >= _TOUCHES)
        # what a push that follows from its node is: of the node's change, and for itself
        follows = -blocks.touch[known, :n] / free[known, None]
        alone = -(contact[known] + blocks.touch[known, n] * d_stretch) / free[known]
        border = 6 + np.arange(unknown.size)
        states, forced = blocks.states, np.zeros((K, n, 6 + unknown.size + 1))
        forced[:, :, -1] = along + blocks.stretch * d_stretch
        inner = node[known] < K
        rows, of_push = node[known][inner], obstacle[known][inner]
        np.add.at(states, rows, blocks.pushes[rows, :, of_push][:, :, None] * follows[inner][:, None, :])
        np.add.at(forced[:, :, -1], rows, blocks.pushes[rows, :, of_push] * alone[inner][:, None])
        before = node[unknown] < K
        rows = node[unknown][before]
        forced[rows, :, border[before]] = blocks.pushes[rows, :, obstacle[unknown][before]]

        every = np.zeros((K + 1, n, 6 + unknown.size + 1))
        every[0, 12:, :6] = np.eye(6)
        every[0, _POSE, -1] = -g[1:_HEAD]
        for k in range(K):
            np.matmul(states[k], every[k], out=every[k + 1])
            every[k + 1] += forced[k]
        system = np.zeros((6 + unknown.size, 6 + unknown.size + 1))
        system[:6] = blocks.tip[:, :n] @ every[K]
        system[:6, -1] += g[_HEAD + n * K : g.size - P] + blocks.tip[:, -1] * d_stretch
        for i in np.flatnonzero(node[known] == K):
            pushed = blocks.tip[:, n + obstacle[known[i]]]
            system[:6] += np.outer(pushed, follows[i] @ every[K])
            system[:6, -1] += pushed * alone[i]
        last = ~before
        system[:6, border[last]] += blocks.tip[:, n + obstacle[unknown[last]]]
        system[6:] = np.matmul(blocks.touch[unknown, None, :n], every[node[unknown]])[:, 0]
        system[6:, -1] += contact[unknown] + blocks.touch[unknown, n] * d_stretch
        system[border, border] += free[unknown]
        if not np.max(np.abs(system)) < LARGEST:  # nan is not either
            raise np.linalg.LinAlgError("the linearised tip equations are not finite")
        found = np.append(np.linalg.solve(system[:, :-1], -system[:, -1]), 1.0)
        nodes = every @ found
        pushes = np.empty(P)
        pushes[unknown] = found[6:-1]
        pushes[known] = np.einsum("ij,ij->i", follows, nodes[node[known]]) + alone
        return np.concatenate([[d_stretch], nodes.ravel(), pushes])

    def _entries(self, x: Array, p: Array) -> Array | None:
        """Return the entries of the Jacobian in the order of the problem's, None until it is worth machine code."""
        blocks = self.blocks(x, p)
        return None if blocks is None else np.append(_values(blocks), 0.0)[self._gathered]

    @cached_property
    def _gathered(self) -> NDArray[np.int64]:
        """Where among `_values` each entry of the problem's Jacobian is."""
        K, n, m, size = self._K, STATE_SIZE, self._count, self._problem.nlp["x"].numel()
        at, zero = (self._node_of, self._obstacle_of), np.zeros(1, int)
        of_push = np.full((K + 1, m), -1)  # column of each push; where there is none, -1
        of_push[at] = 1 + n * (K + 1) + np.arange(self._node_of.size)
        node = 1 + n * np.arange(K + 1)[:, None] + np.arange(n)
        inner = _HEAD + n * np.arange(K)[:, None] + np.arange(n)
        tip, contact = _HEAD + n * K + np.arange(6), _HEAD + n * K + 6 + np.arange(self._node_of.size)
        of_tip = np.concatenate([node[K], of_push[K], zero])
        of_contact = np.column_stack([node[self._node_of], np.zeros_like(contact), of_push[at]])
        blocks = [
            (zero, zero),
            (np.arange(1, _HEAD), node[0, _POSE]),
            (inner[:, :, None], node[:K, None, :]),
            (inner, node[1:]),
            (inner[:, :, None], of_push[:K, None, :]),
            (inner, np.zeros_like(inner)),
            (tip[:, None], of_tip[None, :]),
            (contact[:, None], of_contact),
        ]
        rows, columns = (np.concatenate([np.broadcast_arrays(*b)[i].ravel() for b in blocks]) for i in (0, 1))
        keys = np.where(columns >= 0, columns * size + rows, -1)
        order = np.argsort(keys, kind="stable")
        r, c = (np.asarray(part, int) for part in self._problem.jacobian.sparsity_out(0).get_triplet())
        wanted = c * size + r
        found: NDArray[np.int64] = order[np.minimum(np.searchsorted(keys, wanted, sorter=order), keys.size - 1)]
        assert np.array_equal(keys[found], wanted), "an entry of the Jacobian is in no block"
        return found

    @cached_property
    def function(self) -> ca.Function:
        """(x, p) -> the residual and the Jacobian, for IPOPT."""
        return _Slope(self._problem, self._entries)


def _values(blocks: Blocks) -> Array:
    """Return all entries that blocks hold, and those of one that are in none of them."""
    K, n, _ = blocks.states.shape
    parts = [np.ones(12), blocks.states, -np.ones(K * n), blocks.pushes, blocks.stretch, blocks.tip, blocks.touch]
    return np.concatenate([[blocks.balance], *(part.ravel() for part in parts)])


class _Slope(ca.Callback):
    """(x, p) -> the residual and its Jacobian, from entries in numbers where there are any."""

    def __init__(self, problem: CompiledProblem, entries: Callable[[Array, Array], Array | None]) -> None:
        ca.Callback.__init__(self)
        self._problem, self._own = problem, entries
        self.construct("jac_g", {})

    def get_n_in(self) -> int:
        return 2

    def get_n_out(self) -> int:
        return 2

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._problem.nlp["xp"[i]].numel())

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return self._problem.jacobian.sparsity_out(0) if i else ca.Sparsity.dense(self._problem.nlp["g"].numel())

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(self, arg: Any, res: Any) -> int:
        x, p = (np.frombuffer(given, float) for given in arg)
        if res[0] is not None:
            np.frombuffer(res[0], float)[:] = evaluated(self._problem.residual, x, p)[0].ravel()
        if res[1] is not None:
            with np.errstate(all="ignore"):
                entries = self._own(x, p)
            np.frombuffer(res[1], float)[:] = (
                self._problem.jacobian.call([x, p])[0].nonzeros() if entries is None else entries
            )
        return 0


def _section(case: ObstructedCase, problem: CompiledProblem) -> ca.Function:
    """Return (stretch, p) -> what field, radii and obstacles take, how it and the balance follow the stretch."""
    stretch = case.symbols[0]
    slopes = [ca.jacobian(case.fields, stretch), ca.jacobian(case.ends[0][0], stretch)]
    return _of_stretch(case, problem, [], [case.fields, *slopes])


def _tip(case: ObstructedCase, problem: CompiledProblem) -> ca.Function:
    """Return (state behind its pushes, stretch, p) -> the rows of the tip by both (6, 19)."""
    functions, stretch, state = case.functions, case.symbols[0], ca.MX.sym("state", STATE_SIZE)
    constants, _, units = functions.section(case.column[: functions.section.size1_in(0)], stretch)
    tip = functions.tip(state, constants, ca.MX(0, 1), functions.tip_column(case.given), units)
    return _of_stretch(case, problem, [state], [ca.horzcat(ca.jacobian(tip, state), ca.jacobian(tip, stretch))])


def _of_stretch(case: ObstructedCase, problem: CompiledProblem, more: list[ca.MX], made: list[ca.MX]) -> ca.Function:
    """Return a function of some symbols, the stretch and p."""
    stretch, quantities = case.symbols[0], [q.symbol for q in problem.fixed]
    inner = ca.Function("inner", [*more, stretch, *quantities], [ca.densify(part) for part in made])
    p = ca.MX.sym("p", problem.nlp["p"].numel())
    pieces = ca.vertsplit(p, np.cumsum([0, *(q.size for q in problem.fixed)]).tolist())
    return ca.Function("own", [*more, stretch, p], inner.call([*more, stretch, *pieces], True, False))


def _node(case: ObstructedCase) -> ca.Function:
    """Return what pushes do at all nodes, by columns: (state, pushes, fields, how they follow the stretch) of each.

    It returns the state behind them; N, M there by the pose, by the pushes and by the stretch; the gaps, and those by
    the pose and by the stretch.
    """
    touch, nc, count = case.touching, case.functions.field.size1_in(1), len(case.obstacles)
    x, F = ca.SX.sym("x", STATE_SIZE), ca.SX.sym("F", count)
    fields = ca.SX.sym("fields", case.fields.numel())
    along = ca.SX.sym("along", fields.numel())
    behind, gaps = touch.pushed(x, F, fields[nc : nc + count], fields[nc + count :])
    load = behind[12:]
    parts = [ca.jacobian(load, x)[:, _POSE], ca.jacobian(load, F)]
    parts += [ca.jtimes(load, fields, along), gaps, ca.jacobian(gaps, x)[:, _POSE], ca.jtimes(gaps, fields, along)]
    one = ca.Function("node", [x, F, fields, along], [behind, *(ca.densify(part) for part in parts)], {"cse": True})
    return one.map(case.intervals + 1)
