"""How the frames of orbits differ, as the stars say that several of them measured.

The offset of star i in orbit k is A_ik q_i + B_i f_k and noise: its motion, and the polynomial
that the frame of the orbit follows. With the motions eliminated, the slopes of the likelihood
along the f_k are M f and noise of covariance M. Frames that all stars could follow together,
constant or as a motion is, do not show.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float, Int

from solver.data.run_schema import FRAME_DEGREES
from solver.model.apparent_motion import julian_year, motion_design
from solver.model.directions import places_about

# Stars in fewer orbits say little: their motion takes up what they have.
LEAST_ORBITS = 4
# Those in most orbits are taken, up to so many.
MOST_STARS = 3000
_AT_ONCE = 250
# Directions with less of the information than this share of the largest are nothing but rounding.
_LEAST_SHARE = 1e-7


class Frames(NamedTuple):
    """What the stars say about the frames of the orbits.

    Attributes
    ----------
    values : independent combinations of the frames with unit noise
    by_frame : their change with the coefficients of the frames, orbit after orbit
    n_stars : number of stars
    """

    values: Float[np.ndarray, " row"]
    by_frame: Float[np.ndarray, "row coef"]
    n_stars: int


def compare_frames(
    history: pd.DataFrame, orbits: Int[np.ndarray, " orbit"], centre: tuple[float, float]
) -> Frames:
    """Return what the stars say about the frames of orbits.

    Parameters
    ----------
    history : `survey_schema.HISTORY` of the orbits; reference stars are left out
    orbits : orbit_id of the orbits, in order
    centre : of the polynomials, deg
    """
    rows = _chosen(history[~history["is_reference"]])
    n_coef = len(orbits) * 2 * len(FRAME_DEGREES)
    slopes, matrix = np.zeros(n_coef), np.zeros((n_coef, n_coef))
    ids = rows["source_id"].unique()
    for first in range(0, len(ids), _AT_ONCE):
        part = rows[rows["source_id"].isin(ids[first : first + _AT_ONCE])]
        more_slopes, more_matrix = _slopes(part, orbits, centre)
        slopes += more_slopes
        matrix += more_matrix
    if not len(ids):
        return Frames(np.zeros(0), np.zeros((0, n_coef)), 0)
    values, vectors = np.linalg.eigh(matrix)
    known = values > _LEAST_SHARE * values[-1]
    root = np.sqrt(values[known])
    return Frames(vectors[:, known].T @ slopes / root, (vectors[:, known] * root).T, len(ids))


def _chosen(rows: pd.DataFrame) -> pd.DataFrame:
    counts = rows["source_id"].value_counts()
    often = counts[counts >= LEAST_ORBITS].index[:MOST_STARS]
    return rows[rows["source_id"].isin(often)].sort_values(["source_id", "orbit_id"])


def _slopes(
    rows: pd.DataFrame, orbits: Int[np.ndarray, " orbit"], centre: tuple[float, float]
) -> tuple[Float[np.ndarray, " coef"], Float[np.ndarray, "coef coef"]]:
    """Return the slopes of the likelihood of some stars along all frames, and their matrix."""
    ids, star = np.unique(rows["source_id"].to_numpy(), return_inverse=True)
    orbit = np.searchsorted(orbits, rows["orbit_id"].to_numpy())
    ra, dec, epochs = rows[["ra", "dec", "epoch"]].to_numpy().T
    design = motion_design(ra, dec, epochs, float(julian_year(epochs).mean()))
    weight = np.zeros((len(ids), len(orbits), 2, 2))
    weight[star, orbit] = np.linalg.inv(_conditional(rows))
    motion, offset = np.zeros((len(ids), len(orbits), 2, 5)), np.zeros((len(ids), len(orbits), 2))
    motion[star, orbit] = design
    offset[star, orbit] = rows[["offset_ra", "offset_dec"]].to_numpy()
    weighted = np.einsum("skab,skbp->skap", weight, motion)
    normal = np.einsum("skap,skaq->spq", motion, weighted)
    scale = 1.0 / np.sqrt(np.diagonal(normal, axis1=1, axis2=2))
    # Some orbits leave combinations of the motion free.
    inverse = np.linalg.pinv(
        normal * scale[:, :, None] * scale[:, None, :], rcond=1e-10, hermitian=True
    )
    inverse *= scale[:, :, None] * scale[:, None, :]
    taken = np.einsum("skap,spq->skaq", weighted, inverse)
    left = np.einsum("skab,skb->ska", weight, offset)
    left -= np.einsum("skap,slbp,slb->ska", taken, weighted, offset, optimize=True)
    projected = -np.einsum("skap,slbp->skalb", taken, weighted, optimize=True)
    index = np.arange(len(orbits))
    projected[:, index, :, index] += weight.swapaxes(0, 1)
    first = np.unique(star, return_index=True)[1]
    at = places_about(centre, ra[first], dec[first])
    monomials = np.array([at[:, 0] ** i * at[:, 1] ** j for i, j in FRAME_DEGREES]).T
    slopes = np.einsum("ska,sm->kam", left, monomials).ravel()
    products = np.einsum("sm,sn->smn", monomials, monomials).reshape(len(ids), -1)
    flat = projected.reshape(len(ids), -1).T @ products
    n, n_monomials = len(orbits), monomials.shape[1]
    matrix = flat.reshape(n, 2, n, 2, n_monomials, n_monomials).transpose(0, 1, 4, 2, 3, 5)
    return slopes, matrix.reshape(len(slopes), -1)


def _conditional(rows: pd.DataFrame) -> Float[np.ndarray, "row 2 2"]:
    sigma = rows[["sigma_ra_conditional", "sigma_dec_conditional"]].to_numpy()
    covariance = sigma[:, :, None] * sigma[:, None, :]
    covariance[:, 0, 1] *= rows["corr_conditional"].to_numpy()
    covariance[:, 1, 0] = covariance[:, 0, 1]
    return covariance
