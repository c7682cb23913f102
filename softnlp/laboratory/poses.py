"""The sensors of a tracker's file: position and quaternion of each, and the rows in which it was not seen."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, listed
from softnlp.base.reading import shown
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.table import RawTable, in_si
from softnlp.laboratory.units import UNITS, unit_named

Array = NDArray[np.float64]

_POSITION = re.compile(r"^(?:tip[ _.]?|pos(?:ition)?[ _.]?|t|p)?([xyz])(?:[ _.]?(\w{1,12}))?$", re.IGNORECASE)
_TURN = r"q(?:uat(?:ernion)?)?|rotation|orientation"
_QUATERNION = re.compile(rf"^(?:{_TURN})[ _.:/]?([ow0-4xyzrs])(?:[ _.]?(\w{{1,12}}))?$", re.IGNORECASE)
_PREFIXED = re.compile(
    rf"^(.+?)[ _.:/]+(?:pos(?:ition)?[ _.:/]+)?(t?[xyz]|q[ow0-4xyz]|(?:{_TURN})[ _.:/][wxyz])$", re.IGNORECASE
)
_STATE = re.compile(r"state|status", re.IGNORECASE)
_SEEN = ("ok", "valid", "visible", "tracked", "enabled", "good", "1", "true")
_TOOL = re.compile(r"^(tool|sensor|body|marker|rigid ?body|port ?handle|tool ?info|name)s?\b", re.IGNORECASE)
_LENGTH_UNIT = re.compile(r"length ?units? {0,3}[:=]? {0,3}([a-zµ]+)", re.IGNORECASE)
_REACH = (1e-3, 3.0)  # [m]: how far a tip moves in a test
_SHORT = 0.04  # [m]: a robot for which positions in mm may as well be in cm
_CAPPED = 0.3  # the correlation of how high tips are with the square of how far out
_FLAT, _ROUND = 0.03, 0.3  # of the largest standard deviation: tips in a plane; tips all around
FARTHEST = 10.0  # [m]: beyond what any tracker sees


@dataclass(frozen=True, eq=False)
class Sensor:
    """position : (rows, 3) [m]. quaternion : (rows, 4) x, y, z, w, or None. seen : (rows,)."""

    name: str
    position: Array
    quaternion: Array | None
    seen: NDArray[np.bool_]
    order: str = ""

    @property
    def spread(self) -> float:
        """How far it moves [m]."""
        seen = self.position[self.seen]
        return float(np.linalg.norm(np.ptp(seen, axis=0))) if len(seen) else 0.0


def pose_groups(table: RawTable) -> dict[str, tuple[list[int], list[int], str]]:
    """Return the columns x, y, z and of the quaternion of each sensor by its name, and the order of the latter.

    The order is "wxyz" or "xyzw" as the names say, "" where they are only numbered.
    """
    positions: dict[str, dict[str, int]] = {}
    quaternions: dict[str, dict[str, int]] = {}
    seen: Counter[str] = Counter()
    loads = bool(table.named(r"^f[xyz]$"))
    for k, name in enumerate(table.names):
        if not table.is_number(k) or (table.units[k] is not None and table.units[k] not in _LENGTHS):
            continue
        if loads and re.match(r"^[tm][xyz]$", name, re.IGNORECASE):
            continue  # a moment
        repeat = seen[name.lower()]
        seen[name.lower()] += 1
        again = f"{repeat + 1}" if repeat else ""
        if (found := _PREFIXED.match(name)) and not _POSITION.match(name) and not _QUATERNION.match(name):
            tool, plain = found[1], found[2]
        else:
            tool, plain = "", name
        if found := _QUATERNION.match(plain):
            quaternions.setdefault(f"{tool}{found[2] or ''}{again}", {})[found[1].lower()] = k
        elif found := _POSITION.match(plain):
            positions.setdefault(f"{tool}{found[2] or ''}{again}", {})[found[1].lower()] = k
    made: dict[str, tuple[list[int], list[int], str]] = {}
    whole = {tool: q for tool, q in quaternions.items() if len(q) == 4}
    for tool, parts in positions.items():
        if len(parts) < 3:
            continue
        q = whole.get(tool, next(iter(whole.values())) if len(whole) == 1 and len(positions) == 1 else {})
        columns = sorted(q.values())
        made[tool] = (
            [parts[axis] for axis in "xyz"],
            columns,
            _order([next(n for n in q if q[n] == c) for c in columns]),
        )
    return made


_LENGTHS = tuple(unit for unit in UNITS.values() if unit.kind in ("length", "ratio"))


def _order(letters: Sequence[str]) -> str:
    """Return the order that the letters of a quaternion's columns say."""
    word = "".join(letters)
    if word in ("1234", "0123") or not word:
        return "wxyz" if word == "0123" else ""
    plain = word.replace("o", "w").replace("0", "w").replace("r", "w").replace("s", "w").replace("4", "w")
    return plain if sorted(plain) == sorted("wxyz") else ""


