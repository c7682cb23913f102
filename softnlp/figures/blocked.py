"""The figure of a blocked force: free and blocked shape at the wall, and force and bending over what was varied."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import MILLIMETRE
from softnlp.figures.abscissa import Abscissa, abscissa
from softnlp.figures.body import (
    Camera,
    base_axes,
    disc,
    draw_arrow,
    draw_cut_open,
    draw_loads,
    frame,
    shaded,
    side_camera,
    tube,
)
from softnlp.figures.series import finish_panels, new_panels, series
from softnlp.figures.style import GREY, INK, SMALL, colour, in_own_style, new_figure, step_colours
from softnlp.model.gravity import is_hanging
from softnlp.results import Body, ContactView, RunView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

WALL, FREE = "#56B4E9", "#8A8A8A"
WALL_TINT = 0.22
_FACETS, _STATIONS = 32, 25
_CAP_RADIUS = 0.3  # of the tip's
_ARROW = 0.32  # of L_0
_ALONG_X = 1e-9  # a normal this near to x


BENDING = OUTPUTS["bending_angle"]


@in_own_style
def blocked_figure(view: RunView, contact: ContactView, measured: Sequence[tuple[float, float]] = ()) -> Figure:
    """Draw a blocked force; `measured` is (pressure [Pa] or offset [m], force [N]), whichever was varied.

    In 3-D the step of the largest force: the blocked body cut open, the free shape behind the wall, the wall's push as
    an arrow. Beside it force and bending angle against offset, pressure, time or step.
    """
    total, solved = len(view.status), len(view.solved)
    parts = [view.robot.name, view.material, f"closure {contact.closure}", view.conventions]
    parts.append(f"{solved} of {total} steps solved")
    figure = new_figure(10.0, 5.4, view.title or view.robot.name, "  ·  ".join(parts))
    _wall_panel(figure, (2.85, 2.55), view, contact)

    x = _abscissa(view, contact)
    panels = new_panels(figure, 3 if x.with_pressures else 2)
    series(panels[0], view, x, contact.force, OUTPUTS["blocked_force"].axis, least_span=0.01)
    _draw_measured(panels[0], x, measured)
    _bending(panels[1], view, contact, x)
    finish_panels(figure, panels, view, x)
    _legends(figure, view, contact, bool(measured))
    return figure


def shown_step(view: RunView, contact: ContactView) -> int | None:
    """Return the step that is drawn in full: that of the largest force, the last of equals; None if none is solved."""
    known = [k for k in view.solved if contact.free[k] is not None]
    return max(known, key=lambda k: (contact.force[k], k)) if known else None


def wall_offset(contact: ContactView) -> Array:
    """Return where the wall stands in each step (S,) [m]: h along x, or along its normal for a wall that leans."""
    n, p = contact.normal, contact.wall_point
    known = n[np.isfinite(n).all(axis=1)]
    if not len(known) or np.all(np.abs(known[:, 0]) > 1 - _ALONG_X):
        return np.asarray(p[:, 0])
    return np.asarray(np.einsum("si,si->s", p, n))


def _abscissa(view: RunView, contact: ContactView) -> Abscissa:
    """Choose the wall's offset where it varies, else what any run is drawn against."""
    h = wall_offset(contact) / MILLIMETRE
    known = h[np.isfinite(h)]
    if known.size > 1 and np.ptp(known) > 1e-6:
        # Failed steps have no wall; equal steps are the rule.
        steps = np.arange(len(h))
        n = contact.normal[np.isfinite(h)]
        along_x = np.all(np.abs(n[:, 0]) > 1 - _ALONG_X)
        label = "wall offset [mm]" if along_x else "wall position along its normal [mm]"
        slope, start = np.polyfit(steps[np.isfinite(h)], known, 1)
        return Abscissa(np.where(np.isfinite(h), h, start + slope * steps), label, False, MILLIMETRE)
    return abscissa(view)


