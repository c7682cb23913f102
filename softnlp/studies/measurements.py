"""What a person measured: a robot's pose and blocked force at each pressure, and what a scenario asks of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.base.units import DEGREE
from softnlp.model.laws import Law
from softnlp.model.materials import Material
from softnlp.model.outlined import require_round_layout
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.segments import require_one_segment
from softnlp.studies.check import Check
from softnlp.studies.fit_statistics import repeats
from softnlp.studies.forward import pressure_table
from softnlp.studies.registration import Registration

Array = NDArray[np.float64]

POSE_COLUMNS = ("tip_x", "tip_y", "tip_z", "bending_angle", "elongation")
ORIENTATION = tuple(f"orientation_{axis}" for axis in "xyz")
COLUMNS = (*POSE_COLUMNS, *ORIENTATION, "blocked_force")
"""What can be measured, one number each; m, rad, N. An orientation is the turn from the one measured, so 0 of that."""

OBSERVABLES: Mapping[str, tuple[str, ...]] = {
    "tip_position": ("tip_x", "tip_y", "tip_z"),
    "bending_angle": ("bending_angle",),
    "elongation": ("elongation",),
    "orientation": ORIENTATION,
    "blocked_force": ("blocked_force",),
}
RELATIVE_NOISE = 0.01  # of what is measured, where nothing is said of its noise
ORIENTATION_NOISE = DEGREE  # where nothing is said of that of orientations
_NO_QUATERNION = 0.1  # away from a length of 1
_FLOOR = 0.1  # of an observable's root mean square: smaller numbers count as if they were this large


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was measured of one robot, a row a measurement; nan where a number was not measured. World frame.

    Attributes
    ----------
    robot
        Whose it is.
    pressure
        (rows, sets) gauge [Pa].
    tip_position
        (rows, 3) [m].
    bending_angle
        (rows,) integral of the curvature over the backbone [rad].
    elongation
        (rows,) backbone length - L_0 [m].
    blocked_force
        (rows,) [N]; the tip is free in the other observables of the same row.
    sigma
        Standard deviation of an observable by name, a number or (rows,) [m, rad or N]; by default 1 % of each number,
        where those below a tenth of the observable's root mean square over this robot's rows count as that tenth does.
    weight
        (rows,) of the squared misfit [1]; 1 by default.
    label
        Of the robot in results.
    tilt
        (rows,) angle between the tip's axis and +z [rad]; it can be compared, not fitted.
    orientation
        Of the sensor of the tip in the frame of the positions: (rows, 4) quaternions x, y, z, w, or (rows, 3) the
        directions of its z axis [1]. Its sigma is that of the turn about each axis, 1 deg by default.
    """

    robot: Robot
    pressure: Any
    tip_position: Any = None
    bending_angle: Any = None
    elongation: Any = None
    blocked_force: Any = None
    sigma: Mapping[str, Any] = field(default_factory=dict)
    weight: Any = None
    label: str = ""
    tilt: Any = None
    orientation: Any = None


