"""Modes and the linear system of a robot as JSON, as rows of a table and as files for a control designer."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from softnlp.base.columns import MM
from softnlp.base.netcdf import Variable, file_bytes, said
from softnlp.dynamics.modes import Linear, Mode, Vibration
from softnlp.model.inputs import package_version, pressure_bar
from softnlp.results.document import document_head, plain
from softnlp.studies.modes import Modes

SHOWN = 12
"""How many modes are told of where no number is asked for."""
_SHARES = ("bending", "torsion", "extension")


def modes_document(found: Modes, title: str, conventions: str, count: int) -> dict[str, Any]:
    """Return modes as plain data; None in place of what there is none of."""
    known = found.found
    return {
        **document_head(title, "modes", conventions),
        "pressure_bar": pressure_bar(found.pressure),
        "status": found.status.value,
        "message": found.message,
        "warnings": list(found.warnings),
        "stable": None if known is None else known.stable,
        "tip_position_mm": None if known is None else plain(MM.scale**-1 * known.tip),
        "residual": None if known is None else plain(known.residual),
        "modes": [] if known is None else [_mode(mode) for mode in known.modes[:count]],
    }


def _mode(mode: Mode) -> dict[str, Any]:
    return {
        "frequency_Hz": mode.frequency,
        "damping_ratio": mode.damping_ratio,
        "kind": mode.kind,
        "stable": mode.stable,
        "energy_share": dict(zip(_SHARES, plain(mode.shares), strict=True)),
        "tip_displacement": plain(mode.displacement[-1]),
    }


def modes_rows(found: Vibration, count: int) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of a table."""
    header = ["mode", "frequency_Hz", "damping_ratio", "kind", "tip x", "y", "z"]
    rows = [
        [
            str(k + 1),
            f"{mode.frequency:.4f}",
            f"{mode.damping_ratio:.4f}",
            mode.kind + ("" if mode.stable else " (buckles)"),
            *(f"{x:.3f}" for x in mode.displacement[-1] + 0.0),
        ]
        for k, mode in enumerate(found.modes[:count])
    ]
    return header, rows


def matrices(linear: Linear) -> dict[str, Any]:
    """Return A, B, C, D and the names of states, inputs and outputs, as NumPy and MATLAB files hold them."""
    names = {name: np.array(getattr(linear, name), dtype=object) for name in ("states", "inputs", "outputs")}
    return {**{name: getattr(linear, name) for name in "ABCD"}, **names}


def files(found: Modes, title: str, count: int) -> dict[str, bytes]:
    """Return modes.nc with shapes and matrices, linear.mat for MATLAB and linear.npz for NumPy, by name."""
    from scipy.io import savemat

    known = found.found
    assert known is not None
    held = matrices(known.linear)
    mat, npz = io.BytesIO(), io.BytesIO()
    savemat(mat, held)
    np.savez(npz, **{k: v if k in "ABCD" else v.astype(str) for k, v in held.items()})
    return {"modes.nc": _netcdf(found, known, title, count), "linear.mat": mat.getvalue(), "linear.npz": npz.getvalue()}


def _netcdf(found: Modes, known: Vibration, title: str, count: int) -> bytes:
    modes, linear = known.modes[:count], known.linear
    variables: dict[str, Variable] = {
        "frequency_Hz": (("mode",), [m.frequency for m in modes], said("Hz", "natural frequency")),
        "damping_ratio": (("mode",), [m.damping_ratio for m in modes], said("1", "damping ratio")),
        "kind": (("mode",), np.array([m.kind for m in modes], object), said("1", "where most of its energy is")),
        "energy_share": (("mode", "share"), [m.shares for m in modes], said("1", "share of the elastic energy")),
        "displacement": (
            ("mode", "s", "axis"),
            [m.displacement for m in modes],
            said("1", "displacement of the axis, world frame, scaled to a largest of 1"),
        ),
        "rotation": (
            ("mode", "point", "axis"),
            [m.rotation for m in modes],
            said("1/m", "rotation of the section at the Gauss points, world frame, in the same scale"),
        ),
    }
    of = {"A": ("state", "state_after"), "B": ("state", "input"), "C": ("output", "state"), "D": ("output", "input")}
    for name, dims in of.items():
        variables[name] = (dims, getattr(linear, name), said("1", f"{name} of x' = A x + B u, y = C x + D u, in SI"))
    coordinates: dict[str, Variable] = {
        "s": (("s",), known.place, said("1", "place on the segments' lengths together, the tip last")),
        "axis": (("axis",), list("xyz"), said("1", "axis")),
        "share": (("share",), list(_SHARES), said("1", "part of the elastic energy")),
        "state": (("state",), list(linear.states), said("1", "state")),
        "input": (("input",), list(linear.inputs), said("1", "input")),
        "output": (("output",), list(linear.outputs), said("1", "output")),
    }
    about = {
        "title": title,
        "study": "modes",
        "softnlp": package_version(),
        "pressure_bar": pressure_bar(found.pressure),
    }
    return file_bytes(variables, coordinates, about)
