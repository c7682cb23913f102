"""Moulds: what they enclose is the body, every part is a closed solid that can be printed, drawn and taken apart."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from io import BytesIO
from math import hypot, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.cli import main
from softnlp.cli.mould import left_over
from softnlp.model.body import LinesName, Segment
from softnlp.model.materials import material
from softnlp.model.robot import ROBOTS, Robot, robot
from softnlp.model.segments import segmented_robot
from softnlp.mould import Moulds, MouldTable, Part, SegmentMould, bill, checks_of, moulds
from softnlp.mould.bill import pours
from softnlp.mould.checks import failed, first_balance, overlap, surface_distance, thinnest
from softnlp.mould.page import steps, steps_page
from softnlp.mould.picture import Drawn, camera, picture
from softnlp.mould.plates import tie_places, vent_angles
from softnlp.mould.shape import shapes_of
from softnlp.mould.sizes import settled
from softnlp.mould.solids import bounds, box, cylinder
from softnlp.mould.write import glb, stl, three_mf
from softnlp.scenario.describe import keys_of

trimesh = pytest.importorskip("trimesh")

COARSE = 4.0  # a pitch with few turns: what holds of them holds of more
QUICK = ("D25L40", "D10L40")


def chosen(name: str, **settings: object) -> Moulds:
    return moulds(robot(name), MouldTable(**{"thread_pitch_mm": COARSE, **settings}))


made = cache(chosen)


def taper() -> Robot:
    """Narrower towards the tip, with chambers that lean and have a waist."""
    along = {
        "robot.outer_diameter": (25e-3, 22e-3),
        "robot.lumen_diameter": (8e-3, 5e-3),
        "robot.chamber_circle_diameter": (17e-3, 14e-3),
        "robot.chamber_wall": {"s": (0, 0.5, 1), "value": (0.5e-3, 0.45e-3, 0.5e-3)},
    }
    return segmented_robot([Segment(robot("D25L60"), material("Ecoflex 00-50"), along=along)])


def two_segments(first: str = "D25L40", second: str = "D20L40", lines: LinesName = "slack") -> Robot:
    rubber = material("Ecoflex 00-50")
    below = Segment(robot(first), rubber, connector=3e-3, lines=lines)
    return segmented_robot([below, Segment(robot(second), rubber, turn=pi / 3)])


@pytest.mark.thorough
@pytest.mark.parametrize("name", QUICK)
def test_everything_that_is_measured_holds(name: str) -> None:
    checks = checks_of(made(name))
    assert not failed(checks)
    assert {check.name for check in checks} >= {
        *("closed solid", "thinnest wall", "largest side", "overlap in step 1", "overlap in step 2"),
        *("volume of the void", "distance of the void", "volume of the first void", "overlap when drawn"),
        "volume of the cap",
    }


@pytest.mark.parametrize("name", QUICK)
def test_the_void_is_the_body_of_the_model(name: str) -> None:
    """A_0 L_0 of the model, written out here."""
    r = ROBOTS[name]
    area = pi / 4 * (r.outer_diameter**2 - r.lumen_diameter**2 - r.chambers * r.chamber_diameter**2)
    assert made(name).segments[0].cast.volume() == pytest.approx(area * r.length / MILLIMETRE**3, rel=1e-3)


def test_a_thread_on_a_smooth_core_is_no_silicone() -> None:
    """It touches nothing there, and is taken out of the first pour nevertheless."""
    mould = chosen("D10L40", groove_depth_mm=0.0).segments[0]
    thread = sum(one.volume() for one in mould.threads)
    assert thread > 2e-3 * mould.first.volume()
    assert abs(first_balance(mould)) < 3e-4


def test_the_paper_s_two_kinds_of_cores() -> None:
    kinds = {name: settled(shapes_of(r)[0], MouldTable()).method for name, r in ROBOTS.items()}
    assert kinds == {name: "three-part" if r.outer_diameter > 14.9e-3 else "pin" for name, r in ROBOTS.items()}
    assert settled(shapes_of(ROBOTS["D25L60"])[0], MouldTable(core="pin")).method == "pin"


def test_the_thread_is_where_the_model_has_it() -> None:
    """Its middle is at r_co, and its length is that of a helix."""
    mould = made("D25L40").segments[0]
    core, r = mould.cores[0], ROBOTS["D25L40"]
    vertices = np.asarray(core.thread.to_mesh().vert_properties)[:, :3]
    rho = np.hypot(vertices[:, 0] - r.chamber_circle_radius / MILLIMETRE, vertices[:, 1])
    assert (rho.min() + rho.max()) / 2 == pytest.approx(r.chamber_radius / MILLIMETRE, abs=1e-5)
    low, high = mould.sizes.thread_ends
    turn = hypot(2 * pi * r.chamber_radius / MILLIMETRE, COARSE)
    assert mould.sizes.thread_length() == pytest.approx(6 * (high - low) / COARSE * turn, rel=1e-6)


def test_a_wall_an_overlap_and_a_wrong_void_are_found() -> None:
    plate = box((0, 10), (0, 10), (0, 5)) - box((1, 9), (1, 9), (0.6, 6))
    assert thinnest(plate) == pytest.approx(0.6, abs=1e-3)
    mould = made("D10L40").segments[0]
    shape = mould.sizes.shape
    moved = replace(mould, lumen=replace(mould.lumen, solid=mould.lumen.solid.translate((0.3, 0, 0))))
    assert overlap(moved, 2)[0] > 0.01
    assert surface_distance(mould.cast, shape) < 0.01
    assert surface_distance(mould.cast.translate((0.06, 0, 0)), shape) > 0.05
    assert surface_distance(mould.cast - cylinder(0.4, 1, 39, 4.4), shape) > 0.05


def test_a_mould_that_leaks_has_no_void() -> None:
    mould = made("D10L40").segments[0]
    base = mould.plates["base-2"]
    open_ = replace(base, solid=base.solid - cylinder(0.5, -20, 1, 4.4))
    assert replace(mould, plates={**mould.plates, "base-2": open_}).cast.is_empty()


def test_a_core_that_is_caught_is_found() -> None:
    """A grooved pin that is drawn straight takes the thread with it."""
    mould = made("D10L40").segments[0]
    core = mould.cores[0]
    straight = core.parts[0].solid.translate((0, 0, 1.1))
    assert (straight ^ core.thread).volume() > 0.01


def read_back(part: Part, suffix: str = "stl") -> Any:
    content = stl(part) if suffix == "stl" else three_mf(part)
    return trimesh.load(BytesIO(content), file_type=suffix, force="mesh")


@pytest.mark.parametrize("suffix", ["stl", "3mf"])
def test_files_of_D25L60_are_read_back_in_millimetres(suffix: str) -> None:
    """Every part with the settings of the package; sizes that the robot has are written out here."""
    pytest.importorskip("lxml" if suffix == "3mf" else "trimesh")
    found = made("D25L60", thread_pitch_mm=1.0)
    sides = {
        "lumen-rod": (9.0, 9.0, None),  # the lumen's diameter
        "liner-rod": (4.5, 4.5, None),  # of the bores
        "shell-1": (68.0, None, None),  # L_0 and 4 mm at either end, lying
        "shell-2": (68.0, None, None),
        "cap-tip": (31.0, 31.0, 18.0),  # D_r and 3 mm around it; floor 3, cap 5, guide 10
    }
    for part in found.parts:
        read = read_back(part, suffix)
        for got, wanted in zip(read.extents, sides.get(part.name, (None,) * 3), strict=True):
            assert wanted is None or got == pytest.approx(wanted, abs=6e-3), part.name
        low, high = bounds(part.printed)
        assert np.allclose(read.extents, high - low, atol=1e-3), part.name
        assert read.is_volume
        assert read.volume == pytest.approx(part.solid.volume(), rel=1e-4)
        assert read.bounds[0, 2] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("name", ["D25L40", "D10L40"])
def test_every_part_lies_flat_on_the_bed(name: str) -> None:
    """What faces the bed is on it: sides and keys by their cut faces, though these lean by the draft."""
    for part in made(name).parts:
        read = read_back(part)
        on_bed = np.abs(read.triangles[:, :, 2]).max(axis=1) < 2e-3
        assert read.area_faces[on_bed].sum() > 1.0, part.name
        if part.name.startswith(("core-side", "core-key")):
            facing = read.face_normals[:, 2] < np.cos(np.radians(170))
            assert read.area_faces[on_bed].sum() > 0.99 * read.area_faces[facing].sum(), part.name


def radii(part: Part, low: float, high: float, axis: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Return the distances of a read part's corners between two heights, assembled, from an upright axis [mm]."""
    read = read_back(replace(part, down=(0.0, 0.0, -1.0)))  # standing as it is assembled
    (x, y, _), lowest = bounds(part.solid).mean(axis=0), bounds(part.solid)[0, 2]
    at = np.add(read.vertices, (x, y, lowest))
    chosen = at[(at[:, 2] > low) & (at[:, 2] < high)]
    return np.hypot(chosen[:, 0] - axis[0], chosen[:, 1] - axis[1])


