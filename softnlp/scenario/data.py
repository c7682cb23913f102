"""A scenario as plain data in SI units: what a file of any study comes to, and the run that its steps make."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.batch.plan import Plan
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.obstacles import Obstacle
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.model.rod import Loads
from softnlp.scenario.mould import MouldTable
from softnlp.scenario.pressures import PressurePath
from softnlp.scenario.schema import RegistrationTable
from softnlp.statics.step import Run, Step
from softnlp.studies.uncertainty import Uncertainty

Array = NDArray[np.float64]


class Task(Protocol):
    """What a study is asked beyond the pressures, as frozen data in SI units."""

    def step_count(self, pressures: int) -> int:
        """Return how many steps the run has, for so many pressures of the scenario."""
        ...


@dataclass(frozen=True, eq=False)
class Scenario:
    """Everything that a scenario file asks for, in SI units.

    Attributes
    ----------
    path, text
        The file as it was named, and its content.
    title
        The file's stem when it gives none.
    study
        Which study it is.
    robot, material, coefficients, conventions, loads
        Of its tables, or the defaults.
    pressures
        (steps, sets) gauge [Pa], no steps where the study has none.
    times
        (steps,) [s], or None when the pressures have none.
    numerics
        Of its [solver], or the defaults.
    contact
        The wall, where there may be one, else None.
    task
        What else the study is asked.
    warnings
        Rules of manufacture that the robot breaks with leave, a silicone of an unlikely stiffness, and readings that
        count as 0.
    registration
        Of measured tips that the scenario is compared with, where it says so.
    uncertainty
        What scatters, where it says so.
    mould
        What a maker chooses of the moulds, for `softnlp mould`.
    obstacles
        What the body may touch.
    """

    path: Path
    text: str
    title: str
    study: str
    robot: Robot
    material: Material
    coefficients: Coefficients
    conventions: Conventions
    loads: Loads
    pressures: Array
    times: Array | None
    numerics: Numerics
    contact: ContactSettings | None
    task: Task | None
    warnings: tuple[str, ...]
    registration: RegistrationTable | None = None
    uncertainty: Uncertainty | None = None
    mould: MouldTable = field(default_factory=MouldTable)
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def model(self) -> Model:
        """Its robot, silicone, coefficients and conventions."""
        return Model(self.robot, self.material, self.coefficients, self.conventions)

    @property
    def step_count(self) -> int:
        """How many steps its run has when none is left out."""
        return len(self.pressures) if self.task is None else self.task.step_count(len(self.pressures))

    @property
    def settings(self) -> dict[str, Any]:
        """Its loads, coefficients, conventions and numerics, as the functions of the studies take them."""
        return {key: getattr(self, key) for key in ("loads", "coefficients", "conventions", "numerics")}


class Read(NamedTuple):
    """What the reader of a study's own tables may use.

    file : the tables as checked. data : as they were parsed. steps : without rows where the study has no [pressure].
    folder : where files that the scenario names are looked for.
    """

    file: Any
    data: dict[str, Any]
    robot: Robot
    material: Material
    steps: PressurePath
    folder: Path


def scenario_of(given: object, study: str | None, function: str) -> Scenario:
    """Return what a function was given, if that is a scenario of its study (None: of any).

    Raises
    ------
    InputError
        Naming the function to use instead.
    """
    wanted = f"{function} takes a scenario" + ("" if study is None else f" of study {study!r}")
    if not isinstance(given, Scenario):
        use = "softnlp.run_sweep solves a plan" if isinstance(given, Plan) else "softnlp.load_scenario reads one"
        raise InputError(f"{wanted}, got a value of type {type(given).__name__}; {use}")
    if study not in (None, given.study):
        raise InputError(
            f"{wanted}, got {given.study!r}; softnlp.run_scenario runs it", source=str(given.path), key="study"
        )
    return given


def require_no_obstacles(scenario: Scenario, what: str) -> None:
    """Raise `InputError` for a scenario with obstacles, where something takes none. what : what takes none."""
    if scenario.obstacles:
        raise InputError(f"{what} takes no [[obstacle]] so far", table="obstacle")


def run_of(scenario: Scenario, steps: Iterable[Step], *notes: str) -> Run:
    """Return the run that these steps make of a scenario, with its warnings and then `notes`."""
    same = ("study", "robot", "material", "coefficients", "conventions", "loads", "title", "contact")
    asked: dict[str, Any] = {key: getattr(scenario, key) for key in same}
    told = {} if scenario.uncertainty is None else scenario.uncertainty.written
    warnings = (*scenario.warnings, *notes)
    return Run(steps=tuple(steps), warnings=warnings, uncertainty=told, obstacles=scenario.obstacles, **asked)
