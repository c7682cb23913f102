"""Robots, silicones and runs as HTML, as a notebook shows them: numbers with units, a drawing, and what to mind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import Any

import numpy as np

from softnlp.app.section_svg import section_svg
from softnlp.base.columns import SYMBOLS
from softnlp.base.palette import colour
from softnlp.model.materials import Material
from softnlp.model.robot import DIMENSIONS, Robot, is_number
from softnlp.results.table import table_lines
from softnlp.statics.step import Run

_CELL = "padding:0.15em 0.7em;border-bottom:1px solid rgba(128,128,128,0.3);font-variant-numeric:tabular-nums"
_MOST_STEPS = 40  # of a run that are shown
_CURVE = (260.0, 150.0, 34.0)  # width, height and margin of the drawing of a law [px]


def html_of(shown: Any) -> str:
    """Return the HTML of a robot, a material or a run."""
    writers: dict[type, Callable[[Any], str]] = {Robot: _robot, Material: _material, Run: _run}
    for kind, write in writers.items():
        if isinstance(shown, kind):
            return write(shown)
    raise TypeError(f"no HTML is known of a {type(shown).__name__}")


def _robot(robot: Robot) -> str:
    if "" not in robot.parts:
        return "".join(f"<p><b>{escape(name)}</b></p>{_robot(part)}" for name, part in robot.parts.items())
    rows = []
    for dimension in DIMENSIONS:
        value = getattr(robot, dimension.field)
        in_file = "" if dimension.scale is None else dimension.file_key.rpartition("_")[2]
        unit = in_file if is_number(value) else "SI"
        name = dimension.field.replace("_", " ")
        rows.append((name, SYMBOLS.get(dimension.field, ""), _text(value, dimension.scale or 1), unit))
    table = _table(("dimension", "symbol", "value", "unit"), rows)
    numbers = all(is_number(getattr(robot, dimension.field)) for dimension in DIMENSIONS)
    drawing = f'<div style="flex:0 0 316px">{section_svg(robot)}</div>' if numbers else ""
    return _beside(f"<b>{escape(robot.name)}</b>", table, drawing)


def _material(silicone: Material) -> str:
    rows = [
        (constant.name, _text(silicone.constants[constant.name], 1e6 if constant.unit == "MPa" else 1), constant.unit)
        for constant in silicone.law.constants
    ]
    low, high = silicone.fitted_stretch
    rows.append(("density", _text(silicone.density), "kg/m³"))
    rows.append(("fitted stretch", f"{low:g} to {high:g}", ""))
    known = all(is_number(value) for value in silicone.constants.values())
    if known:
        rows.append(("shear modulus at stretch 1", _text(silicone.shear_modulus(1.0), 1e3), "kPa"))
    source = f", set {silicone.set}" if silicone.set else ""
    title = f"<b>{escape(silicone.name)}</b>, {escape(silicone.law.name)}{escape(source)}"
    return _beside(title, _table(("constant", "value", "unit"), rows), _stress_svg(silicone) if known else "")


def _run(run: Run) -> str:
    """Return the table that the command prints, with its lines of words below it."""
    from rich.console import Console
    from rich.table import Table

    console, parts = Console(width=10_000), [f"<b>{escape(run.title or run.study)}</b>"]
    parts.append(f"<p>{escape(run.robot.name)}, {escape(run.material.name)} ({escape(run.material.law.name)})</p>")
    for part in table_lines(run).renderables:
        if isinstance(part, Table):
            header = [str(column.header).replace("\n", " ") for column in part.columns]
            rows = list(zip(*([str(cell) for cell in column.cells] for column in part.columns), strict=True))
            parts.append(_table(header, rows[:_MOST_STEPS]))
            if len(rows) > _MOST_STEPS:
                parts.append(f"<p>and {len(rows) - _MOST_STEPS} steps more</p>")
        else:
            parts.append(f"<p>{escape(console.render_str(str(part), markup=False).plain)}</p>")
    return f"<div>{''.join(parts)}</div>"


def _text(value: Any, scale: float = 1.0) -> str:
    """Return a number in a unit of so many SI; a symbol by its own name."""
    return f"{value / scale:.6g}" if is_number(value) else str(value)


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f'<th style="{_CELL};text-align:left">{escape(cell)}</th>' for cell in header)
    body = "".join(
        "<tr>" + "".join(f'<td style="{_CELL};text-align:left">{escape(cell)}</td>' for cell in row) + "</tr>"
        for row in rows
    )
    return f'<table style="border-collapse:collapse"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'


def _beside(title: str, table: str, drawing: str) -> str:
    style = "display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start"
    return f'<div><p>{title}</p><div style="{style}">{table}{drawing}</div></div>'


def _stress_svg(silicone: Material) -> str:
    """Draw engineering stress against stretch over the fitted range."""
    width, height, margin = _CURVE
    stretch = np.linspace(*silicone.fitted_stretch, 41)
    stress = np.asarray(silicone.engineering_stress(stretch), dtype=float) / 1e3
    low, high = min(0.0, float(stress.min())), float(stress.max())
    x = margin + (width - margin - 8) * (stretch - stretch[0]) / (stretch[-1] - stretch[0])
    y = height - margin - (height - margin - 8) * (stress - low) / (high - low)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    words = f"Engineering stress of {silicone.name}, up to {high:.3g} kPa at stretch {stretch[-1]:g}"
    base = height - margin
    return (
        f'<svg viewBox="0 0 {width:g} {height:g}" width="{width:g}" role="img" aria-label="{escape(words)}" '
        'font-family="Roboto, Helvetica, Arial, sans-serif" font-size="11">'
        f'<path d="M{margin:g} 8V{base:g}H{width - 8:g}" fill="none" stroke="currentColor" stroke-width="0.8"/>'
        f'<polyline points="{points}" fill="none" stroke="{colour(0)}" stroke-width="2"/>'
        f'<text x="{margin:g}" y="{base + 14:g}" fill="currentColor">{stretch[0]:g}</text>'
        f'<text x="{width - 8:g}" y="{base + 14:g}" text-anchor="end" fill="currentColor">{stretch[-1]:g}</text>'
        f'<text x="{width / 2:g}" y="{height - 4:g}" text-anchor="middle" fill="currentColor">stretch</text>'
        f'<text x="{margin + 5:g}" y="16" fill="currentColor">{high:.3g} kPa</text></svg>'
    )
