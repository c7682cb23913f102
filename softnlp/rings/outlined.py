"""What thread does to sections of any outline: around chambers of any outline, or around the whole body.

Each piece of silicone is a plane section of its own: an annulus, whose thread is at both sides, keeps two apart. Thread
around the body keeps its outline; bores in it are free, and take what the silicone leaves when it is stretched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan2, hypot, pi
from typing import Any

import numpy as np

from softnlp.model.energies import mooney_rivlin
from softnlp.model.outlined import Annulus, Chamber, OutlinedRobot, Region
from softnlp.model.plane import Circle, Outline, Polygon, turned
from softnlp.rings.curve import Curve, fitted
from softnlp.rings.equilibrium import Balance, Equilibrium
from softnlp.rings.mesher import mesh
from softnlp.rings.outline import Array, PlaneSection
from softnlp.rings.response import balances_on

STEP = pi / 9
"""Angle of an arc that is one side of a meshed outline that is not round [rad]."""
_SHORT = 0.05  # of a section's size: what turns within it is a round corner
_ORDER = 7
_MOVED = 1e-4  # change of a stretch by which derivatives are taken
_ALIKE = 1e-6  # of a section's size: places that are one
_GRAIN = 1e-8  # of an outline's size, to which meshed places are rounded
_APART = 1e-4  # of centres from the silicone's, of the section's size, below which they say nothing of its shrinking


@dataclass(frozen=True)
class OutlinedResponse:
    """The response of a section to a stretch.

    shear : H of each piece of silicone with its part of the area, as of `RingResponse.shear`; None where it is free.
    arms : A, with which the section shrinks as stretch^-A. stops : why the range of a piece is shorter than asked for.
    """

    shear: tuple[tuple[Curve | None, float], ...]
    arms: Curve
    stops: str

    def values(self, stretches: Sequence[float]) -> tuple[Array, Array]:
        """Return lambda T / 2 and a, (n,) each, at stretches (n,)."""
        at = np.asarray(stretches, float)
        square = np.zeros(at.shape)
        for curve, part in self.shear:
            H = 0.0 if curve is None else np.asarray(curve(at))
            square += part * (at ** (2 * H) + at ** (-2 * H)) / 2
        return square, np.asarray(at ** -np.asarray(self.arms(at)))


@dataclass(frozen=True)
class _Solved:
    """One piece of silicone. equations : None of one without thread, which is free."""

    area: float
    equations: Equilibrium | None
    balances: tuple[Balance, ...]
    ends: tuple[float, float]
    stops: str


def outlined_response(robot: OutlinedRobot) -> OutlinedResponse:
    """Return the response of a robot's section; kept in memory by its shape.

    Raises
    ------
    RobotError
        Where thread leaves silicone no room to move.
    RingError
        For a section that cannot be meshed.
    """
    return _response(robot.chamber_list, robot.surface, robot.reinforcement == "body", float(robot.lumen_radius))


def pressed_areas(robot: OutlinedRobot) -> tuple[Array, Array]:
    """Return what each pressure works on in a body that thread is wound around: areas (N,) [m^2], centres (N, 2) [m].

    V, the volume of a chamber per length as cast, grows with the stretch by the area and with k by the area times the
    centre, k = (-u_2, u_1): derivatives at rest. Of one chamber without a lumen they are the whole section's and its
    centroid, whatever the chamber's own place is.
    """
    areas, centres = _pressed(robot.chamber_list, robot.surface, float(robot.lumen_radius))
    return np.array(areas), np.array(centres)


def _coarse(outline: Outline) -> Outline:
    """Return an outline with as few corners as a mesh needs: those that turn, and some of each arc."""
    if isinstance(outline, Circle):
        return outline
    corners, kept, bent, past = np.array(outline.corners), list[int](), 0.0, 0.0
    size = outline.area**0.5
    along = np.roll(corners, -1, axis=0) - corners
    lengths, angles = np.hypot(*along.T), np.arctan2(along[:, 1], along[:, 0])
    bends = (angles - np.roll(angles, 1) + pi) % (2 * pi) - pi
    first = int(np.argmax(np.abs(bends) > np.abs(bends).max() - _ALIKE))  # a corner, where there is one
    for k in np.roll(np.arange(len(corners)), -first):
        bent, past = bent + bends[k], past + lengths[k - 1]
        if not kept or abs(bends[k]) > STEP or abs(bent) > (STEP if past > _SHORT * size else 2 * STEP):
            kept.append(int(k))
            bent = past = 0.0
    return Polygon(tuple((float(x), float(y)) for x, y in _graded(corners[kept])))


def _graded(corners: Array) -> Array:
    """Return corners between which no side is much longer than the next one: triangles beside them would be slivers."""
    places = list(corners)
    k = 0
    while k < len(places):
        before, a, b, behind = (places[(k + j) % len(places)] for j in (-1, 0, 1, 2))
        length, shorter = np.hypot(*(b - a)), min(np.hypot(*(a - before)), np.hypot(*(behind - b)))
        if length > 2.5 * shorter:
            near = np.hypot(*(a - before)) <= np.hypot(*(behind - b))
            share = min(1.5 * shorter / length, 0.5)
            places.insert(k + 1, a + (share if near else 1 - share) * (b - a))
            k = max(k - 1, 0)
        else:
            k += 1
    return np.array(places)


def _pieces(
    chambers: tuple[Chamber, ...], surface: Outline, wound: bool, lumen: float
) -> list[tuple[PlaneSection, float]]:
    """Return the plane section of each piece of silicone with its area."""
    robot = _robot(chambers, surface, wound, lumen)
    found = []
    robot.require_room()
    back = -_direction(chambers, surface)
    for part in robot.silicone:
        last = part.outer is robot.surface
        holes, rings = list[Outline](), list[Outline]()
        for outline, n in zip(part.holes, part.chambers, strict=True):
            (holes if n is None or wound else rings).append(outline)
        around = not last if not wound else last
        area = part.outer.area - sum(hole.area for hole in part.holes)
        plane = ([_coarse(_turned(outline, back)) for outline in some] for some in ([part.outer], rings, holes))
        (outer,), turned_rings, turned_holes = plane
        made = PlaneSection(outer, tuple(turned_rings), tuple(turned_holes), outer_ring=around)
        found.append((made, area))
    return found


def _direction(chambers: tuple[Chamber, ...], surface: Outline) -> float:
    """Return an angle that turns with a section, so that a turned one has the same mesh [rad]."""
    size = surface.area**0.5
    areas = [chamber.bore().outer for chamber in chambers]
    for x, y in (area.centre for area in areas):
        if hypot(x, y) > _ALIKE * size:
            return atan2(y, x)
    corners = [of.corners[0] for of in (*areas, surface) if isinstance(of, Polygon)]
    return atan2(corners[0][1], corners[0][0]) if corners else 0.0


def _turned(outline: Outline, angle: float) -> Outline:
    """Return an outline turned about the axis; places are rounded, so that a mesh of them is one mesh."""
    grain = _GRAIN * outline.area**0.5
    if isinstance(outline, Circle):
        (x, y), *_ = turned([outline.centre], angle).corners
        return Circle(round(x / grain) * grain, round(y / grain) * grain, outline.radius)
    corners = turned(list(outline.corners), angle).corners
    return Polygon(tuple((round(x / grain) * grain, round(y / grain) * grain) for x, y in corners))


def _robot(chambers: tuple[Chamber, ...], surface: Outline, wound: bool, lumen: float) -> OutlinedRobot:
    """Return a robot of a shape, whose other numbers play no part here."""
    nothing: Any = None
    kind: Any = "body" if wound else "chamber"
    return OutlinedRobot(
        "", nothing, 2 * lumen, nothing, nothing, nothing, nothing, 1, 0, nothing, chambers, surface, kind
    )


@lru_cache(maxsize=64)
def _response(chambers: tuple[Chamber, ...], surface: Outline, wound: bool, lumen: float) -> OutlinedResponse:
    pieces = _pieces(chambers, surface, wound, lumen)
    solved = [_solved(*piece) for piece in pieces]
    whole = sum(piece.area for piece in solved)
    shear = []
    for piece in solved:
        curve = None
        if piece.equations is not None:
            at = np.array([b.stretch for b in piece.balances])
            square = np.array([b.square for b in piece.balances])
            curve = _fitted(at, np.arccosh(np.maximum(square * at / 2, 1.0)) / 2 / np.abs(np.log(at)), piece.ends)
        shear.append((curve, piece.area / whole))
    stops = "; ".join(sorted({piece.stops for piece in solved} - {""}))
    return OutlinedResponse(tuple(shear), _arms(solved, wound, surface.area**0.5), stops)


def _solved(section: PlaneSection, area: float) -> _Solved:
    if not (section.rings or section.outer_ring):
        return _Solved(area, None, (), (0.0, np.inf), "")
    equations, found, ends, stops = balances_on(section, mesh(section))
    return _Solved(area, equations, tuple(found), ends, stops)


def _fitted(at: Array, values: Array, ends: tuple[float, float]) -> Curve:
    return fitted(at, values, *ends, min(_ORDER, len(at) - 3))


def _arms(solved: Sequence[_Solved], wound: bool, size: float) -> Curve:
    """Return A: from the rings' centres about the silicone's, or where these are one from the silicone's own spread."""

    def spread(piece: _Solved) -> float:
        return 0.0 if piece.equations is None or wound else float((abs(_rings(piece.equations, None)) ** 2).sum())

    piece = max(solved, key=lambda one: (spread(one), one.equations is not None))
    equations = piece.equations
    if equations is None:  # nothing has a ring
        return Curve((0.5,), 0.5, 2.0)
    at = np.array([b.stretch for b in piece.balances])
    if spread(piece) > (_APART * size) ** 2:
        cast = _rings(equations, None)
        ratio = [abs((cast.conj() * _rings(equations, b)).sum()) / (abs(cast) ** 2).sum() for b in piece.balances]
    else:
        X, weight = _silicone(equations, None, fixed=wound)
        square = (weight * abs(X) ** 2).sum()
        ratio = [
            abs((weight * X.conj() * _silicone(equations, b, fixed=wound)[0]).sum()) / square for b in piece.balances
        ]
    return _fitted(at, -np.log(np.array(ratio)) / np.log(at), piece.ends)


