"""The set "srmd" of `materials.toml`, fitted by `softnlp identify` to the curves of another laboratory.

    python -m benchmarks.material_sets PATH

PATH : the folder with the tensile tests of the *Soft Robotics Materials Database* (repository
LucMarechal/Soft-Robotics-Materials-Database, folder Tensile-Tests-Data, Open Database License 1.0), or one CSV file
with the columns silicone, strain, engineering_stress_MPa. The curves are not part of this project. Engineering stress
against crosshead strain of the first loading, up to a stretch of 2.5; every row counts alike.

Prints the tables as they stand in the file, each law with what its fit says. A law with a constant whose standard error
exceeds its value is not determined by the curve: it is named in a comment, and left out.
"""

from __future__ import annotations

import csv
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from softnlp import load_scenario, run_scenario
from softnlp.studies.tensile import LawFit, TensileFit

SET = "srmd"
SILICONES: Mapping[str, str] = {  # by name in the library, its file in the database
    "Dragon Skin 10": "Dragon Skin 10 MEDIUM.csv",
    "Ecoflex 00-50": "Ecoflex 00-50.csv",
    "Ecoflex 00-30": "Ecoflex 00-30.csv",
    "Ecoflex 00-10": "Ecoflex 00-10.csv",
}
HIGHEST = 2.5  # stretch
SAID: Mapping[str, str] = {
    "source": "fitted by softnlp identify to the curve in the Soft Robotics Materials Database, "
    "github.com/LucMarechal/Soft-Robotics-Materials-Database, ODbL 1.0",
    "test": "uniaxial tension, ASTM D412, first loading, strain of the crosshead",
    "rate": "450 mm/min",
    "date": "not in the database",
}

Curve = list[tuple[float, float]]
"""Rows of strain and engineering stress [MPa]."""


def curves(path: Path) -> dict[str, Curve]:
    """Return the curve of each silicone."""
    if path.is_dir():
        return {name: _database_file(path / file) for name, file in SILICONES.items()}
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {
        name: [(float(r["strain"]), float(r["engineering_stress_MPa"])) for r in rows if r["silicone"] == name]
        for name in SILICONES
    }


def _database_file(path: Path) -> Curve:
    """Return the curve of a file of the database: a preamble, a header, and rows, all separated by semicolons."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = list(csv.reader(file, delimiter=";"))
    header = next(k for k, row in enumerate(rows) if "Engineering Strain" in row)
    columns = [rows[header].index(name) for name in ("Engineering Strain", "Engineering Stress (MPa)")]
    strain, stress = ([float(row[k].replace(",", ".")) for row in rows[header + 1 :] if any(row)] for k in columns)
    return list(zip(strain, stress, strict=True))


def fitted(name: str, curve: Curve) -> TensileFit:
    """Return every built-in law fitted by `softnlp identify` to a curve."""
    with tempfile.TemporaryDirectory() as folder:
        with open(Path(folder, "curve.csv"), "w", newline="") as file:
            csv.writer(file).writerows([("strain", "stress_MPa"), *curve])
        scenario = Path(folder, "scenario.toml")
        scenario.write_text(
            f'study = "identify"\n[robot]\nname = "D25L60"\n'
            f'[tensile]\nname = "{name}"\nfile = "curve.csv"\nstretch = [1.0, {HIGHEST}]\n'
        )
        found = run_scenario(load_scenario(scenario))
    assert isinstance(found, TensileFit)
    return found


def is_determined(fit: LawFit) -> bool:
    """Whether the curve determines every constant of a law."""
    return fit.material is not None and all(fit.determined.values())


def tables(name: str, fit: TensileFit) -> Iterator[str]:
    """Yield the lines of a silicone's set as `materials.toml` has them."""
    place = f'"{name}".sets.{SET}'
    yield f"# {SILICONES[name]}"
    yield f"[{place}]"
    yield f"fitted_stretch = [1.0, {HIGHEST}]"
    yield from (f'{key} = "{words}"' for key, words in SAID.items())
    for law, found in fit.fits.items():
        if not is_determined(found):
            yield f"# not determined by this curve: {law}"
            continue
        yield f"\n# R^2 = {found.r_squared:.4f}, rms error {found.misfit.rmse / 1e3:.2f} kPa"
        yield f"[{place}.{law}]"
        for constant in found.law.constants:
            yield f"{constant.file_key} = {found.constants[constant.name] / constant.scale:.4g}"


def main(path: str) -> None:
    """Print the sets."""
    for name, curve in curves(Path(path)).items():
        print("\n".join(tables(name, fitted(name, curve))), end="\n\n")


if __name__ == "__main__":
    main(sys.argv[1])