@pytest.mark.parametrize("c", [0.05, 0.1, 0.2])
def test_clearances_are_in_the_written_files(c: float) -> None:
    """Between lumen rod and base plate, plate and shell, tie rods' plates and shell: c in radius, in the STL."""
    found = chosen("D25L40", clearance_mm=c)
    parts = {part.name: part for part in found.parts}
    foot = radii(parts["lumen-rod"], -9.0, -0.5).max()
    plate = radii(parts["base-1"], -0.01, 0.01)
    assert plate.min() - foot == pytest.approx(c, abs=2e-3)
    recess = radii(parts["shell-1"], -4.01, -3.99)
    assert recess.min() - plate.max() == pytest.approx(c, abs=6e-3)


def test_draft_is_in_the_written_files() -> None:
    """Keys widen upwards by their draft on both sides, where there is room; without draft they do not."""
    for draft in (0.0, 0.3):
        key = next(part for part in chosen("D25L40", draft_deg=draft).parts if part.name == "core-key")
        at = read_back(replace(key, down=(0.0, 0.0, -1.0))).vertices
        height = np.ptp(at[:, 2])
        low, high = (np.ptp(at[np.abs(at[:, 2] - z) < 0.01][:, 1]) for z in (0.0, height))
        assert high - low == pytest.approx(2 * height * np.tan(np.radians(draft)), abs=2e-3)


