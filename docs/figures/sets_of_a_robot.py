"""What both sets of constants of Ecoflex 00-50 make of one robot at 1 bar."""

from __future__ import annotations

from docs.figures._shared import markdown
from docs.figures.material_sets import LAWS
from softnlp import BAR, DEGREE, MILLIMETRE, forward, material, robot

SETS = ("shi-2025", "srmd")
BODY = robot("D25L60")


def bent(law: str, chosen: str, pressed: int) -> tuple[float, float]:
    """Return bending angle [deg] and elongation [mm] with some sets of chambers pressed, by a set of constants."""
    pressures = [BAR] * pressed + [0.0] * (3 - pressed)
    pose = forward(BODY, material("Ecoflex 00-50", law, set=chosen), pressures).steps[0].pose
    assert pose is not None
    return pose.bending_angle / DEGREE, (pose.backbone_length - BODY.length) / MILLIMETRE


def text() -> str:
    """Return the bending angle with one set of chambers and the elongation with three, by both sets of constants."""
    rows = [
        [law, *(f"{bent(law, s, 1)[0]:.1f}" for s in SETS), *(f"{bent(law, s, 3)[1]:.1f}" for s in SETS)]
        for law in LAWS
    ]
    return markdown(["law", *(f"angle, {s}" for s in SETS), *(f"elongation, {s}" for s in SETS)], rows)


if __name__ == "__main__":
    print(text())
