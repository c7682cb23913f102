"""The mould tab: fields of its sizes, refusals beside them, the parts in the view, a stop, and every file as a zip."""

from __future__ import annotations

import asyncio
import io
import multiprocessing
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("trimesh", reason="the extra mesh is not installed")

import trimesh
from app_stage import done, enter, field, opened, until
from nicegui import ElementFilter

from benchmarks.app import chromium
from softnlp.app.mould_parts import hex_of, messages_of
from softnlp.app.tabs import mould
from softnlp.app.tabs.mould import label_of, mould_tab
from softnlp.base.errors import InputError
from softnlp.cli import main
from softnlp.model.robot import robot
from softnlp.mould import MouldTable, moulds
from softnlp.mould.write import COLOURS
from softnlp.scenario.describe import keys_of
from tests.browser import Watched
from tests.test_app_access import AXE, BOXES

KEYS = {key.name: key for key in keys_of(MouldTable)}
SMALL = """title = "small"
study = "forward"
[robot]
name = "D10L40"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[pressure]
sequence_bar = [[0.1, 0.0, 0.0]]
[mould]
thread_pitch_mm = 8.0
"""


def error_of(user: Any, key: str) -> str:
    return str(field(user, f"mould.{key}").props.get("error-message", ""))


def array(text: str, kind: str) -> np.ndarray:
    from base64 import b64decode

    return np.frombuffer(b64decode(text), kind)


async def _fields() -> None:
    async with opened(mould_tab, "forward") as (user, stage):
        session = stage.session
        for name, key in KEYS.items():
            boxes = [f"mould.{name}.{k}" for k in range(3)] if name == "bed_mm" else [f"mould.{name}"]
            for marker in boxes:
                box = field(user, marker)
                assert box.props.get("suffix", "") == key.unit.replace("deg", "°"), name
                default = getattr(MouldTable(), name)
                if default is not None and name != "bed_mm":
                    assert box.value == default
        # what is left open is shown as it holds: half the thread, 4 mm, 2 mm
        assert [field(user, f"mould.{k}").value for k in ("groove_depth_mm", "gate_mm", "tube_mm")] == [0.1, 4.0, 2.0]
        enter(user, "mould.thread_diameter_mm", 0.16)
        assert session.table("mould") == {"thread_diameter_mm": 0.16}
        assert field(user, "mould.groove_depth_mm").value == 0.08
        enter(user, "mould.thread_diameter_mm", None)
        enter(user, "mould.shell_parts", 3)
        enter(user, "mould.bed_mm.2", 150.0)
        assert session.table("mould") == {"shell_parts": 3, "bed_mm": [200.0, 200.0, 150.0]}
        assert "[mould]" in session.text()
        # what the schema refuses and what cannot be moulded are said beside the field, and when it is asked for
        enter(user, "mould.clearance_mm", -1.0)
        assert "expected" in error_of(user, "clearance_mm")
        enter(user, "mould.clearance_mm", None)
        enter(user, "mould.gate_mm", 9.0)
        assert error_of(user, "gate_mm") == "a gate of 9 mm is wider than the wall of silicone, 8 mm"
        user.find(marker="mould.run").click()
        await until(user, "mould.message", "wider than the wall of silicone")
        enter(user, "mould.gate_mm", None)
        assert not error_of(user, "gate_mm")
        # a robot that cannot be moulded, in a sentence
        session.change_all("robot", {"name": "D10L40", "chamber_diameter_mm": 0.7, "chamber_wall_mm": 0.9})
        assert session.problem is None
        assert "second rod of chamber 1 would be 0.7 mm thick" in field(user, "mould.problem").text
        session.change_all("robot", {"name": "D10L40"})
        with user:
            assert [label.visible for label in ElementFilter(marker="mould.problem")] == [False]


def test_sizes_are_fields_with_units_and_refusals_stand_beside_them() -> None:
    done(_fields())


def test_labels_are_words_without_units() -> None:
    labels = {name: label_of(key) for name, key in KEYS.items()}
    assert labels["minimum_wall_mm"] == "Minimum wall"
    assert labels["draft_deg"] == "Draft"
    assert labels["shrinkage_percent"] == "Shrinkage"
    assert len(set(labels.values())) == len(KEYS)


async def _missing() -> None:
    async with opened(mould_tab, "forward") as (user, _):
        assert "pip install -e '.[gui,mesh]'" in field(user, "mould.missing").text
        with user:
            assert not list(ElementFilter(marker="mould.run"))


def test_without_the_extra_the_tab_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(facets: int) -> None:
        raise InputError("solids need trimesh and manifold3d, which are not installed")

    monkeypatch.setattr(mould, "require", absent)
    done(_missing())


async def _stopped() -> None:
    async with opened(mould_tab, "forward", SMALL) as (user, stage):
        view: Any = stage.view
        user.find(marker="mould.run").click()
        for _ in range(1200):
            if view.parts_shown is not None:
                break
            await asyncio.sleep(0.05)
        assert view.parts_shown["name"] == "First pour"  # long before everything is measured
        assert view.parts_shown["apart"] == 1.0
        enter(user, "mould.look", "together")
        assert view.parts_shown["apart"] == 0.0
        enter(user, "mould.scene", "Second pour")
        assert view.parts_shown["name"] == "Second pour"
        user.find(marker="mould.stop").click()
        await until(user, "mould.message", "Stopped.")
        assert not multiprocessing.active_children()
        with user:
            for tell in stage.turned:
                tell("kinematics")
        assert view.parts_shown is None  # on another tab the robot is shown
        with user:
            for tell in stage.turned:
                tell("mould")
        assert view.parts_shown["name"] == "Second pour"
        stage.session.change("robot", "length_mm", 45.0)
        assert view.parts_shown is None  # it is the robot that changes
        assert "earlier robot" in field(user, "mould.old").text


