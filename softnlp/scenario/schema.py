"""The tables of a scenario file, in the units of the file.

Every key that a scenario may hold is a field here, so the file format can be read off this module. `ranges` has the
range of each number; `check` words what does not fit; what needs more than one key, or another file, is checked where
it is read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from math import hypot
from typing import Annotated, Any, Literal
from unicodedata import category

from numpy import interp
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    create_model,
)

from softnlp.base.errors import InputError, nearest
from softnlp.base.reading import BACKSLASH_HINT, as_typed, choices, shown
from softnlp.base.units import MILLIMETRE
from softnlp.model.gravity import DIRECTIONS, unknown_direction
from softnlp.model.ipopt_options import IPOPT_OPTIONS
from softnlp.model.numerics import EngineName, Numerics, Transcribing
from softnlp.model.robot import DIMENSIONS, MINIMUM_WALL, ROBOTS, Robot, check
from softnlp.scenario.varying import Along, Varying, is_number
from softnlp.scenario.varying import wrong as wrong

MOST_INTERVALS = 2000
LARGEST_COMPONENT = 1e300
MOST_STEPS = 1_000_000
LONGEST_LABEL = 200
LONGEST_FILE_NAME = 500


def _direction(value: Any) -> tuple[float, float, float]:
    """Gravity's direction: one of the names, or a vector to be normalised."""
    if isinstance(value, str):
        if value not in DIRECTIONS:
            raise wrong(unknown_direction(value))
        return DIRECTIONS[value]
    if not isinstance(value, list):
        raise wrong(f"expected one of {choices(DIRECTIONS)}, or a vector of 3 numbers, got {shown(value)}")
    return _normal(value)


def _normal(value: Any) -> tuple[float, float, float]:
    """Normalise a list of three numbers."""
    if not isinstance(value, list) or len(value) != 3:
        raise wrong(f"expected a list of 3 numbers, got {shown(value)}")
    for component in value:
        if isinstance(component, bool) or not isinstance(component, (int, float)):
            raise wrong(f"expected a list of 3 numbers, got {shown(component)} in it")
        if not abs(component) <= LARGEST_COMPONENT:
            raise wrong(f"expected 3 finite numbers, got {shown(component)} among them")
    largest = max(abs(component) for component in value)
    if largest == 0:
        raise wrong("expected a direction, got a vector of length 0")
    x, y, z = (component / largest for component in value)  # first, so that no square vanishes or overflows
    length = hypot(x, y, z)
    return x / length, y / length, z / length


def _intervals(value: Any) -> int | None:
    """Return the number of intervals, None for "auto"."""
    if value == "auto":
        return None
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= MOST_INTERVALS:
        raise wrong(f"expected 'auto' or a whole number from 1 to {MOST_INTERVALS}, got {shown(value)}")
    return value


def _number_or_fit(value: Any) -> float | None:
    """Return a number, None for "fit"."""
    if value != "fit" and not is_number(value):
        raise wrong(f"expected a number or 'fit', got {shown(value)}")
    return None if value == "fit" else float(value)


def _vector_or_fit(value: Any) -> list[float] | None:
    """Return three numbers, None for "fit"."""
    if value != "fit" and not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value))):
        raise wrong(f"expected a list of 3 numbers or 'fit', got {shown(value)}")
    return None if value == "fit" else [float(v) for v in value]


def _file_name(value: str) -> str:
    r"""Refuse control characters, which are escapes that nobody meant: in TOML "data\table.csv" holds a tab."""
    if not value.strip():
        raise wrong(f"expected a path, got {shown(value)}")
    if controls := [c for c in value if category(c) == "Cc"]:
        escape = as_typed(controls[0])
        raise wrong(f"expected a path, got '{as_typed(value)}', where {escape} is one character: {BACKSLASH_HINT}")
    return value


def _label(value: str) -> str:
    """Put a name or a title on one line; control characters would reach a terminal or a figure."""
    label = " ".join(value.split())
    if not label or not label.isprintable():
        raise wrong(f"expected text without control characters, got {shown(value)}")
    return label


Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=1)]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Direction = Annotated[tuple[float, float, float], PlainValidator(_direction)]
Normal = Annotated[tuple[float, float, float], PlainValidator(_normal)]
Label = Annotated[str, Field(max_length=LONGEST_LABEL), AfterValidator(_label)]
FileName = Annotated[str, Field(max_length=LONGEST_FILE_NAME), AfterValidator(_file_name)]


class Table(BaseModel):
    """A table of the file: no unknown key, no conversion of types (but a whole number is a number), no nan or inf."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    def written(self, keys: Iterable[str]) -> list[str]:
        """Return which of some keys the file has, in their order."""
        return [key for key in keys if key in self.model_fields_set]

    def refuse(self, keys: Iterable[str], message: str, table: str | None = None) -> None:
        """Raise `InputError` for the first of some keys that the file has."""
        for key in self.written(keys):
            raise InputError(message, table=table, key=key)


def optional_keys(kinds: Mapping[str, Any]) -> Any:
    """Return a table whose keys may each be left out; kinds : of each."""
    fields: dict[str, Any] = {key: (kind | None, None) for key, kind in kinds.items()}
    return create_model("OptionalKeys", __base__=Table, **fields)


class RobotTable(Table):
    """[robot]: a name of the library with single dimensions changed, or every dimension in full."""

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
    allow: list[str] = []
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
            raise type(error)(f"{where}{error.message}", key=file_keys.get(error.key or "", error.key)) from None

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
    """

    name: Label = Field(description="a silicone of the library, or a name for your own")
    model: str = Field(description="linear, neo-hookean, mooney-rivlin, yeoh, ogden or a law of your own")
    density_kg_m3: Positive | None = None
    file: FileName | None = None
    constants: dict[str, float] | None = None
    formula: str | None = None
    fitted_stretch: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None


