"""One browser tab: the scenario on its screen, what reading it gave, and who wants to know of changes."""

from __future__ import annotations

import json
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.app.document import START, Document
from softnlp.app.history import State
from softnlp.app.live import LivePoses
from softnlp.app.taken import checked_content, plain_name
from softnlp.base.errors import InputError, located
from softnlp.base.reading import LARGEST_TOML, one_line, read_bytes, read_text, shown
from softnlp.base.units import BAR
from softnlp.model.outlined import require_round_layout
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.read import Scenario, load_scenario, placed, scenario_from_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softnlp.app.view import RobotView
    from softnlp.statics.step import Step

Array = NDArray[np.float64]
Listener = Callable[[], None]

_POSES = {"forward", "blocked-force"}  # studies of which the page shows the pose
_MOST_KEPT = 2_000_000  # characters of files; a browser keeps some five million for a tab


def _fields(study: str) -> tuple[str, ...]:
    """Return the keys and tables that a scenario of a study may have."""
    return tuple(SCHEMAS[study].model_fields) if study in SCHEMAS else ()


class Session:
    """The state of one tab. Controls call `change`, `set_pressure`, `open`; panels listen and draw what is there.

    document : what is on the screen, also where it does not make sense yet. scenario : what the last text that did
    says, SI. problem : why the text does not, or None; it names table and key. pressure : (sets,) shown [Pa].
    follows_file : whether a saved file has the pressures of the opened one, or else the pose shown as its only step.
    """

    def __init__(self, text: str = START, name: str = "scenario.toml") -> None:
        """Start with a scenario; raises `InputError` where that cannot be read."""
        self._scratch = TemporaryDirectory(prefix="softnlp-")
        self.folder = Path(self._scratch.name)
        self.live = LivePoses()
        self._scenario_listeners: list[Listener] = []
        self._pressure_listeners: list[Listener] = []
        self.problem: InputError | None = None
        self.name = name
        self._start(Document(text))
        self._sound, self._stale = "", False
        self.follows_file = True
        self.scenario = self._read()
        self.pressure = self._last_pressure()

    def on_scenario(self, listener: Listener) -> None:
        """Call a function after each change of the scenario or of what is wrong with it."""
        self._scenario_listeners.append(listener)

    def on_pressure(self, listener: Listener) -> None:
        """Call a function after each change of the pressures of the pose shown."""
        self._pressure_listeners.append(listener)

    def open(self, text: str, name: str, files: Mapping[str, bytes] | None = None) -> None:
        """Show another scenario; `files` are those that it names, by their names.

        Raises
        ------
        InputError
            Where it cannot be read; the screen stays as it was.
        """
        name = PurePath(name).name or "scenario.toml"
        try:
            document = Document(text)
            given = {plain_name(key): checked_content(key, content) for key, content in (files or {}).items()}
            scenario = self._try(document, name, given)
        except InputError as error:
            raise placed(error, name) from None  # and not where it was tried
        for file, content in given.items():
            (self.folder / file).write_bytes(content)
        self._start(document)
        self.problem, self._sound, self._stale = None, document.text(), False
        self.scenario = replace(scenario, path=self.folder / name)
        self.name, self.follows_file = name, True
        self.pressure = self._last_pressure()
        self._tell(self._scenario_listeners)
        self._tell(self._pressure_listeners)

    def _start(self, document: Document) -> None:
        """Take over a document, as it was opened."""
        self.document = document
        self.opened_study = self._last_used = document.study
        self._used = {document.study}

    def _try(self, document: Document, name: str, given: Mapping[str, bytes]) -> Scenario:
        """Return what a document says with files read away from those of the screen, which stay as they were."""
        with TemporaryDirectory(prefix="softnlp-") as folder:
            for file in document.files():
                if PurePath(file).name != file:
                    raise InputError(f"expected the name of a file beside the scenario, got {shown(file)}", key="file")
                if file not in given and not (self.folder / file).exists():
                    raise InputError(f"names the file {shown(file)}; open both together", key="file")
                content = given[file] if file in given else (self.folder / file).read_bytes()
                (Path(folder) / file).write_bytes(content)
            found = scenario_from_text(document.text(), Path(folder) / name)
            require_round_layout(found.robot, "this page")
            return found

    def open_path(self, path: Path) -> None:
        """Show the scenario of a file, with the files that it names; raises `InputError` where one cannot be read."""
        asked = load_scenario(path)  # says the same of a broken file as the commands
        with located(source=one_line(str(path))):
            require_round_layout(asked.robot, "this page")
        document = Document(read_text(path, LARGEST_TOML))
        files = {}
        for file in document.files():
            try:
                files[PurePath(file).name] = read_bytes(path.parent / file)
            except InputError as error:
                raise InputError(f"{file}: {error.message}", source=one_line(str(path)), key="file") from None
        document.rename_files(lambda file: PurePath(file).name)
        self.open(document.source(), path.name, files)

    def keep(self, name: str, content: bytes) -> str:
        """Put a file beside the scenario and return the name it has there; raises `InputError` for one too large."""
        plain = plain_name(name)
        (self.folder / plain).write_bytes(checked_content(name, content))
        return plain

    def change(self, table: str, key: str, value: object) -> None:
        """Set a key of the scenario, or take it out for None; what is wrong with it then is in `problem`."""
        self._use_for(table)
        self.document.set(table, key, value)
        self.reread()

    def change_all(self, table: str, values: Mapping[str, object] | None) -> None:
        """Put these keys in place of a whole table's, or take it out for None."""
        self._use_for(table)
        self.document.replace(table, values)
        self.reread()

    def table(self, name: str) -> dict[str, Any]:
        """Return a table of the scenario as plain Python; empty where there is none."""
        return self.document.table(name)

    def rows(self, name: str) -> list[dict[str, Any]]:
        """Return a list of tables of the scenario, [[name]], as plain Python; empty where there is none."""
        return self.document.rows(name)

    def put_rows(self, name: str, rows: Sequence[Mapping[str, Any]]) -> None:
        """Put rows in place of a list of tables where they say something else."""
        if [dict(row) for row in rows] != self.rows(name):
            self._use_for(name)
            self.document.replace_rows(name, rows)
            self.reread()

    def takes(self, name: str) -> bool:
        """Whether the study on the screen has a table or a list of tables of a name."""
        return name in _fields(self.document.study)

    def put(self, table: str, values: Mapping[str, object]) -> None:
        """Put these keys in place of a whole table's where they say something else."""
        if values != self.table(table):
            self.change_all(table, values)

    def take_file(
        self, table: str, name: str, content: bytes, others: Mapping[str, object], refused: Callable[[InputError], bool]
    ) -> None:
        """Keep a file and name it in a table beside other keys; raises `InputError` and restores what is `refused`."""
        before = self.table(table)
        self.change_all(table, {**others, "file": self.keep(name, content)})
        if (problem := self.problem) is not None and refused(problem):
            self.change_all(table, before or None)
            raise InputError(problem.message)

    def follow(self, refresh: Listener) -> None:
        """Call a function now and after each change of the scenario."""
        refresh()
        self.on_scenario(refresh)

    def choose(self, study: str) -> None:
        """Turn to another study of the same robot."""
        if study in self._used:
            self._last_used = study
        if study != self.document.study:
            self.document.start(study)
            self.reread()

    @property
    def is_stale(self) -> bool:
        """Whether `scenario` is an earlier one, since what is on the screen makes no sense."""
        return self.problem is not None and self._stale

    @property
    def study(self) -> str:
        """The study of the file that is saved: that on the screen, once the file was of it or it was run or changed.

        One that a person only looks at leaves the file as it is, but for a pose at a wall: the page shows its numbers.
        """
        looked = self.document.study
        return looked if looked in self._used or {looked, self._last_used} <= _POSES else self._last_used

    def is_used(self, study: str) -> bool:
        """Whether the file was of a study, or it was run or changed; a look at it is not enough."""
        return study in self._used

    def use(self) -> None:
        """Make the study on the screen that of the file."""
        self._last_used = self.document.study
        self._used.add(self._last_used)

    def _use_for(self, table: str) -> None:
        """Make the study on the screen that of the file where a table changes that the file's study does not have."""
        if table and table not in _fields(self.study):
            self.use()

    def set_pressure(self, pressure: Array) -> None:
        """Show the pose at a pressure (sets,) [Pa]; from now on that is the one step of the scenario."""
        self.pressure = np.asarray(pressure, dtype=float)
        self.follows_file = False
        self._tell(self._pressure_listeners)

    def use_pressure(self, pressure: Array) -> None:
        """Show the pose at a pressure found for a robot, where this one has as many sets."""
        if len(pressure) == len(self.pressure):
            self.set_pressure(pressure)

    def show_step(self, index: int) -> None:
        """Show a step of the scenario's own pressures."""
        if self.scenario is not None and len(self.scenario.pressures):
            self.pressure = self.scenario.pressures[index % len(self.scenario.pressures)]
            self.follows_file = True
            self._tell(self._pressure_listeners)

    def text(self) -> str:
        """Return the scenario file of what is on the screen, of `study`."""
        document = Document(self.document.text(self.study))
        if self.follows_file or not document.table("pressure") or self.study == "dynamic":
            return document.text()  # over time the pose shown is but one of many
        document.replace("pressure", {"sequence_bar": [[float(f"{p / BAR:.12g}") for p in self.pressure]]})
        return document.text()

    @property
    def file_name(self) -> str:
        """The name of the file of `text`: that of the opened file, and another one for another study."""
        stem = self.name.removesuffix(".toml") or "scenario"
        return f"{stem}.toml" if self.study == self.opened_study else f"{stem}_{self.study}.toml"

    def left_out(self) -> list[str]:
        """Return the tables of the opened file's study that the file of `text` does not have."""
        written = Document(self.text())
        return [n for n in _fields(self.opened_study) if self.document.holds(n) and not written.holds(n)]

    def kept(self) -> str:
        """Return all that is on the screen as text, for `recall`."""
        kept: dict[str, Any] = {"name": self.name, "source": self.document.source(), "study": self.document.study}
        kept |= {"last_used": self._last_used, "used": sorted(self._used), "offered": sorted(self.document.offered)}
        sound = None if self.problem is None else self._sound  # what the picture shows meanwhile
        return json.dumps(kept | {"sound": sound, "pressure": None if self.follows_file else self.pressure.tolist()})

    def kept_files(self) -> str:
        """Return the files that the scenario names as text, for `recall`; without those that are too much to keep."""
        contents: dict[str, str] = {}
        for name in dict.fromkeys(self.document.files()):
            file = self.folder / name
            if file.is_file():
                contents[name] = b64encode(file.read_bytes()).decode()
        return json.dumps(contents if sum(map(len, contents.values())) <= _MOST_KEPT else {})

    def recall(self, text: str, files: str = "{}") -> None:
        """Show again what `kept` and `kept_files` returned; raises `InputError` where that cannot be read."""
        try:
            kept = json.loads(text)
            name, source, study, pressure = (kept[key] for key in ("name", "source", "study", "pressure"))
            used = {str(known) for known in kept.get("used", [])}
            contents = {str(key): b64decode(content) for key, content in json.loads(files).items()}
        except (ValueError, KeyError, TypeError, AttributeError):
            raise InputError("expected what a tab of this app had kept") from None
        sound = kept.get("sound")
        self.open(str(sound or source), str(name), contents)
        if sound:
            self.document = Document(str(source))
            self.document.study = str(study)
            self.reread()
        self.document.offered |= {str(name) for name in kept.get("offered", [])}
        self._used |= used & set(SCHEMAS)
        self.choose(str(study))
        self._last_used = str(kept["last_used"]) if kept.get("last_used") in self._used else self._last_used
        if pressure is not None and len(pressure) == len(self.pressure):
            self.set_pressure(np.asarray(pressure, dtype=float))

    def state(self) -> State:
        """Return what is on the screen, for a way back."""
        pressure = tuple(map(float, self.pressure))
        return State(self.document.own(), pressure, self.name, self.kept(), self.kept_files())

    def restore(self, state: State) -> None:
        """Show a state of this session again; the tab on the screen stays, and so do its files."""
        kept, looked = json.loads(state.kept), self.document.study
        for name, content in json.loads(state.files).items():
            (self.folder / plain_name(name)).write_bytes(b64decode(content))
        document = Document(str(kept["source"]))
        document.offered, document.sweeps_wall = set(kept["offered"]), self.document.sweeps_wall
        document.start(looked)
        self.document, self.name = document, state.name
        self._used, self._last_used = set(kept["used"]), str(kept["last_used"])
        self.follows_file = kept["pressure"] is None
        self.pressure = np.asarray(state.pressure)
        self.reread()
        self._tell(self._pressure_listeners)

    def asked(self) -> Scenario:
        """Return the scenario of `text`, as a run of the saved file would have it; raises `InputError`."""
        return scenario_from_text(self.text(), self.folder / self.name)

    def reread(self) -> None:
        """Read the document again, fit the pressures to the robot's sets, and tell who listens."""
        before = len(self.pressure)
        scenario = self._read()
        if scenario is not None:
            self.scenario = scenario
        sets = self.scenario.robot.chamber_sets if self.scenario is not None else before
        if sets != before:
            self.pressure = np.resize(np.append(self.pressure, np.zeros(sets)), sets)
        self._tell(self._scenario_listeners)

    def close(self) -> None:
        """Remove what the session kept on disk."""
        self._scratch.cleanup()

    def _read(self) -> Scenario | None:
        """Return what the document says; of a study that lacks something of its own, the pose without it."""
        self.problem = None
        self.document.fit_pressures()
        for study in dict.fromkeys((self.document.study, "forward")):
            try:
                text = self.document.text(study)
                scenario = scenario_from_text(text, self.folder / self.name)
                self._sound, self._stale = text, False
                return scenario
            except InputError as error:
                self.problem = self.problem or type(error)(error.message, table=error.table, key=error.key)
        self._stale = True
        return None

    def _last_pressure(self) -> Array:
        """Return the pressures of the last step, of which a sequence is read first."""
        if self.scenario is None:
            return np.zeros(3)
        if len(self.scenario.pressures):
            last: Array = self.scenario.pressures[-1]
            return last
        return np.zeros(self.scenario.robot.chamber_sets)

    @staticmethod
    def _tell(listeners: list[Listener]) -> None:
        for listener in tuple(listeners):
            listener()


@dataclass(frozen=True, eq=False)
class Stage:
    """What panels and tabs of one page share.

    session, view : its scenario and its 3-D view. figures : what draws what tabs have found, by title, for reports.
    plays : what shows a step of a motion in place of the pose of the controls.
    open_tab : turns to a tab by its name. turned : called with the name of each tab that is opened. asked : tabs that
    another one asks to begin once they are open.
    """

    session: Session
    view: RobotView
    figures: dict[str, Mapping[str, Callable[[], Figure]]] = field(default_factory=dict)
    plays: list[Callable[[Scenario, Step], None]] = field(default_factory=list)
    open_tab: Callable[[str], object] = str
    turned: list[Callable[[str], None]] = field(default_factory=list)
    asked: set[str] = field(default_factory=set)
