"""From a solution of a load case to a pose in SI units: shape, strains, internal force and moment, warnings."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model import rod
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.nlp.transcription import RK4, rk_step
from softnlp.statics.loadcase import RodFunctions, unpack_section
from softnlp.statics.step import Pose, Shape

Array = NDArray[np.float64]

SHAPE_POINTS = 61
LEAST_STRAIN, MOST_STRAIN = 0.5, 2.0
"""Strains v_z by loads outside these are told of: the stiffness is that at the stretch from pressure alone."""

_SHAPE = np.linspace(0, 1, SHAPE_POINTS)
_SUBSTEPS = 4  # to a point between nodes; 1 where the strains are dear
# Of the bending angle's quadrature.
_SAMPLES, _ZOOMS, _MOST_PARTS = 6, 12, 225
_ENDS = (1 - np.cos(np.pi * np.arange(_SAMPLES) / (_SAMPLES - 1))) / 2  # Chebyshev points, 0 and 1 among them
_MEAN = np.full(_SAMPLES, 1 / _SAMPLES)
_TO_POWERS = np.linalg.inv(np.vander(_ENDS, increasing=True))
_GRADES = np.append(0.0, 0.5 ** np.arange(16, -1, -1))  # from the least outwards
_GRADED_GAUSS = np.polynomial.legendre.leggauss(4)
_LITTLE = 0.25  # change of a curvature over its mean, up to which a quadrature without grades is at round-off
_GAUSS = tuple(part / 2 + middle for part, middle in zip(np.polynomial.legendre.leggauss(12), (0.5, 0.0), strict=True))
_TO_GAUSS = (np.vander(_GAUSS[0], _SAMPLES, increasing=True) @ _TO_POWERS).T  # from samples to its points


def shape_function(functions: RodFunctions) -> ca.Function:
    """Return (state, c, h) -> [state a step h further, strains (v, u), n, m], scaled.

    n and m are the paper's, of the wall alone.
    """
    field = functions.field
    x, c, h = ca.SX.sym("x", field.size1_in(0)), ca.SX.sym("c", field.size1_in(1)), ca.SX.sym("h")
    step = rk_step(field, RK4)
    end, substeps = x, 1 if functions.model.section.coupled else _SUBSTEPS
    for _ in range(substeps):
        end = step(end, c, h / substeps)
    every = ca.vertcat(end, *functions.strains(end[: rod.STATE_SIZE], c), *functions.resultants(end, c))
    return ca.Function("shape", [x, c, h], [every])


class Mapped(Protocol):
    """What `shape_function` returns, or the same in machine code."""

    def __hash__(self) -> int:
        """Return what tells it from others."""

    def map(self, n: int) -> Callable[..., Any]:
        """Return what takes n columns of states, the constants and n steps (1, n)."""
        ...


def between_nodes(function: Mapped, nodes: Array, constants: Array, s: Array) -> Array:
    """Evaluate `shape_function` at any s in 0..1 from the node to its left; (30, len(s))."""
    K = nodes.shape[1] - 1
    left = np.minimum(np.floor(s * K + 1e-9).astype(int), K)
    return np.asarray(function.map(s.size)(nodes[:, left], constants, (s - left / K)[None, :]))


def shape_and_bend(
    function: Mapped, nodes: Array, constants: Array, *, fine: bool = False
) -> tuple[Array, Array, float]:
    """Return s of the shape's points (M,), what `between_nodes` gives there, and `bending_angle`, of a uniform rod.

    fine : whether the grid was refined to an accuracy, so that half as many parts as intervals do for the angle.
    """
    K = _parts(nodes)
    K = -(-K // 2) if fine else K
    bend = _places(K)
    every = between_nodes(function, nodes, constants, np.concatenate([_SHAPE, bend]))
    length = float(unpack_section(constants).length)
    return _SHAPE, every[:, :SHAPE_POINTS], _turned(every[21:23, SHAPE_POINTS:], K) * length


def bending_angle(function: Mapped, nodes: Array, constants: Array, length: float | None = None) -> float:
    """Return the integral of sqrt(u_x^2 + u_y^2) over s [rad], to 1e-7 also where the curvature vanishes on the way.

    function : of `shape_function`. length : of the rod that its curvature is of, by default that in the constants.
    The curvature is smooth, its norm has a kink where it crosses zero, or nearly so. In
    every interval, or part of the rod where those are many, the curvature is the polynomial through `_SAMPLES` points.
    Where it changes little its norm is smooth too; elsewhere the quadrature of the norm is graded towards the point
    where that is smallest.
    """
    K = _parts(nodes)
    length = float(unpack_section(constants).length) if length is None else length  # in L_0
    return _turned(between_nodes(function, nodes, constants, _places(K))[21:23], K) * length


def _parts(nodes: Array) -> int:
    """Return into how many parts the quadrature of the bending angle cuts the rod."""
    return min(int(nodes.shape[1]) - 1, _MOST_PARTS)


@lru_cache(maxsize=16)
def _places(K: int) -> Array:
    """Return s of the samples in K parts and at the tip."""
    s = np.append(((np.arange(K)[:, None] + _ENDS[:-1]) / K).ravel(), 1.0)
    s.flags.writeable = False
    return s


@lru_cache(maxsize=16)
def _parts_of(K: int) -> NDArray[np.intp]:
    """Return where the samples of each part are (K, samples): the right end of one is the left end of the next."""
    return np.arange(K)[:, None] * (_SAMPLES - 1) + np.arange(_SAMPLES)


def _turned(u: Array, K: int) -> float:
    """Return the integral over s of the norm of a curvature (2, samples) at `_places`."""
    values = u[:, _parts_of(K)]
    middle = values @ _MEAN
    away = np.abs(values - middle[:, :, None])
    smooth = (away[0] + away[1]).max(axis=1) < _LITTLE * np.hypot(middle[0], middle[1])
    rest = 0.0
    if not smooth.all():
        rest = float(_graded(values[:, ~smooth]).sum())
        values = values[:, smooth]
    x, y = values @ _TO_GAUSS
    return (float((np.hypot(x, y) @ _GAUSS[1]).sum()) + rest) / K


def _graded(values: Array) -> Array:
    """Return the integrals over 0..1 of the norm of polynomials through values (2, k, samples), (k,)."""
    K = values.shape[1]
    if K == 0:
        return np.zeros(0)
    coefficients = np.einsum("ij,akj->aki", _TO_POWERS, values)

    def norm(at: Array) -> Array:
        """Return the norm at local coordinates (K, n) in 0..1."""
        found = np.zeros((2, *at.shape))
        for c in np.moveaxis(coefficients, 2, 0)[::-1]:
            found = found * at + c[:, :, None]
        size: Array = np.hypot(found[0], found[1])
        return size

    left, width = np.zeros(K), 1.0
    for _ in range(_ZOOMS):  # on the least of each interval
        at = left[:, None] + width * np.linspace(0, 1, 9)
        best = np.argmin(norm(at), axis=1)
        left, width = at[np.arange(K), np.clip(best - 1, 0, 6)], width / 4
    least = left + width / 2
    points, weights = _GRADED_GAUSS
    total = np.zeros(K)
    for reach in (least, least - 1.0):  # to the left end and to the right one
        middle = least[:, None] - reach[:, None] * (_GRADES[1:] + _GRADES[:-1]) / 2
        half = np.abs(reach)[:, None] * (_GRADES[1:] - _GRADES[:-1]) / 2
        at = middle[:, :, None] + half[:, :, None] * points
        total += np.sum(norm(at.reshape(K, -1)).reshape(at.shape) * half[:, :, None] * weights, axis=(1, 2))
    return total


def shape_of(values: Array, s: Array, length_unit: float, force_unit: float) -> Shape:
    """Return the shape in SI units from scaled states, strains, n and m (30, M)."""
    return Shape(
        arc=s,
        position=values[0:3].T * length_unit,
        rotation=values[3:12].T.reshape(-1, 3, 3).transpose(0, 2, 1),
        force=values[24:27].T * force_unit,
        moment=values[27:30].T * force_unit * length_unit,
        shear_extension=values[18:21].T,
        curvature=values[21:24].T / length_unit,
    )


def stability(loads: Loads, is_minimum: bool | None) -> bool | None:
    """Return whether a pose is stable, undefined (None) under a dead tip moment: in space that has no potential."""
    return None if np.any(loads.tip_moment) else is_minimum


def pose_of(
    model: Model, outputs: dict[str, Array], shape: Shape, bending: float, unloaded_tip: Array, stable: bool | None
) -> Pose:
    """Assemble a pose. outputs : of the load case, SI. unloaded_tip : tip at this pressure without loads [m].

    bending : of `bending_angle`, in place of the output, whose quadrature is of second order at a kink.
    stable : where it can be said: not of a rod that is compressed to nothing somewhere.
    """
    stretch = float(outputs["stretch"][0])
    R = np.asarray(outputs["tip_rotation"])
    tip = np.asarray(outputs["tip_position"])
    x, y, z = R[:, 2].tolist()
    return Pose(
        stretch=stretch,
        stable=None if shape.shear_extension[:, 2].min() <= 0 else stable,
        tip_position=tip,
        tip_displacement=tip - unloaded_tip,
        tip_rotation=R,
        bending_angle=bending,
        tilt=math.atan2(math.hypot(x, y), z),
        backbone_length=float(outputs["backbone_length"][0]),
        chamber_length=np.atleast_1d(outputs["chamber_lengths"]),
        radii=model.section.outline(model.numbers, stretch),
        shape=shape,
    )


def pose_warnings(model: Model, pose: Pose) -> tuple[str, ...]:
    """Return what a designer should know of a solved pose: fitted range, touching chambers, stability, its body."""
    own, shape = model.section, pose.shape
    along = own.warnings_along(pose.stretch, shape.shear_extension, shape.curvature)
    return (*own.warnings(pose.stretch), *along, *shape_warnings(pose))


def shape_warnings(pose: Pose) -> tuple[str, ...]:
    """Return what to know of a pose whatever its section."""
    found = []
    if pose.fit.inside_out:
        found.append("the load compresses the rod to nothing somewhere (v_z <= 0); the model does not hold there")
    elif pose.stable is None:
        found.append(
            "stability is undefined: a dead tip moment in space has no potential, so there is no energy to be least"
        )
    along = pose.shape.shear_extension[:, 2]
    low, high = float(along.min()), float(along.max())
    if 0 < low < LEAST_STRAIN or high > MOST_STRAIN:
        found.append(
            f"the load strains the rod to {low if low < LEAST_STRAIN else high:.3g} of its length somewhere (v_z): the "
            "model takes that strain as small"
        )
    if pose.stable is False:
        found.append("this equilibrium is not stable: the real robot buckles away from it")
    return (*found, *pose.fit.warnings)
