"""The page of steps: what to do, in order, with pictures; one HTML file that needs no other."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from functools import partial
from html import escape
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softnlp.model.inputs import package_version
from softnlp.mould.assembly import Moulds, SegmentMould
from softnlp.mould.bill import pours, screws
from softnlp.mould.checks import Check
from softnlp.mould.picture import png
from softnlp.mould.scenes import (
    body_scene,
    cap_scene,
    core_scene,
    exploded,
    open_shell,
    part_scene,
    plate_scene,
    shell_scene,
)

_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1c2833}
h1{font-size:1.6rem}h2{font-size:1.25rem;border-bottom:1px solid #ccd1d9;margin-top:2rem}h3{font-size:1.05rem}
table{border-collapse:collapse;font-size:.85rem;display:block;overflow-x:auto}
th,td{padding:.15rem .6rem;text-align:left;border-bottom:1px solid #e5e8ec}img{max-width:100%}
.step{display:flex;gap:1.5rem;flex-wrap:wrap;align-items:flex-start}.step div{flex:1 1 20rem}
@media print{.step{break-inside:avoid}}
"""
Image = NDArray[np.uint8]


class Step(NamedTuple):
    """One step. picture : draws it, None for none."""

    title: str
    text: list[str]
    picture: Callable[[], Image] | None


def steps_page(title: str, moulds: Moulds, rows: list[dict[str, Any]], checks: list[Check]) -> str:
    """Return the page. rows : of the bill."""
    parts = [f"<h1>{escape(title)}: moulds</h1>", f"<p>softnlp {escape(package_version())}. Sizes are in mm.</p>"]
    parts += [f"<p>{escape(note[0].upper() + note[1:])}.</p>" for note in moulds.notes]
    parts += ["<h2>What is needed</h2>", _bill(rows)]
    for k, segment in enumerate(moulds.segments):
        if len(moulds.segments) > 1:
            parts.append(f"<h2>Segment {k + 1}</h2>")
        for n, step in enumerate(steps(segment), start=1):
            parts.append(_step(n, step))
    for part in moulds.connectors:
        words = [
            "Print it with the face to the lower segment down. Glue it between the two segments with the "
            "tubes in its holes."
        ]
        parts.append(_step(None, Step(part.name.replace("-", " "), words, partial(part_scene, part))))
    parts += ["<h2>What was measured</h2>", _checks(checks)]
    head = f'<meta charset="utf-8"><title>{escape(title)}: moulds</title><style>{_STYLE}</style>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'


