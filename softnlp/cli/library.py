"""`softnlp robots` and `softnlp materials`: what the library holds."""

from __future__ import annotations

from pathlib import Path

from softnlp.cli.console import say_rows


def robots() -> None:
    """List the robots of the library with their dimensions."""
    from softnlp.model.robot import DIMENSIONS, ROBOTS

    rows = []
    for robot in ROBOTS.values():
        values = [getattr(robot, d.field) / (d.scale or 1) for d in DIMENSIONS]
        rows.append([robot.name, *(f"{value:g}" for value in values)])
    say_rows(["name", *(d.file_key for d in DIMENSIONS)], rows)


def materials(*, file: Path | None = None) -> None:
    """List the silicones with their laws and constants.

    Parameters
    ----------
    file
        A materials file of your own; the shipped one by default.
    """
    from softnlp.model.materials import load_materials

    rows = []
    for entry in load_materials(file).values():
        for law, material in entry.models.items():
            constants = (f"{c.file_key} = {material.constants[c.name] / c.scale:.7g}" for c in material.law.constants)
            note = f" (derived: {entry.derived[law]})" if law in entry.derived else ""
            rows.append([entry.name, law, f"{material.density:g}", ", ".join(constants) + note])
    say_rows(["silicone", "model", "density_kg_m3", "constants"], rows)
