"""Coordinates in which engines move: the units of the published code, or whitened ones.

In the former the posterior is extremely elongated: a pointing and the place of a detector can
move together by arcseconds, but each alone only by milliarcseconds. Whitened by the Cholesky
factor of the linearised problem (`solver.linear.source_elimination`), the posterior is a unit
sphere: a step of one is one sigma in every direction.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.linalg as sl
from jaxtyping import Array, Float

from solver.data.parameters import SOURCES
from solver.linear.source_elimination import ReducedSystem
from solver.model.forward import AnyArray
from solver.problem.parameter_vector import VectorLayout


class Curvature(eqx.Module):
    """Second-order term of the posterior along its weak directions.

    Attributes
    ----------
    weak : component of a displacement of the calibration along each weak direction, in sigmas
    calibration, sources : half the second derivatives of the conditional mode of the other
        parameters, by the components along two weak directions; without a component along
        the weak directions themselves
    """

    weak: Float[AnyArray, "weak calib"]
    calibration: Float[AnyArray, "weak weak calib"]
    sources: Float[AnyArray, "weak weak src 2"]

    def at(
        self, moved: Float[AnyArray, " calib"]
    ) -> tuple[Float[Array, " calib"], Float[Array, "src 2"]]:
        """Return the second-order correction to a displacement of the calibration."""
        along = self.weak @ moved
        both = jnp.outer(along, along)
        return jnp.tensordot(both, self.calibration, 2), jnp.tensordot(both, self.sources, 2)


class Coordinates(eqx.Module):
    """A change of coordinates of all parameters, of constant volume.

    theta = theta_0 + A u and s_i = s_0i + B_i (v_i - C_i' u), with A `calibration`,
    B `source` and C `shared`; u and v are the free coordinates of calibration and sources.
    With a `curvature`, its correction is added to both.

    Attributes
    ----------
    origin : calibration and sources where the free coordinates are zero
    log_volume : logarithm of the volume of one unit of all free coordinates
    """

    origin: tuple[Float[AnyArray, " calib"], Float[AnyArray, "src 2"]]
    calibration: Float[AnyArray, "calib calib"]
    shared: Float[AnyArray, "calib 2 src"]
    source: Float[AnyArray, "2 2 src"]
    log_volume: Float[AnyArray, ""]
    curvature: "Curvature | None" = None

    def place(
        self, free_theta: Float[AnyArray, " calib"], free_sources: Float[AnyArray, "2 src"]
    ) -> tuple[Float[AnyArray, " calib"], Float[AnyArray, "src 2"]]:
        """Return calibration and sources, in offsets, from free coordinates."""
        rows = jnp.reshape(self.shared, (len(free_theta), -1))
        v = free_sources - jnp.reshape(free_theta @ rows, free_sources.shape)
        sources = jnp.stack([self.source[a, 0] * v[0] + self.source[a, 1] * v[1] for a in (0, 1)])
        moved = self.calibration @ free_theta, sources.T
        if self.curvature is not None:
            moved = tuple(a + b for a, b in zip(moved, self.curvature.at(moved[0]), strict=True))
        return self.origin[0] + moved[0], self.origin[1] + moved[1]

    def covariance(self, scale: Float[np.ndarray, "2 src"]) -> Float[np.ndarray, "src 2 2"]:
        """Return the covariance of each source if its free coordinates scatter by `scale`."""
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
    """Return the published code's coordinates: degrees and micrometres, without mixing."""
    n_src = len(at[1])
    unit = np.empty(layout.size)
    for group in layout.groups:
        unit[layout.columns(group)] = group.per_value_unit
    source = SOURCES.per_value_unit * np.eye(2)[:, :, None] * np.ones(n_src)
    return Coordinates(
        at,
        np.diag(unit),
        np.zeros((layout.size, 2, n_src)),
        source,
        np.array(np.log(unit).sum() + 2 * n_src * np.log(SOURCES.per_value_unit)),
    )
