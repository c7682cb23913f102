"""Bending and elongation of the tested robots: one, two and three sets, five laws, with and without stiffening."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.paper.cases import BARE, NAMES, STIFFENED, Solvers, case, in_bar, law_of, model_of, unloaded, with_sets
from docs.paper.figures import MEASURED, label_outer, legend, named, panels, saved
from docs.paper.published import elongation_range, mean_error, measured_angles, measured_pressure
from docs.paper.text import between, figure, fixed, page_text, scenario_link, table, worded
from softnlp import COEFFICIENT_SETS, DEGREE, MILLIMETRE, Coefficients, Loads, Material, material
from softnlp.figures.style import INK, colour
from softnlp.model.laws import LAWS
from softnlp.scenario.read import Scenario
from softnlp.statics.solver import PoseSolver
from softnlp.studies.identify import identify
from softnlp.studies.measurements import RobotTask

Array = NDArray[np.float64]

SETS = {1: "one set", 2: "two sets", 3: "three sets"}
_CHECKED = 1e-6  # [deg]: figures below it are round-off
_STEEP = "linear"  # the law that leaves the panels without stiffening, so that the others can be told apart


@dataclass(frozen=True, eq=False)
class Curve:
    """What a robot does along its pressures (steps,); NaN where the branch from zero pressure has ended.

    pressure [bar], angle [deg], elongation [mm], stretch [-].
    """

    pressure: Array
    angle: Array
    elongation: Array
    stretch: Array


Key = tuple[str, int, str, bool]
"""Robot, pressurised sets, law, whether it is stiffened."""


def curve(solvers: Solvers, robot: str, sets: int, law: str, coefficients: Coefficients) -> Curve:
    """Return the unloaded robot along the pressures of its scenario: an arc in closed form at each."""
    scenario = case(f"bending_{robot}")
    return _along(solvers.of(model_of(scenario, law, coefficients), scenario), scenario, sets)


def _along(poses: PoseSolver, scenario: Scenario, sets: int) -> Curve:
    rows = []
    for pressure in with_sets(scenario.pressures, sets):
        angle, stretch = unloaded(poses, pressure)
        longer = (stretch - 1) * float(scenario.robot.length)  # without loads only pressure lengthens the axis
        rows.append((angle / DEGREE, longer / MILLIMETRE, stretch))
    return Curve(in_bar(scenario.pressures), *np.array(rows).T)


def curves() -> dict[Key, Curve]:
    """Return every curve of the page."""
    solvers = Solvers()
    found: dict[Key, Curve] = {}
    for law, stiffened, robot in product(LAWS, (True, False), NAMES):
        scenario = case(f"bending_{robot}")
        poses = solvers.of(model_of(scenario, law, STIFFENED if stiffened else BARE), scenario)
        found |= {(robot, sets, law, stiffened): _along(poses, scenario, sets) for sets in SETS}
    return found


def page(folder: Path) -> str:
    """Write the figures into a folder and return the page."""
    found = curves()
    angles = _known()
    first = case(f"bending_{NAMES[0]}")
    top, law, silicone = measured_pressure(), law_of(first), first.material.name
    for sets, name in SETS.items():
        _draw(found, sets, name, folder)
    links = ", ".join(scenario_link(f"bending_{name}") for name in NAMES)
    return page_text(
        "Bending and elongation",
        f"{worded(len(NAMES)).capitalize()} robots in {silicone}, from zero pressure to {top} bar with the same "
        f"pressure in one, two or three sets, without loads. {worded(len(LAWS)).capitalize()} laws, with stiffening "
        f"(k_e = {STIFFENED.elongation}, k_b = {STIFFENED.bending}) and without (both zero). Curves were measured in "
        "the paper; their last points are what is known of them here.",
        f"Scenarios: {links}. They press one set; the page presses the same in two and three.",
        *(figure(_file(sets), f"{name}, {worded(len(LAWS))} laws") for sets, name in SETS.items()),
        f"## At {top} bar",
        "Each cell: with stiffening / without.",
        *(part for sets in SETS for part in (f"### {_heading(sets)}", _table(found, sets))),
        "## How far from the measurements",
        f"Mean distance from the {len(angles)} measured angles, by law:",
        _errors(found),
        _coefficients(found, law),
        "## Why it differs",
        _reasons(found, law),
        "## How the numbers are made",
        _check(found, law),
    )


def _file(sets: int) -> str:
    return f"bending_{SETS[sets].replace(' ', '_')}"


def _heading(sets: int) -> str:
    return f"Elongation, {SETS[sets]} [mm]" if sets == len(SETS) else f"Bending angle, {SETS[sets]} [deg]"


def _value(found: Curve, sets: int) -> float:
    return float((found.elongation if sets == len(SETS) else found.angle)[-1])


def _table(found: Mapping[Key, Curve], sets: int) -> str:
    measured = _known()
    rows = []
    for robot in NAMES:
        known = between(*elongation_range(robot)) if sets == len(SETS) else fixed(measured.get((robot, sets)))
        cells = [" / ".join(fixed(_value(found[robot, sets, law, s], sets)) for s in (True, False)) for law in LAWS]
        rows.append([robot, known, *cells])
    return table(["robot", "measured", *LAWS], rows)


def _last(found: Mapping[Key, Curve], law: str, stiffened: bool) -> dict[tuple[str, int], float]:
    return {key: float(found[*key, law, stiffened].angle[-1]) for key in _known()}


def _errors(found: Mapping[Key, Curve]) -> str:
    measured = _known()
    rows = [[law, *(fixed(mean_error(_last(found, law, s), measured)) for s in (True, False))] for law in LAWS]
    return table(["law", "with stiffening [deg]", "without [deg]"], rows)


def fitted(free: Sequence[str], start: Coefficients) -> Coefficients:
    """Return coefficients fitted to the measured angles, every angle alike."""
    scenario = case("measured_angles", "identify")
    assert isinstance(scenario.task, RobotTask)
    found = identify(scenario.task.measurements, scenario.material, free, coefficients=start)
    if not found.status.has_solution:
        raise RuntimeError(found.message)
    return found.coefficients


def _coefficients(found: Mapping[Key, Curve], law: str) -> str:
    """Compare coefficient sets under one law."""
    measured = _known()
    solvers, rows = Solvers(), []
    chosen = dict(COEFFICIENT_SETS)
    chosen["k_e, k_b fitted to these angles"] = fitted(["k_e", "k_b"], STIFFENED)
    chosen["k_e, k_b, phi fitted to these angles"] = fitted(["k_e", "k_b", "phi"], COEFFICIENT_SETS["calibrated"])
    for name, c in chosen.items():
        at = {key: float(curve(solvers, *key, law, c).angle[-1]) for key in measured}
        longer = [float(curve(solvers, robot, len(SETS), law, c).elongation[-1]) for robot in _long()]
        numbers = (fixed(float(v), 2) for v in (c.elongation, c.bending, c.bore_fraction))
        rows.append([name, *numbers, fixed(mean_error(at, measured)), between(min(longer), max(longer))])
    robots = ", ".join(_long())
    return (
        f"By coefficients, {law}; phi is how far beyond the bore towards the thread the pressure acts. Elongation with "
        f"three sets of {robots}, measured {between(*elongation_range(_long()[0]))} mm:\n\n"
        + table(["coefficients", "k_e", "k_b", "phi", "mean error [deg]", "elongation [mm]"], rows)
    )


def _known() -> dict[tuple[str, int], float]:
    """Return the measured angles [deg] of the robots of the page, by robot and pressurised sets."""
    return {key: angle for key, angle in measured_angles().items() if key[0] in NAMES}


def _long() -> list[str]:
    """Return the robots whose angles were measured."""
    return list(dict.fromkeys(robot for robot, _ in _known()))


def _reasons(found: Mapping[Key, Curve], law: str) -> str:
    measured = _known()
    ours = _last(found, law, True)
    over = [f"{robot} by {ours[robot, 2] - measured[robot, 2]:+.0f} deg" for robot in _long()]
    wide, narrow = (case(f"bending_{name}").robot for name in _long()[:2])
    scaled = measured[wide.name, 1] * wide.outer_diameter / narrow.outer_diameter
    stretches = [float(np.nanmax(c.stretch)) for key, c in found.items() if not key[3]]
    limit = case(f"bending_{NAMES[0]}").material.fitted_stretch[1]
    beyond = sum(s > limit for s in stretches)
    silicone = case(f"bending_{NAMES[0]}").material
    linear = material(silicone.name, "linear")
    return "\n".join(
        [
            "- The coefficients are those that reproduce the paper's own simulations "
            "([laparoscope](laparoscope.md)). They are shared by all robots; with two sets the error is "
            f"{', '.join(over)}. Fitting k_e and k_b to the angles does not help, as the table shows: no pair shared "
            "by all does well for both wide and narrow robots. With phi the error falls, but does not vanish.",
            f"- {narrow.name} has nearly the proportions of {wide.name}. By any law in which only proportions count it "
            f"bends {float(wide.outer_diameter / narrow.outer_diameter):.2f} times as far: {scaled:.0f} deg with one "
            f"set. It bent {measured[narrow.name, 1]:.0f} deg. That is in the robot, not in the equations.",
            "- Angles alone drive k_e down, and the elongation then leaves the measured range, as the table shows. "
            "[Identification](../identify.md#the-published-measurements) takes this further.",
            f"- Without stiffening {beyond} of {len(stretches)} curves end beyond a stretch of {limit:g}, where the "
            f"laws were not fitted; the largest is {max(stretches):.2f}. With it the largest is "
            f"{max(float(np.nanmax(c.stretch)) for key, c in found.items() if key[3]):.2f}.",
            "- The modulus of the linear law is not published; here it is the secant of the Mooney-Rivlin curve at "
            f"the end of the fitted range, a stretch of {limit:g}: {_kilopascal(linear):.1f} kPa, where the tangent "
            f"modulus E_t of {law} is {_kilopascal(silicone):.1f} kPa at rest. So this law bends too far.",
            f"- Conventions: `{case(f'bending_{NAMES[0]}').conventions.name}`. As printed, the stiffening force adds "
            "to the pressure, and the larger robots have no equilibrium ([model](../model.md#conventions)).",
        ]
    )


def _kilopascal(silicone: Material) -> float:
    """Return the tangent modulus at rest [kPa]."""
    return float(silicone.tangent_modulus(1.0)) / 1e3


def _check(found: Mapping[Key, Curve], law: str) -> str:
    """Solve the last pose of every robot as a boundary value problem too."""
    solvers = Solvers()
    apart, residual, unstable = 0.0, 0.0, 0
    for robot in NAMES:
        scenario = case(f"bending_{robot}")
        poses = solvers.of(model_of(scenario, law, STIFFENED), scenario)
        for sets in SETS:
            step, _ = poses.solve(with_sets(scenario.pressures, sets)[-1], Loads())
            if step.pose is None or step.residual is None:
                raise RuntimeError(f"{robot}, {SETS[sets]}: {step.message}")
            exact = found[robot, sets, law, True].angle[-1]
            apart = max(apart, abs(step.pose.bending_angle / DEGREE - float(exact)))
            residual, unstable = max(residual, step.residual), unstable + (not step.pose.stable)
    return (
        "Without loads the shape is a circular arc, so a pose takes nothing but its stretch. The multiple-shooting "
        f"problem of the last pose of every robot with one, two and three sets ({len(NAMES) * len(SETS)} poses, {law}, "
        f"with stiffening) gives the same angles to {_small(max(apart, _CHECKED))} deg, with residuals up to "
        f"{_small(residual)}; {unstable} of them are unstable."
    )


def _small(value: float) -> str:
    return f"{value:.0e}"


def _draw(found: Mapping[Key, Curve], sets: int, name: str, folder: Path) -> None:
    """Draw a panel a robot: every law, with stiffening and without, and what was measured."""
    longer = sets == len(SETS)
    measured, top = _known(), measured_pressure()
    silicone = case(f"bending_{NAMES[0]}").material.name
    what = "Elongation" if longer else "Bending"
    columns = len(NAMES) // 2
    styles = f"solid: with stiffening, dashed: without ({_STEEP} without may leave the panel)"
    canvas, axes = panels(f"{what}, {name}", f"{silicone}  ·  {styles}", 2, columns)
    unit = "elongation [mm]" if longer else "bending angle [deg]"
    label_outer(axes, columns, "pressure [bar]", unit)
    pick: Callable[[Curve], Array] = (lambda c: c.elongation) if longer else (lambda c: c.angle)
    for panel, robot in zip(axes, _two_rows(), strict=True):
        named(panel, robot)
        for k, law in enumerate(LAWS):
            for stiffened, style, width in ((True, "-", 1.6), (False, (0, (4, 2)), 1.0)):
                c = found[robot, sets, law, stiffened]
                label = law if stiffened else None
                panel.plot(c.pressure, pick(c), color=colour(k), linestyle=style, linewidth=width, label=label)
        if longer:
            low, high = elongation_range(robot)
            panel.plot([top, top], [low, high], color=INK, linewidth=4, solid_capstyle="butt", zorder=5,
                       label="measured, robots of this length", clip_on=False)  # fmt: skip
        elif (robot, sets) in measured:
            panel.plot([top], [measured[robot, sets]], label="measured", **MEASURED)
        panel.set_xlim(0, top)
    for row in (_two_rows()[:columns], _two_rows()[columns:]):
        shown = [pick(found[r, sets, law, s]) for r in row for law in LAWS for s in (True, False) if s or law != _STEEP]
        known = [measured.get((r, sets), 0.0) for r in row]
        for robot in row:
            axes[_two_rows().index(robot)].set_ylim(0, 1.06 * max(float(np.nanmax(shown)), *known))
    legend(canvas, next(p for p, r in zip(axes, _two_rows(), strict=True) if longer or (r, sets) in measured))
    saved(canvas, folder, _file(sets))


def _two_rows() -> list[str]:
    """Return the robots with the long ones in the first row."""
    length = {name: float(case(f"bending_{name}").robot.length) for name in NAMES}
    return sorted(NAMES, key=lambda name: -length[name])
