"""A closure of one's own is taken wherever a built-in one is, and says what is wrong with it."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from softnlp import (
    BAR,
    Closure,
    ContactSettings,
    InputError,
    Loads,
    blocked_force,
    constrained_pose,
    material,
    robot,
    sensitivities,
    to_dataset,
)
from softnlp.model.tip import length_error
from softnlp.results import to_json

D15, ECOFLEX = robot("D15L60"), material("Ecoflex 00-50")
PRESSURES = [[0.4 * BAR, 0, 0], [0.8 * BAR, 0, 0]]
K_C = 1.45


def springs(at: Any) -> list[Any]:
    """Return the law of `compliant`, chamber by chamber, with its constant written out."""
    free = at.given.free_lengths
    return [
        at.given.pressed[i] * K_C * at.chamber_stiffness * (1 - at.lengths[i] / free[i]) for i in range(len(at.centres))
    ]


def common(at: Any) -> Any:
    return at.given.pressed * at.unknowns[-1]


def forces(closure: Any, to: int = 2) -> list[float]:
    run = blocked_force(D15, ECOFLEX, PRESSURES[:to], ContactSettings(closure=closure))
    assert not run.failed, [step.message for step in run.steps]
    return [step.contact.force for step in run.steps if step.contact is not None]


@pytest.mark.thorough
def test_a_closure_written_outside_gives_what_the_built_in_one_does() -> None:
    own = Closure("springs", springs)
    np.testing.assert_allclose(forces(own), forces("compliant"), rtol=1e-9)
    held = constrained_pose(D15, ECOFLEX, PRESSURES[0], Loads(tip_force=(0.02, 0, 0)), own)
    same = constrained_pose(D15, ECOFLEX, PRESSURES[0], Loads(tip_force=(0.02, 0, 0)))
    assert held.contact is not None
    assert same.contact is not None
    np.testing.assert_allclose(held.contact.chamber_reaction, same.contact.chamber_reaction, rtol=1e-7)
    assert np.abs(same.contact.chamber_reaction).max() > 1e-3


def test_a_closure_may_bring_an_unknown_and_its_equation() -> None:
    own = Closure("one reaction", common, length_error)
    assert forces(own, 1) == pytest.approx(forces("rigid", 1), rel=1e-9)
    assert forces(own, 1)[0] > 2 * forces("compliant", 1)[0]


@pytest.mark.slow
def test_a_closure_of_ones_own_has_sensitivities() -> None:
    def slope(closure: Any) -> float:
        found = sensitivities(
            D15,
            ECOFLEX,
            [PRESSURES[1][0], 0, 0],
            outputs=["blocked_force"],
            by=["robot.length"],
            contact=ContactSettings(closure=closure),
        )
        return float(found.matrix[0, 0])

    assert slope(Closure("springs", springs)) == pytest.approx(slope("compliant"), rel=1e-8)


def test_results_name_it() -> None:
    contact = ContactSettings(closure=Closure("springs", springs))
    run = blocked_force(D15, ECOFLEX, PRESSURES, contact)
    assert [step["closure"] for step in to_json(run)["steps"]] == ["springs"] * 2
    assert to_json(run)["contact"]["closure"] == "springs"
    assert to_dataset(run)["closure"].values.tolist() == ["springs"] * 2


@pytest.mark.parametrize(
    ("closure", "words"),
    [
        (Closure("short", lambda at: at.unknowns[0]), "reaction of closure 'short': expected 6 entries, got 1"),
        (
            Closure("long", common, lambda at: ca.vertcat(at.unknowns[-1], 1)),
            "equation of closure 'long': expected 1 entries, got 2",
        ),
        ("springy", "expected one of free, compliant, weighted, rigid, got 'springy'"),
    ],
)
def test_a_closure_that_is_not_right_is_one_line(closure: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        blocked_force(D15, ECOFLEX, PRESSURES[:1], ContactSettings(closure=closure))
