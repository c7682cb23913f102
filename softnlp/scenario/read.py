"""A scenario file, read and checked, as plain data in SI units."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from softnlp.base.errors import InputError, first_of, of_table
from softnlp.base.ranges import file_unit_note
from softnlp.base.reading import BACKSLASH_HINT, LARGEST_TOML, LONGEST_NAME, one_line, read_text, toml_tables
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE, STANDARD_GRAVITY
from softnlp.model.body import Segment
from softnlp.model.conventions import COEFFICIENT_SETS, Coefficients
from softnlp.model.materials import Material, material_from_table
from softnlp.model.numerics import Numerics
from softnlp.model.obstacles import Obstacle
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.quantities import Model
from softnlp.model.robot import DIMENSIONS, MOST_CHAMBERS, Robot, Violation, violations
from softnlp.model.rod import Loads
from softnlp.model.segments import SegmentedRobot, segmented_robot
from softnlp.rings import ALL_CONVENTIONS
from softnlp.scenario.blocked_force import contact_settings, contact_task
from softnlp.scenario.check import HOW, parse, parse_parts
from softnlp.scenario.data import Read, Task
from softnlp.scenario.data import Scenario as Scenario
from softnlp.scenario.design import design_task
from softnlp.scenario.dynamic import dynamic_task
from softnlp.scenario.energy import misplaced
from softnlp.scenario.identify import identify_task
from softnlp.scenario.inverse import inverse_task
from softnlp.scenario.obstacles import obstacles_of
from softnlp.scenario.outlined import made as made_outlined
from softnlp.scenario.outlined import outlined, outlines_given
from softnlp.scenario.pressures import PressurePath, pressure_path
from softnlp.scenario.schema import ScenarioFile
from softnlp.scenario.segments import OF_SEGMENTS, read_segments
from softnlp.scenario.trajectory import trajectory_task
from softnlp.scenario.uncertainty import uncertainty_of
from softnlp.scenario.workspace import workspace_task
from softnlp.studies.plausibility import modulus_notes

T = TypeVar("T")

_ESCAPED = re.compile(r'^[^\n#]*file\w*\s*=[^\n]*"[^"\n]*\\[uU][0-9a-fA-F]{4}', re.MULTILINE)


def load_scenario(path: str | PathLike[str]) -> Scenario:
    """Read and check a scenario file; files that it names are looked for in its folder.

    Parameters
    ----------
    path
        A TOML file.

    Returns
    -------
    Scenario
        Checked, in SI units.

    Raises
    ------
    InputError
        On one line, naming the file, the table and the key of the first error and counting the others.
    """
    try:
        text = read_text(Path(path), LARGEST_TOML)
    except InputError as error:
        raise placed(error, fspath(path)) from None
    return scenario_from_text(text, path)


def scenario_from_text(text: str, path: str | PathLike[str]) -> Scenario:
    """Check the text of a scenario; `path` names it in errors, and its folder holds the files that it names.

    Raises
    ------
    InputError
        As `load_scenario`.
    """
    try:
        return _scenario(text, Path(path))
    except InputError as error:
        if "no such file" in error.message and _ESCAPED.search(text):
            message = f"{error.message}; {BACKSLASH_HINT}"
            error = type(error)(message, table=error.table, key=error.key, every=error.every)
        raise placed(error, fspath(path)) from None


def robot_of_scenario(path: str | PathLike[str], segment: int | None = None) -> tuple[Robot, tuple[Violation, ...]]:
    """Return the robot of a scenario file and the rules of manufacture that it breaks, whether allowed or not.

    segment : of several, from 1, the first by default. Of one that varies along s it is the robot at the base.

    Raises
    ------
    InputError
        As `load_scenario`, for everything but those rules, and for a segment that there is not.
    """
    try:
        file = parse(parse_toml(read_text(Path(path), LARGEST_TOML)))
        tables: list[Any] = getattr(file, "segment", None) or [file]
        if segment is not None and not 1 <= segment <= len(tables):
            raise InputError(f"expected a segment from 1 to {len(tables)}, got {segment}", table="segment")
        chosen = tables[(segment or 1) - 1]
        by_outlines = outlines_given(chosen)
        robot = outlined(chosen, file.corrections.conventions) if by_outlines else chosen.robot.described()
        return robot, violations(robot, chosen.robot.minimum_wall_mm * MILLIMETRE)
    except InputError as error:
        raise placed(error.located(table="robot"), fspath(path)) from None


def _scenario(text: str, path: Path) -> Scenario:
    """Build a scenario; errors do not name the file yet."""
    data = parse_toml(text)
    file, errors, bad = parse_parts(data)  # what does not fit is in no table of the file
    errors += misplaced(data)
    made, chosen, unlikely = _robot(file, data, path.parent, errors, bad)
    alone: list[Any] = getattr(file, "segment", None) or []
    if len(alone) == 1:  # a robot like any other, of which studies read what they read elsewhere
        file = file.model_copy(update={"robot": alone[0].robot, "material": alone[0].material})
    steps = contact = task = numerics = None
    if "pressure" not in bad and (made is not None or not bad & {"robot", "segment"}):
        with suppress(InputError, AttributeError):  # of a robot that is not described, which was said
            sets = made[0].chamber_sets if made is not None else file.robot.described().chamber_sets
            steps = _attempt(errors, "pressure", lambda: _steps(file, min(sets, MOST_CHAMBERS), path.parent))
    if "contact" not in bad and (wall := getattr(file, "contact", None)) is not None:
        single = None if made is None or file.study == "design" else made[0]  # a design judges each candidate
        energy = file.corrections.conventions == "energy"
        contact = _attempt(errors, "contact", lambda: contact_settings(wall, single, energy=energy))
    if file.study in TASKS and not bad and made is not None and chosen is not None and steps is not None:
        table, read_task = TASKS[file.study]
        given = Read(file, data, made[0], chosen, steps, path.parent)
        task = _attempt(errors, table, lambda: read_task(given))
    if "solver" not in bad:
        numerics = _attempt(errors, "solver", lambda: _numerics(file))
    scatter = None
    asked = getattr(file, "uncertainty", None)
    said = None if asked is None else asked.model_dump(exclude_unset=True, warnings=False)
    if said is not None and made is not None and isinstance(made[0], SegmentedRobot | OutlinedRobot):
        what = (
            "with [[chamber]]"
            if isinstance(made[0], OutlinedRobot)
            else "of several segments, or one that varies along s,"
        )
        errors.append(InputError(f"a robot {what} takes none so far", table="uncertainty"))
    if said is not None and not errors and made is not None and chosen is not None:
        silicone = data.get("material") or file.material.model_dump(exclude_none=True)
        model = Model(made[0], chosen, _coefficients(file), ALL_CONVENTIONS[file.corrections.conventions])
        pressed = contact if file.study == "blocked-force" else None
        scatter = _attempt(
            errors, "uncertainty", lambda: uncertainty_of(said, model, silicone, path.parent, pressed, task)
        )
    obstacles: tuple[Obstacle, ...] = ()
    if "obstacle" not in bad and (asked_for := getattr(file, "obstacle", [])):
        obstacles = _attempt(errors, "obstacle", lambda: obstacles_of(file, asked_for)) or ()
    if errors or made is None or chosen is None or steps is None or numerics is None:
        raise first_of(errors, HOW)
    robot, warnings = made
    return Scenario(
        path=path,
        text=text,
        title=file.title or path.stem,
        study=file.study,
        robot=robot,
        material=chosen,
        coefficients=_coefficients(file),
        conventions=ALL_CONVENTIONS[file.corrections.conventions],
        loads=_loads(file),
        pressures=steps.pressures,
        times=steps.times,
        numerics=numerics,
        contact=contact,
        task=task,
        warnings=(*warnings, *unlikely, *file_unit_note(data), *steps.notes),
        registration=getattr(file, "registration", None) if "registration" in data else None,
        uncertainty=scatter,
        mould=file.mould,
        obstacles=obstacles,
    )


def _robot(
    file: ScenarioFile, data: dict[str, Any], folder: Path, errors: list[InputError], bad: set[str]
) -> tuple[tuple[Robot, tuple[str, ...]] | None, Material | None, tuple[str, ...]]:
    """Return the robot with its warnings, the silicone, and what is unlikely of it; None with an error for each.

    bad : the tables that do not fit, of which nothing is read.
    """

    def notes(material: Material) -> tuple[str, ...]:
        # Where constants are to be found, those given only begin the search.
        known = file.study == "identify"
        return () if known else modulus_notes(material.name, float(material.shear_modulus(1.0)))

    if "segment" in bad:
        return None, None, ()
    if (tables := getattr(file, "segment", None)) is not None:
        found = read_segments(tables, data["segment"], folder, errors, file.corrections.conventions)
        if found is None:
            return None, None, ()
        robot, silicone, warnings = found
        every = [s.material for s in robot.segments] if isinstance(robot, SegmentedRobot) else [silicone]
        unlikely = dict.fromkeys(note for one in every for note in notes(one))
        return (robot, warnings), silicone, tuple(unlikely)
    made = chosen = None
    outlines: Any = file
    by_outlines = not {"chamber", "body"}.isdisjoint(data)  # also where they do not fit
    if by_outlines and not {"robot", "chamber", "body", "corrections"} & bad:
        made = _attempt(errors, "robot", lambda: made_outlined(outlines, file.corrections.conventions))
    elif "robot" not in bad and not by_outlines:
        made = _attempt(errors, "robot", file.robot.made)
    if "material" not in bad:
        written = data.get("material") or file.material.model_dump(exclude_none=True)
        chosen = _attempt(errors, "material", lambda: material_from_table(written, folder=folder))
    if made is None or chosen is None:
        return made, chosen, ()
    if (along := file.robot.along) and not by_outlines:
        if file.study not in OF_SEGMENTS:
            key = next(iter(along)).removeprefix("robot.")
            text = f"study {file.study!r} takes one number here so far, not one that varies along s"
            errors.append(InputError(text, table="robot", key=next(d.file_key for d in DIMENSIONS if d.field == key)))
        varying = segmented_robot([Segment(made[0], chosen, along=along)])
        return (varying, made[1]), varying.material, notes(chosen)
    return made, chosen, notes(chosen)


def _numerics(file: ScenarioFile) -> Numerics:
    """Return the choices of [solver]."""
    solver, options = file.solver, cast(Any, file.solver.ipopt)
    return Numerics(**{**dict(solver), "ipopt": options.model_dump(exclude_unset=True)})


def _steps(file: ScenarioFile, sets: int, folder: Path) -> PressurePath:
    """Return the pressures of a study that has them, else none."""
    table = getattr(file, "pressure", None)
    if table is None:
        return PressurePath(np.zeros((0, sets)), None)
    return pressure_path(table, sets, folder, over_time=file.study in ("dynamic", "identify"))


def _attempt(errors: list[InputError], table: str, build: Callable[[], T]) -> T | None:
    """Return what is built, or None with the error added to the others."""
    try:
        with of_table(table):
            return build()
    except InputError as error:
        errors.append(error)
        return None


def placed(error: InputError, source: str) -> InputError:
    """Return an error that names the file; whatever it quotes stays printable and on the same line."""
    table = error.table and one_line(error.table, LONGEST_NAME)
    key = error.key and one_line(error.key, LONGEST_NAME)
    every = [placed(one, source) for one in error.every]
    return type(error)(one_line(error.message), source=one_line(source), table=table, key=key, every=every)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a scenario; raises `InputError` where the text is empty or not TOML."""
    if not text.strip():
        raise InputError("expected a scenario, got an empty file")
    return toml_tables(text)


