"""Everything that sensitivities say of one pose: Jacobian, compliance, ellipsoids, error bars."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.base.ranges import too_uncertain
from softnlp.base.units import BAR, NEWTON_MILLIMETRE
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model, differentiable, quantities
from softnlp.model.robot import DIMENSIONS, Robot
from softnlp.model.rod import Loads
from softnlp.statics.step import Pose
from softnlp.studies.ellipsoids import (
    Ellipsoid,
    Manipulability,
    compliance_ellipsoid,
    manipulability,
    stiffness_ellipsoid,
)
from softnlp.studies.sensitivity import Sensitivities, sensitivities
from softnlp.studies.tolerances import ErrorBars, Sampled, error_bars, monte_carlo

Array = NDArray[np.float64]

OUTPUTS = ("tip_position", "tip_rotation", "bending_angle", "elongation", "stretch", "chamber_lengths")


@dataclass(frozen=True, eq=False)
class SensitivityReport:
    """Sensitivities of one pose by every quantity, and what follows from them; NaN where the pose did not solve.

    Attributes
    ----------
    robot, material
        As given.
    sensitivities
        Of every output by every quantity.
    manipulability
        Of the tip by the pressures.
    compliance, stiffness
        Of the tip, which is free to turn.
    bars, sampled
        Error bars to first order and by Monte Carlo, with tolerances; else None.
    loads
        As given.
    """

    robot: Robot
    material: Material
    sensitivities: Sensitivities
    manipulability: Manipulability
    compliance: Ellipsoid
    stiffness: Ellipsoid
    bars: ErrorBars | None
    sampled: Sampled | None
    loads: Loads = Loads()

    @property
    def solved(self) -> bool:
        """Whether the pose was solved and has derivatives."""
        return self.sensitivities.solved

    @property
    def pose(self) -> Pose | None:
        """The pose."""
        return self.sensitivities.step.pose


def sensitivity_report(
    robot: Robot,
    material: Material,
    pressure: Any,
    tolerances: Mapping[str, float] | None = None,
    *,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    samples: int = 200,
    progress: Callable[[int], None] | None = None,
) -> SensitivityReport:
    """Solve one pose and differentiate it by every quantity of the model.

    Parameters
    ----------
    robot, material, pressure
        As `softnlp.sensitivities`.
    tolerances
        As `softnlp.error_bars`; None for no error bars.
    loads, coefficients, conventions, numerics
        As `softnlp.forward`.
    samples
        Of the check of the error bars by Monte Carlo, 0 for none.
    progress
        Called with the number of samples done.

    Returns
    -------
    SensitivityReport
        Without numbers where the pose has no solution.

    Raises
    ------
    InputError
        As `softnlp.sensitivities` and `softnlp.error_bars`.
    """
    every = list(differentiable(Model(robot, material, coefficients, conventions)))
    found = sensitivities(
        robot,
        material,
        pressure,
        outputs=OUTPUTS,
        by=every,
        loads=loads,
        coefficients=coefficients,
        conventions=conventions,
        numerics=numerics,
    )
    bars = sampled = None
    if tolerances:
        bars = error_bars(found, tolerances)
        if samples and found.point is not None:
            sampled = monte_carlo(found, tolerances, samples, progress=progress)
    return SensitivityReport(
        robot,
        material,
        found,
        manipulability(found),
        compliance_ellipsoid(found),
        stiffness_ellipsoid(found),
        bars,
        sampled,
        loads,
    )


def tolerance_keys(model: Model) -> dict[str, tuple[str, float]]:
    """Return the quantity of each key that may have a tolerance, and the size of the key's unit."""
    declared = differentiable(model)
    keys: dict[str, tuple[str, float]] = {
        d.file_key: (f"robot.{d.field}", d.scale) for d in DIMENSIONS if d.scale is not None
    }
    keys |= {c.file_key: (f"material.{c.name}", c.scale) for c in model.material.law.constants}
    keys |= {name.partition(".")[2]: (name, 1.0) for name in declared if name.startswith(("stiff", "corr"))}
    keys |= {
        "density_kg_m3": ("material.density", 1.0),
        "pressure_bar": ("pressure", BAR),
        "force_N": ("tip_force", 1.0),
        "moment_Nmm": ("tip_moment", NEWTON_MILLIMETRE),
    }
    return {key: found for key, found in keys.items() if found[0] in declared}


def named_tolerances(
    given: Sequence[str],
    robot: Robot,
    material: Material,
    coefficients: Coefficients,
    pressure: Array,
    conventions: Conventions = REPRODUCTION,
) -> dict[str, float]:
    """Return tolerances, SI, by the quantity's name, from "NAME=VALUE" or "NAME=VALUE%" with the keys of a scenario.

    Raises
    ------
    InputError
        For a name that is not known, a value that is not a number, or a percentage of what is 0.
    """
    model = Model(robot, material, coefficients, conventions)
    declared, keys = quantities(model), tolerance_keys(model)
    found: dict[str, float] = {}
    for text in given:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise InputError(f"expected NAME=VALUE, got {text!r}", key="--tolerance")
        if key not in keys:
            raise InputError(f"unknown name {key!r}{nearest(key, keys)}", key="--tolerance")
        name, scale = keys[key]
        try:
            number = float(value.removesuffix("%"))
        except ValueError:
            raise InputError(f"{key}: expected a number, got {value!r}", key="--tolerance") from None
        if not (np.isfinite(number) and number >= 0):
            raise InputError(f"{key}: expected a number that is not negative, got {value}", key="--tolerance")
        share = value.endswith("%")
        if refusal := too_uncertain(number / 100 if share else number, share):
            raise InputError(f"{key}: {refusal}, got {value}", key="--tolerance")
        if not share:
            found[name] = number * scale
        elif name == "pressure":
            for k, P in enumerate(pressure):
                found[f"pressure.{k + 1}"] = number / 100 * float(P)
        elif declared[name].size == 1 and float(declared[name].nominal[0]) != 0:
            found[name] = number / 100 * abs(float(declared[name].nominal[0]))
        else:
            raise InputError(f"{key}: expected a number and no percentage of what may be 0", key="--tolerance")
    return found
