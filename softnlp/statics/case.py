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
from softnlp.model.load import Load
from softnlp.model.quantities import LOADS
from softnlp.model.rod import STATE_SIZE
from softnlp.model.tip import TipContact
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
    loads: Sequence[Load] = (),
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
    loads
        Beside the dead ones, each a `softnlp.Load`; the case takes their quantities too (`Body.quantities_of`).
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
        For a key that the body does not have, an expression of another size, a wall or a closed form for a body of
        several segments or of a section that varies, and loads on a closed form.
    """
    every = (*loads, *((TipContact(wall),) if wall is not None else ()))
    chained = len(body.segments) > 1 or bool(body.varying)
    if chained and (method is None or any(load.needs_lengths for load in every)):
        raise IllPosedError("a wall at the tip, and an arc in closed form, take a body of one segment")
    if method is None and loads:
        raise IllPosedError("an arc in closed form takes no loads")
    taken = body.quantities_of(every)
    for key in taken:
        if key in body.quantities:
            raise IllPosedError(f"a load has a quantity '{key}', which is one of the body's")
    declared = {**body.quantities, **taken}
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
    if method is None:
        return unloaded_case(name, kept_equations(body.models[0]).functions, declared)
    compiled = tuple(kept_equations(model, every) for model in body.models)
    if chained:
        return chain_case(name, body, compiled, declared, method)
    return load_case(name, compiled[0].functions, declared, method)


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
    return _unloaded(case, values)[0]


def _unloaded(case: LoadCase | Chain, values: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return x of a case without loads, and the state at its tip, SI."""
    if isinstance(case, Chain):
        return case.first_guess(values)
    functions = case.functions
    branch = kept_equations(functions.model).branch
    column = np.concatenate([values[key] for key in functions.taken])
    stretch = stretch_on_branch(branch, column[: branch.size1_in(0)], values["pressure"]).stretch
    tip = np.asarray(functions.arc(column, stretch, 1.0)).ravel()[:STATE_SIZE]
    return case.arc(column, stretch), np.concatenate([values["robot.length"] * tip[:3], tip[3:]])


def unloaded_values(case: LoadCase | Chain, values: Mapping[str, Array]) -> dict[str, Any]:
    """Return values of a case's quantities with no load, and with the wall where it touches the tip of the arc."""
    resting: dict[str, Any] = {**values, **{key: np.zeros(3) for key in LOADS}}
    functions = case.equations_of[-1].functions if isinstance(case, Chain) else case.functions
    if functions.loads:
        tip = _unloaded(case, resting)[1]
        for load in functions.loads:
            own = {q.name: values[q.name] for q in load.quantities(functions.model)}
            resting |= load.at_rest(own, tip)
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
