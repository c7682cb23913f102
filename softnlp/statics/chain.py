"""A load case of several segments, or of a section that varies: rods one behind the other, joined by their states.

The states hold the force and moment of wall and fluid together, so they go through a junction unchanged, whatever
pressure ends there. Each segment is posed in its own units, lengths in L_0 and forces in EI/L_0^2 at its base. One
whose section varies has a part between each two knots, see `softnlp.statics.varying`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity
from softnlp.model import rod
from softnlp.model.body import Body
from softnlp.nlp.case import Equation
from softnlp.nlp.transcription import Transcribed, Transcription
from softnlp.statics.compiled import RodEquations
from softnlp.statics.varying import STATE_BLOCKS, STRETCH, in_units
from softnlp.statics.wrenches import tip_equations, unknown_units

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Part:
    """A segment, or what of it is between two knots. segment : its number, from 0. between : fractions of its length.

    varies : whether its states hold the stretch and the place too. length_unit, force_unit : of its states [m, N].
    """

    segment: int
    between: tuple[float, float]
    varies: bool
    transcribed: Transcribed
    constants: ca.MX
    stretch: ca.MX
    length_unit: ca.MX
    force_unit: ca.MX


@dataclass(frozen=True, eq=False)
class Chain:
    """Several rods in one state of loading, as equations in scaled units; a `softnlp.nlp.case.Case`.

    symbols : the stretch and the states of each part in turn, then what the loads add. labels : what these are called.
    outputs : as `LoadCase`, of the whole body, "stretch" (segments), at their bases, and for each
    "segment.k.tip_position", "segment.k.tip_rotation", without the connector behind it, "segment.k.tip_stretch",
    "segment.k.mean_stretch" and "segment.k.bending_angle". given : its quantities by key. column : all of them. blocks
    : of each part the rows before its intervals and `Transcribed.slopes`; the rows of the tip. length_unit, force_unit
    : of the last states [m, N]. whole_length : of segments and connectors, unpressurised [m].
    """

    name: str
    body: Body
    equations_of: tuple[RodEquations, ...]
    method: Transcription
    given: Mapping[str, Quantity]
    parts: tuple[Part, ...]
    added: ca.MX
    constants: ca.MX
    column: ca.MX
    residuals: ca.MX
    blocks: tuple[tuple[tuple[ca.MX, tuple[ca.MX, ca.MX]], ...], ca.MX]
    fine_residuals: ca.MX
    equations: tuple[Equation, ...]
    outputs: Mapping[str, ca.MX]
    length_unit: ca.MX
    force_unit: ca.MX
    whole_length: ca.MX

    @property
    def once_differentiable(self) -> bool:
        """Whether it is so for any segment."""
        return any(equations.functions.model.section.coupled for equations in self.equations_of)

    @property
    def transcribed(self) -> tuple[Transcribed, ...]:
        """Of each part."""
        return tuple(part.transcribed for part in self.parts)

    @property
    def symbols(self) -> tuple[ca.MX, ...]:
        """The unknowns."""
        every = [symbol for part in self.parts for symbol in (part.stretch, part.transcribed.unknowns)]
        return (*every, *([self.added] if self.added.numel() else []))

    @property
    def labels(self) -> list[str]:
        """What the unknowns are called, one name each of `symbols`."""
        labels = []
        for part in self.parts:
            several = sum(other.segment == part.segment for other in self.parts) > 1
            number = sum(other.segment == part.segment and other.between <= part.between for other in self.parts)
            label = f"segment {part.segment + 1} part {number}" if several else f"segment {part.segment + 1}"
            labels += [f"{label} stretch", f"{label} states"]
        return [*labels, *([self.added.name()] if self.added.numel() else [])]

    @property
    def slope(self) -> ca.MX:
        """The Jacobian of the residuals by the unknowns, made of the blocks of one interval."""
        symbols, (parts, tip) = self.symbols, self.blocks

        def near(rows: ca.MX, first: int) -> ca.MX:
            """Return the Jacobian of rows that take the unknowns from some on, of two parts at most."""
            known = range(max(first, 0), min(max(first, 0) + 4, len(symbols)))
            return ca.horzcat(
                *(ca.jacobian(rows, s) if k in known else ca.MX(rows.numel(), s.numel()) for k, s in enumerate(symbols))
            )

        found = []
        for k, (head, (by_states, by_stretch)) in enumerate(parts):
            own = {2 * k: by_stretch, 2 * k + 1: by_states}
            zero = by_states.shape[0]
            found += [
                near(head, 2 * k - 2),
                ca.horzcat(*(own.get(j, ca.MX(zero, s.numel())) for j, s in enumerate(symbols))),
            ]
        return ca.vertcat(*found, near(tip, 2 * len(parts) - 2))

    def first_guess(self, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Return x of the shape without loads at values of `given` by key, SI, and its last state, SI.

        Arcs one behind the other, and what a section that varies makes of them.
        """
        parts: list[Array] = []
        R, p = np.eye(3), np.zeros(3)  # of the end before, world frame [m]
        chained = iter(self.transcribed)
        for k, equations in enumerate(self.equations_of):
            functions, knots = equations.functions, self.body.knots(k)
            columns = [_column_of(self.body, equations, k, values, s) for s in knots]
            pressure = self.body.of_segment(k, values)["pressure"]
            stretch = equations.stretch(columns[0], pressure).stretch
            R = R @ np.asarray(rod.turned(self.body.segments[k].turn))
            L_0, F_0 = (float(unit) for unit in np.asarray(functions.section(columns[0], stretch)[2]).ravel())
            varies = k in self.body.varying
            for (s_a, s_b), (a, b) in zip(pairwise(knots), pairwise(columns), strict=True):
                points = next(chained).points
                if varies:
                    start = np.concatenate([p / L_0, R.T.ravel(), np.zeros(6), [stretch, 0.0]])
                    states = equations.varying.unloaded(start, np.concatenate([a, b, [s_b - s_a, F_0]]), points)
                else:
                    states = np.asarray(functions.arc(a, stretch, points[None, :]))
                    turned = [R @ states[3 * j : 3 * j + 3] for j in (1, 2, 3)]
                    states = np.concatenate([p[:, None] / L_0 + R @ states[:3], *turned, states[12:]])
                parts += [np.array([stretch]), states.T.ravel()]
                p, R = L_0 * states[:3, -1], states[3:12, -1].reshape(3, 3).T
                stretch = states[STRETCH, -1] if varies else stretch
            if self.body.connected[k]:
                p = p + float(np.ravel(values[self.body.connector_key(k)])[0]) * R[:, 2]
        unknown = functions.tip_unknowns
        return np.concatenate([*parts, np.zeros(unknown)]), np.concatenate([p, R.T.ravel(), np.zeros(6)])


