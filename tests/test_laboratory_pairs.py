"""A tracker's file and a log of pressures: laid together where they belong to each other, else a named check."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laboratory_files import check_of, imported

from softnlp.laboratory.choices import AskError

LEVELS = np.array([*np.eye(3) / 2, *np.eye(3), [0.4, 0.4, 0], [0, 0.4, 0.8], [0.7, 0, 0.2]])
LEVELS = np.vstack([0 * LEVELS[:1], LEVELS[[0, 3, 1, 4, 2, 5, 6, 7, 8]], 0 * LEVELS[:1]])
LAG, SHARED, DAY = (
    "lag between two files",
    "time that two recordings share",
    "time that two recordings share by the day",
)
EXPLAINED = "part of the motion that the pressures explain"
MOVES, STEPS = "share of moves without a change of pressure", "share of changes of pressure without a move"
EQUAL = "distance at equal pressures over the motion"


def tips(pressures: np.ndarray) -> np.ndarray:
    """Return the tips (rows, 3) [mm] of a robot of constant curvature under pressures (rows, 3) [bar]."""
    angles = np.radians([0, 120, 240])
    pull = pressures @ np.column_stack([np.cos(angles), np.sin(angles)])
    bend = 0.9 * np.linalg.norm(pull, axis=1)[:, None] + 1e-9
    side = pull / np.maximum(np.linalg.norm(pull, axis=1), 1e-9)[:, None]
    return 60 * np.column_stack([(1 - np.cos(bend)) / bend * side, np.sin(bend) / bend])


def clock(seconds: float) -> str:
    """Return a time of the day."""
    return f"{int(seconds // 3600) % 24:02d}:{int(seconds // 60) % 60:02d}:{seconds % 60:06.3f}"


def recordings(
    folder: Path, moved: np.ndarray, pressed: np.ndarray, later: float = 0.0, began: tuple[float, float] | None = None
) -> list[str]:
    """Write tips under some pressures (rows, 3) [bar], ten a second, and a log of others; return the two files."""
    found, random = [], np.random.default_rng(3)
    for k, (name, header, rows, scale, first) in enumerate(
        (
            ("tracker.csv", "x_mm,y_mm,z_mm", tips(moved), 0.05, 0.0),
            ("log.csv", "p1 (bar),p2 (bar),p3 (bar)", pressed, 0.002, later),
        )
    ):
        values = rows + random.normal(0, scale, rows.shape)
        times = first + 0.1 * np.arange(len(rows))
        cells = [f"{t:.3f}" if began is None else clock(began[k] + t) for t in times]
        lines = [f"{cell},{','.join(f'{v:.4f}' for v in row)}" for cell, row in zip(cells, values, strict=True)]
        (folder / name).write_text("\n".join([f"Time{' (s)' if began is None else ''},{header}", *lines]) + "\n")
        found.append(str(folder / name))
    return found


HELD = np.repeat(LEVELS, 20, axis=0)


def pressures_of(found: object) -> np.ndarray:
    """Return the pressures (rows, 3) [bar] of an import."""
    return np.column_stack([found.columns[f"p{k}_bar"] for k in (1, 2, 3)])  # type: ignore[attr-defined]


@pytest.mark.parametrize("later", [0.35, 5000.0])
def test_two_recordings_of_one_experiment_pass(later: float, tmp_path: Path) -> None:
    found = imported(*recordings(tmp_path, HELD, HELD, later))
    np.testing.assert_allclose(pressures_of(found), LEVELS, atol=0.005)
    assert [check.name for check in found.checks if check.verdict != "passed"] == [LAG]
    assert found.numbers["lag_s"] == pytest.approx(later, abs=0.1)


def test_a_log_of_half_of_the_experiment_finds_its_half(tmp_path: Path) -> None:
    found = imported(*recordings(tmp_path, HELD, HELD[100:]))
    assert found.numbers["lag_s"] == pytest.approx(-10, abs=0.1)
    np.testing.assert_allclose(pressures_of(found), LEVELS[5:], atol=0.005)


@pytest.mark.parametrize("seed", range(3))
def test_other_levels_in_the_same_rhythm_are_asked_about(seed: int, tmp_path: Path) -> None:
    other = np.repeat(np.random.default_rng(seed).permutation(LEVELS), 20, axis=0)
    with pytest.raises(AskError, match="of what moved, at best"):
        imported(*recordings(tmp_path, HELD, other))


def test_a_wrong_lag_is_named(tmp_path: Path) -> None:
    files = recordings(tmp_path, HELD, HELD)
    found = imported(*files, lag_s=7.3)
    for name in (EXPLAINED, MOVES, STEPS, EQUAL):
        assert check_of(found, name).verdict == "warned", name
    with pytest.raises(AskError, match=f"{SHARED} is 0.*another lag_s"):
        imported(*files, lag_s=500)


def test_another_time_of_the_day_is_named(tmp_path: Path) -> None:
    same = imported(*recordings(tmp_path, HELD, HELD, began=(36000.0, 36000.4)))
    assert check_of(same, DAY).verdict == "passed"
    other = imported(*recordings(tmp_path, HELD, HELD, began=(36000.0, 50000.0)))
    assert check_of(other, DAY).verdict == "warned"


def test_few_plateaus_say_little(tmp_path: Path) -> None:
    few = np.repeat(LEVELS[[0, 2, 4, 6, 0]], 30, axis=0)
    found = imported(*recordings(tmp_path, few, few[:, ::-1]))  # sets in another order fit as well
    assert check_of(found, "plateaus beyond those that any motion goes with").verdict == "warned"


def test_a_log_that_does_not_move_the_tip_asks(tmp_path: Path) -> None:
    one, other = np.zeros((240, 3)), np.zeros((240, 3))
    one[:, 0], other[:, 0] = np.repeat([0, 0.5] * 6, 20), np.repeat([0, 0.9] * 4, 30)
    with pytest.raises(AskError, match="of what moved, at best"):
        imported(*recordings(tmp_path, one, other))
