"""How a robot is held, in words: in scenarios and from Python, in every result, and as it is drawn."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp import Loads, forward, load_scenario, material, robot
from softnlp.base.errors import InputError
from softnlp.figures.body import Camera, side_camera
from softnlp.figures.run import run_figure
from softnlp.model.gravity import DIRECTIONS, gravity_lines, gravity_named, gravity_words, is_hanging
from softnlp.results import to_dataset, to_json
from softnlp.results.folder import view_of_run
from softnlp.results.table import table_lines

G = 9.80665
STANDING, HANGING = "standing, gravity towards the base (-z)", "hanging, gravity away from the base (+z)"
SCENARIO = """study = "forward"
robot = { name = "D15L40" }
material = { name = "Ecoflex 00-30", model = "mooney-rivlin" }
pressure = { sequence_bar = [[0.4, 0, 0]] }
solver = { intervals = 10, accuracy = 1e-3 }
gravity = { direction = DIRECTION }
"""


def asked(folder: Path, direction: str) -> Any:
    file = folder / "held.toml"
    file.write_text(SCENARIO.replace("DIRECTION", direction))
    return load_scenario(file)


@pytest.mark.parametrize(
    ("direction", "gravity", "words"),
    [
        ('"standing"', (0, 0, -G), STANDING),
        ('"-z"', (0, 0, -G), STANDING),
        ("[0, 0, -2]", (0, 0, -G), STANDING),
        ('"hanging"', (0, 0, G), HANGING),
        ('"+z"', (0, 0, G), HANGING),
        ("[0, 0, 1e-3]", (0, 0, G), HANGING),
        ('"off"', (0, 0, 0), "no gravity"),
        ('"+x"', (G, 0, 0), "lying, gravity sideways (+x)"),
        ("[0, -5, 0]", (0, -G, 0), "lying, gravity sideways (-y)"),
        ("[3, 0, -4]", (0.6 * G, 0, -0.8 * G), "standing, tilted by 36.9 deg, gravity along (0.6, 0, -0.8)"),
        ("[0, 3, 4]", (0, 0.6 * G, 0.8 * G), "hanging, tilted by 36.9 deg, gravity along (0, 0.6, 0.8)"),
        ("[4, 0, 3]", (0.8 * G, 0, 0.6 * G), "lying, tilted by 36.9 deg, gravity along (0.8, 0, 0.6)"),
    ],
)
def test_a_direction_is_the_same_gravity_and_the_same_words(
    direction: str, gravity: tuple[float, ...], words: str, tmp_path: Path
) -> None:
    loads = asked(tmp_path, direction).loads
    assert loads.gravity == pytest.approx(gravity)
    assert gravity_words(loads.gravity) == words
    assert gravity_lines(loads.gravity) == ([] if direction == '"off"' else [words])


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("Hanging", "did you mean 'hanging'?"),
        ("STANDING", "did you mean 'standing'?"),
        ("-Z", "did you mean '-z'?"),
        ("hangs", "did you mean 'hanging'?"),
        ("down", "say how the robot is held: 'standing' (gravity towards the base, -z) or 'hanging' (+z)"),
        ("up", "say how the robot is held"),
    ],
)
def test_another_word_is_refused_with_the_nearest_one_or_with_what_to_say(word: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as found:
        asked(tmp_path, f'"{word}"')
    assert said in str(found.value)
    assert "got" in str(found.value)
    with pytest.raises(InputError) as found:
        Loads(gravity=word)
    assert said in str(found.value)


def test_python_takes_the_words_of_a_scenario() -> None:
    for word in DIRECTIONS:
        assert Loads(gravity=word).gravity == gravity_named(word)
    assert np.linalg.norm(Loads(gravity="hanging").gravity) == pytest.approx(G)
    assert gravity_words((0, 0, 1.62)) == f"{HANGING}, 1.62 m/s^2"


@pytest.fixture(scope="module")
def held() -> dict[str, Any]:
    """Return the same pose standing and hanging."""
    body, silicone = robot("D15L40"), material("Ecoflex 00-30")
    return {word: forward(body, silicone, [[4e4, 0, 0]], loads=Loads(gravity=word)) for word in ("standing", "hanging")}


@pytest.mark.parametrize(("word", "words"), [("standing", STANDING), ("hanging", HANGING)])
def test_every_result_of_a_run_says_how_it_is_held(word: str, words: str, held: dict[str, Any]) -> None:
    run = held[word]
    assert to_json(run)["loads"]["gravity"] == words
    assert json.loads(to_dataset(run).attrs["loads"])["gravity"] == words
    assert words in [str(line) for line in table_lines(run).renderables[1:]]
    figure = run_figure(view_of_run(run))
    assert words in [text.get_text() for text in figure.texts]


@pytest.mark.parametrize("word", ["standing", "hanging"])
def test_a_body_is_drawn_the_way_up_that_it_is_held(word: str, held: dict[str, Any]) -> None:
    """In the picture gravity points down, the tip is above the base or below, and the robot bends to the right."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    run = held[word]
    axes: Any = run_figure(view_of_run(run)).axes[0]
    tip, pull = 1e3 * run.steps[0].pose.tip_position, np.sign(run.loads.gravity[2]) * np.array([0, 0, 10.0])
    points = np.array([np.zeros(3), tip, pull, [0, 0, tip[2]]]).T
    across, up, _ = proj_transform(*points, axes.get_proj())
    assert up[2] < up[0]
    assert (up[1] > up[0]) == (word == "standing")
    assert across[1] > across[3]


def test_the_camera_is_above_in_the_room_and_the_light_at_the_upper_left() -> None:
    for gravity, up in (((0, 0, -G), 1), ((0, 0, G), -1), ((G, 0, 0), 1)):
        camera = side_camera(np.array([-3.0, 4.0]), 0.1, gravity)
        assert camera.hanging == is_hanging(gravity) == (up < 0)
        assert up * camera.eye[2] > 0.2
        assert up * camera.light[2] > 0.5
        assert camera.light @ camera.right < 0
        assert camera.right @ [-0.6, 0.8, 0] == pytest.approx(np.cos(np.radians(20)))
        assert (up * np.cross(camera.eye, camera.right))[2] > 0  # right of the viewer, with that way up
    assert side_camera(np.zeros(2), 0.1, (0, 0, G)) == Camera(-60.0, True)
