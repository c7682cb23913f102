"""A load case with obstacles: at every node the robot may be pushed, where it touches and only there.

At node k the rod has the gap G(p, R) = d(p) - r |n_t|, with d the obstacle's signed distance, n its gradient and n_t
the part of that across the axis: the section is a disc of radius r. A contact of size F >= 0 does the work F dG, so
that the rod takes the force F dG/dp and the moment F dG/d(theta) there, by which N and M jump. F and G are not negative
and one of them is zero; as an equation that is G + F - sqrt(G^2 + F^2 + 2 tau^2) = 0, whose solutions have
G F = tau^2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity, quantity
from softnlp.model import rod
from softnlp.model.obstacle_distance import signed_distance
from softnlp.model.obstacles import Obstacle
from softnlp.model.quantities import Model, quantities, section_function
from softnlp.model.section import unit_scale
from softnlp.nlp.case import Equation
from softnlp.nlp.transcription import RK4, rk_step
from softnlp.statics.loadcase import RodFunctions
from softnlp.statics.wrenches import tip_equations

Array = NDArray[np.float64]

_FLUSH = 1e-3  # |n_t| of a section that lies flat on what it touches
STIFFNESS = 1e3
"""EI/L_0^3 by which a gap weighs against a push, of the order of what one node answers to a push on it alone."""
SMOOTHING, STEPS = "contact.smoothing", "contact.steps"


def numbers_of(obstacles: Sequence[Obstacle], intervals: int) -> list[Quantity]:
    """Return the quantities of obstacles and of the grid: "obstacle.1", ..., the smoothing tau, the share of each step.

    tau is scaled: the root of a gap in L_0 times a force in EI/L_0^2.
    """
    found = [
        quantity(f"obstacle.{k + 1}", "1", np.array(o.numbers)) for k, o in enumerate(obstacles)
    ]  # of mixed units [m, 1]
    found.append(quantity(SMOOTHING, "1", 0.0))
    found.append(quantity(STEPS, "1", np.full(intervals, 1 / intervals)))
    return found


@dataclass(frozen=True, eq=False)
class Touching:
    """What a contact does to a node, as functions in scaled units.

    pushed : (x, F, radius, numbers of all) -> state behind the node, gaps; F and gaps (obstacles,). stiffness : the
    same -> the symmetric 6 x 6 second derivative of sum F_j G_j by p and a rotation, and the (6, obstacles) first ones.
    """

    pushed: ca.Function
    stiffness: ca.Function

    def at(self, states: Array, pushes: Array, radius: Array, numbers: Array) -> tuple[Array, Array]:
        """Return the states behind what pushes there (18, n) and the gaps (obstacles, n), of as many states."""
        behind, gaps = self.pushed.map(states.shape[1])(states, pushes, radius, numbers)
        return np.asarray(behind), np.asarray(gaps)


def _gap(x: Any, obstacle: Obstacle, numbers: Any, radius: Any) -> Any:
    """Return G at a state."""
    p, R, _, _ = rod.unpack(x)
    point = ca.SX.sym("point", 3)
    distance = signed_distance(obstacle, point, numbers)
    normal = ca.gradient(distance, point)
    d, n = ca.substitute([distance, normal], [point], [p])
    axial = ca.dot(n, R[:, 2])
    across = ca.sqrt(ca.fmax(1 - axial**2, 0) * (1 - _FLUSH**2) + _FLUSH**2)  # n may vanish on a bore's axis
    return d - radius * across


def touching(obstacles: Sequence[Obstacle]) -> Touching:
    """Compile what obstacles do to a node; the radius is one for each, zero for the axis."""
    x, F, radius = ca.SX.sym("x", rod.STATE_SIZE), ca.SX.sym("F", len(obstacles)), ca.SX.sym("r", len(obstacles))
    own = [ca.SX.sym("own", len(o.units)) for o in obstacles]
    numbers = ca.vertcat(*own) if own else ca.SX(0, 1)
    turn = ca.SX.sym("turn", 3)
    p, R, N, M = rod.unpack(x)
    # R turned to second order, so that second derivatives are those of a rotation
    turned = (ca.SX.eye(3) + rod.hat(turn) + rod.hat(turn) @ rod.hat(turn) / 2) @ R
    moved = ca.vertcat(p, ca.reshape(turned, 9, 1), N, M)
    gaps = ca.vertcat(*(_gap(moved, o, own[j], radius[j]) for j, o in enumerate(obstacles)))
    pose = ca.vertcat(p, turn)
    slopes = ca.jacobian(gaps, pose)
    work = ca.dot(F, gaps)
    curved = ca.hessian(work, pose)[0]
    still = ca.SX.zeros(3)
    gaps, slopes, curved = ca.substitute([gaps, slopes, curved], [turn], [still])
    push = slopes.T @ F
    behind = ca.vertcat(x[:12], N - push[:3], M - push[3:])
    given = [x, F, radius, numbers]
    return Touching(
        pushed=ca.Function("pushed", given, [behind, gaps], {"cse": True}),
        stiffness=ca.Function("stiffness", given, [curved, slopes.T], {"cse": True}),
    )


@dataclass(frozen=True, eq=False)
class ObstructedCase:
    """A robot in one state of loading among obstacles, as `softnlp.nlp.case.Case`.

    symbols : stretch, the states at the nodes 0..K before what pushes there, the pushes F of the nodes 1..K by
    obstacles, which those of a tip's obstacle have at K alone. fields : what field, radii and obstacles take.
    every : the pushes (obstacles, K). ends : the rows before and behind the intervals. gaps : at the pushes.
    """

    name: str
    intervals: int
    functions: RodFunctions
    obstacles: tuple[Obstacle, ...]
    given: Mapping[str, Quantity]
    symbols: tuple[ca.MX, ...]
    column: ca.MX
    constants: ca.MX
    residuals: ca.MX
    fine_residuals: ca.MX
    equations: tuple[Equation, ...]
    outputs: Mapping[str, ca.MX]
    length_unit: ca.MX
    force_unit: ca.MX
    touching: Touching
    pushes: tuple[tuple[int, int], ...]
    ends: tuple[ca.MX, ca.MX]
    fields: ca.MX
    every: ca.MX
    gaps: ca.MX

    @cached_property
    def slope(self) -> ca.MX:
        """The Jacobian of the residuals by the unknowns, made of the blocks of one interval and of one node.

        Automatic differentiation of the whole takes ten times as long.
        """
        K, nx, count = self.intervals, rod.STATE_SIZE, len(self.obstacles)
        stretch, states, F = self.symbols
        first, last = (ca.horzcat(*(ca.jacobian(rows, symbol) for symbol in self.symbols)) for rows in self.ends)
        along = ca.jacobian(self.fields, stretch)
        interval, node = _blocks(self.functions, self.touching)
        nodes = ca.reshape(states, nx, K + 1)
        before = ca.horzcat(ca.MX(count, 1), self.every[:, : K - 1])
        A, B, t = interval.map(K)(nodes[:, :K], before, self.fields, along, self.given[STEPS].symbol.T)
        A, B = (ca.sparsity_cast(part, ca.diagcat(*[interval.sparsity_out(k)] * K)) for k, part in enumerate((A, B)))
        own = ca.horzcat(A, ca.MX(nx * K, nx)) - ca.DM(
            ca.Sparsity.triplet(nx * K, nx * (K + 1), list(range(nx * K)), list(range(nx, nx * (K + 1)))), 1
        )
        from_node = [k * count + j for k, j in self.pushes if k < K]
        to_all = ca.Sparsity.triplet(count * K, len(self.pushes), from_node, list(range(len(from_node))))
        inner = ca.horzcat(ca.vec(t), own, B @ ca.DM(to_all, 1))

        by_state, by_stretch = node.map(K)(nodes[:, 1:], self.fields, along)
        by_state = ca.sparsity_cast(by_state, ca.diagcat(*[node.sparsity_out(0)] * K))
        rows = [(k - 1) * count + j for k, j in self.pushes]
        G = STIFFNESS * self.gaps
        root = ca.sqrt(G**2 + F**2 + 2 * self.given[SMOOTHING].symbol ** 2)
        dG = ca.horzcat(ca.vec(by_stretch)[rows], ca.horzcat(ca.MX(len(rows), nx), by_state[rows, :]))
        contact = ca.horzcat(ca.diag(STIFFNESS * (1 - G / root)) @ dG, ca.diag(1 - F / root))
        return ca.vertcat(first, inner, last, contact)

    @property
    def once_differentiable(self) -> bool:
        """Whether strains are found by iterations, whose derivative is the last one's."""
        return self.functions.model.section.coupled