def steps(mould: SegmentMould) -> Iterator[Step]:
    """Yield the steps of a segment in order."""
    sizes, settings = mould.sizes, mould.sizes.settings
    three, amounts = sizes.method == "three-part", pours(mould)
    waste = 1 + settings.waste_percent / 100
    ml = {name: f"{volume * waste / 1000:.1f} ml" for name, volume in amounts.items()}
    (_, clamps, clamp), (_, ties, tie), _ = screws(sizes)
    yield Step(
        "Print the parts",
        [
            "Each file lies as it is printed: shells on their backs, plates with the face to the silicone upwards, the "
            "parts of cores on their flat sides, rods and pins upright. Fine layers (0.05 mm, resin) are "
            "needed for the "
            "grooves of the thread. Liner rods are plain: metal rods of the same diameter do better "
            "where they are thin.",
            "Clean sockets and holes. Try every rod in its plate. In base-2 and top-2, ream the last 2 mm at the "
            "silicone to the liner rods, so that these are held without play. Wash off all resin: it stops silicone "
            "from curing. Wipe or spray what touches silicone with a release agent.",
        ],
        lambda: shell_scene(mould),
    )
    hold = (
        "Put key and sides together in the base plate and hold their upper ends with tape. "
        if three
        else "Hold the pin by its flats in a drill or between two fingers. "
    )
    lie = (
        "lies in the groove"
        if sizes.depth > 0
        else f"keeps its pitch of {settings.thread_pitch_mm:g} mm by eye or by a lathe"
    )
    yield Step(
        f"Wind the thread on {len(sizes.shape.holes)} cores",
        [
            f"{hold}Knot the thread at the lower end of the groove and fix it with a drop of instant glue. Wind it "
            f"upwards under light tension, clockwise seen from below, so that it {lie}; knot and fix it "
            "at the upper end.",
            f"Each core takes about {sizes.thread_length() / len(sizes.shape.holes):.0f} mm.",
        ],
        lambda: core_scene(mould, mould.cores[0]),
    )
    yield Step(
        "Put the first mould together",
        [
            "Stand lumen rod and cores in base-1 until their shoulders bear on it. Close the shell "
            "around its boss: the "
            f"pins find their holes. Clamp it with {clamps} screws {clamp}. Lower top-1 over the upper ends until it "
            f"bears on the shell; this holds all rods straight. Join the plates by {ties} tie rods {tie}.",
        ],
        lambda: exploded(mould, 1),
    )
    yield Step(
        "First pour: the body",
        [
            f"Mix and degas {ml['first pour, body']} of silicone. Fill it slowly with a syringe through "
            "the gate, which "
            "is at the lower end in the joint of the shell and takes the syringe's tip. Air leaves by the vents in the "
            "top plate. Stop when silicone stands in all of them, and leave the syringe in place or "
            "close the gate with "
            "clay until the silicone has cured.",
        ],
        lambda: open_shell(mould, 1, silicone=True),
    )
    if three:
        draw = (
            "Take off the top plate; shell and base plate stay. Draw each key upwards by its end. Press the two sides "
            "together, off the thread, and draw them as well, one after the other."
        )
    elif sizes.depth > 0:
        draw = (
            "Take off the top plate; shell and base plate stay. Turn each pin by its flats, "
            "anticlockwise seen from above: it "
            "leaves its thread like a screw and rises by one pitch a turn."
        )
    else:
        draw = "Take off the top plate; shell and base plate stay. Draw each pin straight upwards."
    yield Step(
        "Draw the cores",
        [
            f"{draw} The thread stays in the silicone. The lumen rod stays where it is. Cut off what "
            "stands in the vents."
        ],
        None,
    )
    yield Step(
        "Second pour: the liners",
        [
            "Take off base-1 and put base-2 on. Fill each chamber with silicone from its lower end "
            "upwards, with a syringe and a blunt "
            "needle, and push its liner rod in down to the socket: what it displaces rises. Lower top-2 "
            "over the rods and "
            "join the plates. Fill up through one of the three holes until silicone stands in the other two. "
            f"{ml['second pour, liners']} are enough. After curing take off top-2, draw the rods, take off "
            "base-2, and cut off the ring flush with the body's end.",
        ],
        lambda: exploded(mould, 2),
    )
    yield Step(
        "Take out the body",
        [
            "Draw the lumen rod. Take out the screws, part the shell, and cut off the gate. The plates "
            "and the ring look so:"
        ],
        lambda: plate_scene(mould, 2),
    )
    yield Step(
        "The body as cast",
        ["Look through every chamber: no silicone may close it, no thread may lie bare."],
        lambda: body_scene(mould),
    )
    for end in mould.caps:
        tubes = " The pins leave holes for the tubes: glue one into each afterwards." if end == "base" else ""
        yield Step(
            f"The {end} cap",
            [
                f"Pour {ml[f'{end} cap']} of a harder silicone into the cup, to {settings.cap_mm:g} mm "
                "above its floor. "
                f"When it begins to set, stand the body's {end} on it; the rim guides it, the pin is in "
                "the lumen. Do not "
                f"press: the chambers have to stay open.{tubes}",
            ],
            partial(cap_scene, mould, end),
        )


def _step(number: int | None, step: Step) -> str:
    text = "".join(f"<p>{escape(line)}</p>" for line in step.text)
    image = ""
    if step.picture is not None:
        data = base64.b64encode(png(step.picture())).decode("ascii")
        image = f'<div><img alt="{escape(step.title)}" src="data:image/png;base64,{data}"></div>'
    head = escape(step.title if number is None else f"{number}. {step.title}")
    return f'<h3>{head}</h3><div class="step"><div>{text}</div>{image}</div>'


def _bill(rows: list[dict[str, Any]]) -> str:
    head = "".join(f"<th>{name}</th>" for name in ("", "what", "count", "size", "amount", "prepare"))
    lines = []
    for row in rows:
        amount, more = ("" if row[key] is None else f"{row[key]:.2f} {row['unit']}" for key in ("amount", "with_waste"))
        cells = (row["kind"], row["item"], str(row["count"]), row["size"], amount, more)
        lines.append("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>")
    return f"<table><tr>{head}</tr>{''.join(lines)}</table>"


def _checks(checks: list[Check]) -> str:
    head = "".join(f"<th>{name}</th>" for name in ("check", "of", "measured", "limit", ""))
    lines = []
    for check in checks:
        value = f"{check.value:.4g} {check.unit}".strip()
        cells = (check.name, check.part, value, check.limit, check.verdict)
        lines.append("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>")
    return f"<table><tr>{head}</tr>{''.join(lines)}</table>"
