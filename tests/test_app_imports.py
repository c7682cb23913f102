"""Files of a laboratory on the page: how they are read, what is asked, and what the identification gets."""

from __future__ import annotations

import asyncio
import tomllib
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import done, enter, field, opened, ran, until
from laboratory_files import FOLDER as LABORATORY
from laboratory_files import MODULUS, machine_text
from nicegui import ui
from nicegui.testing import User

from softnlp.app.imports import (
    SETTINGS,
    Asked,
    check_rows,
    placed,
    read,
    registration_for,
    setting_rows,
    settings_of,
    told,
    traces,
)
from softnlp.app.tabs.identify import identify_tab
from softnlp.app.taken import LARGEST_FILE
from softnlp.base.errors import InputError
from softnlp.laboratory.importing import KINDS
from softnlp.laboratory.recipe import read_recipe, recipe_text


def asked(folder: Path, *contents: tuple[str, str], kind: str | None = None, **settings: Any) -> Asked:
    files = placed(folder / "files", [(name, text.encode()) for name, text in contents])
    return Asked(folder / "files", files, kind, settings)


def modulus(stretch: Any, stress: Any) -> float:
    reduced = stretch - stretch**-2
    return float(reduced @ stress / (reduced @ reduced))


def test_a_test_is_read_with_its_reasons(tmp_path: Path) -> None:
    wanted = asked(tmp_path, ("../utm.csv", machine_text(4.0)))
    assert wanted.files == ("utm.csv",)
    reading = read(wanted)
    assert reading.imported is not None
    assert (reading.kind, reading.header, reading.problem) == ("tensile", ["stretch", "stress [MPa]"], "")
    assert modulus(*reading.imported.columns.values()) == pytest.approx(MODULUS, rel=1e-3)
    reasons = {key: (value, why) for key, value, why in setting_rows(reading.imported)[1]}
    assert reasons["stretch"][0] == "[1.0, 2.0]"
    assert "the test goes to 4" in reasons["stretch"][1]
    assert "preamble" in reasons["width_mm"][1]
    assert reasons["separator"] == ("comma", "as the file has it")
    given = read(Asked(wanted.folder, wanted.files, None, {"width_mm": 8})).imported
    assert given is not None
    assert ["width_mm", "8", "given"] in setting_rows(given)[1]
    assert "points outside stretch" in told(reading.imported)
    (whole, used), x_label, y_label = traces(reading.imported)
    assert (len(whole["x"]), len(used["x"])) == (31, reading.imported.rows)
    assert (x_label, y_label) == ("stretch [-]", "engineering stress [MPa]")
    assert {row[-1] for row in check_rows(reading.imported)[1]} <= {"passed", "warned"}
    assert reading.csv.splitlines()[0] == "stretch,stress_MPa"
    recipe = tmp_path / "files" / "again.import.toml"
    recipe.write_text(recipe_text(reading.imported, wanted.folder, wanted.folder))
    assert read_recipe(recipe).run().csv() == reading.csv


def test_a_warning_is_told_and_stands_first_among_the_checks() -> None:
    every = {"gauge_length_mm": 25, "area_mm2": 8, "cycle": "all"}
    found = read(Asked(LABORATORY, ("utm_cyclic.csv",), None, every)).imported
    assert found is not None
    header, rows = check_rows(found)
    assert dict(zip(header, rows[0], strict=True)) == {
        "check": "load cycles taken as one test",
        "value": "4",
        "verdict": "warned",
    }
    assert told(found).startswith("Warning: the load cycles taken as one test is 4")


def test_what_is_lacking_is_asked_beside_the_table_as_it_stands(tmp_path: Path) -> None:
    text = "Time,Extension,Load\n(s),(mm),(N)\n" + "\n".join(f"{k},{k},{0.1 * k}" for k in range(12))
    reading = read(asked(tmp_path, ("a.csv", text)))
    assert reading.imported is None
    assert reading.kind == "tensile"
    assert reading.problem.startswith("a.csv: ")
    assert "gauge_length_mm" in reading.problem
    assert reading.header == ["Time [s]", "Extension [mm]", "Load [N]"]
    assert reading.rows[1] == [1.0, 1.0, pytest.approx(0.1)]
    unread = read(asked(tmp_path / "b", ("b.csv", "0 1\n1 2\n2 3\n3 4")))
    assert (unread.kind, unread.imported, unread.rows) == ("", None, [])
    assert "no header names the columns" in unread.problem
    wrong = read(asked(tmp_path / "c", ("utm.csv", machine_text()), area_mm2=-1))
    assert "area_mm2" in wrong.problem


def test_settings_are_read_as_the_command_reads_them() -> None:
    further = "--set columns='[\"t_ms\", \"p1_bar\"]'\n\n unit.stress=kPa\n--set frame='base sensor'"
    found = settings_of({"stretch": " [1, 1.5]", "cycle": "first loading", "tare": ""}, {"stress": "true"}, further)
    assert found == {
        "columns": ["t_ms", "p1_bar"],
        "unit.stress": "kPa",
        "frame": "base sensor",
        "stretch": [1, 1.5],
        "cycle": "first loading",
        "stress": "true",
    }
    with pytest.raises(InputError, match="expected key=value"):
        settings_of({}, {}, "much")


def test_only_files_of_a_person_are_taken(tmp_path: Path) -> None:
    for contents, words in (
        ([], "expected 1 to 8 files"),
        ([(f"{k}.csv", b"") for k in range(9)], "got 9"),
        ([("a.csv", b"x" * (LARGEST_FILE + 1))], "at most 5 MB"),
        ([("a.import.toml", b'kind = "tips"\nfiles = ["/etc/passwd"]')], "names further files"),
        ([("..", b"")], "expected a file with a name"),
    ):
        with pytest.raises(InputError, match=words):
            placed(tmp_path / "files", contents)
        assert not (tmp_path / "files").exists()


