"""What the commands of studies share: where results go, steps with a progress bar, and what is written and printed."""

from __future__ import annotations

import json as json_module
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import Parameter

from softnlp.base.errors import InputError, SoftnlpError
from softnlp.cli.console import SOLVED, STOPPED, complain, progress, say, say_rows
from softnlp.cli.figures import draw

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softnlp.scenario.read import Scenario

T = TypeVar("T")

_GUESS = 40  # evaluations of an identification; nobody knows how many there will be

_OUT = "Folder for the results; by default results/NAME, where NAME is that of the scenario file."
_JSON = "Print one JSON document and nothing else; no files are written unless --out is given."
Out = Annotated[Path | None, Parameter(help=_OUT)]
Json = Annotated[bool, Parameter(help=_JSON)]
Legend = Annotated[
    bool, Parameter(help="Print what each column of the tables is, with unit and symbol; solve nothing.")
]
AllErrors = Annotated[bool, Parameter(help="Print every mistake of the scenario on a line of its own.")]


def say_legend(study: str) -> int:
    """Print what each column of a study's tables is; return the exit status."""
    from softnlp.base.columns import LEGENDS, legend

    say_rows(["column", "key", "unit", "symbol", "meaning"], legend(LEGENDS[study]))
    return SOLVED


class AllMistakes(SoftnlpError):
    """Every mistake of a file, in place of the first one that counts the others."""

    def __init__(self, errors: Sequence[InputError]) -> None:
        self.errors = tuple(errors)
        super().__init__("; ".join(map(str, errors)))


class Stopped(Exception):
    """Ends a study between two of its steps."""


def searched(asked: Scenario, run: Callable[[Scenario, Callable[[int, float], None]], T]) -> T:
    """Run an identification with a progress bar, which counts up to a guess of how many evaluations there will be.

    Raises `Stopped` between two of them on Ctrl-C.
    """
    with progress(_GUESS, asked.title) as (advance, stop_asked):

        def tell(evaluations: int, error: float) -> None:
            advance(min(evaluations, _GUESS - 1))
            if stop_asked():
                raise Stopped

        return run(asked, tell)


def scenario_at(path: Path, all_errors: bool) -> Scenario:
    """Read a scenario; all_errors : raise `AllMistakes` where there are several."""
    from softnlp.scenario.read import load_scenario

    try:
        return load_scenario(path)
    except InputError as error:
        if all_errors and error.every:
            raise AllMistakes(error.every) from None
        raise


def scenario_for(path: Path, study: str, refusal: str, all_errors: bool) -> Scenario:
    """Read a scenario for a command that takes one study; refusal : of others, with {} for what it is."""
    asked = scenario_at(path, all_errors)
    if asked.study != study:
        raise InputError(refusal.format(repr(asked.study)), source=str(path), key="study")
    return asked


def results_folder(out: Path | None, json: bool, name: str) -> Path | None:
    """Return where results go, None where none are asked for; refuses a folder that cannot be written."""
    folder = out if out is not None or json else Path("results") / name
    if folder is not None:
        require_writable(folder)
    return folder


def require_writable(folder: Path) -> None:
    """Refuse a folder that cannot be made or written before time is spent on a solve; nothing is made yet."""
    standing = next((p for p in (folder, *folder.parents) if os.path.lexists(p)), Path())
    if not standing.is_dir():
        raise InputError("expected a folder, got a file", source=str(standing))
    for name in folder.parts[len(standing.parts) :]:
        _require_possible(standing, name, folder)
    if not os.access(standing, os.W_OK | os.X_OK):
        raise InputError("this folder cannot be written", source=str(standing))
    try:
        with tempfile.TemporaryFile(dir=standing):  # what permissions do not tell: a kernel's folder, a full disk
            pass
    except OSError as error:
        raise InputError(f"this folder cannot be written: {error.strerror}", source=str(standing)) from None


def require_file(path: Path) -> None:
    """Refuse a file that cannot be written, as `require_writable` does a folder."""
    require_writable(path.parent)
    _require_possible(path.parent, path.name, path)
    if path.is_dir():
        raise InputError("expected a file, got a folder", source=str(path))


def _require_possible(standing: Path, name: str, asked: Path) -> None:
    """Refuse a name that the file system does not take, such as one that is too long."""
    try:
        os.lstat(standing / name)
    except (FileNotFoundError, NotADirectoryError):
        return
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"not a possible file name: {reason}", source=str(asked)) from None


def stepwise(
    asked: Scenario, total: int, run: Callable[[Callable[[int, Any], None]], T], *, to_end: bool = True
) -> tuple[list[Any], T | None]:
    """Run a study with a progress bar; return the steps that are done and the result.

    run : called with what takes each step. to_end : whether the study ends by itself after the last step; else it is
    stopped there. The result is None where it was stopped.
    """
    done: list[Any] = []
    with progress(total, asked.title) as (advance, stop_asked):

        def keep(_: int, step: Any) -> None:
            done.append(step)
            advance(len(done))
            if not to_end if len(done) == total else stop_asked():
                raise Stopped

        try:
            return done, run(keep)
        except Stopped:
            return done, None


def stopped_after(count: int, total: int, steps: str, folder: Path | None) -> int:
    """Say how far a study came that Ctrl-C stopped; return the exit status."""
    kept = "" if folder is None else f"; those are in {folder}"
    complain(f"stopped after {count} of {total} {steps}{kept}")
    return STOPPED


def beside(asked: Scenario) -> dict[str, str]:
    """Return the files that stand beside results: what was asked, and what computed them."""
    from softnlp.model.inputs import versions

    return {"versions.json": json_module.dumps(versions(), indent=2) + "\n", "scenario.toml": asked.text}


def write_results(
    folder: Path, asked: Scenario, texts: Mapping[str, str], figures: Mapping[str, Callable[[], Figure]]
) -> None:
    """Write the numbers, each file whole, after all of them are made, and then the figures by name."""
    from softnlp.results.folder import write_files

    write_files(folder, texts, asked.text)
    draw({folder / f"{name}.png": figure for name, figure in figures.items()}, folder)


def show(
    folder: Path | None,
    json: bool,
    write: Callable[[Path], None],
    document: Callable[[], str],
    table: Callable[[], None],
    gap: str = "",
) -> None:
    """Write results where they are asked for, and print the JSON document or the table; gap : before the last line."""
    try:
        if folder is not None:
            write(folder)
    finally:  # the numbers are shown even where they cannot be written
        if json:
            say(document().rstrip("\n"))
        else:
            table()
    if folder is not None and not json:
        say(f"{gap}results in {folder}")
