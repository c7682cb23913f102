"""Every variable of the netCDF files: of a run, of a blocked force and of a sweep."""

from __future__ import annotations

import xarray as xr

from docs.figures._shared import command, markdown

FILES = {
    "results.nc of study forward": (
        "softnlp run scenarios/D25L60_loaded_tip.toml",
        "results/D25L60_loaded_tip/results.nc",
    ),
    "more of study blocked-force": ("softnlp run scenarios/blocked/D25L60_wall.toml", "results/D25L60_wall/results.nc"),
    "more of study inverse": ("softnlp inverse scenarios/inverse/point.toml", "results/point/results.nc"),
    "workspace.nc of a sweep": (
        "softnlp sweep scenarios/workspace/D25L60_sequence.toml --out results/sweep",
        "results/sweep/workspace.nc",
    ),
}


def rows_of(path, without: set[str]) -> list[list[str]]:
    """Return a row for each variable, coordinates first."""
    with xr.open_dataset(path, engine="h5netcdf") as data:
        names = [*map(str, data.coords), *map(str, data.data_vars)]
        rows = [
            [
                f"`{name}`",
                ", ".join(map(str, data[name].dims)) or "-",
                str(data[name].attrs.get("units", data[name].attrs.get("unit", ""))),
                str(data[name].attrs.get("long_name", data[name].attrs.get("description", ""))),
            ]
            for name in names
        ]
    return [row for row in rows if row[0] not in without]


def text() -> str:
    """Return a table for each file."""
    parts, known = [], set()
    for heading, (line, path) in FILES.items():
        done = command(line)
        of_sweep = heading.startswith("workspace")
        rows = rows_of(done.folder / path, set() if of_sweep else known)
        known |= {row[0] for row in rows}
        parts.append(f"### {heading}\n\n" + markdown(["variable", "dimensions", "unit", "meaning"], rows))
    return "\n\n".join(parts)


if __name__ == "__main__":
    print(text())
