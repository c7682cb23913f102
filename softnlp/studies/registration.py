"""Registration: from the tip of the model to the sensor that was measured, in one problem with the constants.

measured = t + R Rz(clock) (p + R_tip o), with the frame (t, R) of the robot's base in that of the tracker, the clock by
which the chamber sets are turned about the base's axis, and the place o of the sensor in the tip's frame. The sensor's
orientation is R Rz(clock) R_tip S, with its axes S in the tip's frame; what is left of it is twice the sine of half the
angle from the one measured, about the axis of that turn. Rotations are a reference times the Cayley transform of half
the rotation vector (Gibbs-Rodrigues), which is smooth where it is 0.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity, quantity
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.model.quantities import LOADS
from softnlp.model.rod import Loads

Array = NDArray[np.float64]

PREFIX = "registration."
_HALF_TURN = 1e-6  # squared cosine of half an angle, below which it is half a turn
_TURN, _MOVE = 0.1, 0.01  # typical sizes [rad], [m]
_AXES = "xyz"
_GROUPS = {
    "frame": tuple(f"frame_{kind}{axis}" for kind in ("rotation_", "") for axis in _AXES),
    "tip_offset": tuple(f"tip_offset_{axis}" for axis in _AXES),
    "clock": ("clock",),
    "tip_sensor": tuple(f"tip_sensor_rotation_{axis}" for axis in _AXES),
}
NAMES = tuple(name for names in _GROUPS.values() for name in names)
"""Of the numbers that may be fitted."""
CLOCK = f"{PREFIX}clock"
"""The quantity of the clock."""


@dataclass(frozen=True, eq=False)
class Registration:
    """How the frame of measured tips lies to that of the robot's base.

    Attributes
    ----------
    rotation
        (3, 3) R: from the base's frame to that of the measurements [1].
    translation
        (3,) t: the base's origin in that of the measurements [m].
    tip_offset
        (3,) o: the sensor in the frame of the tip [m].
    clock
        By which the sets are turned about the base's z axis [rad].
    fit
        What is fitted: of "frame", "tip_offset", "clock" and "tip_sensor"; the values given are then where the search
        begins.
    set_order
        Which set of the robot each column of pressures is of, from 1; none where they stand in order.
    tip_sensor
        (3, 3) S: from the sensor's frame to that of the tip [1].
    """

    rotation: Any = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    translation: Any = (0.0, 0.0, 0.0)
    tip_offset: Any = (0.0, 0.0, 0.0)
    clock: float = 0.0
    fit: tuple[str, ...] = ()
    set_order: tuple[int, ...] = ()
    tip_sensor: Any = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def ordered(self, pressure: Array) -> Array:
        """Return measured pressures (rows, sets) in the order of the robot's sets.

        Parameters
        ----------
        pressure
            (rows, sets) as measured [Pa].

        Returns
        -------
        array
            (rows, sets) [Pa].
        """
        return pressure[:, np.argsort(self.set_order)] if self.set_order else pressure

    def table(self) -> dict[str, Any]:
        """Return [registration] of a scenario with these numbers.

        Returns
        -------
        dict
            By the keys of the table [mm, deg].
        """
        found: dict[str, Any] = {
            "frame": "given",
            "rotation_world_from_base_quat_xyzw": [round(v, 12) for v in quaternion_of(self.rotation)],
            "translation_mm": [float(v) / MILLIMETRE for v in self.translation],
            "tip_offset_mm": [float(v) / MILLIMETRE for v in self.tip_offset],
            "clock_deg": float(self.clock) / DEGREE,
        }
        if not np.array_equal(self.tip_sensor, np.eye(3)):
            found["tip_sensor_quat_xyzw"] = [round(v, 12) for v in quaternion_of(self.tip_sensor)]
        return found | ({"set_order": list(self.set_order)} if self.set_order else {})

    def lines(self) -> list[str]:
        """Return `table` as lines of TOML.

        Returns
        -------
        list
            The name of the table, then a line a key.
        """
        return ["[registration]", *(f"{key} = {json.dumps(value)}" for key, value in self.table().items())]

    def in_base(self, place: Array) -> Array:
        """Return places of the sensor (rows, 3) in the frame of the model, before the sets are turned by the clock.

        Parameters
        ----------
        place
            (rows, 3) of the sensor [m].

        Returns
        -------
        array
            (rows, 3) with the clock taken off too [m].
        """
        turn = np.asarray(self.rotation) @ _about_z(self.clock)
        return np.asarray((place - np.asarray(self.translation)) @ turn)

    def in_sets(self, loads: Loads, clock: float | None = None) -> Loads:
        """Return loads of the base's frame in that of the model, whose sets the clock turns.

        Parameters
        ----------
        loads
            In the frame of the base [N, N m, m/s^2].
        clock
            In place of that of the registration [rad].

        Returns
        -------
        Loads
            Turned by the clock about z, the other way [N, N m, m/s^2].
        """
        return turned(loads, -(self.clock if clock is None else clock))

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the numbers that are fitted, in order."""
        return tuple(name for group, names in _GROUPS.items() if group in self.fit for name in names)

    @property
    def acts(self) -> bool:
        """Whether it is more than none at all."""
        still = np.array_equal(self.rotation, np.eye(3)) and not np.any(self.translation)
        still = still and np.array_equal(self.tip_sensor, np.eye(3))
        return bool(self.fit) or not still or bool(np.any(self.tip_offset)) or self.clock != 0

    def found(self, values: Iterable[float]) -> Registration:
        """Return the registration at values of `names` [rad, m], with nothing left to fit.

        Parameters
        ----------
        values
            (numbers,) of `names` [rad, m].

        Returns
        -------
        Registration
            The same, with these numbers.
        """
        given = dict(zip(self.names, (float(v) for v in values), strict=True))
        made = replace(self, fit=())
        if "frame" in self.fit:
            turn = np.array([given[f"frame_rotation_{a}"] for a in _AXES])
            rotation = np.asarray(self.rotation) @ np.asarray(_cayley(ca.DM(turn)))
            made = replace(made, rotation=rotation, translation=np.array([given[f"frame_{a}"] for a in _AXES]))
        if "tip_sensor" in self.fit:
            turn = np.array([given[name] for name in _GROUPS["tip_sensor"]])
            made = replace(made, tip_sensor=np.asarray(self.tip_sensor) @ np.asarray(_cayley(ca.DM(turn))))
        if "tip_offset" in self.fit:
            made = replace(made, tip_offset=np.array([given[f"tip_offset_{a}"] for a in _AXES]))
        return replace(made, clock=given["clock"]) if "clock" in self.fit else made

    def function(self) -> ca.Function:
        """Return (tip (3), rotation of the tip (9, by columns), fitted numbers) -> (sensor, and its derivatives).

        Returns
        -------
        casadi.Function
            Of tip (3) [m], rotation (9) and fitted numbers: the sensor (3) [m], and its derivatives by the three.
        """
        p, turned = ca.SX.sym("tip", 3), ca.SX.sym("rotation", 9)
        g = ca.SX.sym("registration", len(self.names))
        at = dict(zip(self.names, ca.vertsplit(g), strict=True)) if self.names else {}
        o = (
            ca.vertcat(*(at[f"tip_offset_{a}"] for a in _AXES))
            if "tip_offset" in self.fit
            else ca.DM(np.asarray(self.tip_offset, float))
        )
        phi = at.get("clock", self.clock)
        R: Any = ca.DM(np.asarray(self.rotation, float))
        t: Any = ca.DM(np.asarray(self.translation, float))
        if "frame" in self.fit:
            R = R @ _cayley(ca.vertcat(*(at[f"frame_rotation_{a}"] for a in _AXES)))
            t = ca.vertcat(*(at[f"frame_{a}"] for a in _AXES))
        c, s = ca.cos(phi), ca.sin(phi)
        body = p + ca.reshape(turned, 3, 3) @ o
        sensor = t + R @ ca.vertcat(c * body[0] - s * body[1], s * body[0] + c * body[1], body[2])
        slopes = [ca.densify(ca.jacobian(sensor, by)) for by in (p, turned, g)]
        return ca.Function("sensor", [p, turned, g], [sensor, *slopes])

    def orientation(self) -> ca.Function:
        """Return how the sensor is turned from where it was measured, and its derivatives.

        Returns
        -------
        casadi.Function
            Of the rotation of the tip (9, by columns), the sensor's as measured (9), whether it was measured as a whole
            or its z axis alone, 1 or 0, and the fitted numbers: the turn (3) in the sensor's frame [rad], about z only
            where the whole is known; its derivatives by the first and the last.
        """
        turned, measured, whole = ca.SX.sym("rotation", 9), ca.SX.sym("measured", 9), ca.SX.sym("whole")
        g = ca.SX.sym("registration", len(self.names))
        at = dict(zip(self.names, ca.vertsplit(g), strict=True)) if self.names else {}
        R, S = (ca.DM(np.asarray(part, float)) for part in (self.rotation, self.tip_sensor))
        if "frame" in self.fit:
            R = R @ _cayley(ca.vertcat(*(at[name] for name in _GROUPS["frame"][:3])))
        if "tip_sensor" in self.fit:
            S = S @ _cayley(ca.vertcat(*(at[name] for name in _GROUPS["tip_sensor"])))
        phi = at.get("clock", self.clock)
        c, s = ca.cos(phi), ca.sin(phi)
        about = ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))
        E = ca.reshape(measured, 3, 3).T @ R @ about @ ca.reshape(turned, 3, 3) @ S
        of_whole = ca.vertcat(E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]) / 2
        of_axis = ca.vertcat(-E[1, 2], E[0, 2], 0)
        cosine = whole * (ca.trace(E) - 1) / 2 + (1 - whole) * E[2, 2]
        turn = (whole * of_whole + (1 - whole) * of_axis) / ca.sqrt(ca.fmax((1 + cosine) / 2, _HALF_TURN))
        slopes = [ca.densify(ca.jacobian(turn, by)) for by in (turned, g)]
        return ca.Function("orientation", [turned, measured, whole, g], [turn, *slopes])

    def quantities(self) -> list[Quantity]:
        """Return the fitted numbers as quantities of a problem.

        Returns
        -------
        list
            `Quantity` for each of `names`.
        """
        start, scale = self.start(), self.scales()
        pairs = zip(self.names, start, scale, strict=True)
        return [quantity(PREFIX + n, "rad" if s == _TURN else "m", v, scale=float(s)) for n, v, s in pairs]

    def start(self) -> Array:
        """Return where the search begins (numbers,) [rad, m].

        Returns
        -------
        array
            (numbers,) of `names` [rad, m].
        """
        known = {f"frame_{a}": v for a, v in zip(_AXES, self.translation, strict=True)} | {"clock": self.clock}
        known |= {f"tip_offset_{a}": v for a, v in zip(_AXES, self.tip_offset, strict=True)}
        return np.array([float(known.get(name, 0.0)) for name in self.names])

    def scales(self) -> Array:
        """Return typical sizes (numbers,) [rad, m].

        Returns
        -------
        array
            (numbers,) of `names` [rad, m].
        """
        return np.array([_TURN if unit_of(name)[1] == DEGREE else _MOVE for name in self.names])


