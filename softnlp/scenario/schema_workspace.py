"""The tables of a workspace sweep, in the units of the file."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from softnlp.scenario.schema import ContactTable, NotNegative, PressureTable, ScenarioFile, Table

MOST_LEVELS = 20_000_000


class WorkspaceTable(Table):
    """[workspace]: a grid or samples of pressures, and what else differs between poses.

    `vary` holds a table for each varied key; `softnlp.scenario.workspace` reads those.
    """

    levels: Annotated[int, Field(ge=1, le=MOST_LEVELS)] | None = None
    samples: Annotated[int, Field(ge=1)] | None = None
    from_bar: NotNegative = 0.0
    to_bar: NotNegative | None = None
    sets: Annotated[list[int], Field(min_length=1)] | None = None
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    vary: dict[str, Any] = Field(default_factory=dict)


class WorkspaceFile(ScenarioFile):
    """A whole scenario of `workspace`."""

    workspace: WorkspaceTable = WorkspaceTable()
    pressure: PressureTable | None = None
    contact: ContactTable | None = None
