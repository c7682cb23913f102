"""Of the moulds of D25L60: see docs/mould.md."""

from __future__ import annotations

import tempfile
from pathlib import Path

from softnlp import robot
from softnlp.mould import moulds
from softnlp.mould.picture import png
from softnlp.mould.scenes import exploded


def figure():
    """Draw it."""
    mould = moulds(robot("D25L60")).segments[0]
    path = Path(tempfile.mkdtemp()) / "figure.png"
    path.write_bytes(png(exploded(mould, 1)))
    return path
