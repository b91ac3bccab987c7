"""Tables of goodness of fit: standardised residuals, chi2 of each exposure."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import exposure_labels
from solver.data.result import FitResult


def pull_histogram(result: FitResult, *, bins: int = 48, limit: float = 6.0) -> pd.DataFrame:
    """Return the histogram of the standardised residuals in each axis.

    Parameters
    ----------
    result : the fit
    bins : number of bins from -limit to limit
    limit : largest absolute value binned; values beyond it are only counted

    Returns
    -------
    A row per axis ("x", "y") and bin: `axis`, `left`, `right`, `count`, `expected` (unit
    normal), and repeated along the axis: `n` (residuals), `outside`, `sd` (about zero)
    """
    edges = np.linspace(-limit, limit, bins + 1)
    return pd.concat([_histogram(result, axis, edges) for axis in "xy"], ignore_index=True)


def exposure_chi2(result: FitResult) -> pd.DataFrame:
    """Return chi2 over its expected value for each exposure, with the expected scatter.

    Returns
    -------
    `index` (order of the result's `exposures`), `exposure` (text), `field_id`, `plate_id`,
    `n_obs`, `chi2_per_dof`, `expected_sd` = sqrt(2 / dof), and
    `z` = (chi2_per_dof - 1) / expected_sd
    """
    table = result.exposures.reset_index(drop=True)
    ratio = table["chi2"] / table["dof"]
    scatter = np.sqrt(2.0 / table["dof"])
    return pd.DataFrame(
        {
            "index": np.arange(len(table)),
            "exposure": exposure_labels(table),
            "field_id": table["field_id"],
            "plate_id": table["plate_id"],
            "n_obs": table["n_obs"],
            "chi2_per_dof": ratio,
            "expected_sd": scatter,
            "z": (ratio - 1.0) / scatter,
        }
    )


def _histogram(result: FitResult, axis: str, edges: np.ndarray) -> pd.DataFrame:
    values = result.residuals[f"standardised_{axis}"].dropna().to_numpy()
    counts, _ = np.histogram(values, edges)
    # The density at the centre overestimates the count in wide bins at the peak; the mean
    # over the bin by Simpson's rule is exact to 1e-5 for the widths in use.
    centre = 0.5 * (edges[1:] + edges[:-1])
    density = (_normal(edges[1:]) + 4.0 * _normal(centre) + _normal(edges[:-1])) / 6.0
    return pd.DataFrame(
        {
            "axis": axis,
            "left": edges[:-1],
            "right": edges[1:],
            "count": counts,
            "expected": len(values) * density * np.diff(edges),
            "n": len(values),
            "outside": len(values) - int(counts.sum()),
            "sd": float(np.sqrt(np.mean(values**2))) if len(values) else float("nan"),
        }
    )


def _normal(x: np.ndarray) -> np.ndarray:
    return np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
