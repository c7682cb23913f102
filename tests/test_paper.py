"""The pages about the paper: their numbers are those of the public interface, and none is typed in."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # docs/ and benchmarks/ are not installed

import docs.paper
from docs.paper import (
    PAGES,
    bending,
    blocked,
    build,
    cache,
    cases,
    constraint,
    laparoscope,
    pages,
    times,
    weights,
    workspace,
)
from docs.paper.__main__ import main
from docs.paper.published import measured_angles, measured_forces, published
from softnlp import (
    BAR,
    DEGREE,
    ClosureWeights,
    Coefficients,
    ContactSettings,
    Loads,
    blocked_force,
    forward,
    material,
    robot,
)
from softnlp.scenario.read import load_scenario
from softnlp.statics.blocked import BlockedSolver

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "scenarios" / "paper"
MODULES = {name: ROOT / "docs" / "paper" / f"{name}.py" for name in (*PAGES, "__init__", "text", "figures", "weights")}
FEW = ("D25L40", "D25L60")
LAW, TOP = "mooney-rivlin", 1.5


def rows_of(text: str, heading: str) -> dict[str, list[str]]:
    """Return the first table after a heading: its cells by the first of each row."""
    lines = text.split(heading, 1)[1].lstrip().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("|"))
    last = next((k for k, line in enumerate(lines) if k > first and not line.startswith("|")), len(lines))
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[first:last]]
    return {row[0]: row[1:] for row in table}


def pressed(sets: int, bar: float = TOP) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return bar * BAR * (np.arange(3) < sets)


# --- no number is typed in ------------------------------------------------------------------------------------------

ALLOWED = re.compile(
    r"Eqs?\. \(\d+\)|\(S\d+\)|\[1/m\]|\d_260|three_rhythms_260|workspace_260|#[0-9A-F]{6}|utf-8|=\.?\d*$|^\.building-$"
)


def page_strings(file: Path) -> Iterator[str]:
    """Yield the text that a module may put on a page: its strings but docstrings and format specifications."""
    tree = ast.parse(file.read_text())
    skipped = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FormattedValue) and node.format_spec is not None:
            skipped |= {id(part) for part in ast.walk(node.format_spec)}
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            skipped.add(id(node.value))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in skipped:
            yield node.value


@pytest.mark.parametrize("name", MODULES)
def test_no_number_is_typed_in(name: str) -> None:
    texts = list(page_strings(MODULES[name]))
    assert texts
    assert [text for text in texts if re.search(r"\d", ALLOWED.sub("", text))] == []


def test_a_typed_number_would_be_found(tmp_path: Path) -> None:
    (tmp_path / "x.py").write_text('"""Doc 1."""\nx = 3.0\ny = f"{x:.2f} N by Eq. (12), not 1.22 N"\n')
    texts = list(page_strings(tmp_path / "x.py"))
    assert [ALLOWED.sub("", text) for text in texts] == [" N by , not 1.22 N"]


# --- scenarios and data ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.toml")), ids=lambda file: file.stem)
def test_a_scenario_of_the_pages_loads(file: Path) -> None:
    scenario = load_scenario(file)
    assert scenario.study in {"forward", "blocked-force"}
    assert scenario.warnings == ()
    assert len(scenario.pressures) > 1


def test_every_case_has_its_scenario() -> None:
    names = {file.stem for file in FOLDER.glob("*.toml")}
    assert names >= {f"{study}_{name}" for study in ("bending", "blocked") for name in cases.NAMES}
    assert names >= {*laparoscope.names(), *(f"constraint_{run}" for run in constraint.RUNS), workspace.NAME}
    assert len(cases.case(workspace.NAME).pressures) == 260
    for name, known in laparoscope.names().items():
        assert cases.case(name).pressures[-1][0] == pytest.approx(known["pressure_bar"] * BAR)


def test_measurements_are_those_of_the_robots() -> None:
    assert set(measured_forces()) == set(cases.NAMES)
    assert {name for name, _ in measured_angles()} == {name for name in cases.NAMES if name.endswith("L60")}
    assert tomllib.loads((ROOT / "scenarios/files/published.toml").read_text()) == published()


# --- numbers of the pages -------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_the_published_laparoscope_angles_to_a_tenth_of_a_degree() -> None:
    runs = {}
    for name, known in laparoscope.names().items():
        P = known["pressure_bar"] * BAR * np.array([[1, 0, 0]])
        runs[name] = forward(robot("laparoscope-6"), material(known["material"], LAW), P).steps
        angle = laparoscope.bending(runs[name])[-1]
        assert angle == pytest.approx(known["bending_angle_deg"], abs=0.1005)
    table = rows_of(laparoscope._angles(runs), "| silicone")
    for name, known in laparoscope.names().items():
        cells = table[known["material"]]
        assert float(cells[1]) == known["bending_angle_deg"]
        assert float(cells[2]) == pytest.approx(laparoscope.bending(runs[name])[-1], abs=0.0051)


@pytest.fixture(scope="module")
def few_bending(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Build the page of bending for two robots and two laws."""
    folder = tmp_path_factory.mktemp("bending")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bending, "NAMES", ("D25L60", "D20L60"))
        patch.setattr(bending, "LAWS", ("linear", LAW))
        patch.setattr(bending, "fitted", lambda free, start: start)
        return bending.page(folder), folder


