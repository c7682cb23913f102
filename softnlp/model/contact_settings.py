"""What a scenario says about the wall of a blocked force (model section 5), as data in SI units."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Literal

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE

_TOUCHES = 1e-4  # of the length: a tip behind a wall by less is pushed in front of it, a rounded number is no mistake
CLOSURES = ("free", "compliant", "weighted", "rigid")
NO_CLOSURE = "none"
"""Of the energy section: the wall holds its tip, and the potential says how its chambers react."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Closure:
    """How pressurised chambers react at a blocked tip: what a closure of your own says.

    Both functions take a `softnlp.model.tip.AtTip` and return expressions of it, made of operators and casadi
    functions. Forces are in units of EI/L_0^2 and lengths in L_0, as everything in `AtTip` is.

    Attributes
    ----------
    name
        How results call it.
    reaction
        Takes an `AtTip`, returns T_i, the reactions (N,) of the chambers, which act at the tip with P_i A_c.
    equation
        Takes an `AtTip`, returns one residual that determines one more unknown force, `at.unknowns[-1]`, such as a
        common reaction; None where there is no such unknown.
    """

    name: str
    reaction: Callable[[Any], Any]
    equation: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class ClosureWeights:
    """Weights of the `weighted` closure; None leaves the choice to the study.

    Attributes
    ----------
    force
        W_n of the force left over [1/N].
    moment
        W_m of the moment left over [1/(N m)].
    length
        W_L of the length error [1/m].
    position
        W_h of the contact point [1/m]; None holds e_h = 0 exactly.
    """

    force: float | None = None
    moment: float | None = None
    length: float | None = None
    position: float | None = None


@dataclass(frozen=True)
class ContactSettings:
    """Where the wall stands and how the pressurised chambers react to it.

    Attributes
    ----------
    offset
        h, horizontal position at which the tip is held, along x [m]; unused when a wall is given.
    tip_cap
        L_t, length of the rigid cap on the tip [m].
    closure
        Which equations close the problem, by name or as a `Closure` of your own; "none" with the energy section alone.
    wall_point
        (3,) a point of a wall anywhere, world frame [m]; given with `wall_normal` or not at all.
    wall_normal
        (3,) the unit vector in which that wall pushes the robot, world frame [1]: it points from the wall to the side
        on which the tip is. It is kept as given, so the unbent tip may touch the wall but not start behind it.
    weights
        Of the `weighted` closure.
    """

    offset: float = 0.0
    tip_cap: float = 0.0
    closure: Literal["free", "compliant", "weighted", "rigid", "none"] | Closure = "compliant"
    wall_point: Vector | None = None
    wall_normal: Vector | None = None
    weights: ClosureWeights = field(default_factory=ClosureWeights)

    @property
    def closure_name(self) -> str:
        """The name of the closure, one of the package's or your own."""
        return self.closure.name if isinstance(self.closure, Closure) else self.closure


def require_in_front(contact: ContactSettings, lengths: Iterable[float], offsets: Iterable[float] = ()) -> None:
    """Refuse a wall given by a point that robots of some lengths [m] start behind, before anything bends them.

    offsets : how far the wall is moved from its point in the direction in which it pushes [m]; where it starts in front
    at one of them it may be moved in.

    Raises
    ------
    InputError
        With the key "wall_normal": which side the unbent tip is on, how far, and what to change.
    """
    point, normal = contact.wall_point, contact.wall_normal
    if point is None or normal is None:
        return
    back = min([0.0, *offsets])
    for length in lengths:
        tip = (0.0, 0.0, length + contact.tip_cap)
        ahead = sum(n * (x - p) for n, x, p in zip(normal, tip, point, strict=True)) - back
        if ahead < -_TOUCHES * length:
            at = [x / MILLIMETRE for x in tip]
            touching = [(p + ahead * n) / MILLIMETRE for p, n in zip(point, normal, strict=True)]
            raise InputError(
                f"the unbent tip at {_row(at)} mm starts {-ahead / MILLIMETRE:.4g} mm behind the wall, which pushes "
                f"along {_row(normal)}; turn the normal to {_row(-n for n in normal)}, or move the point to "
                f"{_row(touching)} mm, where it touches the tip, from where offsets above 0 press it in",
                key="wall_normal",
            )


def _row(values: Iterable[float]) -> str:
    return f"({', '.join(f'{value + 0.0:.6g}' for value in values)})"


@dataclass(frozen=True)
class ContactTask:
    """What a scenario asks of a blocked force; at most one of its three, else the force at each pressure.

    offsets : h of a characteristic curve at the one pressure given [m]. target_force : the force to find the pressure
    for, bounded by the last pressure given [N]. constrained : no wall; the chambers' lengths are held under the loads.
    weight_sensitivity : how the force of `weighted` answers to its weights, in each step as well.
    """

    offsets: tuple[float, ...] | None = None
    target_force: float | None = None
    constrained: bool = False
    weight_sensitivity: bool = False

    def step_count(self, pressures: int) -> int:
        """Return how many steps the run has, for so many pressures of the scenario."""
        if self.offsets is not None:
            return len(self.offsets)
        return 1 if self.target_force is not None else pressures