def _silicone(equations: Equilibrium, balance: Balance | None, *, fixed: bool) -> tuple[Any, Array]:
    """Return places x + i y of all points and their areas as cast, about their middle or where they are."""
    el = equations.elements
    places = equations.mesh.nodes if balance is None else balance.places
    x, y = np.einsum("qn,mni->imq", el.shape, places[equations.mesh.triangles]).reshape(2, -1)
    weight = el.weight.ravel()
    z = x + 1j * y
    return z if fixed else z - (weight * z).sum() / weight.sum(), weight


def _rings(equations: Equilibrium, balance: Balance | None) -> Any:
    """Return the centres x + i y of rings about the silicone's middle."""
    cast = np.array([centre for _, centre, *_ in equations.freedom.rings])
    centres = cast if balance is None else balance.rings[:, :2]
    el = equations.elements
    places = equations.mesh.nodes if balance is None else balance.places
    x = np.einsum("qn,mni->imq", el.shape, places[equations.mesh.triangles])
    middle = (x * el.weight).sum(axis=(1, 2)) / el.weight.sum()
    return (centres - middle) @ np.array([1.0, 1j])


@lru_cache(maxsize=64)
def _pressed(
    chambers: tuple[Chamber, ...], surface: Outline, lumen: float
) -> tuple[tuple[float, ...], tuple[tuple[float, float], ...]]:
    if len(chambers) == 1 and (lumen == 0 or isinstance(chambers[0].form, Annulus)):
        return (surface.area,), (surface.centre,)
    robot = _robot(chambers, surface, True, lumen)
    (section, _), part = _pieces(chambers, surface, True, lumen)[-1], robot.silicone[-1]
    equations = Equilibrium(section, mesh(section), mooney_rivlin(1.0, 0.0))
    rest, size = equations.rest(), surface.area**0.5
    step = _MOVED / size
    ways = ((_MOVED, (0.0, 0.0)), (0.0, (step, 0.0)), (0.0, (0.0, step)))
    rates = []
    for stretch, kappa in ways:
        up = equations.solve(rest, 1 + stretch, kappa)
        down = equations.solve(rest, 1 - stretch, (-kappa[0], -kappa[1]))
        rates.append((_volumes(equations, section, up) - _volumes(equations, section, down)) / (2 * (stretch or step)))
    by_stretch, by_x, by_y = np.array(rates) * surface.area / section.outer.area
    moments = (by_x + 1j * by_y) * np.exp(1j * _direction(chambers, surface))
    same = _symmetries(part)
    areas, centres = [0.0] * len(chambers), [(0.0, 0.0)] * len(chambers)
    for k, n in enumerate(part.chambers):
        if n is not None:  # the mean over what symmetry makes equal, which a mesh does not
            A = np.mean([by_stretch[to[k]] for _, _, to in same])
            M = np.mean([_back(moments[to[k]], turn, mirrored) for turn, mirrored, to in same]) / A
            areas[n], centres[n] = float(A), (float(M.real), float(M.imag))
    return tuple(areas), tuple(centres)


