"""The command `softnlp`. Exit status: 0 when every step solved, 3 when some did not, 2 for bad input, 130 when stopped."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import cyclopts
    from matplotlib.figure import Figure

    from softnlp.runner import Progress
    from softnlp.scenario import Scenario
    from softnlp.studies.step import Run, Step

SOLVED, BAD_INPUT, SOME_UNSOLVED, STOPPED = 0, 2, 3, 130
_TABLE_WIDTH = 100


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words == ["--version"]:  # without the imports that every other command needs
        from softnlp import __version__

        print(__version__)
        return SOLVED
    from cyclopts import CycloptsError

    from softnlp.errors import SoftnlpError

    try:
        return int(_app()(words, exit_on_error=False, print_error=False) or SOLVED)
    except CycloptsError as error:
        return _refuse(f"{_one_line(str(error))} (softnlp --help lists what there is)")
    except SoftnlpError as error:
        return _refuse(str(error))
    except BrokenPipeError:
        sys.stderr.close()  # the reader of the output has gone, and Python would complain of it at exit
        return SOLVED
    except KeyboardInterrupt:
        return _refuse("stopped; nothing was written", STOPPED)


def _refuse(message: str, status: int = BAD_INPUT) -> int:
    """Say on one line what was wrong."""
    print(f"softnlp: {message}", file=sys.stderr)
    return status


def _one_line(text: str) -> str:
    """Return text on one line, without the frame that a parser may draw around it."""
    return " ".join(text.split())


def _app() -> cyclopts.App:
    """Return the commands."""
    from cyclopts import App

    from softnlp import __version__

    app = App(
        name="softnlp",
        help="Statics of pneumatic soft manipulators: how far they bend and stretch, and where the tip goes under load.",
        version=__version__,
        result_action="return_value",
    )
    app.command(run)
    app.command(robots)
    app.command(materials)
    plot = App(name="plot", help="Draw a cross-section, silicones, or the results of a run.")
    plot.command(plot_section, name="section")
    plot.command(plot_material, name="material")
    plot.command(plot_run, name="run")
    app.command(plot)
    return app


def run(scenario: Path, /, *, out: Path | None = None, json: bool = False) -> int:
    """Solve every step of a scenario file in order, each started from the last.

    Prints a table and writes results.nc, table.csv, results.json, figure.png and a copy of the scenario.

    Parameters
    ----------
    scenario
        TOML file.
    out
        Folder for the results; results/<scenario name> by default.
    json
        Print one JSON document and nothing else; write no files unless --out is given.
    """
    from softnlp.results import json_text, save
    from softnlp.scenario import load_scenario

    asked = load_scenario(scenario)
    folder = out if out is not None or json else Path("results") / scenario.stem
    done, interrupted = _solve(asked)
    if not done.steps:
        raise KeyboardInterrupt
    if json:
        sys.stdout.write(json_text(done))
    else:
        _print_table(done)
    if folder is not None:
        from softnlp.plots import run_figure

        save(done, folder, scenario_text=asked.text, figure=run_figure)
        if not json:
            print(f"results in {folder}")
    sys.stdout.flush()
    if interrupted:
        kept = f"; those are in {folder}" if folder is not None else ""
        return _refuse(f"stopped after {len(done.steps)} of {len(asked.pressures)} steps{kept}", STOPPED)
    return SOME_UNSOLVED if done.failed else SOLVED


def _solve(asked: Scenario) -> tuple[Run, bool]:
    """Run a scenario with a progress bar; when it is stopped, return the steps that were done."""
    from dataclasses import replace

    from softnlp.runner import run_scenario
    from softnlp.studies.step import Run

    steps: list[Step] = []
    with _progress(len(asked.pressures), asked.title) as show:

        def keep(index: int, step: Step) -> None:
            steps.append(step)
            show(index, step)

        try:
            return run_scenario(asked, keep), False
        except KeyboardInterrupt:
            partial = Run(
                asked.study,
                asked.robot,
                asked.material,
                asked.coefficients,
                asked.conventions,
                asked.loads,
                tuple(steps),
                asked.title,
                asked.warnings,
            )
            note = f"stopped by the user after {len(steps)} of {len(asked.pressures)} steps"
            return replace(partial, warnings=(*partial.warnings, note)), True


@contextmanager
def _progress(total: int, title: str) -> Iterator[Progress]:
    """Show a progress bar on standard error when it is a terminal."""
    if not sys.stderr.isatty():
        yield lambda index, step: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        from rich.markup import escape

        task = bar.add_task(escape(title), total=total)
        yield lambda index, step: bar.update(task, completed=index + 1)


def _print_table(done: Run) -> None:
    """Print the table of a run; as wide as it needs where the output is not a terminal."""
    from rich.console import Console
    from rich.text import Text

    from softnlp.results import table_lines

    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=_TABLE_WIDTH + 12 * max(0, done.robot.chamber_sets - 3))
    console.print(Text(f"{done.title}: {done.robot.name}, {done.material.name} ({done.material.law.name})", "bold"))
    console.print(table_lines(done))


def robots() -> None:
    """List the robots of the library with their dimensions."""
    from softnlp.robot import DIMENSIONS, ROBOTS

    rows = []
    for robot in ROBOTS.values():
        values = [getattr(robot, d.field) / (d.scale or 1) for d in DIMENSIONS]
        rows.append([robot.name, *(f"{value:g}" for value in values)])
    _print_rows(["name", *(d.file_key for d in DIMENSIONS)], rows)


def materials(*, file: Path | None = None) -> None:
    """List the silicones with their laws and constants.

    Parameters
    ----------
    file
        A materials file of your own; the shipped one by default.
    """
    from softnlp.materials import load_materials

    rows = []
    for entry in load_materials(file).values():
        for law, material in entry.models.items():
            constants = (
                f"{c.file_key} = {material.constants[c.name] / c.scale:.7g}" for c in material.law.constants
            )
            note = f" (derived: {entry.derived[law]})" if law in entry.derived else ""
            rows.append([entry.name, law, f"{material.density:g}", ", ".join(constants) + note])
    _print_rows(["silicone", "model", "density_kg_m3", "constants"], rows)


def _print_rows(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print aligned columns of plain text, which pipes well; numbers to the right."""
    table = [list(header), *map(list, rows)]
    widths = [max(len(row[k]) for row in table) for k in range(len(header))]
    numeric = [all(_is_number(row[k]) for row in rows) for k in range(len(header))]
    for row in table:
        cells = (c.rjust(w) if n else c.ljust(w) for c, w, n in zip(row, widths, numeric, strict=True))
        print("  ".join(cells).rstrip())


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def plot_section(robot: str, /, *, stretch: float = 1.0, out: Path | None = None) -> None:
    """Draw a cross-section to scale, its sets coloured and the rules that it breaks marked.

    Parameters
    ----------
    robot
        A name of the library, or a scenario file (one whose robot cannot be made is drawn too).
    stretch
        Draw the section at this stretch as well.
    out
        PNG, PDF or SVG file; section-<robot>.png by default.
    """
    from softnlp.plots import section_figure
    from softnlp.robot import robot as library_robot
    from softnlp.robot import violations
    from softnlp.scenario import robot_of_scenario

    if robot.endswith(".toml"):
        made, broken = robot_of_scenario(robot)
    else:
        made = library_robot(robot)
        broken = violations(made)
    _save(section_figure(made, broken, stretch), out or Path(f"section-{made.name.replace(' ', '-')}.png"))