@dataclass(frozen=True, eq=False)
class Observed:
    """A table of measurements of one robot.

    Attributes
    ----------
    robot
        Whose they are.
    label
        Of the robot in results.
    pressure
        (rows, sets) gauge [Pa].
    values
        (rows, numbers) in the order that they were asked for in [m, rad, N]; nan where nothing was measured.
    axes
        (rows, 9) the sensor's rotation by columns [1], any about a direction; that of none where nothing was measured.
    whole
        (rows,) whether the rotation was measured, 1, or the direction alone, 0; nan for neither [1].
    """

    robot: Robot
    label: str
    pressure: Array
    values: Array
    axes: Array
    whole: Array

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Which entries of `values` there are, (rows, numbers) [1]."""
        return np.asarray(np.isfinite(self.values))


@dataclass(frozen=True, eq=False)
class Data(Observed):
    """Checked measurements of one robot.

    Attributes
    ----------
    robot, label
        Whose they are, and what results call it.
    pressure
        (rows, sets) gauge [Pa].
    values
        (rows, 9) in the order of `COLUMNS` [m, rad or N]; nan where not measured.
    axes, whole
        (rows, 9) and (rows,) as of `Observed` [1].
    sigma
        (rows, 9) as `values`, their standard deviations [m, rad or N].
    root_weight
        (rows,) what a residual is multiplied by [1].
    """

    sigma: Array
    root_weight: Array

    @property
    def fitted(self) -> NDArray[np.bool_]:
        """Which entries of `values` count in a fit, (rows, 9) [1]."""
        return self.measured & (self.root_weight[:, None] > 0)

    def of(self, observable: str) -> Array:
        """Return the columns of an observable.

        Parameters
        ----------
        observable
            A name of `OBSERVABLES`.

        Returns
        -------
        array
            (rows, columns), three of a tip position and one of others [m, rad or N].
        """
        return self.values[:, column_slice(observable)]


def column_slice(observable: str) -> slice:
    """Return where an observable stands in `COLUMNS`."""
    parts = OBSERVABLES[observable]
    first = COLUMNS.index(parts[0])
    return slice(first, first + len(parts))


def checked_measurements(given: Measurements) -> Data:
    """Return measurements as arrays, or raise `InputError` naming what is not right."""
    if given.tilt is not None:
        raise InputError("expected none: a tilt can be compared, not fitted", key="tilt")
    found = observed(given, COLUMNS)
    rows = len(found.pressure)
    weight = np.ones(rows) if given.weight is None else number_array(given.weight, (rows,), "weight")
    if not np.all(weight >= 0):
        raise InputError("expected weights that are not negative", key="weight")
    data = Data(**vars(found), sigma=np.ones_like(found.values), root_weight=np.sqrt(weight))
    return replace(data, sigma=_sigmas(data, given.sigma))


def observed(given: Measurements, columns: Sequence[str]) -> Observed:
    """Return what was measured, a tip's three columns first, or raise `InputError` naming what is not right."""
    require_one_segment(given.robot, "what takes measurements")
    require_round_layout(given.robot, "what takes measurements")
    check(given.robot, allow=LOWERABLE_RULES)
    P = pressure_table(given.pressure, given.robot.chamber_sets)
    values = np.full((len(P), len(columns)), np.nan)
    names = ("tip_position", *(name for name in columns[3:] if not name.startswith("orientation")))
    for k, name in enumerate(names):
        if (value := getattr(given, name)) is not None:
            shape, place = ((len(P),), columns.index(name)) if k else ((len(P), 3), slice(3))
            values[:, place] = number_array(value, shape, name)
    axes, whole = _oriented(given.orientation, len(P))
    for k, name in enumerate(columns):
        if name.startswith("orientation"):  # about the axis of a direction nothing was measured
            values[:, k] = np.where(whole == 1, 0.0, np.nan) if name == ORIENTATION[-1] else 0.0 * whole
    if not np.any(np.isfinite(values)):
        raise InputError(f"expected at least one number of {', '.join(names)}", key="measurements")
    return Observed(given.robot, given.label or given.robot.name, P, values, axes, whole)


def _oriented(given: Any, rows: int) -> tuple[Array, Array]:
    """Return `Observed.axes` and `Observed.whole` of quaternions (rows, 4), directions (rows, 3), or None."""
    from scipy.spatial.transform import Rotation

    axes, whole = np.tile(np.eye(3).ravel(), (rows, 1)), np.full(rows, np.nan)
    if given is None:
        return axes, whole
    columns = np.shape(given)[1] if np.ndim(given) == 2 else 4
    found = number_array(given, (rows, 3 if columns == 3 else 4), "orientation")
    known = np.isfinite(found).all(axis=1)
    size = np.linalg.norm(found[known], axis=1)
    if not np.all(size > 0) or (columns == 4 and np.any(np.abs(size - 1) > _NO_QUATERNION)):
        raise InputError("expected quaternions x, y, z, w of length 1, or directions", key="orientation")
    if columns == 4:
        turns = Rotation.from_quat(found[known]).as_matrix() if np.any(known) else np.zeros((0, 3, 3))
    else:
        turns = np.array([Rotation.align_vectors([d], [[0, 0, 1]])[0].as_matrix() for d in found[known]])
    axes[known] = turns.reshape(-1, 3, 3).transpose(0, 2, 1).reshape(-1, 9)
    whole[known] = columns == 4
    return axes, whole


