"""A section with its thread rings as cast and stretched: its mesh, and how dense the energy is."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.figures.style import GREY, INK, SMALL, TEXT, in_own_style, legend, mark, new_figure, plain
from softnlp.model.materials import Material
from softnlp.model.robot import Robot
from softnlp.rings import energy_of, of_robot
from softnlp.rings.equilibrium import Equilibrium, Failed
from softnlp.rings.mesher import mesh
from softnlp.rings.outline import Array, PlaneSection
from softnlp.rings.response import follow

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_QUARTERS = ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))  # of a triangle of six nodes
_THREAD = (0, (2, 1.2))


@in_own_style
def rings_figure(robot: Robot, material: Material, stretch: float = 1.5) -> Figure:
    """Draw a robot's section as cast and at a stretch, without pressure, to one scale.

    Parameters
    ----------
    robot
        Of numbers.
    material
        Whose energy is shown; its constants are numbers.
    stretch
        Of the axis, everywhere the same.

    Raises
    ------
    RingError
        For a section that cannot be meshed.
    InputError
        Where no equilibrium is found at the stretch.
    """
    section, law = of_robot(robot), energy_of(material)
    equilibrium = Equilibrium(section, mesh(section), law)
    rest = equilibrium.rest()
    try:
        balance = follow(equilibrium, rest, stretch)
    except Failed as failed:
        last = failed.args[0].stretch
        raise InputError(f"no equilibrium was found beyond stretch {last:.3g}", key="stretch") from None
    uniaxial = float(law.uniaxial(np.array([stretch]))[0])
    ratio = balance.energy / (equilibrium.elements.weight.sum() * uniaxial) if stretch != 1 else 1.0
    words = f"{material.name}, {material.law.name}  ·  mean energy {ratio:.3f} of that in uniaxial stress"
    figure = new_figure(9.6, 5.0, f"{robot.name}, rings of thread that keep their radius", words)
    density = equilibrium.densities(balance) / 1e3
    for left, title, places, top in (
        (0.06, "as cast", rest.places, 0.0),
        (0.49, f"at stretch {stretch:g}", balance.places, max(float(density.max()), 1e-9)),
    ):
        axes = figure.add_axes((left, 0.13, 0.39, 0.69))
        plain(axes, "x [mm]", "y [mm]")
        axes.grid(False)
        axes.set_title(title, size=TEXT, color=INK, loc="left")
        axes.set_aspect("equal")
        bound = 1.05 * float(robot.outer_radius) / MILLIMETRE
        axes.set_xlim(-bound, bound)
        axes.set_ylim(-bound, bound)
        shown = _whole(axes, section, equilibrium, places / MILLIMETRE, density, top)
    bar = figure.colorbar(shown, cax=figure.add_axes((0.905, 0.13, 0.015, 0.69)))
    bar.set_label("energy density [kPa]", size=TEXT, color=INK)
    bar.ax.tick_params(labelsize=SMALL, colors=INK)
    legend(
        figure, [mark("thread", INK, line=_THREAD), mark("free surface", GREY, line="-")], loc="upper right", ncols=2
    )
    return figure


def _whole(
    axes: Axes, section: PlaneSection, equilibrium: Equilibrium, places: Array, values: Array, top: float
) -> Any:
    """Draw the mirror images of the sector around the axis, with colours up to `top` [kPa], and return these."""
    from matplotlib.tri import Triangulation

    shown = None
    on = equilibrium.mesh
    quarters = np.vstack([on.triangles[:, quarter] for quarter in _QUARTERS])
    for turn in range(section.mirrors):
        angle = 2 * pi * turn / section.mirrors
        rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        for side in (1.0, -1.0):
            xy = places * [1.0, side] @ rotation
            if top:
                small = Triangulation(xy[:, 0], xy[:, 1], quarters)
                shown = axes.tripcolor(small, facecolors=np.tile(values, len(_QUARTERS)), vmin=0.0, vmax=top)
            axes.triplot(
                Triangulation(xy[:, 0], xy[:, 1], on.triangles[:, :3]), color="white" if top else GREY, linewidth=0.25
            )
            for loop, nodes in on.sides.items():
                if loop >= 0:
                    thread = 0 < loop <= len(section.rings)
                    path = xy[_along(on.triangles, set(nodes.tolist()))]
                    look: dict[str, Any] = {"color": INK if thread else GREY, "linestyle": _THREAD if thread else "-"}
                    axes.plot(path[..., 0].T, path[..., 1].T, linewidth=1.1, **look)
    return shown


def _along(triangles: Any, side: set[int]) -> Any:
    """Return the (edges, 3) nodes of the triangles' edges on a loop: end, middle, end."""
    edges = np.vstack([triangles[:, edge] for edge in ([0, 3, 1], [1, 4, 2], [2, 5, 0])])
    return edges[np.isin(edges, list(side)).all(axis=1)]
