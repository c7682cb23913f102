"""The figure of a run: every step's shape to scale, and what it did against pressure.

A blocked force is drawn at its wall, free and blocked shape; inverse kinematics with its targets and the tips found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS, Output
from softnlp.base.units import MILLIMETRE
from softnlp.figures.body import (
    Camera,
    base_axes,
    body_panel,
    disc,
    draw_arrow,
    draw_cut_open,
    draw_loads,
    frame,
    shaded,
    side_camera,
    tip_radius,
    tube,
)
from softnlp.figures.dynamic import dynamic_figure
from softnlp.figures.obstacles import draw_obstacles
from softnlp.figures.path import path_panels
from softnlp.figures.series import STEP, Abscissa, abscissa, finish_panels, new_panels, series
from softnlp.figures.space import draw_faces, draw_lines
from softnlp.figures.style import (
    GREY,
    INK,
    SMALL,
    WRONG,
    colour,
    in_own_style,
    legend,
    mark,
    new_figure,
    plain,
    step_colours,
)
from softnlp.model.gravity import is_hanging
from softnlp.results import Body, ContactView, RunView, TargetView
from softnlp.statics.step import STABLE_FLAGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BENDING, ELONGATION, FORCE = (OUTPUTS[name] for name in ("bending_angle", "elongation", "blocked_force"))
DISTANCE, ANGLE = OUTPUTS["distance"], OUTPUTS["direction_error"]
_CENTRE = (2.85, 2.55)  # of the panel in 3-D [inch]
_LEAST_LEFT = 1e-9  # [mm] or [deg]: below it what is left is drawn at the foot of its axis
_DIRECTION = 0.22  # length of a target's direction, of L_0
WALL, FREE, DASHES = "#56B4E9", "#8A8A8A", (0, (4, 2))
WALL_TINT = 0.22
_FACETS, _STATIONS = 32, 25
_CAP_RADIUS = 0.3  # of the tip's
_ARROW = 0.32  # of L_0
_ALONG_X = 1e-9  # a normal this near to x


@in_own_style
def run_figure(view: RunView, measured: Sequence[tuple[float, float]] = ()) -> Figure:
    """Draw a run: a 3-D panel of all shapes, and bending angle and elongation against pressure, time or step.

    A blocked force is drawn at its wall, with `measured` forces over it if given (`blocked_figure`).

    The last solved step is drawn in full, chambers coloured by set, a few others faintly, and the axis of each. Steps
    without a solution are crosses at the foot of the panels; unstable ones are hollow.
    """
    if view.contact is not None:
        return blocked_figure(view, view.contact, measured)
    if view.targets is not None:
        return inverse_figure(view, view.targets)
    if view.moving is not None:
        return dynamic_figure(view, view.moving)
    figure = _begun(view, f"{len(view.solved)} of {len(view.status)} steps solved")
    axes = body_panel(figure, _CENTRE, view)
    if view.obstacles:
        draw_obstacles(axes, view.obstacles, view.robot.length)
    x = abscissa(view)
    among = view.contact_force is not None
    panels = new_panels(figure, 2 + among + x.with_pressures)
    series(panels[0], view, x, BENDING.shown(view.bending_angle), BENDING.heading, std=_std(view, BENDING))
    longer = ELONGATION.shown(view.backbone_length - view.robot.length)
    series(panels[1], view, x, longer, ELONGATION.axis, std=_std(view, ELONGATION))
    if view.contact_force is not None:
        series(panels[2], view, x, view.contact_force.sum(axis=1), "contact force [N]", least_span=0.01)
    finish_panels(figure, panels, view, x)
    _explain_steps(figure, view)
    return figure


def _std(view: RunView, output: Output) -> Array | None:
    """Return one standard deviation of an output, None where the run has none."""
    found = view.std.get(output.name)
    return None if found is None else np.asarray(output.shown(found))


def _begun(view: RunView, solved: str, *more: str) -> Figure:
    """Return a figure that says what was run."""
    band = ["bands of one standard deviation"] if view.std else []
    parts = [view.robot.name, view.material, *more, view.conventions, solved, *band]
    return new_figure(10.0, 5.4, view.title or view.robot.name, "  ·  ".join(parts))


def _explain(figure: Figure, view: RunView, marks: Sequence[Any], caption: str, **look: Any) -> None:
    """Say what the colours of sets and some marks mean, and what the 3-D panel shows."""
    from matplotlib.patches import Patch

    sets = [Patch(color=colour(k), label=f"set {k + 1}") for k in range(view.robot.chamber_sets)]
    look = {"handlelength": 1.2, "columnspacing": 1.4, **look}
    legend(figure, [*sets, *marks], loc="upper left", bbox_to_anchor=(0.01, 0.885), ncols=6, **look)
    figure.text(0.018, 0.018, caption, size=SMALL, color=GREY)


def _explain_steps(figure: Figure, view: RunView) -> None:
    """Say what colours and marks mean, in one line for the shapes and one for the panels where it is needed."""
    caption = "No step has a solution, so no shape is shown"
    if view.solved:
        caption = f"Step {view.solved[-1] + 1} cut open, chambers without pressure pale"
        if len(view.solved) > 1:
            caption += "; other steps in the colours of the markers on the right"
    _explain(figure, view, [], caption)
    marks = []
    if len(view.solved) < len(view.status):
        marks.append(mark("no solution", WRONG, "x"))
    stable = view.stable[list(view.solved)]
    if np.any(stable == STABLE_FLAGS["unstable"]):
        marks.append(mark("unstable", GREY, "o", markerfacecolor="white"))
    if np.any(stable == STABLE_FLAGS["undefined"]):
        marks.append(mark("stability undefined", GREY, "o"))
    if marks:
        look: dict[str, Any] = {"handlelength": 1.2, "columnspacing": 1.4, "ncols": len(marks)}
        legend(figure, marks, loc="upper right", bbox_to_anchor=(0.99, 0.935), **look)


# --- inverse kinematics -----------------------------------------------------------------------------------------------


@in_own_style
def inverse_figure(view: RunView, targets: TargetView) -> Figure:
    """Draw a run of inverse kinematics.

    In 3-D the shapes, the path of targets as open squares and of tips as dots, joined where the target is out of reach.
    Beside it what is left of each target, on a logarithmic axis, the bending angle and the pressure of each set; of a
    path the rate of each pressure in place of the angle, over time, with what limits both dashed.
    """
    figure = _begun(view, f"{len(view.solved)} of {len(view.status)} targets met")
    axes = body_panel(figure, _CENTRE, view)
    if view.obstacles:
        draw_obstacles(axes, view.obstacles, view.robot.length)
    _draw_targets(axes, view, targets)
    panels = new_panels(figure, 3)
    if view.limits and view.time is not None:
        _left(panels[0], path_panels(figure, panels, view, view.time), targets)
    else:
        x = Abscissa(np.arange(1, len(view.status) + 1, dtype=float), STEP, True)
        _left(panels[0], x, targets)
        series(panels[1], view, x, BENDING.shown(view.bending_angle), BENDING.heading, std=_std(view, BENDING))
        finish_panels(figure, panels, view, x)
        panels[-1].set_xlabel("target")
    _explain_targets(figure, view, targets)
    return figure


def _draw_targets(axes: Any, view: RunView, targets: TargetView) -> None:
    """Draw targets and tips [mm] and make room for them."""
    goal, tip = targets.position / MILLIMETRE, targets.tip / MILLIMETRE
    reach = [np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]).T]
    known = np.asarray(np.isfinite(tip).all(axis=1))
    if known.any():
        axes.plot(*tip[known].T, ".", color=INK, markersize=3.5, zorder=7, label="tips")
        reach.append(tip[known])
    there = np.asarray(np.isfinite(goal).all(axis=1))
    if there.any():
        line = "-" if there.sum() > 1 else ""
        style: dict[str, Any] = {"markerfacecolor": "none", "markersize": 5, "linewidth": 0.7, "zorder": 6.5}
        axes.plot(*goal[there].T, marker="s", linestyle=line, color=WRONG, label="targets", **style)
        reach.append(goal[there])
    for k in range(len(goal)):
        if targets.distance[k] > 1e-3 * view.robot.length:
            axes.plot(*np.array([goal[k], tip[k]]).T, color=GREY, linewidth=0.8, linestyle=":", zorder=6.4)
    size = _DIRECTION * view.robot.length / MILLIMETRE
    for k in range(len(goal)):
        if not (np.isfinite(targets.direction[k]).all() and (there[k] or known[k])):
            continue
        start = goal[k] if there[k] else tip[k]
        end = start + size * targets.direction[k]
        axes.plot(*np.array([start, end]).T, color=WRONG, linewidth=0.9, zorder=6.5)
        reach.append(end[None])
    frame(axes, np.vstack(reach))


def _left(axes: Axes, x: Abscissa, targets: TargetView) -> None:
    """Draw distance and angle left."""
    distance, angle = DISTANCE.shown(targets.distance), ANGLE.shown(targets.angle)
    names = []
    for values, unit, name, shape, ink in (
        (distance, DISTANCE.unit, "distance", "o", INK),
        (angle, ANGLE.unit, "direction", "^", colour(1)),
    ):
        if np.isfinite(values).any():
            names.append(f"{name} left [{unit}]")
            shown = np.maximum(values, _LEAST_LEFT)
            axes.plot(x.values, shown, shape, color=ink, markersize=3.5, label=f"{name} left")
    plain(axes, x.label, f"{names[0]}" if len(names) == 1 else f"left [{DISTANCE.unit}] or [{ANGLE.unit}]")
    axes.set_yscale("log")
    everything = np.concatenate([distance, angle, [_LEAST_LEFT]])
    axes.set_ylim(_LEAST_LEFT / 3, max(1e-3, 5 * float(np.nanmax(everything))))
    if len(names) > 1:
        legend(axes)


def _explain_targets(figure: Figure, view: RunView, targets: TargetView) -> None:
    marks = []
    if np.isfinite(targets.position).any():
        marks.append(mark("target", WRONG, "s", markerfacecolor="none"))
    if np.isfinite(targets.direction).any():
        marks.append(mark("its direction", WRONG, line="-", linewidth=0.9))
    marks.append(mark("tip", INK, "."))
    if len(view.solved) < len(view.status):
        marks.append(mark("out of reach", WRONG, "x"))
    caption = "No target is met, so no shape is shown; dots are the nearest tips"
    if view.solved:
        caption = f"Target {view.solved[-1] + 1} cut open, chambers without pressure pale"
    _explain(figure, view, marks, caption, columnspacing=1.2)


# --- blocked forces ---------------------------------------------------------------------------------------------------


@in_own_style
def blocked_figure(view: RunView, contact: ContactView, measured: Sequence[tuple[float, float]] = ()) -> Figure:
    """Draw a blocked force; `measured` is (pressure [Pa] or offset [m], force [N]), whichever was varied.

    In 3-D the step of the largest force: the blocked body cut open, the free shape behind the wall, the wall's push as
    an arrow. Beside it force and bending angle against offset, pressure, time or step.
    """
    figure = _begun(view, f"{len(view.solved)} of {len(view.status)} steps solved", f"closure {contact.closure}")
    _wall_panel(figure, view, contact)
    x = _wall_abscissa(view, contact)
    panels = new_panels(figure, 3 if x.with_pressures else 2)
    series(panels[0], view, x, contact.force, FORCE.axis, least_span=0.01, std=_std(view, FORCE))
    _draw_measured(panels[0], x, measured)
    _bending(panels[1], view, contact, x)
    finish_panels(figure, panels, view, x)
    _explain_wall(figure, view, contact, bool(measured))
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


def _wall_abscissa(view: RunView, contact: ContactView) -> Abscissa:
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
    series(axes, view, x, BENDING.shown(view.bending_angle), BENDING.heading, std=_std(view, BENDING))
    free = BENDING.shown(contact.free_bending_angle)
    axes.plot(x.values, free, color=FREE, linewidth=1.4, linestyle=DASHES, zorder=2, label="free shape")
    both = np.concatenate([free, BENDING.shown(view.bending_angle)])
    if np.isfinite(both).any() and np.nanmax(both) - np.nanmin(both) >= 1:
        axes.autoscale()
        axes.relim()
        axes.autoscale_view()


def _wall_panel(figure: Figure, view: RunView, contact: ContactView) -> None:
    """Draw the step of the largest force at its wall, and the axes of the others."""
    k = shown_step(view, contact)
    if k is None:
        axes, reach = base_axes(figure, _CENTRE, view, Camera(-60.0, is_hanging(view.loads.gravity)))
        frame(axes, np.vstack(reach))
        return
    body, free = view.bodies[k], contact.free[k]
    assert body is not None
    assert free is not None
    L = view.robot.length / MILLIMETRE
    # From the robot's side of the wall, so that the free shape is what the wall veils.
    towards = -contact.normal[k][:2] if contact.has_wall else free.position[-1, :2]
    camera = side_camera(towards, 1e-6, view.loads.gravity, turn=-24.0)
    axes, reach = base_axes(figure, _CENTRE, view, camera)
    light = camera.light
    reach += _draw_free(axes, free, light)
    others = [j for j in view.solved if j != k]
    lines = [b.position / MILLIMETRE for j in others if (b := view.bodies[j]) is not None]
    shades = step_colours(len(view.bodies))[others]
    if lines:
        draw_lines(axes, lines, 1.4, colors=shades, zorder=2.5, label="axes of the steps")
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


def _draw_free(axes: Any, free: Body, light: Array) -> list[Array]:
    """Draw the free shape as a pale body and its axis dashed."""
    quads, normals = tube(free, free.radii.outer, (0, 0), _FACETS, _STATIONS)
    faces = shaded(normals, np.full(3, 0.9), light, contrast=0.1)
    end = free.position[-1] / MILLIMETRE + (disc(tip_radius(free) / MILLIMETRE, _FACETS, 0.0) @ free.rotation[-1].T)
    draw_faces(axes, quads, faces, zorder=2, label="free shape")
    draw_faces(axes, end, "#EFEFEF", FREE, 0.8, zorder=2.1)
    line = free.position / MILLIMETRE
    draw_lines(axes, [line], 1.4, colors=FREE, linestyles=DASHES, zorder=2.2, label="free axis")
    return [quads.reshape(-1, 3), end.reshape(-1, 3)]


def _draw_wall(axes: Any, point: Array, normal: Array, at: Array, view: RunView) -> Array:
    """Draw a piece of the wall about the contact point [mm]; return its corners (4, 3)."""
    up = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
    up = up / np.linalg.norm(up) if np.linalg.norm(up) > 1e-6 else np.array([1.0, 0.0, 0.0])
    side = np.cross(normal, up)
    middle = at - normal * float((at - point) @ normal)
    half = 1.1 * view.robot.outer_diameter / MILLIMETRE
    corners: Array = np.array([middle + half * (i * side + j * up) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    draw_faces(axes, corners[None], WALL, width=1.0, alpha=WALL_TINT, zorder=3, label="wall")
    clear = [(0.0, 0.0, 0.0, 0.0)]  # "none" is no colour at all, which matplotlib before 3.11 cannot sort by depth
    draw_faces(axes, corners[None], clear, WALL, 1.0, zorder=3.1)
    return corners


def _draw_cap(axes: Any, body: Body, cap: float, light: Array) -> Array:
    """Draw the rigid cap [mm] as a slim rod from tip to contact point; return the points it reaches."""
    R, p = body.rotation[-1], body.position[-1]
    rod = Body(np.array([p, p + cap * MILLIMETRE * R[:, 2]]), np.array([R, R]), body.radii)
    quads, normals = tube(rod, _CAP_RADIUS * tip_radius(body), (0, 0), _FACETS, 2)
    end = disc(_CAP_RADIUS * tip_radius(body) / MILLIMETRE, _FACETS, cap) @ R.T + p / MILLIMETRE
    faces = np.vstack([shaded(normals, np.full(3, 0.42), light), [[0.5, 0.5, 0.5]]])
    draw_faces(axes, [*quads, *end], faces, zorder=5.5, label="tip cap")
    return quads.reshape(-1, 3)


def _explain_wall(figure: Figure, view: RunView, contact: ContactView, measured: bool) -> None:
    from matplotlib.patches import Patch

    marks = [mark("free shape", FREE, line=DASHES, linewidth=1.4)]
    if contact.has_wall:
        marks.append(Patch(facecolor=WALL, alpha=0.5, label="wall"))
    caption = "No step has a solution, so no shape is shown"
    if (k := shown_step(view, contact)) is not None:
        where = " at the wall" if contact.has_wall else ""
        caption = f"Step {k + 1} cut open{where}, chambers without pressure pale; grey: free at the same pressure"
    _explain(figure, view, marks, caption, handlelength=1.6)
    if measured:
        square = mark("measured", INK, "s", markerfacecolor="none")
        legend(figure.axes[1], [square], loc="upper left", handlelength=1.6)