class StiffeningTable(Table):
    """[stiffening]: a set of coefficients, and k_e and k_b where they differ from the set's."""

    set: Literal["reproduction", "calibrated"] = "reproduction"
    elongation: NotNegative | None = None
    bending: NotNegative | None = None


class CorrectionsTable(Table):
    """[corrections]: k_a, k_i and phi where they differ from the set's, and the conventions."""

    area: Positive | None = None
    inertia: Positive | None = None
    bore_fraction: NotNegative | None = None
    conventions: Literal["reproduction", "as_printed"] = "reproduction"


class GravityTable(Table):
    """[gravity]: a unit vector, or zeros when it is off."""

    direction: Direction = DIRECTIONS["off"]


class TipLoadTable(Table):
    """[tip_load]: dead loads in the world frame."""

    force_N: Vector = [0.0, 0.0, 0.0]
    moment_Nmm: Vector = [0.0, 0.0, 0.0]


class RampTable(Table):
    """A ramp of [pressure]: equal steps, the same in each of its sets (counted from 1), zero in the others."""

    sets: Annotated[list[int], Field(min_length=1)] = Field(description="a list of chamber sets, counted from 1")
    to_bar: NotNegative = Field(description="a pressure in bar")
    steps: Annotated[int, Field(ge=2, le=MOST_STEPS)] = Field(description="the number of poses")
    from_bar: NotNegative = 0.0


PRESSURE_SOURCES = ("sequence_bar", "ramp", "file")
ImportSettings = dict[str, Any]


class PressureTable(optional_keys({"import": ImportSettings})):  # type: ignore[misc]
    """[pressure]: exactly one of `PRESSURE_SOURCES`; with file the settings of its import."""

    sequence_bar: Annotated[list[list[float]], Field(min_length=1)] | None = None
    ramp: RampTable | None = None
    file: FileName | None = None


class OffsetRampTable(Table):
    """[contact] offset_ramp."""

    from_mm: float = Field(description="an offset in mm")
    to_mm: float = Field(description="an offset in mm")
    steps: Annotated[int, Field(ge=2, le=MOST_STEPS)] = Field(description="the number of poses")


class ContactTable(Table):
    """[contact] of a blocked force."""

    mode: Literal["blocked", "constrained"] = "blocked"
    offset_mm: float | None = None
    offsets_mm: Annotated[list[float], Field(min_length=1)] | None = None
    offset_ramp: OffsetRampTable | None = None
    target_force_N: Positive | None = None
    tip_cap_mm: NotNegative = 0.0
    closure: Literal["free", "compliant", "weighted", "rigid"] = "compliant"
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
IpoptTable = create_model("IpoptTable", __base__=Table, __doc__="[solver.ipopt].", **_OPTIONS)


class SolverTable(Table):
    """[solver]."""

    engine: EngineName = Numerics.engine
    ipopt: IpoptTable = IpoptTable()  # type: ignore[valid-type]
    intervals: Annotated[int | None, PlainValidator(_intervals)] = Numerics.intervals
    accuracy: Positive = Numerics.accuracy
    transcription: Transcribing = Numerics.transcription
    tolerance: Positive = Numerics.tolerance


class ScenarioFile(Table):
    """What every scenario may hold; each study adds its own tables."""

    title: Label | None = None
    study: str
    robot: RobotTable = Field(description="a table with name or every dimension")
    material: MaterialTable = Field(description="a table with name and model")
    stiffening: StiffeningTable = StiffeningTable()
    corrections: CorrectionsTable = CorrectionsTable()
    gravity: GravityTable = GravityTable()
    tip_load: TipLoadTable = TipLoadTable()
    solver: SolverTable = SolverTable()


class RegistrationTable(Table):
    """[registration] of measured tips: their frame, the sensor's place on the tip, and how the sets are turned."""

    frame: Literal["given", "base sensor", "fit"] = "given"
    tip_offset_mm: Annotated[list[float] | None, PlainValidator(_vector_or_fit)] = [0.0, 0.0, 0.0]
    clock_deg: Annotated[float | None, PlainValidator(_number_or_fit)] = 0.0
    set_order: Annotated[list[int], Field(min_length=1)] | None = None
    rotation_world_from_base_quat_xyzw: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None
    translation_mm: Vector | None = None
    base_sensor_mm: Vector | None = None


class ForwardFile(ScenarioFile):
    """A whole scenario of `forward`."""

    registration: RegistrationTable = RegistrationTable()
    pressure: PressureTable = Field(description="a table with one of sequence_bar, ramp, file")


class BlockedForceFile(ForwardFile):
    """A whole scenario of `blocked-force`."""

    contact: ContactTable = ContactTable()
