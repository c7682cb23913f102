"""Equilibrium of a section in generalised plane strain: stretched along the axis, and bent, with rigid thread rings.

A point X of the section as cast goes to x in the plane and its fibre to the stretch l = lambda + kappa . x: uniform
bending of a prism, exactly, as a section stays plane by symmetry. The energy, the sum of w(|F|^2, l) dA, is least under
l det F = 1, whose multipliers are the pressures. Nodes on a ring follow its place and turn; surfaces are free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from softnlp.model.energies import PlaneEnergy
from softnlp.rings.elements import elements
from softnlp.rings.freedom import Freedom
from softnlp.rings.mesher import Mesh
from softnlp.rings.outline import Array, PlaneSection, RingError

TOLERANCE = 1e-10  # of the largest residual, against modulus times size
_STEPS = 10  # of Newton's method


@dataclass(frozen=True)
class Balance:
    """A section in equilibrium.

    Attributes
    ----------
    stretch, curvature
        lambda [1] and (2,) kappa = (-u_2, u_1) of l = lambda + kappa . x [1/m].
    places
        (n, 2) where the nodes are [m].
    pressures
        (corners,) multipliers [Pa].
    rings
        (k, 3) centre [m] and turn [rad] of the rings, as of `Freedom`.
    slope
        Derivative of the free unknowns by lambda, from the last matrix of Newton's method.
    energy
        Per length of the part that is meshed [J/m], and its derivatives by
    force, moment
        lambda [N] and (2,) kappa [N m].
    square
        Mean of T = |F|^2 over the silicone [1].
    """

    stretch: float
    curvature: Array
    places: Array
    pressures: Array
    rings: Array
    slope: Array
    energy: float
    force: float
    moment: Array
    square: float


class Failed(Exception):
    """Newton's method did not reach the tolerance, or a triangle turned over."""


