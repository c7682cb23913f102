"""The page: panels on the left, the robot in the middle, results and the study on the right."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nicegui import ui

from softnlp.app.asking import sentence
from softnlp.app.controls import button
from softnlp.app.files import mesh_menu, open_dialog, save
from softnlp.app.live_view import LiveView
from softnlp.app.notes import tab_note
from softnlp.app.panels.equations import coefficients_panel, loads_panel, solver_panel
from softnlp.app.panels.found import FoundTables
from softnlp.app.panels.material import material_panel
from softnlp.app.panels.obstacles import draw_obstacles, obstacles_panel
from softnlp.app.panels.past import Past
from softnlp.app.panels.pins import PinsPanel
from softnlp.app.panels.pressure import pressure_panel
from softnlp.app.panels.results import ResultsPanel
from softnlp.app.panels.robot import robot_panel
from softnlp.app.panels.segments import segments_panel
from softnlp.app.part import LIST, Part, place_of
from softnlp.app.report import report_menu
from softnlp.app.session import Session, Stage
from softnlp.app.tabs.blocked import blocked_tab
from softnlp.app.tabs.inverse import inverse_tab
from softnlp.app.tabs.scenario import scenario_tab
from softnlp.app.tabs.sequence import sequence_tab
from softnlp.app.tabs.workspace import workspace_tab
from softnlp.app.theme import style_page
from softnlp.app.view import RobotView
from softnlp.statics.step import Run


def _identify(stage: Stage) -> None:
    from softnlp.app.tabs.identify import identify_tab  # these when they are opened: the page is there sooner

    identify_tab(stage)


def _design(stage: Stage) -> None:
    from softnlp.app.tabs.design import design_tab

    design_tab(stage)


def _compare(stage: Stage) -> None:
    from softnlp.app.tabs.compare import compare_tab

    compare_tab(stage)


def _sensitivity(stage: Stage) -> None:
    from softnlp.app.tabs.sensitivity import sensitivity_tab

    sensitivity_tab(stage)


def _time(stage: Stage) -> None:
    from softnlp.app.tabs.time import time_tab

    time_tab(stage)


def _mould(stage: Stage) -> None:
    from softnlp.app.tabs.mould import mould_tab

    mould_tab(stage)


STUDIES: dict[str, tuple[str, str | None, Callable[[Stage], None]]] = {
    "kinematics": ("Kinematics", "forward", sequence_tab),
    "blocked": ("Blocked force", "blocked-force", blocked_tab),
    "workspace": ("Workspace", "workspace", workspace_tab),
    "inverse": ("Inverse", "inverse", inverse_tab),
    "time": ("Time", "dynamic", _time),
    "identify": ("Identification", "identify", _identify),
    "design": ("Design", "design", _design),
    "compare": ("Compare", None, _compare),
    "sensitivity": ("Sensitivity", None, _sensitivity),
    "mould": ("Mould", None, _mould),
}
"""The tabs: label, study of the scenario while it is open (None: any), and what builds it."""
_TAB_OF = {study: name for name, (_, study, _) in STUDIES.items() if study is not None}
SCENARIO = "scenario"
_LINE = "border-neutral-300 dark:border-neutral-700"
_HEADER = f"softnlp-header min-h-12 px-3 py-0 items-center gap-2 border-b softnlp-surface {_LINE}"
_COLUMN = "softnlp-column shrink-0 h-full overflow-y-auto overflow-x-hidden p-3"
_MESSAGE = "absolute bottom-2 left-2 right-2 text-sm rounded px-3 py-2 bg-orange-100 text-orange-950"
_GREY = "Grey: the last robot that made sense."
_PANELS = {
    "robot": "robot",
    "material": "material",
    "gravity": "loads",
    "tip_load": "loads",
    "stiffening": "coefficients",
    "corrections": "coefficients",
    "solver": "solver",
    "obstacle": "obstacles",
    LIST: "segments",
}
"""The panel on the left that says what is wrong with a table."""


def build_page(session: Session, pins: str = "", is_dark: bool = False) -> None:
    """Build one browser tab for a session. pins : those that the browser kept. is_dark : whether it begins dark."""
    dark = ui.dark_mode(is_dark)
    style_page()
    chosen = _TAB_OF.get(session.document.study, SCENARIO)
    with ui.header(elevated=False).classes(_HEADER):
        ui.label("softnlp").classes("text-lg font-semibold mr-2").props("role=heading aria-level=1")
        with ui.tabs().classes("softnlp-tabs min-w-0") as tabs:
            tabs.props("dense no-caps inline-label shrink outside-arrows")
            for name, label in (*((name, label) for name, (label, *_) in STUDIES.items()), (SCENARIO, "Scenario")):
                ui.tab(name, label=label).props(f"data-testid=tab-{name}")
        tabs.set_value(chosen)
        ui.space()
        with ui.row().classes("items-center no-wrap gap-1"):
            exports = _files(session, dark)
    with ui.row().classes("softnlp-page w-full no-wrap gap-0"):
        with ui.element("div").classes(f"softnlp-inputs border-r {_COLUMN} {_LINE}"):
            panels = _panels(session)
        with ui.column().classes("softnlp-middle min-w-0 gap-0 relative") as middle:
            view = RobotView().classes("w-full grow min-h-0").props("data-testid=view")
            with ui.row().classes("absolute top-2 left-2 gap-1 z-10"):
                Past(session)
                pin = button("Pin", "push_pin", "pin", lambda: pinned.pin(), "flat dense no-caps")
                pin.tooltip("Keep this state beside those to come")
            _view_buttons(view)
            message = ui.label().classes(_MESSAGE).props("data-testid=message role=status").mark("message")
            message.set_visibility(False)
        stage = Stage(session, view, open_tab=tabs.set_value)
        with ui.element("div").classes(f"softnlp-results border-l {_COLUMN} {_LINE}"):
            with ui.element("div").classes("w-full softnlp-shown") as shown:
                results = ResultsPanel()
                tables = FoundTables()
            pinned = PinsPanel(stage, lambda: results.run, pins)
            ui.separator()
            _studies(stage, tabs, chosen)
            ui.separator()
            results.details()

    def say(words: str, stale: bool = False) -> None:
        """Show a line below the view, and in grey what is no picture of the controls."""
        if session.is_stale and not awaits_data(session):
            words, stale = stale_words(session), True
        message.set_text(words)
        message.set_visibility(bool(words))
        for part in (middle, shown):
            part.classes(add="softnlp-stale") if stale else part.classes(remove="softnlp-stale")

    def found(run: Run) -> None:
        results.show(run)
        tables.show(run)
        pinned.show(run)

    live = LiveView(stage, found, say)
    stage.plays.append(live.play)
    with exports:
        report_menu(stage, lambda: results.run, lambda: pinned.pins)
        mesh_menu(session, lambda: None if results.run is None else results.run.steps[0].pose)

    draw_obstacles(stage)
    looked = session.document.study

    def read_again() -> None:
        nonlocal looked
        is_other, looked = session.document.study != looked, session.document.study
        if session.is_stale or message.text.startswith(_GREY):
            say("")
        panel = _panel_of(session)
        if session.is_stale and panel is not None:
            panels[panel].set_value(True)  # where it is said
        opened = _TAB_OF.get(session.document.study, SCENARIO)
        of_every_study = STUDIES.get(str(tabs.value), ("", None))[1] is None
        if tabs.value != opened and tabs.value != SCENARIO and (is_other or not of_every_study):
            tabs.set_value(opened)

    session.on_scenario(read_again)
    say("")
    live.request()


def stale_words(session: Session) -> str:
    """Return what to say of a picture that is not of what is on the screen: where it is told, or else what is wrong."""
    problem = session.problem
    if problem is None or _panel_of(session) is not None:
        return f"{_GREY} See the field marked red."
    return f"{_GREY} {sentence(problem.message)}"


def _panel_of(session: Session) -> str | None:
    """Return the panel on the left that says what is wrong, None for another place; of obstacle.2 that of obstacles."""
    problem = session.problem
    if problem is None:
        return None
    place = place_of(problem)
    table = problem.table if place is None else place[1]
    return None if table is None else _PANELS.get(table.split(".")[0])


def awaits_data(session: Session) -> bool:
    """Whether all that is missing is the file that an identification starts from."""
    tables = ("measurements", "tensile")
    return session.document.study == "identify" and not any(map(session.table, tables))


def _files(session: Session, dark: ui.dark_mode) -> ui.menu:
    """Build the buttons for files and return the menu of exports."""
    dialog = open_dialog(session)
    look = "flat dense no-caps"
    button("Open", "folder_open", "open", dialog.open, look).props("aria-label=Open")
    button("Save", "save", "save", partial(save, session), look).props("aria-label=Save")
    with ui.button("Export", icon="view_in_ar").props(f"{look} data-testid=export aria-label=Export"):
        exports = ui.menu()

    def turned() -> None:
        dark.toggle()
        ui.run_javascript(f"sessionStorage.setItem('softnlp.dark', '{str(bool(dark.value)).lower()}')")

    turn = button("", "contrast", "dark", turned, "flat dense round").tooltip("Light or dark")
    turn.props('aria-label="Light or dark"')
    return exports


def _panels(session: Session) -> dict[str, ui.expansion]:
    """Build what describes the robot, its silicone, its loads and the equations; return the panels by name."""
    panels = {}
    part = Part(session)
    for name, label, opened, build in (
        ("pressures", "Pressures", True, partial(pressure_panel, session)),
        ("segments", "Segments", bool(session.rows(LIST)), partial(segments_panel, part)),
        ("robot", "Robot", True, partial(robot_panel, part)),
        ("material", "Silicone", False, partial(material_panel, part)),
        ("loads", "Gravity and tip load", False, partial(loads_panel, session)),
        ("obstacles", "Obstacles", bool(session.rows("obstacle")), partial(obstacles_panel, session)),
        ("coefficients", "Coefficients", False, partial(coefficients_panel, session)),
        ("solver", "Solver", False, partial(solver_panel, session)),
    ):
        panel = ui.expansion(label, value=opened).classes("w-full softnlp-panel")
        panel.props(f"dense header-class=font-semibold data-testid=panel-{name}")
        with panel:
            inside = ui.column().classes("w-full gap-2 pb-3")
        _when_open(panel, inside, build)
        panels[name] = panel
    return panels


def _when_open(panel: ui.expansion, inside: ui.element, build: Callable[[], None]) -> None:
    """Build what is inside a panel when it is first open, so that the page is there sooner."""
    built = False

    def look() -> None:
        nonlocal built
        if panel.value and not built:
            built = True
            with inside:
                build()

    panel.on_value_change(look)
    look()


def _view_buttons(view: RobotView) -> None:
    """Build what stands over the 3-D view."""

    async def picture() -> None:
        ui.download.content(await view.picture(), "softnlp.png", "image/png")

    with ui.row().classes("absolute top-2 right-2 gap-1 z-10"):
        for name, icon, words, act in (
            ("reset", "center_focus_strong", "Look at the robot from the start position", view.reset),
            ("trail", "timeline", "Forget the trail of the tip", view.clear_trail),
            ("picture", "photo_camera", "Save a picture", picture),
        ):
            control = button("", icon, f"view-{name}", act, "flat dense round").tooltip(words)
            control.props(f'aria-label="{words}"')


def _studies(stage: Stage, tabs: ui.tabs, chosen: str) -> None:
    """Build the study on the right; each is built when it is first opened."""
    built: set[str] = set()
    with ui.tab_panels(tabs, value=chosen, animated=False).classes("w-full bg-transparent") as panels:
        slots = {name: ui.tab_panel(name).classes("p-0") for name in (*STUDIES, SCENARIO)}

    def opened() -> None:
        name = str(panels.value)
        _, study, build = STUDIES.get(name, ("", None, scenario_tab))
        if study is not None:
            stage.session.choose(study)
        if name not in built:
            built.add(name)
            with slots[name]:
                tab_note(stage.session, study, name)
                build(stage)
        for tell in tuple(stage.turned):
            tell(name)

    panels.on_value_change(opened)
    opened()
