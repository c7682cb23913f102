"""Every number that comes out is declared once: a new one touches one file, and no other module knows its unit."""

from __future__ import annotations

import ast
import csv
import io
import re
from collections.abc import Iterator
from functools import cache
from math import degrees
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import softnlp
from softnlp import forward, material, robot
from softnlp.app.panels.results import step_lines
from softnlp.base import columns
from softnlp.base.columns import DEG, ONE, OUTPUTS, TABLES, Output, by_key, outputs, written
from softnlp.results import netcdf_bytes, table_lines, table_text, to_json
from softnlp.results.dataset import to_dataset
from softnlp.results.folder import view_of_dataset
from softnlp.statics.step import Pose, Run

PACKAGE = Path(softnlp.__file__).parent
HOME = PACKAGE / "base" / "columns.py"
AZIMUTH = "tip_azimuth"


@pytest.fixture(scope="module")
def run() -> Run:
    return forward(robot("D25L60"), material("Ecoflex 00-50", "mooney-rivlin"), [[0.0, 0.0, 0.0], [0.5e5, 0.0, 0.2e5]])


def azimuth(pose: Pose) -> float:
    """Return the direction in which the tip points, about z [rad]."""
    return float(np.arctan2(pose.tip_rotation[1, 2], pose.tip_rotation[0, 2]))


@pytest.fixture
def with_azimuth(monkeypatch: pytest.MonkeyPatch) -> str:
    """Add an output: a line of the registry, and an attribute of what holds it; return its key."""
    new = Output(AZIMUTH, DEG, "direction in which the tip points, about z", group="pose", short=("azimuth",))
    monkeypatch.setattr(Pose, AZIMUTH, property(azimuth), raising=False)
    monkeypatch.setitem(OUTPUTS, AZIMUTH, new)
    for table in ("forward", "page"):
        monkeypatch.setitem(TABLES, table, (*TABLES[table], AZIMUTH))
    return new.key


def test_a_new_output_is_in_every_file_and_table(run: Run, with_azimuth: str, tmp_path: Path) -> None:
    pose = run.steps[1].pose
    assert pose is not None
    wanted = degrees(azimuth(pose))
    assert abs(wanted) > 1
    assert with_azimuth == "tip_azimuth_deg"
    assert to_json(run)["steps"][1][with_azimuth] == pytest.approx(wanted, rel=1e-12)
    assert float(list(csv.DictReader(io.StringIO(table_text(run))))[1][with_azimuth]) == pytest.approx(wanted)
    (tmp_path / "run.nc").write_bytes(netcdf_bytes(run))
    import xarray

    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        assert float(data[with_azimuth][1]) == pytest.approx(wanted)
        assert data[with_azimuth].attrs["units"] == "degree"
        assert data[with_azimuth].attrs["long_name"] == "direction in which the tip points, about z"
    console = Console(file=io.StringIO(), width=140)
    console.print(table_lines(run))
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    assert "azimuth" in shown
    assert f"{wanted:.2f}" in shown
    line = next(line for line in step_lines(run).numbers if line.key == with_azimuth)
    assert (line.label, line.text, line.unit) == ("Tip azimuth", step_lines_text(to_json(run), with_azimuth), "°")


def step_lines_text(document: dict[str, object], key: str) -> str:
    """Return the number of the first step as the page writes it."""
    steps = document["steps"]
    assert isinstance(steps, list)
    return f"{steps[0][key]:.3f}"


def test_the_output_is_gone_with_its_line(run: Run) -> None:
    assert "tip_azimuth_deg" not in to_json(run)["steps"][1]
    assert by_key("tip_azimuth_deg") is None


def test_a_view_of_a_run_is_that_of_its_dataset(run: Run) -> None:
    from softnlp.results import view_of_run

    here, there = view_of_run(run), view_of_dataset(to_dataset(run))
    for name in ("pressure", "stretch", "bending_angle", "backbone_length"):
        assert getattr(here, name) == pytest.approx(getattr(there, name), rel=1e-12)
    for mine, other in zip(here.bodies, there.bodies, strict=True):
        assert mine is not None
        assert other is not None
        assert mine.position == pytest.approx(other.position, rel=1e-12, abs=1e-15)
        assert vars(mine.radii) == pytest.approx(vars(other.radii), rel=1e-12)


def test_every_output_of_a_step_is_found_where_its_line_says(run: Run) -> None:
    from softnlp.studies.fields import value

    for output in outputs("pose", "solve", "certificate", "section", "shape"):
        found = value(output, run.steps[1])
        assert found is not None
        assert np.ndim(found) == len(output.dims)
        assert value(output, run.steps[1]) is not None


