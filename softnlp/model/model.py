"""The numbers of one segment, and how its equations are read."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.energy_section import EnergySection
from softnlp.model.materials import Material
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.outlined_section import OutlinedSection
from softnlp.model.robot import Robot
from softnlp.model.round_chambers import RoundChambers
from softnlp.model.section import Section, SectionType


@dataclass(frozen=True, eq=False)
class Model:
    """A robot, its silicone, and how the equations are read. Numbers here are the nominal values of quantities.

    section_type : makes the section of the others; of round chambers the conventions choose between the two.
    """

    robot: Robot
    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION
    section_type: SectionType = RoundChambers

    @cached_property
    def section(self) -> Section:
        """The cross-section."""
        made: SectionType = self.section_type
        if made is RoundChambers and isinstance(self.robot, OutlinedRobot):
            made = OutlinedSection
        elif made is RoundChambers and self.conventions.energy:
            made = EnergySection
        return made(self.robot, self.material, self.coefficients, self.conventions)

    @property
    def sets(self) -> int:
        """The number of chamber sets."""
        return self.section.sets

    @property
    def chambers(self) -> int:
        """The number of chambers."""
        return len(self.section.set_of_chamber)

    @cached_property
    def numbers(self) -> Mapping[str, Any]:
        """The numbers of the section by key [SI]; a float where it is one."""
        return {q.name: float(q.nominal[0]) if q.size == 1 else q.nominal for q in self.section.quantities()}

    @property
    def length(self) -> float:
        """L_0 [m]."""
        return float(self.robot.length)

    @property
    def kind(self) -> Hashable:
        """What the compiled equations depend on; models of one kind differ by the values of quantities only."""
        return type(self.section), self.section.kind

    def check_kind(self, other: Model) -> None:
        """Raise `ValueError` for a model of another kind, whose numbers do not fit the compiled equations."""
        if self.kind != other.kind:
            raise ValueError("a model with other chambers, law or conventions needs a solver of its own")
