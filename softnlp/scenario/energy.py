"""conventions = "energy": what it leaves without a meaning in a scenario, and what does not take it yet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from softnlp.base.errors import InputError

NOT_USED = "not used with conventions energy"
FACTOR = "modulus_factor"
_CORRECTIONS = ("area", "inertia", "bore_fraction")
_OF_WALL = (
    "chamber_reaction",
    "weight_force_per_N",
    "weight_moment_per_Nmm",
    "weight_length_per_mm",
    "weight_position_per_mm",
    "weight_sensitivity",
)
NOT_OF_ENERGY = ("k_e", "k_b", "k_a", "k_i", "phi", "k_c")
"""The constants of an identification that the energy section does not have."""
_VARIED = ("stiffening.", "corrections.", "contact.chamber_reaction")


def misplaced(data: Mapping[str, Any]) -> Iterator[InputError]:
    """Yield an error for each key that the conventions of a scenario do not take.

    data : the tables of the file, of the right types where they are there.
    """
    corrections, contact = (_table(data, name) for name in ("corrections", "contact"))
    if corrections.get("conventions") != "energy":
        only = 'expected only with [corrections] conventions = "energy"'
        if FACTOR in corrections:
            yield InputError(only, table="corrections", key=FACTOR)
        if contact.get("closure") == "none":
            yield InputError(only, table="contact", key="closure")
        if "c_m" in _listed(data, "measurements", "free"):
            yield InputError(f"'c_m': {only}", table="measurements", key="free")
        if f"corrections.{FACTOR}" in _varied(data):
            yield InputError(only, table="workspace", key=f"vary.corrections.{FACTOR}")
        return
    if "stiffening" in data:
        yield InputError(NOT_USED, table="stiffening", key=next(iter(_table(data, "stiffening")), None))
    for key in _CORRECTIONS:
        if key in corrections:
            yield InputError(NOT_USED, table="corrections", key=key)
    for key in _OF_WALL:
        if key in contact:
            yield InputError(NOT_USED, table="contact", key=key)
    if contact.get("mode") == "constrained":
        yield InputError(f"'constrained' is {NOT_USED}: no closure holds the chambers", table="contact", key="mode")
    if contact.get("closure", "none") != "none":
        yield InputError(f"{contact['closure']!r} is {NOT_USED}, which takes 'none'", table="contact", key="closure")
    for key in _listed(data, "measurements", "free"):
        if key in NOT_OF_ENERGY:
            yield InputError(f"{key!r} is {NOT_USED}; c_m is its only coefficient", table="measurements", key="free")
    for key in _varied(data):
        if key.startswith(_VARIED) and key != f"corrections.{FACTOR}":
            yield InputError(NOT_USED, table="workspace", key=f"vary.{key}")
        elif key.startswith("robot.") and key != "robot.length_mm":
            text = "not with conventions energy so far, whose rings are solved for one section"
            yield InputError(text, table="workspace", key=f"vary.{key}")
    ranges = [("choices", f"robot.{key}", given) for key, given in _table(_table(data, "choices"), "robot").items()]
    ranges += [("actuation", key, given) for key, given in _table(data, "actuation").items()]
    for table, key, given in ranges:
        if isinstance(given, dict) and "from" in given:
            text = "expected a list: ranges are not searched with conventions energy so far"
            yield InputError(text, table=table, key=key)
    for key in sorted({*_table(data, "uncertainty")} & {"chamber_reaction"}):
        yield InputError(NOT_USED, table="uncertainty", key=key)
    yield from _of_segments(data)


def _of_segments(data: Mapping[str, Any]) -> Iterator[InputError]:
    """Yield an error for what segments have that is not of the energy section yet."""
    varies = "expected one number: sections do not vary along s with conventions energy so far"
    for key, value in _table(data, "robot").items():
        if key.endswith(("_mm", "_deg")) and isinstance(value, dict | list):
            yield InputError(varies, table="robot", key=key)
    several = data.get("segment")
    for k, one in enumerate(several if isinstance(several, list) else [], start=1):
        if not isinstance(one, dict):
            continue
        if one.get("lines") == "bonded":
            yield InputError("'bonded' is not with conventions energy so far", table="segment", key=f"{k}.lines")
        for key, value in _table(one, "robot").items():
            if key.endswith(("_mm", "_deg")) and isinstance(value, dict | list):
                yield InputError(varies, table="segment", key=f"{k}.robot.{key}")


def _table(data: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    found = data.get(name)
    return found if isinstance(found, dict) else {}


def _listed(data: Mapping[str, Any], table: str, key: str) -> list[str]:
    found = _table(data, table).get(key)
    return [one for one in found if isinstance(one, str)] if isinstance(found, list) else []


def _varied(data: Mapping[str, Any]) -> list[str]:
    """Return the keys of [workspace.vary], written with a dot or as a table."""
    found = []
    for key, value in _table(_table(data, "workspace"), "vary").items():
        inner = [name for name, entry in value.items() if isinstance(entry, dict)] if isinstance(value, dict) else []
        found += [f"{key}.{name}" for name in inner] if inner and "." not in key else [key]
    return found
