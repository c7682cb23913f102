"""A body: segments one behind the other, and every number of them as a named quantity."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import isfinite
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.base.quantity import Quantity, quantity
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.lined_chambers import PREFIX, LinedChambers, Lines
from softnlp.model.load import Load
from softnlp.model.materials import Material
from softnlp.model.quantities import LOADS, Model, quantities
from softnlp.model.robot import Robot
from softnlp.model.round_chambers import RoundChambers
from softnlp.model.section import SectionType
from softnlp.model.tip import TipContact

T = TypeVar("T")
Array = NDArray[np.float64]

LinesName = Literal["none", "slack", "bonded"]
"""How the lines of later segments pass through one."""

_SHARED = ("stiffening.", "corrections.")


@dataclass(frozen=True, eq=False)
class Segment:
    """A length of body with one kind of section and one silicone.

    Attributes
    ----------
    robot
        Of the library, or one of your own; its length is the segment's.
    material
        Of all of it.
    section
        The kind of section: the paper's, or one of your own, made of robot, material, coefficients and conventions;
        such a one may take anything with a `length` for a robot.
    along
        What varies along it, by key as in "robot.outer_diameter", in place of what the robot says: a pair, at base and
        tip, with a linear change, or {"s": [0, ..., 1], "value": [...]}, linear between these fractions of the length
        [SI].
    connector
        Length of the rigid, weightless piece behind it, along its tip's axis [m].
    lines
        How the lines of later segments pass through it: "none" of them do, "slack" in the lumen without area or
        stiffness, which is the same to the equations, or "bonded" as straight chambers of this section, at the places
        that they have in their own segment, on which their pressure acts.
    turn
        Angle of its body axes against those of the segment before, about the common axis [rad].

    Raises
    ------
    InputError
        For another word, a negative connector, or a turn that is not finite.
    """

    robot: Robot
    material: Material
    section: SectionType = RoundChambers
    along: Mapping[str, Any] = field(default_factory=dict)
    connector: float = 0.0
    lines: LinesName = "none"
    turn: float = 0.0

    def __post_init__(self) -> None:
        if self.lines not in get_args(LinesName):
            raise InputError(f"expected one of {', '.join(get_args(LinesName))}, got {self.lines!r}", key="lines")
        if not (isfinite(self.connector) and self.connector >= 0):
            raise InputError(f"expected a length of at least 0, got {self.connector!r}", key="connector")
        if not isfinite(self.turn):
            raise InputError(f"expected a finite angle, got {self.turn!r}", key="turn")

    @cached_property
    def tables(self) -> dict[str, tuple[Array, Array]]:
        """What varies along it by key: fractions of the length, from 0 to 1, and as many values (knots,) [SI]."""
        found = {}
        for key, given in self.along.items():
            table = given if isinstance(given, Mapping) else {"s": (0.0, 1.0), "value": given}
            s, values = (np.asarray(table.get(name, ()), float) for name in ("s", "value"))
            if s.ndim != 1 or s.size < 2 or s[0] != 0 or s[-1] != 1 or np.any(np.diff(s) <= 0):
                raise InputError(f"'{key}': expected s from 0 to 1, rising", key="along")
            if values.shape != s.shape or not np.all(np.isfinite(values)):
                raise InputError(f"'{key}': expected {s.size} numbers", key="along")
            found[key] = s, values
        return found


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
        Without a segment, and for what cannot vary along one.
    RobotError
        For a robot that is geometrically impossible, at any knot.
    """

    segments: Sequence[Segment]
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION
    name: str = ""

    def __post_init__(self) -> None:
        if not self.segments:
            raise InputError("expected at least one segment", key="segments")
        if self.conventions.energy:
            for segment in self.segments:
                if segment.along and segment.section is RoundChambers:
                    raise InputError("the energy section does not vary along a segment so far", key="along")
                if segment.lines == "bonded":
                    raise InputError("the energy section has no bonded lines so far", key="lines")
        for k, (segment, model) in enumerate(zip(self.segments, self.models, strict=True)):
            if segment.lines == "bonded" and segment.section is not RoundChambers and k + 1 < len(self.segments):
                raise InputError("bonded lines pass through a section of round chambers only", key="lines")
            model.section.check()
            known = [q.name for q in model.section.quantities() if q.size == 1 and _is_own(q.name)]
            known = [name for name in known if not name.startswith(PREFIX)]
            known.remove("robot.length")
            for key in segment.tables:
                if key not in known:
                    raise InputError(f"'{key}' cannot vary along a segment{nearest(key, known)}", key="along")
            for s in self.knots(k) if segment.along else ():
                there = {key: float(np.interp(s, *table)) for key, table in segment.tables.items()}
                model.section.check({**model.numbers, **there})

    @cached_property
    def models(self) -> tuple[Model, ...]:
        """One model a segment."""
        return tuple(
            replace(own, section_type=self._lined(k)) if s.lines == "bonded" and k + 1 < len(self.segments) else own
            for k, (s, own) in enumerate(zip(self.segments, self._own, strict=True))
        )

    @cached_property
    def _own(self) -> tuple[Model, ...]:
        """The models without the lines of later segments."""
        return tuple(Model(s.robot, s.material, self.coefficients, self.conventions, s.section) for s in self.segments)

    def _lined(self, k: int) -> SectionType:
        """Return a segment's kind of section with the lines of all later ones."""
        lines, turn = [], 0.0
        for j, later in enumerate(self.segments[k + 1 :], start=k + 1):
            if later.section is not RoundChambers:
                raise InputError("bonded lines come from sections of round chambers only", key="lines")
            turn += later.turn
            lines.append(Lines(j + 1, later.robot, turn))
        return partial(LinedChambers, lines=tuple(lines))

    @property
    def sets(self) -> int:
        """The number of chamber sets of all segments."""
        return sum(model.sets for model in self._own)

    @property
    def chambers(self) -> tuple[int, ...]:
        """The number of chambers of each segment, without lines of later ones."""
        return tuple(model.chambers for model in self._own)

    @property
    def length(self) -> float:
        """The unpressurised length of segments and connectors together [m]."""
        return float(sum(segment.robot.length + segment.connector for segment in self.segments))

    @property
    def kind(self) -> Hashable:
        """What its equations depend on beside values of quantities."""
        return tuple(
            (model.kind, tuple((key, tuple(s)) for key, (s, _) in segment.tables.items()), segment.turn, joined)
            for model, segment, joined in zip(self.models, self.segments, self.connected, strict=True)
        )

    @property
    def connected(self) -> tuple[bool, ...]:
        """Whether the length of the connector behind a segment is among the quantities."""
        return tuple(len(self.segments) > 1 or segment.connector > 0 for segment in self.segments)

    def connector_key(self, k: int) -> str:
        """Return the key of the length of the connector behind a segment.

        Parameters
        ----------
        k
            The segment, from 0.

        Returns
        -------
        str
            "segment.1.connector" for the first of several.
        """
        return self._key(k, "connector")

    @property
    def varying(self) -> set[int]:
        """The segments whose section varies along them, from 0."""
        return {k for k, segment in enumerate(self.segments) if segment.along}

    @cached_property
    def quantities(self) -> dict[str, Quantity]:
        """Every quantity by its key: those of `softnlp.model.quantities.quantities`.

        "pressure" has one entry a set, counted through all segments from the base. With several segments a dimension
        is "segment.2.robot.length" and a constant "segment.2.material.C10". What varies along a segment has one entry a
        knot.
        """
        pressure = quantity("pressure", "Pa", np.zeros(self.sets), scale=1e5, lower=0.0)
        declared = {"pressure": pressure}
        for own in (False, True):  # what segments share comes first
            for k, model in enumerate(self.models):
                for key, q in quantities(model).items():
                    if key == "pressure" or key.startswith(PREFIX) or _is_own(key) is not own:
                        continue
                    if self._key(k, key) not in declared:
                        nominal = self.segments[k].tables[key][1] if key in self.segments[k].along else q.nominal
                        declared[self._key(k, key)] = replace(q, nominal=nominal)
                if own and self.connected[k]:
                    length, scale = self.segments[k].connector, float(self.segments[k].robot.length)
                    declared[self.connector_key(k)] = quantity("connector", "m", length, scale=scale, lower=0.0)
        return {key: self._named(key, q) for key, q in declared.items()}

    @property
    def contact_quantities(self) -> dict[str, Quantity]:
        """The quantities of a wall at the tip by key, see `softnlp.model.tip.Given`."""
        return self.quantities_of([TipContact("free")])

    def quantities_of(self, loads: Sequence[Load]) -> dict[str, Quantity]:
        """Return the quantities of loads by key, the same ones each time.

        Parameters
        ----------
        loads
            On this body.

        Returns
        -------
        dict
            As `quantities`.
        """
        found = {}
        for q in [q for load in loads for q in load.quantities(self.models[-1])]:
            found[q.name] = self._of_loads.setdefault(q.name, self._named(q.name, q))
        return found

    @cached_property
    def _of_loads(self) -> dict[str, Quantity]:
        return {}

    def knots(self, k: int) -> list[float]:
        """Return the fractions of a segment's length between which its section is linear in s.

        Parameters
        ----------
        k
            The segment, from 0.

        Returns
        -------
        list
            From 0 to 1 (knots,) [1].
        """
        return sorted({0.0, 1.0, *(float(s) for at, _ in self.segments[k].tables.values() for s in at)})

    def of_segment(self, k: int, given: Mapping[str, T], s: float = 0.0) -> dict[str, T]:
        """Return what is given by the body's keys as that of one segment alone, in the order that its model has.

        Parameters
        ----------
        k
            The segment, from 0.
        given
            Symbols, or values, by the body's keys.
        s
            Where along it, from 0 to 1 [1].

        Returns
        -------
        dict
            By the keys of `softnlp.model.quantities.quantities`.
        """
        found = {key: given[name] for key, name in self._names[k].items()}
        for key, (at, _) in self.segments[k].tables.items():
            value: Any = found[key]
            j = min(int(np.searchsorted(at, s, side="right")), at.size - 1)
            t = (s - at[j - 1]) / (at[j] - at[j - 1])
            found[key] = value[j - 1 : j] * (1 - t) + value[j : j + 1] * t
        for key in found:
            if key.startswith(PREFIX):  # where the later segment begins
                found[key] = found[key][:1]  # type: ignore[index]
        pressure: Any = given["pressure"]
        found["pressure"] = pressure[self._pressures[k]]
        return found

    @cached_property
    def _pressures(self) -> list[slice]:
        """Where the pressures of each segment are, those of bonded lines behind its own."""
        firsts = np.cumsum([0, *(model.sets for model in self._own)])
        return [slice(int(a), int(a) + model.sets) for a, model in zip(firsts, self.models, strict=False)]

    @cached_property
    def _names(self) -> list[dict[str, str]]:
        """The keys of each segment's own model, with the body's."""
        return [{key: self._key(k, key) for key in quantities(model)} for k, model in enumerate(self.models)]

    def _key(self, k: int, key: str) -> str:
        if key.startswith(PREFIX):
            _, number, name = key.split(".")
            return f"segment.{number}.robot.{name}"
        return f"segment.{k + 1}.{key}" if len(self.segments) > 1 and _is_own(key) else key

    def _named(self, key: str, q: Quantity) -> Quantity:
        """Return a quantity with a symbol of this body alone."""
        name = f"{self.name}.{key}" if self.name else key
        return quantity(name, q.unit, q.nominal, scale=q.scale, lower=q.lower, upper=q.upper)


def _is_own(key: str) -> bool:
    """Whether a key is a segment's own, where the others are those of the whole body."""
    return key not in ("pressure", *LOADS) and not key.startswith(_SHARED)
