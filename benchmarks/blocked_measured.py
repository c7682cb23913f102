"""The simulated blocked force beside the eight measured ones (Ecoflex 00-50, one set, tip held at x = 0).

    python -m benchmarks.blocked_measured

The `free` closure (no constraint of the chambers), `compliant`, `weighted` (one set of weights for all robots, where
the paper tunes them for each) and `rigid` with the coefficients of the set `reproduction`, and `compliant` with the set
`calibrated`. Forces at 1.5 bar ("fold": the branch from zero pressure ends before), then mean absolute percentage
errors there and over the curve from 0.3 to 1.5 bar in steps of 0.3, where the measured force is taken as linear in
pressure; both over the steps that have a solution. Last, what `weighted` gives and leaves for one robot with other
weights.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.measured import FORCES, PRESSURE
from softnlp.base.units import BAR
from softnlp.model.contact_settings import ClosureWeights, ContactSettings
from softnlp.model.conventions import COEFFICIENT_SETS
from softnlp.model.materials import material
from softnlp.model.robot import robot
from softnlp.studies.blocked_force import blocked_force

Array = NDArray[np.float64]

MEASURED_AT, MEASURED = PRESSURE, FORCES  # [bar], [N]
PRESSURES = np.linspace(0.3, MEASURED_AT, 5)  # [bar]


@dataclass(frozen=True)
class Compared:
    """A model of the comparison: closure and set of coefficients."""

    closure: str
    coefficients: str

    @property
    def label(self) -> str:
        """The model in words."""
        return f"{self.closure}, {self.coefficients}"


MODELS = (
    Compared("free", "reproduction"),
    Compared("compliant", "reproduction"),
    Compared("compliant", "calibrated"),
    Compared("weighted", "reproduction"),
    Compared("rigid", "reproduction"),
)
WEIGHTS = ClosureWeights(force=10.0, moment=10.0, length=20.0)  # [1/N], [1/(N m)], [1/m]
LENGTH_WEIGHTS = (5.0, 20.0, 50.0)  # [1/m], of one robot


def forces(name: str, model: Compared) -> Array:
    """Return the simulated force of a robot at each of PRESSURES [N], NaN where a step has no solution."""
    P = np.zeros((len(PRESSURES), 3))
    P[:, 0] = PRESSURES * BAR
    contact = ContactSettings(closure=model.closure, weights=WEIGHTS)  # type: ignore[arg-type]
    run = blocked_force(
        robot(name), material("Ecoflex 00-50"), P, contact, coefficients=COEFFICIENT_SETS[model.coefficients]
    )
    return np.array([s.contact.force if s.contact and s.status.has_solution else np.nan for s in run.steps])


def measured_curve(name: str) -> Array:
    """Return the measured force at each of PRESSURES [N], linear in pressure."""
    return np.asarray(MEASURED[name] * PRESSURES / MEASURED_AT)


def percent_errors(simulated: Mapping[str, Array]) -> tuple[float, float]:
    """Return the mean absolute percentage errors at 1.5 bar and over the whole curve, of what is not NaN."""
    errors = np.array([100 * np.abs(f / measured_curve(name) - 1) for name, f in simulated.items()])
    return float(np.nanmean(errors[:, -1])), float(np.nanmean(errors))


def with_length_weight(length: float) -> tuple[float, float]:
    """Return the force [N] that `weighted` gives for D25L60 at 1.5 bar with a weight W_L [1/m], and e_m left [N m]."""
    contact = ContactSettings(closure="weighted", weights=replace(WEIGHTS, length=length))
    P = np.zeros((len(PRESSURES), 3))
    P[:, 0] = PRESSURES * BAR
    step = blocked_force(robot("D25L60"), material("Ecoflex 00-50"), P, contact).steps[-1]
    if step.contact is None:
        raise RuntimeError(step.message)
    return step.contact.force, next(line.value for line in step.contact.weighted if line.equation == "e_m")


def main(models: Sequence[Compared] = MODELS) -> None:
    """Print the comparison."""
    found = {model: {name: forces(name, model) for name in MEASURED} for model in models}
    width = max(len(model.label) for model in models) + 2
    header = "".join(model.label.rjust(width) for model in models)
    print(f"blocked force at {MEASURED_AT} bar [N]\n{'robot':8}{'measured':>10}{header}")
    for name, measured in MEASURED.items():
        cells = [found[m][name][-1] for m in models]
        print(f"{name:8}{measured:10.2f}" + "".join(("fold" if f != f else f"{f:.3f}").rjust(width) for f in cells))
    errors = [percent_errors(found[m]) for m in models]
    print("\nmean absolute percentage error")
    print(f"{'at 1.5 bar':18}" + "".join(f"{at_end:{width}.1f}" for at_end, _ in errors))
    print(f"{'0.3 to 1.5 bar':18}" + "".join(f"{curve:{width}.1f}" for _, curve in errors))
    print("\nweighted, D25L60, 1.5 bar, W_n = 10 /N, W_m = 10 /(N m)")
    for length in LENGTH_WEIGHTS:
        force, left = with_length_weight(length)
        print(f"W_L = {length:4.0f} /m {force:8.3f} N, e_m = {1e3 * left:5.1f} N mm")


if __name__ == "__main__":
    main()
