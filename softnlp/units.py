"""The units people and files use, in SI. Multiply on the way in, divide on the way out."""

from __future__ import annotations

from math import pi

MILLIMETRE = 1e-3
BAR = 1e5
MEGAPASCAL = 1e6
NEWTON_MILLIMETRE = 1e-3
DEGREE = pi / 180
STANDARD_GRAVITY = 9.80665  # m/s^2
