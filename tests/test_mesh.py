"""Meshes of a body: closed, facing outwards, of the section's volume, and placed where the shape is."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arc_runs import arc_pose, ramp_run
from hypothesis import given, settings
from hypothesis import strategies as st
from sybil import Document
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser

from softnlp import robot
from softnlp.base.errors import InputError
from softnlp.cli import main
from softnlp.figures.mesh import (
    body_solid,
    cores,
    display_mesh,
    mould_body,
    natural_body,
    resampled,
    write_solids,
)
from softnlp.figures.mesh.solid import Solid
from softnlp.model.robot import ROBOTS, Robot
from softnlp.results import Body, save

trimesh = pytest.importorskip("trimesh", reason="the extra mesh is not installed")
pytest.importorskip("manifold3d", reason="the extra mesh is not installed")

ROOT = Path(__file__).parents[1]
ONE_SET = ROOT / "scenarios" / "D25L60_one_set.toml"
MM3 = 1e9


def arc_body(arm: Robot, pressure: tuple[float, ...] = (8e4, 2e4, 0.0), points: int = 31) -> Body:
    pose = arc_pose(arm, np.array(pressure), points)
    return Body(pose.shape.position, pose.shape.rotation, pose.radii)


def section_area(arm: Robot, body: Body) -> float:
    return float(np.pi * (body.radii.outer**2 - body.radii.lumen**2 - arm.chambers * body.radii.bore**2))


def assert_closed(solid: Solid, holes: int) -> None:
    """No open edge, every face the right way round, one piece, and a sphere with so many handles."""
    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2 - 2 * holes
    assert mesh.volume == pytest.approx(solid.volume)
    assert mesh.volume > 0  # outwards


@pytest.mark.parametrize("name", ROBOTS)
def test_the_cast_body_is_closed_and_its_volume_converges(name: str) -> None:
    arm = robot(name)
    exact = section_area(arm, natural_body(arm)) * arm.length * MM3
    solids = [mould_body(arm, facets) for facets in (24, 48, 96)]
    assert_closed(solids[-1], 1 + arm.chambers)
    errors = np.array([1 - solid.volume / exact for solid in solids])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx([2, 2], abs=0.02)
    assert errors[-1] == pytest.approx(2 * np.pi**2 / 3 / 96**2, rel=1e-2)  # of a regular polygon in its circle


@pytest.mark.parametrize("name", ["D25L60", "laparoscope-3", "laparoscope-9"])
def test_a_bent_body_is_closed_and_its_volume_converges(name: str) -> None:
    """A planar section about its centroid sweeps A times the length of the axis (Pappus)."""
    arm = robot(name)
    body = arc_body(arm)
    exact = section_area(arm, body) * arc_pose(arm, np.array([8e4, 2e4, 0.0])).backbone_length * MM3
    solids = [body_solid(arm, body, facets) for facets in (48, 192)]
    assert_closed(solids[0], 1 + arm.chambers)
    errors = np.array([1 - solid.volume / exact for solid in solids])
    assert np.log(errors[0] / errors[1]) / np.log(4) == pytest.approx(2, abs=0.2)  # stations are whole numbers
    assert errors[0] < 14 / 48**2
    assert not solids[0].warnings


def test_body_and_cores_fill_the_full_body() -> None:
    arm = robot("D25L60")
    length = arc_pose(arm, np.array([8e4, 2e4, 0.0])).backbone_length
    for body, axis in ((None, arm.length), (arc_body(arm), length)):
        silicone = mould_body(arm) if body is None else body_solid(arm, body)
        inside = cores(arm, body)
        for core in inside:
            assert_closed(core, 0)
        shape = natural_body(arm) if body is None else body
        filled = silicone.volume + sum(core.volume for core in inside)
        assert filled == pytest.approx(np.pi * shape.radii.outer**2 * axis * MM3, rel=14 / 96**2)
    assert [core.chamber for core in inside] == [None, *range(6)]
    assert inside[1].volume > 1.2 * inside[5].volume  # the pressurised side is outside the bend


def test_holes_for_wound_chambers_are_as_wide_as_the_thread() -> None:
    arm = robot("D25L60")
    difference = mould_body(arm).volume - mould_body(arm, holes="reinforced").volume
    ring = 48 * np.sin(2 * np.pi / 96) * (arm.chamber_radius**2 - arm.bore_radius**2)
    assert difference == pytest.approx(arm.chambers * ring * arm.length * MM3)
    for which in ("bore", "reinforced"):
        radius = arm.bore_radius if which == "bore" else arm.chamber_radius
        rod = cores(arm, holes=which)[1].vertices
        assert np.ptp(rod[:, 1]) == pytest.approx(2e3 * radius, rel=1e-3)


def test_a_bore_at_the_surface_leaves_no_solid() -> None:
    arm = robot("D25L60")
    with pytest.raises(InputError, match=r"the bores reach the surface here, r_cp \+ r = 12.75 mm of 12.5 mm"):
        mould_body(replace(arm, chamber_circle_diameter=21e-3))
    with pytest.raises(InputError, match="the bores reach the lumen here"):
        mould_body(replace(arm, chamber_circle_diameter=13e-3))
    with pytest.raises(InputError, match="expected more facets"):
        mould_body(replace(arm, chamber_circle_diameter=19.5e-3), 8)
    with pytest.raises(InputError, match="facets: expected a number of facets from 8 to 2000, got 7"):
        body_solid(arm, natural_body(arm), 7)
    with pytest.raises(InputError, match="holes: expected 'bore' or 'reinforced', got 'thread'"):
        mould_body(arm, holes="thread")


def test_the_command_says_what_it_took_a_reading_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = '[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
    (tmp_path / "s.toml").write_text(f'study = "forward"\n{table}[pressure]\nsequence_bar = [[-0.003, 0.2, 0]]\n')
    assert main(["mesh", str(tmp_path / "s.toml"), "--facets", "8", "--out", str(tmp_path / "s.stl")]) == 0
    assert "1 pressure reading below 0, the lowest -0.003 bar, taken as 0" in capsys.readouterr().err


def test_a_shape_of_negative_length_leaves_no_solid() -> None:
    arm = robot("D25L60")
    body = natural_body(arm)
    backwards = Body(body.position * [1, 1, -1], body.rotation, body.radii)
    with pytest.raises(InputError, match="negative length"):
        body_solid(arm, backwards, 8)
    with pytest.raises(InputError, match="negative length"):
        cores(arm, backwards, 8)


def test_a_body_through_itself_is_said() -> None:
    arm = robot("D25L60")
    long = replace(arm, length=0.4)
    turned = body_solid(long, arc_body(long, points=91), 16)  # more than a whole turn in a plane
    assert any("lie inside each other" in warning for warning in turned.warnings)
    sharp = replace(arm, outer_diameter=0.2)
    wide = natural_body(sharp)
    bent = arc_body(arm, (4e4, 0.0, 0.0))
    folded = body_solid(sharp, Body(bent.position, bent.rotation, wide.radii), 64)
    assert any("inside of the bend has negative length" in warning for warning in folded.warnings)


@given(st.integers(2, 90), st.floats(0, 9e4), st.floats(0, 9e4))
@settings(max_examples=25, deadline=None)
def test_stations_between_lie_on_the_arc(stations: int, first: float, second: float) -> None:
    arm = robot("D25L60")
    coarse = resampled(arc_body(arm, (first, second, 0.0), 12), stations)
    exact = arc_body(arm, (first, second, 0.0), stations)
    assert coarse.position == pytest.approx(exact.position, abs=1e-9)
    assert coarse.rotation == pytest.approx(exact.rotation, abs=1e-9)


@pytest.mark.parametrize("name", ["D25L60", "laparoscope-9"])
def test_the_display_mesh_lies_on_the_body(name: str) -> None:
    arm = robot(name)
    mesh = display_mesh(arm)
    body = arc_body(arm)
    vertices, normals = mesh.vertices(body), mesh.normals(body)
    assert vertices.dtype == np.float32
    assert [part.kind for part in mesh.parts] == ["outer", "lumen", "end", *["chamber"] * arm.chambers]
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-6)
    axis = resampled(body, 41)
    for part in mesh.parts:
        points, station = part.of(vertices), mesh.station[part.first : part.last]
        local = np.einsum("vji,vj->vi", axis.rotation[station], points / 1e3 - axis.position[station])
        assert np.abs(local[:, 2]).max() < 1e-8
        corners = points[part.faces].astype(float)
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("fi,fi->f", across, part.of(normals)[part.faces].sum(axis=1)) > 0).all()
        if part.kind in ("outer", "lumen"):
            assert np.hypot(*local[:, :2].T) == pytest.approx(getattr(body.radii, part.kind), rel=1e-5)
        if part.chamber is not None:
            closed = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
            closed.merge_vertices()
            assert closed.is_watertight
            theta = float(arm.chamber_angles()[part.chamber])
            centre = body.radii.chamber_circle * np.array([np.cos(theta), np.sin(theta)])
            distance = np.hypot(*(local[:, :2] - centre).T)
            assert distance.max() == pytest.approx(body.radii.bore, rel=1e-5)
            assert distance.min() < 1e-8  # the middles of its discs


def test_the_topology_is_the_robot_s_alone() -> None:
    arm = robot("D25L60")
    mesh = display_mesh(arm)
    assert all(part.faces.max() < part.last - part.first for part in mesh.parts)
    shapes = [mesh.vertices(b) for b in (natural_body(arm), arc_body(arm), arc_body(arm, points=7))]
    assert shapes[0].shape == shapes[1].shape == shapes[2].shape == (mesh.parts[-1].last, 3)
    assert np.allclose(shapes[1], shapes[2], atol=1e-4)  # however many stations the solver had


def test_files_hold_millimetres_and_a_glb_stands_in_metres(tmp_path: Path) -> None:
    arm = robot("laparoscope-3")
    solid, inside = mould_body(arm), cores(arm)
    stl = trimesh.load(write_solids([solid], arm, tmp_path / "a.stl"))
    assert stl.is_watertight
    assert stl.extents == pytest.approx([11.4, 11.4, 45.0], rel=1e-3)
    assert stl.volume == pytest.approx(solid.volume, rel=1e-5)
    glb = trimesh.load(write_solids([solid, *inside], arm, tmp_path / "a.glb"))
    assert list(glb.geometry) == ["body", "lumen", "chamber 1", "chamber 2", "chamber 3"]
    assert glb.extents == pytest.approx([11.4e-3, 45e-3, 11.4e-3], rel=1e-3)  # y is up
    assert glb.geometry["body"].extents == pytest.approx([11.4, 11.4, 45.0], rel=1e-3)
    assert glb.geometry["chamber 2"].visual.material.baseColorFactor[:3].tolist() == [0xD5, 0x5E, 0x00]


def test_the_command_takes_a_run_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ramp_run(steps=4, to=8e4, failed=(2,))
    save(run, tmp_path / "run")
    assert (
        main(["mesh", str(tmp_path / "run"), "--cores", "--facets", "32", "--out", str(tmp_path / "new" / "b.stl")])
        == 0
    )
    pose = run.steps[3].pose
    assert pose is not None
    wanted = body_solid(run.robot, Body(pose.shape.position, pose.shape.rotation, pose.radii), 32)
    assert trimesh.load(tmp_path / "new" / "b.stl").volume == pytest.approx(wanted.volume, rel=1e-4)
    assert len(trimesh.load(tmp_path / "new" / "b-cores.stl").split()) == 7
    assert main(["mesh", str(tmp_path / "run"), "--step", "3", "--out", str(tmp_path / "c.stl")]) == 3
    assert "step 3 has no body to write, its status is 'no_equilibrium'" in capsys.readouterr().err
    assert not (tmp_path / "c.stl").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--step", "99"], "--step: expected a step from 1 to 11, got 99"),
        (["--step", "2", "--undeformed"], "expected no step together with --undeformed"),
        (["--holes", "bore"], "--holes: expected only together with --undeformed"),
        (["--out", "a.obj"], "a.obj: expected a file name that ends in .stl or .glb"),
        (["--facets", "4"], "facets: expected a number of facets from 8 to 2000, got 4"),
    ],
)
def test_what_the_command_cannot_do_is_one_line(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", str(ONE_SET), *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_study_without_shapes_is_refused_but_can_be_cast(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    sweep = str(ROOT / "scenarios" / "workspace" / "D25L60_grid.toml")
    assert main(["mesh", sweep]) == 2
    assert "study: expected 'forward', 'blocked-force', 'inverse'" in capsys.readouterr().err
    assert main(["mesh", sweep, "--undeformed"]) == 0
    assert (tmp_path / "D25L60_grid.stl").is_file()


@pytest.mark.parametrize("library", ["trimesh", "manifold3d"])
def test_without_the_extra_it_says_what_to_install(
    library: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    assert main(["mesh", str(ONE_SET), "--undeformed", "--out", str(tmp_path / "a.stl")]) == 2
    error = capsys.readouterr().err
    assert "pip install 'softnlp[mesh]'" in error
    assert error.count("\n") == 1


def test_the_document_s_examples_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenarios").symlink_to(ROOT / "scenarios")

    def run_commands(example: object) -> None:
        for line in str(example.parsed).splitlines():  # type: ignore[attr-defined]
            assert main(shlex.split(line)[1:]) == 0, line

    parsers = (PythonCodeBlockParser(), CodeBlockParser(language="bash", evaluator=run_commands))
    document = ROOT / "docs" / "mesh.md"
    examples = list(Document.parse(str(document), *parsers).examples())
    assert len(examples) == 2
    for example in examples:
        example.evaluate()
    assert {"bent.stl", "cast.stl", "mould.glb"} <= {path.name for path in (tmp_path / "results").iterdir()}
    shown = document.read_text().split("```text\n")[1].split("```")[0]
    assert shown in capsys.readouterr().out


def test_each_segment_is_a_watertight_solid_of_its_own() -> None:
    """At rest a cone has the volume of its frusta, and a piece behind a connector begins where that ends."""
    from softnlp import Segment, forward, material, segmented_robot
    from softnlp.figures.mesh.solid import segment_solids
    from softnlp.results import view_of_run

    base = robot("D25L60", length=30e-3)
    along = {"robot.outer_diameter": (25e-3, 23.8e-3)}
    made = segmented_robot([Segment(base, material("Ecoflex 00-50"), connector=3e-3),
                            Segment(base, material("Ecoflex 00-50"), along=along)])  # fmt: skip
    body = view_of_run(forward(made, made.material, np.zeros(6))).bodies[0]
    assert body is not None
    first, second = segment_solids(made, body, 96)
    polygon = 96 / (2 * np.pi) * np.sin(2 * np.pi / 96)  # area of one over that of its circle
    holes = np.pi * (4.5**2 + 6 * 2.25**2)
    assert first.volume == pytest.approx(30 * polygon * (np.pi * 12.5**2 - holes), rel=1e-6)
    frustum = np.pi / 3 * 30 * (12.5**2 + 12.5 * 11.9 + 11.9**2)
    assert second.volume == pytest.approx(polygon * (frustum - 30 * holes), rel=1e-6)
    assert second.vertices[:, 2].min() - first.vertices[:, 2].max() == pytest.approx(3, abs=1e-6)
    for solid in (first, second):
        edges = np.sort(solid.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        assert np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2)
