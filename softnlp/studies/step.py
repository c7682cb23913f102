"""What a study returns for each step: plain frozen numbers in SI units and the world frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from softnlp.conventions import Coefficients, Conventions
from softnlp.materials import Material
from softnlp.robot import Robot
from softnlp.rod import Loads
from softnlp.solver import EquationResidual
from softnlp.status import Status

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shape:
    """The rod at M points from base to tip.

    arc : (M,) s/L, from 0 to 1. position : (M, 3) p [m]. rotation : (M, 3, 3) R, columns are the body axes.
    force : (M, 3) n [N]. moment : (M, 3) m [N m] (both world frame).
    shear_extension : (M, 3) v [-]. curvature : (M, 3) u [1/m] (both body frame).
    """

    arc: Array
    position: Array
    rotation: Array
    force: Array
    moment: Array
    shear_extension: Array
    curvature: Array


@dataclass(frozen=True)
class SectionRadii:
    """Deformed section, Eqs. (22), (S2) [m]; bore is r_ci, chamber is r_co."""

    outer: float
    lumen: float
    chamber_circle: float
    chamber: float
    bore: float


@dataclass(frozen=True, eq=False)
class Pose:
    """A solved static pose; frames and units as in `Shape`.

    tip_displacement : against the shape at the same pressure without gravity or tip load.
    bending_angle : integral of sqrt(u_x^2 + u_y^2) over s [rad]. tilt : angle between tip axis and +z [rad].
    backbone_length : integral of |v| [m]. chamber_length : (N,) [m]. stable : no conjugate point on the rod.
    """

    stretch: float
    stable: bool
    tip_position: Array
    tip_displacement: Array
    tip_rotation: Array
    bending_angle: float
    tilt: float
    backbone_length: float
    chamber_length: Array
    radii: SectionRadii
    shape: Shape


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a run: its input, how it ended, and the pose when it was solved (else None).

    pressure : (sets,) [Pa]. residual : largest scaled equation error, or None when nothing was evaluated.
    discretisation_error : estimated tip position error over L_0. solve_time : [s].
    """

    pressure: Array
    status: Status
    message: str
    time: float | None = None
    pose: Pose | None = None
    residual: float | None = None
    certificate: tuple[EquationResidual, ...] = ()
    discretisation_error: float | None = None
    intervals: int | None = None
    iterations: int = 0
    solve_time: float = 0.0
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Run:
    """A finished study: what was asked and its steps, in order."""

    study: str
    robot: Robot
    material: Material
    coefficients: Coefficients
    conventions: Conventions
    loads: Loads
    steps: tuple[Step, ...]
    title: str = ""
    warnings: tuple[str, ...] = field(default=())

    @property
    def failed(self) -> tuple[Step, ...]:
        """The steps that carry no solution."""
        return tuple(s for s in self.steps if not s.status.has_solution)
