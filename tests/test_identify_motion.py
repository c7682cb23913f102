"""Damping, lag and modulus from a tip over time: recovered from synthetic traces, refused where it cannot be."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softnlp import BAR, ENERGY, Coefficients, Loads, Numerics, material, robot
from softnlp.cli import main
from softnlp.dynamics.drive import Series
from softnlp.dynamics.simulation import Dynamics
from softnlp.model.conventions import REPRODUCTION
from softnlp.studies.free_motion import Motion, stiffer
from softnlp.studies.identify_motion import MotionFit, identify_motion
from softnlp.studies.trace import Trace, trace_errors

Array = NDArray[np.float64]
D25, RUBBER = robot("D25L60"), material("Ecoflex 00-50")
HANGING = Loads(gravity="hanging")
COARSE = Numerics(engine="newton", intervals=1)
ROWS, TIMES = np.array([[0.0] * 3, [0.5, 0.0, 0.0]]) * BAR, np.zeros(2)
ASKED = Dynamics(0.12, 6e-3, damping=3e-3, lag=0.02)
SEEN = np.arange(0.0, 0.121, 6e-3)
TRUTH = {"damping_s": 0.005, "lag_s": 0.03, "modulus_factor": 1.15}
NOISE = 2e-4


def exact() -> Array:
    """Return the tips of a step of pressure with `TRUTH`."""
    drive = Series(TIMES, ROWS), Series(TIMES, np.zeros((2, 3)))
    motion = Motion(
        D25, RUBBER, Coefficients(), REPRODUCTION, HANGING, ASKED, *drive, COARSE, tuple(TRUTH), 6e-3, 1
    )  # fmt: skip
    return motion.tips(np.array([*TRUTH.values()]), Trace(SEEN, np.zeros((SEEN.size, 3))))


def found(tips: Array, free: Any = tuple(TRUTH), **more: Any) -> MotionFit:
    given: dict[str, Any] = {"times": TIMES, "loads": HANGING, "numerics": COARSE, **more}
    return identify_motion(D25, RUBBER, ROWS, ASKED, Trace(SEEN, tips), free, **given)


def errors_in_sigmas(seeds: range) -> Array:
    """Return (draws, 3) how many standard errors the values found are off."""
    tips, off = exact(), []
    for seed in seeds:
        noise = NOISE * np.random.default_rng(seed).normal(size=tips.shape)
        fit = found(tips + noise)
        assert fit.status == "solved"
        assert not fit.problems
        off.append((fit.values - [*TRUTH.values()]) / fit.uncertainty.standard_errors)
    return np.array(off)


def test_what_was_put_into_a_trace_comes_back() -> None:
    """Without noise to the accuracy of the difference quotients, with noise within two standard errors, mostly."""
    clean = found(exact())
    assert np.allclose(clean.values, [*TRUTH.values()], rtol=1e-4)
    assert clean.errors_after is not None
    assert clean.errors_before is not None
    assert clean.errors_after.rmse < 1e-3 * clean.errors_before.rmse
    off = errors_in_sigmas(range(1))
    assert np.all(np.abs(off) < 2)
    assert np.max(np.abs(off)) > 0.01  # there is noise in it


@pytest.mark.slow
def test_standard_errors_hold_what_they_say() -> None:
    off = errors_in_sigmas(range(10, 30))
    assert np.mean(np.abs(off) < 2) >= 0.88  # of 60 numbers, 0.95 expected
    assert 0.6 < np.std(off) < 1.4


def test_a_softer_silicone_is_slower_by_the_root() -> None:
    from softnlp import modes

    soft, plain = (modes(D25, one, [0.0] * 3, numerics=COARSE).found for one in (stiffer(RUBBER, 0.5), RUBBER))
    assert soft is not None
    assert plain is not None
    assert soft.modes[0].frequency == pytest.approx(plain.modes[0].frequency * np.sqrt(0.5), rel=1e-9)


def test_the_energy_section_has_a_coefficient_for_the_factor() -> None:
    drive = Series(TIMES, ROWS), Series(TIMES, np.zeros((2, 3)))
    made = Motion(
        D25, RUBBER, Coefficients(modulus_factor=1.2), ENERGY, HANGING, ASKED, *drive, COARSE, ("modulus_factor",), 6e-3
    )
    _, silicone, coefficients = made.with_values(np.array([1.4]))
    assert silicone is RUBBER
    assert coefficients.modulus_factor == 1.4


def test_the_first_harmonic_has_amplitude_and_phase() -> None:
    t = np.linspace(0, 1, 201)
    tip = np.column_stack([np.cos(2 * np.pi * 3.3 * t), np.full((201, 2), np.nan)])
    model = np.column_stack([0.8 * np.cos(2 * np.pi * 3.3 * t + 0.4), np.zeros((201, 2))])
    errors = trace_errors(Trace(t, 1e-2 * tip + [5e-2, 0, 0]), 1e-2 * model + [5.1e-2, 0, 0])
    first = errors.harmonic
    assert first is not None
    assert first.axis == 0
    assert first.frequency == pytest.approx(3.3, rel=1e-4)
    assert abs(first.simulated) / abs(first.measured) == pytest.approx(0.8, rel=1e-3)
    assert first.phase == pytest.approx(0.4, abs=1e-3)
    off = 1e-2 * (model - tip)[:, 0] + 1e-3
    assert errors.rmse == pytest.approx(float(np.sqrt(np.mean(off**2))), rel=1e-12)
    assert np.isnan(errors.axes[1:]).all()


# --- files ------------------------------------------------------------------------------------------------------------

HEAD = """
title = "swing"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[gravity]
direction = "hanging"
[solver]
intervals = 1
"""
PRESSURE = "[pressure]\nsequence_bar = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]\nt_s = [0.0, 0.0]\n"
FIT = 'study = "identify"\n' + HEAD + '[measurements]\nfile = "trace.csv"\nfree = ["damping_s", "lag_s"]\n'
MOVING = "[dynamic]\nstep_s = 0.006\n"


def written(folder: Path, text: str, rows: list[str] | None = None, header: str = "t_s,x_mm,y_mm,z_mm") -> Path:
    if rows is None:
        noise = NOISE * np.random.default_rng(5).normal(size=(SEEN.size, 3))
        rows = [
            f"{t:.4f}," + ",".join(f"{v:.4f}" for v in p) for t, p in zip(SEEN, 1e3 * (exact() + noise), strict=True)
        ]
    (folder / "trace.csv").write_text("\n".join([header, *rows]) + "\n")
    path = folder / "swing.toml"
    path.write_text(text)
    return path


def test_from_a_file_to_keys_to_paste(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Results, the figure again from them, and a scenario of the motion compared with the same trace."""
    path, out = written(tmp_path, FIT + PRESSURE + MOVING), tmp_path / "out"
    assert main(["identify", str(path), "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert "damping_s" in told
    assert "phase_deg" in told
    document = json.loads((out / "identified.json").read_text())
    values = {one["name"]: one["value"] for one in document["constants"]}
    pasted = tomllib.loads((out / "identified.toml").read_text())
    assert pasted["dynamic"] == values
    assert values["lag_s"] > 0.02
    assert document["errors"]["after"]["rmse_mm"] < document["errors"]["before"]["rmse_mm"]
    assert len(document["measurements"]) == SEEN.size
    assert main(["plot", str(out), "--out", str(tmp_path / "again")]) == 0
    assert (tmp_path / "again" / "figure.png").stat().st_size > 10_000
    moving = HEAD + PRESSURE + MOVING + "duration_s = 0.1\n"
    moving += "".join(f"{name} = {value}\n" for name, value in values.items())
    path.write_text('study = "dynamic"\n' + moving)
    compared = tmp_path / "compared"
    assert main(["compare", str(path), str(tmp_path / "trace.csv"), "--out", str(compared)]) == 0
    told = json.loads((compared / "comparison.json").read_text())
    assert told["rmse_mm"] == pytest.approx(document["errors"]["after"]["rmse_mm"], rel=1e-3)
    assert set(told["first_harmonic"]) >= {"frequency_Hz", "amplitude_ratio", "phase_deg"}
    assert main(["plot", str(compared), "--out", str(tmp_path / "again")]) == 0


FLAT = [f"{t:.4f},0,0,60" for t in SEEN]
LOGGED = "t_s,p1_bar,p2_bar,p3_bar,x_mm"


@pytest.mark.parametrize(
    ("text", "rows", "header", "said"),
    [
        (FIT + PRESSURE, FLAT, "", "[pressure]: not used but with [dynamic]"),
        (FIT.replace('"lag_s"', '"k_e"') + PRESSURE + MOVING, FLAT, "", "unknown number 'k_e'"),
        (FIT + MOVING, FLAT, "", "missing column 'p1_bar'; expected the pressures at the regulators"),
        (FIT + PRESSURE + MOVING, FLAT, "time,x_mm,y_mm,z_mm", "missing column 't_s'"),
        (FIT + PRESSURE + MOVING, [*FLAT[:4], FLAT[2]], "", "line 6: t_s: expected a time above"),
        (FIT + PRESSURE + MOVING, [*FLAT[:9], "nan,0,0,60"], "", "line 11: t_s: expected a finite number, got 'nan'"),
        (FIT + PRESSURE + MOVING, FLAT[:5], "", "expected at least 8 rows with a tip"),
        (FIT + PRESSURE + MOVING + "output_step_s = 0.1\n", FLAT, "", "[dynamic] output_step_s: not used by study"),
        (
            FIT + PRESSURE + MOVING + "[registration]\n",
            FLAT,
            "",
            "[registration]: this table is not used with [dynamic]",
        ),
        (FIT + "bounds = { lag_s = [0.2, 0.1] }\n" + PRESSURE + MOVING, FLAT, "", "bounds.lag_s: expected a lower"),
        (
            FIT + MOVING,
            [f"{k / 100},0.1,0,0,1" for k in range(40) if not 20 <= k < 23],
            LOGGED,
            "got a gap of 0.04 s",
        ),
    ],
)
def test_what_is_wrong_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, rows: list[str], header: str, said: str
) -> None:
    path = written(tmp_path, text, rows, header or "t_s,x_mm,y_mm,z_mm")
    assert main(["identify", str(path), "--json"]) == 2
    shown = capsys.readouterr()
    assert not shown.out
    assert shown.err.count("\n") == 1
    assert said in shown.err


@pytest.mark.slow
def test_a_trace_of_something_else_is_exit_3(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A tip that goes the other way: what is left of the movement cannot be."""
    rows = [f"{t:.4f},{20 * t / 0.12:.3f},0,60" for t in SEEN]
    path = written(tmp_path, FIT + PRESSURE + MOVING, rows)
    assert main(["identify", str(path), "--json"]) == 3
    shown = capsys.readouterr()
    document = json.loads(shown.out)
    failed = [check["name"] for check in document["checks"] if check["verdict"] == "failed"]
    assert "what is left of the movement" in failed
    assert "the model does not follow this trace" in shown.err
