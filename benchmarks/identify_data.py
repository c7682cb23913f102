"""Writes the CSV files that the scenarios of `identify` read.

    python -m benchmarks.identify_data [FOLDER]

tensile.csv, tensile_force.csv: synthetic. Mooney-Rivlin of Ecoflex 00-50 with noise of 0.2 kPa, stretch 1 to 2; the
second as displacement and force of a specimen of 33 x 6 x 3 mm.
measured_*.csv: published. Shi et al., IEEE Transactions on Robotics 2025, doi 10.1109/TRO.2025.3626601: bending angles
and blocked forces at 1.5 bar in Ecoflex 00-50. Forces are linear in pressure and are given as such from 0.3 bar on.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measured import ANGLES, CURVE, FORCES, PRESSURE
from softnlp.model.materials import material

HIGHEST = PRESSURE

NOISE_KPA = 0.2
GAUGE_LENGTH, WIDTH, THICKNESS = 33.0, 6.0, 3.0  # [mm]

Rows = Sequence[Sequence[Any]]


def tensile() -> tuple[list[str], Rows]:
    """Return a synthetic tensile test."""
    stretch = np.linspace(1, 2, 41)
    noise = NOISE_KPA * np.random.default_rng(50).standard_normal(stretch.size)
    stress = np.asarray(material("Ecoflex 00-50").engineering_stress(stretch)) / 1e6 + noise / 1e3
    return ["stretch", "stress_MPa"], [[f"{x:.4f}", f"{y:.6f}"] for x, y in zip(stretch, stress, strict=True)]


def tensile_force() -> tuple[list[str], Rows]:
    """Return the same material as force over displacement, with noise of its own."""
    displacement = np.linspace(0, GAUGE_LENGTH, 34)
    noise = NOISE_KPA * np.random.default_rng(30).standard_normal(displacement.size)
    stress = (
        np.asarray(material("Ecoflex 00-50").engineering_stress(1 + displacement / GAUGE_LENGTH)) / 1e6 + noise / 1e3
    )
    force = stress * WIDTH * THICKNESS
    rows = [[f"{x:.2f}", f"{f:.5f}"] for x, f in zip(displacement, force, strict=True)]
    return ["displacement_mm", "force_N"], rows


def measured_angles() -> tuple[list[str], Rows]:
    """Return the eight published bending angles."""
    rows = []
    for name, (one, two) in ANGLES.items():
        rows += [[name, HIGHEST, 0, 0, one], [name, HIGHEST, HIGHEST, 0, two]]
    return ["robot", "p1_bar", "p2_bar", "p3_bar", "bending_angle_deg"], rows


def measured_forces() -> tuple[list[str], Rows]:
    """Return the eight published blocked forces."""
    rows = [[name, HIGHEST, 0, 0, force] for name, force in FORCES.items()]
    return ["robot", "p1_bar", "p2_bar", "p3_bar", "blocked_force_N"], rows


def measured_forces_and_angles() -> tuple[list[str], Rows]:
    """Return forces along the curve, with the angles where they were measured."""
    rows: list[list[Any]] = []
    for name, force in FORCES.items():
        for P in CURVE:
            angle = ANGLES[name][0] if name in ANGLES and P == HIGHEST else ""
            rows.append([name, P, 0, 0, f"{force * P / HIGHEST:.5g}", angle])
        if name in ANGLES:
            rows.append([name, HIGHEST, HIGHEST, 0, "", ANGLES[name][1]])
    return ["robot", "p1_bar", "p2_bar", "p3_bar", "blocked_force_N", "bending_angle_deg"], rows


TABLES = (tensile, tensile_force, measured_angles, measured_forces, measured_forces_and_angles)


def main(folder: Path) -> None:
    """Write every file."""
    for make in TABLES:
        header, rows = make()
        with open(folder / f"{make.__name__}.csv", "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([header, *rows])


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "scenarios" / "files")