def test_shrinkage_is_in_the_written_files() -> None:
    """Rods, shells and what they enclose are larger by 1/(1 - 0.02); clearances, walls and screws are not."""
    plain, larger = chosen("D25L40"), chosen("D25L40", shrinkage_percent=2.0)
    one, other = ({part.name: read_back(part).extents for part in m.parts} for m in (plain, larger))
    assert other["lumen-rod"][0] / one["lumen-rod"][0] == pytest.approx(1 / 0.98, rel=1e-4)
    assert other["liner-rod"][0] / one["liner-rod"][0] == pytest.approx(1 / 0.98, rel=1e-4)
    assert other["shell-1"][0] - one["shell-1"][0] == pytest.approx(40 / 0.98 - 40, abs=1e-3)
    volumes = [m.segments[0].cast.volume() for m in (plain, larger)]
    assert volumes[1] / volumes[0] == pytest.approx(0.98**-3, rel=1e-4)


def side(k: int) -> Callable[[SegmentMould, Part], float]:
    return lambda mould, part: float(read_back(part).extents[k])


def volume(mould: SegmentMould, part: Part) -> float:
    return part.solid.volume()


def tube_pin(mould: SegmentMould, part: Part) -> float:
    theta = float(robot("D25L40").chamber_angles()[0])
    return radii(part, 3.9, 4.1, (8.5 * np.cos(theta), 8.5 * np.sin(theta))).min()


def tie_hole(mould: SegmentMould, part: Part) -> float:
    return radii(part, -20.0, 0.0, tie_places(mould.sizes)[0]).min()


def lumen_foot(mould: SegmentMould, part: Part) -> float:
    return radii(part, -9.0, -0.5).max()