def _column_of(body: Body, equations: RodEquations, k: int, values: Mapping[str, Array], s: float) -> Array:
    """Return what the section of a segment takes at s."""
    own = {**values, **body.of_segment(k, values, s)}
    return np.concatenate([own[key] for key in equations.functions.taken])


def chain_case(
    name: str, body: Body, equations_of: tuple[RodEquations, ...], given: Mapping[str, Quantity], method: Transcription
) -> Chain:
    """Transcribe the segments of a body in the state of loading that the quantities `given` describe.

    equations_of : what is compiled for each segment, under the same loads. given : every key of `body.quantities` and
    of the loads. method : of each segment, with as many intervals; each part of one that varies has its share of them.
    """
    made, whole_length = _Rows([], [], [], 0), ca.MX(0)
    parts, outputs = list[Part](), dict[str, ca.MX]()
    lengths, angles, backbone, stretches, slopes = [], [], [], [], []
    values = {key: q.symbol for key, q in given.items()}
    before: tuple[ca.MX, ca.MX, ca.MX] | None = None  # the last state of the part before, and its units
    for k, compiled in enumerate(equations_of):
        functions, knots, varies = compiled.functions, body.knots(k), k in body.varying
        turn = body.segments[k].turn
        columns = []
        for s in knots:
            own = {**values, **body.of_segment(k, values, s)}
            columns.append(ca.vertcat(*(own[key] for key in functions.taken)))
        summed, mean = ca.MX.zeros(functions.model.chambers + 2), ca.MX(0)
        for j, (column, following) in enumerate(pairwise(columns)):
            several = len(knots) > 2
            label = f"segment {k + 1} part {j + 1}" if several else f"segment {k + 1}"
            stretch = ca.MX.sym("stretch")
            constants, balance, units = functions.section(column, stretch)
            if j == 0:
                L_0, F_0 = units[0], units[1]
            field, rates, share, part = functions.field, functions.lengths, 1.0, method
            if varies:
                share = knots[j + 1] - knots[j]
                field, rates = compiled.varying.field, compiled.varying.lengths
                constants = ca.vertcat(column, following, share, F_0)
                part = method.with_intervals(max(1, round(method.intervals * share)))
            transcribed = part.transcribe(field, constants)
            first, last = transcribed.nodes[:, 0], transcribed.nodes[:, -1]
            scales = _scales(L_0, F_0)
            if before is None:
                start = rod.base_balance(first, turn)
            else:
                start = first[: rod.STATE_SIZE] - in_units(*before, L_0, F_0)
            at = made.count
            made.add(f"{label}: stretch balance", balance, "N", units[1])
            word = "base" if before is None else "junction"
            for key, where in rod.STATE_BLOCKS.items():
                if before is not None or where.start < 12:
                    made.add(f"{label}: {word} {key}", start[where], *scales[key])
            if varies:
                made.add(f"{label}: {word} stretch", first[STRETCH] - stretch, "1", ca.MX(1))
                made.add(f"{label}: {word} place", first[STRETCH + 1], "1", ca.MX(1))
            head = made.since(at)
            made.along(label, transcribed, scales)
            summed += transcribed.integrate(rates)
            mean += transcribed.integrate(compiled.varying.mean) if varies else stretch
            parts.append(Part(k, (knots[j], knots[j + 1]), varies, transcribed, constants, stretch, L_0, F_0))
            slopes.append((head, transcribed.slopes(ca.jacobian(constants, stretch))))
            if j == 0:
                stretches.append(stretch)
            before = last[: rod.STATE_SIZE], L_0, F_0
        end = last[STRETCH] if varies else stretch
        own_chambers = body.chambers[k]
        lengths.append(summed[:own_chambers] * L_0)
        whole_length += L_0
        angles.append(summed[-2])
        backbone.append(summed[-1] * L_0)
        outputs |= {
            f"segment.{k + 1}.tip_position": last[:3] * L_0,
            f"segment.{k + 1}.tip_rotation": ca.reshape(last[3:12], 3, 3),
            f"segment.{k + 1}.tip_stretch": end,
            f"segment.{k + 1}.mean_stretch": mean,
            f"segment.{k + 1}.bending_angle": summed[-2],
        }
        connector = values[body.connector_key(k)] if body.connected[k] else ca.MX(0)
        following_turn = body.segments[k + 1].turn if k + 1 < len(body.segments) else 0.0
        if body.connected[k] or following_turn:
            backbone.append(connector)
            whole_length += connector
            before = rod.carried(last, connector / L_0, following_turn), L_0, F_0
    assert before is not None
    reached = tip_state = before[0]
    if varies:
        constants, _, units = functions.section(columns[-1], end)
        reached = in_units(tip_state, L_0, F_0, units[0], units[1])
    y = ca.MX.sym("tip_forces", functions.tip_unknowns)
    tip = functions.tip(reached, constants, y, functions.tip_column(given), units)
    made.equations += tip_equations(made.count, functions.loads, units[0], units[1])
    whole = {
        "stretch": ca.vertcat(*stretches),
        "tip_position": tip_state[:3] * L_0,
        "tip_rotation": ca.reshape(tip_state[3:12], 3, 3),
        "chamber_lengths": ca.vertcat(*lengths),
        "bending_angle": ca.sum1(ca.vertcat(*angles)),
        "backbone_length": ca.sum1(ca.vertcat(*backbone)),
    }
    if functions.tip_unknowns:
        whole["tip_forces"] = y * unknown_units(functions.loads, units[0], units[1])
    return Chain(
        name=name,
        body=body,
        equations_of=equations_of,
        method=method,
        given=given,
        parts=tuple(parts),
        added=y,
        constants=ca.vertcat(*(part.constants for part in parts)),
        column=ca.vertcat(*values.values()),
        residuals=ca.vertcat(*made.residuals, tip),
        blocks=(tuple(slopes), tip),
        fine_residuals=ca.vertcat(*made.fine, tip),
        equations=tuple(made.equations),
        outputs=whole | outputs,
        length_unit=L_0,
        force_unit=F_0,
        whole_length=whole_length,
    )