@pytest.mark.thorough
def test_bending_angles_are_those_of_the_public_interface(few_bending: tuple[str, Path]) -> None:
    text, folder = few_bending
    one, two = (rows_of(text, f"### Bending angle, {sets} [deg]") for sets in ("one set", "two sets"))
    longer = rows_of(text, "### Elongation, three sets [mm]")
    assert one["robot"] == ["measured", "linear", LAW]
    for name, c, k in (("D25L60", Coefficients(), 0), ("D20L60", cases.BARE, 1)):
        P = np.array([pressed(sets) for sets in (1, 2, 3)])
        poses = [s.pose for s in forward(robot(name), material("Ecoflex 00-50", LAW), P, coefficients=c).steps]
        for sets, (pose, table) in enumerate(zip(poses, (one, two, longer), strict=True), start=1):
            assert pose is not None
            exact = (pose.backbone_length - 0.06) * 1e3 if sets == 3 else pose.bending_angle / DEGREE
            assert float(table[name][2].split(" / ")[k]) == pytest.approx(exact, abs=0.0501)
        assert float(one[name][0]) == pytest.approx(measured_angles()[name, 1], abs=0.051)
    assert all(
        (folder / f"bending_{sets}.png").stat().st_size > 10_000 for sets in ("one_set", "two_sets", "three_sets")
    )


@pytest.mark.thorough
def test_without_stiffening_robots_bend_further(few_bending: tuple[str, Path]) -> None:
    for sets in ("one set", "two sets"):
        for cells in list(rows_of(few_bending[0], f"### Bending angle, {sets} [deg]").values())[2:]:
            for cell in cells[1:]:
                stiff, bare = map(float, cell.split(" / "))
                assert bare > 1.1 * stiff


@pytest.mark.thorough
def test_links_of_a_page_lead_somewhere(few_bending: tuple[str, Path]) -> None:
    text, folder = few_bending
    targets = re.findall(r"\]\(([^)]+)\)", text + dict(pages_index())["index.md"])
    assert len(targets) > 10
    for target in targets:
        name = target.partition("#")[0]
        if name.startswith("http") or name.removesuffix(".md") in PAGES:
            continue
        assert (folder / name).exists() or (ROOT / "docs" / "paper" / name).exists(), target


def pages_index() -> list[tuple[str, str]]:
    return [("index.md", docs.paper._index())]


