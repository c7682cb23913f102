"""A NiceGUI element on which the pressure of one set over time is drawn with the mouse, a pen or a finger."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from nicegui.element import Element
from nicegui.events import GenericEventArguments

from softnlp.base.palette import colour


class PressureDraw(Element, component="pressure_draw.js"):
    """A picture of pressures over time; `on_drawn` tells of each stroke."""

    def __init__(self) -> None:
        """Make an empty picture; give it a height by style."""
        super().__init__()
        self._message: dict[str, Any] | None = None
        self._ready = False
        self.on("ready", self._begin)

    def show(self, curves: Sequence[Sequence[tuple[float, float]]], duration: float, top: float, active: int) -> None:
        """Show the points of each set, (time [s], pressure [bar]). active : the set that is drawn, from 0."""
        colours = [colour(k) for k in range(len(curves))]
        picture = {"curves": [[list(point) for point in points] for points in curves], "colours": colours}
        self._message = {**picture, "duration": duration, "top": top, "active": active}
        if self._ready:
            self.run_method("show", self._message)

    def on_drawn(self, handler: Callable[[list[list[float]]], Any]) -> None:
        """Call a handler with the points of each stroke: times [s] and pressures [bar]."""

        def told(event: GenericEventArguments) -> None:
            handler([[float(t), float(p)] for t, p in event.args["points"]])

        self.on("drawn", told)

    def _begin(self) -> None:
        self._ready = True
        if self._message is not None:
            self.run_method("show", self._message)
