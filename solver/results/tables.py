"""The result tables of `solver.data.schema`, computed from the estimate of an engine."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float, Int

from solver.data.instrument import Instrument
from solver.data.parameter_group import Group
from solver.data.schema import (
    CALIBRATION,
    EXPOSURES,
    LOSSES,
    RESIDUALS,
    SOURCES,
    TRACE,
    TRUE_PLACES,
    Table,
)
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Mode
from solver.linear.covariances import Covariances, covariances
from solver.linear.leverage import Residuals, residuals
from solver.linear.source_elimination import ReducedSystem
from solver.model.astrometry import frames_at, sky_position
from solver.model.directions import displaced
from solver.model.ephemeris import observer_at
from solver.problem.problem import Problem
from solver.results.diagnostics import induced_shift
from solver.units import RAD_PER_ARCSEC, RAD_PER_MAS


class SolvedProblem(NamedTuple):
    """An estimate with its covariances and residuals, from which all tables are computed.

    `covariance` has the covariances of the linearised problem. The tables use `conditional` and
    `marginal` of the sources (mas^2) and `theta_variance` of the calibration, which are the
    engine's own if it computes them.
    """

    problem: Problem
    mode: Mode
    reduced: ReducedSystem
    covariance: Covariances
    residuals: Residuals
    conditional: Float[np.ndarray, "src 2 2"]
    marginal: Float[np.ndarray, "src 2 2"]
    theta_variance: Float[np.ndarray, " calib"]


def solved_problem(problem: Problem, found: Estimate, reduced: ReducedSystem) -> SolvedProblem:
    """Return an estimate with its covariances and residuals.

    Parameters
    ----------
    reduced : the problem linearised at the estimate
    """
    covariance = covariances(reduced)
    theta, sources = found.mode.theta, found.mode.sources
    conditional, marginal, calibration = found.conditional, found.marginal, found.calibration
    return SolvedProblem(
        problem,
        found.mode,
        reduced,
        covariance,
        residuals(problem, theta, sources, covariance),
        reduced.conditional_covariance() if conditional is None else conditional,
        covariance.source if marginal is None else marginal,
        np.diag(covariance.theta if calibration is None else calibration),
    )


def source_table(solution: SolvedProblem) -> pd.DataFrame:
    """Return `schema.SOURCES`."""
    problem, sources = solution.problem, solution.problem.sources
    frame = source_frame(problem)
    ra, dec = sky_position(_displaced(frame, solution.mode.sources, RAD_PER_MAS))
    prior_ra, prior_dec = sky_position(frame[:, 0])
    n_src, index = problem.n_src, problem.measurements.index.source
    chi2 = solution.residuals.chi2
    prior = uncertainties("prior", np.linalg.inv(problem.priors.precision))
    columns = {
        "source_id": sources["source_id"].to_numpy(),
        "is_reference": sources["is_reference"].to_numpy(bool),
        "is_artificial": sources["is_artificial"].to_numpy(bool),
        "n_obs": np.bincount(index, minlength=n_src),
        "ra": ra,
        "dec": dec,
        **uncertainties("conditional", solution.conditional),
        **uncertainties("marginal", solution.marginal),
        "prior_ra": prior_ra,
        "prior_dec": prior_dec,
        "prior_sigma_ra": prior["sigma_ra_prior"],
        "prior_sigma_dec": prior["sigma_dec_prior"],
        "prior_corr": prior["corr_prior"],
        "prior_pmra": sources["pmra"].to_numpy(float),
        "prior_pmdec": sources["pmdec"].to_numpy(float),
        "offset_ra": solution.mode.sources[:, 0],
        "offset_dec": solution.mode.sources[:, 1],
        "chi2": np.bincount(index, chi2, n_src),
        "dof": np.bincount(index, 2.0 - solution.residuals.trace, n_src),
        "magnitude": sources.get("magnitude", pd.Series(np.nan, sources.index)).to_numpy(float),
    }
    return _frame(columns, SOURCES)


def residual_table(solution: SolvedProblem, measurements: pd.DataFrame) -> pd.DataFrame:
    """Return `schema.RESIDUALS`, in the row order of `measurements`."""
    problem, residuals = solution.problem, solution.residuals
    row = problem.measurements.row
    pairs = {
        "model_": residuals.pixel,
        "residual_": residuals.whitened * problem.measurements.sigma,
        "standardised_": residuals.standardised,
        "ideal_": residuals.ideal,
        "focal_": residuals.focal,
    }
    columns = {c: measurements[c].to_numpy() for c in RESIDUALS.names if c in measurements}
    columns["leverage"] = _at(row, residuals.trace)
    for name, values in pairs.items():
        for axis, letter in enumerate("xy"):
            columns[name + letter] = _at(row, values[:, axis])
    return _frame(columns, RESIDUALS)


def _at(row: Int[np.ndarray, " n"], values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return values at their rows."""
    placed = np.empty(len(values))
    placed[row] = values
    return placed


