"""Moulds made in a process of their own, so that the page is alive meanwhile and a stop ends the work at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from softnlp.app.asking import Progress, Stopped
from softnlp.base.errors import InputError
from softnlp.base.processes import begin_worker, process_context
from softnlp.model.robot import Robot
from softnlp.mould.checks import Check
from softnlp.scenario.mould import MouldTable
from softnlp.scenario.read import Scenario

_LOOK_S = 0.2  # between two looks whether a person stops
_BEGUN = 0.2  # of the time goes into the start of the process and the parts


@dataclass(frozen=True)
class Asked:
    """What moulds are made of. name : before those of all files. density : of the silicone [kg/m^3]."""

    robot: Robot
    settings: MouldTable
    name: str
    title: str
    density: float
    silicone: str

    @classmethod
    def of(cls, scenario: Scenario, name: str) -> Asked:
        """Return what a scenario asks for."""
        material = scenario.material
        return cls(scenario.robot, scenario.mould, name, scenario.title, float(material.density), material.name)


@dataclass(frozen=True)
class Parts:
    """What there is before anything is measured. views : messages of the 3-D view by their words."""

    views: dict[str, dict[str, Any]]
    notes: tuple[str, ...]
    words: str


@dataclass(frozen=True)
class Made:
    """Moulds that hold. files : content by name. rows : of the bill."""

    parts: Parts
    files: dict[str, bytes]
    checks: list[Check]
    rows: list[dict[str, Any]]


def made_apart(asked: Asked, progress: Progress, parts: Callable[[Parts], None]) -> Made:
    """Return the moulds, made in another process. parts : called with the parts as soon as they are there.

    Raises
    ------
    Stopped
        Where a person stops it.
    InputError
        For what cannot be moulded.
    """
    context: Any = process_context()
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(there, asked), daemon=True)
    process.start()
    there.close()
    try:
        while True:
            if progress.stopping:
                raise Stopped
            if not here.poll(_LOOK_S):
                continue
            kind, found = here.recv()
            if isinstance(found, Made):
                return found
            if kind == "error":
                raise found
            if kind == "parts":
                parts(found)
                progress(_BEGUN, 1.0, "parts are there")
            else:
                done, total, text = found
                progress(_BEGUN + (1 - _BEGUN) * done / total, 1.0, text)
    except EOFError:
        raise InputError("the process that makes the moulds has ended") from None
    finally:
        process.terminate()
        process.join()
        here.close()


def _work(there: Connection, asked: Asked) -> None:
    """Make moulds and send what there is, as it comes."""
    from softnlp.app.mould_parts import messages_of
    from softnlp.mould import bill, mould_files, moulds

    begin_worker()
    try:
        found = moulds(asked.robot, asked.settings)
        methods = " and ".join(dict.fromkeys(segment.sizes.method for segment in found.segments))
        words = f"{sum(part.count for part in found.parts)} pieces of {len(found.parts)} parts, {methods} cores"
        parts = Parts(messages_of(found), found.notes, words)
        there.send(("parts", parts))

        def told(done: float, total: float, text: str) -> None:
            there.send(("told", (done, total, text)))

        files, checks = mould_files(found, asked.name, asked.title, asked.density, asked.silicone, told)
        there.send(("made", Made(parts, files, checks, bill(found, asked.density))))
    except Exception as error:
        there.send(("error", error))
