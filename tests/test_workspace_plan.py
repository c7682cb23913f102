"""From a workspace scenario to its plan: which poses, in what order, and what cannot be asked."""

from __future__ import annotations

import itertools
import pickle
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc
from sweeps import GRID, HEAD, scenario

from softnlp.base.errors import InputError, RobotError
from softnlp.base.units import BAR
from softnlp.batch.plan import CHUNK, Plan, cells
from softnlp.model.laws import Law, formula_law, function_law
from softnlp.model.materials import Material
from softnlp.model.robot import ROBOTS, check
from softnlp.scenario.workspace import MOST_POSES, plan_of
from softnlp.sweep.manufacture import check_many
from softnlp.sweep.task import unit_samples

SEQUENCE = "[pressure]\nsequence_bar = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.3, 0.3, 0.0], [0.1, 0.0, 0.0]]\n"


def planned(tables: str, head: str = HEAD) -> Plan:
    return plan_of(scenario(tables, head))


def bar(plan: Plan) -> list[tuple[float, ...]]:
    return [tuple(row) for row in np.round(plan.pressures() / BAR, 12).tolist()]


# --- which poses ---


def test_a_grid_is_every_combination_of_its_levels() -> None:
    plan = planned("[workspace]\nlevels = 3\nto_bar = 1.2\n")
    assert bar(plan) == list(itertools.product([0, 0.6, 1.2], repeat=3))
    assert plan.poses == scenario("[workspace]\nlevels = 3\nto_bar = 1.2\n").step_count == 27
    assert plan.varied == ("pressure",)


def test_a_grid_may_leave_sets_out_and_start_above_zero() -> None:
    plan = planned("[workspace]\nlevels = 2\nfrom_bar = 0.2\nto_bar = 0.4\nsets = [3, 1]\n")
    assert sorted(bar(plan)) == [(0.2, 0, 0.2), (0.2, 0, 0.4), (0.4, 0, 0.2), (0.4, 0, 0.4)]


