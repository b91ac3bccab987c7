"""Tables of the convergence of a fit: steps and losses."""

import pandas as pd

from solver.data.result import FitResult

# Steps at the end of an svi run whose mean is its final loss.
_FINAL_STEPS = 50


def convergence(result: FitResult) -> pd.DataFrame:
    """Return the trace of the fit with the convergence tolerance.

    Returns
    -------
    The columns of `schema.TRACE` and `tolerance`, the limit of `largest_step` (both in
    units of the parameter's uncertainty)
    """
    return result.trace.assign(tolerance=result.settings.step_tolerance).reset_index(drop=True)


def loss_excess(result: FitResult) -> pd.DataFrame:
    """Return the losses of an svi run; no rows for an engine without a loss.

    Returns
    -------
    The columns of `schema.LOSSES` and `excess`, the loss above the mean of the last steps
    """
    if result.losses is None:
        return pd.DataFrame({"step": [], "loss": [], "excess": []})
    final = result.losses["loss"].tail(_FINAL_STEPS).mean()
    return result.losses.assign(excess=result.losses["loss"] - final).reset_index(drop=True)
