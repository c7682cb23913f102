"""Units as laboratories spell them, and the unit that a column's name carries."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple


class Unit(NamedTuple):
    """kind : what it measures. scale : of it in SI. name : as it is spelt here."""

    kind: str
    scale: float
    name: str


_PSI = 6894.757293168
_SCALES: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "kgf": 9.80665, "gf": 9.80665e-3, "lbf": 4.4482216152605},
    "pressure": {
        **{"Pa": 1.0, "hPa": 100.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5, "mbar": 100.0, "psi": _PSI},
        **{"atm": 101325.0, "mmHg": 133.322387415},
    },
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "ratio": {"1": 1.0, "%": 0.01},
    "moment": {"Nm": 1.0, "Nmm": 1e-3, "mNm": 1e-3},
    "angle": {"rad": 1.0, "deg": 0.017453292519943295},
    "other": {"V": 1.0, "mV": 1e-3, "A": 1.0, "mA": 1e-3, "C": 1.0, "K": 1.0, "Hz": 1.0, "counts": 1.0, "cycles": 1.0},
}
UNITS: Mapping[str, Unit] = {
    name: Unit(kind, scale, name) for kind, names in _SCALES.items() for name, scale in names.items()
}
_ALIASES: Mapping[str, str] = {
    **{"µm": "um", "μm": "um", "micron": "um", "inch": "in", '"': "in", "millimeter": "mm", "millimetre": "mm"},
    **{"meter": "m", "metre": "m", "newton": "N", "newtons": "N", "kilonewton": "kN", "lb": "lbf", "lbs": "lbf"},
    **{"n/mm2": "MPa", "n/mm^2": "MPa", "n/mm²": "MPa", "n/m2": "Pa", "n/m^2": "Pa", "n/m²": "Pa", "torr": "mmHg"},
    **{"sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "milliseconds": "ms", "µs": "us"},
    **{"minutes": "min", "hours": "h", "percent": "%", "pct": "%", "mm/mm": "1", "m/m": "1", "-": "1", "in/in": "1"},
    **{"n*m": "Nm", "n.m": "Nm", "n-m": "Nm", "n·m": "Nm", "n*mm": "Nmm", "n.mm": "Nmm", "n-mm": "Nmm", "n·mm": "Nmm"},
    **{"°": "deg", "degree": "deg", "degrees": "deg", "°c": "C", "degc": "C", "volt": "V", "count": "counts"},
    **{"kilopascal": "kPa", "megapascal": "MPa", "pascal": "Pa", "psig": "psi", "barg": "bar", "millibar": "mbar"},
    **{"psia": "psi", "bara": "bar", "cycle": "cycles", "mm²": "mm2", "mm^2": "mm2"},
}
_FOLDED = {name.lower(): name for name in reversed(list(UNITS))}
_FOLDED_TWICE = {"mpa", "mn", "nm"}  # where capitals tell units apart: MPa is not mPa
_BRACKETED = re.compile(r"^(.*?)\s*[(\[{<]\s*([^()\[\]{}<>]*?)\s*[)\]}>]\s*(.*)$")
_NO_SUFFIX = (
    "1",
    "-",
    "A",
    "C",
    "K",
    "h",
    "in",
    "min",
    "count",
    "counts",
    "cycle",
    "cycles",
    '"',
)  # words that end a name
_QUALIFIED = re.compile(r"\b(abs|absolute|gauge|rel|relative|g|a)\b\.?|\b(in)\b", re.IGNORECASE)
_SUFFIX = re.compile(r"^(.*?)[ _]([^ _]+)$")


def unit_named(text: str) -> Unit | None:
    """Return a unit as people spell it, None where it is none."""
    word = text.strip().strip("()[]{}<>").strip()
    name = word if word in UNITS else _ALIASES.get(word.lower(), "")
    if not name and word.lower() not in _FOLDED_TWICE:
        name = _FOLDED.get(word.lower(), "")
    return UNITS.get(name)


def split_unit(header: str) -> tuple[str, Unit | None]:
    """Return a column's name without its unit, and that; "Force (kN)", "Load [N]", "P_kPa", "ms since midnight"."""
    text = header.strip()
    if found := _BRACKETED.match(text):
        inside = _QUALIFIED.sub("", found[2].split(" since ")[0].split(",")[-1])
        if (unit := unit_named(inside)) is not None:
            return f"{found[1]} {found[3]}".strip(), unit
    found = _SUFFIX.match(text)
    short = found is not None and found[2] not in _NO_SUFFIX and len(found[2]) < 6
    if found and short and (unit := unit_named(found[2])) is not None:
        return found[1].strip(" _,/"), unit
    return text, None
