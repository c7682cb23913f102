"""What a study returns for each step: plain frozen numbers in SI units and the world frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.rich import rich_html
from softnlp.base.status import Status
from softnlp.model.contact_settings import NO_CLOSURE, ContactSettings
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.obstacles import Obstacle
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.model.section import SectionRadii as SectionRadii
from softnlp.nlp.solver import EquationResidual, Ipopt
from softnlp.statics.aimed import Aimed as Aimed
from softnlp.statics.body import Fit, fit_of
from softnlp.statics.margins import Margins as Margins
from softnlp.statics.moving import Moving as Moving
from softnlp.statics.obstacle_contact import ObstacleContact as ObstacleContact

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shape:
    """The rod at M points from base to tip.

    Attributes
    ----------
    arc
        (M,) s/L, from 0 to 1 [1].
    position
        (M, 3) p, world frame [m].
    rotation
        (M, 3, 3) R, columns are the body axes in the world frame [1].
    force, moment
        (M, 3) n [N] and m [N m], world frame.
    shear_extension, curvature
        (M, 3) v [1] and u [1/m], body frame.
    """

    arc: Array
    position: Array
    rotation: Array
    force: Array
    moment: Array
    shear_extension: Array
    curvature: Array


STABLE_FLAGS = {"undefined": -1, "unstable": 0, "stable": 1}
"""What files of numbers hold for `Pose.stable`."""
SELF_INTERSECTING_FLAGS = {"not_solved": -1, "no": 0, "self_intersecting": 1}
"""What files of numbers hold for `Fit.self_intersecting`."""


def stable_flag(stable: bool | None) -> int:
    """Return the flag of `Pose.stable`."""
    return STABLE_FLAGS["undefined"] if stable is None else int(stable)


@dataclass(frozen=True, eq=False)
class SegmentPose:
    """One segment of a solved pose, world frame.

    Attributes
    ----------
    tip_position
        (3,) its end, without the connector behind it [m].
    tip_rotation
        (3, 3) R there [1].
    stretch
        lambda, of the pressure alone; the mean over the segment where its section varies [1].
    bending_angle
        Integral of sqrt(u_x^2 + u_y^2) over it [rad].
    """

    tip_position: Array
    tip_rotation: Array
    stretch: float
    bending_angle: float


@dataclass(frozen=True, eq=False)
class Pose:
    """A solved static pose, world frame.

    Attributes
    ----------
    stretch
        lambda, of the pressure alone [1].
    stable
        No conjugate point on the rod, so that the energy is least; None under a dead tip moment, which has no energy,
        and where the rod is compressed to nothing.
    tip_position
        (3,) [m].
    tip_displacement
        (3,) against the shape at the same pressure without gravity or tip load [m].
    tip_rotation
        (3, 3) R, columns are the body axes [1].
    bending_angle
        Integral of sqrt(u_x^2 + u_y^2) over s [rad].
    tilt
        Angle between tip axis and +z [rad].
    backbone_length
        Integral of the norm of v [m].
    chamber_length
        (N,) [m].
    radii
        Of the deformed section.
    shape
        The whole rod.
    segments
        Of several segments, or one that varies: each by itself, base first. Empty for one that is uniform.
    outline
        The radii along the shape, (M,) each, where they are not the same; `radii` are then those at the base [m].
    segment
        (M,) of each point of the shape, from 1, and 0 at the end of a connector behind the last one [1].
    """

    stretch: float
    stable: bool | None
    tip_position: Array
    tip_displacement: Array
    tip_rotation: Array
    bending_angle: float
    tilt: float
    backbone_length: float
    chamber_length: Array
    radii: SectionRadii
    shape: Shape
    segments: tuple[SegmentPose, ...] = ()
    outline: SectionRadii | None = None
    segment: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def parts(self) -> tuple[SegmentPose, ...]:
        """Each segment by itself, the whole where there is one."""
        own = SegmentPose(self.tip_position, self.tip_rotation, self.stretch, self.bending_angle)
        return self.segments or (own,)

    @cached_property
    def fit(self) -> Fit:
        """Whether a body can take the shape, found when it is first asked for."""
        shape = self.shape
        bend, v_z = np.hypot(shape.curvature[:, 0], shape.curvature[:, 1]), shape.shear_extension[:, 2]
        if v_z.min() > 0:
            curvature = bend / v_z
        else:
            curvature = np.full(bend.shape, np.inf)
            np.divide(bend, v_z, out=curvature, where=v_z > 0)
        radii = self.radii if self.outline is None else self.outline
        return fit_of(shape.position, shape.rotation, radii.outer, curvature, self.bending_angle)


@dataclass(frozen=True)
class WeightSensitivity:
    """How the force of `weighted` answers to one weight.

    Attributes
    ----------
    weight
        "force", "moment", "length" or "position".
    value
        The weight used, in `unit` [SI].
    unit
        Of the weight.
    elasticity
        d ln F / d ln W at that value [1].
    """

    weight: str
    value: float
    unit: str
    elasticity: float


@dataclass(frozen=True, eq=False)
class Contact:
    """The wall and what it does to the tip in one step of a blocked force, world frame.

    Attributes
    ----------
    force
        What the wall pushes with, not negative [N].
    normal
        (3,) unit, the direction in which it pushes the robot [1].
    wall_point
        (3,) a point of the wall [m].
    tip_cap
        L_t [m].
    closure
        Which equations closed the problem.
    chamber_reaction
        (N,) T_i, without P A_c [N].
    free
        The free shape at the same pressure and loads.
    gap
        Distance of the free shape's contact point in front of the wall, negative beyond it [m].
    length_error
        e_L, Eq. (14) [m].
    weighted
        What `weighted` left of e_n, e_m, e_L, e_h.
    sensitivity
        Of its force to its weights, where that was asked for.
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

    @property
    def wall(self) -> Contact | None:
        """Itself; None where the chambers alone are constrained, whose contact has no normal."""
        return self if self.normal.any() else None

    @property
    def told_reaction(self) -> Array | None:
        """The reactions (N,); None where the section has no closure, so that there are none [N]."""
        return None if self.closure == NO_CLOSURE else self.chamber_reaction

    @property
    def elasticities(self) -> dict[str, float]:
        """The elasticity of the force to each weight by its name [1]."""
        return {line.weight: line.elasticity for line in self.sensitivity}


