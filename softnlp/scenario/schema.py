"""The tables of a scenario file, in the units of the file.

Every key that a scenario may hold is a field here or in the module of its study, with what it means as a line of its
table: `KEY : MEANING; by default TEXT; as in VALUE`, of which `softnlp new` and the documents are made (`describe`).
`ranges` has the range of each number; `check` words what does not fit; what needs more than one key, or another file,
is checked where it is read.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal

from numpy import interp
from pydantic import ConfigDict, Field, PlainValidator, create_model

from softnlp.base.errors import InputError, nearest
from softnlp.base.reading import shown
from softnlp.base.units import MILLIMETRE
from softnlp.model.gravity import DIRECTIONS
from softnlp.model.ipopt_options import IPOPT_OPTIONS
from softnlp.model.numerics import EngineName, Numerics, Transcribing
from softnlp.model.robot import DIMENSIONS, MINIMUM_WALL, ROBOTS, Robot, check
from softnlp.scenario.mould import MouldTable
from softnlp.scenario.values import MOST_STEPS as MOST_STEPS
from softnlp.scenario.values import Count as Count
from softnlp.scenario.values import Direction, deviation, intervals_of, number_or_fit, vector_or_fit
from softnlp.scenario.values import FileName as FileName
from softnlp.scenario.values import Label as Label
from softnlp.scenario.values import Normal as Normal
from softnlp.scenario.values import NotNegative as NotNegative
from softnlp.scenario.values import Positive as Positive
from softnlp.scenario.values import Table as Table
from softnlp.scenario.values import Vector as Vector
from softnlp.scenario.values import optional_keys as optional_keys
from softnlp.scenario.values import wrong as wrong
from softnlp.scenario.varying import Along, Varying


class RobotTable(Table):
    """[robot]: a name of the library with single dimensions changed, or every dimension in full.

    name : of a robot of the library (`softnlp robots`), or a name for your own; as in "D25L60"
    outer_diameter_mm : D_r
    lumen_diameter_mm : D_i, the central hole
    chamber_circle_diameter_mm : D_cp, of the circle on which the chambers' centres lie
    chamber_diameter_mm : D_c, of a chamber's bore
    chamber_wall_mm : delta_c, silicone between bore and thread
    length_mm : L_0, without pressure
    chamber_sets : n1, sets of chambers, one pressure each; as in 3
    chambers_per_set : n2; as in 2
    chamber_angle_deg : alpha_1, between neighbouring chambers of one set
    allow : rules of manufacture to lower to a warning; as in ["wall_thickness"]
    minimum_wall_mm : delta_s, the least of delta_c + delta_r that can be made
    """

    name: Label | None = None
    outer_diameter_mm: Along[Positive] = None
    lumen_diameter_mm: Along[Positive] = None
    chamber_circle_diameter_mm: Along[Positive] = None
    chamber_diameter_mm: Along[Positive] = None
    chamber_wall_mm: Along[Positive] = None
    length_mm: Positive | None = None
    chamber_sets: Count | None = None
    chambers_per_set: Count | None = None
    chamber_angle_deg: Along[NotNegative] = None
    allow: list[str] = Field(default=[])
    minimum_wall_mm: Positive = MINIMUM_WALL / MILLIMETRE

    def made(self) -> tuple[Robot, tuple[str, ...]]:
        """Return the robot and its warnings; raises `InputError` where it cannot be made."""
        robot, warnings, where = self.described(), list[str](), ""
        try:
            for place, there in self.sections(robot).items():
                where = place
                warnings += check(there, allow=self.allow, minimum_wall=self.minimum_wall_mm * MILLIMETRE)
            return robot, tuple(dict.fromkeys(warnings))
        except InputError as error:
            file_keys = {d.field: d.file_key for d in DIMENSIONS}
            key = file_keys.get(error.key or "", error.key)
            raise type(error)(f"{where}{error.message}", key=key, every=error.every) from None

    @property
    def along(self) -> dict[str, dict[str, Any]]:
        """What varies along s, as `softnlp.Segment` takes it."""
        return {
            f"robot.{d.field}": {"s": value.s, "value": [v * (d.scale or 1.0) for v in value.value]}
            for d in DIMENSIONS
            if isinstance(value := getattr(self, d.file_key), Varying)
        }

    def sections(self, robot: Robot) -> dict[str, Robot]:
        """Return the robot at each knot of what varies along s, by the place in words."""
        knots = sorted({0.0, *(s for table in self.along.values() for s in table["s"])})
        every: dict[str, dict[str, Any]] = {
            f"at s = {s:g}: " if self.along else "": {
                key.removeprefix("robot."): float(interp(s, t["s"], t["value"])) for key, t in self.along.items()
            }
            for s in knots
        }
        return {where: replace(robot, **sizes) for where, sizes in every.items()}

    def described(self) -> Robot:
        """Return the robot, at the base where it varies along s, whether it can be made or not."""
        given: dict[str, Any] = {}
        for dimension in DIMENSIONS:
            value = getattr(self, dimension.file_key)
            if isinstance(value, Varying):
                value = value.value[0]
            if value is not None:
                given[dimension.field] = value if dimension.scale is None else value * dimension.scale
        missing = [d.file_key for d in DIMENSIONS if d.field not in given]
        if self.name is not None and self.name in ROBOTS:
            changed = bool(self.along) or any(getattr(ROBOTS[self.name], k) != v for k, v in given.items())
            return replace(ROBOTS[self.name], **given, name=f"{self.name} (modified)" if changed else self.name)
        if not missing:
            return Robot(name=self.name or "robot", **given)
        if self.name is None and given:
            raise InputError("missing; without a name every dimension is needed", key=", ".join(missing))
        expected = "expected a robot of the library, or every dimension in full"
        if self.name is None:
            raise InputError(f"missing; {expected}", key="name")
        full = f" (missing: {', '.join(missing)})" if given else ""
        raise InputError(f"{expected}{full}, got {shown(self.name)}{nearest(self.name, ROBOTS)}", key="name")


class MaterialTable(Table):
    """[material]: a silicone of the library or of a file, or constants (and a formula) given here.

    Only the types are checked here: the table is read as it is written by `softnlp.model.materials`.

    name : of a silicone of the library (`softnlp materials`) or of `file`, or your own; as in "Ecoflex 00-50"
    model : linear, neo-hookean, mooney-rivlin, yeoh, ogden, or a law of your own; as in "mooney-rivlin"
    set : of constants, where the library has several of a silicone; by default "shi-2025"; as in "srmd"
    density_kg_m3 : for the weight; by default 1070.0
    file : a materials file of your own; as in "my_silicone.toml"
    constants : of the law, in place of the library's; as in { C10_MPa = 0.004, C01_MPa = 0.015, C20_MPa = 0.001 }
    formula : a law of your own, engineering stress in MPa; as in "a * (stretch - stretch**-2)"
    fitted_stretch : of constants: a step beyond it carries a warning; as in [1.0, 2.0]
    """

    name: Label = Field(description="a silicone of the library, or a name for your own")
    model: str = Field(description="linear, neo-hookean, mooney-rivlin, yeoh, ogden or a law of your own")
    set: Label | None = None
    density_kg_m3: Positive | None = None
    file: FileName | None = None
    constants: dict[str, float] | None = None
    formula: str | None = None
    fitted_stretch: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None


class StiffeningTable(Table):
    """[stiffening]: a set of coefficients, and k_e and k_b where they differ from the set's.

    set : all coefficients at once
    elongation : k_e; by default the set's; as in 0.41
    bending : k_b; by default the set's; as in 1.23
    """

    set: Literal["reproduction", "calibrated"] = "reproduction"
    elongation: NotNegative | None = None
    bending: NotNegative | None = None


class CorrectionsTable(Table):
    """[corrections]: k_a, k_i and phi where they differ from the set's, and the conventions.

    area : k_a, multiplies the section's area; by default 1.0
    inertia : k_i, multiplies the silicone's second moments of area; by default 1.0
    bore_fraction : phi, how far beyond the bore the pressure acts, from 0 to 1; by default the set's; as in 0.0
    conventions : how ambiguous equations are read; "energy" is a section of its own, which takes modulus_factor alone
    modulus_factor : c_m, of "energy": multiplies the silicone's stress; by default 1.0
    """

    area: Positive | None = None
    inertia: Positive | None = None
    bore_fraction: NotNegative | None = None
    conventions: Literal["reproduction", "as_printed", "energy"] = "reproduction"
    modulus_factor: Positive | None = None


class GravityTable(Table):
    """[gravity]: the direction of the weight; here a unit vector, or zeros.

    direction : how the robot is held, "standing", "hanging" or "off"; or where the weight pulls, "-z" or a vector;
        by default "off"; as in "standing"
    """

    direction: Direction = DIRECTIONS["off"]


class TipLoadTable(Table):
    """[tip_load]: dead loads in the world frame.

    force_N : x, y, z
    moment_Nmm : x, y, z
    """

    force_N: Vector = Field(default=[0.0, 0.0, 0.0])
    moment_Nmm: Vector = Field(default=[0.0, 0.0, 0.0])


class RampTable(Table):
    """A ramp of [pressure]: equal steps, the same in each of its sets (counted from 1), zero in the others.

    sets : that get the pressure, counted from 1; the others have none; as in [1]
    to_bar : the last pressure; as in 0.5
    steps : the number of poses, both ends included; as in 6
    from_bar : the first pressure
    """

    sets: Annotated[list[int], Field(min_length=1)] = Field(description="a list of chamber sets, counted from 1")
    to_bar: NotNegative = Field(description="a pressure in bar")
    steps: Annotated[int, Field(ge=2, le=MOST_STEPS)] = Field(description="the number of poses")
    from_bar: NotNegative = 0.0


PRESSURE_SOURCES = ("sequence_bar", "ramp", "file")
ImportSettings = dict[str, Any]


class PressureTable(optional_keys({"import": ImportSettings})):  # type: ignore[misc]
    """[pressure]: exactly one of sequence_bar, ramp and file; with file the settings of its import.

    sequence_bar : a row for each step with one pressure a set; as in [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]
    ramp : equal steps in some sets, none in the others; as in { sets = [1], to_bar = 0.5, steps = 6 }
    file : CSV with p1_bar, p2_bar, ..., or what a logger wrote; as in "pressures.csv"
    import : settings of a file as a logger wrote it; as in { "unit.pressure" = "kPa" }
    """

    sequence_bar: Annotated[list[list[float]], Field(min_length=1)] | None = None
    ramp: RampTable | None = None
    file: FileName | None = None


class OffsetRampTable(Table):
    """[contact] offset_ramp.

    from_mm : the first offset; as in 0.0
    to_mm : the last offset; as in -10.0
    steps : the number of offsets; as in 5
    """

    from_mm: float = Field(description="an offset in mm")
    to_mm: float = Field(description="an offset in mm")
    steps: Annotated[int, Field(ge=2, le=MOST_STEPS)] = Field(description="the number of poses")


class ContactTable(Table):
    """[contact]: the wall, and how its chambers react.

    mode : "blocked" at a wall; or "constrained": no wall, the chambers resist under [tip_load] and [gravity]
    offset_mm : h, where along x the tip is held; by default 0.0
    offsets_mm : several h at the one pressure of [pressure]; as in [0.0, -5.0, -10.0]
    offset_ramp : the same in equal steps; as in { from_mm = 0.0, to_mm = -10.0, steps = 5 }
    target_force_N : find the pressure that gives this force; the last step of [pressure] bounds it; as in 0.5
    tip_cap_mm : L_t, length of the rigid cap on the tip
    closure : which equations close the problem; "none" is that of conventions = "energy", and there the default
    chamber_reaction : k_c of the closure "compliant"; by default the set's; as in 1.45
    wall_point_mm : a point of a wall anywhere, with wall_normal; as in [-5.0, 0.0, 0.0]
    wall_normal : the direction in which that wall pushes the robot; as in [1.0, 0.0, 0.0]
    weight_force_per_N : of the closure "weighted"; as in 1.0
    weight_moment_per_Nmm : of the closure "weighted"; as in 0.1
    weight_length_per_mm : of the closure "weighted"; as in 1.0
    weight_position_per_mm : of the closure "weighted"; without it the wall holds exactly; as in 1.0
    weight_sensitivity : how the force answers to each weight given
    """

    mode: Literal["blocked", "constrained"] = "blocked"
    offset_mm: float | None = None
    offsets_mm: Annotated[list[float], Field(min_length=1)] | None = None
    offset_ramp: OffsetRampTable | None = None
    target_force_N: Positive | None = None
    tip_cap_mm: NotNegative = 0.0
    closure: Literal["free", "compliant", "weighted", "rigid", "none"] = "compliant"
    chamber_reaction: NotNegative | None = None
    wall_point_mm: Vector | None = None
    wall_normal: Normal | None = None
    weight_force_per_N: Positive | None = None
    weight_moment_per_Nmm: Positive | None = None
    weight_length_per_mm: Positive | None = None
    weight_position_per_mm: Positive | None = None
    weight_sensitivity: bool = False


def _ipopt_option(name: str, value: Any) -> Any:
    """Return the value of an option of IPOPT that takes it."""
    if not IPOPT_OPTIONS[name].takes(value):
        raise wrong(IPOPT_OPTIONS[name].refusal(value))
    return value


_OPTIONS: dict[str, Any] = {
    name: (Annotated[Any, PlainValidator(partial(_ipopt_option, name))], None) for name in IPOPT_OPTIONS
}
IpoptTable = create_model(
    "IpoptTable", __base__=Table, __doc__="[solver.ipopt]: options of IPOPT, not with the engine 'newton'.", **_OPTIONS
)


class SolverTable(Table):
    """[solver]: who solves, and how finely.

    engine : who solves: Newton's method closed by IPOPT, every solve by IPOPT, or Newton's method alone
    intervals : a number, or "auto": as many as keep the estimated error within accuracy; by default "auto"; as in 40
    accuracy : largest estimated error of the tip's position, of L_0
    transcription : how the boundary value problem becomes equations
    tolerance : largest scaled residual of a step that counts as solved
    """

    engine: EngineName = Numerics.engine
    ipopt: IpoptTable = IpoptTable()  # type: ignore[valid-type]
    intervals: Annotated[int | None, PlainValidator(intervals_of)] = Numerics.intervals
    accuracy: Positive = Numerics.accuracy
    transcription: Transcribing = Numerics.transcription
    tolerance: Positive = Numerics.tolerance


class ScenarioFile(Table):
    """What every scenario may hold; each study adds its own tables.

    title : heads tables and figures; by default the file's name; as in "My robot"
    study : what is asked
    """

    title: Label | None = None
    study: str
    robot: RobotTable = Field(description="a table with name or every dimension")
    material: MaterialTable = Field(description="a table with name and model")
    stiffening: StiffeningTable = StiffeningTable()
    corrections: CorrectionsTable = CorrectionsTable()
    gravity: GravityTable = GravityTable()
    tip_load: TipLoadTable = TipLoadTable()
    solver: SolverTable = SolverTable()
    mould: MouldTable = MouldTable()


class RegistrationTable(Table):
    """[registration] of measured tips: their frame, the sensor's place on the tip, and how the sets are turned.

    frame : in which the tips were measured
    tip_offset_mm : the sensor in the frame of the tip, or "fit"
    clock_deg : by which the sets are turned about z, or "fit"
    set_order : which set each column of pressures is of, from 1; by default in order; as in [1, 2, 3]
    rotation_world_from_base_quat_xyzw : of a given frame, a quaternion x, y, z, w; as in [0.0, 0.0, 0.0, 1.0]
    translation_mm : of a given frame; as in [0.0, 0.0, 0.0]
    base_sensor_mm : where the base sensor sits in the robot's frame; as in [0.0, 0.0, 0.0]
    tip_sensor_quat_xyzw : the sensor's turn in the frame of the tip, a quaternion x, y, z, w, or "fit"
    """

    frame: Literal["given", "base sensor", "fit"] = "given"
    tip_offset_mm: Annotated[list[float] | None, PlainValidator(partial(vector_or_fit, 3))] = Field(
        default=[0.0, 0.0, 0.0]
    )
    clock_deg: Annotated[float | None, PlainValidator(number_or_fit)] = 0.0
    set_order: Annotated[list[int], Field(min_length=1)] | None = None
    rotation_world_from_base_quat_xyzw: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None
    translation_mm: Vector | None = None
    base_sensor_mm: Vector | None = None
    tip_sensor_quat_xyzw: Annotated[list[float] | None, PlainValidator(partial(vector_or_fit, 4))] = Field(
        default=[0.0, 0.0, 0.0, 1.0]
    )


class UncertaintyTable(Table):
    """[uncertainty]: standard deviations of the silicone, of pressures, and of any dimension of [robot] by its key.

    material : relative, of the stress, or "sets", the spread of the library's sets; as in 0.15
    pressure_bar : of each set, or in percent of its pressure; as in 0.01
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Annotated[float | str, PlainValidator(deviation)]] = Field(init=False)

    material: Annotated[float | str | None, PlainValidator(deviation)] = None
    pressure_bar: Annotated[float | str | None, PlainValidator(deviation)] = None


class ForwardFile(ScenarioFile):
    """What scenarios of `forward` and `blocked-force` may hold."""

    uncertainty: UncertaintyTable | None = None
    registration: RegistrationTable = RegistrationTable()
    pressure: PressureTable = Field(description="a table with one of sequence_bar, ramp, file")


class BlockedForceFile(ForwardFile):
    """A whole scenario of `blocked-force`."""

    contact: ContactTable = ContactTable()
