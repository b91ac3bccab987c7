"""The summary of a fit: plain numbers and text, the same in files, `--json` and dashboard."""

import numpy as np
import pandas as pd

from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode
from solver.model.directions import offsets_mas
from solver.problem.problem import Problem
from solver.results.diagnostics import (
    deviation_freedom,
    effective_parameters,
    fall_to_the_mode,
    log_evidence,
    mean_covariance,
    normalised_deviation,
)
from solver.results.tables import SolvedProblem


def known_numbers(problem: Problem, mode: Mode, settings: FitSettings) -> dict[str, object]:
    """Return the part of the summary that needs no uncertainties."""
    return {
        "converged": mode.status.is_solution,
        "reason": mode.status.value,
        "engine": settings.engine,
        "order": settings.order,
        "distortion_scale_um": float(problem.geometry.distortion_scale),
        "iterations": mode.trace[-1].iteration if mode.trace else 0,
        "orbit": int(problem.exposures["orbit_id"].iloc[0]),
        "epoch_mjd": problem.epoch,
        "n_measurements": problem.n_obs,
        "n_sources": problem.n_src,
        "n_reference": int(problem.sources["is_reference"].sum()),
        "n_exposures": len(problem.exposures),
        "n_parameters": problem.layout.size + 2 * problem.n_src,
    }


def summarise(solution: SolvedProblem, settings: FitSettings) -> dict[str, object]:
    """Return the summary of one fit; residuals in pixels, other lengths in mas."""
    problem, mode, residuals = solution.problem, solution.mode, solution.residuals
    is_reference = problem.sources["is_reference"].to_numpy(bool)
    whitened = residuals.whitened
    chi2 = float(np.vdot(whitened, whitened))
    prior_hessian = problem.priors.hessian_diagonal(mode.theta)
    parameters = effective_parameters(problem.priors, prior_hessian, solution.covariance)
    dof = whitened.size - parameters
    objective = chi2 + problem.priors.penalty(mode.theta, mode.sources)
    if settings.engine != "gauss-newton":
        objective -= fall_to_the_mode(problem, mode)
    log_sigma = float(np.log(problem.measurements.sigma).sum())
    scatter = np.sqrt(np.mean((whitened * problem.measurements.sigma) ** 2, axis=0))
    return {
        **known_numbers(problem, mode, settings),
        "effective_parameters": parameters,
        "chi2": chi2,
        "dof": dof,
        "chi2_per_dof": chi2 / dof,
        "log_evidence": log_evidence(mode, problem.priors, objective, log_sigma, whitened.size),
        "residual_rms_x": float(scatter[0]),
        "residual_rms_y": float(scatter[1]),
        **_reference_numbers(solution, is_reference),
        **_common_error(solution, ~is_reference),
    }


def truth_summary(sources: pd.DataFrame, places: pd.DataFrame) -> dict[str, dict[str, float | int]]:
    """Return deviations from the truth by class, of sources with at least `MIN_OBS` measurements.

    Parameters
    ----------
    sources : `schema.SOURCES`
    places : `schema.TRUE_PLACES`

    Returns
    -------
    class -> numbers; means and rms in mas, pulls with the marginal sigmas: `pull_rms_*` about zero,
    `pull_sd_*` about their mean, which does not show an error that all share. `induced_*` is
    the mean shift due to errors of the reference sources.
    """
    joined = sources.loc[sources["n_obs"] >= MIN_OBS, _DEVIATING].merge(
        places, on="source_id", suffixes=("", "_true")
    )
    joined["deviation_ra"], joined["deviation_dec"] = offsets_mas(
        *(joined[name].to_numpy() for name in ("ra", "dec", "ra_true", "dec_true"))
    )
    return {
        name: _deviation_numbers(joined[member])
        for name, member in class_members(joined).items()
        if member.any()
    }


MIN_OBS = 10
# What the numbers of a class of sources are computed from.
_DEVIATING = [
    *("source_id", "is_reference", "is_artificial", "ra", "dec"),
    *("sigma_ra_marginal", "sigma_dec_marginal"),
]


def class_members(sources: pd.DataFrame) -> dict[str, pd.Series]:
    """Return the members of each class: reference, non-reference and artificial sources."""
    reference = sources["is_reference"].astype(bool)
    artificial = sources["is_artificial"].astype(bool) & ~reference
    return {
        "reference": reference,
        "non-reference": ~reference & ~artificial,
        "artificial": artificial,
    }


def _deviation_numbers(rows: pd.DataFrame) -> dict[str, float | int]:
    numbers: dict[str, float] = {"n": len(rows)}
    for axis in ("ra", "dec"):
        deviation = rows[f"deviation_{axis}"]
        pull = deviation / rows[f"sigma_{axis}_marginal"]
        numbers |= {
            f"mean_{axis}": float(deviation.mean()),
            f"rms_{axis}": float(np.sqrt((deviation**2).mean())),
            f"pull_rms_{axis}": float(np.sqrt((pull**2).mean())),
            f"pull_sd_{axis}": float(pull.std(ddof=0)),
            f"induced_{axis}": float(rows[f"induced_{axis}"].mean()),
        }
    return numbers


def _reference_numbers(solution: SolvedProblem, is_reference: np.ndarray) -> dict[str, float]:
    variances = np.diagonal(np.linalg.inv(solution.problem.priors.precision), axis1=1, axis2=2)
    marginal = np.diagonal(solution.covariance.source, axis1=1, axis2=2)
    deviation = normalised_deviation(solution.mode.sources, variances, marginal, is_reference)
    freedom = deviation_freedom(solution.reduced, solution.covariance, variances, is_reference)
    return {
        f"{name}_{axis}": float(values[i])
        for name, values in (
            ("normalised_deviation", deviation.measured),
            ("expected_normalised_deviation", deviation.expected),
            ("normalised_deviation_dof", freedom),
        )
        for i, axis in enumerate(("ra", "dec"))
    }


def _common_error(solution: SolvedProblem, members: np.ndarray) -> dict[str, float]:
    """Return the standard deviation of the mean error of the non-reference sources, mas."""
    covariance = mean_covariance(solution.reduced, members)
    return {
        f"mean_error_{axis}": float(np.sqrt(covariance[i, i]))
        for i, axis in enumerate(("ra", "dec"))
    }
