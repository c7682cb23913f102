"""The folder that a study leaves behind, and a run as figures see it: the same, in SI, just solved and read back."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS, outputs
from softnlp.base.errors import InputError
from softnlp.base.files import make_folder, write_whole
from softnlp.base.status import Status
from softnlp.model.inputs import loads_of_table, robot_of_attributes, silicone_of_attributes, versions
from softnlp.model.obstacle_tables import obstacles_of_tables
from softnlp.model.obstacles import Obstacle
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.results.body import Body, body_of_pose, chain_body
from softnlp.results.dataset import netcdf_bytes
from softnlp.results.document import json_text, require_run
from softnlp.results.path import PATH_FILE, path_text
from softnlp.results.table import table_text
from softnlp.statics.step import ObstacleContact, Run, SectionRadii
from softnlp.studies.fields import (
    AIMED,
    BLOCKED_FORCE,
    DYNAMIC,
    closure_of,
    deviation_outputs,
    series,
    si_value,
    solved_pose,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

RESULTS_FILE = "results.nc"
DEVIATING = ("bending_angle", "elongation", "blocked_force")
"""What figures draw with a band of one standard deviation, where there is one."""


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
class MovingView:
    """What a run in time has beside its poses; NaN where a step has no solution.

    tip : (S, 3) [m]. regulator : (S, sets) [Pa]. energy : (S,) by the names of `softnlp.dynamics.energy.Energy` [J].
    """

    tip: Array
    regulator: Array
    energy: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class RunView:
    """A run as figures see it; S steps, NaN and None where a step has no solution.

    material : its name and law. pressure : (S, sets) [Pa]. time : (S,) [s] or None.
    stable : (S,) of `STABLE_FLAGS`, undefined where unsolved. stretch : (S,). bending_angle : (S,) [rad].
    backbone_length : (S,) [m]. bodies : S entries. contact : of a blocked force, else None. targets : of inverse
    kinematics, else None. moving : of a run in time, else None. std : standard deviations (S,) of outputs by name
    [SI], none where nothing scatters.
    limits : of a path, by keys with their units; empty for any other run.
    obstacles : what the body may touch. contact_force : (S, obstacles) size of what each pushes with [N], or None.
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
    moving: MovingView | None = None
    std: Mapping[str, Array] = field(default_factory=dict)
    obstacles: tuple[Obstacle, ...] = ()
    contact_force: Array | None = None
    limits: Mapping[str, Any] = field(default_factory=dict)

    @property
    def solved(self) -> tuple[int, ...]:
        """Indices of the steps that carry a solution."""
        return tuple(k for k, body in enumerate(self.bodies) if body is not None)


def view_of_run(run: Run) -> RunView:
    """Return the view of a run."""
    sizes = {"axis": 3, "set": run.robot.chamber_sets}
    times = [float("nan") if step.time is None else step.time for step in run.steps]

    def body(k: int, prefix: str) -> Body | None:
        pose, contact = solved_pose(run.steps[k]), run.steps[k].contact
        if prefix and pose is not None:
            pose = None if contact is None else contact.free
        return None if pose is None else body_of_pose(pose)

    known = {output.name for output in deviation_outputs(run)}
    return _view(
        lambda name: series(OUTPUTS[name], run.steps, sizes, si_value),
        body,
        [closure_of(run, step) for step in run.steps],
        title=run.title,
        study=run.study,
        material=_material_label(run.material.name, run.material.law.name),
        conventions=run.conventions.name,
        robot=run.robot,
        loads=run.loads,
        status=tuple(step.status for step in run.steps),
        pressure=np.array([step.pressure for step in run.steps], dtype=float),
        time=None if np.all(np.isnan(times)) else np.array(times),
        std=[name for name in DEVIATING if f"std_{name}" in known],
        obstacles=run.obstacles,
        contact_force=_pushed([step.contacts for step in run.steps], len(run.obstacles)),
        limits=run.limits,
    )


_ASKED = ("segment", "robot", "chamber", "body", "material")


def view_of_dataset(dataset: xr.Dataset) -> RunView:
    """Return the view of a dataset of `to_dataset`, as it is in memory or read back.

    Raises
    ------
    KeyError, ValueError, TypeError
        When a variable or an attribute is missing or not what `to_dataset` writes.
    """
    attributes = dataset.attrs
    asked = {name: json.loads(attributes[name]) for name in _ASKED if name in attributes}
    values = {str(name): variable.values for name, variable in dataset.variables.items()}

    def number(name: str) -> Any:
        found, scale = values[OUTPUTS[name].key], OUTPUTS[name].scale
        return found if scale == 1.0 else found * scale

    def body(k: int, prefix: str) -> Body | None:
        position = number(f"{prefix}position")[k]
        points = np.isfinite(position).all(axis=1)
        if not points.any():
            return None
        names = [field.name for field in fields(SectionRadii)]
        place, turn = position[points], number(f"{prefix}rotation")[k][points]
        if OUTPUTS["along_segment"].key in values and not prefix:
            along = {name: number(f"along_{name}_radius")[k][points] for name in names}
            return chain_body(place, turn, along, number("along_segment")[k][points].astype(int))
        radii = {name: float(number(f"{name}_radius")[k]) for name in names}
        return Body(place, turn, SectionRadii(**radii))

    return _view(
        number,
        body,
        values.get("closure", ()),
        title=str(attributes["title"]),
        study=str(attributes["study"]),
        material=_material_label(*silicone_of_attributes(asked)),
        conventions=str(attributes["conventions"]),
        robot=robot_of_attributes(asked),
        loads=loads_of_table(json.loads(attributes["loads"])),
        status=tuple(Status(str(word)) for word in values["status"]),
        pressure=number("pressure"),
        time=values.get(OUTPUTS["t"].key),
        std=[name for name in DEVIATING if OUTPUTS[f"std_{name}"].key in values],
        obstacles=obstacles_of_tables(json.loads(attributes["obstacles"])) if "obstacles" in attributes else (),
        contact_force=np.linalg.norm(values["contact_force_N"], axis=2) if "contact_force_N" in values else None,
        limits=json.loads(attributes["limits"]) if "limits" in attributes else {},
    )


