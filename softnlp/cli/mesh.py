"""`softnlp mesh`: the body of a step, or the one to cast, as a watertight solid."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, STOPPED, complain, say
from softnlp.cli.study import AllErrors, require_file, scenario_at, stepwise

if TYPE_CHECKING:
    from softnlp.figures.mesh import Solid
    from softnlp.model.robot import Robot
    from softnlp.results import RunView


def mesh(
    scenario: Path,
    /,
    *,
    step: int | None = None,
    undeformed: bool = False,
    cores: bool = False,
    animate: bool = False,
    holes: str | None = None,
    facets: int | None = None,
    out: Path | None = None,
    all_errors: AllErrors = False,
) -> int:
    """Write the body of one step as a watertight solid in mm; --undeformed writes the body to cast, without a solve.

    Lumen and chambers are holes, open at both ends. Of several segments each is a solid of its own. The exit status is
    3 when the step did not solve.

    Parameters
    ----------
    scenario
        TOML file, or the folder of a run (or its results.nc).
    step
        Which step, from 1; the last by default.
    undeformed
        The body as it is cast: straight, of its natural length, without pressure.
    cores
        Also what fills the lumen and each chamber: in a GLB beside the body, with an STL as a second file, NAME-cores.
    animate
        All steps as one animated GLB, in the time of a dynamic run, else a step a second; of a run or a scenario.
    holes
        Of --undeformed: "bore" (default) makes the finished body; "reinforced" leaves room for chambers wound before.
    facets
        Sides of every circle; 96 by default.
    out
        STL or GLB file; NAME.stl by default, NAME.glb with --animate.
    """
    from softnlp.figures.mesh import FACETS, HOLES, body_solid, format_of, mould_body, require
    from softnlp.figures.mesh import cores as core_solids
    from softnlp.figures.mesh.solid import segment_solids
    from softnlp.model.segments import SegmentedRobot, require_one_segment

    target = out or Path(f"{_stem(scenario)}.{'glb' if animate else 'stl'}")
    if animate:
        return _animated(scenario, target, facets, [step, undeformed or None, cores or None, holes], all_errors)
    format_of(target)
    require_file(target)
    sides = FACETS if facets is None else facets
    require(sides)
    if undeformed:
        if step is not None:
            raise InputError("expected no step together with --undeformed", key="--step")
        robot = _robot(scenario, all_errors)
        chosen = holes or HOLES[0]
        solids: tuple[Solid, ...] = (mould_body(robot, sides, chosen),)
        inside = core_solids(robot, None, sides, chosen) if cores else ()
    else:
        if holes is not None:
            raise InputError("expected only together with --undeformed", key="--holes")
        view, number = _view_of(scenario, step, all_errors)
        if view is not None and cores:
            require_one_segment(view.robot, "softnlp mesh --cores")
        if view is None:
            complain(f"stopped before step {number}; nothing was written")
            return STOPPED
        body = view.bodies[number - 1]
        if body is None:
            complain(f"step {number} has no body to write, its status is {view.status[number - 1].value!r}")
            return SOME_UNSOLVED
        robot = view.robot
        several = isinstance(robot, SegmentedRobot)
        solids = segment_solids(robot, body, sides) if several else (body_solid(robot, body, sides),)
        inside = core_solids(robot, body, sides) if cores else ()
    _write(solids, inside, robot, target)
    return SOLVED


def _animated(scenario: Path, target: Path, facets: int | None, others: list[object], all_errors: bool) -> int:
    """Write all steps as one animated GLB; return the exit status. others : what does not go with it."""
    import numpy as np

    from softnlp.base.files import make_folder
    from softnlp.figures.mesh import format_of
    from softnlp.figures.mesh.animation import FACETS, frames_of, write_animation

    if any(other is not None for other in others):
        raise InputError("expected neither --step, --undeformed, --cores nor --holes beside it", key="--animate")
    if format_of(target) != ".glb":
        raise InputError("expected a file name that ends in .glb", key="--out")
    require_file(target)
    view, number = _view_of(scenario, None, all_errors)
    if view is None:
        complain(f"stopped before step {number}; nothing was written")
        return STOPPED
    chosen = frames_of(view.solved)
    bodies = [body for k in chosen if (body := view.bodies[k]) is not None]
    times = np.array(chosen, float) if view.time is None else np.asarray(view.time, float)[chosen]
    make_folder(target.parent)
    written = write_animation(view.robot, bodies, times, target, FACETS if facets is None else facets)
    say(f"{view.robot.name}: {len(bodies)} of {len(view.bodies)} steps in {written}")
    return SOLVED if len(view.solved) == len(view.bodies) else SOME_UNSOLVED


def _write(solids: tuple[Solid, ...], inside: tuple[Solid, ...], robot: Robot, target: Path) -> None:
    """Write the files and say what is in them."""
    from softnlp.base.files import make_folder
    from softnlp.figures.mesh import format_of, write_solids

    make_folder(target.parent)
    for warning in (warning for solid in solids for warning in solid.warnings):
        complain(f"warning: {warning}")
    apart = bool(inside) and format_of(target) == ".stl"
    say(
        f"{robot.name}: {sum(solid.volume for solid in solids):.6g} mm^3 of silicone, "
        f"{sum(len(solid.faces) for solid in solids)} triangles in "
        f"{write_solids(solids if apart else [*solids, *inside], robot, target)}"
    )
    if apart:
        second = write_solids(inside, robot, target.with_name(f"{target.stem}-cores{target.suffix}"))
        say(f"its {len(inside)} cores in {second}")


def _stem(path: Path) -> str:
    """Return the name of a scenario, or of the folder that results.nc is in."""
    place = path.resolve()
    if place.is_dir():
        return place.name
    return place.parent.name if path.suffix == ".nc" else path.stem


def _is_run(path: Path) -> bool:
    return path.is_dir() or path.suffix == ".nc"


def _robot(path: Path, all_errors: bool) -> Robot:
    from softnlp.model.segments import require_one_segment
    from softnlp.results import load_run

    found = load_run(path).robot if _is_run(path) else scenario_at(path, all_errors).robot
    require_one_segment(found, "softnlp mesh --undeformed")
    return found


def _view_of(path: Path, step: int | None, all_errors: bool) -> tuple[RunView | None, int]:
    """Return the view up to a step, and its number; None where Ctrl-C came before it."""
    from softnlp.results import load_run, view_of_run
    from softnlp.scenario.run import STUDIES, partial_run, solve_steps

    if _is_run(path):
        view = load_run(path)
        return view, _number(step, len(view.bodies))
    asked = scenario_at(path, all_errors)
    if asked.study not in STUDIES:
        raise InputError(
            f"expected {', '.join(map(repr, STUDIES))} for the body of a step, got {asked.study!r}; --undeformed "
            "needs none",
            source=str(path),
            key="study",
        )
    number = _number(step, asked.step_count)
    for warning in asked.warnings:
        complain(f"warning: {warning}")
    steps, _ = stepwise(asked, number, lambda keep: solve_steps(asked, keep), to_end=False)
    return (view_of_run(partial_run(asked, steps)) if len(steps) == number else None), number


def _number(step: int | None, count: int) -> int:
    number = count if step is None else step
    if not 1 <= number <= count:
        raise InputError(f"expected a step from 1 to {count}, got {number}", key="--step")
    return number
