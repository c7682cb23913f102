"""The free shape beside a blocked pose: where it is found, and where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from softnlp import Coefficients, Loads, Numerics, Status, material, robot
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.quantities import Model
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.free_shape import FreeShapes
from softnlp.statics.wall import Situation


def test_a_free_shape_that_is_not_found_is_not_a_number() -> None:
    """Beyond the last pressure with an equilibrium the stretch has no root and the loaded shape no pose."""
    weak = Model(robot("D25L60"), material("Ecoflex 00-20", "yeoh"), Coefficients(elongation=0.0))
    solver = BlockedSolver(weak, Numerics(intervals=4), ContactSettings())
    shapes = FreeShapes(solver.poses, solver.functions, 4, 0.0)
    hung = Loads(tip_force=(0.01, 0.0, 0.0))
    lengths, point = shapes.tip(Situation(np.array([1e4, 0.0, 0.0]), hung, None))
    pose = solver.poses.solve(np.array([1e4, 0.0, 0.0]), hung)[0].pose
    assert pose is not None
    assert lengths == pytest.approx(pose.chamber_length, rel=1e-6)
    assert point == pytest.approx(pose.tip_position, abs=1e-8)
    beyond = Situation(np.full(3, 9e5), hung, None)
    assert solver.poses.solve(beyond.pressure, hung)[0].status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    lengths, point = shapes.tip(beyond)
    assert np.isnan(lengths).all()
    assert lengths.shape == pose.chamber_length.shape
    assert np.isnan(point).all()
