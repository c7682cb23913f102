"""From one reading of the equations to another: keys that mean nothing there are put aside, and come back."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

from softnlp.app.inputs import Tables
from softnlp.app.session import Session
from softnlp.scenario.energy import NOT_OF_ENERGY, misplaced

Data = dict[str, Any]

ENERGY = "energy"
_OTHERS_FREE = ("k_e", "k_b")  # what is identified first, where c_m cannot be


def is_energy(document: Tables) -> bool:
    """Whether a scenario is read by the energy section."""
    return bool(document.get("corrections", "conventions") == ENERGY)


@dataclass
class Aside:
    """Keys that the conventions on the screen do not take, by table, and of which document."""

    of: Any = None
    kept: dict[str, Data] = field(default_factory=dict)


def turn(session: Session, conventions: str, aside: Aside) -> None:
    """Read the scenario by other conventions; what they do not take is put aside, what they take again comes back."""
    document = session.document
    if document.get("corrections", "conventions", "reproduction") == conventions:
        return
    if aside.of is not document:
        aside.of, aside.kept = document, {}
    before = document.own()
    data = deepcopy(before)
    corrections = data.setdefault("corrections", {})
    corrections.pop("conventions", None)
    if conventions != "reproduction":
        corrections["conventions"] = conventions
    back = {name: dict(values) for name, values in aside.kept.items()}
    for name, values in back.items():
        data[name] = {**values, **data.get(name, {})}
    data, taken = without_misplaced(data)
    aside.kept = taken
    for name in {*before, *data}:
        after = data.get(name)
        if isinstance(before.get(name, {}), Mapping) and isinstance(after or {}, Mapping) and after != before.get(name):
            document.replace(name, after or None)
    session.reread()


def without_misplaced(data: Data) -> tuple[Data, dict[str, Data]]:
    """Return tables without what their conventions do not take, and the keys that were taken out, by table."""
    data, taken = deepcopy(data), dict[str, Data]()
    for error in list(misplaced(data)):
        name, key = error.table or "", error.key or ""
        table = data.get(name)
        if name == "segment" or not isinstance(table, dict):
            continue
        if name == "stiffening":
            taken[name] = data.pop(name)
        elif name == "measurements" and key == "free":
            energy = data.get("corrections", {}).get("conventions") == ENERGY
            left = [one for one in table[key] if one not in (NOT_OF_ENERGY if energy else ("c_m",))]
            table[key] = left or (["c_m"] if energy else list(_OTHERS_FREE))
            bounds = {one: pair for one, pair in table.get("bounds", {}).items() if one in table[key]}
            if "bounds" in table:
                table["bounds"] = bounds
        elif name in ("choices", "actuation"):
            *way, last = key.split(".")
            inner = table
            for part in way:
                inner = inner[part]
            ends = inner[last]
            inner[last] = [ends["from"], ends["to"]] if name == "choices" else ends["to"]
        elif key.startswith("vary."):
            _drop(table.get("vary", {}), key.removeprefix("vary."))
        elif key in table:
            taken.setdefault(name, {})[key] = table.pop(key)
    return {name: table for name, table in data.items() if table != {}}, taken


def _drop(table: Data, key: str) -> None:
    """Take out a key that is written with dots, or as tables in each other."""
    if key in table:
        del table[key]
        return
    first, _, rest = key.partition(".")
    if isinstance(table.get(first), dict):
        table[first].pop(rest, None)
        if not table[first]:
            del table[first]
