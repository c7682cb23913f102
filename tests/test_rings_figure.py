"""The figure of a section with rings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from softnlp import InputError, material, robot
from softnlp.figures import rings_figure

RUBBER = material("Ecoflex 00-50")


def test_it_shows_both_sections_and_the_energy() -> None:
    figure = rings_figure(robot("laparoscope-3"), RUBBER, 1.3)
    cast, stretched, bar = figure.axes
    assert (cast.get_title(loc="left"), stretched.get_title(loc="left")) == ("as cast", "at stretch 1.3")
    assert bar.get_ylabel() == "energy density [kPa]"
    assert "mean energy 1.05" in " ".join(text.get_text() for text in figure.texts)
    # 6 sectors, each with a ring of thread, a lumen and a surface; the surface is nearer to the axis when stretched
    widest = [max(np.nanmax(x) for line in axes.lines if len(x := line.get_xdata())) for axes in (cast, stretched)]
    assert widest[0] == pytest.approx(5.7, rel=1e-3)
    assert 5.7 * 1.3**-0.5 < widest[1] < 5.6


def test_a_stretch_that_is_not_reached_is_refused() -> None:
    with pytest.raises(InputError, match="no equilibrium was found beyond stretch 2"):
        rings_figure(replace(robot("laparoscope-9"), chamber_diameter=1.85e-3), RUBBER, 4.0)
