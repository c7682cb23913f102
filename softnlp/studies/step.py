"""What a study returns for each step: plain frozen numbers in SI units and the world frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from softnlp.contact_settings import ContactSettings
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


@dataclass(frozen=True)
class WeightSensitivity:
    """How the force of `weighted` answers to one weight: d ln F / d ln W at the value used, in `unit`.

    weight : force, moment, length or position.
    """

    weight: str
    value: float
    unit: str
    elasticity: float


@dataclass(frozen=True, eq=False)
class Contact:
    """The wall and what it does to the tip in one step of a blocked force; SI, world frame.

    force : what the wall pushes with, not negative [N]. normal : (3,) unit, the direction in which it pushes the robot.
    wall_point : (3,) a point of the wall [m]. tip_cap : L_t [m]. closure : which equations closed the problem.
    chamber_reaction : (N,) T_i, without P A_c [N]. free : the free shape at the same pressure and loads.
    gap : distance of the free shape's contact point in front of the wall, negative beyond it [m].
    length_error : e_L, Eq. (14) [m]. weighted : what `weighted` left of e_n, e_m, e_L, e_h. sensitivity : of its force
    to its weights, where that was asked for.
    """

    force: float
    normal: Array
    wall_point: Array
    tip_cap: float
    closure: str
    chamber_reaction: Array
    free: Pose
    gap: float
    length_error: float
    weighted: tuple[EquationResidual, ...] = ()
    sensitivity: tuple[WeightSensitivity, ...] = ()


@dataclass(frozen=True, eq=False)
class Aimed:
    """A target of inverse kinematics and how near the tip comes to it at the step's pressure; SI, world frame.

    position, direction : (3,) of the target, or None where it has none. distance, angle : what is left of them [m],
    [rad], or None. tip_position, tip_direction : (3,) where the tip is then, also where that is the nearest reachable
    point only; None without any pose.
    """

    position: Array | None
    direction: Array | None
    distance: float | None = None
    angle: float | None = None
    tip_position: Array | None = None
    tip_direction: Array | None = None


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a run: its input, how it ended, and the pose when it was solved (else None).

    pressure : (sets,) [Pa]. residual : largest scaled equation error, or None when nothing was evaluated.
    discretisation_error : estimated tip position error over L_0. solve_time : [s].
    contact : of a blocked force, whose `pose` is the blocked shape. aimed : of inverse kinematics. Else None.
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
    contact: Contact | None = None
    aimed: Aimed | None = None


@dataclass(frozen=True, eq=False)
class Run:
    """A finished study: what was asked and its steps, in order. contact : of a blocked force, else None."""

    study: str
    robot: Robot
    material: Material
    coefficients: Coefficients
    conventions: Conventions
    loads: Loads
    steps: tuple[Step, ...]
    title: str = ""
    warnings: tuple[str, ...] = field(default=())
    contact: ContactSettings | None = None

    @property
    def failed(self) -> tuple[Step, ...]:
        """The steps that carry no solution."""
        return tuple(s for s in self.steps if not s.status.has_solution)
