"""What people call things reaches every figure, table and progress bar as they wrote it, and stops none of them."""

from __future__ import annotations

import io
import json
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import pytest
from matplotlib.text import Text

from softnlp.cli import main
from softnlp.plots.canvas import OwnFigure

ROBOT = r"D25 $a^{ $b_%#&~ <b>[red]{x} \\"[:-1]
SILICONE = r"_batch $7_{ and $x% \alpha [/bold] <i>&amp; 試"
LAW = r"_my $law^{ [red]{0}\\"[:-1]
TITLE = r"budget $5 and $6_{ 50% #1 & ~ [red]red[/red] \\"[:-1]
OTHER = "two\nlines\t \x1b[31m $x_" + 40 * "x"
ALL = (ROBOT, SILICONE, LAW, TITLE)
Q = json.dumps

HEAD = f"""title = {Q(TITLE, ensure_ascii=False)}
[robot]
name = {Q(ROBOT)}
outer_diameter_mm = 25
lumen_diameter_mm = 9
chamber_circle_diameter_mm = 17
chamber_diameter_mm = 4.5
chamber_wall_mm = 0.5
length_mm = 60
chamber_sets = 3
chambers_per_set = 2
chamber_angle_deg = 50
[material]
file = "own $m_{{.toml"
name = {Q(SILICONE, ensure_ascii=False)}
model = {Q(LAW)}
"""
MATERIALS = f"""[{Q(SILICONE, ensure_ascii=False)}]
fitted_stretch = [1.0, 1.8]
[{Q(SILICONE, ensure_ascii=False)}.neo-hookean]
mu0_MPa = 0.03
[{Q(SILICONE, ensure_ascii=False)}.{Q(LAW)}]
formula = "a*(stretch-stretch**-2)"
constants = {{ a = 0.03 }}
"""
ONE = "[pressure]\nsequence_bar = [[0.5, 0, 0]]\n"
FILES = {
    "own $m_{.toml": MATERIALS,
    "meas $^{.csv": "p1_bar,p2_bar,p3_bar,bending_angle_deg,x_mm,y_mm,z_mm,robot\n"
    f"0.5,0,0,20,-18,0,60,{ROBOT}\n1,0,0,60,-39,0,48,\n",
    "meas2.csv": f'p1_bar,p2_bar,p3_bar,bending_angle_deg,robot\n0.5,0,0,20,"{OTHER}"\n1,0,0,60,"{OTHER}"\n',
    "test $^{.csv": "stretch,stress_MPa\n" + "".join(f"{1 + k / 9},{0.03 * (1 + k / 9 - (1 + k / 9) ** -2)}\n" for k in range(9)),
    "run.toml": 'study = "forward"\n' + HEAD + ONE,
    "blocked.toml": 'study = "blocked-force"\n' + HEAD + ONE + '[contact]\nclosure = "compliant"\n',
    "inverse.toml": 'study = "inverse"\n' + HEAD + "[target]\ntip_position_mm = [[-18, 0, 60]]\n",
    "identify.toml": 'study = "identify"\n' + HEAD.replace("[robot]", f"[robots.{Q(OTHER)}]").replace(f"name = {Q(ROBOT)}\n","") + '[measurements]\nfile = "meas2.csv"\nfree = ["k_e", "a"]\n',
    "tensile.toml": 'study = "identify"\n' + f"title = {Q(TITLE)}\n" + HEAD[HEAD.index("[material]"):]
    + '[tensile]\nfile = "test $^{.csv"\nlaws = ["neo-hookean"]\n',
    "design.toml": 'study = "design"\n' + HEAD
    + f"[choices]\nmaterial.name = [{Q(SILICONE)}]\nmaterial.model = [{Q(LAW)}, 'neo-hookean']\n"
    + "[actuation]\nsets = [1]\npressure_bar = 0.5\n[objective]\nmaximise = \"bending_angle_deg\"\n",
    "sweep $^{.toml": 'study = "workspace"\n' + HEAD + "[workspace]\nlevels = 3\nto_bar = 1.0\n",
}
COMMANDS = [
    ("run", "run.toml", "--out", "run"),
    ("run", "blocked.toml", "--out", "blocked"),
    ("run", "inverse.toml", "--out", "inverse"),
    ("run", "identify.toml", "--out", "identify"),
    ("run", "tensile.toml", "--out", "tensile"),
    ("design", "design.toml", "--out", "design", "--workers", "1"),
    ("sweep", "sweep $^{.toml", "--out", "sweep $^{", "--workers", "1"),
    ("workspace", "sweep $^{", "--against", "meas $^{.csv"),
    ("compare", "run.toml", "meas $^{.csv", "--law", "all", "--out", "compare"),
    ("sensitivity", "run.toml", "--samples", "0", "--out", "sensitivity"),
    ("plot", "section", "run.toml", "--out", "section.svg"),
    ("plot", "material", "--file", "own $m_{.toml", "--law", "all", "--out", "material.pdf"),
    ("plot", "run", "run", "--out", "again.png"),
]


def test_proto(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        Path(name).write_text(text)
    for words in [COMMANDS[3], COMMANDS[5]]:
        t = time.process_time()
        status = main(words)
        out, err = capsys.readouterr()
        with capsys.disabled():
            print(f"\n=== {words} {status} {time.process_time() - t:.2f}\n{err}{out[-600:]}")
