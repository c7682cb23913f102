"""Standard deviations of every step of a run, by what scatters: silicone, dimensions, pressures, loads, the wall.

To first order, by the exact derivatives of the solved step (`softnlp.studies.sensitivity`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.contact_settings import ContactSettings
from softnlp.model.laws import Constant, Law
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.pose_grid import Solved
from softnlp.statics.step import Deviation, Step
from softnlp.statics.wall import Wall
from softnlp.studies.derivatives import PoseDerivatives, entries_of
from softnlp.studies.law_curve import LawCurve
from softnlp.studies.sensitivity import Sensitivities, pressed_sensitivities, solved_sensitivities
from softnlp.studies.tolerances import ErrorBars, Scatter, error_bars

Array = NDArray[np.float64]

FACTOR = "stress_factor"
"""The constant that `scalable` adds to a law."""
_ROWS = (
    *("tip_position", "tip_rotation", "bending_angle", "backbone_length", "elongation", "stretch"),
    "chamber_lengths",
)
_ELSEWHERE = 1e-4  # of the length: tips further apart are of two poses
_UPRIGHT = 1e-9  # sine of a tilt that has a kink


@dataclass(frozen=True)
class Uncertainty:
    """What scatters in a run.

    Attributes
    ----------
    sources
        Independent of each other, the same at every step.
    pressure_share
        Standard deviation of each set's pressure as a fraction of it [1].
    wall
        Standard deviation of where the wall stands, along its normal [m].
    written
        The same by the keys of a scenario and in their units.
    """

    sources: tuple[Scatter, ...] = ()
    pressure_share: float = 0.0
    wall: float = 0.0
    written: Mapping[str, Any] = field(default_factory=dict)

    def at(self, step: Step) -> tuple[Scatter, ...]:
        """Return the sources at one step.

        Parameters
        ----------
        step
            With its pressures and, of a blocked force, its wall.

        Returns
        -------
        tuple
            `Scatter`, one a source.
        """
        found = list(self.sources)
        if self.pressure_share:
            moves = {f"pressure.{k + 1}": self.pressure_share * float(P) for k, P in enumerate(step.pressure)}
            found += [Scatter(name, {name: size}) for name, size in moves.items()]
        if self.wall and step.contact is not None:
            along = zip("xyz", step.contact.normal, strict=True)
            found.append(Scatter("wall", {f"contact.wall_point.{x}": self.wall * float(n) for x, n in along}))
        return tuple(found)


def stress_scatter(material: Material, share: float) -> Scatter:
    """Return the source that scales the whole stress of a material of `scalable`.

    share : its standard deviation, as a fraction [1].
    """
    constants = scaling_constants(material)
    return Scatter("material", {f"material.{name}": share * float(material.constants[name]) for name in constants})


def scaling_constants(material: Material) -> tuple[str, ...]:
    """Return constants whose common factor is one of the stress; none where the law has no such constants."""
    curve = LawCurve(material.law)
    values = np.array([float(v) for v in material.constants.values()]) / curve.units
    stretch = np.linspace(*material.fitted_stretch, 21)
    whole, _ = curve.evaluate(stretch, values)
    without, _ = curve.evaluate(stretch, np.where(curve.linear, 0.0, values))
    if not np.all(np.abs(without) <= 1e-12 * np.max(np.abs(whole))):
        return ()
    return tuple(c.name for c, linear in zip(material.law.constants, curve.linear, strict=True) if linear)


def scalable(material: Material) -> Material:
    """Return the material, with a further constant that is a factor of the stress where its own have none."""
    if material.law.constants and scaling_constants(material):
        return material
    law = material.law
    law_of, modulus = law.formula, law.modulus
    scaled = Law(
        law.name,
        (*law.constants, Constant(FACTOR, "1")),
        lambda stretch, **c: c.pop(FACTOR) * law_of(stretch, **c),
        None if modulus is None else lambda stretch, **c: c.pop(FACTOR) * modulus(stretch, **c),
    )
    return replace(material, law=scaled, constants={**material.constants, FACTOR: 1.0})


def sets_scatter(material: Material, others: Sequence[Material]) -> tuple[Scatter, ...]:
    """Return sources whose covariance is the sample covariance of the constants of several sets of one law.

    others : of every set, that of the material among them.
    """
    table = np.array([[float(v) for v in other.constants.values()] for other in others])
    moves = (table - table.mean(axis=0)) / np.sqrt(len(others) - 1)
    names = [f"material.{name}" for name in material.constants]
    return tuple(
        Scatter(f"material, set {other.set}", dict(zip(names, row.tolist(), strict=True)))
        for other, row in zip(others, moves, strict=True)
    )


class Deviations:
    """Adds standard deviations to steps, one after another; each is solved once more, from the last one.

    contact : of a blocked force against a wall.
    """

    def __init__(
        self, model: Model, numerics: Numerics, loads: Loads, contact: ContactSettings | None, uncertainty: Uncertainty
    ) -> None:
        if any(f"material.{FACTOR}" in source.moves for source in uncertainty.sources):
            model = replace(model, material=scalable(model.material))
        if contact is None:  # a pose of a scenario that has a wall, too
            kept = [s for s in uncertainty.sources if not any(name.startswith("contact.") for name in s.moves)]
            uncertainty = replace(uncertainty, sources=tuple(kept), wall=0.0)
        self.uncertainty, self.loads, self.model = uncertainty, loads, model
        self._poses = PoseDerivatives(pose_solver(model, numerics))
        self._blocked = None if contact is None else blocked_solver(model, numerics, contact)
        self._near: Solved | None = None
        self._near_blocked: Blocked | None = None

    def added(self, step: Step) -> Step:
        """Return the step with its standard deviations, or with the reason why it has none."""
        found, why = self.found(step)
        if found is None:
            nothing = Deviation({}, why)
            warned = (f"no standard deviations: {why}",) if step.status.has_solution else ()
            return replace(step, deviation=nothing, warnings=(*step.warnings, *warned))
        kinks = [words for words in found.warnings if words not in step.warnings]
        values, upright = _values(error_bars(found, self.uncertainty.at(step)), step)
        if upright:
            kinks.append("the tip points along z: its tilt has a kink there, so it has no derivative")
        return replace(step, deviation=Deviation(values, "; ".join(kinks)))

    def found(self, step: Step) -> tuple[Sensitivities | None, str]:
        """Return the sensitivities of a step by what scatters, or why there are none."""
        if step.pose is None or not step.status.has_solution:
            return None, step.message
        if step.pose.stable is False:
            return None, "the pose is not stable"
        sources = self.uncertainty.at(step)
        names = tuple(dict.fromkeys(_stem(name) for source in sources for name in source.moves))
        found = self._of_pose(step, names) if self._blocked is None else self._of_blocked(step, names)
        again = found.step.pose
        if again is not None and self._apart(again.tip_position, step.pose.tip_position):
            return None, "solved again the step ends in another pose"
        if not found.solved:
            return None, "; ".join(found.warnings) or found.step.message
        return found, ""

    def _of_pose(self, step: Step, names: tuple[str, ...]) -> Sensitivities:
        again, solved = self._poses.poses.solve(step.pressure, self.loads, self._near)
        self._near = solved or self._near
        return solved_sensitivities(self._poses, again, solved, _ROWS, names)

    def _of_blocked(self, step: Step, names: tuple[str, ...]) -> Sensitivities:
        assert self._blocked is not None
        assert step.contact is not None
        wall = Wall(step.contact.wall_point, step.contact.normal)
        again, found = self._blocked.solve(step.pressure, self.loads, wall, self._near_blocked)
        self._near_blocked = found
        return pressed_sensitivities(self._blocked, self.loads, again, found, (*_ROWS, "blocked_force"), names)

    def _apart(self, one: Array, other: Array) -> bool:
        return bool(np.max(np.abs(one - other)) > _ELSEWHERE * float(self.model.robot.length))


def _values(bars: ErrorBars, step: Step) -> tuple[dict[str, Array], bool]:
    """Return the deviations by the names of outputs [SI], and whether the tip points along z, so that tilt has none."""
    names = {name: name for name in (*_ROWS, "blocked_force")} | {"chamber_lengths": "chamber_length"}
    found = {}
    for row, name in names.items():
        if (entries := entries_of(bars.outputs, row)) and row != "tip_rotation":
            total = bars.total[entries]
            found[name] = total if len(entries) > 1 or row == "chamber_lengths" else total[0]
    assert step.pose is not None
    x, y, _ = step.pose.tip_rotation[:, 2]
    sine = float(np.hypot(x, y))
    if sine <= _UPRIGHT:
        return {**found, "tilt": np.array(np.nan)}, True
    turned = bars.contribution[entries_of(bars.outputs, "tip_rotation")]
    return {**found, "tilt": np.array(np.linalg.norm(turned[0] * y - turned[1] * x) / sine)}, False


def _stem(name: str) -> str:
    """Return the quantity of an entry: "pressure" of "pressure.1"."""
    stem, _, last = name.rpartition(".")
    return stem if last.isdigit() or last in ("x", "y", "z") else name
