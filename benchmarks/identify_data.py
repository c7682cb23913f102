"""Writes the files that the scenarios of `identify` read.

    python -m benchmarks.identify_data [FOLDER]

tensile.csv, tensile_force.csv: synthetic. Mooney-Rivlin of Ecoflex 00-50 with noise of 0.2 kPa, stretch 1 to 2; the
second as displacement and force of a specimen of 33 x 6 x 3 mm.
machine_test.csv: synthetic, as a testing machine writes it: the same material, three load cycles, a tenth softer from
the first unloading on, a preload that was not tared, decimal commas.
tracker.csv, tracker_pressures.csv: synthetic, as a tracker and a logger of absolute pressures write them: D25L60 of
Ecoflex 00-50, k_e 0.55, k_b 2.2, in the tracker's frame, the sensor beyond the tip, ten samples lost, clocks 0.35 s
apart.
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
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.measured import ANGLES, CURVE, FORCES, PRESSURE
from softnlp import BAR, Coefficients, forward, material, robot

HIGHEST = PRESSURE

NOISE_KPA = 0.2
GAUGE_LENGTH, WIDTH, THICKNESS = 33.0, 6.0, 3.0  # [mm]
PRELOAD = 0.03  # [N]
SOFTENED = 0.9  # the stress from the first unloading on, over that of the first loading
SAMPLES = 12  # of the tracker on each plateau, at 10 Hz
LATER = 0.35  # [s] the logger's clock
BASE = ("ZYX", [-35, 70, 15]), (240.0, -85.0, 130.0)  # the robot's frame in that of the tracker [deg], [mm]
OFFSET = (2.0, -1.0, 6.0)  # the sensor in the frame of the tip [mm]
NOISE_MM, AIR_MBAR = 0.3, 987.0

Array = NDArray[np.float64]
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


def machine_test() -> str:
    """Return three load cycles as a testing machine writes them."""
    random = np.random.default_rng(7)
    loading = np.concatenate([np.linspace(1, 1.8, 33), np.linspace(1.8, 1, 33)[1:]])
    stretch = np.tile(loading, 3)
    stress = np.asarray(material("Ecoflex 00-50").engineering_stress(stretch)) / 1e6
    stress[33:] *= SOFTENED
    noise = NOISE_KPA * random.standard_normal(stretch.size) / 1e3
    force = (stress + noise) * WIDTH * THICKNESS + PRELOAD
    head = ["Specimen;A-3", f"Width;{WIDTH:.1f};mm", f"Thickness;{THICKNESS:.1f};mm", f"Gauge length;{GAUGE_LENGTH};mm"]
    rows = [
        f"{k / 2:.1f};{GAUGE_LENGTH * (x - 1):.3f};{1e-3 * f:.7f}"
        for k, (x, f) in enumerate(zip(stretch, force, strict=True))
    ]
    return "\n".join([*head, "", "Time;Crosshead;Load", "s;mm;kN", *rows]).replace(".", ",") + "\n"


def _levels() -> Array:
    """Return the pressures (plateaus, 3) of a robot that is tracked [bar]."""
    random = np.random.default_rng(11)
    return np.concatenate([np.zeros((1, 3)), random.choice([0, 0.4, 0.8, 1.2], size=(19, 3))])


def tracker() -> str:
    """Return what a tracker writes of the tip's sensor."""
    random, steps = np.random.default_rng(12), _levels()
    run = forward(
        robot("D25L60"),
        material("Ecoflex 00-50"),
        BAR * steps,
        coefficients=Coefficients(elongation=0.55, bending=2.2),
    )
    R = Rotation.from_euler(*BASE[0], degrees=True)
    rows = []
    for k in range(SAMPLES * len(steps)):
        pose = run.steps[k // SAMPLES].pose
        assert pose is not None
        place = 1e3 * pose.tip_position + pose.tip_rotation @ OFFSET + NOISE_MM * random.standard_normal(3)
        place = R.apply(place) + BASE[1]
        x, y, z, w = (R * Rotation.from_matrix(pose.tip_rotation)).as_quat()
        numbers = [*(f"{q:.5f}" for q in (w, x, y, z)), *(f"{v:.3f}" for v in place)]
        seen = k % 23 != 15
        rows.append("\t".join([f"{k / 10:.1f}", "OK", *numbers] if seen else [f"{k / 10:.1f}", "Missing"]))
    return "\n".join(["Time (s)\tState\tQ0\tQx\tQy\tQz\tTx (mm)\tTy (mm)\tTz (mm)", *rows]) + "\n"


def tracker_pressures() -> str:
    """Return what a logger of absolute pressures writes meanwhile, by its own clock."""
    random, steps = np.random.default_rng(13), _levels()
    rows = []
    for k in range(5 * SAMPLES * len(steps) // 10):
        now = steps[min(int(k * 0.2 * 10 / SAMPLES), len(steps) - 1)]
        values = AIR_MBAR + 1e3 * now + 1.5 * random.standard_normal(3)
        rows.append(",".join([f"{0.2 * k + LATER:.2f}", *(f"{v:.1f}" for v in values)]))
    return "\n".join(["t_s,P1 (mbar),P2 (mbar),P3 (mbar)", *rows]) + "\n"


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
TEXTS = (machine_test, tracker, tracker_pressures)


def main(folder: Path) -> None:
    """Write every file."""
    for make in TABLES:
        header, rows = make()
        with open(folder / f"{make.__name__}.csv", "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([header, *rows])
    for text in TEXTS:
        (folder / f"{text.__name__}.csv").write_text(text())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "scenarios" / "files")
