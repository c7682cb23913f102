"""Units as laboratories spell them, and the unit that a column's name carries."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from softnlp.base.errors import nearest


class Unit(NamedTuple):
    """kind : what it measures. scale : of it in SI. name : as it is spelt here."""

    kind: str
    scale: float
    name: str


_LBF = 4.4482216152605
_PSI = _LBF / 0.0254**2
_SCALES: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254},
    "area": {"m2": 1.0, "mm2": 1e-6, "cm2": 1e-4, "in2": 0.0254**2},
    "force": {
        **{"N": 1.0, "kN": 1e3, "mN": 1e-3, "cN": 1e-2, "daN": 10.0, "kgf": 9.80665, "gf": 9.80665e-3},
        **{"lbf": _LBF, "ozf": _LBF / 16},
    },
    "pressure": {
        **{"Pa": 1.0, "hPa": 100.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5, "mbar": 100.0, "psi": _PSI},
        **{"atm": 101325.0, "mmHg": 133.322387415, "inHg": 3386.388640341, "cmH2O": 98.0665, "mmH2O": 9.80665},
        **{"inH2O": 249.08891, "ksi": 1e3 * _PSI, "kgf/cm2": 98066.5, "kgf/mm2": 9806650.0, "kN/m2": 1e3},
        **{"N/cm2": 1e4},
    },
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "day": 86400.0},
    "ratio": {"1": 1.0, "%": 0.01, "um/m": 1e-6},
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
    **{"n/mm2": "MPa", "n/m2": "Pa", "torr": "mmHg", "kp": "kgf", "kp/cm2": "kgf/cm2", "kp/mm2": "kgf/mm2"},
    **{"kgf.cm-2": "kgf/cm2", "lbf/in2": "psi", "lb/in2": "psi", "µm/m": "um/m", "με": "um/m", "µε": "um/m"},
    **{"microstrain": "um/m", "sqmm": "mm2", "sq.mm": "mm2", "meters": "m", "metres": "m"},
    **{"millimeters": "mm", "millimetres": "mm", "centimeters": "cm", "centimetres": "cm", "inches": "in"},
    **{"sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "milliseconds": "ms", "µs": "us"},
    **{"minutes": "min", "hours": "h", "percent": "%", "pct": "%", "mm/mm": "1", "m/m": "1", "-": "1", "in/in": "1"},
    **{"n*m": "Nm", "n.m": "Nm", "n-m": "Nm", "n·m": "Nm", "n*mm": "Nmm", "n.mm": "Nmm", "n-mm": "Nmm", "n·mm": "Nmm"},
    **{"°": "deg", "degree": "deg", "degrees": "deg", "°c": "C", "degc": "C", "volt": "V", "count": "counts"},
    **{"kilopascal": "kPa", "megapascal": "MPa", "pascal": "Pa", "psig": "psi", "barg": "bar", "millibar": "mbar"},
    **{"psia": "psi", "bara": "bar", "cycle": "cycles"},
}
_FOLDED = {name.lower(): name for name in reversed(list(UNITS))}
_FOLDED_TWICE = {"mpa", "mn", "nm"}  # where capitals tell units apart: MPa is not mPa
_BRACKETED = re.compile(r"^(.*?)\s*[(\[{<]\s*([^()\[\]{}<>]*?)\s*[)\]}>]\s*(.*)$")
_NO_SUFFIX = ("1", "-", "A", "C", "K", "h", "in", "min", "count", "counts", "cycle", "cycles", '"')  # a name ends so
_QUALIFIED = re.compile(r"\b(abs|absolute|gauge|rel|relative|g|a)\b\.?|\b(in)\b", re.IGNORECASE)
_WITHIN = re.compile(r"\((g|a|abs|gauge|rel)\.?\)", re.IGNORECASE)  # bar(g)
_SUFFIX = re.compile(r"^(.*?)[ _]([^ _]+)$")
_RATIO = re.compile(r"strain|stretch|dehnung|ratio", re.IGNORECASE)
_LIKE_A_UNIT = re.compile(r"[a-zA-Z\u00b5\u03bc\u00b0]{1,5}\d?([/*.^\u00b7-][a-zA-Z\d^-]{1,6})*")


def unit_named(text: str) -> Unit | None:
    """Return a unit as people spell it, None where it is none."""
    word = text.strip().strip("()[]{}<>").strip().replace("²", "2").replace("^", "")
    name = word if word in UNITS else _ALIASES.get(word.lower(), "")
    if not name and word.lower() not in _FOLDED_TWICE:
        name = _FOLDED.get(word.lower(), "")
    return UNITS.get(name)


def split_unit(header: str) -> tuple[str, Unit | None]:
    """Return a column's name without its unit, and that; "Force (kN)", "Load [N]", "P_kPa", "ms since midnight"."""
    text = _WITHIN.sub("", header.strip())
    if found := _BRACKETED.match(text):
        for inside in reversed(found[2].split(" since ")[0].split(",")):
            unit = unit_named(inside) or unit_named(_QUALIFIED.sub("", inside))
            if unit is not None and (inside != "1" or _RATIO.search(text)):  # "Pressure (1)" is the first one
                return f"{found[1]} {found[3]}".strip(), unit
    found = _SUFFIX.match(text)
    short = found is not None and found[2].strip("()[]") not in _NO_SUFFIX and len(found[2]) < 6
    if found and short and (unit := unit_named(found[2])) is not None:
        return found[1].strip(" _,/"), unit
    return header.strip(), None


def unknown_unit(header: str) -> str:
    """Return what stands in a column's name where its unit would and is none that is known, "" where nothing does."""
    found = _BRACKETED.match(header.strip())
    if not found or found[3] or not _LIKE_A_UNIT.fullmatch(found[2]):
        return ""
    return "" if unit_named(found[2]) else found[2]


def nearest_unit(word: str, kind: str) -> str:
    """Return the advice of the nearest known unit of a kind, or of all of them."""
    return nearest(word, [name for name, unit in UNITS.items() if unit.kind == kind])
