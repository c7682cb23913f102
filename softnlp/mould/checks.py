"""What must hold of moulds, measured on the solids that are written: each a number beside its limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.figures.mesh.rings import circle
from softnlp.mould.assembly import Moulds, SegmentMould
from softnlp.mould.cap import cap_volume, end_index, finished
from softnlp.mould.cores import Core, axis_of, moved_in, screw_angle
from softnlp.mould.parts import Part
from softnlp.mould.shape import Shape
from softnlp.mould.sizes import Sizes
from softnlp.mould.solids import bounds, box, cylinder, mesh_of, turned, union, without
from softnlp.mould.write import stl

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

VOLUME, DISTANCE, OVERLAP = 1e-3, 0.05, 0.01
"""Largest relative error of the void's volume, its distance from the body [mm], and overlap of two parts [mm^3]."""
_FACING = -0.97  # of two normals: faces of one wall look away from each other within 14 degrees
_RAYS, _ROUND_OFF = 700, 2e-3
_SAME_FACETS = 12  # parts of a turn after which the facets of core and thread are where they were
_EFFORT = {"overlap in step 1": 14.0, "volume of the void": 7.0, "volume of the first void": 45.0}
_EFFORT_OF_PART, _EFFORT_OF_SEGMENT = 1.0, 105.0  # about the time that checks take, of which progress is told
_OFFSETS = (0.002, 0.02, 0.11, 0.37, 0.83)  # of the length, by which parts are drawn


@dataclass(frozen=True)
class Check:
    """One number that was measured. verdict : "holds" or "fails". limit : what it is held against, with its sign."""

    name: str
    part: str
    value: float
    limit: str
    unit: str
    holds: bool

    @property
    def verdict(self) -> str:
        """In one word."""
        return "holds" if self.holds else "fails"


def checks_of(
    moulds: Moulds, told: Callable[[float, float, str], None] = lambda done, total, text: None
) -> list[Check]:
    """Return every check of a robot's moulds. told : called after each with what is done, of how much, and its name."""
    found, done = list[Check](), 0.0
    total = _EFFORT_OF_PART * len(moulds.parts) + _EFFORT_OF_SEGMENT * len(moulds.segments)
    for part in moulds.parts:
        found += _of_part(part, moulds)
        done += _EFFORT_OF_PART
        told(done, total, f"{part.name} measured")
    for segment in moulds.segments:
        end = done + _EFFORT_OF_SEGMENT
        for check in _of_segment(segment):
            found.append(check)
            done = min(done + _EFFORT.get(check.name, 2.0), end)
            told(done, total, f"{check.name} measured")
        done = end
    return found


def _of_part(part: Part, moulds: Moulds) -> Iterator[Check]:
    """Yield whether a part is a closed solid as its file has it, how thin it is, and whether it fits the bed."""
    trimesh: Any = import_module("trimesh")  # of the extra mesh, which was asked for by now
    read = trimesh.load(BytesIO(stl(part)), file_type="stl")
    whole = bool(read.is_watertight and read.is_volume)
    yield Check("closed solid", part.name, float(whole), "= 1", "", whole)
    least = moulds.settings.minimum_wall_mm
    wall = thinnest(part.solid)
    yield Check("thinnest wall", part.name, wall, f">= {least:g}", "mm", wall >= least - _ROUND_OFF)
    low, high = bounds(part.printed)
    size, bed = high - low, moulds.settings.bed_mm
    fits = bool(np.all(np.sort(size[:2]) <= np.sort(bed[:2])) and size[2] <= bed[2])
    yield Check("largest side", part.name, float(size.max()), f"bed {bed[0]:g} x {bed[1]:g} x {bed[2]:g}", "mm", fits)