EFFECTS: list[tuple[str, float, str, Callable[[SegmentMould, Part], float], float | None]] = [
    ("wall_mm", 4.0, "shell-1", side(2), 1.0),
    ("flange_mm", 15.0, "shell-1", side(1), 6.0),
    ("plate_mm", 7.0, "base-1", side(2), 2.0),
    ("cap_mm", 6.5, "cap-tip", side(2), 1.5),
    ("tube_mm", 1.4, "cap-base", tube_pin, -0.3),
    ("screw_mm", 4.0, "base-1", tie_hole, 0.5),
    ("shoulder_mm", 0.5, "lumen-rod", lumen_foot, -0.3),
    ("gate_mm", 3.0, "shell-1", volume, None),
    ("vent_mm", 1.6, "top-1", volume, None),
    ("flange_thickness_mm", 6.0, "shell-1", volume, None),
    ("thread_diameter_mm", 0.3, "core-side-a", volume, None),
    ("thread_pitch_mm", 5.0, "core-side-a", volume, None),
    ("groove_depth_mm", 0.15, "core-side-a", volume, None),
]
"""A key, another value, the part and what of it changes, and by how much where that is known."""


@pytest.mark.parametrize(("key", "value", "name", "measure", "more"), EFFECTS)
def test_every_size_does_what_it_says(
    key: str, value: float, name: str, measure: Callable[[SegmentMould, Part], float], more: float | None
) -> None:
    before, after = (
        measure(m.segments[0], next(part for part in m.parts if part.name == name))
        for m in (made("D25L40"), chosen("D25L40", **{key: value}))
    )
    if more is None:
        assert abs(after - before) > 1e-3
    else:
        assert after - before == pytest.approx(more, abs=6e-3)


def test_the_assembly_is_one_coloured_glb() -> None:
    scene = trimesh.load(BytesIO(glb(made("D10L40"))), file_type="glb")
    names = set(scene.graph.nodes_geometry)
    assert {"step 1 shell-1", "step 1 core-pin 6", "thread 1 6", "step 2 liner-rod 1", "cap base", "cap tip"} <= names
    colours = {tuple(g.visual.material.baseColorFactor) for g in scene.geometry.values()}
    assert len(colours) >= 5
    assert scene.extents.max() < 1.0  # metres


REFUSED = [
    ("D25L40", {"groove_depth_mm": 3.0}, "groove_depth_mm", "deeper than the core"),
    ("D25L40", {"groove_depth_mm": 0.3}, "groove_depth_mm", "deeper than the thread"),
    ("D25L40", {"gate_mm": 9.0}, "gate_mm", "wider than the wall of silicone, 8 mm"),
    ("D10L40", {"tube_mm": 0.6}, "tube_mm", "less than minimum_wall_mm"),
    ("D10L40", {"shoulder_mm": 0.9}, "shoulder_mm", "less than minimum_wall_mm"),
    ("D10L40", {"core": "three-part"}, "core", "core = 'pin'"),
    ("D25L40", {"thread_pitch_mm": 0.5}, "thread_pitch_mm", "at least 1 mm"),
    ("D25L40", {"bed_mm": [50.0, 50.0, 50.0]}, "bed_mm", "do not fit"),
    ("D25L40", {"wall_mm": 0.5}, "wall_mm", "less than minimum_wall_mm"),
    ("D25L40", {"flange_mm": 4.0}, "flange_mm", "no room for screws"),
    ("D25L40", {"thread_diameter_mm": 1.2}, "thread_diameter_mm", "bare in the bore of chamber 1: there are 0.5 mm"),
    ("D25L40", {"gate_mm": 0.05}, "gate_mm", "less than minimum_wall_mm"),
    ("D25L40", {"vent_mm": 20.0}, "vent_mm", "expected vents of 0.3 to 4 mm"),
    ("D25L40", {"cap_mm": 0.05}, "cap_mm", "less than minimum_wall_mm"),
    ("D25L40", {"plate_mm": 0.2}, "plate_mm", "less than minimum_wall_mm"),
    ("D25L40", {"flange_thickness_mm": 0.3}, "flange_thickness_mm", "less than minimum_wall_mm"),
    ("D25L40", {"thread_pitch_mm": 25.0}, "thread_pitch_mm", "leaves no turn"),
    ("D25L40", {"thread_pitch_mm": 0.1, "groove_depth_mm": 0.0}, "thread_pitch_mm", "not more than the thread's"),
    ("D25L40", {"tube_mm": 6.0}, "tube_mm", "wider than the bores"),
    ("D25L40", {"plate_mm": 300.0}, "bed_mm", "do not fit"),
    ("D25L40", {"clearance_mm": 3.0}, "shoulder_mm", "thinner than nothing"),
]


