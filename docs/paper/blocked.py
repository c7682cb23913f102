"""Blocked tip force of the eight robots by four hyperelastic laws and four closures, beside the measured ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from docs.paper.cases import HYPERELASTIC, NAMES, STIFFENED, case, in_bar, law_of, model_of
from docs.paper.figures import MEASURED, label_outer, legend, named, panels, saved
from docs.paper.published import measured_forces, measured_pressure
from docs.paper.text import NONE, figure, fixed, page_text, scenario_link, table, worded
from docs.paper.weights import ROUGH, length_weight_for, with_length_weight
from softnlp import BAR, COEFFICIENT_SETS, Coefficients, ContactSettings
from softnlp.figures.style import COLOURS, GREY, INK, PALE, SMALL, colour
from softnlp.model.contact_settings import CLOSURES
from softnlp.model.quantities import Model
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.wall import standing_wall

Array = NDArray[np.float64]

_SHADE = {name: colour(k) for name, k in zip(CLOSURES, (5, 0, 1, 3), strict=True)}


@dataclass(frozen=True, eq=False)
class Pushed:
    """The force along the pressures (steps,) [N], NaN where a step has no solution.

    slips : pressure above which the planar shape may slip sideways [bar], or None. ended : status of the first step
    without a solution, or "".
    """

    force: Array
    slips: float | None
    ended: str


Forces = Mapping[tuple[str, str, str], Pushed]
"""By closure, law and robot."""


class Presses:
    """Presses many robots against the wall of their scenario; what is compiled is kept."""

    def __init__(self) -> None:
        self._made: dict[tuple[str, str], BlockedSolver] = {}
        self._rough: BlockedSolver | None = None
        self._contact = {closure: settings(closure) for closure in CLOSURES}

    def solver(self, model: Model, closure: str) -> BlockedSolver:
        """Return the solver of a model; robots of one kind share it."""
        key = (closure, model.material.law.name)
        if key not in self._made:
            like = next((s for (_, law), s in self._made.items() if law == key[1]), None)
            poses = None if like is None else like.poses.with_model(model)
            numerics = case(f"blocked_{model.robot.name}").numerics
            self._made[key] = BlockedSolver(model, numerics, self._contact[closure], poses=poses)
        return self._made[key].with_model(model)

    def push(self, robot: str, closure: str, law: str, coefficients: Coefficients = STIFFENED) -> Pushed:
        """Return the force of a robot at each pressure of its scenario but none."""
        return pushed(self.solver(model_of(case(f"blocked_{robot}"), law, coefficients), closure))

    def tuned(self, robot: str, law: str) -> tuple[float, Pushed | None]:
        """Return the W_L [1/m] that gives the measured force, and the force with it; NaN and None where none does."""
        scenario = case(f"blocked_{robot}")
        model = model_of(scenario, law, STIFFENED)
        if self._rough is None:
            rough = replace(scenario.numerics, accuracy=ROUGH)
            self._rough = BlockedSolver(model, rough, self._contact["weighted"])
        search = self._rough.with_model(model)
        length = length_weight_for(search, scenario.pressures[-1], measured_forces()[robot])
        solver = self.solver(model, "weighted")
        return length, None if np.isnan(length) else pushed(with_length_weight(solver, length))


def pushed(solver: BlockedSolver) -> Pushed:
    """Return the force of a solver's robot at each pressure of its scenario but none."""
    scenario = case(f"blocked_{solver.model.robot.name}")
    pressures = raised(scenario.pressures)
    wall = standing_wall(solver.poses, solver.contact, pressures, scenario.loads)
    near, slips, ended, force = None, None, "", []
    for pressure in pressures:
        step, found = solver.solve(pressure, scenario.loads, wall, near)
        if found is not None:
            near, slips = found, found.slips
        elif not ended:
            ended = step.status.value
        force.append(step.contact.force if step.contact is not None and step.status.has_solution else np.nan)
    return Pushed(np.array(force), None if slips is None else slips / BAR, ended)


def settings(closure: str) -> ContactSettings:
    """Return the contact of the scenarios under a closure; `weighted` has the weights of its scenario."""
    contact = case("constraint_weighted").contact
    assert contact is not None
    if closure == "weighted":
        return contact
    return ContactSettings(closure=closure)  # type: ignore[arg-type]


def raised(pressures: Array) -> Array:
    """Return the pressures that are not zero."""
    return pressures[np.any(pressures > 0, axis=1)]


def forces() -> dict[tuple[str, str, str], Pushed]:
    """Return every force of the page with the coefficients of the scenarios."""
    press = Presses()
    return {
        (closure, law, robot): press.push(robot, closure, law)
        for law in HYPERELASTIC
        for closure in CLOSURES
        for robot in NAMES
    }