def test_every_kind_has_settings_that_the_import_knows_and_a_curve(tmp_path: Path) -> None:
    assert set(SETTINGS) == set(KINDS)
    base = {"frame": "base sensor", "base_sensor_mm": [-30, 0, 0]}
    for name, kind, settings, count in (
        ("tracker_em_two_sensors.csv", "tips", base, 3),
        ("pressure_log_mbar_absolute.csv", "pressure", {}, 3),
        ("force_torque_counts.csv", "force", {}, 3),
    ):
        reading = read(Asked(LABORATORY, (name,), None, settings))
        assert reading.imported is not None, reading.problem
        assert reading.kind == kind
        assert len(traces(reading.imported)[0]) == count


def test_a_registration_is_not_done_twice() -> None:
    base = {"frame": "base sensor", "base_sensor_mm": [-30, 0, 0]}
    tips = read(Asked(LABORATORY, ("tracker_em_two_sensors.csv",), None, base)).imported
    fitted = read(Asked(LABORATORY, ("tracker_em_two_sensors.csv",), None, {"frame": "fit", "tip": "b"})).imported
    assert tips is not None
    assert fitted is not None
    before = {**base, "clock_deg": 3.0}
    assert registration_for(tips, before) == {"clock_deg": 3.0}
    assert registration_for(fitted, before) == {"clock_deg": 3.0, "frame": "fit"}


async def drop(user: User, *contents: tuple[str, str]) -> None:
    box = field(user, "import.drop")
    with user:
        await box.handle_uploads([ui.upload.SmallFileUpload(n, "text/plain", text.encode()) for n, text in contents])
    await asyncio.sleep(0.1)


async def _tensile() -> None:
    async with opened(identify_tab, "identify") as (user, stage):
        session = stage.session
        session.change("tensile", "stress", "true")  # of another file; the import makes engineering stress
        await drop(user, ("utm.csv", machine_text()))
        await until(user, "import.message", "31 rows")
        assert [column["label"] for column in field(user, "import.table").columns] == ["stretch", "stress [MPa]"]
        assert "preamble" in next(row["c2"] for row in field(user, "import.settings").rows if row["c0"] == "width_mm")
        enter(user, "import.gauge_length_mm", "much")
        await until(user, "import.message", "expected a number")
        await user.should_not_see(marker="import.use")
        enter(user, "import.gauge_length_mm", "25")
        await until(user, "import.message", "31 rows")
        enter(user, "import.width_mm", "8")  # half the stress
        for _ in range(200):
            await asyncio.sleep(0.05)
            given = {row["c0"]: row["c1"] for row in field(user, "import.settings").rows}
            if given["width_mm"] == "8" and field(user, "import.use").enabled:
                break
        user.find(marker="import.use").click()
        await asyncio.sleep(0.1)
        assert session.table("tensile") == {"file": "utm_imported.csv"}
        assert session.problem is None
        assert field(user, "identify.kind").value == "tensile"
        await ran(user, "tensile", "best: ")
        session.change("tensile", "laws", ["neo-hookean"])
        await ran(user, "tensile", "best: neo-hookean")
        user.find(marker="tensile.use").click()
        session.choose("forward")
        constants = tomllib.loads(session.text())["material"]["constants"]
        assert constants["mu0_MPa"] == pytest.approx(MODULUS / 2, rel=0.01)
        # files of another kind take their own fields, and a kind that the tab cannot use is taken away only
        session.choose("identify")
        log = "pressure_log_mbar_absolute.csv"
        await drop(user, (log, (LABORATORY / log).read_text()))
        await until(user, "import.message", "Pressures")
        assert field(user, "import.zero").value in (None, "")
        assert not field(user, "import.use").enabled
        await drop(user, ("<b>x.csv", "much"))
        await until(user, "import.message", "<b>x.csv: ")


def test_a_dropped_test_is_corrected_and_used() -> None:
    done(_tensile())


async def _tips() -> None:
    async with opened(identify_tab, "identify") as (user, stage):
        session = stage.session
        await drop(user, ("world.csv", (LABORATORY / "registration_world.csv").read_text()))
        await until(user, "import.message", "Tips of a robot")
        enter(user, "import.frame", "fit")
        for _ in range(200):
            await asyncio.sleep(0.05)
            if "frame" in [row["c0"] for row in field(user, "import.settings").rows]:
                break
        user.find(marker="import.use").click()
        await asyncio.sleep(0.1)
        assert session.table("measurements") == {"file": "world_imported.csv", "free": ["k_e", "k_b"]}
        assert session.table("registration") == {"frame": "fit"}
        assert session.problem is None
        assert field(user, "identify.kind").value == "measurements"
        # tips without pressures are refused, and the scenario stays as it was
        lines = [f"{k},{k % 3}.1,{k % 2}.2,6{k % 4}.3" for k in range(12)]
        await drop(user, ("tips.csv", "\n".join(["t_s,x_mm,y_mm,z_mm", *lines])))
        await until(user, "import.message", "tips.csv: Tips")
        user.find(marker="import.use").click()
        await asyncio.sleep(0.1)
        assert any("p1_bar" in message for message in user.notify.messages), user.notify.messages
        assert session.table("measurements")["file"] == "world_imported.csv"
        assert session.table("registration") == {"frame": "fit"}


def test_dropped_tips_are_those_of_the_identification() -> None:
    done(_tips())