def _coefficients(file: ScenarioFile) -> Coefficients:
    """Take the coefficients of the named set, and the file's own where it gives them."""
    own = file.stiffening.model_dump(exclude={"set"}, exclude_none=True)
    own |= file.corrections.model_dump(exclude={"conventions"}, exclude_none=True)
    if (wall := getattr(file, "contact", None)) is not None and wall.chamber_reaction is not None:
        own["chamber_reaction"] = wall.chamber_reaction
    return replace(COEFFICIENT_SETS[file.stiffening.set], **own)


def _loads(file: ScenarioFile) -> Loads:
    """Return tip load and gravity."""
    f_x, f_y, f_z = file.tip_load.force_N
    m_x, m_y, m_z = (component * NEWTON_MILLIMETRE for component in file.tip_load.moment_Nmm)
    g_x, g_y, g_z = (component * STANDARD_GRAVITY for component in file.gravity.direction)
    return Loads(tip_force=(float(f_x), float(f_y), float(f_z)), tip_moment=(m_x, m_y, m_z), gravity=(g_x, g_y, g_z))


TASKS: Mapping[str, tuple[str, Callable[[Read], Task]]] = {
    "blocked-force": ("contact", contact_task),
    "workspace": ("workspace", workspace_task),
    "inverse": ("target", inverse_task),
    "identify": ("measurements", identify_task),
    "design": ("choices", design_task),
    "dynamic": ("dynamic", dynamic_task),
    "trajectory": ("trajectory", trajectory_task),
}
"""For each study with tables of its own: the table that its errors are about, and what reads them."""
