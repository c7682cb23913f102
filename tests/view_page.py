"""A page with a robot view alone, on which the browser test draws circular arcs: PORT as the only argument."""

from __future__ import annotations

import sys
from time import perf_counter

import numpy as np
from arc_runs import arc_pose
from nicegui import ui

from softnlp.app.view import Frame, RobotView, frame_of
from softnlp.figures.style import step_colours
from softnlp.model.robot import robot
from softnlp.results import Body
from softnlp.statics.wall import Wall

ARM = robot("D25L60")
FULL = 1.5e5
LOADS = {"tip_force": (0.0, -0.2, -0.4), "tip_moment": (0.0, 0.01, 0.0), "gravity": (0.0, 0.0, -9.80665)}
# Waits in the browser until a frame is drawn.
DRAWN = """
const box = document.querySelector(".softnlp-view");
while (Number(box.dataset.frame) < %d) await new Promise(requestAnimationFrame);
return true;
"""


def shape(level: float, turn: float = 0.0) -> tuple[Body, np.ndarray]:
    """Return the arc whose three sets follow one another by 120 degrees, and its pressures [Pa]."""
    phase = 2 * np.pi * (turn - np.arange(3) / 3)
    pressure = FULL * level * np.clip(np.cos(phase), 0, None)
    pose = arc_pose(ARM, pressure)
    return Body(pose.shape.position, pose.shape.rotation, pose.radii), pressure


def frame(level: float, turn: float = 0.0, *, loaded: bool = False) -> Frame:
    body, pressure = shape(level, turn)
    if not loaded:
        return frame_of(ARM, body, pressure)
    wall = Wall(np.array([body.position[-1, 0] - 4e-3, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    contact = {"wall": wall, "wall_force": 0.71, "tip_cap": 4e-3}
    return frame_of(ARM, body, pressure, ghost=shape(0.75 * level, turn)[0], **contact, **LOADS)


@ui.page("/")
def page(dark: bool = False) -> None:
    ui.dark_mode(dark)
    view = RobotView().classes("w-full").style("height: 80vh")
    view.show(frame(0.0))
    picked = ui.label("").props("id=picked")
    view.on_pick(lambda point: picked.set_text(" ".join(f"{value:.3f}" for value in point)))
    said = ui.label("").props("id=said")

    async def turn_round() -> None:
        """Show twenty frames, each as soon as the last is drawn; say the median of show to drawn [ms]."""
        taken = []
        for k in range(20):
            shown = frame(0.9, k / 20)
            start = perf_counter()
            number = view.show(shown)
            await ui.run_javascript(DRAWN % number, timeout=10)
            taken.append(perf_counter() - start)
        said.set_text(f"{number} {1e3 * np.median(taken):.1f}")

    def cloud() -> None:
        xyz = np.array(
            [1e3 * shape(a, b)[0].position[-1] for a in np.linspace(0.1, 1, 9) for b in np.arange(0, 1, 0.04)]
        )
        view.points(xyz, step_colours(len(xyz))[:, :3])
        view.targets(np.array([[30.0, 0.0, 50.0], [0.0, 25.0, 60.0]]))

    async def picture() -> None:
        content = await view.picture()
        said.set_text(f"png {len(content)} {content[:8].hex()} {int.from_bytes(content[16:20], 'big')}")

    with ui.row():
        ui.button("bend", on_click=lambda: view.show(frame(0.8))).props("id=bend")
        ui.button("load", on_click=lambda: view.show(frame(0.8, 0.03, loaded=True))).props("id=load")
        ui.button("hang", on_click=lambda: view.show(frame_of(ARM, *shape(0.8), gravity=(0, 0, 9.8)))).props("id=hang")
        ui.button("round", on_click=turn_round).props("id=round")
        ui.button("cloud", on_click=cloud).props("id=cloud")
        ui.button("picture", on_click=picture).props("id=picture")
        ui.button("reset", on_click=view.reset).props("id=reset")


if __name__ in {"__main__", "__mp_main__"}:
    ui.run(host="127.0.0.1", port=int(sys.argv[1]), show=False, reload=False)
