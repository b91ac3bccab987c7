"""History: the rows that one orbit adds to the history of its sources."""

import numpy as np
import pandas as pd

from solver.data.result import FitResult
from solver.data.survey_schema import HISTORY
from solver.linear.covariances import Covariances
from solver.linear.source_elimination import ReducedSystem
from solver.model.directions import tangent_frame
from solver.problem.prior_centres import catalogue_shift
from solver.problem.problem import Problem
from solver.results.shared_errors import error_budget_table, shared_error_table
from solver.results.tables import separation


def history_table(
    problem: Problem, reduced: ReducedSystem, covariance: Covariances, result: FitResult
) -> pd.DataFrame:
    """Return `survey_schema.HISTORY` of one orbit, joined with `survey_schema.SHARED_ERRORS`.

    Parameters
    ----------
    reduced : the problem linearised at the solution
    covariance : covariances of `reduced`
    result : the solution
    """
    sources = result.sources.merge(
        error_budget_table(problem, reduced, covariance), on="source_id", validate="one_to_one"
    )
    table = sources.assign(orbit_id=result.orbit_id, epoch=problem.epoch, **_true_offsets(result))
    # In a solution, offsets are from the centres of the priors.
    for axis, shift in zip(("ra", "dec"), catalogue_shift(result.settings), strict=True):
        table[f"offset_{axis}"] += shift
        table[f"true_offset_{axis}"] += shift
    table = table[HISTORY.names]
    draws = shared_error_table(problem, reduced, result.settings)
    return table.merge(draws, on="source_id", validate="one_to_one")


def _true_offsets(result: FitResult) -> dict[str, np.ndarray]:
    """Return truth minus centre of the prior of every source, mas; NaN without a truth."""
    sources, offset = result.sources, np.full((len(result.sources), 2), np.nan)
    if result.true_places is not None:
        known = np.isin(sources["source_id"], result.true_places["source_id"])
        rows = sources[known]
        frame = tangent_frame(rows["prior_ra"].to_numpy(), rows["prior_dec"].to_numpy())
        places = result.true_places.set_index("source_id").loc[rows["source_id"]]
        true = tangent_frame(places["ra"].to_numpy(), places["dec"].to_numpy())
        offset[known] = -separation(frame, true[:, 0])
    return {f"true_offset_{axis}": offset[:, i] for i, axis in enumerate(("ra", "dec"))}
