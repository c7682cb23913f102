"""All mistakes of a scenario: one line that counts the others, each on its own with --all-errors; and near keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.cli import main
from softnlp.scenario.near_keys import meant
from softnlp.scenario.read import scenario_from_text

MANY = """study = "forward"
[robot]
name = "D25L60"
outer_diameter_mm = 18
[material]
name = "Ecoflex 00-5"
model = "mooney-rivlin"
[gravity]
direction = "down"
[solver]
engine = "newto"
accuracy = 3
[pressure]
sequence_bar = [[0.1, 0.2]]
"""
EXPECTED = [  # what the schema refuses, then the physical rules of tables that fit it
    "[gravity] direction: expected one of",
    "[solver] engine: expected 'auto', 'ipopt' or 'newton', got 'newto'",
    "[solver] accuracy: expected at least 1e-12",
    "[robot]: wall_thickness: ",
    "[robot]: chambers_inside_wall: ",
    "[material] name: unknown silicone 'Ecoflex 00-5'",
    "[pressure] sequence_bar: ",
]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "many.toml"
    path.write_text(MANY)
    return path


@pytest.mark.parametrize("command", ["run", "check", "sweep", "inverse", "identify", "design", "sensitivity", "mesh"])
def test_every_command_lists_the_mistakes(command: str, file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(file)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"softnlp: {file}: {EXPECTED[0]}")
    assert line.endswith(f" (and {len(EXPECTED) - 1} more: --all-errors)")
    assert main([command, str(file), "--all-errors"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(EXPECTED)
    for got, expected in zip(lines, EXPECTED, strict=True):
        assert got.startswith(f"softnlp: {file}: {expected}")
        assert "more" not in got


def test_compare_lists_the_mistakes(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(file), "measured.csv", "--all-errors"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == len(EXPECTED)


def test_python_has_them_all() -> None:
    with pytest.raises(InputError, match=r"^x: .* \(and 6 more: --all-errors\)$") as caught:
        scenario_from_text(MANY, "x")
    assert all(str(one).startswith(f"x: {words}") for one, words in zip(caught.value.every, EXPECTED, strict=True))


def test_one_mistake_counts_nothing() -> None:
    with pytest.raises(InputError, match=r"got 3 of L_0$") as caught:
        scenario_from_text(MANY.replace("18", "25").replace("00-5", "00-50").replace("down", "off")
                           .replace("newto", "newton").replace("0.2]", "0.2, 0]"), "x")  # fmt: skip
    assert not caught.value.every


def test_a_table_with_a_mistake_makes_no_others() -> None:
    """A key that is not read must not be missed elsewhere."""
    with pytest.raises(InputError) as caught:
        scenario_from_text('study = "inverse"\n[robot]\nnane = "D25L60"\n[material]\nname = "x"\n', "x")
    assert [(one.table, one.key) for one in caught.value.every] == [
        ("robot", "nane"),
        ("material", "model"),
        ("target", None),
    ]


def test_a_scenario_is_checked_without_a_solve(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = Path(__file__).parents[1] / "scenarios" / "D15L60_hanging.toml"
    before = list(tmp_path.iterdir())
    assert main(["check", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("study forward, ")
    assert any("hanging" in line for line in lines)
    assert lines[-1] == f"{path} can be run"
    assert list(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("key", "value", "known", "to", "said"),
    [
        ("to_kPa", 80, ["sets", "to_bar", "from_bar"], "to_bar", "80 kPa = 0.8 bar: write to_bar = 0.8"),
        ("to_mbar", 800.0, ["to_bar", "from_bar"], "to_bar", "800.0 mbar = 0.8 bar: write to_bar = 0.8"),
        ("to_psi", 10, ["to_bar"], "to_bar", "10 psi = 0.6894757293 bar: write to_bar = 0.6894757293"),
        ("length_cm", 6, ["length_mm"], "length_mm", "6 cm = 60 mm: write length_mm = 60"),
        ("length_m", 0.06, ["length_mm"], "length_mm", "0.06 m = 60 mm: write length_mm = 60"),
        (
            "length",
            60,
            ["length_mm"],
            "length_mm",
            "did you mean 'length_mm'? it ends in its unit: write length_mm = 60, in mm",
        ),
        ("chamber_wall", "x", ["chamber_wall_mm"], "chamber_wall_mm", "write chamber_wall_mm, in mm"),
        ("force", [0, 0, 1], ["force_N", "moment_Nmm"], "force_N", "write force_N, in N"),
        ("moment_Nm", [0, 0, 1], ["force_N", "moment_Nmm"], "moment_Nmm", "it is in Nmm: 1 Nm = 1000 Nmm"),
        (
            "pressure_kPa",
            [0, 150],
            ["pressure_bar"],
            "pressure_bar",
            "did you mean 'pressure_bar'? it is in bar: 1 kPa = 0.01 bar",
        ),
        ("sequence_kPa", [[0]], ["sequence_bar", "ramp"], "sequence_bar", "did you mean 'sequence_bar'? it is in bar"),
        (
            "pressure_kPa",
            [[0]],
            ["sequence_bar", "ramp", "file"],
            "sequence_bar",
            "did you mean 'sequence_bar'? it is in bar",
        ),
        ("chamber_angle_rad", 1, ["chamber_angle_deg"], "chamber_angle_deg", "1 rad = 57.29577951 deg"),
        ("LENGTH_MM", 60, ["length_mm"], "length_mm", "unknown key; did you mean 'length_mm'?"),
        ("lenght_mm", 60, ["length_mm", "chamber_wall_mm"], "length_mm", "unknown key; did you mean 'length_mm'?"),
        ("width_cm", 60, ["length_mm", "chamber_wall_mm"], None, "known: length_mm, chamber_wall_mm"),
        ("to_kPa", True, ["to_bar"], "to_bar", "it is in bar: 1 kPa = 0.01 bar"),
    ],
)
def test_an_unknown_key_gets_the_right_word(key: str, value: Any, known: list[str], to: str | None, said: str) -> None:
    found, words = meant(key, value, known)
    assert found == to
    assert words.startswith("unknown key; ")
    assert said in words


def test_the_number_that_is_proposed_is_the_one_that_was_meant() -> None:
    text = MANY[MANY.index("[robot]") : MANY.index("outer")] + '[material]\nname = "Ecoflex 00-50"\nmodel = "yeoh"\n'
    ramp = 'study = "forward"\n' + text + "[pressure]\nramp = { sets = [1], %s, steps = 2 }\n"
    with pytest.raises(InputError) as caught:
        scenario_from_text(ramp % "to_kPa = 80", "x")
    assert not caught.value.every
    proposed = caught.value.message.rpartition("write ")[2]
    assert scenario_from_text(ramp % proposed, "x").pressures[-1, 0] == pytest.approx(80e3, rel=1e-12)
    assert scenario_from_text(ramp % "to_bar = 0.8", "x").pressures[-1, 0] == pytest.approx(0.8 * BAR)
