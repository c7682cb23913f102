"""Figures of an identification: a tensile test with its laws, or measured against modelled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import KILOPASCAL
from softnlp.figures.style import GREY, INK, PALE, TEXT, colour, in_own_style, legend, new_figure, plain, user_text
from softnlp.studies.identified import constants_text, file_name
from softnlp.studies.measurements import OBSERVABLES, column_slice
from softnlp.studies.registration import NAMES as REGISTRATION_NAMES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.figure import Figure

    from softnlp.studies.identified import Identified
    from softnlp.studies.tensile import TensileFit

_LEAST_PASCAL = 0.01  # of the axis of residuals, on which those of round-off are a line
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")  # one more than colours, so that pairs repeat late


@in_own_style
def tensile_figure(fit: TensileFit, name: str, before: Any = None) -> Figure:
    """Draw the test with every fitted law, R^2 in the legend, and what each law leaves.

    before : a material to compare with, or None.
    """
    figure = new_figure(11.0, 4.6, f"Tensile test of {name}", f"{fit.stretch.size} points; incompressible, uniaxial")
    low, high = next(iter(fit.fits.values())).fitted_stretch
    stretch = np.linspace(low, high, 241)
    left = figure.add_axes((0.07, 0.13, 0.5, 0.69))
    right = figure.add_axes((0.65, 0.13, 0.32, 0.69))
    plain(left, "stretch [-]", "engineering stress [kPa]")
    largest = max(float(np.max(np.abs(f.stress(fit.stretch) - fit.stress))) for f in fit.fits.values())
    unit, name_of_unit = (KILOPASCAL, "kPa") if largest >= 0.1 * KILOPASCAL else (1.0, "Pa")
    plain(right, "stretch [-]", f"law - data [{name_of_unit}]")
    room = max(1.08 * largest / unit, _LEAST_PASCAL)
    right.set_ylim(-room, room)
    left.plot(
        fit.stretch, fit.stress / KILOPASCAL, "o", color=INK, markersize=3.5, markerfacecolor="none", label="data"
    )
    if before is not None:
        left.plot(
            stretch,
            np.asarray(before.engineering_stress(stretch)) / KILOPASCAL,
            color=GREY,
            linestyle=":",
            linewidth=1.3,
            label=user_text(f"before: {before.name}, {before.law.name}"),
        )
    order = np.argsort(fit.stretch, kind="stable")
    styles = ("-", "--", "-.", (0, (4, 1, 1, 1, 1, 1)), (0, (8, 2)))
    for k, f in enumerate(fit.fits.values()):
        look: dict[str, Any] = {"color": colour(k), "linestyle": styles[k % len(styles)], "linewidth": 1.5}
        words = (
            user_text(f.law.name),
            f"R² = {f.r_squared:.5f}",
            *([f.status] if f.material is None else ()),
            *(f"{name} {note}" for name, note in f.notes.items() if note),  # on constants
        )
        left.plot(stretch, f.stress(stretch) / KILOPASCAL, label=", ".join(words), **look)
        right.plot(fit.stretch[order], (f.stress(fit.stretch) - fit.stress)[order] / unit, **look)
    right.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
    legend(left)
    return figure


@in_own_style
def identified_figure(found: Identified, title: str, keys: Mapping[str, tuple[str, float]] | None = None) -> Figure:
    """Draw the model before and after against what was measured, a panel an observable and a marker a robot.

    keys : that files have for the constants, with their units in SI; None are those of the material.
    """
    shown = [key for key in OBSERVABLES if key in found.errors()]
    width = 0.9 + 4.1 * len(shown)
    pairs = [(n, v) for n, v in zip(found.free.names, found.constants, strict=True) if n not in REGISTRATION_NAMES]
    told = [
        constants_text([file_name(n, found.material) if keys is None else keys[n]], np.array([v])) for n, v in pairs
    ]
    notes = (found.notes[n] for n, _ in pairs)
    constants = ", ".join(words + (note and f" ({note})") for words, note in zip(told, notes, strict=True))
    figure = new_figure(max(width, 6.5), 5.0, title, constants)
    step = 1.0 / len(shown)
    robots = [sum(bool(np.any(np.isfinite(d.of(key)))) for d in found.data) for key in shown]
    named = int(np.argmax(robots))
    for k, key in enumerate(shown):
        axes = figure.add_axes((step * k + 0.16 * step, 0.12, 0.78 * step, 0.71))
        unit = OUTPUTS[key].scale
        turns = key == "orientation"  # from the one measured, which has no number of its own
        plain(axes, "row" if turns else f"measured {OUTPUTS[key].axis}", f"model {OUTPUTS[key].axis}")
        ends = []
        for j, data in enumerate(found.data):
            measured = data.of(key) / unit
            if not np.any(np.isfinite(measured)):
                continue
            where = column_slice(key)
            look: dict[str, Any] = {"linestyle": "none", "marker": _MARKERS[j % len(_MARKERS)], "markersize": 5}
            old, new = found.before[j][:, where] / unit, found.after[j][:, where] / unit
            if turns:
                old, new = (np.linalg.norm(np.nan_to_num(part), axis=1) for part in (old, new))
                measured = np.where(np.isfinite(measured).any(axis=1), np.arange(1.0, len(measured) + 1), np.nan)
            axes.plot(measured.ravel(), old.ravel(), color=GREY, markerfacecolor="none", **look)
            axes.plot(measured.ravel(), new.ravel(), color=colour(j), label=user_text(data.label), **look)
            ends += [measured, old, new]
        every = np.concatenate([e.ravel() for e in ends])
        low, high = float(np.nanmin(every)), float(np.nanmax(every))
        if not turns:
            axes.plot([low, high], [low, high], color=PALE, linewidth=1.5, zorder=0)
        before, after = found.errors(False)[key], found.errors()[key]
        axes.set_title(
            f"rmse {before.rmse / unit:.3g} {OUTPUTS[key].unit} before (grey), {after.rmse / unit:.3g} "
            f"{OUTPUTS[key].unit} after",
            size=TEXT,
            color=INK,
        )
        if k == named:
            legend(axes)
    return figure
