"""The 3-D panel of a run: bodies to scale, chambers coloured by set, base, tip frame and loads. Lengths in mm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.figures.space import axes_3d, draw_faces, draw_lines, plain_3d
from softnlp.figures.style import GREY, INK, SMALL, TEXT, colour, step_colours
from softnlp.figures.tubes import chamber_tubes, skin
from softnlp.figures.tubes import tube as tube
from softnlp.model.gravity import gravity_lines, is_hanging
from softnlp.model.section import SectionRadii
from softnlp.model.segments import segments_of
from softnlp.results import Body, RunView

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BODY_FACETS, CHAMBER_FACETS, GHOST_FACETS = 32, 10, 24
BODY_STATIONS, GHOST_STATIONS = 25, 13
SILICONE = (0.93, 0.91, 0.88)
GHOST_TINT, IDLE_TINT = 0.16, 0.40  # how much of its colour a faint body and a chamber without pressure keep
MOST_GHOSTS = 3
ELEVATION = 16.0  # of the viewer [deg]
_ARROW = 0.32  # length of a load's arrow, of L_0
_LOW, _ROOM = 5.0, 1.5  # how much less high than wide a text is; distance from others, of a moment's radius
_ROUND, _CLEAR = 0.7, 0.65  # radius of a moment's arrow, of that length, and at least so much of the outer diameter
_CONNECTOR, _SLIM = 0.42, 0.6  # grey of a connector, and its radius in drawings, of the segment before
_CANVAS = 5.6  # side of the square that the panel may draw in [inch]
_BOX = (4.4, 3.7)  # largest width and height of the box of the axes, labels not included [inch]


def disc(radius: float, facets: int, z: float) -> Array:
    """Return a flat disc (1, facets, 3) about the axis, in the unit of its arguments."""
    angle = np.linspace(0, 2 * np.pi, facets, endpoint=False)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(facets, z)])[None]


@dataclass(frozen=True)
class Camera:
    """From where axes are seen: from a little above, and with the base on top where the robot hangs.

    azimuth : of the viewer about +z [deg]. hanging : whether the picture is turned upside down.
    """

    azimuth: float
    hanging: bool

    @property
    def eye(self) -> Array:
        """The unit vector towards the viewer (3,)."""
        return direction(self.azimuth, -ELEVATION if self.hanging else ELEVATION)

    @property
    def right(self) -> Array:
        """The level unit vector that points right in the picture (3,)."""
        return direction(self.azimuth + (-90 if self.hanging else 90), 0)

    @property
    def light(self) -> Array:
        """The unit vector towards the light (3,), from the upper left."""
        return direction(self.azimuth + 50, -40) if self.hanging else direction(self.azimuth - 50, 40)

    def aim(self, axes: Any) -> None:
        """Turn 3-D axes."""
        upside_down = {"elev": -ELEVATION, "roll": 180} if self.hanging else {"elev": ELEVATION}
        axes.view_init(azim=self.azimuth, **upside_down)


def side_camera(towards: Array, least: float, gravity: Sequence[float], turn: float = 20.0) -> Camera:
    """Return the camera for which a level vector points right, turned by some degrees; a fixed one if it is short."""
    (x, y), hanging = towards, is_hanging(gravity)
    if np.hypot(x, y) < least:
        return Camera(-60.0, hanging)
    away = 90.0 - turn
    return Camera(float(np.degrees(np.arctan2(y, x))) + (away if hanging else -away), hanging)


def view_camera(view: RunView) -> Camera:
    """Return the camera for which the last solved step bends to the right, almost side on."""
    body = view.bodies[view.solved[-1]] if view.solved else None
    towards = np.zeros(2) if body is None else body.position[-1, :2]
    return side_camera(towards, 0.02 * view.robot.length, view.loads.gravity)


def body_panel(figure: Figure, centre: tuple[float, float], view: RunView) -> Any:
    """Draw the 3-D panel of a run about a point of the figure [inch] and return its axes."""
    camera = view_camera(view)
    axes, reach = base_axes(figure, centre, view, camera)
    solved = view.solved
    shades = step_colours(len(view.bodies))
    light = camera.light
    for k in _ghosts(solved):
        body = view.bodies[k]
        assert body is not None
        for piece, (own, _) in zip(body.pieces, segments_of(view.robot), strict=True):
            quads, normals = skin(piece, own, GHOST_FACETS, GHOST_STATIONS)
            pale = shaded(normals, GHOST_TINT * shades[k][:3] + (1 - GHOST_TINT), light, contrast=0.06)
            draw_faces(axes, quads, pale, zorder=2, label="earlier step")
            reach.append(quads.reshape(-1, 3))
    if solved:
        lines = [b.position / MILLIMETRE for b in view.bodies if b is not None]
        draw_lines(axes, lines, 1.4, colors=shades[list(solved)], zorder=3, label="axes of the steps")
        reach += lines
        reach += draw_cut_open(axes, view, solved[-1], camera.eye, light)
        reach += draw_loads(axes, view, lines[-1][-1], np.vstack(reach), camera)
    frame(axes, np.vstack(reach))
    return axes


def base_axes(figure: Figure, centre: tuple[float, float], view: RunView, camera: Camera) -> tuple[Any, list[Array]]:
    """Return 3-D axes about a point of the figure [inch] with the base plate alone, and the points it reaches [mm].

    Gravity, where there is some, is said in words beneath.
    """
    width, height = figure.get_size_inches()
    left, bottom = centre[0] - _CANVAS / 2, centre[1] - _CANVAS / 2
    box = (left / width, bottom / height, _CANVAS / width, _CANVAS / height)
    axes = axes_3d(figure, box)
    camera.aim(axes)
    for line in gravity_lines(view.loads.gravity):
        figure.text(0.018, 0.053, line, size=SMALL, color=GREY)
    plate = disc(0.75 * view.robot.outer_diameter / MILLIMETRE, 40, 0.0)
    draw_faces(axes, plate, "#EEEEEE", GREY, 0.6, zorder=1, label="base")
    return axes, [plate.reshape(-1, 3), np.array([[0.0, 0.0, view.robot.length / MILLIMETRE]])]


def _ghosts(solved: Sequence[int]) -> list[int]:
    """Return a few steps between the first and the last to show as faint bodies, the first included."""
    if len(solved) < 2:
        return []
    return sorted({solved[round(j)] for j in np.linspace(0, len(solved) - 1, MOST_GHOSTS + 1)[:-1]})


def draw_cut_open(axes: Any, view: RunView, k: int, eye: Array, light: Array, *, tip_frame: bool = True) -> list[Array]:
    """Draw step k's body opened towards the viewer, chambers and tip frame; return points that it reaches [mm].

    The half of the skin that faces the viewer is left out, so that the chambers are seen and nothing is transparent.
    Chambers without pressure are pale.
    """
    from matplotlib.colors import to_rgb

    body, robot = view.bodies[k], view.robot
    assert body is not None
    quads, colours, reach = list[Array](), list[Array](), list[Array]()
    for piece, (own, first) in zip(body.pieces, segments_of(robot), strict=True):
        surface, normals = skin(piece, own, BODY_FACETS, BODY_STATIONS)
        behind = normals @ eye < 0
        quads.append(surface[behind])
        colours.append(shaded(-normals[behind], SILICONE, light, contrast=0.14))
        for (chamber, outward), chamber_set in zip(
            chamber_tubes(piece, own, CHAMBER_FACETS, BODY_STATIONS), own.set_of_chamber, strict=True
        ):
            rgb = np.array(to_rgb(colour(first + chamber_set)))
            if view.pressure[k, first + chamber_set] == 0:
                rgb = IDLE_TINT * rgb + (1 - IDLE_TINT)
            quads.append(chamber)
            colours.append(shaded(outward, rgb, light))
        edges = _outline(surface, behind)
        quads.append(edges)
        colours.append(np.tile(to_rgb(GREY), (len(edges), 1)))
        reach.append(surface.reshape(-1, 3))
    for link in _connectors(body):
        rod, normals = tube(link, link.radii.outer, (0, 0), CHAMBER_FACETS, 2)
        quads.append(rod)
        colours.append(shaded(normals, np.full(3, _CONNECTOR), light))
    # One collection, so that all is sorted by depth together; edges of the face's colour close the seams.
    draw_faces(axes, np.concatenate(quads), np.concatenate(colours), width=0.6, zorder=4, label="last step")
    rim = surface.reshape(-1, BODY_FACETS, 4, 3)[-1, :, 1]  # of the last segment
    axes.plot(*np.vstack([rim, rim[:1]]).T, color=GREY, linewidth=0.8, zorder=5, label="tip rim")

    if not tip_frame:
        return reach
    tip, R = body.position[-1] / MILLIMETRE, body.rotation[-1]
    size = 0.2 * robot.length / MILLIMETRE
    arms = [(tip, tip + size * R[:, j]) for j in range(3)]
    draw_lines(axes, arms, 1.2, colors=GREY, zorder=6, label="tip frame")
    for (_, end), name in zip(arms, "xyz", strict=True):
        look: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 7, "path_effects": _halo()}
        axes.text(*(tip + 1.35 * (end - tip)), name, size=SMALL, color=INK, **look)
    return [*reach, np.array([tip + 1.4 * size * R[:, j] for j in range(3)])]


def tip_radius(body: Body) -> float:
    """Return the outer radius at the tip of a body [m]."""
    return float(np.ravel(body.radii.outer)[-1])


def _connectors(body: Body) -> list[Body]:
    """Return the rigid pieces between and behind segments, slim rods."""
    found = []
    ends = [piece.position[0] for piece in body.pieces[1:]] + [body.position[-1]]
    for piece, end in zip(body.pieces, ends, strict=True):
        if np.linalg.norm(end - piece.position[-1]) > 0 and body.parts:
            radius = _SLIM * tip_radius(piece)
            radii = SectionRadii(radius, 0.0, 0.0, 0.0, 0.0)
            found.append(Body(np.array([piece.position[-1], end]), np.array([piece.rotation[-1]] * 2), radii))
    return found


def _outline(skin: Array, behind: NDArray[np.bool_]) -> Array:
    """Return (n, 4, 3) faces of no width where a body's faces turn from towards the viewer to away."""
    faces, away = skin.reshape(-1, BODY_FACETS, 4, 3), behind.reshape(-1, BODY_FACETS)
    turns = away != np.roll(away, -1, axis=1)
    edges: Array = faces[turns][:, [3, 2, 2, 3]]
    return edges


