"""How far a model is from everything that was measured of the paper's robots: one table for each way to model them.

    python -m benchmarks.judge [LABEL ...]

`judge` solves the eight angles, the elongations, the eight blocked forces along the pressure, and the laparoscope as it
was built, and compares them with `benchmarks/measured.py`. A further way to model is one more `Variant`.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.measured import ANGLES, CURVE, ELONGATIONS, FORCES, PRESSURE, SILICONE, published
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import COEFFICIENT_SETS, REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material, material
from softnlp.model.robot import robot
from softnlp.rings import ENERGY
from softnlp.statics.step import Step
from softnlp.studies.blocked_force import blocked_force
from softnlp.studies.forward import forward

SETS = 3
ELONGATION_FACTOR = 1.284
"""c_m of the energy section with Mooney-Rivlin, from the mean elongation of the L60 robots, 38.67 mm."""


@dataclass(frozen=True)
class Variant:
    """A way to model the robots. fitted : how many of its constants were fitted to these measurements.

    model, set : of the silicone's law and constants. closure : of the blocked force.
    """

    label: str
    fitted: int
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION
    model: str = "mooney-rivlin"
    set: str | None = None
    closure: str = "compliant"

    def silicone(self, name: str) -> Material:
        """Return a silicone by the law and set of this variant."""
        return material(name, self.model, set=self.set)


VARIANTS = (
    Variant("reproduction", 3, COEFFICIENT_SETS["reproduction"]),
    Variant("calibrated", 5, COEFFICIENT_SETS["calibrated"]),
    Variant("energy", 1, Coefficients(modulus_factor=ELONGATION_FACTOR), ENERGY, closure="none"),
)


@dataclass(frozen=True)
class Judgement:
    """What a variant gives; NaN where a step has no solution.

    angles : [deg] by robot and number of sets. elongations : with three sets [mm] by robot. forces : along `CURVE` [N]
    by robot. laparoscope : angle with one set, with two sets [deg], blocked force [N].
    """

    variant: Variant
    angles: Mapping[tuple[str, int], float]
    elongations: Mapping[str, float]
    forces: Mapping[str, tuple[float, ...]]
    laparoscope: tuple[float, float, float]

    @property
    def angle_errors(self) -> dict[tuple[str, int], float]:
        """Model less measured [deg]."""
        return {(name, sets): angle - ANGLES[name][sets - 1] for (name, sets), angle in self.angles.items()}

    @property
    def force_errors(self) -> dict[str, tuple[float, ...]]:
        """Model less measured, in % of measured, along `CURVE`."""
        return {
            name: tuple(100 * (f / (FORCES[name] * p / PRESSURE) - 1) for f, p in zip(curve, CURVE, strict=True))
            for name, curve in self.forces.items()
        }

    @property
    def elongation_errors(self) -> dict[str, float]:
        """How far outside the published range of its length [mm]; 0 within it."""
        found = {}
        for name, value in self.elongations.items():
            low, high = ELONGATIONS[name[-3:]]
            found[name] = min(value - low, 0.0) + max(value - high, 0.0)
        return found

    @property
    def table(self) -> dict[str, float]:
        """The errors in a few numbers: means of absolute values, of the steps that have a solution."""
        forces = np.array(list(self.force_errors.values()))
        measured = published()["measured_laparoscope"]
        one, two, force = self.laparoscope
        return {
            "angles [deg]": float(np.nanmean(np.abs(list(self.angle_errors.values())))),
            "elongations outside the range [mm]": float(np.nanmean(np.abs(list(self.elongation_errors.values())))),
            "force at 1.5 bar [%]": float(np.nanmean(np.abs(forces[:, -1]))),
            "force along 0.3 to 1.5 bar [%]": float(np.nanmean(np.abs(forces))),
            "laparoscope, one set [deg]": one - measured["bending_angle_deg"][0],
            "laparoscope, two sets [deg]": two - measured["bending_angle_deg"][1],
            "laparoscope, force [%]": 100 * (force / measured["blocked_force_N"] - 1),
            "constants fitted": float(self.variant.fitted),
        }


def judge(variant: Variant, robots: Sequence[str] = tuple(FORCES)) -> Judgement:
    """Return what a variant gives for everything that was measured of some robots, and for the laparoscope."""
    silicone = variant.silicone(SILICONE)
    angles = {
        (name, sets): _number(_pose(variant, silicone, name, [PRESSURE] * sets), "angle")
        for name in robots
        for sets in (1, 2)
        if name in ANGLES
    }
    elongations = {
        name: _number(_pose(variant, silicone, name, [PRESSURE] * SETS), "length") - robot(name).length / MILLIMETRE
        for name in robots
    }
    forces = {name: tuple(_forces(variant, silicone, name, CURVE)) for name in robots}
    built = published()["measured_laparoscope"]
    other, name, P = variant.silicone(built["material"]), built["robot"], built["pressure_bar"]
    one, two = (_number(_pose(variant, other, name, [P] * sets), "angle") for sets in (1, 2))
    # Followed in as many steps as the others: the blocked shape of one jump may be another equilibrium.
    force = _forces(variant, other, name, np.linspace(P / len(CURVE), P, len(CURVE)).tolist())[-1]
    return Judgement(variant, angles, elongations, forces, (one, two, force))


def _pose(variant: Variant, silicone: Material, name: str, pressed: Sequence[float]) -> Step:
    """Return the last of five poses on the way to these pressures [bar] of the first sets."""
    full = np.array([*pressed, *[0.0] * (SETS - len(pressed))]) * BAR
    settings = {"coefficients": variant.coefficients, "conventions": variant.conventions}
    return forward(robot(name), silicone, np.outer(np.linspace(0.2, 1, 5), full), **settings).steps[-1]


def _number(step: Step, what: str) -> float:
    """Return the bending angle [deg] or the length [mm] of a step, NaN where it has no solution."""
    if step.pose is None or not step.status.has_solution:
        return float("nan")
    return step.pose.bending_angle / DEGREE if what == "angle" else step.pose.backbone_length / MILLIMETRE


def _forces(variant: Variant, silicone: Material, name: str, curve: Sequence[float]) -> list[float]:
    """Return the blocked force at each pressure [bar] of one set [N]."""
    P = np.zeros((len(curve), SETS))
    P[:, 0] = np.array(curve) * BAR
    contact = ContactSettings(closure=variant.closure)  # type: ignore[arg-type]
    settings = {"coefficients": variant.coefficients, "conventions": variant.conventions}
    run = blocked_force(robot(name), silicone, P, contact, **settings)
    return [s.contact.force if s.contact and s.status.has_solution else float("nan") for s in run.steps]


def report(judged: Sequence[Judgement]) -> str:
    """Return the errors of several variants beside each other, and what each gives for each robot."""
    labels = [one.variant.label for one in judged]
    width = max(14, *(len(label) + 2 for label in labels))
    lines = [" " * 38 + "".join(label.rjust(width) for label in labels)]
    for row in judged[0].table:
        lines.append(f"{row:38}" + "".join(f"{one.table[row]:.3g}".rjust(width) for one in judged))
    for one in judged:
        elongations = ", ".join(f"{name} {value:.1f}" for name, value in one.elongations.items())
        angles = ", ".join(f"{name}/{sets} {error:+.0f}" for (name, sets), error in one.angle_errors.items())
        forces = ", ".join(f"{name} {errors[-1]:+.0f}" for name, errors in one.force_errors.items())
        lines += ["", one.variant.label, f"  elongation [mm]: {elongations}", f"  angle errors [deg]: {angles}"]
        lines.append(f"  force errors at {PRESSURE} bar [%]: {forces}")
    return "\n".join(lines)


def main(labels: Sequence[str] = ()) -> None:
    """Print the judgement of the variants that are named, by default of all."""
    print(report([judge(variant) for variant in VARIANTS if not labels or variant.label in labels]))


if __name__ == "__main__":
    main(sys.argv[1:])
