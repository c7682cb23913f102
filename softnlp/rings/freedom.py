"""What may move in a section: free nodes, nodes on mirror lines, and rings, which take their nodes with them."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
from scipy.sparse import block_diag, csc_array, eye_array, hstack

from softnlp.rings.mesher import Indices, Mesh
from softnlp.rings.outline import Array, PlaneSection

_PLANE = np.eye(2)


class Freedom:
    """The free unknowns of a mesh: of nodes, then of rings, then the pressures.

    Attributes
    ----------
    rings
        (nodes, place as cast (2,), directions in which it may move (k, 2), whether it may turn) of each ring of the
        part that is meshed, in the section's order; the outer ring is the last.
    """

    def __init__(self, section: PlaneSection, mesh: Mesh) -> None:
        self._mesh = mesh
        high = pi / section.mirrors if section.mirrors else 0.0
        lines = {-1: np.array([1.0, 0.0]), -2: np.array([cos(high), sin(high)])}
        lines = {side: line for side, line in lines.items() if side in mesh.sides}
        loops = [*range(1, 1 + len(section.rings)), *([0] if section.outer_ring else [])]
        self.rings: list[tuple[Indices, Array, Array, bool]] = []
        for loop in (loop for loop in loops if loop in mesh.sides):
            nodes, centre = mesh.sides[loop], np.array(section.loops[loop].centre)
            on = [line for side, line in lines.items() if np.intersect1d(nodes, mesh.sides[side]).size]
            if section.mirrors == 1 and not self.rings:  # the first ring stays where it is along the only line
                self.rings.append((nodes, centre, _PLANE[:0] if on else _PLANE[1:], not on))
            elif section.mirrors:
                along = np.array(on[:1]) if len(on) == 1 or section.mirrors == 1 else _PLANE[:0]
                self.rings.append((nodes, centre, along if on else _PLANE, not on))
            else:  # the first ring of a whole section rests, so that the section does
                first = not self.rings
                self.rings.append((nodes, centre, _PLANE[:0] if first else _PLANE, not first))
        ways: dict[int, Array] = {int(node): line[None] for side, line in lines.items() for node in mesh.sides[side]}
        if section.mirrors == 1 and not self.rings:
            ways[int(mesh.sides[-1][0])] = _PLANE[:0]
        if not section.mirrors and not self.rings:  # one node rests and a far one moves on the line to it
            far = int(((mesh.nodes[: mesh.corners] - mesh.nodes[0]) ** 2).sum(axis=1).argmax())
            ways |= {0: _PLANE[:0], far: (mesh.nodes[far] - mesh.nodes[0])[None]}
        held = {int(node) for nodes, *_ in self.rings for node in nodes}
        columns = [(n, way) for n in range(len(mesh.nodes)) if n not in held for way in ways.get(n, _PLANE)]
        nodes, values = np.array([n for n, _ in columns], int), np.array([way for _, way in columns])
        at = np.repeat(np.arange(len(columns)), 2)
        self._nodal = csc_array((values.ravel(), (_both(nodes), at)), shape=(2 * len(mesh.nodes), len(columns)))

    def _arms(self, rings: Array) -> list[Array]:
        """Return where the nodes of each ring are, from its centre."""
        pairs = zip(self.rings, rings, strict=True)
        return [(self._mesh.nodes[nodes] - centre) @ _turned(ring[2]).T for (nodes, centre, *_), ring in pairs]

    def columns(self, rings: Array) -> csc_array:
        """Return the derivative of all unknowns by the free ones, with rings (k, 3) where they are."""
        moves: list[tuple[Indices, Array]] = []
        for (nodes, _, directions, turns), arm in zip(self.rings, self._arms(rings), strict=True):
            moves += [(nodes, np.tile(direction, (len(nodes), 1))) for direction in directions]
            if turns:
                moves.append((nodes, arm @ np.array([[0.0, 1.0], [-1.0, 0.0]])))
        shape = (self._nodal.shape[0], len(moves))
        ring = csc_array(shape)
        if moves:
            rows = np.concatenate([_both(nodes) for nodes, _ in moves])
            at = np.concatenate([np.full(2 * len(nodes), k) for k, (nodes, _) in enumerate(moves)])
            ring = csc_array((np.concatenate([move.ravel() for _, move in moves]), (rows, at)), shape=shape)
        return csc_array(block_diag([hstack([self._nodal, ring]), eye_array(self._mesh.corners)]))

    def turning(self, residual: Array, rings: Array) -> Array:
        """Return what second derivatives of places by the rings' turns add to the diagonal of the free matrix."""
        force = residual[: self._nodal.shape[0]].reshape(-1, 2)
        found: list[float] = []
        for (nodes, _, directions, turns), arm in zip(self.rings, self._arms(rings), strict=True):
            found += [0.0] * len(directions)
            if turns:
                found.append(-float((arm * force[nodes]).sum()))
        return np.concatenate([np.zeros(self._nodal.shape[1]), found, np.zeros(self._mesh.corners)])

    def pushed(self, forces: Array) -> Array:
        """Return what forces in the plane on each ring (k, 2) do along the free unknowns."""
        found: list[float] = []
        for force, (_, _, directions, turns) in zip(forces, self.rings, strict=True):
            found += [*(directions @ force), *([0.0] if turns else [])]
        return np.concatenate([np.zeros(self._nodal.shape[1]), found, np.zeros(self._mesh.corners)])

    def moved(self, places: Array, pressures: Array, rings: Array, step: Array) -> tuple[Array, Array, Array]:
        """Return places, pressures and rings after a step of the free unknowns."""
        at = self._nodal.shape[1]
        places = places + (self._nodal @ step[:at]).reshape(-1, 2)
        rings = rings.copy()
        for ring, (_, _, directions, turns) in zip(rings, self.rings, strict=True):
            for direction in directions:
                ring[:2] += step[at] * direction
                at += 1
            if turns:
                ring[2] += step[at]
                at += 1
        for ring, (nodes, *_), arm in zip(rings, self.rings, self._arms(rings), strict=True):
            places[nodes] = ring[:2] + arm
        return places, pressures + step[at:], rings


def _both(nodes: Any) -> Any:
    """Return the unknowns x and y of nodes."""
    return (2 * nodes[:, None] + [0, 1]).ravel()


def _turned(turn: float) -> Array:
    return np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
