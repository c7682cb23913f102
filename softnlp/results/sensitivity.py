"""A sensitivity report as one JSON document and as tables; units are in the names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from softnlp.base.columns import BAR_, DEG, MM, NMM, N
from softnlp.model.inputs import loads_table, package_version, pressure_bar, robot_table
from softnlp.results.document import plain
from softnlp.studies.derivatives import entries_of
from softnlp.studies.ellipsoids import Ellipsoid
from softnlp.studies.report import SensitivityReport

SHOWN: Mapping[str, tuple[str, float]] = {unit.si: (unit.suffix, unit.scale) for unit in (MM, DEG, BAR_, NMM)}
"""The unit in which a unit of SI is shown, and its size."""

Rows = tuple[str, Sequence[str], list[list[str]]]


def shown(unit: str) -> tuple[str, float]:
    """Return the unit in which a number is shown to a person, and its size in SI; moduli stay in Pa."""
    return SHOWN.get(unit, (unit, 1.0))


def sensitivity_document(report: SensitivityReport, title: str, step: int, notes: Sequence[str] = ()) -> dict[str, Any]:
    """Return the report as plain data, SI; what is not finite is None. notes : warnings of what was asked."""
    s = report.sensitivities
    document: dict[str, Any] = {
        "softnlp": package_version(),
        "title": title,
        "study": "sensitivity",
        "step": step,
        "pressure_bar": pressure_bar(s.step.pressure),
        "loads": loads_table(report.loads),
        "status": s.step.status.value,
        "message": s.step.message,
        "warnings": [*notes, *s.warnings],
        "outputs": [
            {"name": n, "unit": u, "value": v} for n, u, v in zip(s.outputs, s.output_units, s.values, strict=True)
        ],
        "quantities": [
            {"name": n, "unit": u, "value": v}
            for n, u, v in zip(s.quantities, s.quantity_units, s.nominal, strict=True)
        ],
        "matrix": s.matrix,
        "manipulability": {
            "measure_m3_per_Pa3": report.manipulability.measure,
            "isotropy": report.manipulability.isotropy,
            "translation": _ellipsoid(report.manipulability.translation),
            "rotation": _ellipsoid(report.manipulability.rotation),
        },
        "compliance_ellipsoid": _ellipsoid(report.compliance),
        "stiffness_ellipsoid": _ellipsoid(report.stiffness),
    }
    if report.bars is not None:
        document["error_bars"] = {
            "quantities": list(report.bars.quantities),
            "tolerance": report.bars.tolerance,
            "total": report.bars.total,
            "contribution": report.bars.contribution,
        }
    if report.sampled is not None:
        document["monte_carlo"] = {
            "deviation": report.sampled.deviation,
            "standard_error": report.sampled.standard_error,
            "mean_shift": report.sampled.mean_shift,
            "solved": report.sampled.solved,
            "asked": report.sampled.asked,
        }
    if report.pose is not None:
        pose = report.pose
        radii = {field.name: getattr(pose.radii, field.name) for field in fields(pose.radii)}
        body = {"position_m": pose.shape.position, "rotation": pose.shape.rotation, "radii_m": radii}
        document |= {"robot": robot_table(report.robot), "material": report.material.name, "body": body}
    found: dict[str, Any] = plain(document)
    return found


def table_rows(report: SensitivityReport) -> Iterator[Rows]:
    """Yield heading, header and rows of each table for the terminal."""
    s = report.sensitivities
    tip = ("tip_position", "tip_rotation")
    yield _matrix(report, "tip by pressure", tip, ("pressure",))
    yield _matrix(report, "tip by tip wrench (compliance)", tip, ("tip_force", "tip_moment"))
    others = [
        q for q in dict.fromkeys(_stem(q) for q in s.quantities) if q.startswith(("robot", "mat", "stiff", "corr"))
    ]
    of = ["tip_position.x", "tip_position.y", "tip_position.z", "bending_angle", "elongation"]
    rows = []
    for name in others:
        k = entries_of(s.quantities, name)[0]
        one = 0.01 * abs(s.nominal[k]) or 0.01
        moved = [s.matrix[s.outputs.index(o), k] * one / shown(s.output_units[s.outputs.index(o)])[1] for o in of]
        rows.append([name, *(f"{v:.4g}" for v in moved)])
    units = [shown(s.output_units[s.outputs.index(o)])[0] for o in of]
    yield (
        "what 1 % more does (0.01 more of what is 0)",
        ["quantity", *(f"{o} [{u}]" for o, u in zip(of, units, strict=True))],
        rows,
    )
    ellipsoids = [
        ("moved by pressure", report.manipulability.translation, f"{MM}/{BAR_}", MM.scale / BAR_.scale),
        ("turned by pressure", report.manipulability.rotation, f"{DEG}/{BAR_}", DEG.scale / BAR_.scale),
        ("compliance", report.compliance, f"{MM}/{N}", MM.scale),
        ("stiffness", report.stiffness, f"{N}/{MM}", 1 / MM.scale),
    ]
    rows = [
        [name, unit, f"{size / scale:.4g}", *(f"{x + 0.0:.3f}" for x in np.round(e.axes[:, k], 9))]
        for name, e, unit, scale in ellipsoids
        for k, size in enumerate(e.semi_axes)
    ]
    yield "ellipsoids of the tip", ["ellipsoid", "unit", "semi-axis", "x", "y", "z"], rows
    if report.bars is not None:
        yield _bars(report)


def _matrix(report: SensitivityReport, heading: str, outputs: Sequence[str], by: Sequence[str]) -> Rows:
    s = report.sensitivities
    rows = [k for name in outputs for k in entries_of(s.outputs, name)]
    columns = [k for name in by for k in entries_of(s.quantities, name)]
    units = [shown(s.quantity_units[k]) for k in columns]
    header = ["output", *(f"{s.quantities[k]} [{u}]" for k, (u, _) in zip(columns, units, strict=True))]
    table = []
    for r in rows:
        unit, scale = shown(s.output_units[r])
        cells = [f"{s.matrix[r, k] * size / scale:.5g}" for k, (_, size) in zip(columns, units, strict=True)]
        table.append([f"{s.outputs[r]} [{unit}]", *cells])
    return heading, header, table


def _bars(report: SensitivityReport) -> Rows:
    bars, sampled = report.bars, report.sampled
    assert bars is not None
    header = ["output", "value", "deviation", *(["sampled"] if sampled else []), "most from"]
    table = []
    for k, name in enumerate(bars.outputs):
        unit, scale = shown(bars.output_units[k])
        largest = int(np.argmax(np.nan_to_num(np.abs(bars.contribution[k]))))
        cells = [f"{name} [{unit}]", f"{bars.values[k] / scale:.5g}", f"{bars.total[k] / scale:.3g}"]
        if sampled:
            cells.append(f"{sampled.deviation[k] / scale:.3g}")
        table.append([*cells, bars.quantities[largest]])
    return "error bars (standard deviations, first order)", header, table


def _stem(name: str) -> str:
    stem, _, last = name.rpartition(".")
    return stem if last.isdigit() or last in ("x", "y", "z") else name


def _ellipsoid(e: Ellipsoid) -> dict[str, Any]:
    return {"unit": e.unit, "semi_axes": e.semi_axes, "axes": e.axes}