@dataclass(frozen=True)
class Misfit:
    """Root mean square error [N], mean absolute percentage error [%], and of how many of how many steps."""

    rmse: float
    mape: float
    solved: int
    steps: int


def misfit(found: Mapping[str, Pushed], last_only: bool) -> Misfit:
    """Compare forces by robot with the measured ones, taken as linear in pressure."""
    measured = measured_forces()
    simulated = np.array([pushed.force for pushed in found.values()])
    part = in_bar(raised(case(f"blocked_{NAMES[0]}").pressures)) / measured_pressure()
    known = np.array([measured[name] for name in found])[:, None] * part
    if last_only:
        simulated, known = simulated[:, -1:], known[:, -1:]
    error = simulated - known
    return Misfit(
        float(np.sqrt(np.nanmean(error**2))),
        100 * float(np.nanmean(np.abs(error / known))),
        int(np.isfinite(error).sum()),
        error.size,
    )


def page(folder: Path) -> str:
    """Write the figures into a folder and return the page."""
    found = forces()
    first = case(f"blocked_{NAMES[0]}")
    law, top, silicone = law_of(first), measured_pressure(), first.material.name
    press = Presses()
    calibrated = {name: press.push(name, "compliant", law, COEFFICIENT_SETS["calibrated"]) for name in NAMES}
    tuned = {name: press.tuned(name, law) for name in NAMES}
    _draw_curves(found, calibrated, law, silicone, folder)
    _draw_parity(found, law, folder)
    links = ", ".join(scenario_link(f"blocked_{name}") for name in NAMES)
    return page_text(
        "Blocked tip force",
        f"{worded(len(NAMES)).capitalize()} robots in {silicone}, one set at up to {top} bar, the tip held on the axis "
        f"of the base. {worded(len(HYPERELASTIC)).capitalize()} hyperelastic laws and the {worded(len(CLOSURES))} "
        "closures of [blocked force](../blocked-force.md#closures): `free` is the rod alone, `weighted` the paper's "
        "method, `compliant` this project's own, `rigid` an upper bound.",
        f"Scenarios: {links}; the weights are those of {scenario_link('constraint_weighted')}.",
        figure("blocked_curves", "Blocked force against pressure, every robot"),
        f"## Forces at {top} bar [N]",
        "A status in place of a number: the branch from zero pressure ends before.",
        *(part for closure in CLOSURES for part in (f"### `{closure}`", _table(found, closure))),
        "## RMSE and MAPE",
        "The measures of Table IV of the paper, over all robots and all steps from the first pressure to the last. "
        "The measured force is taken as linear in pressure, as it was found to be nearly. Steps without a solution are "
        "left out, and counted.",
        _misfits(found, calibrated, law),
        "By robot, over the same steps:",
        _by_robot(found, calibrated, law),
        "## The weights tuned for each robot",
        _tuned(tuned, law),
        figure("blocked_parity", "Simulated against measured force"),
        "## Why it differs",
        _reasons(found, calibrated, law),
    )


def _table(found: Forces, closure: str) -> str:
    measured = measured_forces()
    rows = []
    for name in NAMES:
        force = measured[name]
        cells = [found[closure, law, name] for law in HYPERELASTIC]
        rows.append([name, fixed(force, 2), *(p.ended or fixed(float(p.force[-1]), 3) for p in cells)])
    return table(["robot", "measured", *HYPERELASTIC], rows)


def _of(found: Forces, closure: str, law: str) -> dict[str, Pushed]:
    return {name: found[closure, law, name] for name in NAMES}


def _misfits(found: Forces, calibrated: Mapping[str, Pushed], law: str) -> str:
    rows = []
    for closure, by in [*((c, by) for c in CLOSURES for by in HYPERELASTIC), ("compliant, calibrated", law)]:
        forces_of = calibrated if closure not in CLOSURES else _of(found, closure, by)
        curve, end = misfit(forces_of, False), misfit(forces_of, True)
        rows.append([closure, by, fixed(curve.rmse, 3), fixed(curve.mape), f"{curve.solved} of {curve.steps}",
                     fixed(end.rmse, 3), fixed(end.mape), f"{end.solved} of {end.steps}"])  # fmt: skip
    top = measured_pressure()
    return table(
        [
            "closure",
            "law",
            "RMSE [N]",
            "MAPE [%]",
            "steps",
            f"RMSE at {top} bar [N]",
            f"MAPE at {top} bar [%]",
            "robots",
        ],
        rows,
    )


