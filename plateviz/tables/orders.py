"""Table of the compared distortion orders, and its summary in one sentence."""

import numpy as np
import pandas as pd

from solver.data.result import FitResult
from solver.data.settings import MAX_ORDER

_COLUMNS = (
    *("order", "n_terms", "converged", "is_fitted"),
    *("chi2_per_dof", "effective_parameters", "log_evidence", "evidence_below_best"),
    *("n_reserved", "held_out_chi2_per_dof", "held_out_sd"),
    *("held_out_log_density", "log_density_below_best"),
)


def order_comparison(result: FitResult) -> pd.DataFrame:
    """Return the evidence and the reserved-source prediction of every order, against the best.

    Returns
    -------
    A row per order: `n_terms` of the distortion, `is_fitted`, `chi2_per_dof` of all
    measurements, and `held_out_chi2_per_dof` of the reserved ones with its expected scatter
    about 1, `held_out_sd` = sqrt(2 / dof); `*_below_best` are in natural logarithms and zero
    for the best order. NaN where a number does not exist; empty if no orders were compared.
    """
    found = result.orders
    if found is None:
        return pd.DataFrame(columns=list(_COLUMNS))
    dof = found["held_out_dof"].where(found["held_out_dof"] > 0).astype(float)
    table = found.assign(
        is_fitted=found["order"] == result.settings.order,
        chi2_per_dof=found["chi2"] / found["dof"],
        evidence_below_best=_below_best(found["log_evidence"]),
        held_out_chi2_per_dof=found["held_out_chi2"] / dof,
        held_out_sd=np.sqrt(2.0 / dof),
        log_density_below_best=_below_best(found["held_out_log_density"]),
    )
    return table[list(_COLUMNS)]


def order_verdict(table: pd.DataFrame) -> str:
    """Return a sentence that names the orders preferred by each criterion, and the fitted order.

    Parameters
    ----------
    table : `order_comparison`, not empty
    """
    by_evidence = preferred_order(table, "evidence_below_best")
    by_density = preferred_order(table, "log_density_below_best")
    predicts = "predicts the reserved sources best"
    if by_evidence is None and by_density is None:
        preference = "No criterion distinguishes the orders"
    elif by_evidence == by_density:
        preference = f"Order {by_evidence} has the highest evidence and {predicts}"
    elif by_density is None:
        preference = f"Order {by_evidence} has the highest evidence"
    elif by_evidence is None:
        preference = f"Order {by_density} {predicts} (the evidence is undefined under a flat prior)"
    else:
        behind = table.set_index("order")["log_density_below_best"][by_evidence]
        preference = (
            f"Order {by_evidence} has the highest evidence; order {by_density} {predicts}, "
            f"with a log density higher by {behind:,.1f}"
        )
    return f"{preference}; {_fitted_order(table, by_evidence, by_density)}.{_left_out(table)}"


def preferred_order(table: pd.DataFrame, column: str) -> int | None:
    """Return the best order by a criterion, the lowest of equally good ones.

    Parameters
    ----------
    table : `order_comparison`
    column : "evidence_below_best" or "log_density_below_best"

    Returns
    -------
    None if no order has a value
    """
    best = table.loc[table[column] == 0.0, "order"]
    return None if best.empty else int(best.iloc[0])


def _below_best(values: pd.Series) -> pd.Series:
    return values.max() - values


def _fitted_order(table: pd.DataFrame, *preferred: int | None) -> str:
    fitted = table.loc[table["is_fitted"], "order"]
    order = "another" if fitted.empty else int(fitted.iloc[0])
    named = {p for p in preferred if p is not None}
    if order in named:
        return "this is the fitted order" if len(named) == 1 else f"the fitted order is {order}"
    return f"the fitted order is {order}" + (", which is neither" if len(named) == 2 else "")


def _left_out(table: pd.DataFrame) -> str:
    highest = int(table["order"].max())
    if highest == MAX_ORDER:
        return ""
    if highest == MAX_ORDER - 1:
        return (
            f" Order {MAX_ORDER} is left out: it has more parameters than the data can constrain."
        )
    return (
        f" Orders {highest + 1} to {MAX_ORDER} are left out: they have more parameters than the "
        "data can constrain."
    )