def _scales(L_0: ca.MX, F_0: ca.MX) -> dict[str, tuple[str, ca.MX]]:
    """Return the unit of each block of a state, and one of it in SI."""
    none = ("1", ca.MX(1))
    scales = {"position": ("m", L_0), "rotation": none, "force": ("N", F_0), "moment": ("N m", F_0 * L_0)}
    return {**scales, "stretch": none, "place": none}


@dataclass
class _Rows:
    """Residuals on their way, those at half the step beside them, and their names. count : of the rows so far."""

    residuals: list[ca.MX]
    fine: list[ca.MX]
    equations: list[Equation]
    count: int

    def since(self, count: int) -> ca.MX:
        """Return the rows from some on."""
        return ca.vertcat(*self.residuals)[count:]

    def add(self, name: str, rows: ca.MX, unit: str, scale: ca.MX) -> None:
        """Add rows that are the same on every grid."""
        self.equations.append(Equation(name, self.count + np.arange(rows.numel()), unit, scale))
        self.residuals.append(rows)
        self.fine.append(rows)
        self.count += rows.numel()

    def along(self, label: str, transcribed: Transcribed, scales: Mapping[str, tuple[str, ca.MX]]) -> None:
        """Add the rows of all intervals."""
        size = transcribed.residuals.numel()
        inner = self.count + np.arange(size).reshape(-1, transcribed.state_size)
        self.equations += [
            Equation(f"{label}: along the rod, {key}", inner[:, where].ravel(), *scales[key])
            for key, where in STATE_BLOCKS.items()
            if where.start < transcribed.state_size
        ]
        self.residuals.append(transcribed.residuals)
        self.fine.append(transcribed.fine_residuals)
        self.count += size
