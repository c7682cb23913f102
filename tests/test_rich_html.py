"""What notebooks show of robots, silicones and runs: their numbers, well-formed, with names that do no harm."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softnlp import AS_PRINTED, BAR, Body, Segment, case, forward, material, problem, robot, segmented_robot, solve
from softnlp.app.rich_html import html_of
from softnlp.model.robot import DIMENSIONS, ROBOTS


def cells(html: str) -> list[list[str]]:
    """Return the rows of all tables of a piece of HTML, which has to be well-formed."""
    tree = ET.fromstring(f"<div>{html}</div>")
    return [["".join(cell.itertext()) for cell in row] for row in tree.iter("tr")]


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_a_robot_shows_every_dimension_in_the_unit_of_files_and_its_section(name: str) -> None:
    html = ROBOTS[name]._repr_html_()
    rows = {row[0]: row[2:] for row in cells(html)}
    for dimension in DIMENSIONS:
        value, unit = rows[dimension.field.replace("_", " ")]
        scale = 1 if dimension.scale is None else dimension.scale
        assert float(value) == pytest.approx(getattr(ROBOTS[name], dimension.field) / scale, rel=1e-5)
        assert unit == ("" if dimension.scale is None else dimension.file_key.rpartition("_")[2])
    assert html.count('class="bore"') == ROBOTS[name].chambers


def test_a_symbol_is_shown_by_its_name_and_nothing_is_drawn() -> None:
    html = robot("D25L60", length=ca.MX.sym("free_length"))._repr_html_()
    assert ["length", "L_0", "free_length", "SI"] in cells(html)
    assert "<svg" not in html


def test_each_segment_is_shown() -> None:
    silicone = material("Ecoflex 00-50")
    arm = segmented_robot([Segment(robot("D25L60"), silicone), Segment(robot("D20L40"), silicone)])
    html = arm._repr_html_()
    assert html.count("<svg") == 2
    assert [row[2] for row in cells(html) if row[0] == "length"] == ["60", "40"]


@pytest.mark.parametrize("law", ["linear", "neo-hookean", "mooney-rivlin", "yeoh", "ogden"])
def test_a_material_shows_its_constants_and_the_curve_of_its_law(law: str) -> None:
    silicone = material("Ecoflex 00-50", law)
    html = silicone._repr_html_()
    rows = {row[0]: row[1] for row in cells(html)}
    for constant in silicone.law.constants:
        assert float(rows[constant.name]) == pytest.approx(silicone.constants[constant.name] / constant.scale, rel=1e-5)
    assert float(rows["shear modulus at stretch 1"]) == pytest.approx(silicone.shear_modulus(1.0) / 1e3, rel=1e-5)
    line = re.search(r'points="([^"]+)"', html)
    assert line is not None
    points = np.array([point.split(",") for point in line[1].split()], dtype=float)
    stress = silicone.engineering_stress(np.linspace(1, 2, len(points)))
    drawn = (points[0, 1] - points[:, 1]) / (points[0, 1] - points[-1, 1])
    assert drawn == pytest.approx(stress / stress[-1], abs=2e-3)


def test_a_run_shows_the_table_of_the_command() -> None:
    # as printed, the stiffening helps the pressure, and three sets at 1.5 bar have no solution
    P = BAR * np.array([[0.0, 0, 0], [0.5, 0, 0], [1.5, 1.5, 1.5]])
    run = forward(robot("D25L60"), material("Ecoflex 00-50", "yeoh"), P, conventions=AS_PRINTED, title="A & B")
    html = run._repr_html_()
    header, *rows = cells(html)
    assert header[:5] == ["step", "p1 [bar]", "p2 [bar]", "p3 [bar]", "status"]
    angle = header.index("bending [deg]")
    assert float(rows[1][angle]) == pytest.approx(np.degrees(run.steps[1].pose.bending_angle), abs=6e-3)
    assert rows[2][4] == str(run.steps[2].status) != "solved"
    assert run.steps[2].message in "".join(ET.fromstring(html).itertext())
    assert "A &amp; B" in html


def test_a_long_run_is_cut_and_says_so() -> None:
    run = forward(robot("D25L60"), material("Ecoflex 00-50"), [[0.1 * BAR, 0, 0]])
    html = replace(run, steps=run.steps * 50)._repr_html_()
    assert len(cells(html)) == 41
    assert "and 10 steps more" in html


@given(st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), max_size=30))
@settings(max_examples=8, deadline=None)
def test_no_name_is_read_as_html(name: str) -> None:
    name = f"<script>{name}</script>"
    for shown in (replace(robot("D25L60"), name=name), replace(material("Ecoflex 00-50"), name=name)):
        html = shown._repr_html_()
        tree = ET.fromstring(html)
        assert "script" not in {part.tag for part in tree.iter()}
        assert name in "".join(tree.itertext())


def test_nothing_is_known_of_other_things() -> None:
    body = Body([Segment(robot("D25L60"), material("Ecoflex 00-50"))])
    answer = solve(problem([case("pose", body)]), {"pressure": [0.1 * BAR, 0, 0]}, engine="newton")
    with pytest.raises(TypeError, match="no HTML is known of a Answer"):
        html_of(answer)
