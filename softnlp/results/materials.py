"""The silicones of a materials file as plain data, and how far their sets of constants lie apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.units import MEGAPASCAL
from softnlp.model.inputs import material_table, package_version, tidy
from softnlp.model.material_sets import PROVENANCE
from softnlp.model.materials import MaterialEntry, MaterialSet

STRETCHES = (1.1, 1.3, 2.0)
"""Where sets are compared: small, that of a robot under pressure, and the end of the range of most fits."""


@dataclass(frozen=True, eq=False)
class ComparedSets:
    """The engineering stress of one law by the sets of one silicone, at `STRETCHES`.

    Attributes
    ----------
    silicone, law
        Their names.
    stresses
        (3,) by the name of the set [Pa].
    """

    silicone: str
    law: str
    stresses: Mapping[str, Array]

    @property
    def ratio(self) -> Array:
        """The largest stress over the least (3,) [1]."""
        every = np.array(list(self.stresses.values()))
        found: Array = every.max(axis=0) / every.min(axis=0)
        return found

    @property
    def deviation(self) -> Array:
        """The standard deviation over the sets, relative to their mean (3,) [1]."""
        every = np.array(list(self.stresses.values()))
        found: Array = every.std(axis=0, ddof=1) / every.mean(axis=0)
        return found


def compared_sets(entries: Mapping[str, MaterialEntry]) -> list[ComparedSets]:
    """Return the stresses of each law that several sets of a silicone have constants of."""
    found = []
    for entry in entries.values():
        for law in dict.fromkeys(law for chosen in entry.sets.values() for law in chosen.models):
            having = [chosen for chosen in entry.sets.values() if law in chosen.models]
            if len(having) > 1:
                stresses = {s.name: np.asarray(s.models[law].engineering_stress(np.array(STRETCHES))) for s in having}
                found.append(ComparedSets(entry.name, law, stresses))
    return found


def comparison_document(entries: Mapping[str, MaterialEntry]) -> dict[str, Any]:
    """Return `compared_sets` as plain data; stress in MPa."""
    return {
        "softnlp": package_version(),
        "stretch": list(STRETCHES),
        "sets": _sets(entries),
        "materials": [
            {
                "name": one.silicone,
                "model": one.law,
                "engineering_stress_MPa": {name: (s / MEGAPASCAL).tolist() for name, s in one.stresses.items()},
                "ratio": one.ratio.tolist(),
                "relative_deviation": one.deviation.tolist(),
            }
            for one in compared_sets(entries)
        ],
    }


def library_document(entries: Mapping[str, MaterialEntry]) -> dict[str, Any]:
    """Return every set of every silicone as plain data."""
    return {
        "softnlp": package_version(),
        "sets": _sets(entries),
        "materials": [
            {"set": chosen.name, **material_table(model), "derived": chosen.derived.get(law)}
            for entry in entries.values()
            for chosen in entry.sets.values()
            for law, model in chosen.models.items()
        ],
    }


def provenance(chosen: MaterialSet) -> dict[str, str]:
    """Return where the constants of a set come from, in words; "" where that is not said."""
    return {key: getattr(chosen, key) for key in PROVENANCE}


def _sets(entries: Mapping[str, MaterialEntry]) -> list[dict[str, Any]]:
    return [
        {
            "name": entry.name,
            "set": chosen.name,
            **provenance(chosen),
            "fitted_stretch": [tidy(s) for s in next(iter(chosen.models.values())).fitted_stretch],
            "models": list(chosen.models),
        }
        for entry in entries.values()
        for chosen in entry.sets.values()
    ]
