"""`softnlp plot`: a cross-section, silicones, or the results of a run, as figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from softnlp.base.errors import InputError
from softnlp.base.reading import did_you_mean
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, say
from softnlp.cli.figures import draw

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DRAWN = ("section", "material", "run")  # in place of a folder


def plot_section(robot: str, /, *, stretch: float = 1.0, segment: int | None = None, out: Path | None = None) -> int:
    """Draw a cross-section to scale, its sets coloured and the rules that it breaks marked.

    Parameters
    ----------
    robot
        A name of the library, or a scenario file (one whose robot cannot be made is drawn too).
    stretch
        Draw the section at this stretch as well.
    segment
        Of a scenario with several, from 1, the first by default; of one that varies along s the section at the base.
    out
        PNG, PDF or SVG file; section-ROBOT.png by default.
    """
    from softnlp.figures import section_figure
    from softnlp.model.robot import robot as library_robot
    from softnlp.model.robot import violations
    from softnlp.scenario.read import robot_of_scenario

    if robot.endswith(".toml"):
        made, broken = robot_of_scenario(robot, segment)
    else:
        if segment is not None:
            raise InputError("expected only with a scenario", key="--segment")
        made = library_robot(robot)
        broken = violations(made)
    name = "".join(c if c.isalnum() or c in "-_." else "-" for c in made.name)
    return _save(lambda: section_figure(made, broken, stretch), out or Path(f"section-{name}.png"))


def plot_material(
    *names: str,
    law: tuple[str, ...] = ("mooney-rivlin",),
    file: Path | None = None,
    stretch: float = 2.2,
    out: Path = Path("materials.png"),
) -> int:
    """Draw stress and tangent modulus against stretch.

    Parameters
    ----------
    names
        Silicones; all of the file when none is named.
    law
        A law's name; repeat it for several, or "all".
    file
        A materials file of your own; the shipped one by default.
    stretch
        Draw from 1 to this stretch.
    out
        PNG, PDF or SVG file.
    """
    from softnlp.figures import material_figure
    from softnlp.model.materials import load_materials, material

    entries = load_materials(file)
    chosen = []
    for name in names or tuple(entries):
        laws = tuple(entries[name].models) if "all" in law and name in entries else law
        chosen += [material(name, model, file=file) for model in laws]
    return _save(lambda: material_figure(chosen, (1.0, stretch)), out)


def plot_run(results: Path, /, *, out: Path | None = None) -> int:
    """Draw the results of a run again: shapes, bending angle and elongation; or as a GIF its steps one by one.

    Parameters
    ----------
    results
        Folder of a run, or its results.nc.
    out
        PNG, PDF, SVG or GIF file; figure.png beside the results by default.
    """
    from softnlp.figures import run_figure
    from softnlp.results import load_run

    folder = results if results.is_dir() else results.parent
    view = load_run(results)
    if out is not None and out.suffix.lower() == ".gif":
        from softnlp.figures.animation import write_gif
        from softnlp.figures.style import import_alone

        import_alone()
        say(f"drawn in {write_gif(view, out)}")
        return SOLVED
    return _save(lambda: run_figure(view), out or folder / "figure.png")


def plot_folder(results: Path, /, *, out: Path | None = None, format: Literal["png", "pdf", "svg"] = "png") -> int:
    """Draw the figures of a results folder again, from its files: of any study, a sweep, a comparison, sensitivities.

    Parameters
    ----------
    results
        Folder of a run, sweep, identify, design, compare or sensitivity.
    out
        Folder for the figures; that of the results by default.
    format
        png, pdf or svg.
    """
    from softnlp.base.files import make_folder
    from softnlp.figures.again import folder_figures

    if not results.exists() and (meant := did_you_mean(str(results), _DRAWN)):
        raise InputError(f"nothing to draw: there is no such folder{meant}", source=str(results))
    makers = folder_figures(results)
    to = results if out is None else make_folder(out)
    written = draw({to / f"{name}.{format}": figure for name, figure in makers.items()}, results)
    for drawn in written:
        say(f"drawn in {drawn}")
    return SOLVED if len(written) == len(makers) else SOME_UNSOLVED


def _save(figure: Callable[[], Figure], path: Path) -> int:
    """Write a figure and say where; return the exit status."""
    written = draw({path: figure})
    for drawn in written:
        say(f"drawn in {drawn}")
    return SOLVED if written else SOME_UNSOLVED
