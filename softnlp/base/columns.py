"""Every number that comes out, once: name, unit, key, dimensions, meaning and labels.

JSON, CSV, netCDF, tables, figures and the page read this list. A new number is a line here, of an attribute of what a
step holds or of a function of the step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from softnlp.base.units import BAR, DEGREE, MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.base.words import WORDS as WORDS


@dataclass(frozen=True)
class Unit:
    """A unit that numbers are shown in.

    suffix : of keys. si, scale : the unit of SI, and the size of this one in it. label : in tables and on axes.
    attribute : in netCDF, as UDUNITS and Pint read it. sign : on the page.
    """

    suffix: str
    si: str
    scale: float
    label: str
    attribute: str
    sign: str

    def __str__(self) -> str:
        """Return the unit as tables and axes show it."""
        return self.label


ONE = Unit("", "1", 1.0, "1", "1", "")
MM = Unit("mm", "m", MILLIMETRE, "mm", "mm", "mm")
DEG = Unit("deg", "rad", DEGREE, "deg", "degree", "°")
N = Unit("N", "N", 1.0, "N", "N", "N")
NMM = Unit("Nmm", "N m", NEWTON_MILLIMETRE, "N mm", "N mm", "N mm")
PER_M = Unit("per_m", "1/m", 1.0, "1/m", "1/m", "1/m")
BAR_ = Unit("bar", "Pa", BAR, "bar", "bar", "bar")
S = Unit("s", "s", 1.0, "s", "s", "s")
MM_PER_S = Unit("mm_per_s", "m/s", MILLIMETRE, "mm/s", "mm/s", "mm/s")
BAR_PER_S = Unit("bar_per_s", "Pa/s", BAR, "bar/s", "bar/s", "bar/s")
N_PER_MM = Unit("N_per_mm", "N/m", 1e3, "N/mm", "N/mm", "N/mm")
J = Unit("J", "J", 1.0, "J", "J", "J")

_PLACES = {"pose": "pose.", "section": "pose.radii.", "shape": "pose.shape.", "wall": "contact."}
_PLACES |= {"margins": "margins."}
_PLACES |= {"free": "contact.free.shape.", "target": "aimed.", "motion": "moving."}
_AXES = ("axis", "row", "col")


@dataclass(frozen=True)
class Output:
    """A number that comes out.

    name : in Python, where it is in SI. unit : that it is shown in. dims : names of its dimensions after `step`. group
    : what it is a number of. of : the attribute of a step that holds it, by default that of its name in its group; or a
    function of a step. words : on an axis. short : heading of a column, one for each entry. title : of a row on the
    page, with {} for an axis or a number. column : in files of measurements. others : what people call that column.
    pattern : of the keys of entries. form, page : how it is written in a table and on the page.
    """

    name: str
    unit: Unit = ONE
    meaning: str = ""
    dims: tuple[str, ...] = ()
    group: str = ""
    of: str | Callable[[Any], Any] = ""
    words: str = ""
    short: tuple[str, ...] = ()
    title: str = ""
    column: str = ""
    others: tuple[str, ...] = ()
    pattern: str = ""
    form: str = ".2f"
    page: str = ".3f"

    @property
    def key(self) -> str:
        """The name in files, with the unit."""
        return self._with_unit(self.name)

    @property
    def measured(self) -> str:
        """The name in files of measurements, with the unit."""
        return self._with_unit(self.column or self.name)

    @property
    def others_measured(self) -> tuple[str, ...]:
        """Other names in files of measurements, with the unit."""
        return tuple(map(self._with_unit, self.others))

    @property
    def scale(self) -> float:
        """The size of the unit in SI."""
        return self.unit.scale

    def found(self, step: Any) -> Any:
        """Return the number of a step in SI, None where it has none."""
        if callable(self.of):
            return self.of(step)
        found = step
        for name in (self.of or _PLACES.get(self.group, "") + self.name).split("."):
            if found is None:
                return None
            found = found.get(name) if isinstance(found, dict) else getattr(found, name)
        return found

    @property
    def label(self) -> str:
        """The words on an axis."""
        return self.words or self.name.replace("_", " ")

    @property
    def axis(self) -> str:
        """The label of an axis, with the unit."""
        return f"{self.label} [{self.unit}]"

    @property
    def heading(self) -> str:
        """The short label of an axis, with the unit."""
        return self.headings[0].replace("\n", " ")

    @property
    def headings(self) -> tuple[str, ...]:
        """The heading of each column in a table."""
        unit = "" if self.unit is ONE else f"\n[{self.unit}]"
        return tuple(f"{short}{unit}" for short in self.short or (self.label,))

    def _with_unit(self, stem: str) -> str:
        return f"{stem}_{self.unit.suffix}" if self.unit.suffix else stem

    @property
    def entries(self) -> tuple[str, ...]:
        """The dimensions of one pose or one point of a rod."""
        return tuple(d for d in self.dims if d != "s")

    def keys(self, sizes: Mapping[str, int], joint: str = "_") -> list[str]:
        """Return the key of each entry; sizes : of the dimensions."""
        counts = (range(3 if d in _AXES else sizes[d]) for d in self.entries)
        return [self.entry(index, joint) for index in product(*counts)]

    def entry(self, index: Sequence[int], joint: str = "_") -> str:
        """Return the key of an entry, the index before the unit: `tip_position_x_mm`; joint : between two indices."""
        if not index:
            return self.key
        labels = ["xyz"[k] if d in _AXES else str(k + 1) for d, k in zip(self.entries, index, strict=True)]
        return self._with_unit((self.pattern or f"{self.name}_{{}}").format(joint.join(labels)))

    def shown(self, value: Any) -> Any:
        """Return a value of SI in the unit that it is shown in."""
        return value if self.scale == 1.0 else value / self.scale


def written(value: float | None, form: str, nothing: str = "-") -> str:
    """Return a number as a table has it, without a negative zero."""
    if value is None or value != value:
        return nothing
    text = format(value, form)
    return text.removeprefix("-") if float(text) == 0 else text


def _deviation(name: str, step: Any) -> Any:
    return None if step.deviation is None else step.deviation.values.get(name)


_X, _ROTATION, _N = ("axis",), ("row", "col"), ("chamber",)
_TIP = ("tip x", "y", "z")
_EVERY = (
    Output("pressure", BAR_, "gauge pressure of each chamber set", ("set",), pattern="p{}"),
    Output("t", S, "time of the step", of="time", words="time"),
    # --- of the pose
    Output("stretch", ONE, "axial stretch from the pressure balance, Eq. (23)", group="pose",
           title="Stretch from pressure", form=".3f", page=".5f"),
    Output("stable", ONE, "no conjugate point on the rod; undefined under a dead tip moment, in a rod "
           "compressed to nothing and without a solution",
           group="pose"),
    Output("self_intersecting", ONE,
           "curvature times outer radius reaches 1, v_z <= 0, or parts of the body lie inside each other", group="pose",
           of="pose.fit.self_intersecting"),
    Output("tip_position", MM, "tip position in the world frame", _X, "pose", short=_TIP, title="Tip {}"),
    Output("tip_displacement", MM, "tip position against the shape at the same pressure without gravity or tip load",
           _X, "pose", title="Moved by loads, {}"),
    Output("tip_rotation", ONE, "tip rotation; columns are the body axes", _ROTATION, "pose"),
    Output("bending_angle", DEG, "bending angle: integral of sqrt(u_x^2 + u_y^2) over s", group="pose",
           short=("bending",), others=("bending",)),
    Output("tilt", DEG, "angle between the tip axis and +z", group="pose", words="tip tilt", others=("tip_tilt",)),
    Output("backbone_length", MM, "length of the deformed axis: integral of |v| over s", group="pose"),
    Output("chamber_length", MM, "length of each deformed chamber axis", _N, "pose", title="Chamber {}"),
    # --- of a run in time
    Output("tip_velocity", MM_PER_S, "velocity of the tip in the world frame", _X, "motion"),
    Output("regulator", BAR_, "gauge pressure at the regulator of each set; `pressure` is that in the chambers",
           ("set",), "motion", pattern="regulator_p{}"),
    Output("time_steps", ONE, "steps of time since the step before", group="motion", short=("steps",), form=".0f"),
    *(Output(f"energy_{name}", J, meaning, group="motion", of=f"moving.energy.{name}", form=".3g", page=".4g")
      for name, meaning in (
          ("kinetic", "kinetic energy"),
          ("elastic", "energy of wall and held pressures, from the unloaded pose at the pressures of the moment"),
          ("gravity", "energy of the weight, from t = 0"), ("pressure_work", "work of changes of pressure until then"),
          ("load_work", "work of the loads at the tip until then"), ("dissipated", "lost to damping until then"),
          ("numerical", "lost to the rule in time until then"),
          ("imbalance", "what the balance of all of these is off by"),
          ("exchanged", "the largest of them until then"))),
    # --- of each segment, where there are several or one varies
    Output("segment_tip_position", MM, "end of each segment in the world frame, without the connector behind it",
           ("segment", *_X), "segments", lambda step: np.array([part.tip_position for part in step.pose.parts])),
    Output("segment_tip_rotation", ONE, "rotation there; columns are the body axes", ("segment", *_ROTATION),
           "segments", lambda step: np.array([part.tip_rotation for part in step.pose.parts])),
    Output("segment_stretch", ONE, "stretch of each segment, the mean where its section varies", ("segment",),
           "segments", lambda step: np.array([part.stretch for part in step.pose.parts])),
    Output("segment_bending_angle", DEG, "bending angle of each segment", ("segment",), "segments",
           lambda step: np.array([part.bending_angle for part in step.pose.parts])),
    # --- of a blocked force
    Output("blocked_force", N, "force with which the wall pushes the tip, not negative", group="wall",
           of="contact.force", short=("force",), others=("force",), form=".4f", page=".4f"),
    Output("chamber_reaction", N, "reaction T_i of each chamber, without the pressure's P A_c", _N, "wall",
           "contact.told_reaction", title="Reaction {}", page=".4f"),
    Output("gap", MM, "distance of the free shape's contact point in front of the wall, negative beyond it",
           group="wall", of="contact.wall.gap", title="Gap of the free shape"),
    Output("wall_point", MM, "a point of the wall", _X, "wall", "contact.wall.wall_point"),
    Output("wall_normal", ONE, "direction in which the wall pushes the robot", _X, "wall", "contact.wall.normal"),
    Output("tip_cap", MM, "length L_t of the rigid cap on the tip", group="wall"),
    Output("length_error", MM, "sum over the pressurised chambers of free length minus length, Eq. (14)",
           group="wall", title="Length error e_L", page=".4f"),
    Output("free_tip_position", MM, "tip position of the free shape at the same pressure", _X, "wall",
           "contact.free.tip_position"),
    Output("free_bending_angle", DEG, "bending angle of the free shape at the same pressure", group="wall",
           of="contact.free.bending_angle", title="Bending angle, free"),
    *(Output(f"force_elasticity_to_weight_{weight}", ONE,
             f"relative change of the blocked force over that of the weight of {what}", group="weights",
             of=f"contact.elasticities.{weight}")
      for weight, what in (("force", "e_n"), ("moment", "e_m"), ("length", "e_L"), ("position", "e_h"))),
    # --- of the solution
    Output("discretisation_error", ONE, "estimated error of the tip position, of the robot's length L_0",
           group="solve", short=("error",), form=".0e"),
    Output("intervals", ONE, "intervals on the rod, 0 where there is no grid", group="solve"),
    Output("iterations", ONE, "iterations of the solver", group="solve"),
    Output("solve_time", S, "time spent on the step", group="solve", short=("time",), form=".3f"),
    Output("residual", ONE, "largest equation error: force by EI/L^2, moment by EI/L, length by L", group="certificate",
           short=("resid.",), form=".0e"),
    # --- of the section
    Output("outer_radius", MM, "deformed outer radius r_r", group="section", of="pose.radii.outer"),
    Output("lumen_radius", MM, "deformed lumen radius r_i", group="section", of="pose.radii.lumen"),
    Output("chamber_circle_radius", MM, "deformed radius r_cp of the circle of chamber axes", group="section",
           of="pose.radii.chamber_circle"),
    Output("chamber_radius", MM, "radius r_co of the thread", group="section", of="pose.radii.chamber"),
    Output("bore_radius", MM, "deformed bore radius r_ci, Eq. (22)", group="section", of="pose.radii.bore"),
    # --- along the rod
    Output("arc", ONE, "position along the rod s/L, from base to tip", ("s",), "shape"),
    Output("position", MM, "position p of the rod's axis in the world frame", ("s", *_X), "shape", title="Position p"),
    Output("rotation", ONE, "rotation R of the section; columns are the body axes", ("s", *_ROTATION), "shape"),
    Output("force", N, "internal force n in the world frame", ("s", *_X), "shape", title="Internal force n"),
    Output("moment", NMM, "internal moment m in the world frame", ("s", *_X), "shape", title="Internal moment m"),
    Output("shear_extension", ONE, "shear and extension v in the body frame", ("s", *_X), "shape",
           title="Shear and extension v"),
    Output("curvature", PER_M, "curvature u in the body frame", ("s", *_X), "shape", title="Curvature u"),
    *(Output(f"along_{name}_radius", MM, f"radius {letter} along the rod", ("s",), "outline", f"pose.outline.{name}")
      for name, letter in (("outer", "r_r"), ("lumen", "r_i"), ("chamber_circle", "r_cp"), ("chamber", "r_co"),
                           ("bore", "r_ci"))),
    Output("along_segment", ONE, "segment of each point of the rod, from 1; 0 at the end of a last connector", ("s",),
           "outline", "pose.segment"),
    Output("free_position", MM, "position of the free shape's axis in the world frame", ("s", *_X), "free",
           "contact.free.shape.position"),
    Output("free_rotation", ONE, "rotation of the free shape's section; columns are the body axes", ("s", *_ROTATION),
           "free", "contact.free.shape.rotation"),
    # --- of a target, known out of reach too, where the pressures are those of the nearest point
    Output("target", MM, "where the tip is to be", _X, "target", "aimed.position"),
    Output("target_direction", ONE, "where the tip is to point", _X, "target", "aimed.direction"),
    Output("distance", MM, "distance of the tip from its target", group="target", short=("left",), form=".4f"),
    Output("direction_error", DEG, "angle between the tip's axis and the direction it is to have", group="target",
           of="aimed.angle", short=("off",), form=".4f"),
    Output("nearest", MM, "the reachable tip position found", _X, "target", "aimed.tip_position", short=_TIP),
    Output("nearest_direction", ONE, "the tip's axis there", _X, "target", "aimed.tip_direction"),
    Output("optimal", ONE, "whether nothing that was left to choose is better nearby", group="target"),
    # --- of a path: how far a step is from what limits it, known of targets that are not met too
    Output("margin_pressure", BAR_, "least distance of a pressure from its bounds", group="margins",
           of="margins.pressure", form=".3f"),
    Output("margin_rate", BAR_PER_S, "what is left to the largest rate of change of a pressure, on either side",
           group="margins", of="margins.rate", form=".3f"),
    Output("margin_clearance", MM, "distance between body and obstacles, less the clearance", group="margins",
           of="margins.clearance", form=".3f"),
    Output("margin_stiffness", N_PER_MM, "least stiffness of the tip against a force, 0 where the pose ceases to be "
           "stable", group="margins", of="margins.stiffness", form=".4f"),
    # --- standard deviations, where uncertainties were given
    *(Output(f"std_{name}", unit, f"standard deviation of {name.replace('_', ' ')}, first order", dims, "std",
             partial(_deviation, name))
      for name, unit, dims in (
          ("tip_position", MM, _X), ("bending_angle", DEG, ()), ("tilt", DEG, ()), ("backbone_length", MM, ()),
          ("elongation", MM, ()), ("stretch", ONE, ()), ("chamber_length", MM, _N), ("blocked_force", N, ()))),
    # --- of comparisons and designs
    Output("elongation", MM, "length of the deformed axis less that of the robot"),
    *(Output(f"tip_{x}", MM, f"{x} of the tip position", column=x, others=(f"tip_{x}", f"tip_position_{x}"))
      for x in "xyz"),
    *(Output(f"orientation_{x}", DEG, f"{x} of the tip's turn from the one measured, as a rotation vector")
      for x in "xyz"),
    Output("orientation", DEG, "turn of the tip from the one measured", words="turn of the tip from the one measured",
           short=("turn",)),
    Output("tip_deflection", MM, "distance of the tip from the z axis"),
    Output("chamber_gap", MM, "smallest gap between neighbouring reinforced chambers under pressure"),
    *(Output(name, MM, meaning, group="robot") for name, meaning in (
        ("outer_diameter", "outer diameter of the robot"), ("lumen_diameter", "diameter of its central hole"),
        ("chamber_circle_diameter", "diameter of the circle of the chambers' centres"),
        ("chamber_diameter", "diameter of a chamber's bore"), ("chamber_wall", "silicone between bore and thread"),
        ("outer_wall", "silicone between threads and surface"), ("inner_wall", "silicone between threads and lumen"),
        ("wall", "what Eq. (1) leaves of wall"), ("length", "length without pressure"))),
)  # fmt: skip

OUTPUTS: dict[str, Output] = {output.name: output for output in _EVERY}
"""Every output by name."""

TABLES: dict[str, tuple[str, ...]] = {
    "forward": (
        *("bending_angle", "tip_position", "stretch", "stable", "residual", "discretisation_error", "solve_time"),
    ),
    "blocked-force": ("blocked_force", "gap", "bending_angle", "tip_position", "residual"),
    "inverse": (*("distance", "direction_error", "bending_angle", "nearest", "stable", "residual", "solve_time"),),
    "dynamic": ("tip_position", "bending_angle", "stretch", "time_steps", "residual"),
    "trajectory": ("distance", "direction_error", "margin_pressure", "margin_rate", "margin_clearance", "stable"),
    "page": ("tip_position", "bending_angle", "tilt", "backbone_length", "elongation", "stretch"),
    "page, loads": ("tip_displacement",),
    "page, wall": ("blocked_force", "gap", "free_bending_angle", "length_error"),
    "page, chambers": ("chamber_length", "chamber_reaction"),
}
"""The outputs that each table shows of a step, on the terminal by study and on the page."""


SYMBOLS: dict[str, str] = {
    **{"pressure": "P", "t": "t", "stretch": "lambda", "tip_position": "p(L)", "tip_rotation": "R(L)"},
    **{
        "chamber_length": "L_i",
        "blocked_force": "F_b",
        "chamber_reaction": "T_i",
        "tip_cap": "L_t",
        "length_error": "e_L",
    },
    **{"outer_radius": "r_r", "lumen_radius": "r_i", "chamber_circle_radius": "r_cp", "chamber_radius": "r_co"},
    **{"bore_radius": "r_ci", "arc": "s/L", "position": "p", "rotation": "R", "force": "n", "moment": "m"},
    **{"shear_extension": "v", "curvature": "u", "outer_diameter": "D_r", "lumen_diameter": "D_i", "length": "L_0"},
    **{"chamber_circle_diameter": "D_cp", "chamber_diameter": "D_c", "chamber_wall": "delta_c"},
    **{"wall": "delta_c + delta_r", "outer_wall": "delta_r"},
}
"""The paper's letter of an output, by name."""