# --- names ------------------------------------------------------------------------------------------------------------


def test_keys_are_unique_and_say_their_unit() -> None:
    keys = [output.key for output in OUTPUTS.values()]
    assert len(set(keys)) == len(keys)
    for output in OUTPUTS.values():
        assert output.unit is ONE or output.key.endswith(f"_{output.unit.suffix}")
        assert by_key(output.key) is output
    assert {name for names in TABLES.values() for name in names} <= set(OUTPUTS)


def test_an_index_goes_before_the_unit() -> None:
    sizes = {"chamber": 2, "set": 2}
    assert OUTPUTS["tip_position"].keys(sizes) == ["tip_position_x_mm", "tip_position_y_mm", "tip_position_z_mm"]
    assert OUTPUTS["chamber_reaction"].keys(sizes) == ["chamber_reaction_1_N", "chamber_reaction_2_N"]
    assert OUTPUTS["pressure"].keys(sizes) == ["p1_bar", "p2_bar"]
    assert OUTPUTS["tip_rotation"].keys(sizes)[5] == "tip_rotation_y_z"
    assert OUTPUTS["tip_rotation"].keys(sizes, "")[5] == "tip_rotation_yz"
    assert OUTPUTS["curvature"].entry((1,)) == "curvature_y_per_m"
    assert OUTPUTS["stretch"].keys(sizes) == ["stretch"]


def test_labels_have_their_unit() -> None:
    angle = OUTPUTS["bending_angle"]
    assert (angle.axis, angle.heading, angle.headings) == ("bending angle [deg]", "bending [deg]", ("bending\n[deg]",))
    assert OUTPUTS["stretch"].headings == ("stretch",)
    assert OUTPUTS["tip_x"].measured == "x_mm"
    assert angle.shown(np.pi) == pytest.approx(180)
    assert OUTPUTS["stable"].shown(True) is True


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [(1.25, ".1f", "1.2"), (-0.001, ".2f", "0.00"), (-0.01, ".2f", "-0.01"), (float("nan"), ".2f", "-")],
)
def test_numbers_are_written_without_a_negative_zero(value: float, form: str, text: str) -> None:
    assert written(value, form) == text
    assert written(None, form, "–") == "–"


# --- homes ------------------------------------------------------------------------------------------------------------


def literals(nodes: list[ast.AST]) -> Iterator[str]:
    """Yield the texts of a module, those in formatted strings as well, without what documents it."""
    told = {
        id(node.body[0].value)
        for node in nodes
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and isinstance(node.body[0], ast.Expr)
    }
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in told:
            yield node.value


@cache
def modules() -> dict[Path, tuple[str, str, set[str]]]:
    """Return the source, the texts and the fields of every module of the package."""
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        source = file.read_text()
        nodes = list(ast.walk(ast.parse(source)))
        fields = {n.target.id for n in nodes if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}
        found[file] = source, "\n".join(literals(nodes)), fields
    return found


# What is given as well as found has a key in the tables of a scenario; `t_s` is a column of pressures there.
GIVEN = {"pressure", "t", "tip_position", "tip_cap", "wall_point", "force", "moment", "position", "wall"}
GIVEN |= {output.name for output in columns.outputs("robot")}
SAID = {OUTPUTS[name].key for name in OUTPUTS if OUTPUTS[name].unit is not ONE and name not in GIVEN}


def homes(key: str) -> set[str]:
    """Return the modules that have the key or a label of an output as text or as a field, or convert it themselves."""
    output = by_key(key)
    assert output is not None
    labels = (output.axis, output.heading, *(heading for heading in output.headings if output.short))
    said = re.compile("|".join([key, *(rf"(?<!\w )(?<!\w){re.escape(label)}" for label in labels)]))
    own_word = output.unit is DEG or output.name == "backbone_length"  # other names are words of drawings too
    converted = re.compile(rf"\b{output.name}\b[^,]*[*/] *(DEGREE|MILLIMETRE)\b" if own_word else "$^")
    return {
        str(file.relative_to(PACKAGE))
        for file, (source, texts, fields) in modules().items()
        if file != HOME and (key in fields or said.search(texts) or converted.search(source))
    }


def test_the_scan_finds_a_home() -> None:
    """The test below would pass without reading anything; these are known."""
    assert "scenario/inverse.py" in homes("tip_position_mm")
    assert "scenario/design.py" in homes("pressure_bar")
    assert len(SAID) > 25


@pytest.mark.parametrize("key", sorted(SAID))
def test_an_output_has_one_home(key: str) -> None:
    assert homes(key) == set()
