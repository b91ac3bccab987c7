"""Coordinates in which engines move: the groups' own units, or whitened by the solver.

In the units of the groups the posterior is hopelessly long and thin: a pointing and the place
of a detector may move together by arcseconds where each alone may by milliarcseconds. Whitened
by the Cholesky factor of the linearised problem (`solver.linear.source_elimination`), it is a
sphere of radius one: a step of one is one sigma in every direction.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.linalg as sl
from jaxtyping import Array, Float

from solver.data.parameters import CALIBRATION_GROUPS, SOURCES
from solver.linear.source_elimination import ReducedSystem
from solver.model.forward import AnyArray
from solver.problem.parameter_vector import VectorLayout


class Curvature(eqx.Module):
    """How the posterior bends along its weak directions, to second order.

    Attributes
    ----------
    weak : how far a displacement of the calibration leads along each weak direction
    calibration, sources : the second derivatives of where all else settles, by twice the
        displacements along two of them; they have no part in the weak directions
    """

    weak: Float[AnyArray, "weak calib"]
    calibration: Float[AnyArray, "weak weak calib"]
    sources: Float[AnyArray, "weak weak src 2"]

    def at(
        self, moved: Float[AnyArray, " calib"]
    ) -> tuple[Float[Array, " calib"], Float[Array, "src 2"]]:
        """Return what is to be added to a displacement of the calibration."""
        along = self.weak @ moved
        both = jnp.outer(along, along)
        return jnp.tensordot(both, self.calibration, 2), jnp.tensordot(both, self.sources, 2)


class Coordinates(eqx.Module):
    """A change of coordinates of all parameters, of constant volume.

    theta = theta_0 + A u and s_i = s_0i + B_i (v_i - C_i' u), with A `calibration`,
    B `source` and C `shared`; u and v are the free coordinates of calibration and sources.
    To both is added what `bend` says.

    Attributes
    ----------
    origin : where the free coordinates are zero, calibration and sources
    log_volume : logarithm of the volume of one unit of all free coordinates
    """

    origin: tuple[Float[AnyArray, " calib"], Float[AnyArray, "src 2"]]
    calibration: Float[AnyArray, "calib calib"]
    shared: Float[AnyArray, "calib 2 src"]
    source: Float[AnyArray, "2 2 src"]
    log_volume: Float[AnyArray, ""]
    bend: "Curvature | None" = None

    def place(
        self, of_theta: Float[AnyArray, " calib"], of_sources: Float[AnyArray, "2 src"]
    ) -> tuple[Float[AnyArray, " calib"], Float[AnyArray, "src 2"]]:
        """Return calibration and sources, in offsets, of free coordinates."""
        rows = jnp.reshape(self.shared, (len(of_theta), -1))
        v = of_sources - jnp.reshape(of_theta @ rows, of_sources.shape)
        sources = jnp.stack([self.source[a, 0] * v[0] + self.source[a, 1] * v[1] for a in (0, 1)])
        moved = self.calibration @ of_theta, sources.T
        if self.bend is not None:
            moved = tuple(a + b for a, b in zip(moved, self.bend.at(moved[0]), strict=True))
        return self.origin[0] + moved[0], self.origin[1] + moved[1]

    def covariance(self, scale: Float[np.ndarray, "2 src"]) -> Float[np.ndarray, "src 2 2"]:
        """Return the covariance of each source whose free coordinates scatter by `scale`."""
        half = np.asarray(self.source) * scale
        return np.einsum("aks,bks->sab", half, half)


def whitened(reduced: ReducedSystem) -> Coordinates:
    """Return coordinates in which the linearised posterior has unit covariance.

    theta = theta_0 + R^-1 u and s_i = s_0i + L_i'^-1 (v_i - (R'^-1 Z)_i' u).
    """
    factor = reduced.source_factor
    inverse = np.zeros((2, 2, len(factor)))
    inverse[0, 0], inverse[1, 1] = 1.0 / factor[:, 0, 0], 1.0 / factor[:, 1, 1]
    inverse[0, 1] = -factor[:, 1, 0] * inverse[0, 0] * inverse[1, 1]
    return Coordinates(
        reduced.at,
        sl.solve_triangular(reduced.factor, np.eye(len(reduced.factor))),
        reduced.spread()[:, :, reduced.source_blocks.position],
        inverse,
        np.array(-0.5 * reduced.log_determinant()),
    )


def in_bare_units(
    layout: VectorLayout, at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]
) -> Coordinates:
    """Return the published code's coordinates: degrees and micrometres, each on its own."""
    n_src = len(at[1])
    unit = np.empty(layout.size)
    for group in CALIBRATION_GROUPS:
        unit[layout.columns(group)] = group.per_value_unit
    source = SOURCES.per_value_unit * np.eye(2)[:, :, None] * np.ones(n_src)
    return Coordinates(
        at,
        np.diag(unit),
        np.zeros((layout.size, 2, n_src)),
        source,
        np.array(np.log(unit).sum() + 2 * n_src * np.log(SOURCES.per_value_unit)),
    )
