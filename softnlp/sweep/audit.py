"""A sample of a sweep solved again by the general solver and closed by IPOPT, on the whole program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softnlp.base.status import Status
from softnlp.base.units import MILLIMETRE
from softnlp.batch.alone import Alone
from softnlp.batch.plan import Plan
from softnlp.batch.pose_lane import entries
from softnlp.batch.poses import STATUSES, Lane
from softnlp.model.segments import SegmentedRobot
from softnlp.sweep.journal import Journal

EVERY = 1000
"""One of so many poses that the batch solved is audited, counted through all chunks; at least one of a sweep."""


@dataclass(frozen=True)
class Audit:
    """What IPOPT said of a sample.

    Attributes
    ----------
    audited
        How many poses.
    largest
        Distance between the tips of the batch and of the general solver [m].
    disputed
        The numbers of the poses, from 1, that it does not confirm.
    """

    audited: int = 0
    largest: float = 0.0
    disputed: tuple[int, ...] = ()

    @property
    def attributes(self) -> dict[str, float | int]:
        """What the result file says of it by name, numbers [1] and [mm]; nothing where nothing was audited."""
        return {"audited": self.audited, "audit_largest_mm": self.largest / MILLIMETRE} if self.audited else {}


def audit(plan: Plan, journal: Journal, stop: Callable[[], bool] | None = None) -> Audit | None:
    """Audit the poses that were solved together, or return None where it was stopped. Only with the engine "auto"."""
    if plan.numerics.engine != "auto":
        return Audit()
    # poses of several segments and among obstacles are all solved one by one
    chained = isinstance(plan.model.robot, SegmentedRobot) or bool(plan.obstacles)
    solver: Alone | None = None
    solved = STATUSES.index(Status.SOLVED)
    audited, largest, disputed, ahead = 0, 0.0, [], 0  # ahead : how many solved poses come before the next audited one
    for block in journal.blocks():
        rows = block.rows[(chained | (block.rows["lane"] == Lane.BATCH)) & (block.rows["status"] == solved)]
        chosen = rows[ahead::EVERY]
        ahead += EVERY * chosen.size - rows.size
        for row in chosen:
            if stop is not None and stop():
                return None
            solver = solver or Alone(plan, plan.numerics)
            number = int(row["pose"])
            column = plan.full_values(np.array([number]))[:, 0]
            step, _ = solver.solve(column)
            audited += 1
            away = np.inf if step.pose is None else float(np.linalg.norm(step.pose.tip_position - row["tip_position"]))
            length = plan.model.length if chained else float(column[entries(plan, "robot.length")][0])
            if not away <= plan.numerics.accuracy * length:
                disputed.append(number + 1)
            largest = max(largest, away)
    return Audit(audited, largest, tuple(disputed))
