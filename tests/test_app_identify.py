"""The identification tab: a dropped file, the constants it gives, and the scenario that has them then."""

from __future__ import annotations

import itertools
import tomllib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import done, enter, field, opened, ran
from nicegui import ui
from nicegui.testing import User

from softnlp import Coefficients, forward, material, robot
from softnlp.app.parts import Chart
from softnlp.app.session import Stage
from softnlp.app.tabs.identify import LETTERS, bounds_of, first_free, identify_tab, with_bound, with_free
from softnlp.app.taken import LARGEST_FILE
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.scenario.read import scenario_from_text
from softnlp.studies.identified import COEFFICIENTS

FILES = Path(__file__).parents[1] / "scenarios" / "files"
TRUE = Coefficients(elongation=0.5, bending=1.0)


def measured() -> str:
    """Return angles and elongations of a robot with known coefficients, as a file."""
    bars = [[0.4, 0, 0], [0.8, 0, 0], [1.2, 0, 0], [0.8, 0.8, 0], [1.0, 1.0, 1.0]]
    run = forward(robot("D25L60"), material("Ecoflex 00-50"), np.array(bars) * 1e5, coefficients=TRUE)
    rows = ["p1_bar,p2_bar,p3_bar,bending_angle_deg,elongation_mm"]
    for row, step in zip(bars, run.steps, strict=True):
        assert step.pose is not None
        longer = step.pose.backbone_length / MILLIMETRE - 60
        rows.append(",".join(map(repr, [*row, float(step.pose.bending_angle / DEGREE), float(longer)])))
    return "\n".join(rows)


async def drop(user: User, marker: str, name: str, content: bytes) -> None:
    box = field(user, marker)
    with user:
        await box.handle_uploads([ui.upload.SmallFileUpload(name, "text/csv", content)])
    import asyncio

    await asyncio.sleep(0.1)


def test_every_coefficient_may_be_freed_and_bounds_follow() -> None:
    assert set(LETTERS) == set(COEFFICIENTS)
    silicone = material("Ecoflex 00-50")
    for free in itertools.permutations(("k_e", "C10", "k_c"), 2):
        table = with_bound(with_free({"file": "a.csv", "free": ["k_b"]}, free), free[0], [0.1, 0.2])
        found = bounds_of(table, silicone)
        assert list(found) == list(free)
        assert found[free[0]][:2] == (0.1, 0.2)
        assert found.get("C10", (None, None, "MPa"))[2] == "MPa"
        assert "bounds" not in with_free(table, [free[1]])
    assert bounds_of({"free": ["C10"]}, silicone) == {"C10": (None, None, "MPa")}  # a silicone's are open


def test_what_a_file_measures_says_what_is_free_at_first() -> None:
    assert first_free(["p1_bar", "blocked_force_N"]) == ["k_c"]
    assert first_free(["p1_bar", "x_mm", "blocked_force_N"]) == ["k_e", "k_b", "k_c"]
    assert first_free(["p1_bar"]) == ["k_e", "k_b"]


async def _robots() -> None:
    async with opened(identify_tab, "identify") as (user, stage):
        session = stage.session
        await ran(user, "identify", "Drop a CSV")
        # what is no table of measurements is said and not taken
        for content, words in (
            (b"", "expected a header"),
            (b"\xff\xfe\x00", "UTF-8"),
            (b"p1_bar,p2_bar,p3_bar,bending_angle_deg\n1,0,0,much\n", "expected a number"),
            (b"p1_bar,p2_bar,p3_bar,bending_angle_deg\n-1,0,0,5\n", "readings down to -0.05 bar"),
            (b"x" * (LARGEST_FILE + 1), "at most 5 MB"),
        ):
            await drop(user, "measurements.drop", "wrong.csv", content)
            assert any(words in message for message in user.notify.messages), (words, user.notify.messages)
            assert session.document.table("measurements") == {}
        await drop(user, "measurements.drop", "../angles.csv", measured().encode())
        assert session.document.table("measurements") == {"file": "angles.csv", "free": ["k_e", "k_b"]}
        assert session.problem is None
        enter(user, "identify.kind", "tensile")  # a look
        assert session.document.table("measurements") == {"file": "angles.csv", "free": ["k_e", "k_b"]}
        enter(user, "identify.kind", "measurements")
        # bounds that exclude the start are moved to; the constants that made the file come back
        enter(user, "measurements.bounds.k_b.1", 1.2)
        assert session.document.get("measurements", "bounds") == {"k_b": [0.0, 1.2]}
        await ran(user, "identify", "Found after")
        found = {row["c0"]: row for row in field(user, "identify.constants").rows}
        assert float(found["k_e"]["c2"]) == pytest.approx(TRUE.elongation, rel=1e-3)
        assert float(found["k_b"]["c2"]) == pytest.approx(TRUE.bending, rel=1e-3)
        before, after = (float(field(user, "identify.misfits").rows[0][c]) for c in ("c2", "c3"))
        assert after < 1e-3 * before
        assert set(field(user, "identify.observable").options) == {"bending_angle", "elongation"}
        user.find(marker="identify.use").click()
        session.choose("forward")
        written = tomllib.loads(session.text())
        assert written["stiffening"]["bending"] == pytest.approx(TRUE.bending, rel=1e-4)
        assert scenario_from_text(session.text(), "a.toml").coefficients.elongation == pytest.approx(0.5, rel=1e-4)
        # nothing that cannot be found is made up
        session.choose("identify")
        enter(user, "measurements.free", ["k_c"])
        await ran(user, "identify", "no measurement depends on 'k_c'")