def sensors(table: RawTable, choices: Choices) -> dict[str, tuple[RawTable, Sensor]]:
    """Return every sensor of a file by its name, with the rows of the file that are its own.

    Raises
    ------
    AskError
        Where the unit of the positions is not known.
    InputError
        For a file without positions.
    """
    groups = pose_groups(table)
    scale = _scale(table, [places for places, _, _ in groups.values()], choices)
    if not groups:
        raise InputError(f"{table.file}: expected columns x, y, z of a tracker; it has {listed(table.names)}")
    found: dict[str, tuple[RawTable, Sensor]] = {}
    for tool, part in _by_tool(table, choices).items():
        for suffix, group in groups.items():
            name = " ".join(word for word in (tool, suffix) if word) or "tip"
            found[name] = part, _sensor(part, name, group, scale, choices)
    return found


def _by_tool(table: RawTable, choices: Choices) -> dict[str, RawTable]:
    """Return the rows of each tool of a file that has a column for its name, by that."""
    for k, name in enumerate(table.names):
        cells = table.columns[k]
        if _TOOL.match(name):
            tools = list(dict.fromkeys(cells if not table.is_number(k) else cells.tolist()))
            if 1 < len(tools) <= 20 and 2 * len(tools) <= table.rows:
                choices.read.add((table.file, name))
                named = {tool: tool if isinstance(tool, str) else f"{tool:g}" for tool in tools}
                return {named[tool]: table.kept(np.array([cell == tool for cell in cells])) for tool in tools}
    return {"": table}


def _sensor(
    table: RawTable, name: str, group: tuple[list[int], list[int], str], scale: float, choices: Choices
) -> Sensor:
    """Return a sensor; scale : of positions without a unit [m]."""
    places, turns, order = group
    columns = [in_si(table, k, "length", choices, "position") for k in places]
    choices.read |= {(table.file, table.names[k]) for k in turns}
    raw = np.column_stack([table.columns[k] for k in places])
    q = np.column_stack([table.columns[k] for k in turns]) if turns else None
    seen = np.all(np.isfinite(raw), axis=1) & ~_placeholders(raw) & _state(table, min([*places, *turns]), choices)
    if q is not None:
        norm = np.linalg.norm(np.nan_to_num(q), axis=1)
        seen &= np.isfinite(q).all(axis=1) & (norm > 0.5)
        seen &= ~((raw == 0).all(axis=1) & (norm < 0.5))
    else:
        zeros = (raw == 0).all(axis=1)
        seen &= ~zeros | bool(np.mean(zeros) > 0.5)
    known = [column for column in columns if column is not None]
    position = np.column_stack(known) if len(known) == 3 else raw * scale
    seen &= np.linalg.norm(position, axis=1) < FARTHEST
    asked = choices.get("quaternion")
    if q is not None and asked is not None:
        if asked not in ("wxyz", "xyzw"):
            raise InputError(f"expected 'wxyz' or 'xyzw', got {shown(asked)}", key="quaternion")
        order = str(asked)
    return Sensor(name, position, q if q is None else _as_xyzw(q, order or "wxyz"), seen, order)


