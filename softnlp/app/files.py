"""Opening scenario files, saving what is on the screen, and bodies as meshes."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from nicegui import events, ui

from softnlp.app.controls import dismiss_refusals, plain_words, refuse
from softnlp.app.document import Document
from softnlp.app.examples import example_choice
from softnlp.app.parts import DROP, while_open
from softnlp.app.session import Session
from softnlp.app.taken import LARGEST_FILE
from softnlp.base.errors import InputError, SoftnlpError
from softnlp.model.robot import Robot
from softnlp.model.segments import SegmentedRobot, require_one_segment
from softnlp.results import body_of_pose
from softnlp.statics.step import Pose


def saved(session: Session) -> tuple[str, bytes]:
    """Return the name and content of what a person saves: the scenario, zipped with the files that it names."""
    text, name = session.text(), session.file_name
    files = Document(text).files()
    if not files:
        return name, text.encode()
    contents = {file: (session.folder / file).read_bytes() for file in files}
    return f"{name.removesuffix('.toml')}.zip", zipped({name: text.encode(), **contents})


def zipped(files: Mapping[str, bytes | Path]) -> bytes:
    """Return contents and files as a zip archive under their names in it."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.write(content, name) if isinstance(content, Path) else archive.writestr(name, content)
    return packed.getvalue()


def save(session: Session) -> None:
    """Offer the scenario on the screen as a download; what is wrong with it is said instead."""
    try:
        session.asked()
    except SoftnlpError as error:
        refuse(f"not saved: {plain_words(error)}")
        return
    dismiss_refusals()
    name, content = saved(session)
    ui.download.content(content, name)
    if session.study != session.opened_study or session.study != session.document.study:
        without = "".join(f", without [{table}]" for table in session.left_out())
        ui.notify(f"saved {name}: study {session.study}{without}")


def open_dialog(session: Session) -> ui.dialog:
    """Return a dialog that takes a scenario and the files that it names."""

    @while_open
    async def taken(event: events.MultiUploadEventArguments) -> None:
        upload.reset()
        try:
            open_files(session, [(file.name, await file.read()) for file in event.files])
        except SoftnlpError as error:
            refuse(f"not opened: {error}")
            return
        dismiss_refusals()
        dialog.close()
        ui.notify(f"opened {session.name}", type="positive")

    def refused() -> None:
        refuse(f"not opened: expected .toml and .csv files of at most {LARGEST_FILE / 1e6:.0f} MB")

    with ui.dialog() as dialog, ui.card().classes("w-96"):
        ui.label("Open a scenario").classes("text-lg").props("role=heading aria-level=2")
        ui.label("A .toml file; drop the CSV and material files that it names together with it.").classes("text-sm")
        # Files that belong together come together only where their handler is given here
        ui.add_css(DROP)
        upload = ui.upload(
            label="Drop files here, or click +",
            multiple=True,
            auto_upload=True,
            max_file_size=LARGEST_FILE,
            on_multi_upload=taken,
            on_rejected=refused,
        )
        upload.props('flat bordered accept=".toml,.csv,.txt" data-testid=open-upload color=transparent')
        upload.props("text-color=primary").classes("w-full softnlp-drop")
        example_choice(session, dialog)
        ui.button("Cancel", on_click=dialog.close).props("flat no-caps data-testid=open-cancel")
    return dialog


def open_files(session: Session, files: Sequence[tuple[str, bytes]]) -> None:
    """Show the one scenario among some files.

    Raises
    ------
    InputError
        Where there is not exactly one, or it cannot be read.
    """
    scenarios = [(name, content) for name, content in files if name.lower().endswith(".toml") and b"study" in content]
    if len(scenarios) != 1:
        raise InputError(f"expected one scenario (.toml with study = …), got {len(scenarios)}")
    name, content = scenarios[0]
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("expected text in UTF-8", source=name) from None
    session.open(text, name, {other: data for other, data in files if other != name})


def mesh_menu(session: Session, pose: Callable[[], Pose | None]) -> None:
    """Build menu entries that offer the body as a mesh. pose : a function that gives the pose shown, or None."""

    def offer(state: str, kind: str) -> None:
        shown, scenario, name = pose(), session.scenario, f"{state}.{kind}"
        deformed = state == "deformed"
        if scenario is None or (deformed and shown is None):
            ui.notify("no solved pose to export", type="warning")
            return
        try:
            ui.download.content(mesh_bytes(scenario.robot, shown if deformed else None, session.folder / name), name)
        except SoftnlpError as error:
            ui.notify(str(error), type="negative")

    for state, words in (("deformed", "Deformed body"), ("undeformed", "Undeformed body for the mould")):
        for kind in ("stl", "glb"):
            item = ui.menu_item(f"{words}, {kind.upper()}", on_click=partial(offer, state, kind))
            item.props(f"data-testid=mesh-{state}-{kind}")


def mesh_bytes(robot: Robot, pose: Pose | None, file: Path) -> bytes:
    """Return the body of a pose, or the body as it is moulded for None, in the format of a file's suffix.

    Raises
    ------
    InputError
        Where the extra mesh is not installed, where the body passes through itself so that it cannot be made solid, and
        for a mould of several segments.
    """
    from softnlp.figures.mesh import body_solid, mould_body, write_solids
    from softnlp.figures.mesh.solid import segment_solids

    if pose is None:
        require_one_segment(robot, "a mould")
        solids = [mould_body(robot)]
    elif isinstance(robot, SegmentedRobot):
        solids = [*segment_solids(robot, body_of_pose(pose))]
    else:
        solids = [body_solid(robot, body_of_pose(pose))]
    return write_solids(solids, robot, file).read_bytes()