@pytest.mark.thorough
def test_forces_of_the_tables_are_those_of_the_public_interface(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocked, "NAMES", FEW)
    monkeypatch.setattr(blocked, "HYPERELASTIC", (LAW,))
    closures, press = ("free", "compliant", "weighted"), blocked.Presses()
    found = {(closure, LAW, name): press.push(name, closure, LAW) for closure in closures for name in FEW}
    P = np.array([pressed(1, p) for p in np.linspace(0.3, TOP, 5)])
    given = ClosureWeights(force=10.0, moment=10.0, length=20.0)
    for closure, name in (("free", FEW[1]), ("compliant", FEW[0]), ("weighted", FEW[0])):
        contact = ContactSettings(closure=closure, weights=given)  # type: ignore[arg-type]
        steps = blocked_force(robot(name), material("Ecoflex 00-50", LAW), P, contact).steps
        exact = [step.contact.force for step in steps if step.contact is not None]
        np.testing.assert_allclose(found[closure, LAW, name].force, exact, rtol=1e-4)
        cells = rows_of(blocked._table(found, closure), "| robot")[name]
        assert float(cells[0]) == measured_forces()[name]
        assert float(cells[1]) == pytest.approx(exact[-1], abs=6e-4)
    known = np.array([measured_forces()[name] * np.arange(1, 6) / 5 for name in FEW])
    forces = np.array([found["compliant", LAW, name].force for name in FEW])
    whole, end = (blocked.misfit(blocked._of(found, "compliant", LAW), last) for last in (False, True))
    assert whole.mape == pytest.approx(100 * np.abs(forces / known - 1).mean())
    assert whole.rmse == pytest.approx(np.sqrt(((forces - known) ** 2).mean()))
    assert end.mape == pytest.approx(100 * np.abs(forces / known - 1)[:, -1].mean())
    assert (whole.solved, whole.steps, end.steps) == (10, 10, 2)


def test_steps_without_a_solution_are_left_out_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocked, "NAMES", FEW)
    known = [measured_forces()[name] * np.arange(1, 6) / 5 for name in FEW]
    folds = blocked.Pushed(np.where(np.arange(5) < 3, 1.1 * known[0], np.nan), None, "fold")
    found = blocked.misfit({FEW[0]: folds, FEW[1]: blocked.Pushed(1.1 * known[1], None, "")}, False)
    assert (found.solved, found.steps) == (8, 10)
    assert found.mape == pytest.approx(10)


@pytest.fixture(scope="module")
def rough() -> BlockedSolver:
    """Return a solver of the scenario with the constraint, accurate enough to look for a weight."""
    scenario = cases.case("constraint_weighted")
    return constraint._solver(replace(scenario, numerics=replace(scenario.numerics, accuracy=weights.ROUGH)))


@pytest.mark.thorough
def test_the_weight_found_gives_the_published_force(rough: BlockedSolver) -> None:
    known, scenario = published()["simulated_blocked_force"], cases.case("constraint_weighted")
    length = weights.length_weight_for(rough, scenario.pressures[-1], known["with_constraint_N"])
    ratio = length / 10  # of W_n of the scenario
    contact = ContactSettings(closure="weighted", weights=ClosureWeights(force=1.0, moment=1.0, length=ratio))
    step = blocked_force(scenario.robot, scenario.material, scenario.pressures[1:], contact).steps[-1]
    assert step.contact is not None
    assert step.contact.force == pytest.approx(known["with_constraint_N"], rel=1e-3)
    assert ratio == pytest.approx(2.17, abs=0.01)


