"""Solvers that keep what they compile: a second one for the same kind of model has nothing to build.

Kept for each thread by itself, since CasADi releases the interpreter's lock while it computes.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Hashable
from typing import Any

from softnlp.model.body import Body
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.load import Load
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.segments import SegmentedRobot, body_of, require_one_segment
from softnlp.model.tip import TipContact
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.chain_grid import ChainEquations, chain_equations
from softnlp.statics.chain_solver import ChainSolver
from softnlp.statics.compiled import RodEquations, rod_equations
from softnlp.statics.solver import PoseSolver
from softnlp.statics.wall import with_closure

MOST_KINDS = 8
"""How many rods are kept; those that were used least recently go."""


def pose_solver(model: Model, numerics: Numerics, **settings: Any) -> PoseSolver:
    """Return a solver for use in this thread, which shares what it compiles with all others for models of its kind."""
    if isinstance(model.robot, SegmentedRobot):
        return ChainSolver(model, numerics, equations=kept_chain(body_of(model)), **settings)
    return PoseSolver(model, numerics, equations=kept_equations(model), **settings)


def blocked_solver(model: Model, numerics: Numerics, contact: ContactSettings, *, wall: bool = True) -> BlockedSolver:
    """Return a solver for use in this thread, which shares what it compiles as `pose_solver`."""
    with_closure(model, contact)
    poses = pose_solver(model, numerics, unloaded_accuracy=numerics.accuracy)
    kept = kept_equations(model, (TipContact(contact.closure, wall),))
    return BlockedSolver(model, numerics, contact, wall=wall, poses=poses, equations=kept)


def kept_equations(model: Model, loads: tuple[Load, ...] = ()) -> RodEquations:
    """Return the equations of the model's kind, compiled at their first use in this thread.

    loads : beside the dead ones; equal ones share what is compiled.
    """
    require_one_segment(model.robot, "this study")
    kept, name = _KEPT.equations, (model.kind, loads)
    if name not in kept:
        kept[name] = rod_equations(model, loads, like=kept.get((model.kind, ())))
        while len(kept) > MOST_KINDS:
            kept.popitem(last=False)
    kept.move_to_end(name)
    return kept[name]


def kept_chain(body: Body) -> ChainEquations:
    """Return the equations of the body's kind, as `kept_equations`."""
    kept, name = _KEPT.equations, ("chain", body.kind)
    if name not in kept:
        kept[name] = chain_equations(body, tuple(kept_equations(model) for model in body.models))
        while len(kept) > MOST_KINDS:
            kept.popitem(last=False)
    kept.move_to_end(name)
    found = kept[name]
    assert isinstance(found, ChainEquations)
    return found


class _Kept(threading.local):
    """The equations of one thread, least recently used first."""

    def __init__(self) -> None:
        self.equations: OrderedDict[Hashable, RodEquations] = OrderedDict()


_KEPT = _Kept()
