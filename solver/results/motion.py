"""Motion fits: position, proper motion and parallax of each source over the orbits.

The model is linear in five offsets from the catalogue, q = (alpha*, delta, parallax, mu_alpha*,
mu_delta): an orbit's position is y_k = A_k q + e_k. Only the component of e_k that scatters from
orbit to orbit is noise and determines the weights. The component due to errors of the catalogue
is the same function of the same errors in every orbit: it does not average out and propagates
through the fit like the positions. Its effect on q is therefore found by fitting the shifts of
`solver.results.shared_errors` draw by draw.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int

from solver.model.apparent_motion import motion_design
from solver.results.shared_errors import draws_of

# Condition number above which the orbits leave a combination of the parameters unconstrained.
_LARGEST_CONDITION = 1e10


class MotionFit(NamedTuple):
    """Fitted motions of the sources, and residuals of the orbits' positions; mas and mas/yr.

    Attributes
    ----------
    source_id : ID of each source, ascending
    first : first row of the history of each source
    motion : fitted minus catalogue
    true : truth minus catalogue
    noise, catalogue : covariance of the fit due to noise and to catalogue errors
    chi2 : chi2 of the residuals, weighted by the noise
    residual : residual of each row of the history
    expected : variance of each residual
    drawn : shifts of the rows for each draw of the catalogue errors
    """

    source_id: Int[np.ndarray, " src"]
    first: Int[np.ndarray, " src"]
    motion: Float[np.ndarray, "src 5"]
    true: Float[np.ndarray, "src 5"]
    noise: Float[np.ndarray, "src 5 5"]
    catalogue: Float[np.ndarray, "src 5 5"]
    chi2: Float[np.ndarray, " src"]
    residual: Float[np.ndarray, "row 2"]
    expected: Float[np.ndarray, "row 2"]
    drawn: Float[np.ndarray, "row draw 2"]


def fit_motions(history: pd.DataFrame, epoch: float) -> MotionFit:
    """Fit the motion of every source of a history.

    Parameters
    ----------
    history : `survey_schema.HISTORY` joined with `SHARED_ERRORS`, in order of source_id and
        epoch, with all rows of each source
    epoch : epoch of the positions, Julian year in TCB

    Returns
    -------
    The motions; NaN if the orbits of a source leave a parameter unconstrained.
    """
    ids, first = np.unique(history["source_id"].to_numpy(), return_index=True)
    ra, dec, epochs = history[["ra", "dec", "epoch"]].to_numpy().T
    design = motion_design(ra, dec, epochs, epoch)
    noise = _noise(history)
    weight = np.linalg.inv(noise)
    weighted = np.einsum("nij,njp->nip", weight, design)
    normal = np.add.reduceat(np.einsum("nip,niq->npq", design, weighted), first)
    covariance = _inverse(normal)
    position = history[["offset_ra", "offset_dec"]].to_numpy()
    truth = history[["true_offset_ra", "true_offset_dec"]].to_numpy()
    drawn = draws_of(history)
    positions = np.concatenate([position[:, None], truth[:, None], drawn], axis=1)
    right_sides = np.add.reduceat(np.einsum("nip,nki->nkp", weighted, positions), first)
    solved = np.einsum("spq,skq->skp", covariance, right_sides)
    rows = np.repeat(np.arange(len(ids)), np.diff(first, append=len(history)))
    residual = position - np.einsum("nip,np->ni", design, solved[rows, 0])
    fitted = np.einsum("nip,npq,niq->ni", design, covariance[rows], design)
    by_draw = solved[:, 2:]
    return MotionFit(
        ids,
        first,
        solved[:, 0],
        solved[:, 1],
        covariance,
        np.einsum("skp,skq->spq", by_draw, by_draw) / by_draw.shape[1],
        np.add.reduceat(np.einsum("ni,nij,nj->n", residual, weight, residual), first),
        residual,
        np.diagonal(noise, axis1=1, axis2=2) - fitted,
        drawn,
    )


def _noise(history: pd.DataFrame) -> Float[np.ndarray, "row 2 2"]:
    sigma = history[["sigma_ra_noise", "sigma_dec_noise"]].to_numpy()
    covariance = sigma[:, :, None] * sigma[:, None, :]
    covariance[:, 0, 1] *= history["corr_noise"].to_numpy()
    covariance[:, 1, 0] = covariance[:, 0, 1]
    return covariance


def _inverse(normal: Float[np.ndarray, "src 5 5"]) -> Float[np.ndarray, "src 5 5"]:
    """Return the inverses, NaN for singular matrices."""
    diagonal = np.diagonal(normal, axis1=1, axis2=2)
    # A zero diagonal, as of one orbit exactly at the epoch, is singular too.
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    outer = scale[:, :, None] * scale[:, None, :]
    scaled = normal * outer
    usable = _is_regular(scaled)
    inverse = np.full(normal.shape, np.nan)
    inverse[usable] = np.linalg.inv(scaled[usable]) * outer[usable]
    return inverse


def _is_regular(scaled: Float[np.ndarray, "src 5 5"]) -> Bool[np.ndarray, " src"]:
    values = np.linalg.eigvalsh(scaled)
    return values[:, 0] * _LARGEST_CONDITION > values[:, -1]