def pushed_nodes(obstacles: Sequence[Obstacle], intervals: int) -> tuple[tuple[int, int], ...]:
    """Return (node, obstacle) of every push, nodes from 1, in the order of the unknowns."""
    return tuple(
        (k, j)
        for k in range(1, intervals + 1)
        for j, obstacle in enumerate(obstacles)
        if obstacle.part == "body" or k == intervals
    )


def obstructed_case(
    name: str, functions: RodFunctions, given: Mapping[str, Quantity], obstacles: Sequence[Obstacle], intervals: int
) -> ObstructedCase:
    """Transcribe the rod among obstacles by multiple shooting.

    functions : of `rod_functions`, without other loads than dead ones. given : by the names of
    `functions.declared()`, and `numbers_of` the obstacles.
    """
    K, nx, count = intervals, rod.STATE_SIZE, len(obstacles)
    column = ca.vertcat(*(given[key].symbol for key in functions.declared()))
    stretch = ca.MX.sym("stretch")
    constants, balance, units = functions.section(column[: functions.section.size1_in(0)], stretch)
    L_0, F_0 = units[0], units[1]
    own = [
        given[f"obstacle.{j + 1}"].symbol / ca.vertcat(*(unit_scale(unit, L_0, F_0) for unit in obstacle.units))
        for j, obstacle in enumerate(obstacles)
    ]
    numbers = ca.vertcat(*own)
    of_body, of_rim = outer_radii(functions.model)(column[: functions.section.size1_in(0)], stretch)
    wide = {"body": of_body, "tip axis": ca.MX(0), "tip rim": of_rim}
    radius = ca.vertcat(*(wide[o.part] for o in obstacles))
    fields = ca.vertcat(constants, radius, numbers)

    states, places = ca.MX.sym("states", nx * (K + 1)), pushed_nodes(obstacles, K)
    F = ca.MX.sym("pushes", len(places))
    nodes = ca.reshape(states, nx, K + 1)
    rows = [(k - 1) * count + j for k, j in places]
    to_all = ca.DM(ca.Sparsity.triplet(count * K, len(places), rows, list(range(len(places)))), 1)
    every = ca.reshape(to_all @ F, count, K)
    touch = touching(obstacles)
    behind, gaps = touch.pushed.map(K)(nodes[:, 1:], every, radius, numbers)
    out = ca.horzcat(nodes[:, 0], behind)
    G = ca.vec(gaps)[rows]

    h = given[STEPS].symbol.T
    step = rk_step(functions.field, RK4).map(K)
    steps = step(out[:, :K], constants, h) - nodes[:, 1:]
    fine = step(step(out[:, :K], constants, h / 2), constants, h / 2) - nodes[:, 1:]
    base = ca.vertcat(balance, rod.base_balance(nodes[:, 0]))
    tip = functions.tip(out[:, K], constants, ca.MX(0, 1), functions.tip_column(given), units)
    tau = given[SMOOTHING].symbol
    either = STIFFNESS * G + F - ca.sqrt((STIFFNESS * G) ** 2 + F**2 + 2 * tau**2)

    model = functions.model
    integrals = ca.sum2(_integrals(functions).map(K)(out[:, :K], constants, h))
    N = model.chambers
    outputs = {
        "stretch": stretch,
        "tip_position": nodes[:3, K] * L_0,
        "tip_rotation": ca.reshape(nodes[3:12, K], 3, 3),
        "chamber_lengths": integrals[:N] * L_0,
        "bending_angle": integrals[N],
        "backbone_length": integrals[N + 1] * L_0,
        "pushes": F * F_0,
        "gaps": G * L_0,
    }
    return ObstructedCase(
        name=name,
        intervals=K,
        functions=functions,
        obstacles=tuple(obstacles),
        given=given,
        symbols=(stretch, states, F),
        column=column,
        constants=fields,
        residuals=ca.vertcat(base, ca.vec(steps), tip, either),
        fine_residuals=ca.vertcat(base, ca.vec(fine), tip, either),
        equations=_equations(K, functions, L_0, F_0, len(places)),
        outputs=outputs,
        length_unit=L_0,
        force_unit=F_0,
        touching=touch,
        pushes=places,
        ends=(base, tip),
        fields=fields,
        every=every,
        gaps=G,
    )


