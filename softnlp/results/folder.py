"""The folder that a run leaves behind, and what is read back from it."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.base.files import make_folder, write_whole
from softnlp.model.inputs import versions
from softnlp.results.csv_table import table_text
from softnlp.results.dataset import netcdf_bytes
from softnlp.results.document import json_text
from softnlp.results.view import RunView, view_of_dataset, view_of_run
from softnlp.statics.step import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESULTS_FILE = "results.nc"


def save(
    run: Run,
    directory: str | PathLike[str],
    *,
    scenario_text: str | None = None,
    figure: Callable[[RunView], Figure] | None = None,
) -> list[Path]:
    """Write a run to a folder, made where missing; each file whole or not at all.

    Parameters
    ----------
    run
        Of any study that returns one.
    directory
        Gets results.nc, table.csv, results.json and versions.json; files of those names are replaced.
    scenario_text
        What was asked, kept as scenario.toml.
    figure
        Draws the run, `softnlp.figures.run_figure` for instance; kept as figure.png. Drawn last, so that an error of
        drawing leaves the numbers.

    Returns
    -------
    list
        The files written.

    Raises
    ------
    InputError
        When the folder or a file cannot be written.
    """
    folder = make_folder(directory)
    # The numbers are all made before the first file is written, so that an error leaves no half of the new results.
    contents = {
        RESULTS_FILE: netcdf_bytes(run),
        "table.csv": table_text(run).encode(),
        "results.json": json_text(run).encode(),
        "versions.json": (json.dumps(versions(), indent=2) + "\n").encode(),
    }
    if scenario_text is not None:
        contents["scenario.toml"] = scenario_text.encode()
    written = [write_whole(folder / name, content) for name, content in contents.items()]
    if figure is not None:
        png = io.BytesIO()
        figure(view_of_run(run)).savefig(png, format="png")
        written.append(write_whole(folder / "figure.png", png.getvalue()))
    return written


def load_run(path: str | PathLike[str]) -> RunView:
    """Return the view of a run that `save` wrote; `path` is its folder or its results.nc.

    Raises
    ------
    InputError
        When there is no such file or it is not one that `save` wrote.
    """
    import xarray as xr

    file = Path(path)
    if file.is_dir():
        file = file / RESULTS_FILE
    if not file.is_file():
        raise InputError(f"expected a folder with {RESULTS_FILE} or such a file; there is none", source=str(file))
    try:
        return view_of_dataset(xr.load_dataset(file, engine="h5netcdf"))
    except PermissionError as error:
        raise InputError(f"cannot be read: {error.strerror}", source=str(file)) from None
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"expected a {RESULTS_FILE} of a run; this is not one ({error})", source=str(file)) from None