def _draw_measured(axes: Axes, x: Abscissa, measured: Sequence[tuple[float, float]]) -> None:
    if not measured:
        return
    at, force = np.array(measured, dtype=float).T
    axes.plot(at / x.unit, force, "s", color=INK, markersize=5, markerfacecolor="none", label="measured", zorder=4)


def _bending(axes: Axes, view: RunView, contact: ContactView, x: Abscissa) -> None:
    """Draw the bending angle of the free shape as a dashed line, that of the blocked one as the steps."""
    series(axes, view, x, BENDING.shown(view.bending_angle), BENDING.heading)
    free = BENDING.shown(contact.free_bending_angle)
    axes.plot(x.values, free, color=FREE, linewidth=1.4, linestyle=(0, (4, 2)), zorder=2, label="free shape")
    both = np.concatenate([free, BENDING.shown(view.bending_angle)])
    if np.isfinite(both).any() and np.nanmax(both) - np.nanmin(both) >= 1:
        axes.autoscale()
        axes.relim()
        axes.autoscale_view()


def _wall_panel(figure: Figure, centre: tuple[float, float], view: RunView, contact: ContactView) -> Any:
    """Draw the step of the largest force at its wall about a point of the figure [inch], and the axes of the others."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    k = shown_step(view, contact)
    if k is None:
        axes, reach = base_axes(figure, centre, view, Camera(-60.0, is_hanging(view.loads.gravity)))
        frame(axes, np.vstack(reach))
        return axes
    body, free = view.bodies[k], contact.free[k]
    assert body is not None
    assert free is not None
    L = view.robot.length / MILLIMETRE
    # From the robot's side of the wall, so that the free shape is what the wall veils.
    towards = -contact.normal[k][:2] if contact.has_wall else free.position[-1, :2]
    camera = side_camera(towards, 1e-6, view.loads.gravity, turn=-24.0)
    axes, reach = base_axes(figure, centre, view, camera)
    light = camera.light
    reach += _draw_free(axes, free, light)
    others = [j for j in view.solved if j != k]
    lines = [b.position / MILLIMETRE for j in others if (b := view.bodies[j]) is not None]
    shades = step_colours(len(view.bodies))[others]
    if lines:
        axes.add_collection3d(
            Line3DCollection(lines, colors=shades, linewidths=1.4, zorder=2.5, label="axes of the steps")
        )
    reach += lines
    cap = contact.tip_cap / MILLIMETRE
    at = body.position[-1] / MILLIMETRE + cap * body.rotation[-1][:, 2]
    if contact.has_wall:
        reach.append(_draw_wall(axes, contact.wall_point[k] / MILLIMETRE, contact.normal[k], at, view))
    only_last = replace(view, bodies=tuple(b if j == k else None for j, b in enumerate(view.bodies)))
    reach += draw_cut_open(axes, only_last, k, camera.eye, light, tip_frame=False)
    if cap > 0:
        reach.append(_draw_cap(axes, body, cap, light))
    if contact.force[k] > 0:
        push = _ARROW * L * contact.normal[k]
        text = f"$F_b$ = {contact.force[k]:.3g} N"
        reach += draw_arrow(axes, at - push, push, text, "wall's force", camera, at_tail=True)
    reach += draw_loads(axes, view, body.position[-1] / MILLIMETRE, np.vstack(reach), camera)
    frame(axes, np.vstack(reach))
    return axes


def _draw_free(axes: Any, free: Body, light: Array) -> list[Array]:
    """Draw the free shape as a pale body and its axis dashed."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    quads, normals = tube(free, free.radii.outer, (0, 0), _FACETS, _STATIONS)
    faces = shaded(normals, np.full(3, 0.9), light, contrast=0.1)
    end = free.position[-1] / MILLIMETRE + (disc(free.radii.outer / MILLIMETRE, _FACETS, 0.0) @ free.rotation[-1].T)
    axes.add_collection3d(
        Poly3DCollection(quads, facecolors=faces, edgecolors=faces, linewidths=0.4, zorder=2, label="free shape")
    )
    axes.add_collection3d(Poly3DCollection(end, facecolors="#EFEFEF", edgecolors=FREE, linewidths=0.8, zorder=2.1))
    line = free.position / MILLIMETRE
    style = {"colors": FREE, "linewidths": 1.4, "linestyles": (0, (4, 2))}
    axes.add_collection3d(Line3DCollection([line], zorder=2.2, label="free axis", **style))
    return [quads.reshape(-1, 3), end.reshape(-1, 3)]


