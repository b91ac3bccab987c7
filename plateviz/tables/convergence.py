"""Table of the course of a fit."""

import pandas as pd

from solver.result import FitResult


def convergence(result: FitResult) -> pd.DataFrame:
    """Return the trace of the fit with the tolerance that it had to reach.

    Returns
    -------
    The columns of `schema.TRACE` and `tolerance`, the limit of `largest_step` (both in
    units of the parameter's uncertainty)
    """
    return result.trace.assign(tolerance=result.settings.step_tolerance).reset_index(drop=True)
