"""What a sweep comes to: how many poses solved, how far they reach, what volume they fill, how dexterous they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softnlp.base.status import Status
from softnlp.statics.step import STABLE_FLAGS
from softnlp.sweep.boundary import Boundary, Reach, alpha_shape, convex_hull, reach
from softnlp.sweep.dexterity import Dexterity, dexterity
from softnlp.sweep.read import Workspace

_SPAN = 1e-9  # of the largest pressure: a column that varies less does not vary


@dataclass(frozen=True, eq=False)
class Summary:
    """A sweep in numbers.

    unstable, undefined : solved poses that are not stable, and whose stability is undefined. failed : poses of each
    status without a solution. worst_residual : of the solved poses. dexterity : None where no pose has a solution.
    parameters : how many independent pressures the poses vary.
    """

    poses: int
    solved: int
    unstable: int
    undefined: int
    self_intersecting: int
    failed: dict[Status, int]
    parameters: int
    reach: Reach
    hull: Boundary
    boundary: Boundary
    dexterity: Dexterity | None
    worst_residual: float


def summarise(workspace: Workspace, *, radius: float | None = None, voxel: float | None = None) -> Summary:
    """Return a sweep in numbers. radius : of the alpha shape [m]. voxel : edge of a voxel of the dexterity [m].

    Raises
    ------
    InputError
        As `dexterity`, for a voxel that is not a positive number.
    """
    solved = workspace.solved
    tips = workspace.tip_position[solved]
    count = parameters(workspace)
    residuals = workspace.residual[solved]
    return Summary(
        poses=workspace.poses,
        solved=len(tips),
        unstable=int(np.count_nonzero(workspace.stable[solved] == STABLE_FLAGS["unstable"])),
        undefined=int(np.count_nonzero(workspace.stable[solved] == STABLE_FLAGS["undefined"])),
        self_intersecting=int(np.count_nonzero(workspace.self_intersecting == 1)),
        failed={s: n for s in Status if not s.has_solution and (n := workspace.count(s))},
        parameters=count,
        reach=reach(tips),
        hull=convex_hull(tips, count),
        boundary=alpha_shape(tips, radius, parameters=count),
        dexterity=dexterity(tips, workspace.tip_axis[solved], voxel) if len(tips) else None,
        worst_residual=float(residuals.max()) if len(residuals) else float("nan"),
    )


def parameters(workspace: Workspace) -> int:
    """Return how many independent numbers the poses vary, at most 3.

    Pressures that vary together count once. A sweep that varies a load or a dimension as well counts as 3.
    """
    if varied_besides_pressure(workspace):
        return 3
    P = workspace.pressure[workspace.solved]
    if not len(P):
        return 0
    centred = P - P.mean(axis=0)
    spans = np.sqrt(np.maximum(np.linalg.eigvalsh(centred.T @ centred / len(P)), 0.0))
    return min(3, int(np.count_nonzero(spans > max(_SPAN, 1e-7) * max(float(np.abs(P).max()), 1.0))))


def varied_besides_pressure(workspace: Workspace) -> tuple[str, ...]:
    """Return the names of what differs between the poses of a sweep other than pressures."""
    varied = workspace.attributes.get("varied", [])
    names = varied.split() if isinstance(varied, str) else list(varied)
    return tuple(name for name in map(str, names) if name != "pressure")
