"""Units in which a person may read and set a pressure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from softnlp.base.units import BAR


@dataclass(frozen=True)
class PressureUnit:
    """name : as shown. pascal : of one. step : of a slider, a round number near 10 mbar. decimals : shown."""

    name: str
    pascal: float
    step: float
    decimals: int


PRESSURE_UNITS: Mapping[str, PressureUnit] = {
    unit.name: unit
    for unit in (
        PressureUnit("bar", BAR, 0.01, 3),
        PressureUnit("kPa", 1e3, 1.0, 1),
        PressureUnit("psi", 6894.757293168361, 0.1, 2),
    )
}