@pytest.mark.parametrize(("name", "settings", "key", "words"), REFUSED)
def test_what_cannot_be_moulded_is_refused(name: str, settings: dict[str, object], key: str, words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        settled(shapes_of(robot(name))[0], MouldTable(**settings))
    assert (caught.value.table, caught.value.key) == ("mould", key)


def test_thin_rods_are_refused() -> None:
    thin = robot("D10L40", chamber_diameter=0.7e-3, chamber_wall=0.9e-3)
    with pytest.raises(InputError, match=r"second rod of chamber 1 would be 0\.7 mm thick"):
        settled(shapes_of(thin)[0], MouldTable())


def test_cores_that_could_not_be_drawn_are_refused() -> None:
    rubber = material("Ecoflex 00-50")
    bent = {"robot.chamber_circle_diameter": {"s": [0, 0.5, 1], "value": [17e-3, 16e-3, 17e-3]}}
    with pytest.raises(InputError, match=r"bends at s = 0\.5"):
        shapes_of(segmented_robot([Segment(robot("D25L40"), rubber, along=bent)]))
    waist = {"robot.lumen_diameter": (9e-3, 8e-3), "robot.chamber_diameter": (4e-3, 4.5e-3)}
    with pytest.raises(InputError, match="could not be drawn"):
        shapes_of(segmented_robot([Segment(robot("D25L40"), rubber, along=waist)]))


def test_a_body_that_narrows_is_cast_tip_down() -> None:
    shape = shapes_of(taper())[0]
    assert shape.flipped
    assert np.all(np.diff(shape.lumen) > 0)
    cones = [pi / 3 * 60e-3 * (a * a + a * b + b * b) / 4 for a, b in ((25e-3, 22e-3), (8e-3, 5e-3))]
    bores = 6 * pi * 2.25e-3**2 * 60e-3
    assert shape.volume() * MILLIMETRE**3 == pytest.approx(cones[0] - cones[1] - bores, rel=1e-9)
    assert settled(shape, MouldTable()).method == "three-part"  # their sides move in past the waist
    with pytest.raises(InputError, match="pin of chamber 1 could not be drawn"):
        settled(shape, MouldTable(core="pin"))


def test_segments_have_a_mould_each_and_a_connector() -> None:
    found = moulds(two_segments("laparoscope-3", "laparoscope-3", "bonded"), MouldTable(thread_pitch_mm=COARSE))
    names = {part.name for part in found.parts}
    assert {"segment-1-shell-1", "segment-2-shell-1", "connector-1", "segment-1-cap-base", "segment-2-cap-tip"} <= names
    assert "segment-1-cap-tip" not in names  # the connector closes it
    assert [len(segment.sizes.shape.holes) for segment in found.segments] == [6, 3]  # bonded lines are chambers
    (joint,) = found.connectors
    assert bounds(joint.solid)[1, 2] == pytest.approx(3.0)
    tube = found.segments[1].sizes.tube_hole
    assert joint.solid.volume() == pytest.approx(3 * pi * ((11.4**2 - 4.7**2) / 4 - 3 * tube**2), rel=2e-3)
    slack = moulds(two_segments("D25L40", "D20L40"), MouldTable(thread_pitch_mm=COARSE)).connectors[0].solid
    assert slack.volume() < 3 * pi * ((25**2 + 25 * 20 + 20**2) / 12 - 3.6**2 - 6)  # slots lead to the lumen


def test_the_bill_adds_up() -> None:
    found = made("D10L40")
    rows = bill(found)
    silicone = {row["item"]: row for row in rows if row["kind"] == "silicone"}
    mould = found.segments[0]
    thread = sum(one.volume() for one in mould.threads)
    sprues = sum(s.volume() for s in (*mould.sprues[0], mould.sprues[1][1]))
    poured = silicone["first pour, body"]["amount"] + silicone["second pour, liners"]["amount"]
    assert 1000 * poured == pytest.approx(mould.cast.volume() - thread + sprues, rel=1e-3)
    assert silicone["first pour, body"]["with_waste"] == pytest.approx(
        1.2 * silicone["first pour, body"]["amount"], rel=1e-3
    )
    screws = {row["item"]: row["count"] for row in rows if row["kind"] == "screw"}
    assert screws["nut"] == screws["clamping screw"] + 2 * screws["tie rod or screw"]
    assert {row["count"] for row in rows if row["item"] == "core-pin"} == {6}


def test_shrinkage_makes_moulds_larger() -> None:
    larger = shapes_of(robot("D25L40"), 1.0)[0]
    assert larger.length == pytest.approx(40 / 0.99)
    assert larger.volume() == pytest.approx(shapes_of(robot("D25L40"))[0].volume() / 0.99**3)


def test_what_is_nearer_hides_what_is_behind() -> None:
    """Of two plates seen from above the upper one is seen, beside it the lower one, and around them nothing."""
    low = Drawn.of(box((-10, 10), (-10, 10), (0, 1)), (1.0, 0.0, 0.0))
    high = Drawn.of(box((-5, 5), (-5, 5), (4, 5)), (0.0, 0.0, 1.0))
    for things in ([low, high], [high, low]):
        image = picture(things, 100, 100, camera(0.0, 90.0)).astype(int)
        middle, edge, corner = image[50, 50], image[50, 10], image[1, 1]
        assert middle[2] > 100
        assert middle[0] == 0
        assert edge[0] > 100
        assert edge[2] == 0
        assert np.all(corner == 255)


def test_vents_are_between_chambers() -> None:
    shape = shapes_of(robot("D25L40"))[0]
    for angle in vent_angles(shape):
        assert min(abs(np.angle(np.exp(1j * (angle - hole.angle)))) for hole in shape.holes) > np.radians(20)


def test_amounts_of_silicone_are_those_of_the_robot() -> None:
    """Computed from the robot's own numbers: areas times length, a thread of which half is outside its circle."""
    r, mould = robot("D25L40"), made("D25L40").segments[0]
    L, outer, lumen = (1e3 * x for x in (r.length, r.outer_diameter, r.lumen_diameter))
    rco, bore = 1e3 * r.chamber_radius, 1e3 * r.bore_radius
    liner = pi * (rco**2 - bore**2) * L
    assert [mould.sizes.shape.liner(hole) for hole in mould.sizes.shape.holes] == pytest.approx([liner] * 6)
    turns = (L - COARSE) / COARSE  # half a pitch is left at either end
    thread = 6 * turns * hypot(2 * pi * rco, COARSE) * 0.1**2 * 1.5 * 3**0.5  # a hexagon of 0.2 mm across
    amounts = pours(mould)
    gate, vents = (s.volume() for s in mould.sprues[0])
    assert gate == pytest.approx(pi * 2.0**2 * (mould.sizes.flange + 1.0 - outer / 2), rel=0.1)  # to beyond the flange
    ring = mould.sprues[1][1].volume()
    total = pi / 4 * (outer**2 - lumen**2) * L - 6 * pi * bore**2 * L
    poured = amounts["first pour, body"] + amounts["second pour, liners"]
    assert poured - gate - vents - ring == pytest.approx(total - thread, rel=1e-3)
    # keys are lower than the thread's circle, so a little of what liners are is cast before
    body = pi / 4 * (outer**2 - lumen**2) * L - 6 * pi * rco**2 * L - thread / 2
    assert 0 < amounts["first pour, body"] - gate - vents - body < 0.1 * 6 * liner
    assert amounts["tip cap"] == pytest.approx(5.0 * pi / 4 * (outer**2 - lumen**2))


def test_the_page_of_steps_has_amounts_and_ends_in_order() -> None:
    mould = made("D25L40").segments[0]
    text = {step.title: " ".join(step.text) for step in steps(mould, " Sets.")}
    assert list(text) == [
        *("Print the parts", "Wind the thread on 6 cores", "Put the first mould together", "First pour: the body"),
        *("Draw the cores", "Second pour: the liners", "Take out the body", "The body as cast"),
        *("The base cap", "The tip cap"),
    ]
    assert "16 cm in 9 turns" in text["Wind the thread on 6 cores"]
    amount = pours(mould)["first pour, body"] / 1000
    assert f"Mix and degas {1.2 * amount:.1f} ml of silicone; the mould takes {amount:.1f} ml" in str(text)
    assert "each chamber 0.31 ml, about 13 mm high" in text["Second pour: the liners"]  # a third of 40 mm
    assert "Prepare 2.6 ml of a harder silicone and pour 2.1 ml" in text["The tip cap"]
    assert "the gate lies between chambers 2 and 3" in text["Take out the body"]
    assert "in a drill" in text["Wind the thread on 6 cores"]


def test_sockets_of_liner_rods_let_silicone_out() -> None:
    """Below the rod there is a way to the open, which the rod itself closes."""
    mould = made("D25L40").segments[0]
    sizes, hole = mould.sizes, mould.sizes.shape.holes[0]
    x, y = float(hole.circle[0]) * np.cos(hole.angle), float(hole.circle[0]) * np.sin(hole.angle)
    way = cylinder(0.4, -sizes.stand - 1.0, -sizes.socket + 1.0, x, y)
    assert (way ^ mould.plates["base-2"].solid).volume() < 1e-9
    assert (way ^ mould.plates["base-1"].solid).volume() > 0.3
    assert mould.cast.volume() > 0  # closed nevertheless


def test_the_page_of_moulds_has_every_key() -> None:
    text = (Path(__file__).parents[1] / "docs" / "mould.md").read_text()
    for key in keys_of(MouldTable):
        (row,) = (line for line in text.splitlines() if line.startswith(f"| `{key.name}` |"))
        _, _, unit, default, *_ = (cell.strip().strip("`") for cell in row.split("|"))
        assert (unit, default) == (key.unit, key.default), key.name


SCENARIO = """study = "forward"
[robot]
name = "D10L40"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[pressure]
sequence_bar = [[0.0, 0.0, 0.0]]
[mould]
thread_pitch_mm = 8.0
"""


def scenario_file(folder: Path, text: str = SCENARIO) -> Path:
    path = folder / "small.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("gate_mm = 5.0", "[mould] gate_mm: a gate of 5 mm is wider"),
        ("gate = 5.0", "[mould] gate: unknown key; did you mean 'gate_mm'?"),
        ('shell_parts = "2"', "[mould] shell_parts: expected"),
        ("clearance_mm = -1.0", "[mould] clearance_mm: expected"),
    ],
)
def test_bad_moulds_are_one_line_and_write_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str, words: str
) -> None:
    path = scenario_file(tmp_path, f"{SCENARIO}{line}\n")
    assert main(["mould", str(path), "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert not out
    assert len(err.splitlines()) == 1
    assert words in err
    assert not (tmp_path / "out").exists()


def test_the_page_says_which_set_and_silicone_of_each_segment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sets count on through the segments, as in a scenario."""
    monkeypatch.setattr("softnlp.mould.page._step", lambda n, step: " ".join(step.text))  # without pictures
    monkeypatch.setattr("softnlp.mould.page.pours", lambda mould: defaultdict(lambda: 1.0))
    below = Segment(robot("laparoscope-3"), material("Ecoflex 00-50"), connector=3e-3, lines="bonded")
    above = Segment(robot("laparoscope-3"), material("Ecoflex 00-30"), turn=pi / 3)
    both = segmented_robot([below, above])
    page = steps_page("Two", moulds(both, MouldTable(thread_pitch_mm=COARSE)), [], [])
    first, second = page.split("<h2>Segment 2")
    assert "Segment 1, of Ecoflex 00-50" in first
    assert ", of Ecoflex 00-30" in second
    assert "set 1 has 1; set 2 has 2; set 3 has 3. Chambers 4 to 6 are the lines" in first
    assert "set 4 has 1; set 5 has 2; set 6 has 3. Cut gate" in second


def test_parts_of_earlier_moulds_in_the_folder_are_told(tmp_path: Path) -> None:
    """Three parts of a shell before, two now: the third would be printed in vain."""
    for file in ("small-shell-2.stl", "small-shell-3.stl", "small-shell-3.3mf", "other-shell-3.stl", "small-notes.txt"):
        (tmp_path / file).touch()
    assert left_over(tmp_path, "small", {"small-shell-2.stl"}) == ["small-shell-3.3mf", "small-shell-3.stl"]


@pytest.mark.thorough
def test_the_command_writes_every_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = scenario_file(tmp_path), tmp_path / "out"
    out.mkdir()
    (out / "small-shell-3.stl").touch()
    assert main(["mould", str(path), "--out", str(out)]) == 0
    names = {file.name for file in out.iterdir()}
    assert {"small-shell-1.stl", "small-shell-1.3mf", "small-assembly.glb", "small-steps.html"} <= names
    kept = json.loads((out / "small-bill.json").read_text())
    assert kept["settings"]["thread_pitch_mm"] == 8.0
    assert {check["verdict"] for check in kept["checks"]} == {"holds"}
    page = (out / "small-steps.html").read_text()
    assert page.count("data:image/png") >= 9
    assert "http" not in page
    assert "core-pin" in (out / "small-bill.csv").read_text()
    told = capsys.readouterr().out
    assert "moulds in" in told
    assert "files of earlier moulds too, which do not belong to these: small-shell-3.stl" in told


def test_a_finished_design_is_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "design.json").write_text("{}")
    assert main(["mould", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "no feasible candidate" in capsys.readouterr().err
    (tmp_path / "best.toml").write_text(SCENARIO + "gate_mm = 5.0\n")
    assert main(["mould", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "best.toml: [mould] gate_mm" in capsys.readouterr().err


DESIGN = """title = "length"
study = "design"
[robot]
name = "laparoscope-3"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[choices]
robot.length_mm = [40.0, 45.0]
[actuation]
sets = [1]
pressure_bar = 0.3
[requirements]
{limit}
[objective]
maximise = "bending_angle_deg"
[mould]
thread_pitch_mm = 8.0
"""


def design_file(folder: Path, limit: str = "") -> Path:
    path = folder / "length.toml"
    path.write_text(DESIGN.format(limit=limit))
    return path


def shell_height(folder: Path, name: str) -> float:
    return float(trimesh.load(folder / f"{name}-shell-1.stl").extents[0])


@pytest.mark.slow
def test_the_best_of_a_design_study_s_folder_is_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The longer of two robots bends more: the study says so, and the moulds of its folder are of that one."""
    study, out = tmp_path / "study", tmp_path / "out"
    assert main(["design", str(design_file(tmp_path)), "--out", str(study)]) == 0
    best = json.loads((study / "design.json").read_text())["best"]
    assert best["robot"]["length_mm"] == 45.0
    assert main(["mould", str(study), "--out", str(out)]) == 0
    assert shell_height(out, "study") == pytest.approx(45.0 + 8.0, abs=1e-3)
    kept = json.loads((out / "study-bill.json").read_text())
    assert kept["settings"]["thread_pitch_mm"] == 8.0  # the design's own [mould]
    assert "45 mm" in kept["title"]
    assert "laparoscope-3" in capsys.readouterr().out


@pytest.mark.slow
def test_a_design_is_found_and_made_in_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = design_file(tmp_path, "tip_x_mm = { at_least = -100.0 }"), tmp_path / "out"
    assert main(["mould", str(path), "--design", "--out", str(out)]) == 0
    assert shell_height(out, "length") == pytest.approx(45.0 + 8.0, abs=1e-3)
    assert "checks hold" in capsys.readouterr().out


def test_a_design_without_a_feasible_candidate_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = design_file(tmp_path, "bending_angle_deg = { at_least = 179.0 }"), tmp_path / "out"
    assert main(["mould", str(path), "--design", "--out", str(out)]) == 3
    assert "no feasible candidate" in capsys.readouterr().err
    assert not out.exists()


def test_design_asks_for_a_design_study(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["mould", str(scenario_file(tmp_path)), "--design", "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "study: --design takes 'design', got 'forward'" in line


EVERY = {**{name: partial(robot, name) for name in ROBOTS}, "taper": taper, "two segments": two_segments}


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_every_robot_s_moulds_hold(name: str) -> None:
    assert not failed(checks_of(moulds(EVERY[name]())))


@pytest.mark.slow
def test_three_part_shells_and_smooth_cores_hold() -> None:
    assert not failed(checks_of(chosen("D25L40", shell_parts=3, groove_depth_mm=0.0)))
    assert not failed(checks_of(chosen("D10L40", shell_parts=3, groove_depth_mm=0.0, shrinkage_percent=0.5)))
