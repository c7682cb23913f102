"""The stretch of the pose on the screen: the axial balance alone, without the rod."""

from __future__ import annotations

from collections.abc import Hashable

import casadi as ca
import numpy as np

from softnlp.app.session import Session
from softnlp.base.status import Status
from softnlp.model.quantities import quantities
from softnlp.statics.branch import branch_function, stretch_on_branch


class PoseStretch:
    """Gives the stretch of a session's pose; what is compiled is kept while robot and law are of the same kind."""

    def __init__(self, session: Session) -> None:
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
