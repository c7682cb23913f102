"""`softnlp robots` and `softnlp materials`: what the library holds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError, RobotError
from softnlp.base.units import KILOPASCAL
from softnlp.cli.console import say, say_rows
from softnlp.cli.study import Json

if TYPE_CHECKING:
    from softnlp.model.materials import MaterialEntry


def robots(
    *,
    fit: bool = False,
    outer_diameter_mm: float | None = None,
    lumen_diameter_mm: float | None = None,
    chamber_diameter_mm: float | None = None,
    chamber_sets: int = 3,
    chambers_per_set: int = 2,
    chamber_wall_mm: float = 0.5,
    length_mm: float = 60.0,
) -> None:
    """List the robots of the library, or with --fit say where the chambers of your own go.

    --fit takes outer, lumen and chamber diameter and puts the chambers in the middle of the wall, evenly around. It
    prints each dimension with the least and the most that can be made when it alone is changed, and a table [robot].

    Parameters
    ----------
    fit
        Find chamber circle and angle for the sizes below.
    outer_diameter_mm
        D_r.
    lumen_diameter_mm
        D_i, the central hole.
    chamber_diameter_mm
        D_c, of a chamber's bore.
    chamber_sets
        n1, one pressure each.
    chambers_per_set
        n2.
    chamber_wall_mm
        delta_c, silicone between bore and thread.
    length_mm
        L_0, without pressure.
    """
    sizes = (outer_diameter_mm, lumen_diameter_mm, chamber_diameter_mm)
    if fit:
        _fit(sizes, chamber_sets, chambers_per_set, chamber_wall_mm, length_mm)
        return
    if any(size is not None for size in sizes):
        raise InputError("expected together with the sizes of a robot of your own", key="--fit")
    from softnlp.model.robot import DIMENSIONS, ROBOTS

    rows = []
    for robot in ROBOTS.values():
        values = [getattr(robot, d.field) / (d.scale or 1) for d in DIMENSIONS]
        rows.append([robot.name, *(f"{value:g}" for value in values)])
    say_rows(["name", *(d.file_key for d in DIMENSIONS)], rows)


def _fit(sizes: tuple[float | None, ...], sets: int, each: int, wall: float, length: float) -> None:
    """Print the robot of some sizes [mm]."""
    from softnlp.base.units import MILLIMETRE
    from softnlp.model.fit import fit_robot, fit_rows
    from softnlp.model.robot import DIMENSIONS

    keys = {d.field: f"--{d.file_key.replace('_', '-')}" for d in DIMENSIONS}
    for size, field in zip(sizes, ("outer_diameter", "lumen_diameter", "chamber_diameter"), strict=True):
        if size is None:
            raise InputError("missing; --fit needs it", key=keys[field])
    outer, lumen, bore = (MILLIMETRE * (size or 0.0) for size in sizes)
    try:
        found = fit_robot(*(outer, lumen, bore, sets, each), chamber_wall=wall * MILLIMETRE, length=length * MILLIMETRE)
    except RobotError as error:
        raise RobotError(error.message, key=keys.get(error.key or "", error.key)) from None
    rows = fit_rows(found)
    say_rows(["key", "value", "least", "most"], rows)
    say("\n[robot]")
    for key, value, *_ in rows:
        say(f"{key} = {value}")


def materials(*, file: Path | None = None, compare: bool = False, json: Json = False) -> None:
    """List the silicones: their sets of constants, where each comes from, and their laws.

    Parameters
    ----------
    file
        A materials file of your own; the shipped one by default.
    compare
        Show the stress of each law at some stretches by every set, and how far the sets lie apart, for the silicones
        that have several.
    json
        Print one JSON document instead of tables; stresses and constants in the units of their keys.
    """
    from softnlp.model.materials import load_materials

    entries = load_materials(file)
    if json:
        from softnlp.results.document import document_text
        from softnlp.results.materials import comparison_document, library_document

        say(document_text(comparison_document(entries) if compare else library_document(entries)).rstrip("\n"))
    elif compare:
        _show_comparison(entries)
    else:
        _show_library(entries)


def _show_library(entries: Mapping[str, MaterialEntry]) -> None:
    from softnlp.results.materials import provenance

    rows, said = [], {}
    for entry, chosen in [(one, chosen) for one in entries.values() for chosen in one.sets.values()]:
        for law, material in chosen.models.items():
            constants = (f"{c.file_key} = {material.constants[c.name] / c.scale:.7g}" for c in material.law.constants)
            note = f" (derived: {chosen.derived[law]})" if law in chosen.derived else ""
            rows.append([entry.name, chosen.name, law, f"{material.density:g}", ", ".join(constants) + note])
        low, high = next(iter(chosen.models.values())).fitted_stretch
        words = [f"{key}: {text}" for key, text in provenance(chosen).items() if text]
        said[entry.name, chosen.name] = "; ".join([*words, f"stretch {low:g} to {high:g}"])
    say_rows(["silicone", "set", "model", "density_kg_m3", "constants"], rows)
    for text in dict.fromkeys(said.values()):
        alike = [name for (name, _), other in said.items() if other == text]
        names = {chosen for (_, chosen), other in said.items() if other == text}
        say(f"\n{', '.join(sorted(names))} ({', '.join(alike)}): {text}")


def _show_comparison(entries: Mapping[str, MaterialEntry]) -> None:
    from softnlp.results.materials import STRETCHES, compared_sets

    header = ["silicone", "model", "stretch", "stress [kPa] by set", "largest / least"]
    rows = []
    for one in compared_sets(entries):
        for k, stretch in enumerate(STRETCHES):
            stresses = ", ".join(f"{name} {stress[k] / KILOPASCAL:.4g}" for name, stress in one.stresses.items())
            rows.append([one.silicone, one.law, f"{stretch:g}", stresses, f"{one.ratio[k]:.2f}"])
    say_rows(header, rows)
    alone = [name for name, entry in entries.items() if len(entry.sets) < 2]
    if alone:
        say(f"\nwith one set: {', '.join(alone)}")