def thinnest(part: Manifold) -> float:
    """Return the least distance through a part between faces that look away from each other [mm].

    From points spread over the surface by area, and from the middle of every large face, a ray goes inwards.
    """
    vertices, faces = mesh_of(part)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    random = np.random.default_rng(1)
    chosen = random.choice(len(faces), _RAYS, p=area / area.sum())
    large = np.flatnonzero(area > 0.02)
    some = random.choice(large, min(len(large), _RAYS), replace=False) if len(large) else large
    at = np.concatenate([chosen, some])
    weights = np.concatenate([random.dirichlet((1, 1, 1), len(chosen)), np.full((len(some), 3), 1 / 3)])
    points = np.einsum("ij,ijk->ik", weights, corners[at])
    inwards = -normal[at] / (2 * area[at, None])
    least = np.inf
    for p, n in zip(points + 1e-4 * inwards, inwards, strict=True):
        hits = part.ray_cast(tuple(p), tuple(p + 50.0 * n))
        if hits and np.dot(hits[0].normal, -n) < _FACING:
            least = min(least, float(np.linalg.norm(np.subtract(hits[0].position, p))) + 1e-4)
    return least


def _of_segment(mould: SegmentMould) -> Iterator[Check]:
    sizes, name = mould.sizes, mould.prefix.rstrip("-") or "body"
    for number in (1, 2):
        worst, pair = overlap(mould, number)
        yield Check(f"overlap in step {number}", f"{name}: {pair}", worst, f"<= {OVERLAP:g}", "mm^3", worst <= OVERLAP)
    exact = sizes.shape.volume()
    error = mould.cast.volume() / exact - 1
    yield Check("volume of the void", name, 100 * error, f"+- {100 * VOLUME:g}", "%", abs(error) <= VOLUME)
    apart = surface_distance(mould.cast, sizes.shape)
    yield Check("distance of the void", name, apart, f"<= {DISTANCE:g}", "mm", apart <= DISTANCE)
    balance = first_balance(mould)
    yield Check("volume of the first void", name, 100 * balance, f"+- {100 * VOLUME:g}", "%", abs(balance) <= VOLUME)
    for core in mould.cores:
        for part, worst in drawn(mould, core):
            yield Check(
                "overlap when drawn", f"{mould.prefix}{part}", worst, f"<= {OVERLAP:g}", "mm^3", worst <= OVERLAP
            )
    for part, worst in parted(mould):
        yield Check("overlap when drawn", f"{mould.prefix}{part}", worst, f"<= {OVERLAP:g}", "mm^3", worst <= OVERLAP)
    for end, cup in mould.caps.items():
        error = cap_void(sizes, end, cup.solid) / cap_volume(sizes, end) - 1
        yield Check("volume of the cap", f"{mould.prefix}cap-{end}", 100 * error, "+- 0.1", "%", abs(error) <= VOLUME)


def overlap(mould: SegmentMould, number: int) -> tuple[float, str]:
    """Return the largest volume that two parts of an assembly share [mm^3], and which; threads are parts of the first.

    Of parts that are there several times the first one stands for all against every other one.
    """
    every = [(part.name, part.every) for part in mould.step(number)]
    if number == 1:
        every += [("thread", [turned(core.thread, turn) for turn in core.turns]) for core in mould.cores]
    worst, pair = 0.0, "none"
    pairs = [(a, solids[0], b, others) for (a, solids), (b, others) in combinations(every, 2)]
    pairs += [(a, solids[0], a, solids[1:]) for a, solids in every if len(solids) > 1]
    for a, solid, b, others in pairs:
        near = [other for other in others if _near(solid, other)]
        if near:
            shared = float((solid ^ union(near)).volume())
            if shared > worst:
                worst, pair = shared, f"{a}, {b}"
    return worst, pair


def _near(a: Manifold, b: Manifold) -> bool:
    (low, high), (down, up) = bounds(a), bounds(b)
    return bool(np.all(low < up - 1e-9) and np.all(down < high - 1e-9))


def first_balance(mould: SegmentMould) -> float:
    """Return what is missing in the first step, relative to the body.

    Silicone, thread and cores between the plates together are all that is between lumen and surface.
    """
    shape = mould.sizes.shape
    around = 2 * float(shape.outer.max())
    slab = box((-around, around), (-around, around), (0.0, shape.length))
    cores = sum(len(core.turns) * float((part.solid ^ slab).volume()) for core in mould.cores for part in core.parts)
    thread = sum(len(core.turns) * float(core.thread.volume()) for core in mould.cores)
    bare = Shape(shape.z, shape.outer, shape.lumen, ()).volume()
    return (float(mould.first.volume()) + thread + cores - bare) / shape.volume()