@dataclass(frozen=True, eq=False)
class Deviation:
    """Standard deviations of the outputs of a step, to first order.

    Attributes
    ----------
    values
        By the name of the output, a number or an array (entries,) [SI]; NaN where there is none.
    message
        Why there is none of some output, else "".
    """

    values: Mapping[str, Array]
    message: str = ""


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a run: its input, how it ended, and the pose when it was solved.

    Attributes
    ----------
    pressure
        (sets,) gauge [Pa].
    status, message
        How it ended, and what that means.
    time
        As given with the pressures [s].
    pose
        None where it was not solved; of a blocked force it is the blocked shape.
    residual
        Largest scaled equation error [1], or None when nothing was evaluated.
    certificate
        Every equation's own.
    discretisation_error
        Estimated tip position error over L_0 [1].
    intervals, iterations
        Of the grid and of every attempt that led here.
    solve_time
        Of the step [s].
    warnings
        What to know of the pose.
    contact
        Of a blocked force, else None.
    aimed
        Of inverse kinematics, else None.
    engine
        Which engine solved it, of `Numerics`; None without a solution.
    ipopt
        What IPOPT said, None where it took no part.
    deviation
        Where uncertainties were given, else None.
    moving
        Of a run in time, else None.
    contacts
        Of obstacles, one each.
    complementarity
        Sum of what each contact pushes with times its gap, None without obstacles [N m].
    margins
        Of a path, else None.
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
    engine: str | None = None
    ipopt: Ipopt | None = None
    deviation: Deviation | None = None
    moving: Moving | None = None
    contacts: tuple[ObstacleContact, ...] = ()
    complementarity: float | None = None
    margins: Margins | None = None


@dataclass(frozen=True, eq=False)
class Run:
    """A finished study: what was asked and its steps.

    Attributes
    ----------
    study
        As a scenario names it.
    robot, material, coefficients, conventions, loads
        As given.
    steps
        In order.
    title
        As given.
    warnings
        Of the robot.
    contact
        Of a blocked force, else None.
    uncertainty
        What scatters and how much, by the keys of a scenario and in their units; empty where nothing was said.
    obstacles
        What the body may touch, or keeps away from along a path.
    limits
        Of a path, by keys with their units; empty for any other run.
    """

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
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    obstacles: tuple[Obstacle, ...] = ()
    limits: Mapping[str, Any] = field(default_factory=dict)

    _repr_html_ = rich_html

    @property
    def failed(self) -> tuple[Step, ...]:
        """The steps that carry no solution."""
        return tuple(s for s in self.steps if not s.status.has_solution)

    @property
    def energy(self) -> dict[str, float]:
        """(entries,) the balance of energy of a run in time at its last solved step, empty for any other [J]."""
        moving = [step.moving for step in self.steps if step.moving is not None]
        return dict(moving[-1].energy) if moving else {}
