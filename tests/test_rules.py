"""Rules of manufacture: the same rows for numbers and symbols, and what a search has to keep beside Eq. (1)."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from softnlp.model.robot import DIMENSIONS, ROBOTS, robot, violations
from softnlp.model.rules import RULES, neighbours, rules

DELTA_S = 0.8e-3
MOVED, GIVEN = {"outer_wall": True, "inner_wall": True}, {"outer_wall": False, "inner_wall": False}
SIZES = [d.field for d in DIMENSIONS if d.scale is not None]


@pytest.mark.parametrize("name", ["D25L60", "laparoscope-3", "laparoscope-9"])
def test_rows_of_symbols_are_those_of_numbers(name: str) -> None:
    """Of an angle that is a symbol one pair of each kind of neighbours stands for all."""
    rng, given = np.random.default_rng(3), ROBOTS[name]
    symbols = {field: ca.MX.sym(field) for field in SIZES}
    rows = rules(replace(given, **symbols), DELTA_S, MOVED)
    value = ca.Function("rows", list(symbols.values()), [ca.vertcat(*(row.value for row in rows))])
    for _ in range(20):
        made = replace(given, **{field: getattr(given, field) * rng.uniform(0.8, 1.2) for field in SIZES})
        found = np.asarray(value(*(getattr(made, field) for field in SIZES))).ravel()
        same = rules(made, DELTA_S, MOVED)
        for kind in {row.row for row in rows}:
            symbolic = [v for row, v in zip(rows, found, strict=True) if row.row == kind]
            numbers = sorted({round(row.value, 12) for row in same if row.row == kind})
            assert sorted(symbolic) == pytest.approx(numbers, abs=2e-12)


def test_a_pair_of_chambers_and_one_alone_have_their_neighbours() -> None:
    two = replace(ROBOTS["D25L60"], chamber_sets=2, chambers_per_set=1)
    assert [pair[1:] for pair in neighbours(two)] == [(0, 1)]
    assert neighbours(two)[0][0] == pytest.approx(17e-3)
    free = replace(two, chamber_angle=ca.MX.sym("angle"))
    chord = ca.Function("chord", [free.chamber_angle], [neighbours(free)[0][0]])
    assert float(chord(0.3)) == pytest.approx(17e-3)
    assert neighbours(replace(two, chamber_sets=1)) == neighbours(replace(free, chamber_sets=1)) == []


@pytest.mark.parametrize("name", ROBOTS)
def test_published_robots_keep_every_rule_as_they_are(name: str) -> None:
    assert violations(ROBOTS[name], DELTA_S, GIVEN) == ()


def test_eq_1_alone_protects_neither_side() -> None:
    """D25L60 leaves 1.25 mm beside its threads on both sides; Eq. (1) does not see its circle grow or shrink."""
    for circle, side in ((19.4e-3, "outer wall"), (14.6e-3, "inner wall")):
        off = robot("D25L60", chamber_circle_diameter=circle)
        assert violations(off) == ()
        (broken,) = violations(off, DELTA_S, MOVED)
        assert (broken.rule, broken.lowerable) == ("wall_thickness", True)
        assert broken.message == f"the {side} beside the threads is 0.05 mm, 0.75 mm below minimum_wall_mm = 0.8 mm"
        (broken,) = violations(off, DELTA_S, GIVEN)
        assert broken.message == f"the {side} beside the bores is 0.55 mm, 0.25 mm below minimum_wall_mm = 0.8 mm"
        assert violations(off, 0.05e-3, MOVED) == ()
        assert violations(off, DELTA_S, {"inner_wall" if side == "outer wall" else "outer_wall": True}) == ()


def test_what_is_broken_has_one_entry_for_each_rule_in_their_order() -> None:
    packed = replace(ROBOTS["laparoscope-9"], chamber_diameter=4e-3, lumen_diameter=8e-3)
    assert tuple(v.rule for v in violations(packed, DELTA_S, MOVED)) == RULES
