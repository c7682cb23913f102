"""`softnlp workspace`: a finished sweep in numbers and figures, and compared with a measurement or another sweep."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, aligned, progress, progress_bar, say
from softnlp.cli.figures import draw
from softnlp.model.gravity import gravity_lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softnlp.sweep.boundary import Boundary
    from softnlp.sweep.comparison import Comparison
    from softnlp.sweep.measured import Measured
    from softnlp.sweep.read import Workspace
    from softnlp.sweep.summary import Summary

BENDING, TILT = OUTPUTS["bending_angle"], OUTPUTS["tilt"]
CM = 1e-2
_FIGURES = (".png", ".pdf", ".svg")


def workspace(
    results: Path,
    /,
    *,
    colour: str = BENDING.key,
    against: Path | None = None,
    within_bar: float = 1e-5,
    voxel_mm: float | None = None,
    radius_mm: float | None = None,
    out: Path | None = None,
    csv: Path | None = None,
) -> int:
    """Show where a sweep's tip goes: reach, volume and dexterity as a table, the cloud as a figure.

    Writes workspace.png and dexterity.png, and with --against comparison.png and comparison.csv. The exit status is 3
    when the pose at a measured pressure has no solution.

    Parameters
    ----------
    results
        Folder of a sweep, or its workspace.nc.
    colour
        What colours the poses: a number of the file by name, p1_bar or tip_position_z_mm for instance.
    against
        A measured CSV file with columns t_s, p1_bar, ..., x_mm, y_mm, z_mm, or another sweep.
    within_bar
        Pressures that differ by no more are compared; a measured pressure farther from any pose is solved for.
    voxel_mm
        Edge of the voxels of the dexterity; a twentieth of the cloud's extent by default.
    radius_mm
        How wide a hollow the boundary follows; by default 2.5 times the radius that takes in 95 % of the poses.
    out
        Folder for what is written, or a PNG, PDF or SVG file for the figure, with the others beside it; the sweep's
        folder by default.
    csv
        Write all poses to this CSV file as well.
    """
    from softnlp.figures.comparison import comparison_figure
    from softnlp.figures.workspace import dexterity_figure, workspace_figure
    from softnlp.sweep.read import export_csv, load_workspace, read_column
    from softnlp.sweep.summary import summarise

    for key, value in (("--voxel-mm", voxel_mm), ("--radius-mm", radius_mm)):
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"expected a number above 0, got {value:g}", key=key)
    found = load_workspace(results)
    read_column(found, colour)  # refused before anything is written
    compared = None if against is None else _compared(found, against, within_bar)
    with progress_bar(1, f"{found.title}: reach, volume, dexterity"):
        summary = summarise(
            found,
            radius=None if radius_mm is None else radius_mm * MILLIMETRE,
            voxel=None if voxel_mm is None else voxel_mm * MILLIMETRE,
        )
    cloud, others = _places(found, out)
    rows = list(_summary_rows(found, summary))
    width = max(len(name) for name, _ in rows)
    say("\n".join(f"{name.ljust(width)}  {value}" for name, value in rows))
    written = [] if compared is None else [_write_comparison(*compared, others("comparison", ".csv"))]
    if csv is not None:
        written.append(export_csv(found, csv))
    figures: dict[Path, Callable[[], Figure]] = {cloud: lambda: workspace_figure(found, colour)}
    if (dexterity := summary.dexterity) is not None:
        figures[others("dexterity", cloud.suffix)] = lambda: dexterity_figure(dexterity, found.title, found.robot.name)
    if compared is not None:
        figures[others("comparison", cloud.suffix)] = lambda: comparison_figure(found, compared[0])
    written += draw(figures, found.file.parent)
    say("\n".join(f"written to {path}" for path in written))
    asked_in_vain = compared is not None and compared[1] is not None and compared[0].unsolved
    return SOME_UNSOLVED if asked_in_vain else SOLVED


def _places(found: Workspace, out: Path | None) -> tuple[Path, Callable[[str, str], Path]]:
    """Return the file of the figure, and what names the others: in its folder, and after it where it has a name.

    A folder is made where it is missing.
    """
    from softnlp.base.files import make_folder

    if out is not None and out.suffix.lower() in _FIGURES and not out.is_dir():
        return out, lambda name, suffix: out.with_name(f"{out.stem}-{name}{suffix}")
    folder = make_folder(found.file.parent if out is None else out)
    return folder / "workspace.png", lambda name, suffix: folder / f"{name}{suffix}"


def _compared(found: Workspace, against: Path, within_bar: float) -> tuple[Comparison, Measured | None]:
    """Compare with whatever is there."""
    from softnlp.sweep.comparison import compare_measured, compare_workspaces
    from softnlp.sweep.measured import load_measured
    from softnlp.sweep.read import load_workspace

    if not (np.isfinite(within_bar) and within_bar >= 0):
        raise InputError(f"expected a number of at least 0, got {within_bar:g}", key="--within-bar")
    within = within_bar * BAR
    if against.is_dir() or against.suffix.lower() == ".nc":
        return compare_workspaces(found, load_workspace(against), within=within), None
    measured = load_measured(against, found.robot.chamber_sets)
    with progress(len(measured.pressure), f"poses of {against.name}") as (advance, stop_asked):

        def told(done: int, total: int) -> None:
            advance(len(measured.pressure) - total + done)
            if stop_asked():
                raise KeyboardInterrupt

        return compare_measured(found, measured, within=within, progress=told), measured


def _write_comparison(compared: Comparison, measured: Measured | None, table: Path) -> Path:
    """Print and write a comparison; return the file."""
    from softnlp.base.files import placed_whole
    from softnlp.sweep.comparison import comparison_rows

    notes = [f"warning: {note}" for note in (measured.notes if measured else ())]
    say("\n".join(["", *_comparison_lines(compared), *notes]))
    header, rows = comparison_rows(compared, measured)
    with placed_whole(table) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
    return table


def _summary_rows(found: Workspace, s: Summary) -> Iterator[tuple[str, str]]:
    """Yield what a sweep comes to, as name and value."""
    mm = MILLIMETRE
    yield "workspace", f"{found.title}: {found.robot.name}, {found.material}"
    yield from (("gravity", line) for line in gravity_lines(found.gravity))
    yield "poses", f"{s.poses:,}"
    kinds = {
        "unstable": s.unstable,
        "of undefined stability": s.undefined,
        "that pass through themselves": s.self_intersecting,
    }
    told = ", ".join(f"{count:,} {kind}" for kind, count in kinds.items() if count)
    yield "solved", f"{s.solved:,}" + (f" ({told})" if told else "")
    yield "failed", ", ".join(f"{n:,} {status}" for status, n in s.failed.items()) or "0"
    if s.dexterity is None:
        return
    r = s.reach
    yield "reach from the base axis", f"{r.nearest_to_axis / mm:.2f} to {r.farthest_from_axis / mm:.2f} mm"
    yield "reach from the base", f"{r.nearest_to_base / mm:.2f} to {r.farthest_from_base / mm:.2f} mm"
    yield "height", f"{r.lowest / mm:.2f} to {r.highest / mm:.2f} mm"
    yield "convex hull", _body(s.hull)
    yield "boundary", _body(s.boundary)
    d = s.dexterity
    tilts = [
        TILT.shown(size)
        for size in (d.lowest_tilt.min(), d.highest_tilt.max(), np.median(d.tilt_range), d.tilt_range.max())
    ]
    most = f"within a voxel {tilts[2]:.1f} (median), {tilts[3]:.1f} (most)"
    yield "tilts", f"{tilts[0]:.1f} to {tilts[1]:.1f} {TILT.unit}; {most}"
    yield (
        "dexterity",
        f"{100 * d.overall:.1f} % of directions anywhere; in a voxel {100 * float(np.mean(d.coverage)):.2f} % (mean), "
        f"{100 * float(d.coverage.max()):.2f} % (most)",
    )
    yield (
        "voxels",
        f"{len(d.voxel):,} of {d.size / mm:.3g} mm, {float(np.median(d.poses)):.0f} poses (median); "
        f"{d.directions} directions of {TILT.shown(d.resolution):.1f} {TILT.unit}",
    )
    yield "worst residual", f"{s.worst_residual:.1e}"


def _body(body: Boundary) -> str:
    """Return the measures of a hull or a boundary, or what it is instead."""
    from softnlp.sweep.boundary import Extent

    radius = "" if body.radius is None else f", radius {body.radius / MILLIMETRE:.2f} mm, of {body.points:,} poses"
    radius += f", {body.outside:,} outside" if body.outside else ""
    if body.extent is Extent.SOLID:
        return f"{body.volume / CM**3:.4g} cm^3, surface {body.area / CM**2:.4g} cm^2{radius}"
    if body.extent is Extent.FLAT:
        return f"{body.area / CM**2:.4g} cm^2 ({body.extent.meaning}{radius})"
    if body.volume:
        return f"{body.volume / CM**3:.4g} cm^3 about {body.extent.meaning}"
    return f"none: {body.extent.meaning}"


def _comparison_lines(compared: Comparison) -> list[str]:
    """Return the table of the distances, by group and in all, and what was left out."""
    from softnlp.base.statistics import groups, statistics

    every = np.ones(len(compared.row), bool)
    table = []
    for name, mask in [*groups(compared.pressure), ("all", every)]:
        s = statistics(compared.distance[mask] / MILLIMETRE)
        numbers = [s.mean, s.median, s.rmse, s.largest, 100 * s.mean * MILLIMETRE / compared.length]
        table.append([name, f"{s.count:,}", *(f"{v:.3f}" for v in numbers)])
    lines = [f"tip against {compared.against}; % of the length {compared.length / MILLIMETRE:.4g} mm"]
    lines += aligned(["pressurised", "pairs", "mean", "median", "RMSE", "max [mm]", "mean [%]"], table)
    if compared.angle is not None:
        s = statistics(BENDING.shown(compared.angle))
        lines.append(
            f"{BENDING.label}: mean difference {s.mean:.3f} {BENDING.unit}, RMSE {s.rmse:.3f}, max {s.largest:.3f}"
        )
    counts = (
        (int(compared.solved_again.sum()), "pairs whose pose was solved for this"),
        (compared.skipped, "rows with blanks skipped"),
        (
            compared.unmatched,
            f"rows without a pose at their pressure{f' ({compared.reason})' if compared.reason else ''}",
        ),
        (compared.unsolved, "rows whose pose has no solution"),
    )
    return lines + [f"{n:,} {words}" for n, words in counts if n]
