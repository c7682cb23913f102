"""Bending angles and elongations of the robots by both coefficient sets, beside the measured ones."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import MEASURED_ELONGATION, markdown, measured
from softnlp import BAR, COEFFICIENT_SETS, DEGREE, MILLIMETRE, Numerics, material, robot
from softnlp.model.quantities import Model
from softnlp.statics.arc import arc_pose, unloaded_arc
from softnlp.statics.solver import PoseSolver

SILICONE = material("Ecoflex 00-50")


def predictions() -> tuple[dict[str, dict[tuple[str, int], float]], dict[str, dict[str, float]]]:
    """Return, by coefficient set, the angle of (robot, number of sets) [deg] and each elongation [mm] at 1.5 bar."""
    angles: dict[str, dict[tuple[str, int], float]] = {}
    elongations: dict[str, dict[str, float]] = {}
    first = PoseSolver(Model(robot("D25L60"), SILICONE), Numerics())
    for label, coefficients in COEFFICIENT_SETS.items():
        angles[label], elongations[label] = {}, {}
        for name, P, _ in measured("measured_angles.csv", "bending_angle_deg"):
            poses = first.with_model(Model(robot(name), SILICONE, coefficients))
            angles[label][name, sum(p > 0 for p in P)] = _pose(poses, np.array(P)).bending_angle / DEGREE
            extended = _pose(poses, np.full(3, 1.5 * BAR))
            elongations[label][name] = (extended.backbone_length - poses.model.robot.length) / MILLIMETRE
    return angles, elongations


def _pose(poses: PoseSolver, P: np.ndarray):
    return arc_pose(poses, unloaded_arc(poses, P)[1])


def text() -> str:
    """Return the comparison."""
    angles, elongations = predictions()
    rows_measured = measured("measured_angles.csv", "bending_angle_deg")
    found = {(name, sum(p > 0 for p in P)): value for name, P, value in rows_measured}
    rows = []
    for name in dict.fromkeys(name for name, _ in found):
        both = [f"{of[name, 1]:.1f}\u00a0/\u00a0{of[name, 2]:.1f}" for of in (found, *angles.values())]
        rows.append([name, *both, *(f"{elongations[label][name]:.1f}" for label in elongations)])
    errors = [np.mean([abs(angles[label][key] - value) for key, value in found.items()]) for label in angles]
    rows.append(["mean error", "", *(f"**{e:.1f}**" for e in errors), "", ""])
    header = ["robot", "measured [deg]", *(f"{label} [deg]" for label in angles)]
    header += [f"elongation, {label} [mm]" for label in elongations]
    low, high = MEASURED_ELONGATION["L60"]
    return markdown(header, rows) + f"\n\nMeasured elongations of the robots of 60 mm: {low} to {high} mm."


if __name__ == "__main__":
    print(text())
