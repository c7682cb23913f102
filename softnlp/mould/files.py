"""All files of a mould, made before the first of them is written."""

from __future__ import annotations

import json

from softnlp.model.inputs import package_version
from softnlp.mould.assembly import Moulds
from softnlp.mould.bill import bill, bill_csv, bill_text
from softnlp.mould.checks import Check, checks_of, document, failed
from softnlp.mould.page import steps_page
from softnlp.mould.sizes import refuse
from softnlp.mould.write import glb, stl, three_mf


def mould_files(moulds: Moulds, name: str, title: str, density: float) -> tuple[dict[str, bytes], list[Check]]:
    """Return the content of every file by its name, and what was measured.

    name : before the names of all files. title : of the page. density : of the silicone [kg/m^3].

    Raises
    ------
    InputError
        Where a check fails: such moulds are not written.
    """
    checks = checks_of(moulds)
    for check in failed(checks):
        unit = f" {check.unit}" if check.unit else ""
        raise refuse(
            f"these moulds would not hold: {check.name} of {check.part} is {check.value:.4g}{unit}, "
            f"expected {check.limit}"
        )
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
        f"{name}-steps.html": steps_page(title, moulds, rows, checks),
    }
    return found | {key: text.encode() for key, text in texts.items()}, checks
