"""Why a fit has no solution with uncertainties: the likely cause, and what to do about it."""

from typing import NamedTuple

import numpy as np

from solver.data.result import FitStatus
from solver.engines.gauss_newton import Mode
from solver.errors import LikelyCause
from solver.linear.source_elimination import eliminate_sources
from solver.problem.problem import Problem

# A start within this share of the largest pixel coordinate is near enough.
_NEAR = 0.5
# Uncertainties of a hundredth of a good measurement, pixels; larger ones are not to blame.
_TINY_PIX = 1e-4
# Priors ten thousand times narrower.
_TIGHTENED = 1e8


class _Numbers(NamedTuple):
    residual_pix: float
    sigma_pix: float
    half_width_pix: float


def likely_cause(problem: Problem, mode: Mode) -> LikelyCause:
    """Return what most likely left a fit without a solution, and what to do.

    Parameters
    ----------
    mode : from an engine, without a reduced system
    """
    numbers = _numbers(problem, mode)
    if mode.status is FitStatus.NOT_FINITE or not np.isfinite(numbers.residual_pix):
        return LikelyCause(
            "not-finite",
            "an estimate of an exposure, or a measurement, is no number or in a wrong unit",
            "Some estimate of an exposure, or a measurement, is likely no number or in a wrong "
            "unit",
            "check obstime (MJD), ra_est, dec_est and pa_est (deg), focal_length (um)",
        )
    if numbers.residual_pix > _NEAR * numbers.half_width_pix:
        return LikelyCause(
            "wrong-estimates",
            "an estimate of the exposures is wrong",
            f"The stars are predicted some {numbers.residual_pix:.0f} pixels from where they were "
            "measured, so an estimate of the exposures is likely wrong",
            "check ra_est, dec_est and pa_est (deg), focal_length (um), and that source_id means "
            "the same in both files",
            is_misfit=True,
        )
    if numbers.sigma_pix < _TINY_PIX and _tight_priors_hold_it(problem, mode):
        return LikelyCause(
            "outweighed-priors",
            "the measurements outweigh the priors so far that rounding hides these",
            f"The measurements have uncertainties sx, sy of {numbers.sigma_pix:.2g} pixel (median) "
            "and outweigh the priors so far that rounding hides these",
            "check the unit of sx and sy, or narrow the priors that were widened",
        )
    return LikelyCause(
        "open-direction",
        "the priors are too wide for what was measured",
        f"Reference sources alone, {problem.sources['is_reference'].sum()} measured, do not hold "
        "the solution",
        "narrow a prior that holds what they leave open (focal_length, the detectors' places), "
        "lower the order, or add reference sources",
    )


def _numbers(problem: Problem, mode: Mode) -> _Numbers:
    measurements = problem.measurements
    sigma = float(np.median(measurements.sigma))
    chi2 = mode.equations.gradient.chi2
    in_sigmas = np.sqrt(chi2 / (2 * problem.n_obs))
    return _Numbers(in_sigmas * sigma, sigma, float(np.abs(measurements.measured).max()))


def _tight_priors_hold_it(problem: Problem, mode: Mode) -> bool:
    priors = problem.priors
    tight = priors._replace(
        width=priors.width / np.sqrt(_TIGHTENED), precision=priors.precision * _TIGHTENED
    )
    return eliminate_sources(mode.equations, tight) is not None
