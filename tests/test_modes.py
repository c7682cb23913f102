"""Natural frequencies against beams of the textbook, and the linear system against statics and the motion itself."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.optimize import brentq

from softnlp import BAR, Body, Loads, Numerics, Segment, forward, material, robot
from softnlp.cli import main
from softnlp.dynamics.drive import Series
from softnlp.dynamics.simulation import Dynamics, Simulation
from softnlp.model.round_chambers import RoundChambers
from softnlp.studies.modes import modes

Array = NDArray[np.float64]
D25, RUBBER = robot("D25L60"), material("Ecoflex 00-50")
REST = [0.0, 0.0, 0.0]
EULER = (1.8751040687, 4.6940911330, 7.8547574382)


class Beam:
    """The beam that a robot is at rest, from its section alone. A, I, J : areas; E, G : moduli."""

    def __init__(self, made: object, rubber: object) -> None:
        section = RoundChambers(made, rubber)  # type: ignore[arg-type]
        numbers = {q.name: float(q.nominal[0]) for q in section.quantities()}
        state = section.at(numbers, [0.0] * section.sets, 1.0)
        self.EA, self.GA, self.GJ = (
            float(v) for v in (state.axial_stiffness, state.shear_stiffness, state.torsional_stiffness)
        )
        self.EI, self.mass = float(state.bending_stiffness[0]), float(state.line_density)
        self.inertia = self.mass * self.EI / self.EA  # rho I
        self.length = numbers["robot.length"]

    def timoshenko(self, highest: float) -> list[float]:
        """Return the bending frequencies [Hz] of a cantilever by shooting: w' = V/GA + turn, turn' = M/EI."""

        def tip(omega: float) -> float:
            A = np.zeros((4, 4))  # w, turn, M, V
            A[0, 1], A[0, 3] = 1.0, 1 / self.GA
            A[1, 2] = 1 / self.EI
            A[2, 1], A[2, 3] = -self.inertia * omega**2, -1.0
            A[3, 0] = -self.mass * omega**2
            return float(np.linalg.det(scipy.linalg.expm(A * self.length)[2:, 2:]))

        grid = 2 * np.pi * np.linspace(0.1, highest, 400)
        values = [tip(omega) for omega in grid]
        signs = [k for k in range(len(grid) - 1) if values[k] * values[k + 1] < 0]
        return [float(brentq(tip, grid[k], grid[k + 1], xtol=1e-10)) / (2 * np.pi) for k in signs]


def frequencies(found: object, kind: str) -> list[float]:
    """Return the different frequencies of a kind; those of bending are twofold."""
    every = [mode.frequency for mode in found.found.modes if mode.kind == kind]  # type: ignore[attr-defined]
    return every[::2] if kind == "bending" else every


def test_slender_rods_are_those_of_euler_and_bernoulli() -> None:
    made = replace(D25, length=5.0)
    beam, found = Beam(made, RUBBER), modes(made, RUBBER, REST, numerics=Numerics(intervals=4))
    for beta, frequency in zip(EULER, frequencies(found, "bending"), strict=False):
        exact = beta**2 / (2 * np.pi * beam.length**2) * np.sqrt(beam.EI / beam.mass)
        assert frequency == pytest.approx(exact, rel=1e-3)
    assert found.found is not None


def test_a_robot_is_the_beam_of_timoshenko() -> None:
    beam, found = Beam(D25, RUBBER), modes(D25, RUBBER, REST)
    exact = beam.timoshenko(100.0)
    assert exact[0] == pytest.approx(9.90, abs=0.005)
    for mine, other in zip(frequencies(found, "bending")[:3], exact, strict=True):
        assert mine == pytest.approx(other, rel=1e-4)
    torsion = np.sqrt(beam.GJ / (2 * beam.inertia)) / (4 * beam.length)
    extension = np.sqrt(beam.EA / beam.mass) / (4 * beam.length)
    assert frequencies(found, "torsion")[0] == pytest.approx(torsion, rel=1e-6)
    assert frequencies(found, "torsion")[1] == pytest.approx(3 * torsion, rel=1e-5)
    assert frequencies(found, "extension")[0] == pytest.approx(extension, rel=1e-6)


def test_damping_ratios_and_shapes() -> None:
    tau = 2e-3
    found = modes(D25, RUBBER, REST, damping=tau).found
    assert found is not None
    for mode in found.modes[:8]:
        assert mode.damping_ratio == pytest.approx(np.pi * mode.frequency * tau, rel=1e-6)
    bending = found.modes[0].displacement
    assert np.linalg.norm(bending[-1]) == pytest.approx(1.0, rel=1e-9)
    assert np.abs(bending[:, 2]).max() < 1e-9
    assert np.all(np.diff(np.linalg.norm(bending, axis=1)) > 0)
    assert found.stable


def test_a_mass_at_the_tip_slows_it() -> None:
    """Of a slender rod with a mass M much larger than its own, 3 EI / (L^3 (M + 33/140 of its own))."""
    made = replace(D25, length=1.0)
    beam = Beam(made, RUBBER)
    M = 5 * beam.mass * beam.length
    found = modes(made, RUBBER, REST, tip_mass=M)
    exact = np.sqrt(3 * beam.EI / (beam.length**3 * (M + 33 / 140 * beam.mass * beam.length))) / (2 * np.pi)
    assert frequencies(found, "bending")[0] == pytest.approx(exact, rel=2e-3)


def test_a_pose_that_buckles_says_so() -> None:
    tall = replace(robot("D10L60"), length=0.12)
    found = modes(tall, material("Ecoflex 00-10"), REST, loads=Loads(gravity="standing"))
    assert found.found is not None
    assert not found.found.stable
    assert not found.found.modes[0].stable
    assert found.found.modes[0].frequency == 0.0
    assert "not stable" in found.warnings[-1]
    assert modes(tall, material("Ecoflex 00-10"), REST, loads=Loads(gravity="hanging")).found.stable  # type: ignore[union-attr]


BENT = np.array([0.8, 0.3, 0.1]) * BAR
PULLED = Loads((0.02, 0.01, 0.02), gravity="hanging")


def test_the_linear_system_is_that_of_statics_at_rest() -> None:
    """Tip by pressures and tip force, about a pose bent in space, against differences of poses."""
    found = modes(D25, RUBBER, BENT, loads=PULLED, damping=3e-3, lag=0.02).found
    assert found is not None
    system = found.linear
    assert np.all(np.linalg.eigvals(system.A).real < 0)
    gain = system.D - system.C @ np.linalg.solve(system.A, system.B)
    exact = Numerics(accuracy=1e-9, engine="newton", tolerance=1e-11)
    for j in range(3):
        ends = [BENT + sign * 300 * np.eye(3)[j] for sign in (1, -1)]
        steps = forward(D25, RUBBER, ends, loads=PULLED, numerics=exact).steps
        tips = [step.pose.tip_position for step in steps if step.pose is not None]
        assert np.allclose(gain[:3, j], (tips[0] - tips[1]) / 600, rtol=0, atol=2e-5 * np.abs(gain[:3, j]).max())
    assert np.allclose(gain[:3, 3:], gain[:3, 3:].T, rtol=0, atol=1e-6 * np.abs(gain[:3, 3:]).max())
    assert np.allclose(gain[3:], 0, atol=1e-6 * np.abs(gain).max())


def test_the_linear_system_moves_as_the_motion_does() -> None:
    """A small push at the tip of a pose bent in space is let go, at steps of a quarter of a millisecond."""
    push, end = np.array([1e-4, 5e-5, -1e-4]), 0.05
    found = modes(D25, RUBBER, BENT, loads=Loads(gravity="hanging"), damping=3e-3).found
    assert found is not None
    system = found.linear
    begin = -np.linalg.solve(system.A, system.B[:, 3:] @ push)
    linear = system.C @ scipy.linalg.expm(system.A * end) @ begin
    asked = Dynamics(end, 2.5e-4, damping=3e-3, output_step=end, release=True)
    held, none = Series(np.zeros(1), BENT[None]), Series(np.zeros(1), np.zeros((1, 3)))
    body = Body([Segment(D25, RUBBER)])
    last = list(Simulation(body, Loads(tuple(push), gravity="hanging"), asked, held, none).run())[-1].instant
    moved = last.at.position[-1] - found.tip
    size = np.abs(system.C[:3] @ begin).max()
    assert np.abs(linear[:3]).max() > 0.2 * size
    assert np.allclose(moved, linear[:3], rtol=0, atol=3e-3 * size)


SCENARIO = """
study = "forward"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[pressure]
sequence_bar = [[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]]
"""


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.toml"
    path.write_text(SCENARIO)
    assert main(["modes", str(path), "--json", "--out", str(tmp_path / "out")]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["modes"][0]["frequency_Hz"] == pytest.approx(9.90, abs=0.005)
    assert document["modes"][0]["kind"] == "bending"
    assert document["modes"][0]["damping_ratio"] == 0.0
    assert document["status"] == "solved"
    assert document["stable"] is True
    mat = loadmat(tmp_path / "out/linear.mat")
    npz = np.load(tmp_path / "out/linear.npz")
    for name in "ABCD":
        assert np.array_equal(mat[name], npz[name])
    assert mat["A"].shape[0] == len(npz["states"])
    assert mat["B"].shape[1] == len(npz["inputs"]) == 6
    assert main(["modes", str(path)]) == 0
    assert "bending" in capsys.readouterr().out
    path.write_text(SCENARIO.replace("forward", "inverse"))
    assert main(["modes", str(path)]) == 2


def test_an_obstacle_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What it holds back would swing in another way."""
    path = Path(__file__).parent.parent / "scenarios" / "contact" / "sphere.toml"
    assert main(["modes", str(path), "--out", str(tmp_path / "out")]) == 2
    shown = capsys.readouterr()
    assert not shown.out
    assert shown.err.count("\n") == 1
    assert "[obstacle]" in shown.err
    assert not (tmp_path / "out").exists()


def test_files_are_read_by_xarray(tmp_path: Path) -> None:
    import xarray as xr

    path = tmp_path / "a.toml"
    path.write_text(SCENARIO)
    assert main(["modes", str(path), "--json", "--out", str(tmp_path), "--count", "3"]) == 0
    dataset = xr.load_dataset(tmp_path / "modes.nc", engine="h5netcdf")
    assert dataset["frequency_Hz"].shape == (3,)
    assert dataset["displacement"].dims == ("mode", "s", "axis")
    assert dataset["A"].shape[0] == dataset["A"].shape[1]