def _back(z: Any, turn: float, mirrored: bool) -> Any:
    """Return where a symmetry takes x + i y from: it mirrors at the x axis, where it does, and then turns."""
    z = z * np.exp(-1j * turn)
    return z.conjugate() if mirrored else z


def _symmetries(part: Region) -> list[tuple[float, bool, list[int]]]:
    """Return what takes a piece of silicone to itself: turn, whether mirrored first, and where each hole goes."""
    middles = [complex(*hole.centre) for hole in part.holes]
    size = part.outer.area**0.5
    found = [(0.0, False, list(range(len(middles))))]
    away = [z for z in middles if abs(z) > _ALIKE * size]
    for z in away:
        for mirrored in (False, True):
            turn = float(np.angle(z) - np.angle(away[0].conjugate() if mirrored else away[0]))
            if not mirrored and abs(turn) < _ALIKE:
                continue
            if not _alike(part.outer, part.outer, turn, mirrored, size):
                continue
            to = [
                next((j for j, b in enumerate(part.holes) if _alike(a, b, turn, mirrored, size)), -1)
                for a in part.holes
            ]
            if min(to) >= 0:
                found.append((turn, mirrored, to))
    return found


def _alike(a: Outline, b: Outline, turn: float, mirrored: bool, size: float) -> bool:
    """Whether one outline is another one turned, and mirrored first."""
    if isinstance(a, Circle) != isinstance(b, Circle) or abs(a.area - b.area) > _ALIKE * size**2:
        return False
    places = [a.centre] if isinstance(a, Circle) else a.corners
    z = np.array([complex(*place) for place in places])
    z = (z.conj() if mirrored else z) * np.exp(1j * turn)
    moved = np.column_stack([z.real, z.imag])
    off = np.hypot(*(moved - b.centre).T) if isinstance(b, Circle) else np.abs(b.signed(moved))
    return bool(off.max() < _ALIKE * size)


