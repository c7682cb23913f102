"""What a figure of a run needs, as arrays in SI: the same from a run just solved and from its netCDF file."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.model.inputs import loads_of_table, robot_of_table
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.results.targets import INVERSE
from softnlp.statics.step import Contact, Run, SectionRadii, stable_flag
from softnlp.studies.fields import BLOCKED_FORCE, solved_pose

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Body:
    """The body of one solved step.

    position : (M, 3) p [m]. rotation : (M, 3, 3) R, columns are the body axes. radii : of the deformed section.
    """

    position: Array
    rotation: Array
    radii: SectionRadii


@dataclass(frozen=True, eq=False)
class ContactView:
    """The wall of a blocked force, S steps; NaN and None where a step has no solution.

    force, gap : (S,) [N], [m]. wall_point, normal : (S, 3) [m], unit. tip_cap : L_t [m].
    free_bending_angle : (S,) [rad]. free : the free shapes, S entries.
    """

    closure: str
    force: Array
    gap: Array
    wall_point: Array
    normal: Array
    tip_cap: float
    free_bending_angle: Array
    free: tuple[Body | None, ...]

    @property
    def has_wall(self) -> bool:
        """Whether there is a wall; without one the chambers alone are constrained."""
        return bool(np.isfinite(self.normal).any())


@dataclass(frozen=True, eq=False)
class TargetView:
    """The targets of inverse kinematics, S steps; NaN where there is none of a kind, or no pose was found.

    position, direction : (S, 3) of the target [m], unit. distance, angle : (S,) what is left [m], [rad].
    tip : (S, 3) the tip found, also where that is the nearest reachable one only [m].
    """

    position: Array
    direction: Array
    distance: Array
    angle: Array
    tip: Array


@dataclass(frozen=True, eq=False)
class RunView:
    """A run as figures see it; S steps, NaN and None where a step has no solution.

    material : its name and law. pressure : (S, sets) [Pa]. time : (S,) [s] or None.
    stable : (S,) of `STABLE_FLAGS`, undefined where unsolved. stretch : (S,). bending_angle : (S,) [rad].
    backbone_length : (S,) [m]. bodies : S entries. contact : of a blocked force, else None. targets : of inverse
    kinematics, else None.
    """

    title: str
    study: str
    material: str
    conventions: str
    robot: Robot
    loads: Loads
    status: tuple[Status, ...]
    pressure: Array
    time: Array | None
    stable: NDArray[np.int8]
    stretch: Array
    bending_angle: Array
    backbone_length: Array
    bodies: tuple[Body | None, ...]
    contact: ContactView | None = None
    targets: TargetView | None = None

    @property
    def solved(self) -> tuple[int, ...]:
        """Indices of the steps that carry a solution."""
        return tuple(k for k, body in enumerate(self.bodies) if body is not None)


def view_of_run(run: Run) -> RunView:
    """Return the view of a run."""
    poses = [solved_pose(step) for step in run.steps]
    times = [float("nan") if step.time is None else step.time for step in run.steps]

    def series(name: str) -> Array:
        return np.array([float("nan") if pose is None else getattr(pose, name) for pose in poses], dtype=float)

    return RunView(
        title=run.title,
        study=run.study,
        material=_material_label(run.material.name, run.material.law.name),
        conventions=run.conventions.name,
        robot=run.robot,
        loads=run.loads,
        status=tuple(step.status for step in run.steps),
        pressure=np.array([step.pressure for step in run.steps], dtype=float),
        time=None if np.all(np.isnan(times)) else np.array(times),
        stable=np.array([stable_flag(None if pose is None else pose.stable) for pose in poses], np.int8),
        stretch=series("stretch"),
        bending_angle=series("bending_angle"),
        backbone_length=series("backbone_length"),
        bodies=tuple(None if p is None else Body(p.shape.position, p.shape.rotation, p.radii) for p in poses),
        contact=_contact_of_run(run) if run.study == BLOCKED_FORCE else None,
        targets=_targets_of_run(run) if run.study == INVERSE else None,
    )


def _targets_of_run(run: Run) -> TargetView:
    """Return the targets of a run."""

    def series(name: str, size: tuple[int, ...] = ()) -> Array:
        nothing = np.full(size, np.nan)
        values = [None if step.aimed is None else getattr(step.aimed, name) for step in run.steps]
        return np.array([nothing if value is None else value for value in values], dtype=float)

    return TargetView(
        series("position", (3,)),
        series("direction", (3,)),
        series("distance"),
        series("angle"),
        series("tip_position", (3,)),
    )


def _contact_of_run(run: Run) -> ContactView | None:
    """Return the contact of a run; None where no solved step has a wall."""
    contacts = [step.contact if solved_pose(step) is not None else None for step in run.steps]
    known = [contact for contact in contacts if contact is not None]
    if not known:
        return None

    def series(of: Callable[[Contact], Any], size: tuple[int, ...] = ()) -> Array:
        nothing = np.full(size, np.nan)
        return np.array([nothing if c is None else of(c) for c in contacts], dtype=float)

    return ContactView(
        closure=known[0].closure,
        force=series(lambda c: c.force),
        gap=series(lambda c: c.gap if c.normal.any() else np.nan),
        wall_point=series(lambda c: c.wall_point if c.normal.any() else np.full(3, np.nan), (3,)),
        normal=series(lambda c: c.normal if c.normal.any() else np.full(3, np.nan), (3,)),
        tip_cap=known[0].tip_cap,
        free_bending_angle=series(lambda c: c.free.bending_angle),
        free=tuple(
            None if c is None else Body(c.free.shape.position, c.free.shape.rotation, c.free.radii) for c in contacts
        ),
    )


def view_of_dataset(dataset: xr.Dataset) -> RunView:
    """Return the view of a dataset of `to_dataset`, as it is in memory or read back.

    Raises
    ------
    KeyError, ValueError, TypeError
        When a variable or an attribute is missing or not what `to_dataset` writes.
    """
    attributes = dataset.attrs
    material = json.loads(attributes["material"])
    values = {str(name): variable.values for name, variable in dataset.variables.items()}
    steps = range(dataset.sizes["step"])
    status = tuple(Status(str(word)) for word in values["status"])
    return RunView(
        title=str(attributes["title"]),
        study=str(attributes["study"]),
        material=_material_label(material["name"], material["model"]),
        conventions=str(attributes["conventions"]),
        robot=robot_of_table(json.loads(attributes["robot"])),
        loads=loads_of_table(json.loads(attributes["loads"])),
        status=status,
        pressure=values["pressure_bar"] * BAR,
        time=values.get("t_s"),
        stable=values["stable"],
        stretch=values["stretch"],
        bending_angle=values["bending_angle_deg"] * DEGREE,
        backbone_length=values["backbone_length_mm"] * MILLIMETRE,
        bodies=tuple(_body(values, k) if status[k].has_solution else None for k in steps),
        contact=_contact_of_values(values) if str(attributes["study"]) == BLOCKED_FORCE else None,
        targets=_targets_of_values(values) if str(attributes["study"]) == INVERSE else None,
    )


def _targets_of_values(values: Mapping[str, Any]) -> TargetView:
    """Return the targets of a dataset."""
    return TargetView(
        values["target_mm"] * MILLIMETRE,
        values["target_direction"],
        values["distance_mm"] * MILLIMETRE,
        values["direction_error_deg"] * DEGREE,
        values["nearest_mm"] * MILLIMETRE,
    )


def _contact_of_values(values: Mapping[str, Any]) -> ContactView | None:
    """Return the contact of a dataset; None where no solved step has a wall."""
    force = values["blocked_force_N"]
    known = np.flatnonzero(np.isfinite(force))
    if not known.size:
        return None
    return ContactView(
        closure=str(values["closure"][known[0]]),
        force=force,
        gap=values["gap_mm"] * MILLIMETRE,
        wall_point=values["wall_point_mm"] * MILLIMETRE,
        normal=values["wall_normal"],
        tip_cap=float(values["tip_cap_mm"][known[0]]) * MILLIMETRE,
        free_bending_angle=values["free_bending_angle_deg"] * DEGREE,
        free=tuple(_body(values, k, "free_") if np.isfinite(f) else None for k, f in enumerate(force)),
    )


def _body(values: Mapping[str, Any], k: int, shape: str = "") -> Body | None:
    position = values[f"{shape}position_mm"][k]
    points = np.isfinite(position).all(axis=1)
    if not points.any():
        return None
    radii = {
        name: float(values[f"{name}_radius_mm"][k]) * MILLIMETRE
        for name in ("outer", "lumen", "chamber_circle", "chamber", "bore")
    }
    return Body(position[points] * MILLIMETRE, values[f"{shape}rotation"][k][points], SectionRadii(**radii))


def _material_label(name: str, law: str) -> str:
    return f"{name}, {law}"
