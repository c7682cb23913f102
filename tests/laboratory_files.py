"""The files of tests/laboratory, and importing them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from softnlp.laboratory.imported import Imported
from softnlp.laboratory.importing import import_files

FOLDER = Path(__file__).parent / "laboratory"
TRUTH: dict[str, Any] = json.loads((FOLDER / "truth.json").read_text())
SPECIMEN = {"gauge_length_mm": 25, "area_mm2": 8}


def imported(*files: str, kind: str | None = None, **settings: Any) -> Imported:
    """Return the import of some of the files; __ in a setting stands for a dot."""
    given = {key.replace("__", "."): value for key, value in settings.items()}
    return import_files(files, kind, given, FOLDER)


def check_of(found: Imported, name: str) -> Any:
    """Return a check by its name."""
    return next(check for check in found.checks if check.name == name)
