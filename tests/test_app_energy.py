"""The energy section on the page: its one coefficient, its one closure, and files that stay what they are."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_pages import control, drawn, put, use
from nicegui.testing import User

from softnlp.app.conventions import Aside, turn, without_misplaced
from softnlp.app.panels.equations import coefficients_panel
from softnlp.app.session import Session, Stage
from softnlp.app.tabs.blocked import blocked_tab, closure_of, closures_of
from softnlp.app.tabs.identify import free_choices
from softnlp.scenario.energy import misplaced

SCENARIOS = Path(__file__).parents[1] / "scenarios"
FILES = [SCENARIOS / "D25L60_energy.toml", SCENARIOS / "blocked" / "D25L60_energy.toml"]


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.parent.name)
def test_a_file_with_energy_opened_changed_saved_and_opened_again_is_the_same(file: Path) -> None:
    session = Session()
    try:
        session.open_path(file)
        text = session.text()
        assert tomllib.loads(text) == tomllib.loads(file.read_text())
        for study in ("forward", "blocked-force", "workspace", "inverse", "dynamic", "design"):
            session.choose(study)
            assert session.problem is None, study
        session.choose(session.opened_study)
        assert session.text() == text
        session.change("corrections", "modulus_factor", 1.1)
        changed = session.text()
        session.open(changed, session.name)
        assert session.text() == changed
        assert tomllib.loads(changed)["corrections"] == {"conventions": "energy", "modulus_factor": 1.1}
    finally:
        session.close()


EVERYTHING = """
study = "forward"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[stiffening]
set = "calibrated"
bending = 1.5
[corrections]
area = 0.98  # measured
[pressure]
sequence_bar = [[0.3, 0.0, 0.0]]
"""


def test_what_the_conventions_do_not_take_is_put_aside_and_comes_back() -> None:
    session, aside = Session(EVERYTHING), Aside()
    try:
        session.document.replace("contact", {"closure": "weighted", "weight_force_per_N": 2.0})
        session.document.replace("choices", {"robot": {"chamber_diameter_mm": {"from": 3.0, "to": 5.0}}})
        session.document.replace("workspace", {"levels": 3, "to_bar": 1.0, "vary": {"corrections.area": [0.9, 1.0]}})
        first = session.document.own()
        turn(session, "energy", aside)
        assert session.problem is None
        own = session.document.own()
        assert list(misplaced(own)) == []
        assert "stiffening" not in own
        assert own["corrections"] == {"conventions": "energy"}
        assert "contact" not in own
        assert own["choices"]["robot"]["chamber_diameter_mm"] == [3.0, 5.0]
        session.change("corrections", "modulus_factor", 1.2)
        for study in ("blocked-force", "workspace", "forward"):
            session.choose(study)
            assert session.problem is None, study
        turn(session, "as_printed", aside)
        assert session.problem is None
        back = session.document.own()
        assert back["stiffening"] == first["stiffening"]
        assert back["contact"] == first["contact"]
        assert back["corrections"] == {"area": 0.98, "conventions": "as_printed"}
        turn(session, "energy", aside)
        assert session.document.own()["corrections"] == {"conventions": "energy", "modulus_factor": 1.2}
        turn(session, "reproduction", aside)
        assert "conventions" not in session.document.own()["corrections"]
        assert session.problem is None
    finally:
        session.close()


def test_the_free_constants_of_an_identification_turn_too() -> None:
    data = {
        "corrections": {"conventions": "energy"},
        "measurements": {"file": "a.csv", "free": ["k_e", "C10"], "bounds": {"k_e": [0.0, 1.0], "C10": [0.0, 1.0]}},
        "actuation": {"sets": [1], "pressure_bar": {"from": 0.0, "to": 1.0}},
    }
    made, _ = without_misplaced(data)
    assert made["measurements"] == {"file": "a.csv", "free": ["C10"], "bounds": {"C10": [0.0, 1.0]}}
    assert made["actuation"]["pressure_bar"] == 1.0
    assert without_misplaced({**data, "measurements": {"free": ["k_b"]}})[0]["measurements"]["free"] == ["c_m"]
    other, _ = without_misplaced({"measurements": {"free": ["c_m"]}})
    assert other["measurements"]["free"] == ["k_e", "k_b"]
    assert set(free_choices(None, energy=True)) == {"c_m"}
    assert "c_m" not in free_choices(None)


def test_the_wall_has_no_closure_but_none_and_the_panel_one_coefficient() -> None:
    def build(session: Session) -> None:
        session.choose("blocked-force")
        coefficients_panel(session)
        blocked_tab(Stage(session, None))  # type: ignore[arg-type]

    async def person(user: User, session: Session) -> None:
        assert set(control(user, "contact.closure").options) == {"compliant", "free", "rigid", "weighted"}
        put(user, "contact.closure", "rigid")
        put(user, "corrections.conventions", "energy")
        await drawn()
        assert session.problem is None
        assert list(control(user, "contact.closure").options) == ["none"]
        assert control(user, "contact.closure").value == "none"
        assert list(closures_of(session)) == ["none"]
        assert not control(user, "contact.mode").visible
        assert not control(user, "contact.chamber_reaction").visible
        assert control(user, "corrections.modulus_factor").visible
        assert not control(user, "stiffening.set").parent_slot.parent.visible
        assert "contact" not in tomllib.loads(session.text())
        put(user, "contact.offset_mm", -1.0)
        assert session.problem is None
        put(user, "corrections.conventions", "reproduction")
        await drawn()
        assert closure_of(session) == "rigid"
        assert control(user, "contact.closure").value == "rigid"
        assert session.problem is None

    use(build, person)
