"""Figures that say whether a solution can be trusted: arrays in, numbers out.

Paper, section "Results", Eq. (result:deviation); with expected values beside them,
because a point estimate of a reference star does not scatter as its prior does.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.engines.gauss_newton import Mode
from solver.linear.leverage import Covariances
from solver.linear.source_elimination import ReducedSystem
from solver.linear.triangular import lower_solve
from solver.problem.priors import Priors

# Sources of which the covariances with the calibration fit into the caches.
_AT_ONCE = 64


class NormalisedDeviation(NamedTuple):
    """Root mean square of (estimate - prior) / prior sigma of the reference stars.

    `expected` is its expectation, which is below one: the estimate is drawn towards the
    prior, so that its variance about it is the prior's less the marginal one.
    """

    measured: Float[np.ndarray, " 2"]
    expected: Float[np.ndarray, " 2"]


def normalised_deviation(
    sources: Float[np.ndarray, "src 2"],
    prior_variance: Float[np.ndarray, "src 2"],
    marginal_variance: Float[np.ndarray, "src 2"],
    is_reference: Bool[np.ndarray, " src"],
) -> NormalisedDeviation:
    """Return Eq. (result:deviation) in alpha* and delta, with its expectation.

    Parameters
    ----------
    sources : estimate minus prior, mas
    prior_variance, marginal_variance : mas^2
    """
    squares = sources[is_reference] ** 2 / prior_variance[is_reference]
    shares = 1.0 - marginal_variance[is_reference] / prior_variance[is_reference]
    return NormalisedDeviation(np.sqrt(squares.mean(axis=0)), np.sqrt(shares.mean(axis=0)))


def effective_parameters(
    priors: Priors, prior_hessian: Float[np.ndarray, " calib"], covariance: Covariances
) -> float:
    """Return the number of parameters that the data decide: n less the prior shares."""
    of_sources = 2 * len(priors.precision) - np.einsum(
        "sij,sji->", priors.precision, covariance.source
    )
    of_theta = len(prior_hessian) - prior_hessian @ np.diag(covariance.theta)
    return float(of_sources + of_theta)


def log_evidence(mode: Mode, priors: Priors, log_sigma_sum: float, n_coordinates: int) -> float:
    """Return the logarithm of the evidence in Laplace's approximation.

    Parameters
    ----------
    log_sigma_sum : sum of log sigma over all measured coordinates, pixels
    n_coordinates : two for each measurement
    """
    if mode.reduced is None:
        return float("nan")
    n_parameters = len(mode.theta) + mode.sources.size
    likelihood = -0.5 * n_coordinates * np.log(2.0 * np.pi) - log_sigma_sum
    volume = 0.5 * n_parameters * np.log(2.0 * np.pi) - 0.5 * mode.reduced.log_determinant()
    return float(likelihood + volume + priors.log_normalisation() - 0.5 * mode.trace[-1].objective)


def mean_covariance(
    reduced: ReducedSystem, members: Bool[np.ndarray, " src"]
) -> Float[np.ndarray, "2 2"]:
    """Return the covariance of the mean position error of some sources, mas^2.

    Their errors share the calibration, and with it the reference stars' errors, so this
    does not fall with their number.
    """
    count = max(int(members.sum()), 1)
    conditional = reduced.conditional_covariance()[members].sum(axis=0) / count**2
    # Of a shift of all members together by one mas, along each axis.
    together = np.eye(2)[:, :, None] * (members / count)
    shared = reduced.onto_calibration(lower_solve(reduced.source_factor, together))
    return conditional + shared @ reduced.theta_covariance() @ shared.T


def induced_shift(
    reduced: ReducedSystem,
    priors: Priors,
    reference_error: Float[np.ndarray, "*k src 2"],
) -> Float[np.ndarray, "*k src 2"]:
    """Return the shift of every source that errors of the reference positions cause, mas.

    Parameters
    ----------
    reference_error : catalogue minus truth of reference stars, zero for the others, mas; one
        set, or several
    """
    pull = np.einsum("sij,...sj->...si", priors.precision, reference_error)
    return reduced.pulled(pull.reshape(-1, *pull.shape[-2:])).reshape(pull.shape)


class ErrorBudget(NamedTuple):
    """The marginal covariance of each source by the origin of its error, mas^2; the three add up.

    Attributes
    ----------
    noise : of the measurements: the scatter over repeated orbits with the same catalogue
    catalogue : of the sources' priors, which err by the same in every orbit: an offset
    calibration : of the centres of the calibration's priors
    """

    noise: Float[np.ndarray, "src 2 2"]
    catalogue: Float[np.ndarray, "src 2 2"]
    calibration: Float[np.ndarray, "src 2 2"]


def error_budget(reduced: ReducedSystem, priors: Priors, covariance: Covariances) -> ErrorBudget:
    """Split the covariance of each source into what the data and what the priors cause.

    With H = H_data + P, the estimate errs by H^-1 times a sum: the data's noise, of
    covariance H_data, and P times the error of the priors' centres, of covariance P. So H^-1
    is H^-1 H_data H^-1 plus H^-1 P H^-1, of which these are the sources' blocks.
    """
    precision, response = priors.precision, reduced.response()
    conditional, n_calib = reduced.conditional_covariance(), len(reduced.theta)
    pulled = np.empty(response.shape)
    for a in range(2):
        by_first, by_second = precision[covariance.source_blocks.order, a].T
        pulled[:, a] = by_first * response[:, 0] + by_second * response[:, 1]
    shared = pulled.reshape(n_calib, -1) @ response.reshape(n_calib, -1).T
    half = conditional @ precision @ (covariance.source - 0.5 * conditional)
    by_others, calibration = (
        part[covariance.source_blocks.position]
        for part in _between(
            covariance.cross, shared, priors.hessian_diagonal(covariance.at[0])[:, None]
        )
    )
    catalogue = half + half.swapaxes(1, 2) + by_others
    return ErrorBudget(covariance.source - catalogue - calibration, catalogue, calibration)


def _between(
    cross: Float[np.ndarray, "calib 2 src"],
    shared: Float[np.ndarray, "calib calib"],
    prior_hessian: Float[np.ndarray, "calib 1"],
) -> tuple[Float[np.ndarray, "src 2 2"], Float[np.ndarray, "src 2 2"]]:
    """Return C_i' M C_i of each source, for a symmetric matrix and for a diagonal one.

    A few sources at a time, so that all of it stays in the caches.
    """
    n_calib, _, n_src = cross.shape
    found = np.empty((2, 2, 2, n_src))
    for first in range(0, n_src, _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        rows = cross[:, :, some].reshape(n_calib, -1)
        part = rows.reshape(n_calib, 2, -1)
        for kind, moved in enumerate((shared @ rows, prior_hessian * rows)):
            other = moved.reshape(part.shape)
            for a, b in ((0, 0), (0, 1), (1, 1)):
                found[kind, a, b, some] = np.einsum("ks,ks->s", part[:, a], other[:, b])
    found[:, 1, 0] = found[:, 0, 1]
    by_others, calibration = found.transpose(0, 3, 1, 2)
    return by_others, calibration
