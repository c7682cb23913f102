"""A NiceGUI element that draws a robot in 3-D and follows it in place."""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Callable, Sequence
from typing import Any

import nicegui.elements.scene  # noqa: F401  registers the three.js that the browser side imports
from nicegui.element import Element
from nicegui.events import GenericEventArguments
from numpy.typing import NDArray

from softnlp.app.view.frame import Frame, Layout, cloud_message, frame_message, layout_of, pieces_message
from softnlp.base.units import BAR

Point = tuple[float, float, float]

_PICTURE_WAIT = 10.0  # for the browser to draw and encode it [s]


class RobotView(Element, component="robot_view.js", esm={"softnlp-view": "js"}):
    """A 3-D view, to be made inside a NiceGUI page; give it a height by style or classes.

    What is shown before the browser is there, or when it comes back, is sent as soon as it is.
    """

    def __init__(self, *, full_pressure: float = 1.5 * BAR) -> None:
        """Make an empty view; `full_pressure` [Pa] is that at which a chamber has its full colour."""
        super().__init__()
        self._full_bar = full_pressure / BAR
        self._ready = False
        self._layout: Layout | None = None
        self._number = 0
        self._frame: Frame | None = None
        self._marks: dict[str, Any] = {}
        self._pickers: list[Callable[[GenericEventArguments], Any]] = []
        self.on("ready", self._begin)
        self._movers: list[Callable[[int, Point, bool], Any]] = []
        self.on("moved", self._moved)
        self.on("pick", self._picked)  # now: a listener that comes later has the browser make the view anew

    def show(self, frame: Frame) -> int:
        """Draw a frame in place of the last one; return its number, which the DOM node has as data-frame once drawn."""
        self._number += 1
        self._frame = frame
        self._send_frame()
        return self._number

    def reset(self) -> None:
        """Turn the camera back to where it began."""
        self._call("reset")

    def clear_trail(self) -> None:
        """Forget where the tip has been."""
        self._call("clearTrail")

    def points(self, xyz_mm: NDArray[Any] | None, colours: NDArray[Any] | None = None) -> None:
        """Show a cloud of points.

        Parameters
        ----------
        xyz_mm : (n, 3) [mm], or None for no cloud. Points that are not finite are left out.
        colours : (n, 3) red, green, blue from 0 to 1; grey when there are none.

        Raises
        ------
        ValueError
            For other shapes.
        """
        self._mark("points", cloud_message(xyz_mm, colours))

    def targets(self, xyz_mm: NDArray[Any] | None) -> None:
        """Show (n, 3) targets [mm], or none; raises as `points` does."""
        self._mark("targets", cloud_message(xyz_mm, None))

    def pins(self, messages: Sequence[dict[str, Any]]) -> None:
        """Show other bodies as ghosts with a letter at the tip, each a message of its robot, tube, colour and label."""
        self._mark("pins", {"pins": list(messages)})

    def obstacles(self, messages: Sequence[dict[str, Any]]) -> None:
        """Show obstacles, each a message of `obstacle_message`."""
        self._mark("obstacles", {"obstacles": list(messages)})

    def on_moved(self, handler: Callable[[int, Point, bool], Any]) -> None:
        """Call a handler as an obstacle is dragged or moved by keys: number from 0, how far [mm], if that is all."""
        self._movers.append(handler)

    def parts(self, message: dict[str, Any] | None) -> None:
        """Show the parts of a mould in place of the robot, or the robot again for None.

        message : `name`; `apart` as of `explode`; `solids`, each with `points` and `faces` (`wide`: of 32 bits),
        `colour` and `opacity`; `places`, each with the index of its `solid`, `turn` about z [deg], and
        `at` and `apart` (3,) [mm]: where it is, and how far it goes when all are apart.
        """
        self._mark("parts", message)

    def explode(self, share: float) -> None:
        """Draw the parts from together, 0, to apart, 1."""
        if (shown := self._marks.get("parts")) is not None:
            shown["apart"] = share
            self._call("explode", share)

    def on_pick(self, handler: Callable[[Point], Any]) -> None:
        """Call a handler with (x, y, z) [mm] when the view is clicked, not dragged.

        The point lies on the upright plane through the base's axis that faces the viewer; seen steeply from above or
        below, on the level plane through the tip.
        """
        self._pickers.append(lambda event: handler(_point(event)))

    def on_sight(self, handler: Callable[[Point, Point], Any]) -> None:
        """Call a handler where the view is clicked, with the viewer's place [mm] and the direction of sight, a unit."""
        self._pickers.append(lambda event: handler(_vector(event, "from"), _vector(event, "along")))

    async def picture(self) -> bytes:
        """Return the view as a PNG of twice its size on the screen.

        Raises
        ------
        TimeoutError
            When the browser does not answer.
        RuntimeError
            When there is no browser to draw it.
        """
        if not self._ready:
            raise RuntimeError("the view has no browser yet that could draw it")
        url = await self.run_method("picture", timeout=_PICTURE_WAIT)
        if not isinstance(url, str) or not url.startswith("data:image/png;base64,"):
            raise RuntimeError("the browser could not draw the view")
        return b64decode(url.partition(",")[2])

    def download(self, name: str = "robot.png") -> None:
        """Have the browser save the picture under a name."""
        self._call("download", name)

    def _moved(self, event: GenericEventArguments) -> None:
        for tell in self._movers:
            tell(int(event.args["number"]), _vector(event, "by"), bool(event.args["done"]))

    def _picked(self, event: GenericEventArguments) -> None:
        for tell in self._pickers:
            tell(event)

    def _begin(self) -> None:
        """Send everything to a browser that has just made the element, for the first time or again."""
        self._ready = True
        self._layout = None
        for name, message in self._marks.items():
            self._call(name, message)
        if self._frame is not None:
            self._send_frame()

    def _send_frame(self) -> None:
        frame = self._frame
        if not self._ready or frame is None:
            return
        layout = layout_of(frame.robot)
        if layout != self._layout:
            self._call("robot", pieces_message(frame.robot))
            self._layout = layout
        self._call("show", frame_message(frame, self._number, self._full_bar))

    def _mark(self, name: str, message: dict[str, Any] | None) -> None:
        self._marks[name] = message
        self._call(name, message)

    def _call(self, method: str, *arguments: Any) -> None:
        """Call a method of the browser side; before there is one, what matters is kept and sent later."""
        if self._ready:
            self.run_method(method, *arguments)


def _point(event: GenericEventArguments) -> Point:
    x, y, z = (float(event.args[axis]) for axis in "xyz")
    return x, y, z


def _vector(event: GenericEventArguments, name: str) -> Point:
    x, y, z = (float(number) for number in event.args[name])
    return x, y, z
