"""Histogram of pulls about zero, for comparison with a unit normal."""

import numpy as np
import pandas as pd


def pull_bins(values: pd.Series, *, bins: int = 41, limit: float = 5.0) -> pd.DataFrame:
    """Return the histogram of values that are expected to be unit normal.

    Parameters
    ----------
    values : NaN is ignored
    bins : number of bins from -limit to limit; odd, so that one is centred on zero
    limit : largest absolute value binned; values beyond it are only counted

    Returns
    -------
    `left`, `right`, `count` of each bin, and repeated: `n`, `outside`, `mean`, and `sd`, the
    standard deviation about the mean
    """
    known = values.dropna().to_numpy(dtype=float)
    edges = np.linspace(-limit, limit, bins + 1)
    counts, _ = np.histogram(known, edges)
    return pd.DataFrame(
        {
            "left": edges[:-1],
            "right": edges[1:],
            "count": counts,
            "n": len(known),
            "outside": len(known) - int(counts.sum()),
            "mean": float(known.mean()) if len(known) else np.nan,
            "sd": float(known.std(ddof=1)) if len(known) > 1 else np.nan,
        }
    )