def plot_material(
    *names: str,
    law: tuple[str, ...] = ("mooney-rivlin",),
    file: Path | None = None,
    stretch: float = 2.2,
    out: Path = Path("materials.png"),
) -> None:
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
    from softnlp.materials import load_materials, material
    from softnlp.plots import material_figure

    entries = load_materials(file)
    chosen = []
    for name in names or tuple(entries):
        laws = tuple(entries[name].models) if "all" in law and name in entries else law
        chosen += [material(name, model, file=file) for model in laws]
    _save(material_figure(chosen, (1.0, stretch)), out)


def plot_run(results: Path, /, *, out: Path | None = None) -> None:
    """Draw the results of a run again: shapes, bending angle and elongation.

    Parameters
    ----------
    results
        Folder of a run, or its results.nc.
    out
        PNG, PDF or SVG file; figure.png beside the results by default.
    """
    from softnlp.plots import run_figure
    from softnlp.results import load_run

    folder = results if results.is_dir() else results.parent
    _save(run_figure(load_run(results)), out or folder / "figure.png")


def _save(figure: Figure, path: Path) -> None:
    """Write a figure and say where."""
    from softnlp.plots import save_figure

    print(f"drawn in {save_figure(figure, path)}")


if __name__ == "__main__":
    sys.exit(main())