@pytest.mark.parametrize(("fold", "reached"), [(np.inf, True), (12.0, True), (9.0, False)])
def test_a_weight_is_found_before_the_fold_or_not_at_all(
    fold: float, reached: bool, rough: BlockedSolver, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force that grows like the real one, 1.0 N at W_L = 10 /m, and ends where its branch folds."""

    def force_at(asked: BlockedSolver, pressure: object) -> float:
        W_L = asked.contact.weights.length
        assert W_L is not None
        return 0.7 + 0.3 * (W_L / 10) ** 2.4 if fold > W_L else float("inf")

    monkeypatch.setattr(weights, "force_at", force_at)
    found = weights.length_weight_for(rough, pressed(1), 1.0)
    assert found == pytest.approx(10, rel=2e-3) if reached else np.isnan(found)
    assert np.isnan(weights.length_weight_for(rough, pressed(1), 0.6))


@pytest.mark.thorough
def test_the_tips_of_the_workspace_are_those_of_the_public_interface() -> None:
    scenario = cases.case(workspace.NAME)
    some = [40, 130, 200]
    tips = workspace.solved_rows(Loads(gravity=(0.0, 0.0, -9.80665)))["tip_position"][some]
    run = forward(scenario.robot, scenario.material, scenario.pressures[some], loads=Loads(gravity=(0, 0, -9.80665)))
    exact = [step.pose.tip_position for step in run.steps if step.pose is not None]
    np.testing.assert_allclose(tips, exact, atol=3e-6 * float(scenario.robot.length))
    arcs = workspace._arcs(cases.Solvers(), cases.model_of(scenario), scenario.pressures[some])
    assert np.linalg.norm(arcs - tips, axis=1).max() > 1e-3


def test_a_method_that_does_not_arrive_has_no_time() -> None:
    found = times.timed({"arrives": lambda: True, "does not": lambda: False}, 1, 2)
    assert found["arrives"] >= 0
    assert np.isnan(found["does not"])


# --- building -------------------------------------------------------------------------------------------------------


@pytest.fixture
def one_page(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Put a page in place of the others; return the folders that it was built in."""
    built: list[Path] = []
    module = ModuleType("docs.paper.small")

    def page(folder: Path) -> str:
        built.append(folder)
        (folder / "small.png").write_bytes(b"picture")
        return f"# Small, built {len(built)} times\n"

    module.page = page  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "docs.paper.small", module)
    monkeypatch.setattr(docs.paper, "PAGES", ("small",))
    return built


def test_a_page_is_built_once_for_the_same_sources(
    tmp_path: Path, one_page: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept, told = tmp_path / "cache", []
    for out in ("a", "b"):
        build(tmp_path / out, ["small"], cache=kept, done=told.append)
        assert (tmp_path / out / "small.md").read_text() == "# Small, built 1 times\n"
        assert (tmp_path / out / "small.png").read_bytes() == b"picture"
        assert (tmp_path / out / "index.md").exists()
    assert len(one_page) == 1
    assert told == [1, 1]
    assert dict(pages(kept))["small.md"] == "# Small, built 1 times\n"
    monkeypatch.setattr(docs.paper, "digest", lambda: "other")
    build(tmp_path / "c", ["small"], cache=kept)
    assert (tmp_path / "c" / "small.md").read_text() == "# Small, built 2 times\n"
    assert [folder.name for folder in kept.iterdir()] == ["small-other"]


def test_a_page_that_fails_leaves_nothing(
    tmp_path: Path, one_page: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def page(folder: Path) -> str:
        raise RuntimeError("no solution")

    monkeypatch.setattr(sys.modules["docs.paper.small"], "page", page)
    with pytest.raises(RuntimeError, match="no solution"):
        build(tmp_path / "a", ["small"], cache=tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_page_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="unknown page 'bendin'; expected one of bending"):
        build(tmp_path, ["bendin"])


def test_the_digest_follows_every_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = cache.digest()
    assert cache.digest() == before
    names = {file.relative_to(ROOT).as_posix() for file in cache.sources()}
    assert {"materials.toml", "softnlp/model/section.py", "docs/paper/text.py", "benchmarks/paper_method.py"} <= names
    assert {"scenarios/files/published.toml", "scenarios/files/measured_forces.csv"} <= names
    (tmp_path / "docs" / "paper").mkdir(parents=True)
    (tmp_path / "materials.toml").write_text("")
    monkeypatch.setattr(cache, "ROOT", tmp_path)
    found = [cache.digest()]
    for text in ("a = 1", "a = 2"):
        (tmp_path / "docs" / "paper" / "x.py").write_text(text)
        found.append(cache.digest())
    assert len(set(found)) == 3


def test_the_command_writes_pages(
    tmp_path: Path, one_page: list[Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("docs.paper.__main__.PAGES", ("small",))
    main(["--out", str(tmp_path / "out"), "--page", "small", "--cache", str(tmp_path / "cache")])
    assert "small.md, index.md in" in capsys.readouterr().out
    assert (tmp_path / "out" / "small.png").exists()
