"""The scenario as text, and its run as the command does it, for any study."""

from __future__ import annotations

import asyncio
import base64
import sys
from asyncio.subprocess import PIPE, STDOUT, Process
from pathlib import Path

from nicegui import ui

from softnlp.app.controls import button, dismiss_refusals, named, refuse
from softnlp.app.files import zipped
from softnlp.app.session import Stage
from softnlp.app.theme import darkness, on_dark
from softnlp.base.errors import SoftnlpError

_ENDED = {
    0: "every step solved",
    2: "the scenario was refused",
    3: "some steps did not solve; the others' results are kept",
}


def scenario_tab(stage: Stage) -> None:
    """Build the text of the scenario on the screen, with what applies it and what runs it."""
    session = stage.session
    running: list[Process] = []

    with ui.column().classes("w-full gap-2 p-2"):
        ui.label("The file behind the screen. Edit it and apply, or run it as the command does.").classes("text-sm")
        editor = ui.codemirror(session.text(), language="TOML", theme="basicLight").classes("w-full h-80 text-xs")
        named(editor, "scenario.text", "scenario-text")
        with ui.row().classes("w-full gap-2"):
            button("Apply", None, "scenario-apply", lambda: apply(), "no-caps unelevated dense")
            back = button("Back", None, "scenario-back", lambda: editor.set_value(session.text()), "no-caps flat dense")
            back.tooltip("Forget what was typed here")
            ui.space()
            run_button = button("Run", "play_arrow", "scenario-run", lambda: start(), "no-caps unelevated dense")
            stop_button = button("Stop", "stop", "scenario-stop", lambda: stop(), "no-caps outline dense")
        stop_button.set_visibility(False)
        output = ui.log(max_lines=400).classes("w-full h-40 text-xs").props("data-testid=scenario-output")
        figure = ui.image().classes("w-full").props("data-testid=scenario-figure")
        figure.set_visibility(False)
        result = button("Results", "download", "scenario-results", lambda: offer(), "no-caps flat dense")
        result.set_visibility(False)

    out = session.folder / "results"

    def follow() -> None:
        editor.set_value(session.text())

    def apply() -> bool:
        if editor.value == session.text():
            return True
        try:
            session.open(editor.value or "", session.file_name)
        except SoftnlpError as error:
            refuse(str(error))
            return False
        dismiss_refusals()
        return True

    async def start() -> None:
        if not apply():
            return
        file = session.folder / session.name
        file.write_text(session.text(), encoding="utf-8")
        output.clear()
        _switch(True)
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "softnlp", "run", str(file), "--out", str(out), stdout=PIPE, stderr=STDOUT
        )
        running.append(process)
        assert process.stdout is not None
        async for line in process.stdout:
            output.push(line.decode(errors="replace").rstrip().replace(f"{session.folder}/", ""))
        code = await process.wait()
        running.remove(process)
        _switch(False)
        output.push(_ENDED.get(code, "stopped" if code in (130, -2, -15) else f"ended with status {code}"))
        drawing = out / "figure.png"
        figure.set_visibility(drawing.exists())
        if drawing.exists():
            figure.set_source(_data_url(drawing))
        result.set_visibility(out.exists() and any(out.iterdir()))

    def stop() -> None:
        for process in running:
            process.terminate()

    def offer() -> None:
        found = {str(file.relative_to(out)): file for file in sorted(out.rglob("*")) if file.is_file()}
        ui.download.content(zipped(found), f"{Path(session.name).stem}_results.zip")

    def _switch(on: bool) -> None:
        run_button.set_visibility(not on)
        stop_button.set_visibility(on)

    dark = darkness()

    def turn() -> None:
        editor.set_theme("basicDark" if dark() else "basicLight")

    on_dark(turn)
    turn()
    session.on_scenario(follow)
    session.on_pressure(follow)
    ui.context.client.on_delete(stop)


def _data_url(image: Path) -> str:
    """Return a PNG file as a URL that holds it, so that the next run's is not mistaken for it."""
    return f"data:image/png;base64,{base64.b64encode(image.read_bytes()).decode()}"
