"""The figures of a results folder, drawn again from its files: of a run, a sweep or the document of another study."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.base.reading import LARGEST_DATA, LARGEST_TOML, read_text
from softnlp.base.status import Status
from softnlp.base.units import BAR, MEGAPASCAL, MILLIMETRE
from softnlp.model.inputs import loads_of_table, robot_of_table
from softnlp.model.laws import LAWS
from softnlp.model.robot import DIMENSIONS, ROBOTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softnlp.scenario.read import Scenario

Makers = dict[str, "Callable[[], Figure]"]


def folder_figures(folder: Path) -> Makers:
    """Return what draws each figure of a results folder, by the name of its file without the ending.

    Raises
    ------
    InputError
        Where the folder holds no results, or a file of theirs is missing or not what its command wrote.
    """
    for name, makers in _KINDS.items():
        if (folder / name).is_file():
            try:
                return makers(folder)
            except (KeyError, IndexError, TypeError, AttributeError) as error:
                raise InputError(f"not what its command wrote: {error!r}", source=str(folder / name)) from None
    there = "there is no such folder" if not folder.is_dir() else f"none of {', '.join(_KINDS)} is there"
    raise InputError(f"nothing to draw: {there}", source=str(folder))


def _run(folder: Path) -> Makers:
    from softnlp.figures.run import run_figure
    from softnlp.results.folder import load_run

    view = load_run(folder)
    return {"figure": lambda: run_figure(view)}


def _workspace(folder: Path) -> Makers:
    from softnlp.figures.workspace import dexterity_figure, workspace_figure
    from softnlp.sweep.read import load_workspace
    from softnlp.sweep.summary import summarise

    found = load_workspace(folder)
    made: Makers = {"workspace": lambda: workspace_figure(found)}
    if (dexterity := summarise(found).dexterity) is not None:
        made["dexterity"] = lambda: dexterity_figure(dexterity, found.title, found.robot.name)
    return made


def _document(folder: Path, name: str) -> Any:
    try:
        return json.loads(read_text(folder / name, LARGEST_DATA))
    except (InputError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", source=str(folder / name)) from None


def _scenario(folder: Path) -> Scenario:
    """Return the scenario that lies beside results."""
    from softnlp.scenario.read import load_scenario

    return load_scenario(folder / "scenario.toml")


# --- identification ---------------------------------------------------------------------------------------------------


def _identified(folder: Path) -> Makers:
    told = _document(folder, "identified.json")
    if "laws" in told:
        return _tensile(folder, told)
    if told["status"] != Status.SOLVED:
        raise InputError(f"nothing to draw: the identification ended {told['status']!r}", source=str(folder))
    if "step_s" in told:
        return {"figure": partial(_motion, told, told["measurements"], ("before", "after"), told["errors"]["after"])}
    return {"figure": partial(_identified_figure, folder, told)}


def _motion(told: Any, rows: Any, names: tuple[str, ...], errors: Any) -> Figure:
    """Draw a tip over time. rows : with t_s, measured and what is named, in mm. errors : of the last of these."""
    from softnlp.figures.trace import trace_figure
    from softnlp.studies.trace import Harmonic, Trace, TraceErrors

    times = np.array([row["t_s"] for row in rows])
    every = ("measured", *names)
    tips = {name: np.array([[_number(v) for v in row[name]] for row in rows]) * MILLIMETRE for name in every}
    harmonic = None
    if (first := errors["first_harmonic"]) is not None:
        simulated = first["simulated_mm"] * MILLIMETRE * np.exp(1j * np.deg2rad(first["phase_deg"]))
        measured = complex(first["measured_mm"] * MILLIMETRE)
        harmonic = Harmonic(first["frequency_Hz"], "xyz".index(first["axis"]), measured, complex(simulated))
    trace = Trace(times, tips.pop("measured"))
    off = np.sqrt(np.nansum((tips[names[-1]] - trace.tip) ** 2, axis=1))
    return trace_figure(told["title"], trace, tips, TraceErrors(off, np.zeros(3), nan, harmonic))


def _tensile(folder: Path, told: Any) -> Makers:
    from softnlp.figures.identify import tensile_figure
    from softnlp.model.materials import load_materials, material_from_table
    from softnlp.scenario.read import parse_toml
    from softnlp.studies.tensile import LawFit, TensileFit

    with (folder / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    stretch = np.array([float(row["stretch"]) for row in rows])
    stress = np.array([float(row["stress_MPa"]) for row in rows]) * MEGAPASCAL
    entry = load_materials(folder / "material.toml").get(told["material"])
    fits = {}
    for one in told["laws"]:
        made = None if entry is None else entry.models.get(one["model"])
        law = LAWS[one["model"]] if made is None else made.law
        scale = {c.file_key: (c.name, c.scale) for c in law.constants}
        errors = one["standard_errors"]
        fits[law.name] = LawFit(
            law=law,
            constants={scale[key][0]: value * scale[key][1] for key, value in one["constants"].items()},
            standard_errors={scale[k][0]: inf if v is None else v * scale[k][1] for k, v in errors.items()},
            correlation=np.empty((0, 0)),
            condition=nan,
            r_squared=_number(one["r_squared"]),
            misfit=None,  # type: ignore[arg-type]  # of the numbers, which are not drawn
            fitted_stretch=tuple(told["fitted_stretch"]),
            unstable_from=one["unstable_from_stretch"],
            at_bound=tuple(scale[key][0] for key in one["at_bound"]),
            checks=(),
            status=one["status"],
            material=made,
            problem=one["message"],
            warnings=(),
        )
    before = None
    if told["before"] is not None:
        table = parse_toml(read_text(folder / "scenario.toml", LARGEST_TOML))["material"]
        with suppress(InputError):  # of a file that is not beside the results
            before = material_from_table(table, folder=folder)
    fit = TensileFit(stretch, stress, fits, ())
    return {"figure": partial(tensile_figure, fit, told["material"], before)}


def _identified_figure(folder: Path, told: Any) -> Figure:
    from softnlp.figures.identify import identified_figure
    from softnlp.studies.fit_statistics import Uncertainty
    from softnlp.studies.identified import FreeConstants, Identified
    from softnlp.studies.measurements import COLUMNS, Data

    labels = list(dict.fromkeys(row["robot"] for row in told["measurements"]))
    robots = _robots(folder, labels)
    data, models = [], {"before": [], "after": []}  # type: ignore[var-annotated]
    for label in labels:
        rows = [row for row in told["measurements"] if row["robot"] == label]
        shape = (len(rows), len(COLUMNS))
        values = {when: np.full(shape, nan) for when in ("measured", "before", "after")}
        for k, row in enumerate(rows):
            for when, array in values.items():
                for columns, numbers in _observed(row[when]):
                    array[k, columns] = numbers
        pressure = np.array([row["pressure_bar"] for row in rows]) * BAR
        of_sensor = np.zeros((len(rows), 9)), np.full(len(rows), nan)  # which is not drawn
        ones = np.ones(shape), np.ones(len(rows))
        data.append(Data(robots[label], label, pressure, values["measured"], *of_sensor, *ones))
        for when in models:
            models[when].append(values[when])
    named = [_constant(one["name"]) for one in told["constants"]]
    names, scales = [name for name, _ in named], np.array([scale for _, scale in named])
    found = np.array([_number(one["value"]) for one in told["constants"]]) * scales
    errors = np.array([_number(one["standard_error"], inf) for one in told["constants"]]) * scales
    none = np.full(len(names), nan)
    identified = Identified(
        status=Status.SOLVED,
        message="",
        free=FreeConstants(tuple(names), tuple(names), none, none, none, none),
        constants=found,
        at_bound=tuple(n for n, one in zip(names, told["constants"], strict=True) if one["at_bound"]),
        uncertainty=Uncertainty(errors, np.empty((0, 0)), nan, ()),
        material=None,  # type: ignore[arg-type]  # nothing of it is drawn
        coefficients=None,  # type: ignore[arg-type]
        data=tuple(data),
        before=tuple(models["before"]),
        after=tuple(models["after"]),
        evaluations=0,
        warnings=(),
    )
    keys = {name: (one["name"], scale) for one, (name, scale) in zip(told["constants"], named, strict=True)}
    return identified_figure(identified, told["title"], keys)


def _observed(numbers: Mapping[str, Any]) -> Iterator[tuple[slice, Any]]:
    """Yield where each observable of a row stands, and its numbers in SI."""
    from softnlp.studies.measurements import OBSERVABLES, column_slice

    for name in OBSERVABLES:
        if (value := numbers.get(OUTPUTS[name].key)) is not None:
            yield column_slice(name), np.array([_number(v) for v in np.atleast_1d(value)]) * OUTPUTS[name].scale


def _robots(folder: Path, labels: list[str]) -> dict[str, Any]:
    """Return the robots of measurements by their names, of the scenario or the library."""
    from softnlp.scenario.check import parse
    from softnlp.scenario.read import parse_toml

    file: Any = parse(parse_toml(read_text(folder / "scenario.toml", LARGEST_TOML)))
    own = {name: table.made()[0] for name, table in file.robots.items()}
    return {label: own.get(label) or ROBOTS.get(label) or file.robot.made()[0] for label in labels}


def _constant(key: str) -> tuple[str, float]:
    """Return the name of a constant that files have under a key, and the unit there in SI."""
    from softnlp.studies.registration import NAMES, unit_of

    registered = {unit_of(name)[0]: (name, unit_of(name)[1]) for name in NAMES}
    laws = {c.file_key: (c.name, c.scale) for law in LAWS.values() for c in law.constants}
    return registered.get(key) or laws.get(key) or (key, 1.0)


# --- design -----------------------------------------------------------------------------------------------------------


def _design(folder: Path) -> Makers:
    from softnlp.figures.design import design_figure
    from softnlp.model.contact_settings import ContactSettings
    from softnlp.studies.design import Design
    from softnlp.studies.design_task import DesignTask, Setting

    told, asked = _document(folder, "design.json"), _scenario(folder)
    task = asked.task
    if not isinstance(task, DesignTask):
        raise InputError("expected a scenario of study 'design'", source=str(folder / "scenario.toml"))
    setting = Setting(asked.robot, asked.material, contact=asked.contact or ContactSettings(), **asked.settings)
    done = Design(setting, task, tuple(_candidate(one, asked, task) for one in told["candidates"]), told["title"])
    return {"figure": lambda: design_figure(done)}


def _candidate(told: Any, asked: Scenario, task: Any) -> Any:
    """Return a candidate of a document."""
    from softnlp.studies.design_candidate import Candidate
    from softnlp.studies.design_problem import Active
    from softnlp.studies.design_task import OUTPUTS as POSSIBLE

    chosen, choices = told["choices"], {}
    material = asked.material
    fields = {f"robot.{d.file_key}": (d.field, d.scale) for d in DIMENSIONS}
    for key, value in chosen.items():
        if key == "material.name":
            law = chosen["material.model"]
            material = next(m for m in task.choices["material"] if (m.name, m.law.name) == (value, law))
            choices["material"] = material
        elif key == "robot.name":
            choices["robot"] = next(r for r in task.choices["robot"] if r.name == value)
        elif key == OUTPUTS["pressure"].key:
            choices["pressure"] = value * BAR
        elif key in fields:
            field, scale = fields[key]
            choices[field] = value if scale is None else value * scale
    scales = {o.key: (o.name, o.scale) for o in POSSIBLE.values()}
    outputs = {scales[k][0]: v * scales[k][1] for k, v in told["outputs"].items() if v is not None}
    active = []
    for one in told["active"]:
        name, scale = scales.get(
            one["limit"], (one["limit"], next(o.scale for o in OUTPUTS.values() if o.unit.label == one["unit"]))
        )
        rate = _number(one["gain_per_unit"]) * task.objective.scale / scale
        active.append(Active(name, one["side"], _number(one["value"]) * scale, rate))
    return Candidate(
        number=told["number"],
        choices=choices,
        robot=robot_of_table(told["robot"]),
        material=material,
        status=told["status"],
        reasons=tuple(told["reasons"]),
        outputs=outputs,
        objective=outputs.get(task.objective.name, nan),
        active=tuple(active),
    )


# --- comparison and sensitivities -------------------------------------------------------------------------------------


def _comparison(folder: Path) -> Makers:
    from softnlp.figures.compare import figure_makers
    from softnlp.model.contact_settings import ContactSettings
    from softnlp.scenario.compare import Asked, compare_task
    from softnlp.studies.comparison import NUMBERS, OBSERVABLES, Comparison, Solved
    from softnlp.studies.measurements import observed

    told, scenario = _document(folder, "comparison.json"), _scenario(folder)
    if "first_harmonic" in told:
        return {"figure": partial(_motion, told, told["measurements"], ("simulated",), told)}
    words = {key: tuple(dict.fromkeys(v[key] for v in told["variants"] if v[key] is not None))
             for key in ("law", "coefficients", "conventions", "closure")}  # fmt: skip
    asked = Asked(words["law"], words["coefficients"], words["conventions"], words["closure"], told["shape"])
    task = compare_task(scenario, folder / "measured.csv", asked)
    robots = tuple(observed(m, NUMBERS) for m in task.measurements)
    simulated = []
    for variant in told["variants"]:
        solved = []
        for o, rows in zip(robots, task.rows, strict=True):
            values = np.full(o.values.shape, nan)
            lines = [variant["rows"][place] for _, place in rows.places]
            for k, line in enumerate(lines):
                for j, name in enumerate(NUMBERS):
                    number = line.get("simulated", {}).get(OBSERVABLES[name].measured)
                    values[k, j] = _number(number) * OBSERVABLES[name].scale
            status = tuple(None if line["status"] is None else Status(line["status"]) for line in lines)
            through = frozenset(k for k, line in enumerate(lines) if line.get("self_intersecting"))
            solved.append(Solved(values, status, tuple(line.get("message", "") for line in lines), through))
        simulated.append(tuple(solved))
    contact = scenario.contact or ContactSettings()
    found = Comparison(robots, task.variants, tuple(simulated), contact, told["shape"])
    return dict(figure_makers(task, found))


def _sensitivity(folder: Path) -> Makers:
    from softnlp.figures.sensitivity import sensitivity_figure
    from softnlp.statics.step import SectionRadii
    from softnlp.studies.ellipsoids import Ellipsoid
    from softnlp.studies.sensitivity import Sensitivities

    told = _document(folder, "sensitivity.json")
    if told.get("body") is None:
        raise InputError("nothing to draw: the step has no solution", source=str(folder))
    body = told["body"]
    shape = SimpleNamespace(position=np.array(body["position_m"]), rotation=np.array(body["rotation"]))
    pose = SimpleNamespace(shape=shape, tip_position=shape.position[-1], radii=SectionRadii(**body["radii_m"]))

    def ellipsoid(table: Any) -> Ellipsoid:
        return Ellipsoid(np.array(table["axes"]), np.array(table["semi_axes"]), table["unit"])

    def columns(rows: Any) -> tuple[tuple[str, ...], tuple[str, ...], Any]:
        return tuple(r["name"] for r in rows), tuple(r["unit"] for r in rows), _array([r["value"] for r in rows])

    outputs, output_units, values = columns(told["outputs"])
    quantities, units, nominal = columns(told["quantities"])
    step: Any = SimpleNamespace(status=Status(told["status"]), pose=pose)
    bars, sampled = told.get("error_bars"), told.get("monte_carlo")
    moved = told["manipulability"]
    report: Any = SimpleNamespace(
        robot=robot_of_table(told["robot"]),
        material=SimpleNamespace(name=told["material"]),
        sensitivities=Sensitivities(
            step, outputs, output_units, quantities, units, values, nominal, _array(told["matrix"]), None
        ),
        solved=True,
        pose=pose,
        loads=loads_of_table(told["loads"]),
        manipulability=SimpleNamespace(
            translation=ellipsoid(moved["translation"]), rotation=ellipsoid(moved["rotation"])
        ),
        compliance=ellipsoid(told["compliance_ellipsoid"]),
        stiffness=ellipsoid(told["stiffness_ellipsoid"]),
        bars=None
        if bars is None
        else SimpleNamespace(
            quantities=bars["quantities"], total=_array(bars["total"]), contribution=_array(bars["contribution"])
        ),
        sampled=None if sampled is None else SimpleNamespace(deviation=_array(sampled["deviation"])),
    )
    return {"sensitivity": lambda: sensitivity_figure(report, f"{told['title']}, step {told['step']}")}


def _number(value: Any, nothing: float = nan) -> float:
    return nothing if value is None else float(value)


def _array(values: Any) -> Any:
    """Return numbers of a document, nan where there is none."""
    return np.array(values, dtype=float)


_KINDS: Mapping[str, Callable[[Path], Makers]] = {
    "results.nc": _run,
    "workspace.nc": _workspace,
    "identified.json": _identified,
    "design.json": _design,
    "comparison.json": _comparison,
    "sensitivity.json": _sensitivity,
}
"""What draws the folder in which a file is."""
