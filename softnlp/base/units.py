"""The units people and files use, in SI. Multiply on the way in, divide on the way out."""

from __future__ import annotations

from math import pi

MILLIMETRE = 1e-3
"""One millimetre in [m]."""
BAR = 1e5
"""One bar in [Pa]."""
KILOPASCAL = 1e3
"""One kilopascal in [Pa]."""
MEGAPASCAL = 1e6
"""One megapascal in [Pa]."""
NEWTON_MILLIMETRE = 1e-3
"""One newton millimetre in [N m]."""
DEGREE = pi / 180
"""One degree in [rad]."""
STANDARD_GRAVITY = 9.80665  # m/s^2


def tidy(value: float, scale: float = 1.0) -> float:
    """Return an input in its file unit without the last-digit noise of the conversion: 0.3, not 0.30000000000000004."""
    return float(f"{float(value) / scale:.14g}")
