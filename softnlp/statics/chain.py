"""A load case of several segments: each a rod of its own stretch and constants, joined by its state.

The states hold the force and moment of wall and fluid together, so they go through a junction unchanged, whatever
pressure ends there. Each segment is posed in its own units, lengths in L_0 and forces in EI/L_0^2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity
from softnlp.model import rod
from softnlp.model.body import Body
from softnlp.nlp.case import Equation
from softnlp.nlp.transcription import Transcribed, Transcription
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.compiled import RodEquations

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Chain:
    """Several segments in one state of loading, as equations in scaled units; a `softnlp.nlp.case.Case`.

    symbols : the stretch and the states of each segment in turn. outputs : as `LoadCase`, of the whole body, "stretch"
    (segments), and "segment.k.tip_position", "segment.k.tip_rotation" for each. given : its quantities by key.
    column : all of them. length_unit, force_unit : of the last segment's states [m, N].
    """

    name: str
    body: Body
    equations_of: tuple[RodEquations, ...]
    method: Transcription
    given: Mapping[str, Quantity]
    transcribed: tuple[Transcribed, ...]
    symbols: tuple[ca.MX, ...]
    constants: ca.MX
    column: ca.MX
    residuals: ca.MX
    fine_residuals: ca.MX
    equations: tuple[Equation, ...]
    outputs: Mapping[str, ca.MX]
    length_unit: ca.MX
    force_unit: ca.MX

    @property
    def slope(self) -> ca.MX:
        """The Jacobian of the residuals by the unknowns."""
        return ca.horzcat(*(ca.jacobian(self.residuals, symbol) for symbol in self.symbols))

    def first_guess(self, values: Mapping[str, Array]) -> Array:
        """Return x of the shape without loads at values of `given` by key, SI: arcs, one behind the other."""
        parts: list[Array] = []
        R, p = np.eye(3), np.zeros(3)  # of the end before, world frame [m]
        for k, equations in enumerate(self.equations_of):
            own = self.body.of_segment(k, values)
            column = np.concatenate(list(own.values()))
            stretch = stretch_on_branch(equations.branch, column, own["pressure"]).stretch
            L_0 = float(equations.functions.section(column, stretch)[2][0])
            states = np.asarray(equations.functions.arc(column, stretch, self.transcribed[k].points[None, :]))
            turned = states.copy()
            turned[:3] = p[:, None] / L_0 + R @ states[:3]
            turned[3:12] = np.concatenate([R @ states[3 * j : 3 * j + 3] for j in (1, 2, 3)])
            p, R = L_0 * turned[:3, -1], turned[3:12, -1].reshape(3, 3).T
            parts += [np.array([stretch]), turned.T.ravel()]
        return np.concatenate(parts)


def chain_case(
    name: str, body: Body, equations_of: tuple[RodEquations, ...], given: Mapping[str, Quantity], method: Transcription
) -> Chain:
    """Transcribe the segments of a body in the state of loading that the quantities `given` describe.

    equations_of : what is compiled for each segment, under dead loads. given : every key of `body.quantities`. method :
    of each segment, with as many intervals.
    """
    pieces, symbols, residuals, fine, equations = [], [], [], [], list[Equation]()
    lengths, angles, backbone, stretches, outputs = [], [], [], [], {}
    before: tuple[ca.MX, ca.MX, ca.MX] | None = None  # the last state of the segment before, and its units
    rows = 0
    for k, compiled in enumerate(equations_of):
        functions = compiled.functions
        own = body.of_segment(k, {key: q.symbol for key, q in given.items()})
        stretch = ca.MX.sym("stretch")
        constants, balance, units = functions.section(ca.vertcat(*own.values()), stretch)
        L_0, F_0 = units[0], units[1]
        transcribed = method.transcribe(functions.field, constants)
        first, last = transcribed.nodes[:, 0], transcribed.nodes[:, -1]
        start = rod.base_balance(first) if before is None else first - _in_units(*before, L_0, F_0)
        residuals += [balance, start, transcribed.residuals]
        fine += [balance, start, transcribed.fine_residuals]
        label = f"segment {k + 1}: "
        equations.append(Equation(f"{label}stretch balance", np.array([rows]), "N", F_0))
        blocks = {key: where for key, where in rod.STATE_BLOCKS.items() if before is not None or where.start < 12}
        scales = {
            "position": ("m", L_0),
            "rotation": ("1", ca.MX(1)),
            "force": ("N", F_0),
            "moment": ("N m", F_0 * L_0),
        }
        word = "base" if before is None else "junction"
        equations += [
            Equation(f"{label}{word} {key}", rows + 1 + np.arange(where.start, where.stop), *scales[key])
            for key, where in blocks.items()
        ]
        rows += 1 + start.numel()
        inner = rows + np.arange(transcribed.residuals.numel()).reshape(-1, rod.STATE_SIZE)
        equations += [
            Equation(f"{label}along the rod, {key}", inner[:, where].ravel(), *scales[key])
            for key, where in rod.STATE_BLOCKS.items()
        ]
        rows += transcribed.residuals.numel()

        along = transcribed.integrate(functions.lengths)
        N = functions.model.robot.chambers
        lengths.append(along[:N] * L_0)
        angles.append(along[N])
        backbone.append(along[N + 1] * L_0)
        stretches.append(stretch)
        outputs[f"segment.{k + 1}.tip_position"] = last[:3] * L_0
        outputs[f"segment.{k + 1}.tip_rotation"] = ca.reshape(last[3:12], 3, 3)
        pieces.append((transcribed, constants))
        symbols += [stretch, transcribed.unknowns]
        before = last, L_0, F_0
    force, moment = own["tip_force"] / F_0, own["tip_moment"] / (F_0 * L_0)
    tip = rod.tip_balance(last, force, moment)
    equations.append(Equation("tip force", np.arange(rows, rows + 3), "N", F_0))
    equations.append(Equation("tip moment", np.arange(rows + 3, rows + 6), "N m", F_0 * L_0))
    whole = {
        "stretch": ca.vertcat(*stretches),
        "tip_position": last[:3] * L_0,
        "tip_rotation": ca.reshape(last[3:12], 3, 3),
        "chamber_lengths": ca.vertcat(*lengths),
        "bending_angle": ca.sum1(ca.vertcat(*angles)),
        "backbone_length": ca.sum1(ca.vertcat(*backbone)),
    }
    return Chain(
        name=name,
        body=body,
        equations_of=equations_of,
        method=method,
        given=given,
        transcribed=tuple(transcribed for transcribed, _ in pieces),
        symbols=tuple(symbols),
        constants=ca.vertcat(*(constants for _, constants in pieces)),
        column=ca.vertcat(*(q.symbol for q in given.values())),
        residuals=ca.vertcat(*residuals, tip),
        fine_residuals=ca.vertcat(*fine, tip),
        equations=tuple(equations),
        outputs=whole | outputs,
        length_unit=L_0,
        force_unit=F_0,
    )


def _in_units(state: ca.MX, L_a: ca.MX, F_a: ca.MX, L_b: ca.MX, F_b: ca.MX) -> ca.MX:
    """Return a scaled state of one segment in the units of another."""
    moment = F_a * L_a / (F_b * L_b)
    return ca.vertcat(state[:3] * L_a / L_b, state[3:12], state[12:15] * F_a / F_b, state[15:18] * moment)
