"""Paths beside point-by-point inverse kinematics in one run: time, smoothness, and which limits are kept.

    python -m benchmarks.trajectory [points] [points of the second, inverse]

A circle of 12 mm: free, with one segment; and with two segments that go through a port and around a ball, 1 mm away
from both. Inverse kinematics knows neither rates nor obstacles. It takes long for sets to spare, so that of the second
circle it is given some points only, evenly spread. Smoothness is the root mean square of the rates of pressure.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from numpy.typing import NDArray

from softnlp import BAR, MILLIMETRE, Run, Segment, Sphere, Trocar, inverse, material, robot, segmented_robot, trajectory
from softnlp.statics.clearance import BodyGaps

Array = NDArray[np.float64]

SILICONE = material("Ecoflex 00-50", "mooney-rivlin")
DURATION, RATE, CLEARANCE = 20.0, 0.2, 1.0  # s, bar/s, mm
PORT = Trocar(point=(0, 0, 0.012), axis=(0, 0, 1), radius=0.014, length=0.006, name="port")
BALL = Sphere(centre=(0.027, 0.0, 0.045), radius=0.010, name="ball")


def circle(count: int) -> Array:
    """Return points of the circle, the last one as the first [m]."""
    angle = np.linspace(0, 2 * np.pi, count)
    return np.column_stack([12 * np.cos(angle), 12 * np.sin(angle), np.full(count, 72.0)]) * MILLIMETRE


def told(name: str, run: Run, times: Array, seconds: float, gaps: BodyGaps | None) -> None:
    """Print one line of a run."""
    P = np.array([step.pressure for step in run.steps]) / BAR
    rates = np.diff(P, axis=0) / np.diff(times)[:, None]
    solved = sum(step.status.has_solution for step in run.steps)
    least = "-"
    if gaps is not None:
        every = [gaps.at(step.pose)[1].min() for step in run.steps if step.pose is not None]
        least = f"{min(every) / MILLIMETRE:.3f} mm"
    print(
        f"{name:34s} {solved:3d} of {len(P):3d} met  {seconds:7.1f} s  rms rate {np.sqrt(np.mean(rates**2)):.5f}"
        f"  largest rate {np.abs(rates).max():.4f} bar/s  pressures {P.min():.3f} to {P.max():.3f} bar  gap {least}"
    )


def main(count: int = 100, few: int = 8) -> None:
    """Solve both circles both ways."""
    one, half = robot("D25L60"), robot("D25L60", length=0.03)
    two = segmented_robot([Segment(half, SILICONE), Segment(half, SILICONE)])
    times = np.linspace(0, DURATION, count)
    began = time.process_time()
    run = trajectory(one, SILICONE, times=times, positions=circle(count), rate=RATE * BAR)
    told("one segment, free: path", run, times, time.process_time() - began, None)
    began = time.process_time()
    run = inverse(one, SILICONE, positions=circle(count))
    told("one segment, free: point by point", run, times, time.process_time() - began, None)

    obstacles, gaps = [PORT, BALL], BodyGaps([PORT, BALL], float(two.length))
    for minimise in ("pressure", "rate"):
        began = time.process_time()
        run = trajectory(
            two,
            two.material,
            times=times,
            positions=circle(count),
            rate=RATE * BAR,
            obstacles=obstacles,
            clearance=CLEARANCE * MILLIMETRE,
            minimise=minimise,  # type: ignore[arg-type]
        )
        told(f"two segments: path, least {minimise}", run, times, time.process_time() - began, gaps)
    some = np.unique(np.round(np.linspace(0, count - 1, few)).astype(int))
    began = time.process_time()
    run = inverse(two, two.material, positions=circle(count)[some])
    told(f"two segments: {some.size} points alone", run, times[some], time.process_time() - began, gaps)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