def _blocks(functions: RodFunctions, touch: Touching) -> tuple[ca.Function, ca.Function]:
    """Return the slopes of an interval, and of the gaps of a node.

    (x, F, fields, their change, h) -> (18, 18), (18, obstacles), (18,) and (x, fields, their change) ->
    (obstacles, 18), (obstacles,).
    """
    nc, count = functions.field.size1_in(1), touch.pushed.size1_in(1)
    x, F, h = ca.SX.sym("x", rod.STATE_SIZE), ca.SX.sym("F", count), ca.SX.sym("h")
    fields = ca.SX.sym("fields", nc + touch.pushed.size1_in(2) + touch.pushed.size1_in(3))
    change = ca.SX.sym("change", fields.numel())
    c, radius, numbers = fields[:nc], fields[nc : nc + count], fields[nc + count :]
    behind, gaps = touch.pushed(x, F, radius, numbers)
    end = rk_step(functions.field, RK4)(behind, c, h)
    moved = [ca.densify(ca.jtimes(part, fields, change)) for part in (end, gaps)]
    interval = [ca.jacobian(end, x), ca.jacobian(end, F), moved[0]]
    return (
        ca.Function("interval", [x, F, fields, change, h], interval, {"cse": True}),
        ca.Function("node", [x, fields, change], [ca.jacobian(gaps, x), moved[1]], {"cse": True}),
    )