def _by_robot(found: Forces, calibrated: Mapping[str, Pushed], law: str) -> str:
    """Return RMSE and MAPE of each robot, the second as a part of the measured force."""
    columns = {f"`{c}`": _of(found, c, law) for c in CLOSURES} | {"`compliant`, calibrated": calibrated}
    rows = []
    for name in NAMES:
        cells = []
        for pushed in columns.values():
            measured = _measured_curve(name)
            error = pushed[name].force - measured
            rmse, mape = np.sqrt(np.nanmean(error**2)), 100 * np.nanmean(np.abs(error / measured))
            cells.append(f"{fixed(float(rmse), 3)} / {fixed(float(mape))}")
        rows.append([name, *cells])
    return table([f"{law}: RMSE [N] / MAPE [%]", *columns], rows)


def _tuned(tuned: Mapping[str, tuple[float, Pushed | None]], law: str) -> str:
    """Say what W_L gives each measured force, and what the curve is then."""
    rows, errors = [], []
    for name, (length, curve) in tuned.items():
        row = [name, fixed(length, 1), NONE, NONE, NONE]
        if curve is not None:
            error = curve.force / _measured_curve(name) - 1
            errors.append(error)
            row[2:] = [
                fixed(float(curve.force[-1]), 3),
                fixed(float(curve.force[0]), 3),
                fixed(100 * float(np.nanmean(np.abs(error)))),
            ]
        rows.append(row)
    pressures = in_bar(raised(case(f"blocked_{NAMES[0]}").pressures))
    none = [name for name, (length, _) in tuned.items() if np.isnan(length)]
    least = (
        f" For {', '.join(none)} no W_L gives the measured force: the force jumps over it where the branch folds, and "
        "the other weights would have to change too."
        if none
        else ""
    )
    return (
        f"The W_L with which `weighted` gives the force measured at {measured_pressure()} bar ({law}, the other "
        f"weights as above). The curves are then {100 * float(np.nanmean(np.abs(errors))):.1f} % off on average, with "
        f"a constant for each robot instead of one for all.{least}\n\n"
        + table(
            ["robot", "W_L [1/m]", *(f"force at {p:g} bar [N]" for p in (pressures[-1], pressures[0])), "MAPE [%]"],
            rows,
        )
    )


def _measured_curve(name: str) -> Array:
    pressure = in_bar(raised(case(f"blocked_{name}").pressures))
    return np.asarray(measured_forces()[name] * pressure / measured_pressure())


def _reasons(found: Forces, calibrated: Mapping[str, Pushed], law: str) -> str:
    weights = settings("weighted").weights
    free, compliant, fitted = (
        misfit(m, False) for m in (_of(found, "free", law), _of(found, "compliant", law), calibrated)
    )
    at_end = misfit(_of(found, "compliant", law), True)
    folds = {c: sum(bool(found[c, law, name].ended) for name in NAMES) for c in CLOSURES}
    k_c = STIFFENED.chamber_reaction
    slips = [f"{name} {s.slips:.2f} bar" for name, s in _of(found, "compliant", law).items() if s.slips is not None]
    low = sum(float(found["compliant", law, name].force[0]) < _measured_curve(name)[0] for name in NAMES)
    ratios = [p.force[-1] / measured_forces()[n] for n, p in _of(found, "rigid", law).items() if not p.ended]
    return "\n".join(
        [
            f"- `free` leaves the chambers out and is {free.mape:.0f} % off: the chambers do resist.",
            "- `weighted` has eight equations for seven unknowns, so its force depends on the weights. The paper tunes "
            f"them for each robot; above one set serves all (W_n = {weights.force:g} /N, W_m = {weights.moment:g} "
            f"/(N m), W_L = {weights.length:g} /m). [The constraint](constraint.md) shows how much that matters.",
            f"- `rigid` holds the lengths exactly. It gives {min(ratios):.1f} to {max(ratios):.1f} times the measured "
            f"force, and its branch ends before {measured_pressure()} bar on {folds['rigid']} of {len(NAMES)} robots "
            f"({folds['weighted']} for `weighted`, {folds['compliant']} for `compliant`).",
            f"- `compliant` is semi-empirical: its one constant k_c = {k_c:g} was fitted to these {len(NAMES)} forces "
            f"at {measured_pressure()} bar, so its {at_end.mape:.1f} % there is a fit and no prediction. Its force "
            f"rises faster than in proportion: at the lowest pressure it is below the measured line for {low} of "
            f"{len(NAMES)} robots, and the whole curve is {compliant.mape:.0f} % off. The calibrated coefficients, "
            f"fitted to forces and angles together, bring that to {fitted.mape:.1f} %.",
            "- The shapes are planar. Without friction a blocked robot may slip sideways past the wall above a "
            f"pressure that depends on the robot: {', '.join(slips)} (`compliant`). A sensor has friction, and the "
            "paper's model is used in the plane; the force given is that of the planar shape.",
            "- Measured curves are known here by their last point and by being close to linear, so the errors along "
            "the curve are those to that line.",
        ]
    )