def _placeholders(raw: Array) -> NDArray[np.bool_]:
    """Return which rows hold one number three times, beyond all others: -9999 and the like stand for a lost sensor."""
    same = (raw == raw[:, :1]).all(axis=1) & (raw[:, 0] != 0)
    others = raw[~same & np.isfinite(raw).all(axis=1)]
    beyond: NDArray[np.bool_] = same & (np.abs(raw[:, 0]) > np.max(np.abs(others), initial=0.0)) & bool(len(others))
    return beyond


def _as_xyzw(q: Array, order: str) -> Array:
    """Return quaternions x, y, z, w of columns in another order."""
    return q[:, [order.index(letter) for letter in "xyzw"]]


def _state(table: RawTable, first: int, choices: Choices) -> NDArray[np.bool_]:
    """Return in which rows the words of the state column nearest to a sensor's first column say that it was seen."""
    words = {
        k: [str(cell).strip().lower() for cell in table.columns[k]]
        for k, name in enumerate(table.names)
        if _STATE.search(name) and not table.is_number(k)
    }
    telling = [k for k, cells in words.items() if any(cell in _SEEN for cell in cells)]
    if not telling:
        return np.ones(table.rows, bool)
    nearest = min(telling, key=lambda k: abs(first - k))
    choices.read.add((table.file, table.names[nearest]))
    return np.array([cell in _SEEN for cell in words[nearest]])


def _scale(table: RawTable, places: Sequence[list[int]], choices: Choices) -> float:
    """Return the unit [m] of positions without one: what the preamble says, else that in which a tip moves as far."""
    without = [group for group in places if any(table.units[k] is None for k in group)]
    asked = choices.get("unit.position")
    if not without or asked is not None:
        return 1.0  # `in_si` takes it
    said = _LENGTH_UNIT.search(" ".join(table.preamble))
    unit = None if said is None else unit_named(said[1])
    if said is not None and unit is not None and unit.kind == "length":
        return UNITS[str(choices.take("unit.position", unit.name, f"{shown(said[0])} of the preamble"))].scale
    size = 0.0
    for group in without:
        raw = np.column_stack([table.columns[k] for k in group])
        seen = raw[np.isfinite(raw).all(axis=1) & ~_placeholders(raw) & (raw != 0).any(axis=1)]
        if len(seen):
            size = max(size, *(float(np.linalg.norm(v)) for v in (np.ptp(seen, axis=0), np.median(seen, axis=0))))
    likely = [u for u in ("mm", "m") if _REACH[0] <= size * UNITS[u].scale <= _REACH[1]]
    if size * UNITS["mm"].scale < _SHORT < size * UNITS["cm"].scale:
        likely.append("cm")
    if len(likely) != 1:
        raise AskError(
            f"{table.file}: its positions have no unit and lie within {size:.4g}: --set unit.position=mm, or cm, m"
        )
    reason = f"the positions lie within {size:.4g}, {size * UNITS[likely[0]].scale:.3g} m"
    return UNITS[str(choices.take("unit.position", likely[0], reason))].scale


def tip_and_base(found: Mapping[str, Sensor], choices: Choices) -> tuple[str, str | None]:
    """Return which sensor is at the tip and which one at the base, where there is one.

    Raises
    ------
    AskError
        Where neither the settings nor what moves tells.
    """
    names = list(found)
    tip, base = choices.get("tip"), choices.get("base")
    for key, asked in (("tip", tip), ("base", base)):
        if asked is not None and asked not in names:
            raise InputError(f"expected a sensor of {listed(names)}, got {shown(asked)}", key=key)
    if tip is None and base is None and len(names) == 2:
        still, moves = sorted(names, key=lambda name: found[name].spread)
        if found[still].spread < 0.2 * found[moves].spread:
            spreads = (
                f"it moves by {1e3 * found[still].spread:.3g} mm, sensor {moves} by {1e3 * found[moves].spread:.3g}"
            )
            base = choices.take("base", still, spreads)
            tip = moves
    if tip is None:
        others = [name for name in names if name != base]
        if len(others) != 1:
            raise AskError(
                f"which sensor is at the tip? There are {listed(names)}: --set tip={names[-1]}, --set base={names[0]}"
            )
        tip = others[0]
    return str(tip), None if base is None else str(base)