def shaded(normals: Array, rgb: Any, light: Array, contrast: float = 0.28) -> Array:
    """Return (n, 3) colours, lighter where a face looks at the light."""
    brightness = 1 - contrast + contrast * (normals @ light)
    return np.clip(np.asarray(rgb) * brightness[:, None], 0, 1)


def direction(azimuth: float, elevation: float) -> Array:
    """Return the unit vector towards an azimuth and elevation [deg]."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def _halo() -> list[Any]:
    """Return what keeps letters apart from what is behind them."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.5, foreground="white")]


def draw_loads(axes: Any, view: RunView, tip: Array, reach: Array, camera: Camera) -> list[Array]:
    """Draw tip force and gravity as arrows of one length, a tip moment as one bent round its axis; return ends [mm].

    Gravity stands to the left of everything drawn so far, `reach`.
    """
    right = camera.right
    size = _ARROW * view.robot.length / MILLIMETRE
    force, moment, gravity = (
        np.asarray(x, dtype=float) for x in (view.loads.tip_force, view.loads.tip_moment, view.loads.gravity)
    )
    height = (1.0 if gravity[2] <= 0 else 1 - _ARROW) * view.robot.length / MILLIMETRE
    aside = (float((reach @ right).min()) - 0.3 * size) * right + np.array([0.0, 0.0, height])
    arrows = [(tip, force, f"F {np.linalg.norm(force):.3g} N", "tip force"), (aside, gravity, "g", "gravity")]
    ends = []
    for start, vector, text, label in arrows:
        norm = float(np.linalg.norm(vector))
        if norm > 0:
            ends += draw_arrow(axes, start, size * vector / norm, text, label, camera)
    if (turn := float(np.linalg.norm(moment))) > 0:
        radius = max(_ROUND * size, _CLEAR * view.robot.outer_diameter / MILLIMETRE)
        text = f"M {turn / NEWTON_MILLIMETRE:.3g} N mm"
        ends += draw_turn(axes, tip, moment / turn, radius, text, "tip moment", camera)
    return ends


