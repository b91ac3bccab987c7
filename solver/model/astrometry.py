"""Propagation of catalogue sources to an epoch: directions and position covariances.

Paper, Eqs. (exp:survey:alpha_p) to (exp:survey:sigma_delta_p), in vector form: uniform
space motion from a Julian epoch in TCB and parallax from the observer's barycentric
position, without aberration. Errors are in alpha* = alpha cos(dec) and delta.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.model.correlation import ASTROMETRY, correlation_matrices
from solver.model.directions import tangent_frame
from solver.units import DAYS_PER_JULIAN_YEAR, MJD_J2000, RAD_PER_DEG, RAD_PER_MAS


class Places(NamedTuple):
    """Positions of sources at one epoch.

    `frame` holds direction, east and north; `covariance` is that of (alpha*, delta), mas^2.
    """

    frame: Float[np.ndarray, "src 3 3"]
    covariance: Float[np.ndarray, "src 2 2"]


def propagate(
    catalogue: pd.DataFrame, mjd_tcb: float, observer_position: Float[np.ndarray, " 3"]
) -> Places:
    """Return positions of catalogue sources seen from `observer_position`, with covariances.

    Parameters
    ----------
    catalogue : `schema.CATALOGUE`
    mjd_tcb : epoch, MJD in TCB
    observer_position : barycentric, au
    """
    return Places(
        frames_at(catalogue, mjd_tcb, observer_position),
        _covariance(catalogue, years_since_epoch(catalogue, mjd_tcb), observer_position),
    )


def frames_at(
    catalogue: pd.DataFrame, mjd_tcb: float, observer_position: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "src 3 3"]:
    """Return direction, east and north of sources at an epoch; arguments as `propagate`.

    The uncertainty columns are not used and may be absent, as in a true catalogue.
    """
    years = years_since_epoch(catalogue, mjd_tcb)
    start = tangent_frame(catalogue["ra"].to_numpy(), catalogue["dec"].to_numpy())
    velocity = (
        catalogue["pmra"].to_numpy()[:, None] * start[:, 1]
        + catalogue["pmdec"].to_numpy()[:, None] * start[:, 2]
    )
    parallax = catalogue["parallax"].to_numpy()[:, None] * observer_position
    moved = start[:, 0] + RAD_PER_MAS * (years[:, None] * velocity - parallax)
    return tangent_frame(*sky_position(moved))


def sky_position(
    direction: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return right ascension in [0, 360) and declination, deg, of vectors of any length."""
    x, y, z = direction.T
    ra = np.mod(np.arctan2(y, x) / RAD_PER_DEG, 360.0)
    # `mod` rounds an angle just below zero up to 360.
    return np.where(ra < 360.0, ra, 0.0), np.arctan2(z, np.hypot(x, y)) / RAD_PER_DEG


def years_since_epoch(catalogue: pd.DataFrame, mjd_tcb: float) -> Float[np.ndarray, " src"]:
    """Return the Julian years from each source's reference epoch to an epoch, MJD in TCB."""
    julian_year = 2000.0 + (mjd_tcb - MJD_J2000) / DAYS_PER_JULIAN_YEAR
    return julian_year - catalogue["ref_epoch"].to_numpy()


def catalogue_covariance(catalogue: pd.DataFrame) -> Float[np.ndarray, "src 5 5"]:
    """Return the covariance of (alpha*, delta, parallax, pmra, pmdec) of each source, mas and yr.

    Parameters
    ----------
    catalogue : `schema.CATALOGUE`, errors and correlations
    """
    sigma = np.stack([catalogue[f"{name}_error"].to_numpy() for name in ASTROMETRY], axis=-1)
    return correlation_matrices(catalogue) * sigma[:, :, None] * sigma[:, None, :]


def jacobian_at(
    frame: Float[np.ndarray, "n 3 3"],
    years: Float[np.ndarray, " n"],
    observer_position: Float[np.ndarray, "n 3"] | Float[np.ndarray, " 3"],
) -> Float[np.ndarray, "n 2 5"]:
    """Return the derivatives of (alpha*, delta) with respect to the five astrometric parameters.

    Parameters
    ----------
    frame : direction, east and north of each source
    years : time since the epoch of the parameters
    observer_position : barycentric, au, one for all sources or one per source
    """
    jacobian = np.zeros((len(frame), 2, 5))
    jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1.0
    jacobian[:, :, 2] = -np.einsum(
        "nij,nj->ni", frame[:, 1:], np.broadcast_to(observer_position, (len(frame), 3))
    )
    jacobian[:, 0, 3] = jacobian[:, 1, 4] = years
    return jacobian


def _covariance(
    catalogue: pd.DataFrame,
    years: Float[np.ndarray, " src"],
    observer_position: Float[np.ndarray, " 3"],
) -> Float[np.ndarray, "src 2 2"]:
    """Propagate the 5 x 5 covariance of the catalogue to (alpha*, delta) at the epoch."""
    frame = tangent_frame(catalogue["ra"].to_numpy(), catalogue["dec"].to_numpy())
    jacobian = jacobian_at(frame, years, observer_position)
    return jacobian @ catalogue_covariance(catalogue) @ jacobian.transpose(0, 2, 1)