def test_parts_come_before_checks_and_a_stop_ends_the_process() -> None:
    done(_stopped())


def test_the_view_gets_every_piece_where_it_is() -> None:
    found = moulds(robot("D10L40"), MouldTable(thread_pitch_mm=8.0))
    messages = messages_of(found)
    assert list(messages) == ["First pour", "Second pour", "Caps"]
    segment = found.segments[0]
    for number, name in ((1, "First pour"), (2, "Second pour")):
        message = messages[name]
        pieces = sum(part.count for part in segment.step(number)) + (6 if number == 1 else 0)
        assert len(message["places"]) == pieces
        for part, solid in zip(segment.step(number), message["solids"], strict=False):
            points = array(solid["points"], "<f4").reshape(-1, 3).astype(float)
            faces = array(solid["faces"], "<u4" if solid["wide"] else "<u2").reshape(-1, 3)
            a, b, c = (points[faces[:, k]] for k in range(3))
            volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
            assert volume == pytest.approx(part.solid.volume(), rel=1e-4)
            assert solid["colour"] == hex_of(part.kind)
    assert {hex_of(kind) for kind in COLOURS} >= {solid["colour"] for m in messages.values() for solid in m["solids"]}


@pytest.mark.slow
def test_the_zip_has_the_files_of_the_command(tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    assert main(["mould", str(path), "--out", str(tmp_path / "out")]) == 0

    async def visit() -> None:
        async with opened(mould_tab, "forward", SMALL) as (user, stage):
            stage.session.name = "small.toml"
            user.find(marker="mould.run").click()
            await asyncio.sleep(0.05)
            await until(user, "mould.message", "checks hold", 4000)
            user.find(marker="mould.zip").click()
            content = (await user.download.next()).content
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            assert {n: archive.read(n) for n in archive.namelist()} == {
                file.name: file.read_bytes() for file in (tmp_path / "out").iterdir()
            }

    done(visit())


# Those with a browser come last: its event loop stays until the file ends, and pages without one need their own.
def taken(tab: Watched, button: str, folder: Path) -> Path:
    with tab.page.expect_download() as waiting:
        tab.press(button)
    path = folder / waiting.value.suggested_filename
    waiting.value.save_as(path)
    return path


@pytest.mark.thorough
@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
def test_a_designer_makes_moulds_in_the_browser(tab: Watched, tmp_path: Path, pictures: Path) -> None:
    tab.choose("robot-name", "D10L40")
    tab.page.locator("[data-testid=tab-mould]").scroll_into_view_if_needed()
    tab.press("tab-mould")
    tab.open_panel("mould")
    tab.type("mould.thread_pitch_mm", "8")
    tab.page.wait_for_timeout(600)
    assert tab.page.locator("[data-testid=tab-mould][aria-selected=true]").count() == 1  # a change stays on this tab
    tab.press("mould.run")
    tab.page.wait_for_function("document.querySelector('[data-parts]')?.dataset.parts === 'First pour'")
    said = "document.querySelector('[data-testid=\"mould.message\"]').textContent"
    tab.page.wait_for_function(f"{said}.includes('checks hold')")
    assert "21 pieces of 11 parts" in tab.text("mould.message")
    sentences = tab.page.locator("[data-testid='mould.checks'] [role=listitem]").all_inner_texts()
    assert len(sentences) == 10
    assert any("thinnest wall is 0.8" in words for words in sentences)
    with zipfile.ZipFile(taken(tab, "mould.zip", tmp_path)) as archive:
        names = archive.namelist()
        stl = next(name for name in names if name.endswith("-lumen-rod.stl"))
        read = trimesh.load(io.BytesIO(archive.read(stl)), file_type="stl")
    assert len(names) == 2 * 11 + 5
    assert read.extents[:2] == pytest.approx(2 * [1e3 * robot("D10L40").lumen_diameter], abs=1e-3)
    assert "Wind the thread" in taken(tab, "mould.steps", tmp_path).read_text()
    axe = pytest.importorskip("axe_core_python", reason="axe-core-python is not installed")
    tab.page.evaluate((Path(axe.__file__).parent / "axe.min.js").read_text())
    assert tab.page.evaluate(AXE, True) == []
    for width in (390, 820, 1280, 1600):
        tab.page.set_viewport_size({"width": width, "height": 900})
        tab.page.wait_for_timeout(500)
        tab.page.screenshot(path=pictures / f"mould_{width}.png")
        assert tab.evaluate(BOXES) == [], width
    tab.page.locator("[data-testid=tab-kinematics]").scroll_into_view_if_needed()
    tab.press("tab-kinematics")
    tab.page.wait_for_function("document.querySelector('[data-parts]').dataset.parts === ''")


@pytest.mark.slow
@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
def test_the_best_design_is_made_in_the_browser(tab: Watched) -> None:
    tab.press("tab-design")
    tab.press("design.run")
    tab.page.wait_for_selector("[data-testid='design.make']")
    tab.press("design.make")
    tab.page.wait_for_function("document.querySelector('[data-parts]')?.dataset.parts === 'First pour'")
    assert tab.page.locator("[data-testid=tab-mould][aria-selected=true]").count() == 1
    said = "document.querySelector('[data-testid=\"mould.message\"]').textContent"
    tab.page.wait_for_function(f"{said}.includes('checks hold')")
