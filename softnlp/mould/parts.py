"""A part of a mould: where it is when everything is assembled, how it lies as it is printed, how often it is needed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from softnlp.base.arrays import Array
from softnlp.mould.solids import bounds, turned

if TYPE_CHECKING:
    from manifold3d import Manifold

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Part:
    """One thing to print.

    name : of its files. kind : "shell", "plate", "core", "key", "rod", "cap", "connector". solid : the first of them,
    assembled [mm]. turns : angles about z of all of them [deg]. down : the direction, assembled, that lies on the
    printer's bed. apart : where it goes when the assembly is drawn exploded [mm]; with the part's turn.
    """

    name: str
    kind: str
    solid: Manifold
    turns: tuple[float, ...] = (0.0,)
    down: Vector = (0.0, 0.0, -1.0)
    apart: Vector = (0.0, 0.0, 0.0)

    @property
    def count(self) -> int:
        """How many of them are printed."""
        return len(self.turns)

    @property
    def every(self) -> list[Manifold]:
        """All of them, assembled."""
        return [turned(self.solid, turn) for turn in self.turns]

    @property
    def printed(self) -> Manifold:
        """The part as it lies on the bed: on z = 0, in the middle of x and y."""
        turn = laid(self.down)
        if abs(self.down[2]) < 0.5 * np.linalg.norm(self.down):  # its length along x
            x, y = turn[:2, 2] / np.hypot(*turn[:2, 2])
            turn = np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]]) @ turn
        lying = self.solid.transform(np.column_stack([turn, np.zeros(3)]))
        low, high = bounds(lying)
        middle = (low + high) / 2
        moved: Manifold = lying.translate((-middle[0], -middle[1], -low[2]))
        return moved


def laid(down: Vector) -> Array:
    """Return the rotation that turns a direction to -z, by the shortest way."""
    a = np.asarray(down) / np.linalg.norm(down)
    axis, cosine = np.cross(a, (0.0, 0.0, -1.0)), -a[2]
    if cosine < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn: Array = np.eye(3) + K + K @ K / (1 + cosine)
    return turn
