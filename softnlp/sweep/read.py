"""Reading a finished sweep, `workspace.nc`: the columns that are needed, in SI, as flat arrays; or all, as CSV."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS, by_key, outputs
from softnlp.base.errors import InputError, nearest
from softnlp.base.files import placed_whole
from softnlp.base.reading import one_line
from softnlp.base.status import Status
from softnlp.model.inputs import robot_of_attributes, silicone_of_attributes
from softnlp.model.robot import Robot

WORKSPACE_FILE = "workspace.nc"
STATUSES: tuple[Status, ...] = tuple(Status)
_PRESSURE, _TIP, _BENDING, _ROTATION = (
    OUTPUTS[name] for name in ("pressure", "tip_position", "bending_angle", "tip_rotation")
)
_SLAB = 65_536  # poses read at a time where a column is not kept as it is in the file
_BLOCK = 16_384  # poses written at a time


@dataclass(frozen=True, eq=False)
class Workspace:
    """A finished sweep of N poses; SI, world frame, NaN where a pose has no solution. The arrays are read-only.

    file : where it was read from. material : its name and law. attributes : global ones of the file, tables parsed.
    pressure : (N, sets) [Pa]. status : (N,) positions in `STATUSES`. tip_position : (N, 3) [m].
    tip_axis : (N, 3) third column of the tip's rotation. bending_angle : (N,) [rad].
        stable : (N,) of `softnlp.statics.step.STABLE_FLAGS`. self_intersecting : (N,) 1, 0, or -1 without a solution.
    residual : (N,), known of failed poses too. time : (N,) [s] or None.
    """

    file: Path
    title: str
    robot: Robot
    material: str
    attributes: Mapping[str, Any]
    pressure: Array
    status: NDArray[np.int8]
    tip_position: Array
    tip_axis: Array
    bending_angle: Array
    stable: NDArray[np.int8]
    self_intersecting: NDArray[np.int8]
    residual: Array
    time: Array | None

    @property
    def poses(self) -> int:
        """The number of poses N, solved or not."""
        return len(self.status)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Which poses carry a solution (N,)."""
        return np.array([status.has_solution for status in STATUSES])[self.status]

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Gravity of the poses (3,) [m/s^2]; of a varied size the direction alone counts."""
        x, y, z = self.attributes["loads"]["gravity_m_per_s2"]
        return float(x), float(y), float(z)

    @property
    def tilt(self) -> Array:
        """The angle between tip axis and +z (N,) [rad]."""
        x, y, z = self.tip_axis.T
        return np.asarray(np.arctan2(np.hypot(x, y), z))

    def count(self, status: Status) -> int:
        """Return how many poses ended with a status."""
        return int(np.count_nonzero(self.status == STATUSES.index(status)))


@dataclass(frozen=True, eq=False)
class Column:
    """A number of every pose, in the unit that its name ends in. values : (N,), NaN where there is none."""

    name: str
    unit: str
    meaning: str
    values: Array


def load_workspace(path: str | PathLike[str]) -> Workspace:
    """Return the sweep of a `workspace.nc`; `path` is that file or its folder.

    Raises
    ------
    InputError
        On one line, when there is no such file or it is not one of a sweep.
    """
    file = workspace_file(path)
    with _opened(file) as data:
        N = _poses(data)
        status = _statuses(data, N)
        solved = np.array([s.has_solution for s in STATUSES])[status]
        pressure = _numbers(data, _PRESSURE.key, (N, -1)) * _PRESSURE.scale
        attributes = _attributes(data)
        robot = robot_of_attributes(attributes)
        if pressure.shape[1] != robot.chamber_sets:
            raise ValueError(f"pressures of {pressure.shape[1]} sets for a robot of {robot.chamber_sets}")
        tip = _numbers(data, _TIP.key, (N, 3)) * _TIP.scale
        axis = _third_columns(data, N)
        bending = _numbers(data, _BENDING.key, (N,)) * _BENDING.scale
        stable, through = (
            np.array(data[name][:], dtype=np.int8) if name in data else np.full(N, -1, np.int8)
            for name in ("stable", "self_intersecting")
        )
        residual = _numbers(data, "residual", (N,))
        time = _numbers(data, "t_s", (N,)) if "t_s" in data else None
    stable[~solved] = through[~solved] = -1
    for known in (tip, axis, bending):
        known[~solved] = np.nan
        if np.isnan(known[solved]).any():
            raise InputError("a pose is solved but its numbers are missing", source=str(file))
    arrays = (pressure, status, tip, axis, bending, stable, through, residual, *(() if time is None else (time,)))
    for array in arrays:
        array.setflags(write=False)
    return Workspace(
        file=file,
        title=str(attributes.get("title") or file.parent.name),
        robot=robot,
        material=", ".join(silicone_of_attributes(attributes)),
        attributes=attributes,
        pressure=pressure,
        status=status,
        tip_position=tip,
        tip_axis=axis,
        bending_angle=bending,
        stable=stable,
        self_intersecting=through,
        residual=residual,
        time=time,
    )


def workspace_file(path: str | PathLike[str]) -> Path:
    """Return the `workspace.nc` of a folder, or the file itself.

    Raises
    ------
    InputError
        When there is none.
    """
    file = Path(path)
    if file.is_dir():
        file = file / WORKSPACE_FILE
    if not file.is_file():
        raise InputError(f"expected a folder with {WORKSPACE_FILE} or such a file; there is none", source=str(file))
    return file


def column_names(workspace: Workspace) -> tuple[str, ...]:
    """Return the name of every number of a pose that the file holds, one for each component of a vector."""
    with _opened(workspace.file) as data:
        return tuple(_columns(data))


def read_column(workspace: Workspace, name: str) -> Column:
    """Return one number of every pose.

    name : of a variable of the file; for vectors with the index before the unit, as in CSV: `p1_bar`,
    `tip_position_x_mm`, `chamber_length_2_mm`.

    Raises
    ------
    InputError
        For a name that the file does not hold; the text has the nearest one.
    """
    with _opened(workspace.file) as data:
        known = _columns(data)
        if name not in known:
            hint = nearest(name, known)
            raise InputError(
                f"expected a number of the poses, got {one_line(name)!r}{hint}", source=str(workspace.file)
            )
        variable, index = known[name]
        values = np.asarray(data[variable][(slice(None), *index)], dtype=float)
        unit, meaning = (
            str(_text(data[variable].attrs.get(key, other))) for key, other in (("units", "1"), ("long_name", name))
        )
    if variable in _POSE_NUMBERS:
        values[~workspace.solved] = np.nan
    return Column(name, unit, meaning, values)


def read_block(workspace: Workspace, names: Sequence[str], rows: slice) -> list[NDArray[Any]]:
    """Return some rows of columns as they stand in the file, NaN where a pose has no solution.

    Raises
    ------
    InputError
        When the file is no longer what it was.
    """
    hidden = ~workspace.solved[rows]
    blocks: dict[str, Any] = {}
    found = []
    with _opened(workspace.file) as data:
        known = _columns(data)
        for name in names:
            variable, index = known[name]
            if variable not in blocks:
                blocks[variable] = np.asarray(data[variable][rows])
            values = blocks[variable][(..., *index)]
            if variable in _POSE_NUMBERS and values.dtype.kind == "f":
                values = np.where(hidden, np.nan, values)
            found.append(values)
    return found


def export_csv(workspace: Workspace, path: str | PathLike[str]) -> Path:
    """Write every number of every pose, with status, under its name in the file; empty where there is none.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    names = column_names(workspace)
    words = np.array([status.value for status in STATUSES], dtype=object)
    with placed_whole(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["pose", "status", *names])
        for start in range(0, workspace.poses, _BLOCK):
            rows = slice(start, min(start + _BLOCK, workspace.poses))
            cells: list[list[Any]] = [
                list(range(rows.start + 1, rows.stop + 1)),
                words[workspace.status[rows]].tolist(),
            ]
            cells += [_cells(column) for column in read_block(workspace, names, rows)]
            table.writerows(zip(*cells, strict=True))
    return Path(path)