def surface_distance(void: Manifold, shape: Shape) -> float:
    """Return the largest distance between the surface of a void and that of the body [mm], both ways.

    Horizontal sections are compared with the exact circles, and the ends with their planes.
    """
    (_, _, low), (_, _, high) = bounds(void)
    worst = max(abs(low), abs(high - shape.length))
    for z in shape.length * np.array([0.0005, 0.13, 0.35, 0.5, 0.65, 0.87, 0.9995]):
        exact = [(0.0, 0.0, np.interp(z, shape.z, shape.outer)), (0.0, 0.0, np.interp(z, shape.z, shape.lumen))]
        for hole in shape.holes:
            rho = np.interp(z, shape.z, hole.circle)
            exact.append((rho * np.cos(hole.angle), rho * np.sin(hole.angle), np.interp(z, shape.z, hole.bore)))
        worst = max(worst, _section_distance(void.slice(float(z)), np.array(exact)))
    return float(worst)


def _section_distance(section: CrossSection, exact: Array) -> float:
    """Return the distance both ways between outlines and circles; exact : (n, 3) x, y, r."""
    loops = [np.asarray(loop, float) for loop in section.to_polygons()]
    loops = [loop for loop in loops if abs(_area(loop)) > 1e-3]
    if not loops:
        return float("inf")
    a = np.concatenate(loops)
    b = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    middle = np.concatenate([a, (a + b) / 2])
    off = np.abs(np.linalg.norm(middle[:, None] - exact[None, :, :2], axis=2) - exact[:, 2])
    there = float(off.min(axis=1).max())
    points = np.concatenate([(x, y) + r * circle(64) for x, y, r in exact])
    along = b - a
    t = np.einsum("ijk,jk->ij", points[:, None] - a, along) / np.maximum(np.einsum("jk,jk->j", along, along), 1e-30)
    nearest = a + np.clip(t, 0, 1)[..., None] * along
    back = float(np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1).max())
    return max(there, back)


def _area(loop: Array) -> float:
    x, y = loop.T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def drawn(mould: SegmentMould, core: Core) -> Iterator[tuple[str, float]]:
    """Yield each part of a core, in the order in which they are drawn, with what it shares with others on its way.

    In the way are the silicone around the first of these chambers, the thread, the parts not drawn yet and the base
    plate; the top plate is off. A key goes along the chamber; a side moves off the thread first; a grooved pin turns by
    its pitch. The second rod goes through the finished bore.
    """
    sizes, L = mould.sizes, mould.sizes.shape.length
    axis, hole = axis_of(sizes, core.hole), core.hole
    reach = float(hole.core.max()) + 1.0
    x = (float(hole.circle.min()) - reach, float(hole.circle.max()) + reach)
    near = box(x, (-reach, reach), (-sizes.stand - 1.0, L + 1.0))
    bases = [turned(mould.plates[name].solid, -core.turns[0]) ^ near for name in ("base-1", "base-2")]
    standing = [turned(mould.first, -core.turns[0]) ^ near, core.thread, bases[0]]
    left, step = list(core.parts), sizes.settings.thread_pitch_mm / _SAME_FACETS
    for part in core.parts:
        left.remove(part)
        obstacles = [*standing, *(other.solid for other in left)]  # not as one: faces that touch would leave hairs
        shift = moved_in(sizes, part)
        worst = 0.0
        for off in (0.0, *(L * share for share in _OFFSETS)) if any(shift) else [L * share for share in _OFFSETS]:
            solid = part.solid.translate(shift)
            if sizes.method == "pin" and sizes.depth > 0:
                middle = (float(hole.circle[0]), 0.0, 0.0)
                solid = solid.translate(tuple(-c for c in middle))
                off = step * max(round(off / step), 1)
                solid = turned(solid, screw_angle(sizes, off)).translate(middle)
            moved = solid.translate(tuple(float(off * c) for c in axis))
            worst = max(worst, sum(float((moved ^ obstacle).volume()) for obstacle in obstacles))
        yield part.name, worst
    around = [turned(mould.cast, -core.turns[0]) ^ near, bases[1]]
    moves = [core.rod.solid.translate(tuple(float(L * share * c) for c in axis)) for share in _OFFSETS]
    yield core.rod.name, max(sum(float((solid ^ one).volume()) for one in around) for solid in moves)


