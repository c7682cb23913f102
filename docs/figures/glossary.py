"""Every number that comes out and every key that goes in, with unit and meaning, from the registry and the schema."""

from __future__ import annotations

from docs.figures._shared import markdown
from softnlp.base.columns import ONE, OUTPUTS, SYMBOLS
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.describe import keys_of

OTHERS = (
    ("lambda", "", "axial stretch of a section; 1 without pressure"),
    ("s", "m", "length along the robot's axis, from base to tip"),
    ("theta_n, d_i", "rad, m", "angle of a chamber from +x, and its centre in the section"),
    ("P_i, A_c", "Pa, m^2", "pressure of a chamber, and the area of its deformed bore"),
    ("F_P", "N", "sum of P_i A_c"),
    ("E_t, G", "Pa", "tangent modulus of the true stress, and shear modulus E_t / 3"),
    ("EA, EI, GA, GJ", "N, N m^2", "stiffness against extension, bending, shear and twist"),
    ("k_e, k_b", "", "coefficients of the stiffening in extension and in bending"),
    ("k_a, k_i, phi", "", "corrections of area and of inertia, and how far beyond the bore the pressure acts"),
    ("k_c", "", "coefficient of the chambers' reaction against a wall"),
    ("n, m", "N, N m", "internal force and moment in the world frame"),
    ("v, u", "1, 1/m", "shear and extension, and curvature and twist, in the body frame"),
    ("delta_s", "m", "least wall that can be made"),
    ("h", "m", "where along x a wall holds the tip"),
)
"""Letters of the equations that are neither a key nor a column."""


def text() -> str:
    """Return the tables."""
    letters = [[f"`{name}`", unit, meaning] for name, unit, meaning in OTHERS]
    out = [
        [f"`{o.key}`", SYMBOLS.get(o.name, ""), "" if o.unit is ONE else str(o.unit), o.meaning.replace("|", "\\|")]
        for o in OUTPUTS.values()
    ]
    inside = {
        f"`[{table.name}] {key.name}`": [key.unit, key.default.replace("|", "\\|"), key.meaning.replace("|", "\\|")]
        for schema in SCHEMAS.values()
        for table in keys_of(schema)
        if table.table is not None and not table.named
        for key in keys_of(table.table)
    }
    parts = (
        ("Letters of the equations", ["letter", "unit", "meaning"], letters),
        ("What comes out", ["name in files", "symbol", "unit", "meaning"], out),
        ("What goes in", ["key", "unit", "default", "meaning"], [[name, *rest] for name, rest in inside.items()]),
    )
    return "\n\n".join(f"## {title}\n\n{markdown(header, rows)}" for title, header, rows in parts)


if __name__ == "__main__":
    print(text())
