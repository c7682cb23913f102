"""The files of tests/laboratory, and importing them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.laboratory.imported import Imported
from softnlp.laboratory.importing import import_files

FOLDER = Path(__file__).parent / "laboratory"
TRUTH: dict[str, Any] = json.loads((FOLDER / "truth.json").read_text())
SPECIMEN = {"gauge_length_mm": 25, "area_mm2": 8}
MODULUS = 0.03  # [MPa], of the test that `machine_text` returns


def imported(*files: str, kind: str | None = None, **settings: Any) -> Imported:
    """Return the import of some of the files; __ in a setting stands for a dot."""
    given = {key.replace("__", "."): value for key, value in settings.items()}
    return import_files(files, kind, given, FOLDER)


def check_of(found: Imported, name: str) -> Any:
    """Return a check by its name."""
    return next(check for check in found.checks if check.name == name)


def machine_text(longest: float = 1.6) -> str:
    """Return a neo-Hookean test as a machine writes it: its size in a preamble, kN, percent of a strain."""
    rows = [
        f"{k / 10:.1f},{20.5 * (x - 1):.4f},{MODULUS * 8e-3 * (x - x**-2):.9f},{100 * (x - 1):.4f}"
        for k, x in enumerate(np.linspace(1, longest, 31))
    ]
    head = ["Results Table 1", ",Specimen label,Thickness,Width", ",,(mm),(mm)", "1,A-1,2.00,4.00", ""]
    return "\n".join([*head, "Time (s),Displacement (mm),Force (kN),Strain 1 (%)", *rows])
