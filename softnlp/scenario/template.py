"""A scenario to begin with: every key of a study with its unit, default and meaning, and what runs as it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from softnlp.base.columns import OUTPUTS
from softnlp.base.files import toml_key, toml_text
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.materials import Material, material
from softnlp.model.robot import DIMENSIONS, Robot, robot
from softnlp.model.segments import SegmentedRobot
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.describe import Key, about, keys_of

ROBOT, SILICONE, LAW = "D25L60", "Ecoflex 00-50", "mooney-rivlin"
MEASURED = "measured_angles.csv"
"""The data that a scenario of `identify` begins with: those of the package."""

_WIDTH = 36  # of a key and its value, before the comment
_POSE = (0.3, 0.1, 0.2)  # whose tip is the target of an example [bar]


def template(study: str, name: str = ROBOT, data: str = MEASURED) -> str:
    """Return a scenario of a study that runs as it is; what is optional is commented out.

    name : of a robot of the library. data : the file that `identify` reads.

    Raises
    ------
    RobotError
        When there is no such robot.
    """
    made = robot(name)
    values = begun(study, made, data)
    lines = [
        f"# A scenario of study {study!r}: what stands here without # in front runs as it is.",
        "# Take the # away from what you need; a table needs its [name] too. docs/scenario.md says more.",
        "",
    ]
    head = {"title": f"{name}, {study}", "study": study}
    for key in keys_of(SCHEMAS[study]):
        if key.table is None:
            lines.append(_line(f"{key.name} = {toml_text(head[key.name])}", key.comment))
        else:
            lines += ["", *table_lines(key, values.get(key.name), examples(made))]
    return "\n".join(lines) + "\n"


def example_table(study: str, table: str, values: Mapping[str, Any], made: Robot) -> str:
    """Return one table of `template`; values : of `begun`."""
    key = next(key for key in keys_of(SCHEMAS[study]) if key.name == table)
    return "\n".join(table_lines(key, values[table], examples(made)))


def examples(made: Robot) -> dict[str, str]:
    """Return values that fit a robot, as TOML by the keys of the file."""
    found = {}
    for dimension in DIMENSIONS:
        value = getattr(made, dimension.field)
        if dimension.scale is None:
            found[f"robot.{dimension.file_key}"] = str(value)
            found[f"choices.robot.{dimension.file_key}"] = f"[{value}, {value + 1}]"
        else:
            size = round(value / dimension.scale, 6)
            found[f"robot.{dimension.file_key}"] = found[f"robots.mine.{dimension.file_key}"] = toml_text(size)
            found[f"choices.robot.{dimension.file_key}"] = f"{{ from = {0.9 * size:.4g}, to = {1.1 * size:.4g} }}"
    return found


def table_lines(key: Key, values: Mapping[str, Any] | None, fit: Mapping[str, str], place: str = "") -> Iterator[str]:
    """Yield the lines of a table; values : of its keys that are set, None where the whole table is left out."""
    assert key.table is not None
    place = place or (f"{key.name}.mine" if key.named else key.name)
    off = "# " if values is None else ""
    head, count = (f"[[{place}]]", "one or more: ") if key.several else (f"[{place}]", "")
    count = "several, each with a name: " if key.named else count
    yield f"{off}{head}".ljust(_WIDTH) + f"  # {count}{about(key.table)}"
    later = []
    for one in keys_of(key.table):
        value = None if values is None else values.get(one.name)
        if not one.is_short:
            later.append((one, value))
            continue
        text = fit.get(f"{place}.{one.name}", one.example) if value is None else toml_text(value)
        mark = "# " if value is None else ""
        yield _line(f"{mark}{toml_key(one.name)} = {text}", one.comment)
        if one.table is not None and key.name != "requirements":
            yield from (f"#   {part.name}: {part.comment}" for part in keys_of(one.table))
    for one, value in later:
        yield ""
        yield from table_lines(one, value, fit, f"{place}.{one.name}")


def _line(text: str, comment: str) -> str:
    return f"{text.ljust(_WIDTH)}  # {comment}" if comment else text


def begun(study: str, made: Robot, data: str, silicone: Material | None = None) -> dict[str, Any]:
    """Return the values of the tables that a scenario of a study begins with; silicone : None is that of `template`."""
    own = {"robot": {"name": made.name}, "material": {"name": SILICONE, "model": LAW}}
    return {**own, **_BEGUN[study](made, data, silicone or material(SILICONE, LAW))}


def _forward(made: Robot, data: str, silicone: Material) -> dict[str, Any]:
    return {"pressure": {"ramp": {"sets": [1], "to_bar": 0.5, "steps": 6}}}


def _blocked(made: Robot, data: str, silicone: Material) -> dict[str, Any]:
    contact = {"offset_mm": 0.0} | ({"closure": "free"} if isinstance(made, SegmentedRobot) else {})
    return {**_forward(made, data, silicone), "contact": contact}


def _inverse(made: Robot, data: str, silicone: Material) -> dict[str, Any]:
    """Take for the target where the tip of this robot goes, so that it is within reach."""
    from softnlp.studies.forward import forward

    pressure = [(_POSE * made.chamber_sets)[k] * BAR for k in range(made.chamber_sets)]
    pose = forward(made, silicone, [pressure]).steps[0].pose
    assert pose is not None
    tip = [round(float(x) / MILLIMETRE, 1) + 0.0 for x in pose.tip_position]
    return {"target": {"tip_position_mm": [tip]}, "bounds": {"pressure_bar": [0.0, 1.5]}}


def _trajectory(made: Robot, data: str, silicone: Material) -> dict[str, Any]:
    """Take a path about where the tip of this robot goes, so that it is within reach."""
    (tip,) = _inverse(made, data, silicone)["target"]["tip_position_mm"]
    rows = [[round(tip[0] + k, 1), tip[1], tip[2]] for k in (0.0, 0.5, 1.0)]
    return {
        "trajectory": {"tip_position_mm": rows, "duration_s": 2.0, "rate_bar_per_s": 0.2},
        "bounds": {"pressure_bar": [0.0, 1.5]},
    }


def _identify(made: Robot, data: str, silicone: Material) -> dict[str, Any]:
    return {
        "stiffening": {"set": "calibrated"},
        "measurements": {"file": data, "free": ["k_e", "k_b", "phi"]},
        "sigma": {OUTPUTS["bending_angle"].key: 10.0},
    }


def _design(made: Robot, data: str, silicone: Material) -> dict[str, Any]:
    length = round(made.length / MILLIMETRE, 6)
    return {
        "choices": {"robot": {"length_mm": [0.8 * length, length]}, "material": {"name": [SILICONE, "Ecoflex 00-30"]}},
        "actuation": {"pressure_bar": 0.5, "sets": [1]},
        "requirements": {"stretch": {"at_most": 1.5}},
        "objective": {"maximise": OUTPUTS["bending_angle"].key},
    }


def _dynamic(made: Robot, data: str, silicone: Material) -> dict[str, Any]:
    rows = [[0.0] * made.chamber_sets, [0.3, *[0.0] * (made.chamber_sets - 1)]]
    return {
        "pressure": {"sequence_bar": rows, "t_s": [0.0, 0.1]},
        "dynamic": {"duration_s": 0.5, "damping_s": 0.005, "output_step_s": 0.02},
    }


_BEGUN: Mapping[str, Callable[[Robot, str, Material], dict[str, Any]]] = {
    "forward": _forward,
    "blocked-force": _blocked,
    "workspace": lambda made, data, silicone: {"workspace": {"levels": 4, "to_bar": 0.5}},
    "inverse": _inverse,
    "identify": _identify,
    "design": _design,
    "dynamic": _dynamic,
    "trajectory": _trajectory,
}
"""What a scenario of each study begins with beside robot and silicone."""
