"""Tables of the scatter of the reference sources between orbits, and of their mean deviations."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings

LEAST_ORBITS = 10
_COLUMNS = [
    *("id", "coordinate", "n_orbits", "scatter_mas", "expected_mas"),
    *("deviation_mas", "deviation_sigma_mas", "pull"),
]


def reference_scatter(motions: pd.DataFrame, *, least_orbits: int = LEAST_ORBITS) -> pd.DataFrame:
    """Return the scatter of each reference source between orbits, measured and predicted.

    Parameters
    ----------
    motions : `survey_schema.MOTIONS`
    least_orbits : minimum number of orbits; with fewer the measured scatter is too uncertain

    Returns
    -------
    A row per reference source and coordinate ("ra", "dec"): `id`, `coordinate`, `n_orbits`,
    mas: `scatter_mas`, `expected_mas`, `deviation_mas` (mean estimate minus truth),
    `deviation_sigma_mas` (expected sigma of that), and `pull`, their ratio; the last three
    NaN without a truth
    """
    chosen = motions["is_reference"] & (motions["n_orbits"] >= least_orbits)
    rows = motions[chosen].sort_values("source_id", kind="stable")
    frames = [
        pd.DataFrame(
            {
                "id": id_strings(rows["source_id"]),
                "coordinate": axis,
                "n_orbits": rows["n_orbits"],
                "scatter_mas": rows[f"scatter_{axis}"],
                "expected_mas": rows[f"expected_scatter_{axis}"],
                "deviation_mas": rows[f"mean_deviation_{axis}"],
                "deviation_sigma_mas": rows[f"expected_deviation_{axis}"],
                "pull": rows[f"mean_deviation_{axis}"] / rows[f"expected_deviation_{axis}"],
            }
        )
        for axis in ("ra", "dec")
    ]
    table = pd.concat(frames, ignore_index=True)[_COLUMNS]
    known = table[["scatter_mas", "expected_mas"]].notna().all(axis=1)
    return table[known].reset_index(drop=True)


def scatter_cells(table: pd.DataFrame, *, bins: int = 60) -> pd.DataFrame:
    """Return the number of sources in logarithmic cells of a `reference_scatter` coordinate.

    Used when there are too many sources to draw one by one.

    Returns
    -------
    `left`, `right` (predicted, mas), `low`, `high` (measured, mas) and `n` of each non-empty
    cell
    """
    names = ["expected_mas", "scatter_mas"]
    values = table[names].to_numpy(dtype=float)
    rows = values[(values > 0).all(axis=1)]
    edges = [np.geomspace(0.999 * v.min(), 1.001 * v.max(), bins + 1) for v in rows.T]
    n, *_ = np.histogram2d(rows[:, 0], rows[:, 1], edges)
    i, j = np.nonzero(n)
    return pd.DataFrame(
        {
            "left": edges[0][i],
            "low": edges[1][j],
            "right": edges[0][i + 1],
            "high": edges[1][j + 1],
            "n": n[i, j].astype("int64"),
        }
    )