def _cells(values: Any) -> list[Any]:
    """Return numbers as CSV has them: rounded to 12 digits, empty for NaN."""
    if values.dtype.kind != "f":
        return list(values.tolist())
    return ["" if value != value else float(f"{value:.12g}") for value in values.tolist()]


_POSE_NUMBERS = tuple(output.key for output in (*outputs("pose", "wall"), OUTPUTS["discretisation_error"]))
"""What a pose without a solution does not have, whatever the file says; the rest is what was asked, or how it went."""


@contextmanager
def _opened(file: Path) -> Iterator[Any]:
    """Open a file for reading; whatever is not as a sweep writes it is one line."""
    import h5py

    try:
        with h5py.File(file, "r") as data:
            yield data
    except PermissionError as error:
        raise InputError(f"cannot be read: {error.strerror}", source=str(file)) from None
    except InputError as error:
        raise error.located(source=str(file)) from None
    except (OSError, KeyError, ValueError, TypeError, AttributeError) as error:
        reason = one_line(" ".join(str(error).split()), 160)
        raise InputError(
            f"expected a {WORKSPACE_FILE} of a sweep; this is not one ({reason})", source=str(file)
        ) from None


def _poses(data: Any) -> int:
    """Return the number of poses, or raise for a file of something else."""
    if _TIP.key in data and OUTPUTS["position"].key in data:
        raise InputError(f"expected a {WORKSPACE_FILE} of a sweep; this is a run's, which `softnlp plot run` draws")
    missing = [name for name in _NEEDED if name not in data]
    if missing:
        raise InputError(f"expected a {WORKSPACE_FILE} of a sweep; this has no {', '.join(missing)}")
    N = int(data["status"].shape[0])
    if not N:
        raise InputError("expected at least one pose, got none")
    return N


