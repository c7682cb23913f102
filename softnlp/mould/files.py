"""All files of a mould, made before the first of them is written."""

from __future__ import annotations

import json
from collections.abc import Callable

from softnlp.base.errors import InputError
from softnlp.model.inputs import package_version
from softnlp.mould.assembly import Moulds
from softnlp.mould.bill import bill, bill_csv, bill_text
from softnlp.mould.checks import Check, checks_of, document, failed
from softnlp.mould.page import steps_page
from softnlp.mould.sizes import refuse
from softnlp.mould.write import glb, stl, three_mf

_MEASURED = 0.85  # of the time goes into checks, the rest into pictures


def mould_files(
    moulds: Moulds,
    name: str,
    title: str,
    density: float,
    silicone: str = "",
    told: Callable[[float, float, str], None] = lambda done, total, text: None,
) -> tuple[dict[str, bytes], list[Check]]:
    """Return the content of every file by its name, and what was measured.

    name : before the names of all files. title : of the page. density : of the silicone [kg/m^3].
    silicone : its name, for the page. told : called now and then with what is done, of how much, and what it was.

    Raises
    ------
    InputError
        Where a check fails: such moulds are not written.
    """
    checks = checks_of(moulds, lambda done, total, text: told(_MEASURED * done / total, 1.0, text))
    for check in failed(checks):
        raise _refusal(check)
    told(_MEASURED, 1.0, "files are made")
    rows = bill(moulds, density)
    found = {}
    for part in moulds.parts:
        found[f"{name}-{part.name}.stl"] = stl(part)
        found[f"{name}-{part.name}.3mf"] = three_mf(part)
    found[f"{name}-assembly.glb"] = glb(moulds)
    kept = {
        "softnlp": package_version(),
        "title": title,
        "settings": moulds.settings.model_dump(),
        "method": [segment.sizes.method for segment in moulds.segments],
        "notes": list(moulds.notes),
        "bill": rows,
        "checks": document(checks),
    }
    texts = {
        f"{name}-bill.json": json.dumps(kept, indent=2, ensure_ascii=False) + "\n",
        f"{name}-bill.csv": bill_csv(rows),
        f"{name}-bill.txt": bill_text(title, rows, moulds.notes),
        f"{name}-steps.html": steps_page(title, moulds, rows, checks, silicone),
    }
    return found | {key: text.encode() for key, text in texts.items()}, checks


def _refusal(check: Check) -> InputError:
    """Return why moulds are not written of which a check fails; it names the key that most likely mends it."""
    unit = f" {check.unit}" if check.unit else ""
    if check.name == "largest side":
        return refuse(
            f"{check.part} is {check.value:.4g} mm long as it is printed, too large for the {check.limit}", "bed_mm"
        )
    if check.name == "thinnest wall":
        return refuse(f"{check.part} would be {check.value:.3g} mm thin, expected {check.limit} mm", "minimum_wall_mm")
    return refuse(
        f"these moulds would not hold: {check.name} of {check.part} is {check.value:.4g}{unit}, expected {check.limit}"
    )
