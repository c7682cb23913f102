"""Cases of a body: which numbers they share, and a first guess of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError, nearest
from softnlp.base.quantity import Quantity, quantity
from softnlp.model.body import Body
from softnlp.model.contact_settings import Closure
from softnlp.model.rod import STATE_SIZE
from softnlp.model.tip import DEAD_LOADS, tip_conditions
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.transcription import MultipleShooting, Transcription
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.chain import Chain, chain_case
from softnlp.statics.compiled import RodEquations
from softnlp.statics.kept import kept_equations
from softnlp.statics.loadcase import LoadCase, load_case
from softnlp.statics.unloaded import unloaded_case

Array = NDArray[np.float64]

METHOD = MultipleShooting(20)


def case(
    name: str,
    body: Body,
    *,
    given: Mapping[str, Quantity | ca.MX] | None = None,
    own: Sequence[str] = (),
    wall: str | Closure | None = None,
    method: Transcription | None = METHOD,
) -> LoadCase | Chain:
    """Pose a body in one state of loading: its unknowns, as many equations, and its outputs.

    Parameters
    ----------
    name
        Stands before its equations and outputs where a problem has several cases.
    body
        Whose quantities (`Body.quantities`) all its cases share.
    given
        Expressions, or quantities, in place of some of them, by key: `{"pressure": scale * P}`.
    own
        Keys of quantities that are this case's alone: "tip_force" is then "<name>.tip_force".
    wall
        A closure by name, or of your own: a wall at the tip, whose `contact.` quantities the case takes too
        (`Body.contact_quantities`). None: dead loads alone.
    method
        The transcription of each segment. None: no load acts and the shape is an arc in closed form, exactly.

    Returns
    -------
    LoadCase or Chain
        With `given`, the quantities by key, and `outputs`, expressions in SI and the world frame.

    Raises
    ------
    IllPosedError
        For a key that the body does not have, an expression of another size, and a wall or a closed form for a body of
        several segments.
    """
    if len(body.segments) > 1 and (wall is not None or method is None):
        raise IllPosedError("a wall at the tip, and an arc in closed form, take a body of one segment")
    declared = {**body.quantities, **(body.contact_quantities if wall is not None else {})}
    for key in [*own, *(given or {})]:
        if key not in declared:
            raise IllPosedError(f"'{key}' is not a quantity of this case{nearest(key, declared)}")
    for key in own:
        q = declared[key]
        declared[key] = quantity(f"{name}.{q.name}", q.unit, q.nominal, scale=q.scale, lower=q.lower, upper=q.upper)
    for key, value in (given or {}).items():
        q = value if isinstance(value, Quantity) else replace(declared[key], symbol=ca.vec(ca.MX(value)))
        if q.symbol.numel() != declared[key].size:
            raise IllPosedError(f"'{key}' takes {declared[key].size} numbers, got {q.symbol.numel()}")
        declared[key] = q
    if len(body.segments) > 1 and method is not None:
        return chain_case(name, body, tuple(kept_equations(m) for m in body.models), declared, method)
    (model,) = body.models
    if method is None:
        return unloaded_case(name, kept_equations(model).functions, declared)
    equations = kept_equations(model, (wall, True), lambda: tip_conditions(wall)) if wall else kept_equations(model)
    return load_case(name, equations.functions, declared, method)


def own_quantities(case: LoadCase | Chain) -> list[Quantity]:
    """Return the quantities of a case that are symbols: expressions of others are not."""
    return [q for q in case.given.values() if q.symbol.is_symbolic() and q.symbol.name() == q.name]


def alone(case: LoadCase | Chain) -> CompiledProblem:
    """Compile a case with all its quantities fixed, named by their keys."""
    given = {
        key: quantity(key, q.unit, q.nominal, scale=q.scale, lower=q.lower, upper=q.upper)
        for key, q in case.given.items()
    }
    if isinstance(case, Chain):
        posed: LoadCase | Chain = chain_case(case.name, case.body, case.equations_of, given, case.method)
    elif case.method is None:
        posed = unloaded_case(case.name, case.functions, given)
    else:
        posed = load_case(case.name, case.functions, given, case.method)
    return compile_problem(list(given.values()), [posed])


def first_guess(case: LoadCase | Chain, values: Mapping[str, Array]) -> Array:
    """Return x of a case without loads at values of its quantities by key, SI: the arc, no force added at the tip."""
    if isinstance(case, Chain):
        return case.first_guess(values)
    functions = case.functions
    column = np.concatenate([values[key] for key in kept_equations(functions.model).declared])
    stretch = stretch_on_branch(kept_equations(functions.model).branch, column, values["pressure"]).stretch
    return case.arc(column, stretch)


def unloaded_values(case: LoadCase | Chain, values: Mapping[str, Array]) -> dict[str, Any]:
    """Return values of a case's quantities with no load, and with the wall where it touches the tip of the arc."""
    resting: dict[str, Any] = {**values, **{key: np.zeros(3) for key in ("tip_force", "tip_moment", "gravity")}}
    if isinstance(case, LoadCase) and case.functions.conditions is not DEAD_LOADS:
        functions = case.functions
        tip = first_guess(case, resting)[-functions.tip_unknowns - functions.state_size :][:STATE_SIZE]
        L_0, cap = float(values["robot.length"][0]), float(values["contact.tip_cap"][0])
        resting["contact.wall_point"] = L_0 * tip[:3] + cap * tip[9:12]
    return resting


def rods(
    case: LoadCase | Chain, values: Mapping[str, Array]
) -> Iterator[tuple[RodEquations, Mapping[str, Array], int]]:
    """Yield what is compiled of each segment, its own of the values by key, SI, and where x has its stretch."""
    if isinstance(case, LoadCase):
        yield kept_equations(case.functions.model), values, 0
        return
    at = 0
    for k, equations in enumerate(case.equations_of):
        yield equations, case.body.of_segment(k, values), at
        at += 1 + case.symbols[2 * k + 1].numel()


def pose_entries(case: LoadCase | Chain) -> NDArray[np.intp]:
    """Return where x of a case holds positions and direction cosines."""
    found, start = [], 0
    chained = case.transcribed if isinstance(case, Chain) else (case.transcribed,)
    for transcribed in chained:
        nx, states = transcribed.state_size, len(transcribed.points)
        found.append(start + 1 + (np.arange(states)[:, None] * nx + np.arange(12)).ravel())
        start += 1 + nx * states
    return np.concatenate(found)
