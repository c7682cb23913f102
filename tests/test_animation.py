"""A run as an animated GLB and as a GIF: what is in the files is the motion."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp import BAR, Dynamics, Loads, Numerics, dynamic, forward, material, robot, save
from softnlp.cli import main
from softnlp.figures.mesh.animation import FACETS, STATIONS, frames_of
from softnlp.figures.mesh.solid import segment_solids
from softnlp.results import load_run

RUBBER = material("Ecoflex 00-50")
FAST = Numerics(engine="newton")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a release."""
    asked = Dynamics(0.04, damping=4e-3, output_step=0.01, release=True)
    made = dynamic(robot("D25L60"), RUBBER, [0.3 * BAR, 0.0, 0.0], asked, loads=Loads((0.03, 0, 0)), numerics=FAST)
    folder = tmp_path_factory.mktemp("run")
    save(made, folder)
    return folder


def parts(path: Path) -> tuple[dict[str, Any], bytes]:
    """Return the JSON and the binary part of a GLB, by the specification of glTF 2.0."""
    content = path.read_bytes()
    assert content[:4] == b"glTF"
    version, length = np.frombuffer(content, np.uint32, 2, 4)
    assert (version, length) == (2, len(content))
    size = int(np.frombuffer(content, np.uint32, 1, 12)[0])
    assert content[16:20] == b"JSON"
    rest = content[20 + size :]
    assert rest[4:8] == b"BIN\0"
    return json.loads(content[20 : 20 + size]), rest[8:]


def array(document: dict[str, Any], binary: bytes, number: int) -> Any:
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = {5126: np.float32, 5125: np.uint32}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
    found = np.frombuffer(binary, kind, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
    if "min" in accessor:
        assert np.array_equal(found.min(axis=0), np.array(accessor["min"], kind))
        assert np.array_equal(found.max(axis=0), np.array(accessor["max"], kind))
    return found


def test_each_frame_of_a_glb_is_the_body_then(run: Path, tmp_path: Path) -> None:
    """Base and one target weighted as the animation says give the solid of the step, at its time."""
    out = tmp_path / "run.glb"
    assert main(["mesh", str(run), "--animate", "--out", str(out)]) == 0
    document, binary = parts(out)
    view = load_run(run)
    primitive = document["meshes"][0]["primitives"][0]
    base = array(document, binary, primitive["attributes"]["POSITION"])
    targets = [array(document, binary, target["POSITION"]) for target in primitive["targets"]]
    sampler = document["animations"][0]["samplers"][0]
    times = array(document, binary, sampler["input"]).ravel()
    weights = array(document, binary, sampler["output"]).reshape(times.size, -1)
    assert np.allclose(times, [0.0, 0.01, 0.02, 0.03, 0.04])
    moved = 0.0
    for k, row in enumerate(weights):
        here = base + sum(w * target for w, target in zip(row, targets, strict=True))
        body = view.bodies[k]
        assert body is not None
        solid = segment_solids(view.robot, body, FACETS, STATIONS)[0]
        assert np.allclose(here, solid.vertices, atol=1e-4)  # of single precision, in mm
        moved = max(moved, float(np.abs(here - base).max()))
    assert moved > 1.0
    faces = array(document, binary, primitive["indices"]).reshape(-1, 3)
    a, b, c = (base[faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(solid.volume, rel=0.1)


def test_segments_move_each_by_itself(tmp_path: Path) -> None:
    from softnlp import Segment, segmented_robot

    made = segmented_robot([Segment(robot("D25L60"), RUBBER), Segment(robot("D20L40"), RUBBER)])
    folder = tmp_path / "run"
    save(forward(made, RUBBER, [[0.0] * 6, [0.3 * BAR, 0, 0, 0, 0.3 * BAR, 0]], numerics=FAST), folder)
    assert main(["mesh", str(folder), "--animate", "--out", str(tmp_path / "run.glb")]) == 0
    document, binary = parts(tmp_path / "run.glb")
    assert [mesh["name"] for mesh in document["meshes"]] == ["segment 1", "segment 2"]
    assert [channel["target"]["node"] for channel in document["animations"][0]["channels"]] == [0, 1]
    assert np.allclose(array(document, binary, 0).ravel(), [0.0, 1.0])  # a step a second


def test_a_gif_has_a_frame_for_each_step(run: Path, tmp_path: Path) -> None:
    from PIL import Image

    out = tmp_path / "run.gif"
    assert main(["plot", "run", str(run), "--out", str(out)]) == 0
    with Image.open(out) as picture:
        frames = []
        for k in range(picture.n_frames):
            picture.seek(k)
            frames.append(np.asarray(picture.convert("L"), float))
        assert picture.info["duration"] == 500  # 2.4 s in 5 frames, to a whole number a second
    assert len(frames) == 5
    changed = [np.mean(np.abs(a - b) > 40) for a, b in pairwise(frames)]
    assert all(0.002 < part < 0.2 for part in changed)


def test_a_long_run_is_thinned() -> None:
    assert frames_of(range(1000), 5) == [0, 250, 500, 749, 999]
    assert frames_of([3, 4], 60) == [3, 4]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--animate", "--step", "1"], "--animate: expected neither --step"),
        (["--animate", "--out", "run.stl"], "--out: expected a file name that ends in .glb"),
    ],
)
def test_what_does_not_go_together_is_one_line(
    run: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    assert main(["mesh", str(run), *words]) == 2
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert said in shown
