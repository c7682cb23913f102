"""What a run was asked, as plain tables with unit suffixes, and back for figures; and what computed it."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from softnlp.base.units import BAR, DEGREE, MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.base.units import tidy as tidy
from softnlp.model.body import Segment
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import UNIAXIAL, Coefficients, Conventions
from softnlp.model.gravity import gravity_words
from softnlp.model.materials import Material
from softnlp.model.outline_tables import outline_tables, robot_of_outlines
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.robot import DIMENSIONS, Robot
from softnlp.model.rod import Loads
from softnlp.model.segments import SegmentedRobot, whole_robot

if TYPE_CHECKING:
    from softnlp.model.quantities import Model


def pressure_bar(pressure: Any) -> list[float]:
    """Return pressures [Pa] in bar."""
    return [tidy(p, BAR) for p in pressure]


def robot_table(robot: Robot) -> dict[str, Any]:
    """Return a robot as the `[robot]` table of a scenario with every dimension."""
    table: dict[str, Any] = {"name": robot.name}
    for dimension in DIMENSIONS:
        value = getattr(robot, dimension.field)
        table[dimension.file_key] = int(value) if dimension.scale is None else tidy(value, dimension.scale)
    return table


def section_tables(robot: Robot) -> dict[str, Any]:
    """Return `[robot]`, and the tables beside it that a robot of any section has."""
    return outline_tables(robot) if isinstance(robot, OutlinedRobot) else {"robot": robot_table(robot)}


def robot_of_table(table: Mapping[str, Any]) -> Robot:
    """Return the robot of a `robot_table`; KeyError where a dimension is missing."""
    values: dict[str, Any] = {
        d.field: int(table[d.file_key]) if d.scale is None else float(table[d.file_key]) * d.scale for d in DIMENSIONS
    }
    return Robot(name=str(table["name"]), **values)


def segment_tables(robot: SegmentedRobot) -> list[dict[str, Any]]:
    """Return the segments of a robot as the `[[segment]]` tables of a scenario."""
    found = []
    for segment in robot.segments:
        tables = section_tables(segment.robot)
        for d in DIMENSIONS:
            if (varies := segment.tables.get(f"robot.{d.field}")) is not None:
                s, value = varies
                tables["robot"][d.file_key] = {"s": s.tolist(), "value": [tidy(v, d.scale or 1.0) for v in value]}
        found.append(
            {
                **tables,
                "material": material_table(segment.material),
                "connector_mm": tidy(segment.connector, MILLIMETRE),
                "lines": segment.lines,
                "turn_deg": tidy(segment.turn, DEGREE),
            }
        )
    return found


def robot_of_segments(tables: Sequence[Mapping[str, Any]]) -> SegmentedRobot:
    """Return the robot of `segment_tables`, for its sizes: without silicones; KeyError where one is missing."""
    segments = []
    for table in tables:
        if "chamber" in table:
            segments.append(_segment_of(table, robot_of_outlines(table), {}))
            continue
        sizes, along = dict(table["robot"]), {}
        for d in DIMENSIONS:
            if isinstance(given := sizes[d.file_key], Mapping):
                along[f"robot.{d.field}"] = {"s": given["s"], "value": [v * (d.scale or 1.0) for v in given["value"]]}
                sizes[d.file_key] = given["value"][0]
        segments.append(_segment_of(table, robot_of_table(sizes), along))
    return whole_robot(segments)


def _segment_of(table: Mapping[str, Any], robot: Robot, along: Mapping[str, Any]) -> Segment:
    """Return the segment of one of `segment_tables`, without a silicone."""
    connector, turn = float(table["connector_mm"]) * MILLIMETRE, float(table["turn_deg"]) * DEGREE
    nothing: Any = None
    return Segment(robot, nothing, along=along, connector=connector, lines=table["lines"], turn=turn)


def robot_of_attributes(attributes: Mapping[str, Any]) -> Robot:
    """Return the robot of a file's attributes, parsed; KeyError where one is missing."""
    if "segment" in attributes:
        return robot_of_segments(attributes["segment"])
    if "chamber" in attributes:
        return robot_of_outlines(attributes)
    return robot_of_table(attributes["robot"])


def silicone_of_attributes(attributes: Mapping[str, Any]) -> tuple[str, str]:
    """Return the names of a file's silicones and of their laws, each once."""
    segments = attributes.get("segment")
    tables = [attributes["material"]] if segments is None else [table["material"] for table in segments]
    name, law = (" + ".join(dict.fromkeys(str(table[key]) for table in tables)) for key in ("name", "model"))
    return name, law


def material_table(material: Material) -> dict[str, Any]:
    """Return a material as an inline `[material]` table of a scenario; stresses in MPa."""
    constants = {c.file_key: tidy(material.constants[c.name], c.scale) for c in material.law.constants}
    return {
        "name": material.name,
        "model": material.law.name,
        "constants": constants,
        "density_kg_m3": tidy(material.density),
        "fitted_stretch": [tidy(limit) for limit in material.fitted_stretch],
    }


