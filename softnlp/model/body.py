"""A body: segments one behind the other, and every number of them as a named quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.quantities import Model, contact_quantities, quantities
from softnlp.model.robot import LOWERABLE_RULES, Robot, check

T = TypeVar("T")

_OWN = ("robot.", "material.")


@dataclass(frozen=True, eq=False)
class Segment:
    """A length of body with one section and one silicone.

    Attributes
    ----------
    robot
        Of the library, or one of your own; its length is the segment's.
    material
        Of all of it.
    """

    robot: Robot
    material: Material


@dataclass(frozen=True, eq=False)
class Body:
    """Segments joined rigidly, the first one clamped at the base.

    Attributes
    ----------
    segments
        Base first, at least one.
    coefficients, conventions
        As `softnlp.forward`, of all segments.
    name
        Stands before the names of its quantities, as in "left.pressure": bodies in one problem need names of their own.

    Raises
    ------
    InputError
        Without a segment.
    RobotError
        For a robot that is geometrically impossible.
    """

    segments: Sequence[Segment]
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION
    name: str = ""

    def __post_init__(self) -> None:
        if not self.segments:
            raise InputError("expected at least one segment", key="segments")
        for segment in self.segments:
            check(segment.robot, allow=LOWERABLE_RULES)

    @cached_property
    def models(self) -> tuple[Model, ...]:
        """One model a segment."""
        return tuple(Model(s.robot, s.material, self.coefficients, self.conventions) for s in self.segments)

    @property
    def sets(self) -> int:
        """The number of chamber sets of all segments."""
        return sum(s.robot.chamber_sets for s in self.segments)

    @cached_property
    def quantities(self) -> dict[str, Quantity]:
        """Every quantity by its key: those of `softnlp.model.quantities.quantities`.

        "pressure" has one entry a set, counted through all segments from the base. With several segments a dimension
        is "segment.2.robot.length" and a constant "segment.2.material.C10".
        """
        declared = {key: q for key, q in quantities(self.models[0]).items() if not key.startswith(_OWN)}
        declared["pressure"] = quantity("pressure", "Pa", np.zeros(self.sets), scale=1e5, lower=0.0)
        for k, model in enumerate(self.models):
            own = quantities(model).items()
            declared |= {self._key(k, key): q for key, q in own if key.startswith(_OWN)}
        return {key: self._named(key, q) for key, q in declared.items()}

    @cached_property
    def contact_quantities(self) -> dict[str, Quantity]:
        """The quantities of a wall at the tip by key, see `softnlp.model.tip.Given`."""
        return {key: self._named(key, q) for key, q in contact_quantities(self.models[-1]).items()}

    def of_segment(self, k: int, given: Mapping[str, T]) -> dict[str, T]:
        """Return what is given by the body's keys as that of one segment alone, in the order that its model has.

        Parameters
        ----------
        k
            The segment, from 0.
        given
            Symbols, or values, by the body's keys.

        Returns
        -------
        dict
            By the keys of `softnlp.model.quantities.quantities`.
        """
        first = sum(s.robot.chamber_sets for s in self.segments[:k])
        found = {key: given[self._key(k, key)] for key in quantities(self.models[k])}
        pressure: Any = given["pressure"]
        found["pressure"] = pressure[first : first + self.segments[k].robot.chamber_sets]
        return found

    def _key(self, k: int, key: str) -> str:
        return f"segment.{k + 1}.{key}" if len(self.segments) > 1 and key.startswith(_OWN) else key

    def _named(self, key: str, q: Quantity) -> Quantity:
        """Return a quantity with a symbol of this body alone."""
        name = f"{self.name}.{key}" if self.name else key
        return quantity(name, q.unit, q.nominal, scale=q.scale, lower=q.lower, upper=q.upper)
