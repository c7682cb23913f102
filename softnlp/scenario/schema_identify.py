"""The tables of a scenario of `identify`, in the units of the file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from softnlp.base.columns import OUTPUTS
from softnlp.scenario.schema import (
    ContactTable,
    FileName,
    Label,
    MaterialTable,
    Positive,
    RobotTable,
    ScenarioFile,
    Table,
    optional_keys,
)
from softnlp.studies.measurements import OBSERVABLES

Files = Annotated[list[FileName], Field(min_length=1)]


class TensileTable(Table):
    """[tensile]: tests of one silicone, and the laws to fit."""

    file: FileName | None = None
    files: Files | None = None
    name: Label | None = None
    laws: Annotated[list[str], Field(min_length=1)] | None = None
    stress: Literal["engineering", "true"] = "engineering"
    gauge_length_mm: Positive | None = None
    width_mm: Positive | None = None
    thickness_mm: Positive | None = None
    diameter_mm: Positive | None = None
    stretch: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None
    density_kg_m3: Positive | None = None


class MeasurementsTable(Table):
    """[measurements]: of one robot or several, and the constants to identify."""

    file: FileName | None = None
    files: Files | None = None
    free: Annotated[list[str], Field(min_length=1)] = Field(
        description="a list of k_e, k_b, k_a, k_i, phi, k_c and constants of the material"
    )
    bounds: dict[str, Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(default_factory=dict)


def _sigma_keys() -> Iterator[str]:
    for name in OBSERVABLES:
        yield OUTPUTS[name].key
        if name != "tip_position":
            yield f"{name}_percent"


class SigmaTable(optional_keys(Positive, _sigma_keys())):  # type: ignore[misc]
    """[sigma]: the standard deviation of each observable, absolute or in percent of each number."""


class IdentifyFile(ScenarioFile):
    """A whole scenario of `identify`. A tensile test has no robot; measurements may name theirs row by row."""

    robot: RobotTable = RobotTable(name="D25L60")
    material: MaterialTable = MaterialTable(name="Ecoflex 00-50", model="mooney-rivlin")
    robots: dict[str, RobotTable] = Field(default_factory=dict)
    tensile: TensileTable | None = None
    measurements: MeasurementsTable | None = None
    sigma: SigmaTable = SigmaTable()
    contact: ContactTable = ContactTable()