def test_constants_of_a_dropped_file() -> None:
    done(_robots())


async def _tensile() -> None:
    async with opened(identify_tab, "identify") as (user, stage):
        session = stage.session
        session.change("stiffening", "bending", 1.1)  # which a tensile test does not use
        enter(user, "identify.kind", "tensile")
        await ran(user, "tensile", "Drop a CSV")
        await drop(user, "tensile.drop", "tensile.csv", (FILES / "tensile.csv").read_bytes())
        assert session.problem is None
        await ran(user, "tensile", "best: ")
        rows = {row["c0"]: float(row["c1"]) for row in field(user, "tensile.laws").rows}
        assert rows["mooney-rivlin"] > 0.999 > rows["linear"]
        enter(user, "tensile.law", "yeoh")
        user.find(marker="tensile.use").click()
        session.choose("forward")
        scenario = scenario_from_text(session.text(), "a.toml")
        assert scenario.material.law.name == "yeoh"
        assert scenario.material.constants["C10"] == pytest.approx(
            0.0157e6, rel=0.05
        )  # of the silicone behind the test
        assert scenario.coefficients.bending == 1.1
        # a file of force and displacement asks for the specimen, and is fitted once that is known
        session.choose("identify")
        await drop(user, "tensile.drop", "tensile_force.csv", (FILES / "tensile_force.csv").read_bytes())
        assert "gauge_length_mm" in field(user, "tensile.problem").text
        for key, size in (("gauge_length_mm", 33), ("width_mm", 6), ("thickness_mm", 3)):
            enter(user, f"tensile.{key}", size)
        assert field(user, "tensile.problem").text == ""
        await ran(user, "tensile", "best: ")
        # data of another quantity leave no law to use, and the page says what they look like
        lines = [f"{x},{31 * (x - x**-2)}" for x in np.linspace(1, 2, 21)]
        await drop(user, "tensile.drop", "kPa.csv", "\n".join(["stretch,stress_MPa", *lines]).encode())
        session.change("tensile", "laws", ["neo-hookean", "yeoh"])
        await ran(user, "tensile", "no law is a material to use")
        assert "looks like stress in kPa (name its column stress_kPa)" in field(user, "tensile.told").text
        assert {row["c5"].partition(":")[0] for row in field(user, "tensile.laws").rows} == {"implausible"}
        assert not field(user, "tensile.law").options


def test_a_tensile_test_gives_a_silicone() -> None:
    done(_tensile())


async def _one_kind_at_a_time() -> None:
    async with opened(identify_tab, "identify") as (user, stage):
        session = stage.session
        await drop(user, "measurements.drop", "angles.csv", measured().encode())
        enter(user, "identify.kind", "tensile")
        await drop(user, "tensile.drop", "tensile.csv", (FILES / "tensile.csv").read_bytes())
        for kind, other in (("tensile", "measurements"), ("measurements", "tensile")) * 2:
            enter(user, "identify.kind", kind)
            assert (bool(session.table(kind)), bool(session.table(other))) == (True, False)
            assert session.problem is None


def test_data_of_the_kind_that_is_not_chosen_are_put_aside() -> None:
    done(_one_kind_at_a_time())


async def _named_traces() -> None:
    trace = {"x": [0, 1], "y": [0, 1], "name": "<b>law</b> & $x_%{y}"}

    def tab(stage: Stage) -> None:
        Chart("a.chart", "x", "y").show([trace, {"x": [0], "y": [1]}])

    async with opened(tab, "identify") as (user, _):
        shown = field(user, "a.chart").figure["data"]
    assert shown[0]["name"] == "&lt;b>law&lt;/b> &amp; $x_％{y}"
    assert shown[1]["name"] == ""


def test_the_names_of_a_chart_are_no_markup() -> None:
    done(_named_traces())