def _draw_curves(found: Forces, calibrated: Mapping[str, Pushed], law: str, silicone: str, folder: Path) -> None:
    """Draw a panel a robot: the closures under one law, the spread over the laws, and the measured line."""
    columns = len(NAMES) // 2
    words = "bands: spread over the laws; rigid leaves the panels"
    canvas, axes = panels("Blocked tip force, one set", f"{silicone}, {law}  ·  {words}", 2, columns)
    label_outer(axes, columns, "pressure [bar]", "blocked force [N]")
    for panel, name in zip(axes, _two_rows(), strict=True):
        named(panel, name)
        pressure = np.append(0.0, in_bar(raised(case(f"blocked_{name}").pressures)))
        line = measured_forces()[name]
        panel.plot([0, measured_pressure()], [0, line], color=INK, linewidth=0.9, linestyle=(0, (5, 3)),
                   label="measured, taken as linear")  # fmt: skip
        panel.plot([measured_pressure()], [line], label="measured", **MEASURED)
        for closure, label, pushed, spread in _lines(found, calibrated, law, name):
            panel.plot(pressure, _from_zero(pushed), color=closure, marker=".", linewidth=1.5, label=label)
            with np.errstate(all="ignore"):
                band = [_from_zero(p) for p in spread]
            if band:
                known = np.isfinite(band).all(axis=0)
                panel.fill_between(pressure[known], np.min(band, axis=0)[known], np.max(band, axis=0)[known],
                                   color=closure, alpha=0.22, linewidth=0)  # fmt: skip
        panel.set_xlim(0, measured_pressure())
        panel.set_ylim(0, 2.0 * line)
    legend(canvas, axes[0], 7)
    saved(canvas, folder, "blocked_curves")


def _lines(
    found: Forces, calibrated: Mapping[str, Pushed], law: str, name: str
) -> Iterator[tuple[str, str, Pushed, Sequence[Pushed]]]:
    """Yield colour, label, force and its likes under all laws of each line of a panel."""
    for closure in CLOSURES:
        yield _SHADE[closure], closure, found[closure, law, name], [found[closure, by, name] for by in HYPERELASTIC]
    yield COLOURS[2], "compliant, calibrated", calibrated[name], ()


def _from_zero(pushed: Pushed) -> Array:
    """Return the force with the 0 at zero pressure."""
    return np.append(0.0, pushed.force)


def _two_rows() -> list[str]:
    length = {name: float(case(f"blocked_{name}").robot.length) for name in NAMES}
    return sorted(NAMES, key=lambda name: -length[name])


def _draw_parity(found: Forces, law: str, folder: Path) -> None:
    """Draw the simulated against the measured force at the last pressure."""
    measured = {name: measured_forces()[name] for name in NAMES}
    title = f"Simulated against measured, {measured_pressure()} bar"
    canvas, (panel,) = panels(title, f"{law}, every robot a mark; on the line they agree", 1, 1, row_height=3.6)
    label_outer([panel], 1, "measured blocked force [N]", "simulated blocked force [N]")
    marks: dict[str, Any] = dict(zip(CLOSURES, "vos^", strict=True))
    known = np.array(list(measured.values()))
    ends = np.array([0.8 * known.min(), 1.25 * known.max()])
    panel.plot(ends, ends, color=INK, linewidth=0.9)
    panel.fill_between(ends, 0.8 * ends, 1.2 * ends, color=PALE, alpha=0.6, linewidth=0, label="within a fifth")
    for closure in CLOSURES:
        y = [found[closure, law, name].force[-1] for name in measured]
        panel.scatter(known, y, color=_SHADE[closure], marker=marks[closure], s=42, label=closure, zorder=3)
    panel.set(xscale="log", yscale="log", xlim=ends, ylim=(known.min() / 8, 5 * known.max()))
    for name, force in measured.items():
        panel.text(force, 0.02, name, size=SMALL, color=GREY, rotation=90, ha="center", va="bottom",
                   transform=panel.get_xaxis_transform())  # fmt: skip
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(ScalarFormatter())
        axis.set_minor_formatter(NullFormatter())
    ticks = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0]
    panel.set_xticks([t for t in ticks if t < ends[1]])
    panel.set_yticks(ticks[:-1])
    legend(canvas, panel)
    saved(canvas, folder, "blocked_parity")
