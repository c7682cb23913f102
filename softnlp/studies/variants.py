"""Variants of the model that are compared with one measurement: law, coefficients, conventions, closure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

from softnlp.model.conventions import COEFFICIENT_SETS, REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material

NAMED: Mapping[str, Coefficients] = {**COEFFICIENT_SETS, "none": Coefficients(elongation=0.0, bending=0.0)}
"""Coefficients by name; none has no stiffening: k_e = k_b = 0, phi = 0."""

OWN = "scenario"
"""What coefficients are called that are of no name."""


@dataclass(frozen=True, eq=False)
class Variant:
    """One way to simulate what was measured.

    Attributes
    ----------
    material
        Silicone and law.
    coefficients
        Stiffening and corrections [1].
    conventions
        How ambiguous equations are read.
    closure
        Of a blocked force; None for that of the wall's settings.
    named
        What the coefficients are called.
    """

    material: Material
    coefficients: Coefficients = Coefficients()
    conventions: Conventions = REPRODUCTION
    closure: str | None = None
    named: str = "reproduction"

    @property
    def law(self) -> str:
        """The law's name."""
        return self.material.law.name


def every_variant(
    materials: Sequence[Material],
    coefficients: Mapping[str, Coefficients],
    conventions: Sequence[Conventions] = (REPRODUCTION,),
    closures: Sequence[str | None] = (None,),
) -> tuple[Variant, ...]:
    """Return every combination of silicones with their laws, coefficients by name, conventions and closures."""
    every = product(materials, coefficients.items(), conventions, closures)
    return tuple(Variant(m, values, reading, closure, name) for m, (name, values), reading, closure in every)


def named_coefficients(name: str, given: Coefficients) -> Coefficients:
    """Return a named set with what no set is about, k_a and k_i, as given; none keeps k_c as given, too."""
    chosen = replace(NAMED[name], area=given.area, inertia=given.inertia)
    return replace(chosen, chamber_reaction=given.chamber_reaction) if name == "none" else chosen


def labels(variants: Sequence[Variant]) -> list[str]:
    """Return what tells each variant from the others in a few words; all of it where nothing differs."""
    parts = [(v.law, v.named, v.conventions.name, v.closure or "") for v in variants]
    differs = [len(set(column)) > 1 for column in zip(*parts, strict=True)]
    if not any(differs):
        differs = [True, True, False, bool(variants[0].closure)]
    return [", ".join(word for word, shown in zip(row, differs, strict=True) if shown) for row in parts]
