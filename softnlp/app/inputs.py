"""What panels need of what they edit: a session, or one segment of its robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.scenario.read import Scenario


class Tables(Protocol):
    """Tables of a scenario as plain Python."""

    def get(self, table: str, key: str, default: Any = None) -> Any:
        """Return a value, or the default."""
        ...

    def table(self, name: str) -> dict[str, Any]:
        """Return a whole table; empty where there is none."""
        ...


class Inputs(Protocol):
    """As `softnlp.app.session.Session`."""

    folder: Path

    @property
    def document(self) -> Tables:
        """What is on the screen."""
        ...

    @property
    def scenario(self) -> Scenario | None:
        """What the last text that made sense says."""
        ...

    @property
    def problem(self) -> InputError | None:
        """Why the text on the screen makes none."""
        ...

    @property
    def pressure(self) -> NDArray[np.float64]:
        """(sets,) shown [Pa]."""
        ...

    def table(self, name: str) -> dict[str, Any]:
        """Return a whole table as plain Python."""
        ...

    def change(self, table: str, key: str, value: object) -> None:
        """Set a key, or take it out for None."""
        ...

    def change_all(self, table: str, values: Mapping[str, object] | None) -> None:
        """Put these keys in place of a whole table's."""
        ...

    def on_scenario(self, listener: Callable[[], None]) -> None:
        """Call a function after each change."""
        ...

    def on_pressure(self, listener: Callable[[], None]) -> None:
        """Call a function after each change of the pressures."""
        ...
