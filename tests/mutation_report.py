"""Write docs/mutation.md from what `mutmut run` left in mutants/ and the reasons in mutation_reasons.toml.

    python tests/mutation_report.py

Every mutant that no test found has to have a reason, or nothing is written; neither is it below nine of ten found.
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

from mutmut.mutation.diff_apply import get_diff_for_mutant

ROOT = Path(__file__).parents[1]
ENOUGH = 0.9
SURVIVED, FOUND, SLOW = (0,), (1, 3), (24, 36, 152, 255, -24)
KINDS = {"equivalent": "the same behaviour", "words": "only the words of a message", "open": "no test yet"}


def changed(mutant: str, module: str) -> tuple[str, str]:
    """Return the line that a mutant changes, before and after."""
    lines = get_diff_for_mutant(mutant, path=f"softnlp/{module}.py").splitlines()[2:]
    before, after = ([line[1:].strip() for line in lines if line[:1] == sign] for sign in "-+")
    return " ".join(before), " ".join(after)


def reason_of(reasons: list[dict[str, Any]], module: str, before: str, after: str) -> dict[str, Any] | None:
    """Return the first reason that fits; `text = true` is for a change of quoted letters alone."""
    spelt = after.replace("XX", "").casefold() == before.casefold()
    for reason in reasons:
        fits = reason.get("module", module) == module and reason["before"] in before
        if fits and reason.get("after", "") in after and (spelt or not reason.get("text")):
            return reason
    return None


def main() -> int:
    """Write the report; return 1 where something has no reason or too little was found."""
    reasons = tomllib.loads((ROOT / "tests" / "mutation_reasons.toml").read_text())["survivor"]
    rows, listed, lost, kinds = [], [], [], Counter[str]()
    made = found = left = 0
    for file in sorted((ROOT / "mutants" / "softnlp").rglob("*.py.meta")):
        module, codes = file.name.partition(".")[0], json.loads(file.read_text())["exit_code_by_key"]
        survivors = [mutant for mutant, code in codes.items() if code in SURVIVED]
        killed = sum(code in (*FOUND, *SLOW) for code in codes.values())
        run = killed + len(survivors)
        share = f"{100 * killed / run:.1f} %" if run else ""
        rows.append(f"| `{module}` | {len(codes)} | {killed} | {len(survivors)} | {len(codes) - run} | {share} |")
        made, found, left = made + run, found + killed, left + len(codes) - run
        lines = []
        for mutant in survivors:
            before, after = changed(mutant, module)
            reason = reason_of(reasons, module, before, after)
            if reason is None:
                lost.append(f"{mutant}: no reason for\n  - {before}\n  + {after}")
                continue
            kinds[reason["kind"]] += 1
            lines.append(
                f"- `{mutant.split('.')[-1].removeprefix('x_')}`: `{after}`\\\n  {reason['why']} ({reason['kind']})"
            )
        if lines:
            listed.append(f"### {module}\n\n" + "\n".join(lines) + "\n")
    if lost or found < ENOUGH * made:
        print("\n".join(lost), f"{found} of {made} found", sep="\n", file=sys.stderr)
        return 1
    counted = "; ".join(f"{kinds[kind]} {kind} ({text})" for kind, text in KINDS.items() if kinds[kind])
    text = (ROOT / "tests" / "mutation_head.md").read_text()
    table = "\n".join(
        ["| module | mutants | found | not found | not run | found of those run |", "|---|---|---|---|---|---|", *rows]
    )
    total = f"| all | {made + left} | {found} | {made - found} | {left} | {100 * found / made:.1f} % |"
    text += f"\n{table}\n{total}\n\n## Not found\n\n{counted}.\n\n" + "\n".join(listed)
    (ROOT / "docs" / "mutation.md").write_text(text.rstrip("\n") + "\n")
    print(f"{found} of {made} found, {made - found} listed, {left} not run")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