LEGENDS: dict[str, tuple[str, ...]] = {
    **{
        study: ("step", "t", "pressure", "status", *TABLES[study])
        for study in ("forward", "blocked-force", "inverse", "dynamic", "trajectory")
    },
    "workspace": (
        *("pressure", "t", "tip_position", "tip_rotation", "bending_angle", "tilt", "stretch", "backbone_length"),
        *("chamber_length", "status", "stable", "self_intersecting", "residual", "discretisation_error", "intervals"),
        *("iterations", "blocked_force", "gap"),
    ),
    "identify": (
        *("law", "status", "R^2", "rmse_kPa", "mape_percent", "constants", "constant", "value", "standard_error"),
        *("start", "note", "observable", "unit", "numbers", "rmse_before", "rmse_after", "mape_before_percent"),
        *("mape_after_percent", "sigma"),
    ),
    "compare": ("variant", "count", "rmse", "mape_%", "mean", "median", "max", "bias"),
    "design": (
        *("candidate", "status", "bending_angle", "blocked_force", "stretch", "elongation", "tip_x", "tip_y", "tip_z"),
        *("tip_deflection", "chamber_gap", "pressure", *(output.name for output in _EVERY if output.group == "robot")),
    ),
}
"""What the tables of a study may show: outputs by name, and `WORDS`."""


def legend(names: Sequence[str]) -> list[list[str]]:
    """Return a row for each column of a table: its name there, its key in files, unit, symbol and meaning."""
    rows = []
    for name in names:
        if name in WORDS:
            rows.append([name, name, WORDS[name][0] or "-", "", WORDS[name][1]])
            continue
        output = OUTPUTS[name]
        heading = ", ".join(output.short) if output.short else output.label
        unit = "-" if output.unit is ONE else str(output.unit)
        rows.append([heading, output.key, unit, SYMBOLS.get(name, ""), output.meaning])
    return rows


def outputs(*groups: str) -> tuple[Output, ...]:
    """Return the outputs of groups, in order."""
    return tuple(output for group in groups for output in OUTPUTS.values() if output.group == group)


def by_key(key: str) -> Output | None:
    """Return the output of a key in files, None for any other key."""
    return next((output for output in OUTPUTS.values() if output.key == key), None)