def parted(mould: SegmentMould) -> Iterator[tuple[str, float]]:
    """Yield lumen rod, shell and plates with what each shares with the body, or with rods, as it is taken off."""
    L, body = mould.sizes.shape.length, mould.cast
    moves = [mould.lumen.solid.translate((0.0, 0.0, L * share)) for share in _OFFSETS]
    yield mould.lumen.name, max(float((solid ^ body).volume()) for solid in moves)
    for part in mould.shells:
        x, y, _ = part.down
        moves = [part.solid.translate((x * off, y * off, 0.0)) for off in (0.05, 2.0, 12.0)]
        others = union([body, *(other.solid for other in mould.shells if other is not part)])
        yield part.name, max(float((solid ^ others).volume()) for solid in moves)
    for name, plate in mould.plates.items():
        up = 1.0 if name.startswith("top") else -1.0
        step = mould.step(int(name[-1]))
        # Cores and second rods are drawn before a base plate is taken off, but after a top plate.
        there = ("rod", "core", "key") if up > 0 else ()
        rods = [one for part in step if part.kind in there for one in part.every]
        obstacles = union([*rods, *(part.solid for part in mould.shells), body])
        moves = [plate.solid.translate((0.0, 0.0, up * off)) for off in (0.05, 4.0)]
        yield plate.name, max(float((solid ^ obstacles).volume()) for solid in moves)


def cap_void(sizes: Sizes, end: str, cup: Manifold) -> float:
    """Return the volume that a cup leaves below the body that stands in it [mm^3]."""
    R, r = (float(x[end_index(sizes.shape, end)]) for x in (sizes.shape.outer, sizes.shape.lumen))
    body = finished(sizes, end)
    thick = R + 10.0
    block = box((-thick, thick), (-thick, thick), (-sizes.settings.cap_mm - 10.0, 0.0))
    inside = cylinder(R, -sizes.settings.cap_mm - 1.0, 0.0, sides=192)
    rest = without(block, [cup, body]) ^ inside
    return float(sum(one.volume() for one in rest.decompose() if bounds(one)[1, 2] > -1e-6)) if r > 0 else 0.0


_LIMITS = {
    "closed solid": "Every part is a closed solid: {count} of {count}",
    "thinnest wall": "The thinnest wall is {value:.2f} mm, of {part}; at least {least:g} mm",
    "largest side": "Every part fits the bed: the longest side is {value:.1f} mm, of {part}",
    "overlap in step 1": "In the first mould parts overlap by at most {value:.2g} mm³; at most {overlap:g} mm³",
    "overlap in step 2": "In the second mould parts overlap by at most {value:.2g} mm³; at most {overlap:g} mm³",
    "volume of the void": "What the moulds enclose has the body's volume to {size:.3f} %; within {volume:g} %",
    "distance of the void": "Its surface is at most {value:.4f} mm from the body's; at most {distance:g} mm",
    "volume of the first void": "Silicone, thread and cores fill the first mould to {size:.3f} %; within {volume:g} %",
    "overlap when drawn": "Cores, rods, plates and shells come off: on their way they meet {value:.2g} mm³ at most; "
    "at most {overlap:g} mm³",
    "volume of the cap": "Cups hold the caps' volume to {size:.3f} %; within {volume:g} %",
}


def in_words(checks: list[Check], least: float) -> list[str]:
    """Return a sentence for each kind of check, of the worst of it. least : the minimum wall [mm]."""
    found = []
    for name, words in _LIMITS.items():
        own = [check for check in checks if check.name == name]
        if own:
            worst = min(own, key=lambda c: c.value) if "wall" in name else max(own, key=lambda c: abs(c.value))
            limits = {"least": least, "overlap": OVERLAP, "volume": 100 * VOLUME, "distance": DISTANCE}
            told = words.format(count=len(own), value=worst.value, size=abs(worst.value), part=worst.part, **limits)
            found.append(f"{told}.")
    return found


def failed(checks: list[Check]) -> list[Check]:
    """Return those that do not hold."""
    return [check for check in checks if not check.holds]


def document(checks: list[Check]) -> list[dict[str, Any]]:
    """Return checks as rows of a JSON document."""
    return [
        {"name": c.name, "part": c.part, "value": c.value, "limit": c.limit, "unit": c.unit, "verdict": c.verdict}
        for c in checks
    ]
