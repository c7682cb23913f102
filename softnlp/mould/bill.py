"""The bill of a mould: what is printed, cast, wound and bought."""

from __future__ import annotations

import csv
from io import StringIO
from math import ceil
from typing import Any

from softnlp.mould.assembly import Moulds, SegmentMould
from softnlp.mould.cap import cap_volume
from softnlp.mould.plates import tie_places
from softnlp.mould.shell import rows
from softnlp.mould.sizes import PULL, Sizes
from softnlp.mould.solids import bounds

_LENGTHS = (6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50, 60, 70, 80, 90, 100)  # of screws that are sold [mm]
_COLUMNS = ("kind", "item", "count", "size", "amount", "unit", "with_waste")


def bill(moulds: Moulds, density: float = 1070.0) -> list[dict[str, Any]]:
    """Return the rows of the bill.

    Each has `kind` ("print", "silicone", "thread", "rod", "screw"), `item`, `count`, `size` in words, and where it has
    one an `amount` with its `unit`, with and without waste. density : of the silicone [kg/m^3].
    """
    waste = 1 + moulds.settings.waste_percent / 100
    found = [
        _row("print", part.name, part.count, _box(part), part.solid.volume() / 1000, "cm3", 1.0)
        for part in moulds.parts
    ]
    for segment in moulds.segments:
        where = segment.prefix
        for name, volume in pours(segment).items():
            mass = volume / 1000 * density / 1000
            found.append(
                _row("silicone", f"{where}{name}", 1, f"{mass * waste:.1f} g to prepare", volume / 1000, "ml", waste)
            )
        n = len(segment.sizes.shape.holes)
        length = segment.sizes.thread_length() / 1000
        size = f"{moulds.settings.thread_diameter_mm:g} mm, pitch {moulds.settings.thread_pitch_mm:g} mm"
        found.append(_row("thread", f"{where}thread", n, size, length, "m", waste))
        found += [_row("rod", f"{where}{name}", count, size) for name, count, size in rods(segment)]
        found += [_row("screw", f"{where}{name}", count, size) for name, count, size in screws(segment.sizes)]
    return found


def pours(segment: SegmentMould) -> dict[str, float]:
    """Return the silicone of each pour [mm^3], with what fills gate, vents and channel."""
    first, cast = float(segment.first.volume()), float(segment.cast.volume())
    thread = sum(float(one.volume()) for one in segment.threads)
    outside = [sum(float(one.volume()) for one in sprues) for sprues in segment.sprues]
    gate = float(segment.sprues[1][0].volume())  # cured by the second pour
    found = {"first pour, body": first + outside[0], "second pour, liners": cast - first - thread + outside[1] - gate}
    for end in segment.caps:
        found[f"{end} cap"] = cap_volume(segment.sizes, end)
    return found


def rods(segment: SegmentMould) -> list[tuple[str, int, str]]:
    """Return rods and pins: name, count and size; plain ones can be cut from stock."""
    sizes, shape = segment.sizes, segment.sizes.shape
    length = sizes.top_end + sizes.foot
    found = [("lumen rod", 1, f"{_wide(shape.lumen)} x {length:.1f} mm, ends {2 * sizes.lumen_spigot(0):.2f} mm")]
    for core in segment.cores:
        n, chambers = len(core.turns), ", ".join(map(str, core.chambers))
        ends, wide = 2 * sizes.spigot(core.hole, 0), _wide(core.hole.core + sizes.inset)
        kind = "pin" if sizes.method == "pin" else "core of three parts"
        longer = 0.0 if sizes.method == "pin" else PULL
        words = f"{wide} x {length + longer:.1f} mm, ends {ends:.2f} mm, groove {sizes.depth:g} mm"
        found.append((f"{kind}, chambers {chambers}", n, words))
        found.append(
            (f"liner rod, chambers {chambers}", n, f"{_wide(core.hole.bore)} x {sizes.top_end + sizes.socket:.1f} mm")
        )
    return found


def screws(sizes: Sizes) -> list[tuple[str, int, str]]:
    """Return clamping screws and tie rods: name, count and size."""
    d = sizes.settings.screw_mm
    clamps = sizes.settings.shell_parts * len(rows(sizes)[0])
    grip = 2 * sizes.settings.flange_thickness_mm + 0.8 * d + 1.0
    length = next((one for one in _LENGTHS if one >= grip), ceil(grip))
    ties = len(tie_places(sizes))
    rod = 5 * ceil((sizes.shape.length + 2 * sizes.stand + 2 * (0.8 * d + 2.0)) / 5)
    return [
        ("clamping screw", clamps, f"M{d:g} x {length}"),
        ("tie rod or screw", ties, f"M{d:g} x {rod}"),
        ("nut", clamps + 2 * ties, f"M{d:g}"),
    ]


def _wide(radius: Any) -> str:
    low, high = 2 * float(min(radius)), 2 * float(max(radius))
    return f"{low:.2f} mm" if high - low < 1e-6 else f"{low:.2f} to {high:.2f} mm"


def _box(part: Any) -> str:
    low, high = bounds(part.printed)
    return " x ".join(f"{side:.1f}" for side in high - low) + " mm"


def _row(
    kind: str, item: str, count: int, size: str, amount: float | None = None, unit: str = "", waste: float = 1.0
) -> dict[str, Any]:
    rounded = None if amount is None else round(amount, 4)
    with_waste = None if amount is None or waste == 1.0 else round(amount * waste, 4)
    return dict(zip(_COLUMNS, (kind, item, count, size, rounded, unit, with_waste), strict=True))


def bill_csv(rows_: list[dict[str, Any]]) -> str:
    """Return a bill as CSV."""
    text = StringIO()
    writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows_)
    return text.getvalue()


def bill_text(title: str, rows_: list[dict[str, Any]], notes: tuple[str, ...]) -> str:
    """Return a bill as a page of text."""
    lines = [title, ""]
    heads = {"print": "To print", "silicone": "Silicone", "thread": "Thread", "rod": "Rods and pins", "screw": "Screws"}
    for kind, head in heads.items():
        lines.append(head)
        for row in (row for row in rows_ if row["kind"] == kind):
            amount = "" if row["amount"] is None else f"{row['amount']:.2f} {row['unit']}"
            waste = "" if row["with_waste"] is None else f", prepare {row['with_waste']:.2f} {row['unit']}"
            lines.append(f"  {row['count']:>3} x  {row['item']:<42} {row['size']:<44} {amount}{waste}".rstrip())
        lines.append("")
    return "\n".join([*lines, *(f"Note: {note}." for note in notes)]).rstrip() + "\n"
