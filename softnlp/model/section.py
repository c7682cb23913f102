"""What rod, cases and batches ask of a cross-section: its quantities, its state by name, its outline.

A section of another kind is a class that inherits from `Section`, in one file: `Segment(robot, material, section=...)`
takes it. The paper's is `softnlp.model.round_chambers`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import casadi as ca

from softnlp.base.errors import InputError
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
    own
        What else `Section.strains` takes: numbers, each with the name of its unit [SI].
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
    own: Sequence[tuple[Any, str]] = field(default=(), kw_only=True)

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


class RodSection(NamedTuple):
    """What the rod asks of its section at s, in one consistent system of units.

    shear, axial, bending_x, bending_y, torsion : GA, EA, EI_x, EI_y, GJ. pressure_force : F_P.
    pressure_moment_x, pressure_moment_y : sum d_i x P_i A_c e3. line_density : mass per length. length : of the whole
    stretched rod.
    """

    shear: Any
    axial: Any
    bending_x: Any
    bending_y: Any
    torsion: Any
    pressure_force: Any
    pressure_moment_x: Any
    pressure_moment_y: Any
    line_density: Any
    length: Any


def rod_section(state: SectionState, length: Any, length_unit: Any, force_unit: Any) -> RodSection:
    """Return the section as the rod sees it, with lengths and forces divided by the units [m, N].

    length : of the whole stretched rod, in the unit of length. Accelerations stay in m/s^2.
    """
    EI_x, EI_y = state.bending_stiffness
    M_x, M_y = state.pressure_moment
    moment_unit = force_unit * length_unit
    return RodSection(
        state.shear_stiffness / force_unit,
        state.axial_stiffness / force_unit,
        EI_x / (moment_unit * length_unit),
        EI_y / (moment_unit * length_unit),
        state.torsional_stiffness / (moment_unit * length_unit),
        state.pressure_force / force_unit,
        M_x / moment_unit,
        M_y / moment_unit,
        state.line_density * length_unit / force_unit,
        length,
    )


class Section(Protocol):
    """A kind of cross-section with its numbers, any of which may be a symbol elsewhere.

    One of your own inherits from this class. Its methods are written with operators and casadi functions, on numbers
    and symbols alike, in SI units. `numbers` are by the keys of `quantities`.
    """

    @property
    def kind(self) -> Hashable:
        """What its equations depend on beside numbers; sections of a class and a kind share what is compiled."""
        return ()

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """The set of each chamber, both counted from 0, (N,) entries [1]."""
        return ()

    @property
    def sets(self) -> int:
        """The number of sets, with one pressure each."""
        return max(self.set_of_chamber, default=-1) + 1

    @property
    def by_sum(self) -> bool:
        """Whether pressures enter the imbalance by their sum alone and only add to stiffnesses; batches are quicker."""
        return False

    @property
    def coupled(self) -> bool:
        """Whether stretch and curvature without a load are found together, by `unloaded`."""
        return False

    @property
    def splits_pressure(self) -> bool:
        """Whether what the fluid carries is left out of the n and m that are shown, as the paper's are."""
        return True

    def check(self, numbers: Mapping[str, Any] | None = None) -> None:
        """Raise `RobotError` for a section that cannot be made.

        Parameters
        ----------
        numbers
            By key; None are its own.
        """

    def quantities(self) -> Sequence[Quantity]:
        """Return its numbers as quantities, "robot.length" among them, the unpressurised length of its segment.

        Returns
        -------
        Sequence
            In a fixed order.
        """
        ...

    def at(self, numbers: Mapping[str, Any], pressures: Any, stretch: Any) -> SectionState:
        """Return the section at a stretch; imbalance and stiffnesses are linear in the pressures.

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

    def unloaded(self, numbers: Mapping[str, Any], pressures: Any, strains: Any) -> tuple[Sequence[Any], Sequence[Any]]:
        """Return the generalised forces without a load; of a section that is `coupled`.

        Parameters
        ----------
        numbers
            By key.
        pressures
            (sets,) gauge [Pa].
        strains
            (3,) v_3, and two curvatures times a length of the section [1].

        Returns
        -------
        tuple
            (3,) forces, which are gradients of an energy and linear in the pressures [N], and the upper part of their
            slopes, row by row (6,) [N]; none of another section.
        """
        return (), ()

    def lengthening(self, own: Sequence[Any], centres: Sequence[tuple[Any, Any]], v: Any, u: Any) -> list[Any]:
        """Return the rate of each chamber's length by s, Eq. (13).

        Parameters
        ----------
        own, centres
            (entries,) of `SectionState.own` and (N, 2) d_i, in any consistent system of units [SI].
        v, u
            (3,) of `strains` [1], [1/m].

        Returns
        -------
        list
            (N,) [1].
        """
        return [ca.norm_2(v + ca.cross(u, ca.vertcat(d_x, d_y, 0))) for d_x, d_y in centres]

    def bending_at_rest(self, numbers: Mapping[str, Any]) -> Any:
        """Return the mean bending stiffness without pressure, of which the unit of force is made.

        Parameters
        ----------
        numbers
            By key.

        Returns
        -------
        number
            EI, or what is near to it [N m^2].
        """
        rest = self.at(numbers, [0.0] * self.sets, 1.0)
        return (rest.bending_stiffness[0] + rest.bending_stiffness[1]) / 2

    def strains(self, section: RodSection, own: Sequence[Any], force: Any, moment: Any) -> tuple[Any, Any]:
        """Return the strains under what wall and fluid carry together, Eq. (5): R^T M + M_P = K u.

        Without a load v has to be e3, which is what the stretch means.

        Parameters
        ----------
        section, own
            Its state, and (entries,) the numbers of `SectionState.own`, in any consistent system of units [SI].
        force, moment
            (3,) R^T N and R^T M in the same units, body frame [SI].

        Returns
        -------
        tuple
            (3,) v [1] and (3,) u [1/m], per stretched length, body frame.
        """
        m = moment + ca.vertcat(section.pressure_moment_x, section.pressure_moment_y, 0)
        v = ca.vertcat(force[0] / section.shear, force[1] / section.shear, force[2] / section.axial + 1)
        return v, ca.vertcat(m[0] / section.bending_x, m[1] / section.bending_y, m[2] / section.torsion)

    def quick_strains(self, section: RodSection, own: Sequence[Any], force: Any, moment: Any) -> tuple[Any, Any]:
        """Return `strains` as machine code takes them, whose derivatives need not be exact; by default the same.

        Parameters
        ----------
        section, own
            As of `strains` (entries,) [SI].
        force, moment
            (3,) R^T N and R^T M [SI].

        Returns
        -------
        tuple
            (3,) v [1] and (3,) u [1/m].
        """
        return self.strains(section, own, force, moment)

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

    def warnings_along(self, stretch: float, v: Any, u: Any) -> list[str]:
        """Return what to know of the section where loads strain it.

        Parameters
        ----------
        stretch
            lambda without loads [1].
        v, u
            (M, 3) strains at points of the rod, as of `strains` [1], [1/m].

        Returns
        -------
        list
            One line each.
        """
        return []

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
        return []


SectionType = Callable[[Any, Material, Coefficients, Conventions], Section]
"""Makes a section of a robot, its silicone, coefficients and conventions: a class, or a function."""


def unit_scale(unit: str, length: Any, force: Any) -> Any:
    """Return one SI unit's size in the scaled system: SI value = scaled value * this; accelerations are not scaled.

    Raises
    ------
    InputError
        For a unit that is not known.
    """
    scales = {
        "1": 1.0,
        "rad": 1.0,
        "m": length,
        "m^2": length**2,
        "1/m": 1 / length,
        "N": force,
        "N m": force * length,
        "N/m": force / length,
        "N/rad": force,
        "Pa": force / length**2,
        "m/s^2": 1.0,
        "kg": force,
        "kg/m": force / length,
        "kg/m^3": force / length**3,
    }
    if unit not in scales:
        raise InputError(f"expected one of {', '.join(scales)}, got {unit!r}", key="unit")
    return scales[unit]