def coefficients_table(coefficients: Coefficients, *, energy: bool = False) -> dict[str, float]:
    """Return the dimensionless coefficients by name, those of the paper's section or of the energy section."""
    own = [f.name for f in fields(coefficients) if (f.name == "modulus_factor") is energy]
    return {name: tidy(getattr(coefficients, name)) for name in own}


def contact_table(contact: ContactSettings) -> dict[str, Any]:
    """Return the wall and the closure as the `[contact]` table of a scenario; what is left to the study is absent."""
    table: dict[str, Any] = {"closure": contact.closure_name, "tip_cap_mm": tidy(contact.tip_cap, MILLIMETRE)}
    if contact.wall_point is None or contact.wall_normal is None:
        table["offset_mm"] = tidy(contact.offset, MILLIMETRE)
    else:
        table["wall_point_mm"] = [tidy(x, MILLIMETRE) for x in contact.wall_point]
        table["wall_normal"] = [float(x) for x in contact.wall_normal]
    weights = contact.weights
    for key, weight, unit in (
        ("weight_force_per_N", weights.force, 1.0),
        ("weight_moment_per_Nmm", weights.moment, NEWTON_MILLIMETRE),
        ("weight_length_per_mm", weights.length, MILLIMETRE),
        ("weight_position_per_mm", weights.position, MILLIMETRE),
    ):
        if weight is not None:
            table[key] = tidy(weight * unit)
    return table


def conventions_table(conventions: Conventions) -> dict[str, Any]:
    """Return how ambiguous equations were read."""
    table = asdict(conventions)
    rings, _ = table.pop("rings") is not None, table.pop("pressed")
    if conventions.energy:
        return {"name": conventions.name, "rings": rings}
    table["fibre_thickness_mm"] = tidy(table.pop("fibre_thickness"), MILLIMETRE)
    return table


def conventions_of_table(table: Mapping[str, Any]) -> Conventions:
    """Return the conventions of a `conventions_table`; KeyError or TypeError where one is missing.

    Those of the energy section have no rings, which are not known here.
    """
    if table["name"] == UNIAXIAL.name:
        return UNIAXIAL
    values = dict(table)
    values["fibre_thickness"] = float(values.pop("fibre_thickness_mm")) * MILLIMETRE
    return Conventions(**values)


def loads_table(loads: Loads) -> dict[str, Any]:
    """Return the dead loads in the world frame, gravity in words too."""
    return {
        "tip_force_N": [tidy(f) for f in loads.tip_force],
        "tip_moment_Nmm": [tidy(m, NEWTON_MILLIMETRE) for m in loads.tip_moment],
        "gravity_m_per_s2": [tidy(g) for g in loads.gravity],
        "gravity": gravity_words(loads.gravity),
    }


def loads_of_table(table: Mapping[str, Any]) -> Loads:
    """Return the loads of a `loads_table`; KeyError where one is missing."""
    return Loads(
        tip_force=tuple(float(f) for f in table["tip_force_N"]),
        tip_moment=tuple(float(m) * NEWTON_MILLIMETRE for m in table["tip_moment_Nmm"]),
        gravity=tuple(float(g) for g in table["gravity_m_per_s2"]),
    )


def asked_tables(model: Model, loads: Loads) -> dict[str, Any]:
    """Return what was asked of any study as tables by name."""
    robot = {**section_tables(model.robot), "material": material_table(model.material)}
    if isinstance(model.robot, SegmentedRobot):
        robot = {"segment": segment_tables(model.robot)}
    return {
        **robot,
        **({"material_set": model.material.set} if model.material.set else {}),
        "coefficients": coefficients_table(model.coefficients, energy=model.conventions.energy),
        "loads": loads_table(loads),
    }


def file_attributes(
    study: str, model: Model, loads: Loads, contact: ContactSettings | None, own: Mapping[str, Any], **more: str
) -> dict[str, str]:
    """Return the global attributes of a netCDF file, with what was asked as JSON; own, more : those of its study."""
    tables = {
        **asked_tables(model, loads),
        "versions": versions(),
        "conventions_in_full": conventions_table(model.conventions),
        **own,
        **({} if contact is None else {"contact": contact_table(contact)}),
    }
    return {
        "study": study,
        "conventions": model.conventions.name,
        "softnlp": versions()["softnlp"],
        **{name: json.dumps(found, ensure_ascii=False, allow_nan=False) for name, found in tables.items()},
        **more,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def package_version(name: str = "softnlp") -> str:
    """Return the installed version of a package, "unknown" for one that is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"


def versions() -> dict[str, str]:
    """Return what computed the numbers: packages, Python, platform."""
    packages = {name: package_version(name) for name in ("softnlp", "casadi", "numpy", "xarray")}
    return {
        "softnlp": packages.pop("softnlp"),
        "python": platform.python_version(),
        **packages,
        "platform": platform.platform(),
    }