def draw_arrow(
    axes: Any,
    start: Array,
    step: Array,
    text: str,
    label: str,
    camera: Camera,
    *,
    ink: str = INK,
    at_tail: bool = False,
) -> list[Array]:
    """Draw an arrow [mm], its head flat towards the viewer and its text beyond one end; return points it reaches."""
    eye, right = camera.eye, camera.right
    size = float(np.linalg.norm(step))
    across = np.cross(step, eye)
    across = 0.4 * across / np.linalg.norm(across) if np.linalg.norm(across) > 0.1 * size else 0.4 * right
    tail, side = start + 0.74 * step, 0.28 * size * across
    lines = [(start, start + step), (tail + side, start + step), (tail - side, start + step)]
    draw_lines(axes, lines, 1.6, colors=ink, zorder=6, label=label)
    sideways = float(step @ right) / size * (-1 if at_tail else 1)
    place, away = ("center", 0.22) if abs(sideways) < 0.4 else ("left" if sideways > 0 else "right", 0.05)
    end = start - away * step if at_tail else start + (1 + away) * step
    _write_load(axes, end, text, place, ink)
    return [start[None], end[None]]


def draw_turn(
    axes: Any, centre: Array, axis: Array, radius: float, text: str, label: str, camera: Camera
) -> list[Array]:
    """Draw an arrow bent round an axis [mm] by the right-hand rule, its text beside; return points that it reaches."""
    level = camera.right - (camera.right @ axis) * axis
    if np.linalg.norm(level) < 0.1:  # seen along its axis
        level = np.cross(axis, camera.eye)
    first = level / np.linalg.norm(level)
    second = np.cross(axis, first)

    def at(angle: Any, reach: Any = radius) -> Array:
        along = np.multiply.outer(np.cos(angle) * reach, first) + np.multiply.outer(np.sin(angle) * reach, second)
        return np.asarray(centre + along)

    # The gap is on the right, where the text is if no other stands there: the head ends before it.
    bend = at(np.radians(np.linspace(45, 335, 49)))
    heads = [np.array([at(np.radians(305.0), radius * part), bend[-1]]) for part in (0.78, 1.22)]
    draw_lines(axes, [bend, *heads], 1.6, colors=INK, zorder=6, label=label)
    up = np.cross(camera.eye, camera.right)
    others = [t.get_position_3d() for t in axes.texts if len(t.get_text()) > 1]  # not the letters of axes
    written = np.array(others or [bend[0] + 9 * radius * up])

    def crowded(angle: float) -> float:
        """How near other texts are, which are wide and low."""
        away = at(angle, 1.15 * radius) - written
        return float(-np.min(np.abs(away @ camera.right) + _LOW * np.abs(away @ up)))

    angle = min(np.radians([0.0, 180.0, 60.0, -60.0, 120.0, -120.0]), key=lambda a: max(crowded(a), -_ROOM * radius))
    end = at(angle, 1.15 * radius)
    to_right = bool(np.cos(angle) > 0)
    _write_load(axes, end, text, "left" if to_right else "right", INK)
    # with room for the text before the numbers of the axis
    return [bend, (end + (1.4 if to_right else -1.4) * radius * camera.right)[None]]


