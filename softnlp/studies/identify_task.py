"""What a scenario asks of an identification, as data in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.model.laws import Law
from softnlp.model.materials import Material
from softnlp.studies.measurements import Measurements
from softnlp.studies.plausibility import Check

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TensileTask:
    """Laws to fit to a tensile test.

    stretch, stress : (points,), [-] and engineering [Pa], of every file. file_of_point : (points,) from 0. files : as
    they were named. name, density : of the silicone. start : of a person's law, SI. before : to compare with, or None.
    stretch_range : (2,) as asked for, or None. dropped : how many points lay outside of it. checks : of the specimen.
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
    cells : for each robot and row, the cells of the file as they were read. notes : on readings that count as 0.
    """

    measurements: tuple[Measurements, ...]
    free: tuple[str, ...]
    bounds: Mapping[str, tuple[float, float]]
    columns: tuple[str, ...]
    cells: tuple[tuple[tuple[str, ...], ...], ...]
    notes: tuple[str, ...] = ()

    def step_count(self, pressures: int) -> int:
        """Return one: it is solved as a whole."""
        return 1
