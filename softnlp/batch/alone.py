"""Single poses of a plan by the general solver, one after the other."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.blocked_lane import wall_of_plan
from softnlp.batch.plan import Plan
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model, with_symbols
from softnlp.model.rod import Loads
from softnlp.model.segments import SegmentedRobot, body_of
from softnlp.model.tip import TipContact
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.chain_grid import chain_equations
from softnlp.statics.chain_solver import ChainSolver
from softnlp.statics.compiled import rod_equations
from softnlp.statics.obstacle_solver import ObstacleSolver
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step

Array = NDArray[np.float64]


class Alone:
    """Solves single poses of a plan; what it compiles is made at the first one and kept."""

    def __init__(self, plan: Plan, numerics: Numerics) -> None:
        self.plan = plan
        self._numerics = numerics
        self.wall = None if plan.contact is None else wall_of_plan(plan, plan.contact)
        self._free: PoseSolver | None = None
        self._blocked: BlockedSolver | None = None

    def solve(self, column: Array, near: Any = None) -> tuple[Step, Any]:
        """Solve one pose, given by every quantity, from a neighbour where there is one."""
        model, pressure, loads = self._pose(column)
        plan = self.plan
        if plan.contact is None:
            self._free = self._free or self._solver()
            own = self._free.with_model(model)
            if plan.obstacles:
                # from the unpressurised shape: the neighbours in a chunk are not on the way to each other
                return ObstacleSolver(own, plan.obstacles).solve(pressure, loads)
            return own.solve(pressure, loads, near)
        if self._blocked is None:
            poses = self._solver(unloaded_accuracy=self._numerics.accuracy)
            wall = (TipContact(plan.contact.closure),)
            equations = rod_equations(plan.model, wall, by_machine=False, like=poses.equations)
            self._blocked = BlockedSolver(plan.model, self._numerics, plan.contact, poses=poses, equations=equations)
        # from zero pressure: the neighbours in a chunk are not on the way to each other
        return self._blocked.with_model(model).solve(pressure, loads, self.wall)

    def _solver(self, **settings: float) -> PoseSolver:
        """Return a solver whose numbers do not depend on what it has solved before."""
        if isinstance(self.plan.model.robot, SegmentedRobot):
            body = body_of(self.plan.model)
            rods = tuple(rod_equations(model, by_machine=False) for model in body.models)
            return ChainSolver(self.plan.model, self._numerics, equations=chain_equations(body, rods), **settings)
        equations = rod_equations(self.plan.model, by_machine=False)
        return PoseSolver(self.plan.model, self._numerics, equations=equations, **settings)

    def _pose(self, column: Array) -> tuple[Model, Array, Loads]:
        """Return the model, the pressures and the loads of one pose from every quantity."""
        values: dict[str, Any] = {}
        start = 0
        for name, nominal in self.plan.nominal.items():
            part = column[start : start + nominal.size]
            values[name] = float(part[0]) if nominal.size == 1 and name != "pressure" else part
            start += nominal.size
        model = self.plan.model
        named = model if isinstance(model.robot, SegmentedRobot) else with_symbols(model, values)
        return named, values["pressure"], Loads(values["tip_force"], values["tip_moment"], values["gravity"])