def _write_load(axes: Any, place: Array, text: str, side: str, ink: str) -> None:
    look: dict[str, Any] = {"ha": side, "va": "center", "path_effects": _halo(), "parse_math": True}
    axes.text(*place, text, size=TEXT, color=ink, zorder=8, **look)


def frame(axes: Any, points: Array) -> None:
    """Set limits with equal scales on the three axes and one tick distance for all."""
    low, high = points.min(axis=0), points.max(axis=0)
    widest = float((high - low).max())
    low, high = low - 0.03 * widest, high + 0.03 * widest
    decade = 10.0 ** np.floor(np.log10(widest / 6))
    distance = next(d for d in decade * np.array([1.0, 2.0, 5.0, 10.0]) if d >= widest / 6)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    _fit(axes, high - low)
    for k, axis in enumerate(plain_3d(axes)):
        # No tick next to a corner, where the labels of two axes would meet.
        first, last = np.ceil((low[k] + 0.07 * widest) / distance), np.floor((high[k] - 0.07 * widest) / distance)
        axis.set_ticks(distance * np.arange(first, last + 1))
    axes.tick_params(labelsize=SMALL, colors=INK, pad=0)
    # mplot3d scales label distances with the width of the box, so a slender one needs more.
    slender = widest / float((high - low)[:2].max()) - 1
    axes.tick_params(axis="z", pad=4 + 2 * slender)
    axes.zaxis.labelpad = 4 + 7 * slender


def _fit(axes: Any, size: Array) -> None:
    """Give the box its proportions and the largest scale at which it fits, as seen from the chosen direction."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    axes.set_box_aspect(size)
    axes.apply_aspect()
    corners = np.array(np.meshgrid(axes.get_xlim(), axes.get_ylim(), axes.get_zlim())).reshape(3, -1)
    across, up, _ = proj_transform(*corners, axes.get_proj())
    seen = np.ptp(axes.transData.transform(np.column_stack([across, up])), axis=0) / axes.figure.dpi
    axes.set_box_aspect(size, zoom=float(min(_BOX / seen)))