def exposure_table(solution: SolvedProblem) -> pd.DataFrame:
    """Return `schema.EXPOSURES`."""
    problem, residuals = solution.problem, solution.residuals
    n_exp, index = len(problem.exposures), problem.measurements.index.exposure
    columns = {name: problem.exposures[name].to_numpy() for name in EXPOSURES.names[:4]}
    columns["n_obs"] = np.bincount(index, minlength=n_exp)
    columns["chi2"] = np.bincount(index, residuals.chi2, n_exp)
    columns["dof"] = np.bincount(index, 2.0 - residuals.trace, n_exp)
    return _frame(columns, EXPOSURES)


def calibration_table(solution: SolvedProblem, instrument: Instrument) -> pd.DataFrame:
    """Return `schema.CALIBRATION`: all parameter groups except the sources."""
    problem, theta = solution.problem, solution.mode.theta
    priors = problem.priors
    marginal = solution.theta_variance
    by_column = {
        "offset": theta,
        "prior_sigma": priors.walks.sigmas(priors.width),
        "sigma_conditional": 1.0 / np.sqrt(np.diag(solution.reduced.theta)),
        "sigma_marginal": np.sqrt(marginal),
        "prior_share": priors.shares(theta, marginal, solution.covariance.theta),
    }
    pointing = _pointing(problem, theta)
    of_groups = []
    for group in problem.layout.groups:
        columns = problem.layout.columns(group)
        centre = priors.centre[columns] / group.per_value_unit
        value = pointing.get(group.name, centre + theta[columns] / group.per_value_unit)
        values_by_name = {
            "group": np.full(len(columns), group.name),
            "element": np.arange(len(columns)),
            "label": np.array(_labels(group, problem), dtype=object),
            "value": value,
            "prior_centre": centre,
            "value_unit": np.full(len(columns), group.value_unit),
            "unit": np.full(len(columns), group.unit),
            **{name: values[columns] for name, values in by_column.items()},
        }
        of_groups.append(values_by_name)
    columns = {
        name: np.concatenate([values[name] for values in of_groups]) for name in CALIBRATION.names
    }
    return _frame(columns, CALIBRATION)


def trace_table(mode: Mode) -> pd.DataFrame:
    """Return `schema.TRACE`."""
    return pd.DataFrame(mode.trace, columns=TRACE.names)


def loss_table(losses: Float[np.ndarray, " step"] | None) -> pd.DataFrame | None:
    """Return `schema.LOSSES`, or None if the engine has no loss."""
    if losses is None:
        return None
    return _frame({"step": np.arange(1, len(losses) + 1), "loss": losses}, LOSSES)


