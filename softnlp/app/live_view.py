"""The pose on the screen follows the controls: the newest wish is solved, those in between are left out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable

import casadi as ca
import numpy as np
from nicegui import background_tasks, ui
from numpy.typing import NDArray

from softnlp.app.asking import bars, sentence
from softnlp.app.inputs import Inputs
from softnlp.app.session import Stage
from softnlp.app.theme import Redraw
from softnlp.app.view import frame_of
from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.model.quantities import quantities
from softnlp.results import body_of_pose
from softnlp.scenario.data import run_of
from softnlp.scenario.read import Scenario
from softnlp.statics.branch import branch_function, stretch_on_branch
from softnlp.statics.step import Pose, Run, Step
from softnlp.statics.wall import Wall

Array = NDArray[np.float64]


_PATIENCE_S = 0.6  # of a person, before the page says that it works
_AMONG_OBSTACLES_S = 0.15  # where a pose always takes long
_SOLVING = "Solving …"
_NUMBERS_AFTER_S = 0.04


class LiveView:
    """Solves the pose of the session in a thread whenever it changes, and hands it to the view and the panels.

    shown : called with each run of one step. say : called with a line about what is not shown, "" when all is well, and
    whether the picture is not of the controls.
    """

    def __init__(self, stage: Stage, shown: Callable[[Run], None], say: Callable[[str, bool], None]) -> None:
        self._stage = stage
        self._say = say
        self._words, self._stale = "", False
        self._wanted = False
        self._working = False
        self._last: tuple[Scenario, Array] | None = None
        self._client = ui.context.client
        # The panels get the numbers a moment after the picture, which they would hold up in the browser.
        self._tell = Redraw(self._client.content, lambda: shown(self._run), _NUMBERS_AFTER_S)
        stage.session.on_scenario(self.request)
        stage.session.on_pressure(self.request)

    def request(self) -> None:
        """Ask for the pose of the session as it is now."""
        self._wanted = True
        if not self._working:
            self._working = True
            background_tasks.create(self._work(), name="live pose")

    async def _work(self) -> None:
        try:
            while self._wanted and not self._client.is_deleted:
                self._wanted = False
                await self._once()
        finally:
            self._working = False

    async def _once(self) -> None:
        session = self._stage.session
        scenario, pressure = session.scenario, session.pressure.copy()
        if scenario is None or len(pressure) != scenario.robot.chamber_sets:
            return
        solve = session.live.blocked if scenario.study == "blocked-force" else session.live.pose
        task = asyncio.create_task(asyncio.to_thread(solve, scenario, pressure))
        patience = _PATIENCE_S if not scenario.obstacles else _AMONG_OBSTACLES_S
        if not (await asyncio.wait({task}, timeout=patience))[0]:
            with self._client:
                self._say(_SOLVING, True)
            await asyncio.wait({task})
            with self._client:
                self._say(self._words, self._stale)
        try:
            run, ghost = await task
        except InputError as error:
            with self._client:
                about = "obstacles: " if error.table == "obstacle" else ""  # of them all, whose words do not name them
                self._said(sentence(about + error.message), True)
            return
        with self._client:
            step = run.steps[0]
            if not step.status.has_solution and self._stays(scenario, pressure):
                assert self._last is not None
                self._said(f"{sentence(step.message)} The sliders stay at {bars(self._last[1], 3)} bar.")
                session.set_pressure(self._last[1])
                return
            if step.pose is not None and step.status.has_solution:
                self._show(scenario, pressure, step, step.pose, ghost)
            else:
                self._said(f"{sentence(step.message)} Grey: the last pose that was solved.", True)
        self._run = run
        self._tell()

    def _said(self, words: str, stale: bool = False) -> None:
        """Say words that stay when a later pose takes long. stale : whether the picture is not of the controls."""
        self._words, self._stale = words, stale
        self._say(words, stale)

    def play(self, scenario: Scenario, step: Step) -> None:
        """Show a step of a motion in place of the pose of the controls, until these change."""
        if step.pose is None:
            return
        self._draw(scenario, step.pressure, step, step.pose, None)
        self._run = run_of(scenario, [step])
        self._tell()

    def _show(self, scenario: Scenario, pressure: Array, step: Step, pose: Pose, ghost: Pose | None) -> None:
        if self._last is None or not np.array_equal(self._last[1], pressure) or self._last[0] is not scenario:
            self._said("")
        if self._last is not None and vars(self._last[0].robot) != vars(scenario.robot):
            self._stage.view.clear_trail()  # of another robot
        self._last = (scenario, pressure)
        self._draw(scenario, pressure, step, pose, ghost)

    def _draw(self, scenario: Scenario, pressure: Array, step: Step, pose: Pose, ghost: Pose | None) -> None:
        loads, contact = scenario.loads, step.contact
        stands = contact is not None and contact.normal.any()  # else the chambers alone are held
        self._stage.view.show(
            frame_of(
                scenario.robot,
                body_of_pose(pose),
                pressure,
                ghost=None if ghost is None else body_of_pose(ghost),
                tip_force=loads.tip_force,
                tip_moment=loads.tip_moment,
                gravity=loads.gravity,
                wall=Wall(contact.wall_point, contact.normal) if contact is not None and stands else None,
                wall_force=0.0 if contact is None else contact.force,
                tip_cap=0.0 if contact is None else contact.tip_cap,
                contacts=step.contacts,
            )
        )

    def _stays(self, scenario: Scenario, pressure: Array) -> bool:
        """Whether only the pressures changed since the last pose that was solved, so that they can go back there."""
        return self._last is not None and self._last[0] is scenario and not np.array_equal(self._last[1], pressure)


class PoseStretch:
    """Gives the stretch of a session's pose; what is compiled is kept while robot and law are of the same kind."""

    def __init__(self, session: Inputs) -> None:
        self._session = session
        self._kind: Hashable = None
        self._branch: ca.Function | None = None

    def __call__(self) -> float | None:
        """Return lambda at the pressures shown, as Eq. (23) gives it; None where there is no such equilibrium."""
        scenario, pressure = self._session.scenario, self._session.pressure
        if scenario is None or len(pressure) != scenario.robot.chamber_sets:
            return None
        model = scenario.model
        if self._branch is None or self._kind != model.kind:
            self._branch, self._kind = branch_function(model), model.kind
        nominal = {name: q.nominal for name, q in quantities(model).items()} | {"pressure": pressure}
        point = stretch_on_branch(self._branch, np.concatenate([np.ravel(v) for v in nominal.values()]), pressure)
        return point.stretch if point.status is Status.SOLVED else None
