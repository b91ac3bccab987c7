"""Diagnostics of a solution, computed from arrays.

Paper, section "Results", Eq. (result:deviation), with expected values, because the estimate of
a reference source scatters less than its prior.
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg as sl
from jaxtyping import Bool, Float

from solver.engines.gauss_newton import Mode, downhill
from solver.linear.chi2 import gradient
from solver.linear.covariances import Covariances, cross_covariance
from solver.linear.source_elimination import ReducedSystem
from solver.linear.triangular import lower_solve, upper_solve
from solver.problem.priors import Priors
from solver.problem.problem import Problem

# Number of sources whose covariances with the calibration fit into the caches.
_AT_ONCE = 64


class NormalisedDeviation(NamedTuple):
    """Root mean square of (estimate - prior) / prior sigma of the reference sources.

    `expected` is its expectation, which is below one: the estimate is shrunk towards the
    prior, so its variance about the prior is the prior variance minus the marginal one.
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


def deviation_freedom(
    reduced: ReducedSystem,
    covariance: Covariances,
    prior_variance: Float[np.ndarray, "src 2"],
    is_reference: Bool[np.ndarray, " src"],
) -> Float[np.ndarray, " 2"]:
    """Return how many independent deviations there are in alpha* and in delta.

    The estimates of all reference sources share the errors of the calibration, so that their
    deviations vary together, by far fewer directions than there are sources. With M the
    covariance of the normalised deviations, the sum of their squares is distributed about as
    chi2 with (tr M)^2 / tr(M^2) degrees of freedom, scaled to its mean (Satterthwaite).

    Parameters
    ----------
    prior_variance : mas^2
    """
    order = reduced.source_blocks.order
    order = order[is_reference[order]]
    # L'^-1 T'T L^-1 is the part of the covariance that sources share through the calibration.
    shared = upper_solve(reduced.source_factor[order], reduced.spread(is_reference))
    marginal = np.diagonal(covariance.source, axis1=1, axis2=2)[order]
    freedom = np.zeros(2)
    for axis in range(2):
        scaled = shared[:, axis] / np.sqrt(prior_variance[order, axis])
        together = scaled @ scaled.T if len(scaled) < scaled.shape[1] else scaled.T @ scaled
        own = 1.0 - marginal[:, axis] / prior_variance[order, axis]
        # M is minus the shared part, but for its diagonal; both products have the same norm.
        diagonal = np.einsum("ks,ks->s", scaled, scaled)
        squares = float(np.vdot(together, together) - diagonal @ diagonal + own @ own)
        freedom[axis] = own.sum() ** 2 / squares if squares > 0.0 else 0.0
    return freedom


def effective_parameters(
    priors: Priors, prior_hessian: Float[np.ndarray, " calib"], covariance: Covariances
) -> float:
    """Return the number of parameters that the data determine: n minus the prior shares."""
    source_count = 2 * len(priors.precision) - np.einsum(
        "sij,sji->", priors.precision, covariance.source
    )
    variances = priors.walks.variances(covariance.theta)
    theta_count = len(prior_hessian) - prior_hessian @ variances
    return float(source_count + theta_count)


def fall_to_the_mode(problem: Problem, mode: Mode) -> float:
    """Return by how much the objective falls from a point near the mode to the mode itself.

    It is what a step of Newton's method promises. The engines `svi` and `nuts` end at points whose
    distances from the mode are small for each parameter, but add up over thousands of them.
    """
    if mode.reduced is None:
        return float("nan")
    at = gradient(problem, mode.theta, mode.sources)
    by_theta, by_source = downhill(problem, mode.theta, mode.sources, at)
    theta, sources = mode.reduced.solve(by_theta, by_source)
    return float(by_theta @ theta + np.vdot(by_source, sources))


def log_evidence(
    mode: Mode, priors: Priors, objective: float, log_sigma_sum: float, n_coordinates: int
) -> float:
    """Return the logarithm of the evidence in Laplace's approximation.

    Parameters
    ----------
    objective : at the mode
    log_sigma_sum : sum of log sigma over all measured coordinates, pixels
    n_coordinates : number of measured coordinates, two for each measurement
    """
    if mode.reduced is None:
        return float("nan")
    n_parameters = len(mode.theta) + mode.sources.size
    likelihood = -0.5 * n_coordinates * np.log(2.0 * np.pi) - log_sigma_sum
    volume = 0.5 * n_parameters * np.log(2.0 * np.pi) - 0.5 * mode.reduced.log_determinant()
    return float(likelihood + volume + priors.log_normalisation() - 0.5 * objective)