def _sigmas(data: Data, given: Mapping[str, Any]) -> Array:
    """Return the standard deviation of every number measured."""
    sigma = np.full_like(data.values, np.nan)
    for key in given:
        if key not in OBSERVABLES:
            raise InputError(f"unknown observable{nearest(key, OBSERVABLES)}", key=f"sigma.{key}")
    for observable in OBSERVABLES:
        values = data.of(observable)
        if not np.any(np.isfinite(values)):
            continue
        squares = np.nansum(values**2, axis=1)
        where = np.any(np.isfinite(values), axis=1)
        column = RELATIVE_NOISE * np.sqrt(squares + _FLOOR**2 * np.mean(squares[where]))
        if observable == "orientation":
            column = np.full_like(column, ORIENTATION_NOISE)
        if observable in given:
            stated = np.asarray(given[observable], float)
            if stated.shape not in ((), (len(values),)):
                raise InputError(f"expected a number or {len(values)} of them", key=f"sigma.{observable}")
            column = np.where(np.isnan(stated), column, stated)
        if not np.all(column[where] > 0) or not np.all(np.isfinite(column[where])):
            if observable not in given:
                raise InputError("expected a number that is not 0, or a standard deviation of these", key=observable)
            raise InputError("expected standard deviations above 0", key=f"sigma.{observable}")
        sigma[:, column_slice(observable)] = column[:, None]
    return sigma


def repeated_numbers(data: Sequence[Data]) -> NDArray[np.intp]:
    """Return a number for each number that is fitted, in order, the same for one that was measured again exactly."""
    found = []
    for k, d in enumerate(data):
        rows = repeats(d.pressure, d.values, d.axes, d.sigma, d.root_weight)
        each = np.column_stack([np.full(d.values.size, k), np.repeat(rows, d.values.shape[1])])
        columns = np.tile(np.arange(d.values.shape[1]), len(rows))
        found.append(np.column_stack([each, columns])[d.fitted.ravel()])
    return repeats(np.concatenate(found).astype(float))


def number_array(value: Any, shape: tuple[int, ...], key: str) -> Array:
    """Return an array of a shape whose entries are finite or nan."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError("expected numbers", key=key) from None
    if array.shape != shape:
        raise InputError(f"expected the shape {shape}, a row a measurement, got {array.shape}", key=key)
    if np.any(np.isinf(array)):
        raise InputError("expected finite numbers, or nan where nothing was measured", key=key)
    return array


@dataclass(frozen=True, eq=False)
class TensileTask:
    """Laws to fit to a tensile test.

    stretch, stress : (points,), [-] and engineering [Pa], of every file. file_of_point : (points,) from 0. files : as
    they were named. name, density : of the silicone. start : of a person's law, SI. before : to compare with, or None.
    stretch_range : (2,) as asked for, or None. dropped : how many points lay outside of it. checks : of the specimen.
    notes : on files of a laboratory: what was guessed and left out.
    """

    stretch: Array
    stress: Array
    file_of_point: NDArray[np.intp]
    files: tuple[str, ...]
    laws: tuple[Law, ...]
    name: str
    density: float
    start: Mapping[str, float] | None
    before: Material | None
    stretch_range: tuple[float, float] | None = None
    dropped: int = 0
    checks: tuple[Check, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def data_stretch(self) -> tuple[float, float]:
        """The least and the largest stretch of the points [1]."""
        return float(np.min(self.stretch)), float(np.max(self.stretch))

    @property
    def about(self) -> str:
        """How many points there are, and their stretches, in words."""
        low, high = self.data_stretch
        return f"{self.stretch.size} points, stretch {low:.4g} to {high:.4g}"

    @property
    def left_out(self) -> str:
        """What is said of points that the range asked for leaves out, "" where there is none."""
        asked = self.stretch_range
        return "" if asked is None else f"; {self.dropped} points outside stretch = {list(asked)}"

    def step_count(self, pressures: int) -> int:
        """Return one: it is solved as a whole."""
        return 1


@dataclass(frozen=True, eq=False)
class RobotTask:
    """Constants to identify from measurements of robots.

    measurements : of each robot. free : names of constants. bounds : by name, SI. columns : the header of the file.
    cells : for each robot and row, the cells of the file as they were read. notes : on readings that count as 0,
    and on files of a laboratory. registration : of the tips, None where they are those of the model.
    """

    measurements: tuple[Measurements, ...]
    free: tuple[str, ...]
    bounds: Mapping[str, tuple[float, float]]
    columns: tuple[str, ...]
    cells: tuple[tuple[tuple[str, ...], ...], ...]
    notes: tuple[str, ...] = ()
    registration: Registration | None = None

    def step_count(self, pressures: int) -> int:
        """Return one: it is solved as a whole."""
        return 1
