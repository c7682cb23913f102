"""What rod, cases and batches ask of a cross-section: its quantities, its state by name, its outline.

A section of another kind is a class of these methods, in one file: `Segment(robot, material, section=...)` takes it.
The paper's is `softnlp.model.round_chambers`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from softnlp.base.quantity import Quantity
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.materials import Material

STIFFNESSES = ("E_t", "EA", "EI_x", "EI_y", "GA", "GJ")
"""What the section gives the rod; where one of them is not positive there is no pose."""


@dataclass(frozen=True, eq=False)
class SectionState:
    """A section at one stretch and set of pressures; body frame, N chambers.

    Attributes
    ----------
    imbalance
        What the wall's axial force exceeds that of the pressures by, a number [N]; zero where the stretch is right.
    line_density
        Mass per length of the stretched rod, a number [kg/m].
    tangent_modulus
        E_t, a number [Pa].
    axial_stiffness, shear_stiffness
        EA and GA, numbers [N].
    bending_stiffness
        (2,) EI_x, EI_y, about the body's x and y [N m^2].
    torsional_stiffness
        GJ, a number [N m^2].
    pressure_force
        F_P, of all chambers along e3, a number [N].
    pressure_moment
        (2,) x and y of M_P, the sum of d_i x P_i A_c e3 [N m].
    centres
        (N, 2) d_i of the chambers [m].
    chamber_stiffness
        Of one reinforced chamber along its axis, which the closure `compliant` takes, a number [N].
    """

    imbalance: Any
    line_density: Any
    tangent_modulus: Any
    axial_stiffness: Any
    shear_stiffness: Any
    bending_stiffness: tuple[Any, Any]
    torsional_stiffness: Any
    pressure_force: Any
    pressure_moment: tuple[Any, Any]
    centres: tuple[tuple[Any, Any], ...]
    chamber_stiffness: Any

    @property
    def stiffnesses(self) -> list[Any]:
        """In the order of `STIFFNESSES`, numbers [SI]."""
        EI_x, EI_y = self.bending_stiffness
        return [self.tangent_modulus, self.axial_stiffness, EI_x, EI_y, self.shear_stiffness, self.torsional_stiffness]


@dataclass(frozen=True)
class SectionRadii:
    """Deformed section, Eqs. (22), (S2).

    Attributes
    ----------
    outer, lumen, chamber_circle
        r_r, r_i, r_cp [m].
    chamber, bore
        r_co, which the thread keeps, and r_ci [m].
    """

    outer: float
    lumen: float
    chamber_circle: float
    chamber: float
    bore: float


class Section(Protocol):
    """A kind of cross-section with its numbers, any of which may be a symbol elsewhere.

    Its methods are written with operators and casadi functions, on numbers and symbols alike, in SI units. `numbers`
    are by the keys of `quantities`.
    """

    @property
    def kind(self) -> Hashable:
        """What the equations depend on beside numbers; sections of a kind share what is compiled."""
        ...

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """The set of each chamber, both counted from 0, (N,) entries [1]."""
        ...

    @property
    def sets(self) -> int:
        """The number of sets, with one pressure each."""
        ...

    def check(self, numbers: Mapping[str, Any] | None = None) -> None:
        """Raise `RobotError` for a section that cannot be made.

        Parameters
        ----------
        numbers
            By key; None are its own.
        """
        ...

    def quantities(self) -> Sequence[Quantity]:
        """Return its numbers as quantities, "robot.length" among them, the unpressurised length of its segment.

        Returns
        -------
        Sequence
            In a fixed order.
        """
        ...

    def at(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> SectionState:
        """Return the section at a stretch.

        Parameters
        ----------
        numbers
            By key.
        pressures
            (sets,) gauge [Pa].
        stretch
            lambda, a number [1].

        Returns
        -------
        SectionState
            As said.
        """
        ...

    def outline(self, numbers: Mapping[str, Any], stretch: Any) -> SectionRadii:
        """Return the section's deformed radii.

        Parameters
        ----------
        numbers
            By key.
        stretch
            lambda, a number [1].

        Returns
        -------
        SectionRadii
            Of which "outer" bounds the body.
        """
        ...

    def warnings(self, stretch: float) -> list[str]:
        """Return what to know of the section at a stretch.

        Parameters
        ----------
        stretch
            lambda [1].

        Returns
        -------
        list
            One line each.
        """
        ...


SectionType = Callable[[Any, Material, Coefficients, Conventions], Section]
"""Makes a section of a robot, its silicone, coefficients and conventions: a class, or a function."""
