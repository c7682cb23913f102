"""Scenarios with conventions = "energy": what they take, what has no meaning there, and what comes out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from softnlp import BAR, ENERGY, ContactSettings, InputError, blocked_force, load_scenario, material, robot
from softnlp.model.inputs import coefficients_table, conventions_of_table, conventions_table
from softnlp.results import to_json
from softnlp.scenario.run import run_scenario

HEAD = """
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
"""
ENERGETIC = '[corrections]\nconventions = "energy"\nmodulus_factor = 1.284\n'
PRESSURE = "[pressure]\nsequence_bar = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0]]\n"
NOT_USED = "not used with conventions energy"


def written(folder: Path, study: str, *tables: str) -> Path:
    path = folder / "scenario.toml"
    path.write_text("\n".join((f'study = "{study}"', HEAD, *tables)))
    return path


def refused(folder: Path, study: str, *tables: str) -> str:
    with pytest.raises(InputError) as found:
        load_scenario(written(folder, study, *tables))
    return "\n".join(str(one) for one in (found.value.every or [found.value]))


@pytest.mark.parametrize(
    ("study", "tables", "said"),
    [
        ("forward", "[stiffening]\nelongation = 0.4", f"[stiffening] elongation: {NOT_USED}"),
        ("forward", '[stiffening]\nset = "calibrated"', f"[stiffening] set: {NOT_USED}"),
        ("blocked-force", "[contact]\nchamber_reaction = 1.2", f"[contact] chamber_reaction: {NOT_USED}"),
        ("blocked-force", "[contact]\nweight_force_per_N = 1.0", f"[contact] weight_force_per_N: {NOT_USED}"),
        ("blocked-force", '[contact]\nmode = "constrained"', NOT_USED),
        ("blocked-force", '[contact]\nclosure = "compliant"', NOT_USED),
        ("blocked-force", '[contact]\nclosure = "free"', NOT_USED),
        (
            "workspace",
            "[workspace]\nlevels = 2\nto_bar = 0.1\nvary.stiffening.bending = { values = [1.0, 2.0] }",
            NOT_USED,
        ),
        (
            "design",
            "[choices.robot]\nlength_mm = { from = 50.0, to = 60.0 }\n[actuation]\nsets = [1]\npressure_bar = 1.0\n"
            '[objective]\nmaximise = "bending_angle_deg"',
            "[choices] robot.length_mm: expected a list: ranges are not searched with conventions energy so far",
        ),
        (
            "workspace",
            "[workspace]\nlevels = 2\nto_bar = 0.1\nvary.robot.chamber_diameter_mm = { values = [4.0, 4.5] }",
            "rings are solved for one section",
        ),
    ],
)
def test_keys_without_a_meaning_are_refused_by_name(tmp_path, study, tables, said):
    pressure = PRESSURE if study in ("forward", "blocked-force") else ""
    assert said in refused(tmp_path, study, ENERGETIC, tables, pressure)


@pytest.mark.parametrize("key", ["area = 1.0", "inertia = 1.0", "bore_fraction = 0.1"])
def test_corrections_of_the_paper_s_section_are_refused(tmp_path, key):
    said = refused(tmp_path, "forward", ENERGETIC + key, PRESSURE)
    assert f"[corrections] {key.split()[0]}: {NOT_USED}" in said


def test_what_is_of_the_energy_section_alone_is_refused_elsewhere(tmp_path):
    only = 'expected only with [corrections] conventions = "energy"'
    assert f"[corrections] modulus_factor: {only}" in refused(
        tmp_path, "forward", "[corrections]\nmodulus_factor = 1.2", PRESSURE
    )
    assert f"[contact] closure: {only}" in refused(tmp_path, "blocked-force", '[contact]\nclosure = "none"', PRESSURE)


@pytest.mark.parametrize(
    ("own", "dimension", "words"),
    [
        ('lines = "bonded"', "", "segment] 1.lines: 'bonded' is not with conventions energy so far"),
        ("", "outer_diameter_mm = [25.0, 24.0]", "segment] 1.robot.outer_diameter_mm: expected one number"),
    ],
)
def test_what_segments_do_not_have_yet_is_refused(tmp_path, own, dimension, words):
    path = tmp_path / "two.toml"
    one = f'[[segment]]\n{own}\n[segment.robot]\nname = "D25L60"\n{dimension}\n'
    one += '[segment.material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
    path.write_text(f'study = "forward"\n{ENERGETIC}\n{one}{one}[pressure]\nsequence_bar = [[0.0, 0, 0, 0, 0, 0]]\n')
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    assert words in str(caught.value)


def test_a_closure_of_the_paper_s_section_is_refused_in_python():
    made, silicone = robot("D25L60"), material("Ecoflex 00-50")
    with pytest.raises(InputError, match="not used with conventions energy; expected 'none'"):
        blocked_force(made, silicone, [0.1 * BAR, 0.0, 0.0], conventions=ENERGY)
    with pytest.raises(InputError, match="expected 'none' only with conventions energy"):
        blocked_force(made, silicone, [0.1 * BAR, 0.0, 0.0], ContactSettings(closure="none"))


def test_conventions_are_told_and_read():
    assert conventions_table(ENERGY) == {"name": "energy", "rings": True}
    assert conventions_of_table(conventions_table(ENERGY)).energy
    assert json.dumps(conventions_table(ENERGY))


@pytest.mark.thorough
def test_a_wall_needs_no_closure_and_the_document_says_so(tmp_path):
    scenario = load_scenario(written(tmp_path, "blocked-force", ENERGETIC, PRESSURE))
    assert scenario.contact is not None
    assert scenario.contact.closure == "none"
    document = to_json(run_scenario(scenario))
    assert document["conventions"] == "energy"
    told = coefficients_table(scenario.coefficients, energy=True)
    assert document["coefficients"] == told == {"modulus_factor": 1.284}
    step = document["steps"][-1]
    assert (step["closure"], step["chamber_reaction_N"]) == ("none", None)
    assert step["blocked_force_N"] == pytest.approx(1.18, rel=0.1)  # measured
    free = to_json(run_scenario(load_scenario(written(tmp_path, "forward", ENERGETIC, PRESSURE))))["steps"][-1]
    assert free["bending_angle_deg"] == pytest.approx(107.67, abs=6)  # measured
    assert np.allclose(step["free_tip_position_mm"], free["tip_position_mm"], atol=1e-4)


def test_dimensions_that_rings_would_have_to_follow_have_no_deviation(tmp_path):
    scatter = "[uncertainty]\nchamber_diameter_mm = 0.05"
    said = refused(tmp_path, "forward", ENERGETIC, scatter, PRESSURE)
    assert "[uncertainty] chamber_diameter_mm: unknown name" in said
    taken = load_scenario(written(tmp_path, "forward", ENERGETIC, "[uncertainty]\nmodulus_factor = 0.05", PRESSURE))
    assert taken.uncertainty is not None
    assert [source.moves for source in taken.uncertainty.sources] == [{"corrections.modulus_factor": 0.05}]


def test_a_factor_of_the_stress_that_no_measurement_depends_on_is_refused(tmp_path: Path) -> None:
    """Without pressure and loads no stress moves the robot; what rounding leaves of that is no slope."""
    (tmp_path / "measured.csv").write_text("p1_bar,p2_bar,p3_bar,bending_angle_deg\n0,0,0,0.0\n0,0,0,0.5\n")
    path = written(tmp_path, "identify", ENERGETIC, '[measurements]\nfile = "measured.csv"\nfree = ["c_m"]\n')
    with pytest.raises(InputError, match="no measurement depends on 'c_m'"):
        run_scenario(load_scenario(path))