def _volumes(equations: Equilibrium, section: PlaneSection, balance: Balance) -> Array:
    """Return the integral of the stretch over each hole, per length as cast [m^2]."""
    first = 1 + len(section.rings)
    at, weight = np.polynomial.legendre.leggauss(4)
    t, weight = (1 + at) / 2, weight / 2
    shape = np.array([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
    slope = np.array([4 * t - 3, 4 - 8 * t, 4 * t - 1])
    found = []
    for loop in range(first, first + len(section.holes)):
        on = np.zeros(len(equations.mesh.nodes), bool)
        on[equations.mesh.sides[loop]] = True
        edges = np.vstack([equations.mesh.triangles[:, pick] for pick in ([0, 3, 1], [1, 4, 2], [2, 5, 0])])
        nodes = balance.places[edges[on[edges].all(axis=1)]]  # (edges, 3, 2), the silicone on their left
        (x, y), (dx, dy) = (np.einsum("nq,eni->ieq", of, nodes) for of in (shape, slope))
        k_x, k_y = balance.curvature
        area = -((x * dy - y * dx) / 2 @ weight).sum()
        moments = -((x**2 * dy / 2) @ weight).sum(), ((y**2 * dx / 2) @ weight).sum()
        found.append(balance.stretch * area + k_x * moments[0] + k_y * moments[1])
    return np.array(found)