def rotation_of_quaternion(q: Sequence[float]) -> Array:
    """Return the rotation (3, 3) of a quaternion x, y, z, w of any length but 0."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(np.asarray(q, float)).as_matrix())


def quaternion_of(rotation: Array) -> list[float]:
    """Return the quaternion x, y, z, w of a rotation (3, 3), w not negative."""
    from scipy.spatial.transform import Rotation

    return [float(v) for v in Rotation.from_matrix(np.asarray(rotation, float)).as_quat(canonical=True)]


def unit_of(name: str) -> tuple[str, float]:
    """Return the key that files have for a fitted number, and its unit there in SI."""
    turns = name == "clock" or "rotation" in name
    return (f"{name}_deg", DEGREE) if turns else (f"{name}_mm", MILLIMETRE)


def across(loads: Loads) -> bool:
    """Whether loads are other ones where the sets are turned about z."""
    return any(bool(np.any(np.asarray(getattr(loads, name), float)[:2])) for name in LOADS)


def turned(loads: Loads, angle: float, rate: float | None = None) -> Loads:
    """Return loads turned about z by an angle [rad], or how they change while it does so at a rate."""
    R = _about_z(angle) if rate is None else rate * _about_z(angle + np.pi / 2) @ np.diag([1.0, 1.0, 0.0])
    return Loads(*(R @ np.asarray(getattr(loads, name), float) for name in LOADS))


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _cayley(turn: Any) -> Any:
    """Return the rotation (3, 3) of twice the Gibbs-Rodrigues vector, the rotation vector where it is small."""
    a = turn / 2
    K = ca.skew(a)
    return ca.DM.eye(3) + 2 / (1 + ca.dot(a, a)) * (K + K @ K)
