"""Shared errors: shifts of the sources due to catalogue errors, which all orbits share.

The catalogue has the same errors in all orbits, so their effect does not average out. How
closely the shifts of a source in two orbits agree depends on the fields of both. Therefore the
catalogue errors of each source are drawn once, the same draws serve all orbits, and each orbit
stores the shifts that they cause. The mean of these shifts over orbits, or a fit to them, is the
catalogue error of that mean or fit.
"""

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.parameters import SOURCES
from solver.data.settings import FitSettings
from solver.data.survey_schema import ERROR_BUDGET, N_DRAWS, SHARED_ERRORS
from solver.linear.covariances import Covariances
from solver.linear.source_elimination import ReducedSystem
from solver.model.astrometry import catalogue_covariance, jacobian_at, years_since_epoch
from solver.model.correlation import square_roots
from solver.model.directions import tangent_frame
from solver.model.ephemeris import observer_at
from solver.problem.problem import Problem
from solver.results.diagnostics import error_budget, induced_shift
from solver.results.tables import uncertainties

# First element of the seed of each source's draws; the second is its ID.
_SEED = 20290


def error_budget_table(
    problem: Problem, reduced: ReducedSystem, covariance: Covariances
) -> pd.DataFrame:
    """Return `survey_schema.ERROR_BUDGET`: each source's covariance due to noise and catalogue.

    Errors due to the prior centres of the calibration count as noise: they are small, and most
    of these centres differ from orbit to orbit.
    """
    budget = error_budget(reduced, problem.priors, covariance)
    columns = {"source_id": problem.sources["source_id"].to_numpy()}
    columns |= uncertainties("noise", budget.noise + budget.calibration)
    columns |= uncertainties("catalogue", budget.catalogue)
    return pd.DataFrame(columns)[ERROR_BUDGET.names]


def shared_error_table(
    problem: Problem, reduced: ReducedSystem, settings: FitSettings
) -> pd.DataFrame:
    """Return `survey_schema.SHARED_ERRORS`: the shifts of all sources for each draw."""
    error = np.zeros((N_DRAWS, problem.n_src, 2))
    is_reference = problem.sources["is_reference"].to_numpy(bool)
    drawn = _drawn_errors(problem.sources[is_reference], problem.epoch)
    error[:, is_reference] = drawn * settings.width(SOURCES.name)
    shift = induced_shift(reduced, problem.priors, error).astype(np.float32)
    names = SHARED_ERRORS.names[1:]
    values = shift.transpose(2, 0, 1).reshape(len(names), -1)
    ids = {"source_id": problem.sources["source_id"].to_numpy()}
    return pd.DataFrame(ids | dict(zip(names, values, strict=True)))


def draws_of(table: pd.DataFrame) -> Float[np.ndarray, "row draw 2"]:
    """Return the shifts of `survey_schema.SHARED_ERRORS` as one array, mas."""
    values = table[SHARED_ERRORS.names[1:]].to_numpy(np.float64)
    return values.reshape(len(table), 2, N_DRAWS).swapaxes(1, 2)


def _drawn_errors(references: pd.DataFrame, epoch: float) -> Float[np.ndarray, "draw src 2"]:
    """Return drawn errors of catalogue positions at an epoch, which depend on the ID only."""
    root = square_roots(catalogue_covariance(references))
    normal = np.stack([_normal(int(number)) for number in references["source_id"]])
    frame = tangent_frame(references["ra"].to_numpy(), references["dec"].to_numpy())
    observer = observer_at(np.array([epoch])).position[0]
    jacobian = jacobian_at(frame, years_since_epoch(references, epoch), observer)
    return np.einsum("sip,spq,sdq->dsi", jacobian, root, normal)


def _normal(source_id: int) -> Float[np.ndarray, "draw 5"]:
    return np.random.default_rng([_SEED, source_id]).standard_normal((N_DRAWS, 5))
