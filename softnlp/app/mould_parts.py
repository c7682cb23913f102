"""The parts of moulds as the 3-D view shows them: each solid once, and every place where it stands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.app.view.frame import packed
from softnlp.mould.assembly import Moulds, SegmentMould
from softnlp.mould.scenes import apart_in_picture
from softnlp.mould.solids import bounds, mesh_of
from softnlp.mould.write import COLOURS

if TYPE_CHECKING:
    from manifold3d import Manifold

Message = dict[str, Any]
Vector = tuple[float, float, float]
_BESIDE = 10.0  # between cups of caps [mm]


class _Scene:
    """A message as it is put together."""

    def __init__(self, name: str) -> None:
        self.message: Message = {"name": name, "apart": 0.0, "solids": [], "places": [], "kinds": []}

    def add(
        self, solid: Manifold, kind: str, turns: tuple[float, ...], apart: Vector, at: Vector = (0.0, 0.0, 0.0)
    ) -> None:
        """Add a solid at each of its turns [deg]."""
        points, faces = mesh_of(solid)
        wide = len(points) > np.iinfo(np.uint16).max
        self.message["places"] += [
            {"solid": len(self.message["solids"]), "turn": turn, "at": at, "apart": apart} for turn in turns
        ]
        self.message["solids"].append(
            {
                "points": packed(points, np.float32),
                "faces": packed(faces, np.uint32 if wide else np.uint16),
                "wide": wide,
                "colour": hex_of(kind),
                "opacity": COLOURS[kind][3],
            }
        )
        if kind not in self.message["kinds"]:
            self.message["kinds"].append(kind)


def hex_of(kind: str) -> str:
    """Return the colour of a kind of part as a page has it."""
    return "#" + "".join(f"{round(255 * share):02x}" for share in COLOURS[kind][:3])


def messages_of(moulds: Moulds) -> dict[str, Message]:
    """Return what the view shows, by the words of a choice: both pours of each segment, caps and connectors."""
    found = {}
    for k, segment in enumerate(moulds.segments):
        where = f"Segment {k + 1}: " if len(moulds.segments) > 1 else ""
        for number, words in ((1, "first pour"), (2, "second pour")):
            name = f"{where}{words}" if where else words.capitalize()
            found[name] = _step(name, segment, number)
    last = "Caps and connectors" if moulds.connectors else "Caps"
    scene, across = _Scene(last), 0.0
    for part in (*(cup for segment in moulds.segments for cup in segment.caps.values()), *moulds.connectors):
        (low, _, _), (high, _, _) = bounds(part.solid)
        scene.add(part.solid, part.kind, (0.0,), (0.0, 0.0, 0.0), (across - low, 0.0, 0.0))
        across += high - low + _BESIDE
    return found | ({last: scene.message} if scene.message["places"] else {})


def _step(name: str, segment: SegmentMould, number: int) -> Message:
    scene = _Scene(name)
    for part in segment.step(number):
        scene.add(part.solid, part.kind, part.turns, apart_in_picture(part))
    for core in segment.cores if number == 1 else ():
        _, _, lift = apart_in_picture(core.parts[-1])
        scene.add(core.thread, "thread", core.turns, (0.0, 0.0, lift))
    return scene.message