def _view(number: Callable[[str], Any], body: Callable[[int, str], Body | None], closures: Any, **head: Any) -> RunView:
    """Return a view.

    number : an output of every step by name, SI. body : of a step, with "free_" its free shape. head : the other
    fields, `std` as the names of what has standard deviations.
    """
    solved = [status.has_solution for status in head["status"]]
    contact = targets = moving = None
    if head["study"] == DYNAMIC:
        energies = {
            output.name.removeprefix("energy_"): number(output.name)
            for output in outputs("motion")
            if output.name.startswith("energy_")
        }
        moving = MovingView(number("tip_position"), number("regulator"), energies)
    if head["study"] in AIMED:
        targets = TargetView(*map(number, ("target", "target_direction", "distance", "direction_error", "nearest")))
    if head["study"] == BLOCKED_FORCE and (known := np.flatnonzero(np.isfinite(number("blocked_force")))).size:
        contact = ContactView(
            closure=str(closures[known[0]]),
            force=number("blocked_force"),
            gap=number("gap"),
            wall_point=number("wall_point"),
            normal=number("wall_normal"),
            tip_cap=float(number("tip_cap")[known[0]]),
            free_bending_angle=number("free_bending_angle"),
            free=tuple(body(k, "free_") if k in known else None for k in range(len(solved))),
        )
    return RunView(
        **{**head, "std": {name: np.asarray(number(f"std_{name}"), dtype=float) for name in head["std"]}},
        **{name: number(name) for name in ("stable", "stretch", "bending_angle", "backbone_length")},
        bodies=tuple(body(k, "") if solution else None for k, solution in enumerate(solved)),
        contact=contact,
        targets=targets,
        moving=moving,
    )


def _pushed(contacts: Sequence[Sequence[ObstacleContact]], count: int) -> Array | None:
    """Return the size of the force of each obstacle (S, obstacles) [N], NaN without a solution; None without any."""
    if not count:
        return None
    found = np.full((len(contacts), count), np.nan)
    for k, step in enumerate(contacts):
        for j, contact in enumerate(step):
            found[k, j] = np.linalg.norm(contact.force)
    return found


def _material_label(name: str, law: str) -> str:
    return f"{name}, {law}"


def save(
    run: Run,
    directory: str | PathLike[str],
    *,
    scenario_text: str | None = None,
    figure: Callable[[RunView], Figure] | None = None,
) -> list[Path]:
    """Write a run to a folder, made where missing; each file whole or not at all.

    Parameters
    ----------
    run
        Of any study that returns one.
    directory
        Gets results.nc, table.csv, results.json and versions.json, of a path path.csv as well; files of those names
        are replaced.
    scenario_text
        What was asked, kept as scenario.toml.
    figure
        Draws the run, `softnlp.figures.run_figure` for instance; kept as figure.png. Drawn last, so that an error of
        drawing leaves the numbers.

    Returns
    -------
    list
        The files written.

    Raises
    ------
    InputError
        When the folder or a file cannot be written, and for the result of another study, naming what takes it.
    """
    run = require_run(run, "softnlp.save")
    # The numbers are all made before the first file is written, so that an error leaves no half of the new results.
    contents: dict[str, str | bytes] = {
        RESULTS_FILE: netcdf_bytes(run),
        "table.csv": table_text(run),
        "results.json": json_text(run),
    }
    if run.limits and all(step.margins is not None for step in run.steps):  # no part of a path that was stopped
        contents[PATH_FILE] = path_text(run)
    written = write_files(directory, contents, scenario_text)
    if figure is not None:
        png = io.BytesIO()
        figure(view_of_run(run)).savefig(png, format="png")
        written.append(write_whole(Path(directory) / "figure.png", png.getvalue()))
    return written


def write_files(
    directory: str | PathLike[str], contents: Mapping[str, str | bytes], scenario_text: str | None = None
) -> list[Path]:
    """Write what a study found to a folder, made where missing, with what computed it and what was asked."""
    folder = make_folder(directory)
    every = {**contents, "versions.json": json.dumps(versions(), indent=2) + "\n"}
    if scenario_text is not None:
        every["scenario.toml"] = scenario_text
    for name in every:  # before the first of them is written
        if (folder / name).is_dir():
            raise InputError("cannot be written: Is a directory", source=str(folder / name))
    return [
        write_whole(folder / name, found.encode() if isinstance(found, str) else found) for name, found in every.items()
    ]


def load_run(path: str | PathLike[str]) -> RunView:
    """Return the view of a run that `save` wrote; `path` is its folder or its results.nc.

    Raises
    ------
    InputError
        When there is no such file or it is not one that `save` wrote.
    """
    import xarray as xr

    file = Path(path)
    if file.is_dir():
        file = file / RESULTS_FILE
    if not file.is_file():
        raise InputError(f"expected a folder with {RESULTS_FILE} or such a file; there is none", source=str(file))
    try:
        return view_of_dataset(xr.load_dataset(file, engine="h5netcdf"))
    except PermissionError as error:
        raise InputError(f"cannot be read: {error.strerror}", source=str(file)) from None
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"expected a {RESULTS_FILE} of a run; this is not one ({error})", source=str(file)) from None
