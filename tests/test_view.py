"""The 3-D view: what a frame holds, what is sent of it, and that a browser draws that, in place and from here alone."""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arc_runs import arc_pose
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from view_browser import FLAGS, STAGE, drawn, served

from softnlp import robot
from softnlp.app.view import Frame, frame_of
from softnlp.app.view.frame import ARROW, cloud_message, frame_message, layout_of, packed, quaternions, robot_message
from softnlp.base.palette import colour
from softnlp.figures.mesh import display_mesh
from softnlp.figures.mesh.display import STATIONS
from softnlp.results import Body
from softnlp.statics.wall import Wall

ARM = robot("D25L60")
BESIDE_THE_VIEW = {"frame_of", "RobotView", "NotebookView", "run", "handler", "picture"}
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def bent(pressure: tuple[float, ...] = (8e4, 2e4, 0.0), points: int = 31) -> Body:
    pose = arc_pose(ARM, np.array(pressure), points)
    return Body(pose.shape.position, pose.shape.rotation, pose.radii)


def numbers(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
@settings(max_examples=60, deadline=None)
def test_quaternions_are_those_of_the_rotations(q: list[float]) -> None:
    R = Rotation.from_quat(q).as_matrix()
    back = Rotation.from_quat(quaternions(R[None])[0]).as_matrix()
    assert back == pytest.approx(R, abs=1e-12)


def test_a_frame_is_the_body_in_millimetres_at_fixed_stations() -> None:
    for points in (7, 31, 90):
        shown = frame_of(ARM, bent(points=points), [8e4, 2e4, 0.0])
        exact = bent(points=STATIONS)
        assert shown.body.position == pytest.approx(1e3 * exact.position, abs=1e-9)
        assert Rotation.from_quat(shown.body.quaternion).as_matrix() == pytest.approx(exact.rotation, abs=1e-9)
    assert shown.body.radii.bore == pytest.approx(1e3 * exact.radii.bore)
    assert shown.pressure_bar.tolist() == [0.8, 0.2, 0.0]
    assert shown.arrows == ()
    assert shown.wall is shown.ghost is None
    with pytest.raises(ValueError, match="expected 3 pressures, one a chamber set"):
        frame_of(ARM, bent(), [1e5])


def test_loads_are_arrows_with_their_size() -> None:
    body = bent()
    tip, axis = 1e3 * body.position[-1], body.rotation[-1, :, 2]
    pulls, pushes = 2.0 * axis, -3.0 * axis
    size = ARROW * 60
    for force in (pulls, pushes):
        shown = frame_of(
            ARM, body, np.zeros(3), tip_force=force, tip_moment=(0.0, 0.02, 0.0), gravity=(0.0, 0.0, -9.80665)
        )
        arrow, moment, gravity = shown.arrows
        assert np.linalg.norm(arrow.vector) == pytest.approx(size)
        assert np.cross(arrow.vector, force) == pytest.approx(0, abs=1e-9)
        assert arrow.inwards == (force is pushes)
        assert (arrow.start + arrow.inwards * arrow.vector) == pytest.approx(tip)  # it ends, or starts, at the tip
        assert arrow.label == f"F {np.linalg.norm(force):.3g} N"
        assert (moment.label, gravity.label) == ("M 20 N mm", "g 9.81 m/s²")
        assert gravity.vector == pytest.approx([0, 0, -size])
        assert np.linalg.norm(moment.vector) >= 1.7 * 1e3 * body.radii.outer  # it goes round the body


def test_a_robot_that_hangs_is_shown_with_its_base_on_top() -> None:
    for gravity, hanging in (((0, 0, -9.8), False), ((0, 0, 9.8), True), ((9.8, 0, 0), False), ((0, 0, 0), False)):
        shown = frame_of(ARM, bent(), np.zeros(3), gravity=gravity)
        assert frame_message(shown, 1, full_bar=1.0)["hanging"] is hanging


def test_a_wall_stands_where_the_cap_meets_it_and_pushes_there() -> None:
    body = bent()
    wall = Wall(np.array([-0.05, 0.3, 0.7]), np.array([1.0, 0.0, 0.0]))
    shown = frame_of(ARM, body, np.zeros(3), wall=wall, wall_force=0.71, tip_cap=5e-3)
    contact = 1e3 * (body.position[-1] + 5e-3 * body.rotation[-1, :, 2])
    assert shown.wall is not None
    assert shown.wall[0] == pytest.approx([-50, contact[1], contact[2]])
    (arrow,) = shown.arrows
    assert arrow.start + arrow.vector == pytest.approx(contact)
    assert (arrow.kind, arrow.label, arrow.vector[0] > 0) == ("wall", "wall 0.71 N", True)
    assert not frame_of(ARM, body, np.zeros(3), wall=wall).arrows  # it stands there without a force too


def test_a_frame_s_message_is_small_and_holds_the_frame() -> None:
    shown = frame_of(ARM, bent(), [8e4, 2e4, 0.0], ghost=bent((5e4, 0, 0)), gravity=(0, 0, -9.8))
    message = frame_message(shown, 7, full_bar=1.0)
    assert len(json.dumps(message)) < 5000
    axis = numbers(message["body"]["axis"], "<f4").reshape(STATIONS, 7)
    assert axis[:, :3] == pytest.approx(shown.body.position, abs=1e-4)
    assert axis[:, 3:] == pytest.approx(shown.body.quaternion, abs=1e-6)
    assert (message["id"], message["level"], message["length"]) == (7, [0.8, 0.2, 0.0], pytest.approx(60))
    assert frame_message(shown, 8, full_bar=0.5)["level"] == [1.0, 0.4, 0.0]


@pytest.mark.parametrize("name", ["D25L60", "laparoscope-9"])
def test_a_robot_s_message_is_its_display_mesh(name: str) -> None:
    arm = robot(name)
    message, mesh = robot_message(arm), display_mesh(arm)
    assert numbers(message["station"], "<u2").tolist() == mesh.station.tolist()
    assert numbers(message["around"], "<f4").reshape(-1, 2).tolist() == mesh.around.tolist()
    for sent, part in zip(message["parts"], mesh.parts, strict=True):
        assert numbers(sent["faces"], "<u2").reshape(-1, 3).tolist() == (part.faces + part.first).tolist()
        assert sent["set"] == (None if part.chamber is None else arm.set_of_chamber[part.chamber])
    assert [s["colour"] for s in message["sets"]] == [colour(k) for k in range(3)]
    assert np.degrees([s["angle"] for s in message["sets"]]) % 360 == pytest.approx([0, 120, 240], abs=1e-9)


def test_the_triangles_are_those_of_the_chambers_alone() -> None:
    assert layout_of(ARM) == layout_of(robot("D25L40"))  # not of lengths
    assert layout_of(ARM) != layout_of(robot("D15L60"))
    assert layout_of(robot("laparoscope-6")) != layout_of(robot("laparoscope-9"))


def test_a_cloud_leaves_out_what_is_nowhere() -> None:
    assert cloud_message(None, None) is None
    xyz = np.array([[1.0, 2.0, 3.0], [np.nan, 0.0, 0.0], [4.0, 5.0, 6.0]])
    message = cloud_message(xyz, np.array([[0.0, 0.5, 1.0], [0.1, 0.1, 0.1], [1.0, 1.0, 2.0]]))
    assert message is not None
    assert numbers(message["points"], "<f4").tolist() == [1, 2, 3, 4, 5, 6]
    assert numbers(message["colours"], "u1").tolist() == [0, 128, 255, 255, 255, 255]
    for wrong in (xyz[:, :2], xyz[0]):
        with pytest.raises(ValueError, match=r"of shape \(n, 3\)"):
            cloud_message(wrong, None)
    with pytest.raises(ValueError, match=r"got \(3, 3\) and \(2, 3\)"):
        cloud_message(xyz, xyz[:2])


def test_whole_numbers_are_rounded_to() -> None:
    assert numbers(packed(np.array([0.49, 0.51, 126.999]), np.int8), "i1").tolist() == [0, 1, 127]


class Recorded:
    """A view outside a browser: the calls that it would make there."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        pytest.importorskip("nicegui", reason="the extra gui is not installed")
        from nicegui import ui
        from nicegui.client import Client

        from softnlp.app.view import RobotView

        self.calls: list[tuple[Any, ...]] = []
        with Client(ui.page("/test-view")):
            self.view = RobotView()
        monkeypatch.setattr(self.view, "run_method", lambda *call, **_: self.calls.append(call))

    def names(self) -> list[str]:
        names = [call[0] for call in self.calls]
        self.calls.clear()
        return names


def test_the_view_sends_what_is_new_when_there_is_a_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Recorded(monkeypatch)
    view = made.view
    assert view.show(frame_of(ARM, bent(), np.zeros(3))) == 1
    view.points(np.zeros((1, 3)))
    view.reset()
    assert made.names() == []  # nobody is there
    view._begin()
    assert made.names() == ["points", "robot", "show"]
    assert view.show(frame_of(ARM, bent(), np.zeros(3))) == 2
    assert made.names() == ["show"]  # the triangles are there
    view.show(frame_of(robot("laparoscope-9"), bent(), np.zeros(3)))
    assert made.names() == ["robot", "show"]
    view.clear_trail()
    view.reset()
    view.targets(None)
    view.download()
    assert made.names() == ["clearTrail", "reset", "targets", "download"]
    view._begin()  # it came back, with an empty page
    assert sorted(made.names()) == ["points", "robot", "show", "targets"]


def test_the_document_s_example_runs() -> None:
    pytest.importorskip("nicegui", reason="the extra gui is not installed")
    from sybil import Document
    from sybil.parsers.markdown import PythonCodeBlockParser

    document = Path(__file__).parents[1] / "docs" / "view.md"
    in_a_cell, example = Document.parse(str(document), PythonCodeBlockParser()).examples()
    in_a_cell.evaluate()
    example.evaluate()
    from nicegui import ui
    from nicegui.client import Client

    with Client(ui.page("/test-document")) as client:
        example.namespace["page"]()
    (view,) = [element for element in client.elements.values() if type(element).__name__ == "RobotView"]
    assert view._frame.robot.name == "D25L60"
    for call in re.findall(r"`(\w+)\(", document.read_text()):
        assert hasattr(view, call) or call in BESIDE_THE_VIEW, call


# The text of each label that is seen, and its box on the screen without the margin of its halo.
LABELS = """
(() => {
  const { labels, camera, element } = %s;
  const [width, height] = [element.clientWidth, element.clientHeight];
  const seen = (node) => node === null || (node.visible && seen(node.parent));
  return [...labels].filter((label) => seen(label.sprite)).map(({ sprite, canvas, key }) => {
    const place = sprite.getWorldPosition(camera.position.clone()).project(camera);
    const [w, h] = [canvas.width / 3, canvas.height / 3];
    const left = ((place.x + 1) / 2) * width - sprite.center.x * w;
    const top = ((1 - place.y) / 2) * height - (1 - sprite.center.y) * h;
    return [key.split("|")[0], left + 4, top + 4, left + w - 4, top + h - 4];
  });
})()
"""


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """Serve a page with a view; yield its address."""
    pytest.importorskip("nicegui", reason="the extra gui is not installed")
    pytest.importorskip("playwright", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("there is no chromium on this machine")
    with served() as address:
        yield address


def pixels(page: Any) -> np.ndarray:
    """Return the picture that the view makes of itself."""
    from matplotlib.image import imread

    url = page.evaluate(f"{STAGE}.picture()")
    return np.asarray(imread(io.BytesIO(base64.b64decode(url.partition(",")[2]))))[..., :3]


def vertices_in_the_browser(page: Any) -> np.ndarray:
    return np.array(page.evaluate(f"Array.from({STAGE}.body.pieces[0].position.array)")).reshape(-1, 3)


def expected_vertices(shown: Frame) -> np.ndarray:
    rotation = Rotation.from_quat(shown.body.quaternion).as_matrix()
    r = shown.body.radii
    radii = type(r)(*(1e-3 * x for x in (r.outer, r.lumen, r.chamber_circle, r.chamber, r.bore)))
    return display_mesh(shown.robot).vertices(Body(1e-3 * shown.body.position, rotation, radii))


@pytest.mark.thorough
def test_a_browser_draws_it_in_place_and_asks_nobody_else(server: str, tmp_path: Path) -> None:
    """One page is used throughout, since a browser takes seconds to start."""
    import view_page
    from playwright.sync_api import sync_playwright

    said: list[str] = []
    asked: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch_persistent_context(
            str(tmp_path), executable_path=CHROMIUM, args=FLAGS, viewport={"width": 500, "height": 420}
        )
        page = browser.new_page()
        page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(server)
        drawn(page, 1)
        at_rest = pixels(page)
        assert len(np.unique(at_rest.reshape(-1, 3), axis=0)) > 200  # not blank
        assert vertices_in_the_browser(page) == pytest.approx(expected_vertices(view_page.frame(0.0)), abs=2e-4)

        page.evaluate(f"window.kept = [document.querySelector('canvas'), {STAGE}.body]")
        page.click("#bend")
        drawn(page, 2)
        assert vertices_in_the_browser(page) == pytest.approx(expected_vertices(view_page.frame(0.8)), abs=2e-4)
        assert page.evaluate(f"kept[0] === document.querySelector('canvas') && kept[1] === {STAGE}.body")
        bent_over = pixels(page)
        assert np.abs(bent_over - at_rest).max(axis=2).mean() > 0.01
        blue, pale = (int((image[..., 2] - image[..., 0] > 0.3).sum()) for image in (bent_over, at_rest))
        assert blue > 1000  # the pressurised set has its colour
        assert pale < 0.05 * blue

        page.click("#load")
        drawn(page, 3)
        assert page.evaluate(f"{STAGE}.ghost.group.visible && {STAGE}.marks.wall.visible && {STAGE}.marks.cap.visible")
        boxes = page.evaluate(LABELS % STAGE)
        assert {"F 0.447 N", "M 10 N mm", "wall 0.71 N", "x", "y", "z"} <= {box[0] for box in boxes}
        assert not [
            (a[0], b[0])
            for a, b in combinations(boxes, 2)
            if a[1] < b[3] and b[1] < a[3] and a[2] < b[4] and b[2] < a[4]
        ]
        page.click("#round")
        page.wait_for_function("document.querySelector('#said').innerText !== ''", timeout=60_000)
        median = page.inner_text("#said").split()[1]
        print(f"from show to drawn {median} ms (median of 20)")
        assert page.evaluate(f"{STAGE}.marks.count") > 15  # the trail of the tip

        page.click("#cloud")
        page.wait_for_function(f"{STAGE}.marks.targets.children.length === 2")
        assert page.evaluate(f"{STAGE}.marks.cloud.geometry.attributes.position.count") == 225
        box = page.locator(".softnlp-view canvas").bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.wait_for_function("document.querySelector('#picked').innerText !== ''")
        assert [float(x) for x in page.inner_text("#picked").split()] == pytest.approx(
            page.evaluate(f"{STAGE}.controls.target.toArray()"), abs=0.5
        )  # the middle of the picture is where the camera looks, on the axis
        camera = f"{STAGE}.camera.position.toArray()"
        start, picked = page.evaluate(camera), page.inner_text("#picked")
        page.mouse.move(box["x"] + 100, box["y"] + 100)
        page.mouse.down()
        page.mouse.move(box["x"] + 200, box["y"] + 120, steps=4)
        page.mouse.up()
        page.wait_for_timeout(100)
        assert np.linalg.norm(np.subtract(page.evaluate(camera), start)) > 10  # turned
        assert page.inner_text("#picked") == picked  # a drag is no click
        page.click("#reset")
        page.wait_for_function(f"Math.hypot(...{camera}.map((x, k) => x - {start}[k])) < 1e-6")
        page.click("#picture")
        page.wait_for_function("document.querySelector('#said').innerText.startsWith('png')")
        assert page.inner_text("#said").split()[2] == "89504e470d0a1a0a"
        assert int(page.inner_text("#said").split()[3]) == 2 * round(box["width"])
        light = at_rest[5, 5]
        page.evaluate("document.body.classList.add('body--dark')")
        page.wait_for_function(f"{STAGE}.scene.background.r < 0.1")
        assert (pixels(page)[5, 5] < light - 0.5).all()
        page.click("#hang")
        page.wait_for_function(f"{STAGE}.camera.up.z === -1 && {STAGE}.camera.position.z < {STAGE}.controls.target.z")
        page.click("#bend")
        page.wait_for_function(f"{STAGE}.camera.up.z === 1 && {STAGE}.camera.position.z > {STAGE}.controls.target.z")
        browser.close()
    assert not [line for line in said if not line.startswith(("log", "debug", "info"))]
    assert asked
    assert all(url.startswith((server, "data:", "blob:")) for url in asked)
