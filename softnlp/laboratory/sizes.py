"""The size of a specimen: its cross-section and gauge length, as they are set or as a preamble says them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from softnlp.base.reading import shown
from softnlp.base.units import MILLIMETRE
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.table import RawTable
from softnlp.laboratory.units import UNITS
from softnlp.studies.check import Check

_GRIPS = r"\b(grip|jaw|clamp)|einspannl"
_AREA = r"\barea\b|cross.?section|querschnitt"
_MARKED = r"gauge|l0|messl"  # labels of what is stretched, and of nothing else
_LABELS: Mapping[str, Sequence[str]] = {
    "gauge_length": (r"gauge", r"^(specimen |sample )?length", r"l0|messl"),
    "diameter": (r"^(specimen |sample )?diameter|^(proben)?durchmesser",),
    "width": (r"^(specimen |sample )?width|^(proben)?breite",),
    "thickness": (r"^(specimen |sample )?thickness|^(proben)?dicke",),
}
_SLENDER = 10.0  # widths: a dumbbell's gauge length is 2 to 7 of its narrow width, the whole of it 12 to 20 (ISO 37)


def _size(table: RawTable, key: str, choices: Choices) -> float | None:
    """Return a size of the specimen [mm], from its setting or the preamble."""
    given = choices.number(f"{key}_mm", 0.01, 3000.0)
    if given is not None:
        return given
    found = _written(table, key)
    if found is None:
        return None
    label, size = found
    meant = "" if re.search(_MARKED, label) or key != "gauge_length" else ", if that is what was stretched"
    return float(choices.take(f"{key}_mm", size, f"{shown(label)} of the preamble{meant}"))


def area_of(table: RawTable, choices: Choices) -> tuple[float | None, bool]:
    """Return the specimen's cross-section [m^2], None where nothing says it, and whether it is to be checked."""
    given = choices.number("area_mm2")
    if given is not None:
        return given * MILLIMETRE**2, True
    diameter = _size(table, "diameter", choices)
    if diameter is not None:
        return float(np.pi / 4) * (diameter * MILLIMETRE) ** 2, True
    width = _size(table, "width", choices)
    thickness = _size(table, "thickness", choices)
    if width is None or thickness is None:
        written = _written_area(table)
        if written is None:
            return None, False
        taken = choices.take("area_mm2", written[1], f"{shown(written[0])} of the preamble")
        return float(taken) * MILLIMETRE**2, True
    return width * thickness * MILLIMETRE**2, True


def gauge_length(table: RawTable, choices: Choices, moved: bool) -> float | None:
    """Return the length that is stretched [mm], None where nothing says it; moved : whether a displacement is of it.

    Raises
    ------
    AskError
        Where a preamble has a distance of the grips besides, and either could be what a displacement is of.
    """
    grips, marked = table.value(_GRIPS), _written(table, "gauge_length")
    if moved and choices.get("gauge_length_mm") is None and grips is not None and marked is not None:
        apart = grips[1] * (UNITS["mm"] if grips[2] is None else grips[2]).scale / MILLIMETRE
        if abs(apart - marked[1]) > 0.01 * marked[1]:
            raise AskError(
                f"{table.file}: two lengths could be what was stretched: {shown(grips[0])} is {apart:.6g} mm "
                f"(--set gauge_length_mm={apart:.6g}, for the way of the crosshead), {shown(marked[0])} is "
                f"{marked[1]:.6g} mm (--set gauge_length_mm={marked[1]:.6g}, for an extensometer)"
            )
    return _size(table, "gauge_length", choices)


def _written(table: RawTable, key: str) -> tuple[str, float] | None:
    """Return what a preamble calls a size of the specimen, and the size [mm]."""
    found = table.value(*_LABELS[key])
    if found is None or found[2] is None or found[2].kind != "length" or found[1] <= 0:
        return None
    return found[0], round(found[1] * found[2].scale / MILLIMETRE, 9)


def _written_area(table: RawTable) -> tuple[str, float] | None:
    """Return what a preamble calls the cross-section of the specimen, and it [mm^2], where it has a unit of area."""
    found = table.value(_AREA)
    if found is None or found[2] is None or found[2].kind != "area" or found[1] <= 0:
        return None
    return found[0], round(found[1] * found[2].scale / MILLIMETRE**2, 9)


def size_checks(table: RawTable, area: float | None, choices: Choices) -> list[Check]:
    """Return the checks of sizes that were set against a preamble, and of a gauge length that it only calls a length.

    area : of the specimen [m^2].
    """
    return [*_set_checks(table, area, choices), *_slender_checks(table, area, choices)]


def _set_checks(table: RawTable, area: float | None, choices: Choices) -> list[Check]:
    """Return the checks of sizes that were set beside others of a preamble."""
    written = {key: found[1] for key in _LABELS if (found := _written(table, key)) is not None}
    pairs = [(f"{key}_mm", choices.given.get(f"{key}_mm"), value) for key, value in written.items()]
    if area is not None and "area_mm2" in choices.given:
        if "diameter" in written:
            pairs.append(("area_mm2", area / MILLIMETRE**2, float(np.pi / 4) * written["diameter"] ** 2))
        elif {"width", "thickness"} <= set(written):
            pairs.append(("area_mm2", area / MILLIMETRE**2, written["width"] * written["thickness"]))
        elif (whole := _written_area(table)) is not None:
            pairs.append(("area_mm2", area / MILLIMETRE**2, whole[1]))
    return [
        Check(
            "size that was set over that of the preamble",
            given / value,
            (0.99, 1.01),
            (0, np.inf),
            f"{key} is {given:.6g}, and the file says {value:.6g}; leave the setting out, or know why it differs",
        )
        for key, given, value in pairs
        if given is not None
    ]


def _slender_checks(table: RawTable, area: float | None, choices: Choices) -> list[Check]:
    """Return the check of a gauge length that a preamble only calls a length."""
    length = _written(table, "gauge_length")
    taken = choices.used.get("gauge_length_mm")
    if length is None or length[1] != taken or re.search(_MARKED, length[0]):
        return []
    width = choices.used.get("width_mm") or (None if area is None else np.sqrt(area) / MILLIMETRE)
    if width is None:
        return []
    likely = f"{shown(length[0])} may be that of the whole specimen, heads included; then --set gauge_length_mm=…"
    return [Check("gauge length over the width", taken / width, (0, _SLENDER), (0, np.inf), likely)]