def order_misfits(sensor: Sensor) -> dict[str, float]:
    """Return how far turns are from being about an axis across the motion, 0 to 1, by the order of the quaternion.

    A robot without a load bends in a plane: the axis of the turn from the first pose to another is normal to the path
    of its tip, wherever the sensor sits and however it is turned.
    """
    from scipy.spatial.transform import Rotation

    q, p = sensor.quaternion, sensor.position
    if q is None:
        return {}
    q, p = q[sensor.seen], p[sensor.seen]
    other = "xyzw" if sensor.order != "xyzw" else "wxyz"
    w_first = np.roll(q, 1, axis=1)
    misread = w_first if other == "xyzw" else np.roll(q, -1, axis=1)
    found = {}
    for order, turned in ((sensor.order or "wxyz", q), (other, misread), ("inverse", q * [-1, -1, -1, 1])):
        R = Rotation.from_quat(turned / np.linalg.norm(turned, axis=1)[:, None])
        axis = (R * R[0].inv()).as_rotvec()
        moved = p - p[0]
        turn, far = np.linalg.norm(axis, axis=1), np.linalg.norm(moved, axis=1)
        used = (turn > 0.1) & (far > 0.2 * far.max())
        if np.sum(used) < 3:
            return {}
        cosine = np.abs(np.sum(axis * moved, axis=1)[used]) / (turn * far)[used]
        found[order] = float(np.mean(cosine))
    return found


def turn_sense(position: Array, quaternion: Array) -> float | None:
    """Return the mean cosine between where a tip moves and where it turns the z axis to, None where it hardly turns.

    position : (rows, 3), of a robot along z at rest. quaternion : (rows, 4) x, y, z, w.
    """
    from scipy.spatial.transform import Rotation

    R = Rotation.from_quat(quaternion)
    turned = np.cross((R * R[0].inv()).as_rotvec(), [0.0, 0.0, 1.0])[:, :2]
    moved = (position - position[0])[:, :2]
    turn, far = np.linalg.norm(turned, axis=1), np.linalg.norm(moved, axis=1)
    used = (turn > 0.1) & (far > 0.2 * far.max())
    if np.sum(used) < 3:
        return None
    return float(np.mean(np.sum(turned * moved, axis=1)[used] / (turn * far)[used]))


def motion_axis(position: Array, rest: Array) -> tuple[Array, bool] | None:
    """Return the unit vector of a robot at rest, by how its tips (rows, 3) lie, and whether it may lie in all a plane.

    Tips that bend all around lie on a cap, thin along the robot, which rises towards the rest tip; those of one plane
    tell its normal, which the robot is across. None where they tell neither.
    """
    if len(position) < 3:
        return None
    centred = position - position.mean(axis=0)
    _, size, axes = np.linalg.svd(centred, full_matrices=False)
    size = size / max(size[0], 1e-30)
    if size[2] < _FLAT and size[1] > 2 * size[2]:
        return axes[2], True
    if size[1] < _ROUND or size[2] > 0.6 * size[1]:
        return None
    along = centred @ axes[2]
    away = np.linalg.norm(centred @ axes[:2].T - (rest - position.mean(axis=0)) @ axes[:2].T, axis=1)
    rises = -float(np.corrcoef(along, away**2)[0, 1])
    # a robot that grows longer while it bends may lie on no cap: the rest tip then says on which side it is
    return axes[2] * np.sign(rises if abs(rises) > _CAPPED else float(axes[2] @ rest)), False