def true_places(solution: SolvedProblem, truth: pd.DataFrame | None) -> pd.DataFrame | None:
    """Return `schema.TRUE_PLACES` of the measured sources in `truth`."""
    if truth is None:
        return None
    problem = solution.problem
    # The truth has all stars of the sky, far more than there are sources.
    rows = truth[truth["source_id"].isin(problem.sources["source_id"])].sort_values("source_id")
    ids = rows["source_id"].to_numpy()
    known = np.isin(problem.sources["source_id"].to_numpy(), ids)
    observer = observer_at(np.array([problem.epoch])).position[0]
    direction = frames_at(rows, problem.epoch, observer)[:, 0]
    ra, dec = sky_position(direction)
    error = np.zeros((problem.n_src, 2))
    error[known] = separation(source_frame(problem)[known], direction)
    error[~problem.sources["is_reference"].to_numpy(bool)] = 0.0
    induced = induced_shift(solution.reduced, problem.priors, error)[known]
    columns = {
        "source_id": ids,
        "ra": ra,
        "dec": dec,
        "induced_ra": induced[:, 0],
        "induced_dec": induced[:, 1],
    }
    return _frame(columns, TRUE_PLACES)


def source_frame(problem: Problem) -> Float[np.ndarray, "src 3 3"]:
    """Return the frames at the sources' prior positions, without padding."""
    return np.asarray(problem.geometry.source_frame)[: problem.n_src]


def separation(
    frame: Float[np.ndarray, "src 3 3"], direction: Float[np.ndarray, "src 3"]
) -> Float[np.ndarray, "src 2"]:
    """Return prior minus true position in the frame of the prior, mas.

    Parameters
    ----------
    frame : tangent frame at the prior position
    direction : unit vector to the true position
    """
    return -np.einsum("sij,sj->si", frame[:, 1:], direction) / RAD_PER_MAS


def _displaced(
    frame: Float[np.ndarray, "n 3 3"], offset: Float[np.ndarray, "n 2"], unit: float
) -> Float[np.ndarray, "n 3"]:
    return displaced(frame, unit * offset[:, 0], unit * offset[:, 1])


def _pointing(
    problem: Problem, theta: Float[np.ndarray, " calib"]
) -> dict[str, Float[np.ndarray, " exp"]]:
    """Return the pointings in degrees, from their offsets in the tangent plane."""
    values = problem.layout.scatter(theta)
    offset = np.stack([values["pointing_ra"], values["pointing_dec"]], axis=-1)
    frame = np.asarray(problem.geometry.pointing_frame)[: len(offset)]
    ra, dec = sky_position(_displaced(frame, offset, RAD_PER_ARCSEC))
    return {"pointing_ra": ra, "pointing_dec": dec}


def _labels(group: Group, problem: Problem) -> list[str]:
    """Return the elements of a group in words; those of terms begin with A or B."""
    letter = group.label[-1] if group.is_term else ""
    return [letter + element.words for element in problem.elements[group.axis]]


def _sigmas(covariance: Float[np.ndarray, "src 2 2"]) -> Float[np.ndarray, "src 2"]:
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


def uncertainties(
    kind: str, covariance: Float[np.ndarray, "src 2 2"]
) -> dict[str, Float[np.ndarray, " src"]]:
    """Return sigmas and correlation of each source as columns with `kind` in their names."""
    sigma = _sigmas(covariance)
    product = sigma[:, 0] * sigma[:, 1]
    # The correlation is zero where a variance is zero.
    correlation = np.divide(
        covariance[:, 0, 1], product, out=np.zeros(len(product)), where=product > 0.0
    )
    return {
        f"sigma_ra_{kind}": sigma[:, 0],
        f"sigma_dec_{kind}": sigma[:, 1],
        f"corr_{kind}": correlation,
    }


def _frame(columns: dict[str, np.ndarray], table: Table) -> pd.DataFrame:
    # Not copied into common blocks: a column is what is written, read and drawn.
    return pd.DataFrame({name: columns[name] for name in table.names}, copy=False)
