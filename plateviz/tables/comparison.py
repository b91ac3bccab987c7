"""Table of the differences between two fits of the same sources."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.sky import centre_of, places_arcmin
from plateviz.tables.sources import ordered_by_class
from solver.data.result import FitResult
from solver.model.directions import offsets_mas, vectors_about
from solver.units import MAS_PER_ARCMIN


def comparison(result_a: FitResult, result_b: FitResult) -> pd.DataFrame:
    """Return position B minus position A of every source in both fits, and the ratio of sigmas.

    Parameters
    ----------
    result_a : the fit taken as reference
    result_b : the fit compared with it

    Returns
    -------
    `source_id`, `id`, `source_class`, `n_obs` (of A), `x_arcmin` (East),
    `y_arcmin` in the plane tangent at the centre, the difference along its axes as `u_arcmin`,
    `v_arcmin`, and at the source as `difference_ra_mas` (ra cos(dec)), `difference_dec_mas`,
    `pull_ra`, `pull_dec` (difference over the marginal sigma of A; not unit normal, because both
    fits use the same data), `sigma_ratio_ra`, `sigma_ratio_dec` (marginal, B over A)
    """
    columns = ["source_id", "ra", "dec", "sigma_ra_marginal", "sigma_dec_marginal"]
    table = ordered_by_class(result_a.sources).merge(
        result_b.sources[columns], on="source_id", suffixes=("", "_b"), validate="one_to_one"
    )
    d_ra, d_dec = offsets_mas(table["ra_b"], table["dec_b"], table["ra"], table["dec"])
    centre = centre_of(table)
    x, y = places_arcmin(table, centre)
    places = table["ra"].to_numpy(), table["dec"].to_numpy()
    u, v = vectors_about(centre, *places, d_ra, d_dec).T
    return pd.DataFrame(
        {
            "source_id": table["source_id"],
            "id": id_strings(table["source_id"]),
            "source_class": table["source_class"],
            "n_obs": table["n_obs"],
            "x_arcmin": x,
            "y_arcmin": y,
            "u_arcmin": u / MAS_PER_ARCMIN,
            "v_arcmin": v / MAS_PER_ARCMIN,
            "difference_ra_mas": d_ra,
            "difference_dec_mas": d_dec,
            "pull_ra": d_ra / table["sigma_ra_marginal"],
            "pull_dec": d_dec / table["sigma_dec_marginal"],
            "sigma_ratio_ra": table["sigma_ra_marginal_b"] / table["sigma_ra_marginal"],
            "sigma_ratio_dec": table["sigma_dec_marginal_b"] / table["sigma_dec_marginal"],
        }
    )


def difference_histogram(table: pd.DataFrame, *, bins: int = 41) -> pd.DataFrame:
    """Return the histogram of the differences of `comparison` over their uncertainty.

    Parameters
    ----------
    table : of `comparison`, not empty
    bins : number of bins; odd, so that one is centred on zero

    Returns
    -------
    A row per coordinate ("ra", "dec") and bin: `coordinate`, `left`, `right`, `count`;
    the bins span every difference
    """
    pulls = table[["pull_ra", "pull_dec"]].to_numpy(dtype=float)
    limit = 1.05 * float(np.abs(pulls).max()) or 1.0
    edges = np.linspace(-limit, limit, bins + 1)
    frames = [
        pd.DataFrame(
            {
                "coordinate": coordinate,
                "left": edges[:-1],
                "right": edges[1:],
                "count": np.histogram(table[f"pull_{coordinate}"], edges)[0],
            }
        )
        for coordinate in ("ra", "dec")
    ]
    return pd.concat(frames, ignore_index=True)
