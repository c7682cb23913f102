"""Workspaces of a robot without loads, whose poses are arcs in closed form, as files that a sweep would write."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.model.conventions import REPRODUCTION, Coefficients
from softnlp.model.inputs import coefficients_table, conventions_table, loads_table, material_table, robot_table
from softnlp.model.materials import material
from softnlp.model.quantities import Model, quantities
from softnlp.model.robot import robot
from softnlp.model.rod import Loads
from softnlp.statics.loadcase import rod_functions

MODEL = Model(robot("D25L60"), material("Ecoflex 00-50"), Coefficients(), REPRODUCTION)


@cache
def functions(model: Model = MODEL) -> Any:
    return rod_functions(model)


def arcs(pressures: np.ndarray, model: Model = MODEL) -> dict[str, np.ndarray]:
    """Return the arcs at (N, sets) pressures [Pa]: what a sweep keeps of them, SI.

    The stretch is the root of the balance that Newton reaches from 1, the shape the arc of the rod's own functions.
    """
    import casadi as ca

    made, N = functions(model), len(pressures)
    columns = []
    for name, q in quantities(model).items():
        columns.append(pressures.T if name == "pressure" else np.repeat(np.asarray(q.nominal)[:, None], N, axis=1))
    column = np.vstack(columns)
    c, stretch = ca.SX.sym("c", column.shape[0]), ca.SX.sym("l")
    balance = made.section(c, stretch)[1]
    newton = ca.Function("newton", [c, stretch], [balance, ca.jacobian(balance, stretch)])
    found = np.ones((1, N))
    for _ in range(12):
        value, slope = newton(column, found)
        found = found - np.asarray(value) / np.asarray(slope)
    L_0 = model.robot.length
    state = np.asarray(made.arc(column, found, 1.0))
    R = state[3:12].T.reshape(N, 3, 3).transpose(0, 2, 1)
    halfway = np.asarray(made.arc(column, found, 0.05))[3:12].T.reshape(N, 3, 3).transpose(0, 2, 1)[:, :, 2]
    turned = np.arctan2(np.hypot(halfway[:, 0], halfway[:, 1]), halfway[:, 2]) / 0.05  # of the whole arc
    length = found.ravel() * L_0
    toward = R[:, :2, 2] / np.maximum(np.hypot(*R[:, :2, 2].T), 1e-30)[:, None]  # the axis turns to (u_y, -u_x)
    centres = np.array(model.robot.chamber_centres(), float)
    stretched = centres @ toward.T * (turned / length / np.sqrt(found.ravel()))
    return {
        "stretch": found.ravel(),
        "tip_position": state[0:3].T * L_0,
        "tip_rotation": R,
        "bending_angle": turned,
        "chamber_length": length[:, None] * (1 - stretched.T),
    }


def grid(levels: int, to_bar: float = 1.2, sets: int = 3) -> np.ndarray:
    """Return pressures (levels^sets, 3) [Pa] of a grid; sets that are not swept stay at 0."""
    axes = [np.linspace(0, to_bar * BAR, levels)] * sets
    table = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, sets)
    return np.hstack([table, np.zeros((len(table), 3 - sets))])


def workspace_dataset(
    pressures: np.ndarray,
    *,
    failed: Mapping[int, str] = {},
    unstable: tuple[int, ...] = (),
    move: np.ndarray | None = None,
    model: Model = MODEL,
) -> xr.Dataset:
    """Return the dataset of a sweep over pressures [Pa].

    failed : statuses of poses without a solution. unstable : poses that are. move : added to the tips [m].
    """
    found, N = arcs(pressures, model), len(pressures)
    none = np.zeros(N, bool)
    none[list(failed)] = True

    def of(values: np.ndarray) -> np.ndarray:
        values = np.array(values, float)
        values[none] = np.nan
        return values

    tip = found["tip_position"] + (0 if move is None else move)
    axis = found["tip_rotation"][:, :, 2]
    stable = np.where(none, -1, 1).astype(np.int8)
    stable[list(unstable)] = 0
    status = np.array([failed.get(k, "solved") for k in range(N)], dtype=object)
    tilt = np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2])
    length = found["stretch"] * model.robot.length
    variables = {
        "pressure_bar": (("pose", "set"), pressures / BAR, {"units": "bar", "long_name": "gauge pressure of each set"}),
        "status": (("pose",), status, {"units": "1", "long_name": "how the pose ended"}),
        "tip_position_mm": (("pose", "axis"), of(tip) / MILLIMETRE, {"units": "mm", "long_name": "tip position"}),
        "tip_rotation": (("pose", "row", "col"), of(found["tip_rotation"]), {"units": "1"}),
        "bending_angle_deg": (
            ("pose",),
            of(found["bending_angle"]) / DEGREE,
            {"units": "degree", "long_name": "bending angle"},
        ),
        "tilt_deg": (("pose",), of(tilt) / DEGREE, {"units": "degree", "long_name": "angle between tip axis and +z"}),
        "stable": (("pose",), stable, {"units": "1", "long_name": "no conjugate point on the rod"}),
        "stretch": (("pose",), of(found["stretch"]), {"units": "1", "long_name": "axial stretch"}),
        "residual": (("pose",), np.where(none, 0.3, 1e-12), {"units": "1", "long_name": "largest equation error"}),
        "discretisation_error": (("pose",), of(np.full(N, 2e-8)), {"units": "1", "long_name": "estimated error"}),
        "backbone_length_mm": (("pose",), of(length) / MILLIMETRE, {"units": "mm", "long_name": "length of the axis"}),
        "chamber_length_mm": (("pose", "chamber"), of(found["chamber_length"]) / MILLIMETRE, {"units": "mm"}),
    }
    tables = {
        "robot": robot_table(model.robot),
        "material": material_table(model.material),
        "coefficients": coefficients_table(model.coefficients),
        "conventions_in_full": conventions_table(model.conventions),
        "loads": loads_table(Loads()),
    }
    attributes = {"title": "arcs", "study": "workspace", "conventions": "reproduction", "softnlp": "0"}
    attributes |= {name: json.dumps(table) for name, table in tables.items()}
    coordinates = {"set": [1, 2, 3], "axis": list("xyz"), "row": list("xyz"), "col": list("xyz")}
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)


def write_workspace(folder: Path, pressures: np.ndarray, **changes: Any) -> Path:
    """Write the `workspace.nc` of a sweep into a folder and return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    workspace_dataset(pressures, **changes).to_netcdf(folder / "workspace.nc", engine="h5netcdf")
    return folder