@pytest.mark.parametrize("count", [64, 100])
def test_samples_fill_the_box_more_evenly_than_chance(count: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plan = planned(f"[workspace]\nsamples = {count}\nfrom_bar = 0.5\nto_bar = 1.5\n")
    unit = plan.pressures() / BAR - 0.5
    assert unit.shape == (count, 3)
    assert unit.min() >= 0
    assert unit.max() <= 1
    by_chance = [qmc.discrepancy(np.random.default_rng(k).random((count, 3))) for k in range(20)]
    assert qmc.discrepancy(unit) < min(by_chance)


def test_samples_are_those_of_their_seed() -> None:
    one, same, other = (
        planned(f"[workspace]\nsamples = 50\nto_bar = 1.0\n{seed}").pressures() for seed in ("", "seed = 0", "seed = 1")
    )
    np.testing.assert_array_equal(one, same)
    assert not np.isin(other, one).any()


@pytest.mark.parametrize(("count", "dimensions"), [(1, 2), (7, 3), (64, 3), (100, 15)])
def test_samples_of_any_number_and_dimension(count: int, dimensions: int) -> None:
    points = unit_samples(count, dimensions, 3)
    assert points.shape == (count, dimensions)
    assert len(np.unique(points, axis=0)) == count


def test_given_pressures_keep_their_order(tmp_path: Path) -> None:
    plan = planned(SEQUENCE)
    assert bar(plan) == [(0.1, 0, 0), (0, 0.2, 0), (0.3, 0.3, 0), (0.1, 0, 0)]
    assert plan.order.tolist() == [0, 1, 2, 3]
    assert plan.times is None
    ramp = planned("[pressure]\nramp = { sets = [2], to_bar = 1.0, steps = 3 }\n")
    assert bar(ramp) == [(0, 0, 0), (0, 0.5, 0), (0, 1, 0)]


def test_times_of_a_file_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.csv").write_text("t_s,p1_bar,p2_bar,p3_bar\n0,0,0,0\n2.5,0.2,0,0.1\n")
    vary = '[workspace.vary]\n"robot.length_mm" = { values = [50, 60] }\n'
    plan = planned('[pressure]\nfile = "p.csv"\n' + vary)
    assert plan.times is not None
    assert plan.times.tolist() == [0, 2.5, 0, 2.5]
    assert bar(plan) == [(0, 0, 0), (0.2, 0, 0.1)] * 2


def test_what_is_varied_multiplies_a_grid_and_a_sequence() -> None:
    vary = (
        '[workspace.vary]\nrobot.length_mm = { from = 40, to = 60, levels = 3 }\n"tip_load.force_z_N" = '
        "{ values = [0.0, -0.1] }\n"
    )
    for tables, steps in ((GRID, 27), (SEQUENCE, 4)):
        plan = planned(tables + vary)
        assert plan.varied == ("pressure", "robot.length", "tip_force")
        assert plan.poses == 6 * steps == scenario(tables + vary).step_count
        lengths = plan.values[:, plan.columns_of("robot.length")][:, 0]
        forces = plan.values[:, plan.columns_of("tip_force")]
        np.testing.assert_allclose(lengths, np.repeat([0.04, 0.05, 0.06], 2 * steps))
        np.testing.assert_allclose(forces[:, 2], np.tile(np.repeat([0, -0.1], steps), 3))
        assert not forces[:, :2].any()
        assert bar(plan) == bar(planned(tables)) * 6


def test_what_is_varied_is_a_dimension_of_the_samples() -> None:
    vary = (
        "[workspace.vary]\ngravity.size_m_per_s2 = { from = 5, to = 10 }\nstiffening.bending = { from = 2, to = 1 }\n"
    )
    plan = planned("[gravity]\ndirection = [0, 3, 4]\n[workspace]\nsamples = 40\nto_bar = 1.0\n" + vary)
    gravity = plan.values[:, plan.columns_of("gravity")]
    size = np.linalg.norm(gravity, axis=1)
    np.testing.assert_allclose(gravity, size[:, None] * [0, 0.6, 0.8])
    bending = plan.values[:, plan.columns_of("stiffening.bending")][:, 0]
    for values, low, high in ((size, 5, 10), (bending, 1, 2)):
        assert low <= values.min() < low + 0.2 * (high - low)
        assert high - 0.2 * (high - low) < values.max() <= high
    assert abs(np.corrcoef(size, bending)[0, 1]) < 0.3


@pytest.mark.parametrize(
    ("key", "value", "table"),
    [
        ("robot.length_mm", 55.0, "robot = { name = 'D25L60', length_mm = 55.0 }"),
        ("robot.outer_diameter_mm", 26.0, "robot = { name = 'D25L60', outer_diameter_mm = 26.0 }"),
        ("robot.chamber_wall_mm", 0.6, "robot = { name = 'D25L60', chamber_wall_mm = 0.6 }"),
        ("robot.chamber_angle_deg", 45.0, "robot = { name = 'D25L60', chamber_angle_deg = 45.0 }"),
        ("tip_load.force_x_N", 0.2, "tip_load = { force_N = [0.2, 0.0, 0.1] }"),
        ("tip_load.force_z_N", -0.2, "tip_load = { force_N = [0.0, 0.0, -0.2] }"),
        ("tip_load.moment_y_Nmm", 3.0, "tip_load = { force_N = [0.0, 0.0, 0.1], moment_Nmm = [0.0, 3.0, 0.0] }"),
        ("gravity.size_m_per_s2", 9.80665, "gravity = { direction = '-z' }"),
        ("material.C10_MPa", 0.004, None),
        ("material.density_kg_m3", 1000.0, None),
        ("stiffening.elongation", 0.5, "stiffening = { elongation = 0.5 }"),
        ("stiffening.bending", 0.0, "stiffening = { bending = 0.0 }"),
        ("corrections.area", 0.9, "corrections = { area = 0.9 }"),
        ("corrections.inertia", 1.1, "corrections = { inertia = 1.1 }"),
        ("corrections.bore_fraction", 0.3, "corrections = { bore_fraction = 0.3 }"),
    ],
)
def test_a_varied_value_is_what_the_scenario_would_say(key: str, value: float, table: str | None) -> None:
    """Every quantity of every pose, against a scenario that has the value in its own table."""
    base = {
        "study": 'study = "workspace"',
        "robot": "robot = { name = 'D25L60' }",
        "material": "material = { name = 'Ecoflex 00-50', model = 'mooney-rivlin' }",
        "gravity": "gravity = { direction = '-z' }",
        "tip_load": "tip_load = { force_N = [0.0, 0.0, 0.1] }",
    }
    if table is None:
        constants = "C10_MPa = 0.00376, C01_MPa = 0.01558, C20_MPa = 0.001047"
        own = "material = { name = 'own', model = 'mooney-rivlin', density_kg_m3 = 1070.0, constants = { %s } }"
        base["material"] = own % constants
        old = {"material.C10_MPa": "C10_MPa = 0.00376", "material.density_kg_m3": "density_kg_m3 = 1070.0"}[key]
        table = base["material"].replace(old, f"{old.split(' = ')[0]} = {value}")
    vary = f'[workspace.vary]\n"{key}" = {{ values = [{value}] }}\n'
    varied = planned(GRID + vary, "\n".join(base.values()) + "\n")
    said = planned(GRID, "\n".join((base | {table.split(" = ")[0]: table}).values()) + "\n")
    numbers = np.arange(27)
    np.testing.assert_allclose(varied.full_values(numbers), said.full_values(numbers), rtol=1e-15)
    assert varied.fingerprint() != said.fingerprint()


# --- in what order ---


@pytest.mark.parametrize(
    "tables", ["[workspace]\nlevels = 16\nto_bar = 1.2\n", "[workspace]\nsamples = 3000\nto_bar = 1.2\n"]
)
def test_a_chunk_is_a_neighbourhood(tables: str) -> None:
    plan = planned(tables)
    assert sorted(plan.order.tolist()) == list(range(plan.poses))
    assert plan.chunk == CHUNK
    rows, chunk = np.arange(plan.poses), 128  # so that there are many

    def spread(order: np.ndarray) -> float:
        parts = [plan.pressures()[order[k : k + chunk]] for k in range(0, plan.poses, chunk)]
        return float(np.mean([part.var(axis=0).sum() for part in parts]))

    assert spread(cells(plan.values, chunk)) < 0.5 * spread(rows)
    assert plan.chunks == -(-plan.poses // CHUNK)


def test_a_plan_has_a_fingerprint_of_everything() -> None:
    plan = planned(GRID)
    others = [
        planned(GRID.replace("1.2", "1.3")),
        planned(GRID, HEAD.replace("D25L60", "D25L40")),
        planned(GRID, HEAD.replace("mooney-rivlin", "yeoh")),
        planned(GRID + "[solver]\ntolerance = 1e-9\n"),
        planned(GRID + "[corrections]\narea = 1.1\n"),
        planned(GRID + '[gravity]\ndirection = "+z"\n'),
        planned(GRID + "[tip_load]\nforce_N = [0, 0, 1]\n"),
        planned(GRID + "[contact]\n"),
        planned(GRID + "[contact]\noffset_mm = -1.0\n"),
        planned(GRID + '[workspace.vary]\n"robot.length_mm" = { values = [60] }\n'),
        replace(plan, chunk=100),
        replace(plan, times=np.zeros(27)),
    ]
    prints = [p.fingerprint() for p in (plan, *others)]
    assert len(set(prints)) == len(prints)
    assert planned(GRID + "[solver]\n", 'title = "a name changes nothing"\n' + HEAD).fingerprint() == prints[0]


def test_a_fingerprint_is_the_same_in_another_process_and_after_pickling() -> None:
    formula = HEAD.replace(
        'model = "mooney-rivlin"', 'model = "own"\nformula = "a * (stretch - 1 / stretch**2)"\nconstants = { a = 0.03 }'
    )
    plan = planned(GRID, formula)
    assert pickle.loads(pickle.dumps(plan)).fingerprint() == plan.fingerprint()
    code = (
        "import sys; from softnlp.scenario.workspace import plan_of; "
        "from softnlp.scenario.read import scenario_from_text; "
        "print(plan_of(scenario_from_text(sys.stdin.read(), 'x.toml')).fingerprint())"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], input=formula + GRID, capture_output=True, text=True, check=True
    )
    assert told.stdout.strip() == plan.fingerprint()


def test_a_fingerprint_tells_laws_apart_by_their_text_and_constants() -> None:
    """Of a person's function by its operations, numbers in full; of none by what a release of CasADi makes of it."""
    plan = planned(GRID)

    def of(law: Law, c: float = 0.03) -> str:
        return replace(plan, model=replace(plan.model, material=Material("mine", law, {"c": c}))).fingerprint()

    def function(factor: float) -> Law:
        return function_law("mine", lambda s, c: c * (s - s**-2) * factor, ["c"])

    laws = [
        formula_law("mine", "c * (stretch - stretch**-2)", ["c"]),
        formula_law("mine", "c * (stretch - stretch**-3)", ["c"]),
        function(1.5),
        function(1.5 + 1e-15),
    ]
    prints = [of(law) for law in laws]
    assert len({*prints, of(laws[0], 0.04), of(laws[2], 0.04), plan.fingerprint()}) == len(prints) + 3
    assert of(function(1.5)) == of(pickle.loads(pickle.dumps(laws[2]))) == prints[2]
    assert plan.model.material.law.told == ("mooney-rivlin", "C10_MPa", "C01_MPa", "C20_MPa", "_mooney_rivlin")
    assert laws[0].told == ("mine", "c", "c * (stretch - stretch**-2)")


def test_cells_are_whole_chunks() -> None:
    values = np.random.default_rng(0).random((1000, 2))
    order = cells(values, 64)
    widths = [np.ptp(values[order[k : k + 64]], axis=0).max() for k in range(0, 1000, 64)]
    assert max(widths) < 0.5


# --- what can be made ---


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_many_robots_are_judged_as_one(data: st.DataObject) -> None:
    """Against `check` on each of them alone."""
    robot = data.draw(st.sampled_from(list(ROBOTS.values())))
    names = st.sampled_from(["outer_diameter", "lumen_diameter", "chamber_circle_diameter", "chamber_diameter"])
    names |= st.sampled_from(["chamber_wall", "length", "chamber_angle"])
    factors = st.lists(st.sampled_from([-1.0, 0.0, 0.5, 0.8, 0.95, 1.0, 1.05, 1.2, 2.0, 9.0]), min_size=5, max_size=5)
    varied = {
        name: getattr(robot, name) * np.array(data.draw(factors))
        for name in data.draw(st.lists(names, unique=True, min_size=1, max_size=2))
    }
    allow = data.draw(st.lists(st.sampled_from(["wall_thickness", "chamber_overlap"]), unique=True))
    first = None
    for k in range(5):
        one = replace(robot, **{name: float(values[k]) for name, values in varied.items()})
        try:
            check(one, allow=allow)
        except RobotError as error:
            first = error.message
            break
    if first is None:
        check_many(robot, varied, allow=allow, minimum_wall=0.8e-3)
        return
    with pytest.raises(RobotError) as caught:
        check_many(robot, varied, allow=allow, minimum_wall=0.8e-3)
    assert caught.value.message.endswith(first)


def test_a_robot_that_cannot_be_made_is_named_unless_it_is_allowed() -> None:
    vary = '[workspace.vary]\n"robot.outer_diameter_mm" = { from = 25, to = 23, levels = 5 }\n'
    thick = HEAD.replace('name = "D25L60"', 'name = "D25L60"\nminimum_wall_mm = 1.4')
    assert scenario(GRID + vary).step_count == 27 * 5
    with pytest.raises(InputError) as caught:
        scenario(GRID + vary, thick)
    assert str(caught.value).startswith("sweep.toml: [workspace] vary: outer_diameter_mm = 23.5: wall_thickness: ")
    assert scenario(GRID + vary, thick.replace("= 1.4", '= 1.4\nallow = ["wall_thickness"]')).step_count == 27 * 5
    sampled = vary.replace(", levels = 5", "")
    with pytest.raises(InputError, match=r"\[workspace\] vary: outer_diameter_mm = "):
        scenario("[workspace]\nsamples = 40\nto_bar = 1.0\n" + sampled, thick)


# --- what cannot be asked ---

VARY = GRID + "[workspace.vary]\n"


@pytest.mark.parametrize(
    ("tables", "place", "words"),
    [
        ("", "[workspace]", "exactly one of levels, samples or [pressure], got none"),
        ("[workspace]\n", "[workspace]", "got none"),
        (GRID + "samples = 3\n", "[workspace] levels", "got levels and samples"),
        (GRID + SEQUENCE, "[workspace] levels", "got levels and [pressure]"),
        ("[workspace]\nto_bar = 1.0\n" + SEQUENCE, "[workspace] to_bar", "not with [pressure]"),
        ("[workspace]\nsets = [1]\n" + SEQUENCE, "[workspace] sets", "not with [pressure]"),
        ("[workspace]\nlevels = 3\n", "[workspace] to_bar", "missing"),
        ("[workspace]\nlevels = 3\nto_bar = 1.0\nfrom_bar = 2.0\n", "[workspace] to_bar", "at least from_bar = 2"),
        ("[workspace]\nlevels = 3\nto_bar = 120.0\n", "[workspace] to_bar", "at most 100 bar"),
        ("[workspace]\nlevels = 3\nto_bar = -1.0\n", "[workspace] to_bar", "at least 0"),
        ("[workspace]\nlevels = 1\nto_bar = 1.0\n", "[workspace] levels", "at least 2"),
        ("[workspace]\nlevels = 2.5\nto_bar = 1.0\n", "[workspace] levels", "whole number"),
        ("[workspace]\nsamples = 0\nto_bar = 1.0\n", "[workspace] samples", "at least 1"),
        (GRID + "seed = 1\n", "[workspace] seed", "only with samples"),
        (GRID + "sets = [1, 4]\n", "[workspace] sets", "item 2: expected a chamber set from 1 to 3, got 4"),
        (GRID + "sets = [1, 1]\n", "[workspace] sets", "twice"),
        (GRID + "sets = []\n", "[workspace] sets", "at least 1"),
        (GRID + "lvels = 3\n", "[workspace] lvels", "did you mean 'levels'"),
        (GRID + "vary = 3\n", "[workspace] vary", "expected a table"),
        (
            "[workspace]\nlevels = 272\nto_bar = 1.0\n",
            "[workspace] levels",
            f"at most {MOST_POSES} poses, got 20123648",
        ),
        ("[workspace]\nsamples = 20000001\nto_bar = 1.0\n", "[workspace] samples", "got 20000001"),
        (VARY + "robot.lenght_mm = { values = [1] }\n", "vary.robot.lenght_mm", "did you mean 'robot.length_mm'"),
        (VARY + "robot.chamber_sets = { values = [1] }\n", "vary.robot.chamber_sets", "unknown quantity"),
        (VARY + "robot.length_mm = 3\n", "vary.robot.length_mm", "expected a table { from, to, levels }"),
        (VARY + "robot.length_mm = { from = 1, to = 2 }\n", "vary.robot.length_mm.levels", "missing"),
        (VARY + "robot.length_mm = { from = 1, to = 2, levels = 1 }\n", "vary.robot.length_mm.levels", "from 2 to"),
        (VARY + "robot.length_mm = { from = true, to = 2, levels = 2 }\n", "vary.robot.length_mm.from", "got true"),
        (VARY + "robot.length_mm = { values = [] }\n", "vary.robot.length_mm.values", "at least 1 number"),
        (VARY + "robot.length_mm = { values = [1], levels = 2 }\n", "vary.robot.length_mm", "got both"),
        (VARY + "robot.length_mm = { values = [inf] }\n", "vary.robot.length_mm.values", "finite"),
        (
            VARY + "robot.length_mm = { values = [0] }\n",
            "vary.robot.length_mm.values",
            "at least 0.001 and at most 100000 mm, got 0 mm",
        ),
        (VARY + "stiffening.bending = { values = [-1] }\n", "vary.stiffening.bending", "at least 0"),
        (VARY + "corrections.area = { values = [0] }\n", "vary.corrections.area", "at least 0.001"),
        (
            VARY + "corrections.bore_fraction = { values = [1.5] }\n",
            "vary.corrections.bore_fraction",
            "at most 1, got 1.5",
        ),
        (VARY + "material.C10_MPa = { values = [-1] }\n", "[workspace] vary", "tangent modulus at stretch 1"),
        (VARY + "gravity.size_m_per_s2 = { values = [1] }\n", "vary.gravity.size_m_per_s2", "which is off"),
        (
            "[workspace]\nsamples = 3\nto_bar = 1.0\nvary = { robot.length_mm = { values = [1] } }\n",
            "vary.robot.length_mm.values",
            "not with samples",
        ),
        (GRID + '[contact]\nmode = "constrained"\n', "[contact] mode", "expected 'blocked' in a sweep"),
        (GRID + "[contact]\ntarget_force_N = 1.0\n", "[contact] target_force_N", "not in a sweep"),
        (GRID + "[contact]\noffsets_mm = [0.0, 1.0]\n", "[contact] offsets_mm", "not in a sweep"),
        (GRID + "[target]\nx = 1\n", "[target]", "not used by study 'workspace'"),
    ],
)
def test_what_cannot_be_asked_is_one_line(tables: str, place: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        scenario(tables)
    told = str(caught.value)
    assert told.startswith("sweep.toml: [")
    assert place in told
    assert words in told
    assert "\n" not in told


def test_a_wall_goes_into_the_plan() -> None:
    plan = planned(GRID + '[contact]\noffset_mm = -2.0\nclosure = "free"\n')
    assert plan.contact is not None
    assert (plan.contact.offset, plan.contact.closure) == (-0.002, "free")
    assert planned(GRID).contact is None
    assert "blocked_force" in (plan.row_type.names or ())


def test_the_order_does_not_depend_on_how_a_machine_partitions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Equal values may fall on either side of a partition, which differs between processors."""
    values = np.array(list(itertools.product(np.linspace(0, 1, 6), repeat=3)))
    order = cells(values, 20)

    def another(keys: Any, cut: int) -> Any:
        parted = np.argsort(-keys, kind="stable")[::-1]
        return np.concatenate([parted[:cut][::-1], parted[cut:][::-1]])

    monkeypatch.setattr(np, "argpartition", another)
    assert np.array_equal(order, cells(values, 20))