class Equilibrium:
    """The equations of one mesh and one law."""

    def __init__(self, section: PlaneSection, mesh: Mesh, energy: PlaneEnergy) -> None:
        self.mesh, self.law = mesh, energy
        self.elements = elements(mesh)
        if not self.elements.weight.min() > 0:
            raise RingError("the mesh of the section is too coarse for its curved outlines: take more layers")
        self.freedom = Freedom(section, mesh)
        self._size = section.outer.area**0.5
        _, w_T, _, w_TT, _, w_ll = (float(d[0]) for d in energy.derivatives(np.array([2.0]), np.array([1.0])))
        self._modulus = abs(2 * w_T) + abs(4 * w_TT) + abs(w_ll)
        self._rest_pressure = -2 * w_T
        # Pressures in these units make all entries of the matrix alike.
        self._units = np.ones(self.elements.unknowns)
        self._units[2 * len(mesh.nodes) :] = self._modulus / self._size

    def rest(self) -> Balance:
        """Return the section as cast."""
        rings = np.array([[*centre, 0.0] for _, centre, *_ in self.freedom.rings]).reshape(-1, 3)
        pressures = np.full(self.mesh.corners, self._rest_pressure)
        residual, matrix, by_stretch = self._assembled(1.0, np.zeros(2), self.mesh.nodes, pressures)
        free, lu = self._factored(residual, matrix, rings)
        return self._balance(1.0, np.zeros(2), self.mesh.nodes, pressures, rings, free, lu, by_stretch)

    def solve(
        self, guess: Balance, stretch: float, curvature: Sequence[float] = (0.0, 0.0), forces: Array | None = None
    ) -> Balance:
        """Return the equilibrium at a stretch and curvature, near a guess, which is led on along its slope.

        forces : (k, 2) in the plane, on each ring, per length as cast [N/m].

        Raises
        ------
        Failed
            Where Newton's method does not reach it.
        """
        kappa = np.array(curvature, float)
        step = guess.slope * (stretch - guess.stretch)
        state = self.freedom.moved(guess.places, guess.pressures, guess.rings, step)
        pushed = self.freedom.pushed(np.zeros((len(guess.rings), 2)) if forces is None else forces)
        free = lu = None
        for _ in range(_STEPS):
            residual, matrix, by_stretch = self._assembled(stretch, kappa, *state[:2])
            columns = self._units[:, None] * self.freedom.columns(state[2])
            right = columns.T @ residual - pushed
            error = float(np.abs(right).max()) / (self._modulus * self._size)
            if error < TOLERANCE and lu is not None:
                return self._balance(stretch, kappa, *state, free, lu, by_stretch)
            if not error < 1e6:
                raise Failed
            free, lu = self._factored(residual, matrix, state[2])
            state = self.freedom.moved(*state, -self._scaled(lu.solve(right)))
        raise Failed

    def densities(self, balance: Balance) -> Array:
        """Return the (m,) mean energy density of each triangle [Pa]."""
        *_, (w, *_) = self._fields(balance.stretch, balance.curvature, balance.places, balance.pressures)
        weight = self.elements.weight
        return np.asarray((weight * w).sum(axis=1) / weight.sum(axis=1))

    def _scaled(self, step: Array) -> Array:
        """Return a step of the free unknowns in their units [m, rad, Pa]."""
        step = step.copy()
        step[-self.mesh.corners :] *= self._units[-1]
        return step

    def _factored(self, residual: Array, matrix: csc_array, rings: Array) -> tuple[csc_array, Any]:
        """Return the columns of the free unknowns and the factors of the matrix of these."""
        free = csc_array(self._units[:, None] * self.freedom.columns(rings))
        turning = diags_array(self.freedom.turning(residual, rings))
        try:
            return free, splu(csc_array(free.T @ matrix @ free + turning))
        except RuntimeError as error:
            raise Failed from error

    def _fields(self, stretch: float, kappa: Array, places: Array, pressures: Array) -> Any:
        """Return the fields at all points: F, its cofactors, l, det F, pressure, and the law's derivatives."""
        el, triangles = self.elements, self.mesh.triangles
        x = places[triangles]
        F = np.einsum("mni,mqnj->mqij", x, el.gradient).reshape(*el.weight.shape, 4)
        line = stretch + (x @ kappa) @ el.shape.T
        cofactor = F[..., [3, 2, 1, 0]] * np.array([1.0, -1.0, -1.0, 1.0])
        det = F[..., 0] * F[..., 3] - F[..., 1] * F[..., 2]
        p = pressures[triangles[:, :3]] @ el.linear.T
        if not (np.all(det > 0) and np.all(line > 0)):
            raise Failed
        return F, cofactor, line, det, p, self.law.derivatives((F**2).sum(axis=2), line)

    def _assembled(
        self, stretch: float, kappa: Array, places: Array, pressures: Array
    ) -> tuple[Array, csc_array, Array]:
        """Return residual, its matrix, and its derivative by lambda, of all unknowns."""
        el = self.elements
        F, cofactor, line, det, p, (_, w_T, w_l, w_TT, w_Tl, w_ll) = self._fields(stretch, kappa, places, pressures)
        m, q = el.weight.shape
        weight = el.weight[..., None]
        # By (F, l): the slope and the curvature of w + p (l det F - 1), and the slope of l det F.
        slope, volume, H = np.empty((m, q, 5)), np.empty((m, q, 5)), np.empty((m, q, 5, 5))
        slope[..., :4] = 2 * w_T[..., None] * F + (p * line)[..., None] * cofactor
        slope[..., 4] = w_l + p * det
        volume[..., :4] = line[..., None] * cofactor
        volume[..., 4] = det
        H[..., :4, :4] = 4 * w_TT[..., None, None] * F[..., :, None] * F[..., None, :]
        H[..., :4, :4] += 2 * w_T[..., None, None] * np.eye(4)
        for i, j, sign in ((0, 3, 1.0), (3, 0, 1.0), (1, 2, -1.0), (2, 1, -1.0)):
            H[..., i, j] += sign * p * line
        H[..., :4, 4] = H[..., 4, :4] = 2 * w_Tl[..., None] * F + p[..., None] * cofactor
        H[..., 4, 4] = w_ll
        slope, volume, H = slope * weight, volume * weight, H * weight[..., None]

        B = np.zeros((m, q, 5, 12))
        B[..., 0:2, 0::2] = B[..., 2:4, 1::2] = np.swapaxes(el.gradient, 2, 3)
        B[..., 4, 0::2], B[..., 4, 1::2] = el.shape * kappa[0], el.shape * kappa[1]
        across = np.swapaxes(B.reshape(m, q * 5, 12), 1, 2)
        K = np.zeros((m, 15, 15))
        K[:, :12, :12] = across @ (H @ B).reshape(m, q * 5, 12)
        K[:, :12, 12:] = across @ (volume[..., None] * el.linear[:, None, :]).reshape(m, q * 5, 3)
        K[:, 12:, :12] = np.swapaxes(K[:, :12, 12:], 1, 2)
        residual, by_stretch = np.empty((m, 15)), np.empty((m, 15))
        residual[:, :12] = (across @ slope.reshape(m, q * 5, 1))[..., 0]
        residual[:, 12:] = (el.weight * (line * det - 1)) @ el.linear
        by_stretch[:, :12] = (across @ H[..., 4].reshape(m, q * 5, 1))[..., 0]
        by_stretch[:, 12:] = volume[..., 4] @ el.linear
        return el.vector(residual), el.matrix(K), el.vector(by_stretch)

    def _balance(
        self, stretch: float, kappa: Array, places: Array, pressures: Array, rings: Array,
        free: csc_array, lu: Any, by_stretch: Array,
    ) -> Balance:  # fmt: skip
        """Return the state with its energy, force and moment."""
        el = self.elements
        F, _, _, det, p, (w, _, w_l, *_) = self._fields(stretch, kappa, places, pressures)
        axial = el.weight * (w_l + p * det)
        x = np.einsum("qn,mni->mqi", el.shape, places[self.mesh.triangles])
        return Balance(
            stretch, kappa, places, pressures, rings,
            slope=-self._scaled(lu.solve(free.T @ by_stretch)),
            energy=float((el.weight * w).sum()),
            force=float(axial.sum()),
            moment=np.einsum("mq,mqi->i", axial, x),
            square=float((el.weight * (F**2).sum(axis=2)).sum() / el.weight.sum()),
        )  # fmt: skip