def mean_covariance(
    reduced: ReducedSystem, members: Bool[np.ndarray, " src"]
) -> Float[np.ndarray, "2 2"]:
    """Return the covariance of the mean position error of some sources, mas^2; NaN of none.

    The errors share those of the calibration, and with them those of the reference sources, so
    this does not fall with the number of sources.
    """
    count = int(members.sum())
    if count == 0:
        return np.full((2, 2), np.nan)
    conditional = reduced.conditional_covariance()[members].sum(axis=0) / count**2
    # Mean shift of the members, along each axis.
    mean_shift = np.eye(2)[:, :, None] * (members / count)
    shared = reduced.onto_calibration(lower_solve(reduced.source_factor, mean_shift))
    half = sl.solve_triangular(reduced.factor, shared.T, trans="T")
    return conditional + half.T @ half


def induced_shift(
    reduced: ReducedSystem,
    priors: Priors,
    reference_error: Float[np.ndarray, "*k src 2"],
) -> Float[np.ndarray, "*k src 2"]:
    """Return the shift of every source due to errors of the reference positions, mas.

    Parameters
    ----------
    reference_error : catalogue minus truth of the reference sources, zero for the others, mas;
        one set or several
    """
    pull = np.einsum("sij,...sj->...si", priors.precision, reference_error)
    return reduced.pulled(pull.reshape(-1, *pull.shape[-2:])).reshape(pull.shape)


class ErrorBudget(NamedTuple):
    """The marginal covariance of each source as a sum over the causes of its error, mas^2.

    Attributes
    ----------
    noise : due to the measurements: the scatter over repeated orbits with the same catalogue
    catalogue : due to the sources' priors, with the same errors in every orbit: an offset
    calibration : due to the prior centres of the calibration
    """

    noise: Float[np.ndarray, "src 2 2"]
    catalogue: Float[np.ndarray, "src 2 2"]
    calibration: Float[np.ndarray, "src 2 2"]


def error_budget(reduced: ReducedSystem, priors: Priors, covariance: Covariances) -> ErrorBudget:
    """Split the covariance of each source into contributions of the data and of the priors.

    With H = H_data + P, the error of the estimate is H^-1 times a sum: the noise of the data,
    of covariance H_data, and P times the error of the prior centres, of covariance P. So H^-1
    is H^-1 H_data H^-1 plus H^-1 P H^-1, whose source blocks these are.
    """
    precision, response = priors.precision, reduced.response()
    cross = cross_covariance(reduced)
    conditional, n_calib = reduced.conditional_covariance(), len(reduced.theta)
    pulled = np.empty(response.shape)
    for a in range(2):
        by_first, by_second = precision[covariance.source_blocks.order, a].T
        pulled[:, a] = by_first * response[:, 0] + by_second * response[:, 1]
    shared = pulled.reshape(n_calib, -1) @ response.reshape(n_calib, -1).T
    half = conditional @ precision @ (covariance.source - 0.5 * conditional)
    cross_terms, calibration = (
        contribution[covariance.source_blocks.position]
        for contribution in _quadratic_forms(cross, shared, priors, covariance.at[0])
    )
    catalogue = half + half.swapaxes(1, 2) + cross_terms
    return ErrorBudget(covariance.source - catalogue - calibration, catalogue, calibration)


def _quadratic_forms(
    cross: Float[np.ndarray, "calib 2 src"],
    shared: Float[np.ndarray, "calib calib"],
    priors: Priors,
    theta: Float[np.ndarray, " calib"],
) -> tuple[Float[np.ndarray, "src 2 2"], Float[np.ndarray, "src 2 2"]]:
    """Return C_i' M C_i of each source, for a symmetric matrix and for that of the priors.

    Computed for a few sources at a time, to stay in the caches.
    """
    n_calib, _, n_src = cross.shape
    prior_hessian = priors.hessian_diagonal(theta)[:, None]
    found = np.empty((2, 2, 2, n_src))
    for first in range(0, n_src, _AT_ONCE):
        batch = slice(first, first + _AT_ONCE)
        rows = cross[:, :, batch].reshape(n_calib, -1)
        independent = priors.walks.independent(rows)
        pairs = (rows, shared @ rows), (independent, prior_hessian * independent)
        for kind, (values, product) in enumerate(pairs):
            left, right = (one.reshape(n_calib, 2, -1) for one in (values, product))
            for a, b in ((0, 0), (0, 1), (1, 1)):
                found[kind, a, b, batch] = np.einsum("ks,ks->s", left[:, a], right[:, b])
    found[:, 1, 0] = found[:, 0, 1]
    cross_terms, calibration = found.transpose(0, 3, 1, 2)
    return cross_terms, calibration
