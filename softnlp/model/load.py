"""What a load is to a rod: its quantities, its wrench along the rod and at the tip, unknowns and equations of its own.

A load is a class of these methods, in one file: `case(name, body, loads=[...])` takes it. The package's are
`softnlp.model.gravity`, `softnlp.model.dead_tip` and `softnlp.model.tip`. What a load sees is scaled, lengths in L_0
and forces in EI/L_0^2, and so are its own numbers, by the units of its quantities: any formula that is right in every
consistent system of units is right here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple, Protocol

from softnlp.base.quantity import Quantity
from softnlp.model.model import Model
from softnlp.model.section import RodSection

Wrench = tuple[Any, Any]
"""A force and a moment, (3,) each, in the world frame; a zero may be the number 0."""


class AtPoint(NamedTuple):
    """What a load along the rod may use.

    state : p, R, N, M, see `softnlp.model.rod.unpack`. section : the rod's. given : the load's own numbers by the last
    part of their keys, "push" for "follower.push".
    """

    state: Any
    section: RodSection
    given: Any


class AtTip(NamedTuple):
    """What a load at the tip may use; N chambers.

    state : p, R, N, M at s = L, see `softnlp.model.rod`. section : the rod's. lengths : (N,) of the chambers, for loads
    that need them. centres : N pairs d_i. chamber_stiffness : E_t pi r_co^2. force, moment : the dead loads.
    unknowns : the load's own. given : its numbers, `Given` for a wall.
    """

    state: Any
    section: RodSection
    lengths: Any
    centres: list[tuple[Any, Any]]
    chamber_stiffness: Any
    force: Any
    moment: Any
    unknowns: Any
    given: Any


class Load(Protocol):
    """A load on the rod. One of your own inherits from this class and says what it does; the rest is nothing.

    Its expressions are made of operators and casadi functions, in any consistent system of units and the world frame.
    """

    needs_lengths: bool = False
    """Whether the chambers' lengths at the tip are asked for."""

    @property
    def unknowns(self) -> Mapping[str, str]:
        """What it adds to be found, forces or moments: names and their units, "N" or "N m"."""
        return {}

    @property
    def equations(self) -> Mapping[str, str]:
        """Names and units of as many equations, in the order of `rows`."""
        return {}

    def quantities(self, model: Model) -> Sequence[Quantity]:
        """Return its numbers.

        Parameters
        ----------
        model
            Of a segment; sizes are to be the same for every segment of a body.

        Returns
        -------
        Sequence
            With names such as "follower.push".
        """
        return ()

    def named(self, numbers: Mapping[str, Any]) -> object:
        """Return its scaled numbers, by the last part of their names, as `given` has them.

        Parameters
        ----------
        numbers
            By name.

        Returns
        -------
        SimpleNamespace
            With these attributes.
        """
        return SimpleNamespace(**numbers)

    def along(self, at: AtPoint) -> Wrench | None:
        """Return its wrench per length of the stretched rod.

        Parameters
        ----------
        at
            A point of the rod.

        Returns
        -------
        tuple or None
            Force and moment per length; None where it does not act there.
        """
        return None

    def tip(self, at: AtTip) -> Wrench | None:
        """Return its wrench at the tip.

        Parameters
        ----------
        at
            The tip.

        Returns
        -------
        tuple or None
            Force and moment; None where it does not act there.
        """
        return None

    def rows(self, at: AtTip) -> Sequence[Any]:
        """Return as many residuals as it has unknowns.

        Parameters
        ----------
        at
            The tip.

        Returns
        -------
        Sequence
            (unknowns,) one for each of `equations`, in any consistent system of units [1].
        """
        return ()

    def at_rest(self, values: Mapping[str, Any], tip: Any) -> dict[str, Any]:
        """Return values of its quantities with which the unloaded shape stays as it is: zeros, unless it says others.

        Parameters
        ----------
        values
            Of its quantities by key [SI].
        tip
            (18,) state p, R, N, M at the tip of the unloaded shape [SI].

        Returns
        -------
        dict
            By key; what is not in it keeps its value.
        """
        return {key: 0.0 * value for key, value in values.items()}