_NEEDED = (_PRESSURE.key, "status", *(o.key for o in (_TIP, _ROTATION, _BENDING)), OUTPUTS["residual"].key)


def _attributes(data: Any) -> dict[str, Any]:
    """Return the global attributes, those that hold JSON parsed."""
    found: dict[str, Any] = {}
    for name, value in data.attrs.items():
        text = _text(value)
        found[name] = json.loads(text) if isinstance(text, str) and text[:1] in "[{" and text else text
    return found


def _numbers(data: Any, name: str, shape: tuple[int, ...]) -> Array:
    """Return a variable as floats; -1 in the shape is any size."""
    found = data[name]
    if found.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, found.shape, strict=True)):
        raise ValueError(f"{name} has the shape {found.shape}")
    values = np.empty(found.shape)
    if values.size:
        found.read_direct(values)
    return values


def _third_columns(data: Any, N: int) -> Array:
    """Return the tip axes without holding all rotations in memory."""
    rotation = data["tip_rotation"]
    if rotation.shape != (N, 3, 3):
        raise ValueError(f"tip_rotation has the shape {rotation.shape}")
    axes = np.empty((N, 3))
    for start in range(0, N, _SLAB):
        axes[start : start + _SLAB] = rotation[start : start + _SLAB][:, :, 2]
    return axes


def _statuses(data: Any, N: int) -> NDArray[np.int8]:
    """Return the statuses as positions in `STATUSES`."""
    codes = np.empty(N, np.int8)
    position = {status.value.encode(): k for k, status in enumerate(STATUSES)}
    for start in range(0, N, _SLAB):
        words = np.asarray(data["status"][start : start + _SLAB])
        if words.ndim == 2:
            words = np.ascontiguousarray(words).view(f"S{words.shape[1]}")[:, 0]
        for word in set(words.tolist()):
            text = word if isinstance(word, bytes) else str(word).encode()
            if text not in position:
                raise ValueError(f"unknown status {text.decode(errors='replace')!r}")
            codes[start : start + len(words)][words == word] = position[text]
    return codes


def _columns(data: Any) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Return (variable, index after the pose) of every number of a pose, by the name of its column."""
    columns = {}
    for variable in sorted(data):
        found = data[variable]
        if variable == "pose" or getattr(found, "dtype", np.dtype("O")).kind not in "fiu" or not _is_per_pose(found):
            continue
        output = by_key(variable)
        for index in np.ndindex(*found.shape[1:]):
            if output is not None and len(output.entries) == len(index):
                name = output.entry(index)
            else:
                name = "_".join([variable, *(str(k + 1) for k in index)])
            columns[name] = variable, index
    return columns


def _text(value: Any) -> Any:
    """Return text of characters, or of type `string` as version 0.1 wrote it."""
    return value.decode() if isinstance(value, bytes) else value


def _is_per_pose(found: Any) -> bool:
    """Whether the first dimension is `pose`."""
    if not found.ndim:
        return False
    scales = found.dims[0]
    return found.name == "/pose" or (len(scales) > 0 and str(scales[0].name).lstrip("/") == "pose")