def outer_radii(model: Model) -> ca.Function:
    """Return (quantities, stretch) -> the outer radius, as it is stretched and as it is cast, over L_0."""

    def build(numbers: Any, stretch: Any) -> list[Any]:
        outline = model.section.outline
        return [outline(numbers, at).outer / numbers["robot.length"] for at in (stretch, ca.SX(1))]

    return section_function(quantities(model), build)


def _integrals(functions: RodFunctions) -> ca.Function:
    """Return (x, c, h) -> what `functions.lengths` grows by over a step."""
    nx, nq = functions.field.size1_in(0), functions.lengths.size1_out(0)
    x, c, h = ca.SX.sym("x", nx), ca.SX.sym("c", functions.field.size1_in(1)), ca.SX.sym("h")
    every = ca.SX.sym("every", nx + nq)
    both = ca.vertcat(functions.field(every[:nx], c), functions.lengths(every[:nx], c))
    field = ca.Function("both", [every, c], [both])
    return ca.Function("grown", [x, c, h], [rk_step(field, RK4)(ca.vertcat(x, ca.SX.zeros(nq)), c, h)[nx:]])


def _equations(K: int, functions: RodFunctions, L_0: ca.MX, F_0: ca.MX, pushes: int) -> tuple[Equation, ...]:
    """Name the rows: stretch, base, continuity, tip, contact."""
    units = {"position": ("m", L_0), "rotation": ("1", ca.MX(1)), "force": ("N", F_0), "moment": ("N m", F_0 * L_0)}
    named = [
        Equation("stretch balance", np.array([0]), "N", F_0),
        Equation("base position", np.arange(1, 4), "m", L_0),
        Equation("base orientation", np.arange(4, 13), "1", ca.MX(1)),
    ]
    rows = 13 + np.arange(K * rod.STATE_SIZE).reshape(K, rod.STATE_SIZE)
    for block, where in rod.STATE_BLOCKS.items():
        named.append(Equation(f"continuity of {block}", rows[:, where].ravel(), *units[block]))
    start = 13 + rows.size
    named += tip_equations(start, functions.loads, L_0, F_0)
    named.append(Equation("contact gap or force", start + 6 + np.arange(pushes), "m", L_0 / STIFFNESS))
    return tuple(named)
