"""What the pictures of the steps show: the parts of each step, exploded or cut open, and one core with its thread."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from softnlp.mould.assembly import SegmentMould
from softnlp.mould.cap import GUIDE, finished
from softnlp.mould.cores import Core
from softnlp.mould.parts import Part
from softnlp.mould.picture import Drawn, camera, picture
from softnlp.mould.solids import bounds, box, turned
from softnlp.mould.write import COLOURS

if TYPE_CHECKING:
    from manifold3d import Manifold
    from numpy.typing import NDArray

    Image = NDArray[np.uint8]

SILICONE = (0.93, 0.88, 0.80)
LINER = (0.95, 0.72, 0.72)
CUT = (0.85, 0.25, 0.20)


def core_scene(mould: SegmentMould, core: Core) -> Image:
    """Draw one core as it is wound, and its parts beside it."""
    wide = 4.0 * float(core.hole.core.max()) + 3.0
    x = float(core.hole.circle.min())
    things, across = [], wide
    shift = (-x, 0.0, 0.0)
    for part in core.parts:
        things.append(Drawn.of(part.solid.translate(shift), COLOURS[part.kind]))
        if len(core.parts) > 1:
            alone = part.solid.translate((across - x, 0.0, 0.0))
            things.append(Drawn.of(alone, COLOURS[part.kind]))
            across += wide
    things.append(Drawn.of(core.thread.translate(shift), (0.1, 0.1, 0.1)))
    things.append(Drawn.of(core.rod.solid.translate((across - x, 0.0, 0.0)), COLOURS["rod"]))
    return picture(things, 300, 460, camera(8.0, 14.0))


def exploded(mould: SegmentMould, number: int) -> Image:
    """Draw the parts of a step apart from each other."""
    things = []
    for part in mould.step(number):
        for turn in part.turns:
            turned_by = np.radians(turn)
            way = np.array([[np.cos(turned_by), -np.sin(turned_by)], [np.sin(turned_by), np.cos(turned_by)]])
            *aside, lift = apart_in_picture(part)
            x, y = way @ np.array(aside)
            things.append(Drawn.of(turned(part.solid, turn).translate((x, y, lift)), COLOURS[part.kind]))
    return picture(things, 390, 580, _side(mould))


def apart_in_picture(part: Part) -> tuple[float, float, float]:
    """Return where a part goes in a picture that has no room for all the way out [mm]."""
    x, y, lift = part.apart
    return x, y, lift * (1.0 if part.kind == "plate" else 0.55)


def _side(mould: SegmentMould) -> np.ndarray:
    return camera(float(np.degrees(mould.sizes.lead)) + 62.0, 24.0)


def open_shell(mould: SegmentMould, number: int, silicone: bool) -> Image:
    """Draw a step assembled, without the first part of the shell; silicone : with what is cast, cut open there."""
    parts = [part for part in mould.step(number) if part is not mould.shells[0]]
    things = [Drawn.of(one, COLOURS[part.kind]) for part in parts for one in part.every]
    if silicone:
        things.append(Drawn.of(_half(mould, mould.cast), SILICONE if number == 1 else LINER))
    return picture(things, 390, 480, _front(mould))


def _front(mould: SegmentMould) -> np.ndarray:
    """Return the view into a shell without its first part."""
    x, y, _ = mould.shells[0].down
    return camera(float(np.degrees(np.arctan2(y, x))) + 108.0, 20.0)


def draw_scene(mould: SegmentMould) -> Image:
    """Draw how the first core is drawn: shell and silicone cut open, the top plate off, key or pin on its way out."""
    things = []
    for part in mould.step(1):
        if part is mould.shells[0] or part.name == "top-1":
            continue
        rise = 0.55 * mould.sizes.shape.length if part is mould.cores[0].parts[0] else 0.0
        for n, one in enumerate(part.every):
            things.append(Drawn.of(one.translate((0.0, 0.0, rise if n == 0 else 0.0)), COLOURS[part.kind]))
    things.append(Drawn.of(_half(mould, mould.first), SILICONE))
    return picture(things, 390, 480, _front(mould))


def sprue_scene(mould: SegmentMould) -> Image:
    """Draw the body as it comes out of the shell, with what is cut off: gate and ring, in red."""
    gate, ring = mould.sprues[1]
    things = [Drawn.of(mould.cast, SILICONE), Drawn.of(gate, CUT), Drawn.of(ring, CUT)]
    return picture(things, 390, 420, _side(mould))


def _half(mould: SegmentMould, solid: Manifold) -> Manifold:
    """Return what of a solid is on the side of the last part of the shell."""
    x, y, _ = mould.shells[0].down
    half: Manifold = solid.trim_by_plane((-x, -y, 0.0), 0.0)
    return half


def shell_scene(mould: SegmentMould) -> Image:
    """Draw the parts of the shell as they are printed, side by side."""
    return _row([Drawn.of(part.printed, COLOURS["shell"]) for part in mould.shells], camera(25.0, 40.0), 480, 280)


def plate_scene(mould: SegmentMould, number: int) -> Image:
    """Draw base and top plate of a step as they are printed."""
    plates = [mould.plates[f"{kind}-{number}"] for kind in ("base", "top")]
    return _row([Drawn.of(part.printed, COLOURS["plate"]) for part in plates], camera(20.0, 48.0), 480, 250)


def cap_scene(mould: SegmentMould, end: str) -> Image:
    """Draw a cup of an end cap and the body above it, both cut open."""
    cup = mould.caps[end]
    body = finished(mould.sizes, end).translate((0.0, 0.0, 2.0 * GUIDE))
    reach = 200.0
    cut = box((-reach, reach), (0.0, reach), (-reach, reach))
    return picture(
        [Drawn.of(cup.solid ^ cut, COLOURS["cap"]), Drawn.of(body ^ cut, SILICONE)], 320, 320, camera(0.0, 25.0)
    )


def part_scene(part: Part, width: int = 360, height: int = 300) -> Image:
    """Draw a part as it is printed."""
    return picture([Drawn.of(part.printed, COLOURS[part.kind])], width, height, camera(30.0, 35.0))


def body_scene(mould: SegmentMould) -> Image:
    """Draw the finished body, with a quarter cut away."""
    reach = 200.0
    low, high = bounds(mould.cast)
    cut = box((0.0, reach), (-reach, 0.0), (low[2] + 0.35 * (high[2] - low[2]), reach))
    return picture([Drawn.of(mould.cast - cut, SILICONE)], 280, 400, camera(40.0, 28.0))


def _row(things: Iterable[Drawn], view: np.ndarray, width: int, height: int) -> Image:
    moved, across = [], 0.0
    for thing in things:
        low, high = thing.vertices[:, 0].min(), thing.vertices[:, 0].max()
        moved.append(Drawn(thing.vertices + np.array([across - low, 0.0, 0.0]), thing.faces, thing.colour))
        across += high - low + 8.0
    return picture(moved, width, height, view)
