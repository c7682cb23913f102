"""How far the five laws of each silicone agree, at a few stretches."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import markdown
from softnlp import load_materials

STRETCHES = (1.1, 1.3, 1.5, 2.0, 2.5)


def text() -> str:
    """Return the spread of the hyperelastic laws, and how far the linear one is off their mean, in % of that mean."""
    rows = []
    for name, entry in load_materials().items():
        row = [name]
        for stretch in STRETCHES:
            stress = {law: float(m.engineering_stress(stretch)) for law, m in entry.models.items()}
            linear = stress.pop("linear")
            values = np.array(list(stress.values()))
            row.append(f"{100 * np.ptp(values) / values.mean():.0f} / {100 * (linear / values.mean() - 1):+.0f}")
        rows.append(row)
    return markdown(["silicone", *(f"stretch {x}" for x in STRETCHES)], rows)


if __name__ == "__main__":
    print(text())
