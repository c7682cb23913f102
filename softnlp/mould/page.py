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
from softnlp.model.robot import Robot
from softnlp.model.segments import SegmentedRobot
from softnlp.mould.assembly import Moulds, SegmentMould
from softnlp.mould.bill import pours, screws
from softnlp.mould.checks import Check
from softnlp.mould.picture import png
from softnlp.mould.scenes import (
    body_scene,
    cap_scene,
    core_scene,
    draw_scene,
    exploded,
    open_shell,
    part_scene,
    plate_scene,
    shell_scene,
    sprue_scene,
)

_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1c2833}
h1{font-size:1.6rem}h2{font-size:1.25rem;border-bottom:1px solid #ccd1d9;margin-top:2rem}h3{font-size:1.05rem}
table{border-collapse:collapse;font-size:.85rem;display:block;overflow-x:auto}
th,td{padding:.15rem .6rem;text-align:left;border-bottom:1px solid #e5e8ec}
td:nth-child(5),td:nth-child(6){white-space:nowrap}img{max-width:100%}
.step{display:flex;gap:1.5rem;flex-wrap:wrap;align-items:flex-start}.step div{flex:1 1 20rem}
@media print{.step{break-inside:avoid}}
"""
Image = NDArray[np.uint8]


class Step(NamedTuple):
    """One step. pictures : draw it."""

    title: str
    text: list[str]
    pictures: tuple[Callable[[], Image], ...]


def steps_page(title: str, moulds: Moulds, rows: list[dict[str, Any]], checks: list[Check], silicone: str = "") -> str:
    """Return the page. rows : of the bill. silicone : its name, "" for none."""
    parts = [f"<h1>{escape(title)}: moulds</h1>", f"<p>softnlp {escape(package_version())}. Sizes are in mm.</p>"]
    parts += [f"<p>The body is of {escape(silicone)}.</p>"] if silicone else []
    parts += [f"<p>{escape(note[0].upper() + note[1:])}.</p>" for note in moulds.notes]
    tape = ", tape" if any(segment.sizes.method == "three-part" for segment in moulds.segments) else ""
    parts += ["<h2>What is needed</h2>", _bill(rows), f"<p>{_BESIDES.format(tape=tape)}</p>"]
    own = moulds.robot.segments if isinstance(moulds.robot, SegmentedRobot) else []
    first = 0  # sets count on through the segments, as in a scenario
    for k, segment in enumerate(moulds.segments):
        if len(moulds.segments) > 1:
            parts.append(f"<h2>Segment {k + 1}, of {escape(own[k].material.name)}</h2>")
        robot = own[k].robot if own else moulds.robot
        for n, step in enumerate(steps(segment, _sets(robot, first, len(segment.sizes.shape.holes))), start=1):
            parts.append(_step(n, step))
        first += robot.chamber_sets
    for part in moulds.connectors:
        words = [
            "Print it with the face to the lower segment down. Glue it between the two segments with the "
            "tubes in its holes."
        ]
        parts.append(_step(None, Step(part.name.replace("-", " "), words, (partial(part_scene, part),))))
    parts += ["<h2>What was measured</h2>", _checks(checks)]
    head = f'<meta charset="utf-8"><title>{escape(title)}: moulds</title><style>{_STYLE}</style>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'


def steps(mould: SegmentMould, sets: str = "") -> Iterator[Step]:
    """Yield the steps of a segment in order. sets : in words, which chambers belong together."""
    yield _print(mould)
    yield _wind(mould)
    yield _assemble(mould)
    yield _pour(mould)
    yield _draw(mould)
    yield _line(mould)
    yield _take_out(mould, sets)
    yield Step(
        "The body as cast",
        ["Look through every chamber: no silicone may close it, no thread may lie bare."],
        (lambda: body_scene(mould),),
    )
    for end in mould.caps:
        yield _cap(mould, end)


def _ml(mould: SegmentMould, pour: str) -> tuple[str, str]:
    """Return how much a pour takes, and how much is prepared for it, in words."""
    volume = pours(mould)[pour] / 1000
    return _amount(volume), _amount(volume * (1 + mould.sizes.settings.waste_percent / 100))


def _amount(millilitres: float) -> str:
    return f"{millilitres:.1f} ml" if millilitres >= 1 else f"{millilitres:.2f} ml"


def _print(mould: SegmentMould) -> Step:
    fine = "Fine layers (0.05 mm, resin) are needed for the grooves of the thread. " if mould.sizes.depth > 0 else ""
    words = [
        "Each file lies as it is printed: shells on their backs, plates with the face to the silicone upwards, the "
        f"parts of cores on their flat sides, rods and pins upright. {fine}Liner rods are plain: metal rods of the "
        "same diameter do better where they are thin.",
        "Clean sockets and holes. Try every rod in its plate. In base-2 and top-2, ream the last 2 mm at the "
        "silicone to the liner rods, so that these are held without play; the small holes below the sockets of "
        "base-2 have to be open. Wash and cure resin well, as what is left of it stops silicone from curing. Wipe a "
        "thin film of release agent on what touches silicone, cores as well, before any thread is on them.",
    ]
    return Step("Print the parts", words, (lambda: shell_scene(mould),))


def _wind(mould: SegmentMould) -> Step:
    sizes = mould.sizes
    hold = (
        "Lay the two sides against the key, their lower ends flush, and hold both ends with a turn of tape. Turn the "
        "core in a drill, or between two fingers. "
        if sizes.method == "three-part"
        else "Hold the pin by its flats in a drill or between two fingers. "
    )
    lie = (
        "lies in the groove"
        if sizes.depth > 0
        else f"keeps its pitch of {sizes.settings.thread_pitch_mm:g} mm by eye or by a lathe"
    )
    low, high = sizes.thread_ends
    each = sizes.thread_length() / len(sizes.shape.holes)
    take_off = " Take off the tape: the thread holds the three parts." if sizes.method == "three-part" else ""
    words = [
        f"{hold}Tie the thread round the core where the groove begins, {low:.3g} mm above the lower shoulder, and put "
        "a drop of instant glue on the knot alone: thread that is glued to the core comes out with it. Wind it "
        f"upwards under light tension, clockwise seen from below, so that it {lie}, up to {high:.3g} mm above the "
        f"shoulder. Tie it there in the same way and cut it off.{take_off}",
        f"Each core takes about {each / 10:.0f} cm in {(high - low) / sizes.settings.thread_pitch_mm:.0f} turns.",
    ]
    return Step(
        f"Wind the thread on {len(sizes.shape.holes)} cores", words, (lambda: core_scene(mould, mould.cores[0]),)
    )


def _assemble(mould: SegmentMould) -> Step:
    (_, clamps, clamp), (_, ties, tie), _ = screws(mould.sizes)
    words = [
        "Stand lumen rod and cores in base-1 until their shoulders bear on it. Close the shell around its boss: the "
        f"pins find their holes. Clamp it with {clamps} screws {clamp}. Lower top-1 over the upper ends until it "
        f"bears on the shell; this holds all rods straight. Join the plates by {ties} tie rods {tie}.",
    ]
    return Step("Put the first mould together", words, (lambda: exploded(mould, 1),))


def _pour(mould: SegmentMould) -> Step:
    takes, prepared = _ml(mould, "first pour, body")
    words = [
        f"Mix and degas {prepared} of silicone; the mould takes {takes}. Fill it slowly with a syringe through the "
        "gate, which is at the lower end in the joint of the shell and takes the syringe's tip. Air leaves by the "
        "vents in the top plate. Stop when silicone stands in all of them, and leave the syringe in place or close "
        "the gate with clay until the silicone has cured.",
    ]
    return Step("First pour: the body", words, (lambda: open_shell(mould, 1, silicone=True),))


def _draw(mould: SegmentMould) -> Step:
    if mould.sizes.method == "three-part":
        how = (
            "Draw each key upwards by its end. Press the two sides together, off the thread, and draw them as well, "
            "one after the other."
        )
    elif mould.sizes.depth > 0:
        how = (
            "Turn each pin by its flats, anticlockwise seen from above: it leaves its thread like a screw and rises "
            "by one pitch a turn."
        )
    else:
        how = "Draw each pin straight upwards."
    words = [
        f"Take off tie rods and top plate; shell and base plate stay. {how} The thread stays in the silicone. The "
        "lumen rod stays where it is. Cut off what stands in the vents.",
        "Wash the chambers with isopropyl alcohol and let them dry: liners bond to clean silicone only.",
    ]
    return Step("Draw the cores", words, (lambda: draw_scene(mould),))


def _line(mould: SegmentMould) -> Step:
    takes, prepared = _ml(mould, "second pour, liners")
    shape = mould.sizes.shape
    shots = []
    for core in mould.cores:
        volume = shape.liner(core.hole)
        height = f"{volume / (np.pi * float(core.hole.core[0]) ** 2):.0f} mm high"
        which = "each chamber" if len(mould.cores) == 1 else f"chambers {', '.join(map(str, core.chambers))}"
        shots.append(f"{which} {_amount(volume / 1000)}, about {height}")
    words = [
        "Take off base-1 and put base-2 on; the lumen rod stays in the body. Mix and degas "
        f"{prepared} of silicone; chambers and ring take {takes}. With a syringe and a blunt needle that reaches the "
        f"ground, put into {'; into '.join(shots)}. Push the liner rods in slowly, down to the ground of their "
        "sockets: silicone rises past them to the top, and what was in the sockets leaves by the holes below. Wipe "
        "it off.",
        "Lower top-2 over the rods and join the plates. Fill up through one of the three holes until silicone stands "
        "in the other two. Let it cure upright.",
    ]
    return Step("Second pour: the liners", words, (lambda: exploded(mould, 2), lambda: plate_scene(mould, 2)))


def _take_out(mould: SegmentMould, sets: str) -> Step:
    shape = mould.sizes.shape
    ends = ("tip", "base") if shape.flipped else ("base", "tip")
    around = sorted(shape.holes, key=lambda hole: (hole.angle - mould.sizes.lead) % (2 * np.pi))
    last, first = around[-1].chamber, around[0].chamber
    gate = f", and the gate lies between chambers {last} and {first}" if len(around) > 1 else ""
    words = [
        "Take off top-2. Turn each liner rod by its upper end until it is loose and draw it upwards. Take off base-2. "
        "Turn and draw the lumen rod in the same way, by the end that stands out above; alcohol between rod and "
        "silicone helps. Take out the screws and part the shell.",
        f"The end that stood below is the robot's {ends[0]}, the upper one its {ends[1]}. Before you cut, mark "
        f"chamber 1: seen from the tip, chambers are counted anticlockwise{gate}.{sets} Cut gate "
        "and ring off flush with a sharp blade; they are red in the picture.",
    ]
    return Step("Take out the body", words, (lambda: sprue_scene(mould),))


def _cap(mould: SegmentMould, end: str) -> Step:
    takes, prepared = _ml(mould, f"{end} cap")
    tubes = (
        f" The pins leave holes of {2 * mould.sizes.tube_hole:.3g} mm for the tubes: glue one into each afterwards."
        if end == "base"
        else ""
    )
    words = [
        f"Prepare {prepared} of a harder silicone and pour {takes} of it into the cup: it stands "
        f"{mould.sizes.settings.cap_mm:g} mm above the floor. When it begins to set, stand the body's {end} on it; "
        f"the rim guides it, the pin is in the lumen. Do not press: the chambers have to stay open. After curing "
        f"draw the body out by hand.{tubes}",
    ]
    return Step(f"The {end} cap", words, (partial(cap_scene, mould, end),))


def _sets(robot: Robot, first: int, holes: int) -> str:
    """Return in words which chambers get the same pressure, and which are lines of segments above.

    first : sets of the segments below. holes : chambers and lines.
    """
    each: dict[int, list[str]] = {}
    for chamber, number in enumerate(robot.set_of_chamber):
        each.setdefault(number, []).append(str(chamber + 1))
    words = "; ".join(f"set {first + k + 1} has {' and '.join(members)}" for k, members in sorted(each.items()))
    own = robot.chambers
    lines = f" Chambers {own + 1} to {holes} are the lines of what comes above." if holes > own else ""
    return f" Of these chambers {words}.{lines}"


_BESIDES = (
    "Besides: a syringe with a plain tip that holds the first pour, a blunt needle longer than the body, release agent "
    "for silicone, isopropyl alcohol, instant glue, clay, a blade{tape}, and what degasses silicone."
)


def _step(number: int | None, step: Step) -> str:
    text = "".join(f"<p>{escape(line)}</p>" for line in step.text)
    image = "".join(f"<div>{_image(step.title, draw())}</div>" for draw in step.pictures)
    head = escape(step.title if number is None else f"{number}. {step.title}")
    return f'<h3>{head}</h3><div class="step"><div>{text}</div>{image}</div>'


def _image(title: str, drawn: Image) -> str:
    data = base64.b64encode(png(drawn)).decode("ascii")
    return f'<img alt="{escape(title)}" src="data:image/png;base64,{data}">'


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
