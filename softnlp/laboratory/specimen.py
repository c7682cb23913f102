"""One specimen of a testing machine's file: which columns are its stretch and stress, their units, and its size."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.units import MEGAPASCAL, MILLIMETRE
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.sizes import area_of, gauge_length, size_checks
from softnlp.laboratory.table import RawTable, in_si, no_unit, one_column
from softnlp.laboratory.units import UNITS, unit_named
from softnlp.studies.check import Check
from softnlp.studies.plausibility import SHEAR_MODULUS, area_check, divisor_checks

Array = NDArray[np.float64]

DISPLACEMENT = (
    r"extension|extensomet|disp(?![a-z])|displac|crosshead|position|stroke|travel|traverse|elongation|distance|^d$|"
    r"^delta ?l$|standardweg|^weg|verl[aä]ngerung|verformung|d[eé]form|d[eé]placement|desplaz|spostam|verplaats|"
    r"allung|alarg"
)
_FORCE = r"load|force|kraft|^last|^f[yz]?$|fuerza|forza|carga|carico|kracht"
_STRAIN, STRETCH = r"strain|dehnung", r"stretch|lambda"
_STRESS = r"stress|spannung|^sigma|contrainte|esfuerzo|sforzo"
ALONG, ACROSS = rf"{DISPLACEMENT}|{_STRAIN}|{STRETCH}", rf"{_STRESS}|{_FORCE}"
_TRUE = r"true|cauchy|wahre|hencky|(?<![a-z])(?:ln|log(?:arithm\w*)?)(?![a-z])"
_GREEN, _RATE = r"green|lagrang", r"rate|limit|pacing|almansi"
_COMPRESSION = r"compress|druck(spannung|kraft)"
_SAME = 0.02  # relative, of two columns that say the same
_STRESS_UNITS = ("Pa", "kPa", "bar", "psi", "MPa")


@dataclass(frozen=True, eq=False)
class Curve:
    """stretch, stress : (rows,) [1] and engineering [Pa]. area : of the specimen [m^2], where known. checks : of it."""

    stretch: Array
    stress: Array
    area: float | None
    checks: tuple[Check, ...]

    def kept(self, rows: slice | NDArray[np.intp]) -> Curve:
        """Return the curve with some of its rows."""
        return replace(self, stretch=self.stretch[rows], stress=self.stress[rows])


def specimens(table: RawTable, choices: Choices) -> list[RawTable]:
    """Return the specimens of a file, whose columns stand side by side or whose rows follow each other."""
    parts = [table.block(int(k)) for k in np.unique(table.repeat)]
    count = len(table.names)
    for width in range(2, count // 2 + 1):
        if count % width == 0 and all(table.names[k] == table.names[k % width] for k in range(count)):
            parts = [part.only(range(k, k + width)) for part in parts for k in range(0, count, width)]
            break
    parts = _with_results(parts, choices)
    if len(parts) == 1:
        return parts
    asked = choices.take("specimen", "all", f"{len(parts)} specimens; they count as repeats of one test")
    if asked == "all":
        return parts
    if isinstance(asked, bool) or not isinstance(asked, int) or not 1 <= asked <= len(parts):
        raise InputError(f"expected 'all' or 1 to {len(parts)}, got {shown(asked)}", key="specimen")
    return [parts[asked - 1]]


def _with_results(parts: list[RawTable], choices: Choices) -> list[RawTable]:
    """Return specimens with the sizes of their own rows of a table of results, none where nothing tells the row.

    One specimen takes the row that the setting `specimen` says.
    """
    table = parts[0]
    units = {label: unit for label, (_, unit) in table.values.items() if unit is not None and unit.kind == "length"}
    several = {label: v for label, v in table.results.items() if label in units and len(set(v)) > 1}
    if not several:
        return parts
    count = max(map(len, several.values()))
    rows: list[int | None] = list(range(count)) if len(parts) == count else [None] * len(parts)
    asked = choices.get("specimen") if len(parts) == 1 else None
    if asked is not None:
        if isinstance(asked, bool) or not isinstance(asked, int) or not 1 <= asked <= count:
            raise InputError(f"expected a row of the results, 1 to {count}, got {shown(asked)}", key="specimen")
        rows = [asked - 1]
    made = []
    for part, row in zip(parts, rows, strict=True):
        values = {label: value for label, value in part.values.items() if label not in several}
        if row is not None:
            values |= {label: (v[row], part.values[label][1]) for label, v in several.items() if row < len(v)}
        made.append(replace(part, values=values))
    return made


def curve_of(table: RawTable, choices: Choices) -> Curve:
    """Return the whole curve of one specimen.

    Raises
    ------
    AskError
        Naming everything that is missing at once.
    """
    missing: list[str] = []
    area, sized = area_of(table, choices)
    stretch, told = _stretch(table, choices, missing)
    stress, more = _stress(table, choices, stretch, area, missing)
    if missing or stretch is None or stress is None:
        rows = any(label not in table.values for label in table.results)
        hint = "; its table of results has several rows: --set specimen=… takes one" if rows else ""
        raise AskError(f"{table.file}: {'; and '.join(missing)}{hint}")
    known = np.isfinite(stretch) & np.isfinite(stress)
    choices.drop(int(np.sum(~known)), "rows with a missing cell")
    if area is not None and sized:
        more = [area_check(area / MILLIMETRE**2), *more]
    return Curve(stretch[known], stress[known], area, (*told, *more, *size_checks(table, area, choices)))


def _stretch(table: RawTable, choices: Choices, missing: list[str]) -> tuple[Array | None, list[Check]]:
    """Return the stretch, and the check of the crosshead against a strain where the file has both."""
    moved = table.named(DISPLACEMENT, f"{_STRAIN}|{_RATE}")
    strains = table.named(_STRAIN, f"{_TRUE}|{_GREEN}|{_RATE}")
    # an elongation in percent is a strain, and a strain in mm an elongation
    ratios = [k for k in moved if _kind(table, k, choices, "displacement") == "ratio"]
    lengths = [k for k in strains if _kind(table, k, choices, "strain") == "length"]
    strains = [k for k in strains if k not in lengths] + ratios
    moved = [k for k in moved if k not in ratios] + lengths
    columns = {
        "stretch": one_column(table, "stretch", table.named(STRETCH), choices),
        "strain": one_column(table, "strain", strains, choices),
        "displacement": one_column(table, "displacement", moved, choices),
        "true strain": one_column(table, "true strain", table.named(rf"(?=.*({_TRUE})).*({_STRAIN})", _RATE), choices),
        "Green strain": one_column(table, "Green strain", table.named(rf"({_GREEN}).*({_STRAIN})", _RATE), choices),
    }
    known = [name for name, k in columns.items() if k is not None]
    if not known:
        raise InputError(
            f"{table.file}: expected a column of stretch, strain or extension; it has {', '.join(table.names)}"
        )
    chosen = choices.one_of("extension", list(columns), known[0])
    if columns[chosen] is None:
        raise InputError(f"{table.file} has no column of this; it has {', '.join(known)}", key="extension")
    if len(known) > 1 and "extension" not in choices.used and chosen in ("stretch", "strain"):
        others = " and ".join(known[1:])
        choices.take("extension", chosen, f"measured at the specimen, or made from it; the file has {others} too")
    k = columns[chosen]
    assert k is not None
    _require_tension(table, k)
    gauge = gauge_length(table, choices, chosen == "displacement")
    crosshead = None
    if columns["displacement"] is not None and (gauge is not None or chosen == "displacement"):
        way = in_si(table, columns["displacement"], "length", choices, "displacement")
        if way is None and chosen == "displacement":
            missing.append(f"{no_unit(table, k, 'length')}: --set unit.displacement=mm, or another length")
        elif gauge is None:
            missing.append(
                f"column {shown(table.names[k])} needs the length that was stretched: --set gauge_length_mm=…"
            )
        elif way is not None:
            crosshead = 1 + way / (gauge * MILLIMETRE)
    if chosen == "displacement":
        return crosshead, []
    if chosen == "stretch":
        known_unit = in_si(table, k, "ratio", choices, "stretch")
        return (table.columns[k] if known_unit is None else known_unit), []
    strain = _strain(table, k, chosen, columns, choices, crosshead, missing)
    if strain is None:
        return None, []
    if chosen == "Green strain":
        choices.take("extension", chosen, "(stretch^2 - 1) / 2, by its name")
    stretch = _stretch_of(strain, chosen)
    return stretch, [] if crosshead is None else _crosshead_check(crosshead, stretch)


def _kind(table: RawTable, k: int, choices: Choices, role: str) -> str:
    """Return what a column measures, by its unit or the one that a person gives it, "" where neither tells."""
    asked = choices.given.get(f"unit.{table.names[k]}", choices.given.get(f"unit.{role}"))
    unit = table.units[k] if asked is None else unit_named(str(asked))
    return "" if unit is None else unit.kind


def _require_tension(table: RawTable, k: int) -> None:
    """Raise `InputError` for a column of a compression test, whose signs and stretches are others."""
    if re.search(_COMPRESSION, table.names[k], re.IGNORECASE):
        raise InputError(
            f"{table.file}: column {shown(table.names[k])} is of compression; a test in tension is expected"
        )


def _stretch_of(strain: Array, measure: str) -> Array:
    """Return the stretch of a strain, by its measure."""
    if measure == "true strain":
        return np.exp(strain)
    if measure == "Green strain":
        return np.sqrt(np.maximum(1 + 2 * strain, 0.0))
    return 1 + strain


def _crosshead_check(crosshead: Array, stretch: Array) -> list[Check]:
    known = np.isfinite(crosshead) & np.isfinite(stretch) & (stretch > 1.05)
    if not np.any(known):
        return []
    ratio = float(np.median((crosshead[known] - 1) / (stretch[known] - 1)))
    likely = (
        "the crosshead moves more or less than the specimen: grips slip, or gauge_length_mm is not that of the strain"
    )
    return [Check("crosshead strain over the strain taken", ratio, (0.95, 1.05), (0.1, 10.0), likely)]


def _strain(
    table: RawTable,
    k: int,
    chosen: str,
    columns: dict[str, int | None],
    choices: Choices,
    crosshead: Array | None,
    missing: list[str],
) -> Array | None:
    """Return a strain [1]; without a unit another column has to tell whether it is in percent."""
    strain = in_si(table, k, "ratio", choices, "strain")
    if strain is not None:
        return strain
    plain: Array = table.columns[k]
    largest = float(np.nanmax(np.abs(plain)))
    true = columns["true strain"]
    if chosen == "strain" and true is not None and table.units[true] is None:
        for unit in ("1", "%"):
            scale = UNITS[unit].scale
            difference = np.log1p(np.maximum(plain * scale, -0.9)) - table.columns[true] * scale
            if np.nanmax(np.abs(difference)) < _SAME * largest * scale:
                choices.take("unit.strain", unit, "ln(1 + strain) is then the column of true strain")
                return plain * scale
    if crosshead is not None:
        for unit in ("1", "%"):
            ratio = float(np.nanmedian((crosshead - 1)[1:] / np.where(plain[1:] == 0, np.nan, plain[1:])))
            if 0.5 < ratio / UNITS[unit].scale < 2:
                choices.take("unit.strain", unit, "it then agrees with the displacement over the gauge length")
                return plain * UNITS[unit].scale
    if largest > 12 and "strain" in table.names[k].lower():  # Dehnung may be in mm
        choices.take("unit.strain", "%", f"it goes to {largest:.4g}, and no silicone to that stretch")
        return plain * UNITS["%"].scale
    plain_one, percent = (float(_stretch_of(np.array(largest * scale), chosen)) for scale in (1.0, 0.01))
    missing.append(
        f"{no_unit(table, k, 'ratio')}; it goes to {largest:.4g}: a stretch of {plain_one:.4g} "
        f"(--set unit.strain=1) or of {percent:.4g} (--set unit.strain=%)"
    )
    return None


def _stress(
    table: RawTable, choices: Choices, stretch: Array | None, area: float | None, missing: list[str]
) -> tuple[Array | None, list[Check]]:
    """Return the engineering stress [Pa], and the checks of what the machine divided by."""
    columns = {
        "engineering stress": one_column(table, "stress", table.named(_STRESS, f"{_TRUE}|{_RATE}"), choices),
        "force": one_column(table, "force", table.named(_FORCE, f"{_RATE}|cell|peak"), choices),
        "true stress": one_column(table, "true stress", table.named(rf"(?=.*({_TRUE})).*({_STRESS})"), choices),
    }
    known = [name for name, k in columns.items() if k is not None]
    if not known:
        raise InputError(f"{table.file}: expected a column of stress or force; it has {', '.join(table.names)}")
    words = {"engineering": "engineering stress", "true": "true stress"}
    asked = choices.get("stress")
    chosen = words.get(str(asked), str(asked)) if asked is not None else known[0]
    if columns.get("engineering stress") is not None and chosen == "true stress" and columns["true stress"] is None:
        columns["true stress"] = columns["engineering stress"]  # a person says so of a column that does not
    k = columns.get(chosen)
    if k is None:
        raise InputError(f"expected {' or '.join(map(repr, known))}, got {shown(asked)}", key="stress")
    _require_tension(table, k)
    force = columns["force"] if columns["force"] is not None and columns["force"] != k else None
    pull = None if force is None else in_si(table, force, "force", choices, "force")
    if chosen == "force":
        pull = in_si(table, k, "force", choices, "force")
        if pull is None:
            missing.append(f"{no_unit(table, k, 'force')}: --set unit.force=N, or kN, mN, lbf")
        if area is None:
            missing.append("a force needs the specimen's size: --set area_mm2=…, or width_mm and thickness_mm")
        return (None if pull is None or area is None else pull / area), []
    if len(known) > 1 and asked is None:
        choices.take("stress", chosen, f"the file has {' and '.join(known[1:])} too")
    stress = in_si(table, k, "pressure", choices, "stress")
    if stress is None:
        missing.append(_without_unit(no_unit(table, k, "pressure"), table.columns[k], stretch))
        return None, []
    if chosen == "true stress":
        return (None if stretch is None else stress / stretch), []
    return stress, [] if pull is None else list(divisor_checks(pull, stress, area))


def _without_unit(head: str, stress: Array, stretch: Array | None) -> str:
    """Say what a stress without a unit would come to in each."""
    if stretch is None:
        return f"{head}: --set unit.stress=kPa, or MPa, Pa, psi"
    reduced = stretch - stretch**-2.0
    known = np.isfinite(reduced) & np.isfinite(stress)
    modulus = float(reduced[known] @ stress[known] / (reduced[known] @ reduced[known]))
    (low, high), told = SHEAR_MODULUS[1], []
    for unit in _STRESS_UNITS:
        size = modulus * UNITS[unit].scale / MEGAPASCAL
        possible = "" if low <= size <= high else ", which no silicone has"
        told.append(f"in {unit} the shear modulus is {size:.3g} MPa{possible} (--set unit.stress={unit})")
    return f"{head}: {'; '.join(told)}"