def _draw_wall(axes: Any, point: Array, normal: Array, at: Array, view: RunView) -> Array:
    """Draw a piece of the wall about the contact point [mm]; return its corners (4, 3)."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    up = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
    up = up / np.linalg.norm(up) if np.linalg.norm(up) > 1e-6 else np.array([1.0, 0.0, 0.0])
    side = np.cross(normal, up)
    middle = at - normal * float((at - point) @ normal)
    half = 1.1 * view.robot.outer_diameter / MILLIMETRE
    corners: Array = np.array([middle + half * (i * side + j * up) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    axes.add_collection3d(
        Poly3DCollection(
            corners[None], facecolors=WALL, edgecolors=WALL, linewidths=1.0, alpha=WALL_TINT, zorder=3, label="wall"
        )
    )
    clear = [(0.0, 0.0, 0.0, 0.0)]  # "none" is no colour at all, which matplotlib before 3.11 cannot sort by depth
    axes.add_collection3d(
        Poly3DCollection(corners[None], facecolors=clear, edgecolors=WALL, linewidths=1.0, zorder=3.1)
    )
    return corners


def _draw_cap(axes: Any, body: Body, cap: float, light: Array) -> Array:
    """Draw the rigid cap [mm] as a slim rod from tip to contact point; return the points it reaches."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    R, p = body.rotation[-1], body.position[-1]
    rod = Body(np.array([p, p + cap * MILLIMETRE * R[:, 2]]), np.array([R, R]), body.radii)
    quads, normals = tube(rod, _CAP_RADIUS * body.radii.outer, (0, 0), _FACETS, 2)
    end = disc(_CAP_RADIUS * body.radii.outer / MILLIMETRE, _FACETS, cap) @ R.T + p / MILLIMETRE
    faces = np.vstack([shaded(normals, np.full(3, 0.42), light), [[0.5, 0.5, 0.5]]])
    axes.add_collection3d(
        Poly3DCollection(
            [*quads, *end], facecolors=faces, edgecolors=faces, linewidths=0.4, zorder=5.5, label="tip cap"
        )
    )
    return quads.reshape(-1, 3)


def _legends(figure: Figure, view: RunView, contact: ContactView, measured: bool) -> None:
    """Say what colours and lines mean."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    style: dict[str, Any] = {"fontsize": SMALL, "frameon": False, "labelcolor": INK, "handlelength": 1.6}
    sets: list[Any] = [Patch(color=colour(k), label=f"set {k + 1}") for k in range(view.robot.chamber_sets)]
    sets.append(Line2D([], [], color=FREE, linewidth=1.4, linestyle=(0, (4, 2)), label="free shape"))
    if contact.has_wall:
        sets.append(Patch(facecolor=WALL, alpha=0.5, label="wall"))
    figure.legend(handles=sets, loc="upper left", bbox_to_anchor=(0.01, 0.885), ncols=6, columnspacing=1.4, **style)
    if measured:
        mark = Line2D([], [], color=INK, marker="s", markerfacecolor="none", linestyle="", label="measured")
        figure.axes[1].legend(handles=[mark], loc="upper left", **style)
    if (k := shown_step(view, contact)) is not None:
        where = " at the wall" if contact.has_wall else ""
        caption = f"Step {k + 1} cut open{where}, chambers without pressure pale; grey: free at the same pressure"
    else:
        caption = "No step has a solution, so no shape is shown"
    figure.text(0.018, 0.018, caption, size=SMALL, color=GREY)
