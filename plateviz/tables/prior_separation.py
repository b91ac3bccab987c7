"""Tables of the separation between catalogue and truth at an epoch of observation."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from solver.model.apparent_motion import mjd_of, parallax_factors
from solver.model.directions import offsets_mas
from solver.model.ephemeris import observer_at

EPOCH = 2029.0
GROUPS = ("reference", "non-reference")
_PARAMETERS = (("ra", "pmra"), ("dec", "pmdec"))
_COLUMNS = ["id", "group", "is_artificial", "separation_mas", "sigma_mas"]


def prior_separation(
    catalogue: pd.DataFrame, truth: pd.DataFrame | None, *, epoch: float = EPOCH
) -> pd.DataFrame:
    """Return the separation of catalogue and truth at an epoch, and its stated uncertainty.

    Parameters
    ----------
    catalogue : `schema.CATALOGUE`
    truth : `schema.TRUTH`, or None where there is none
    epoch : Julian year in TCB

    Returns
    -------
    A row per source in both: `id`, `group` ("reference" or "non-reference"), `is_artificial`,
    `separation_mas` on the sky (2-D), and `sigma_mas`, the rms over both coordinates of the
    catalogue's uncertainty at that epoch; no rows without a truth
    """
    if truth is None:
        return pd.DataFrame(columns=_COLUMNS)
    names = ["ra", "dec", "pmra", "pmdec", "parallax", "ref_epoch"]
    rows = catalogue.merge(
        truth[["source_id", *names]], on="source_id", suffixes=("", "_true"), validate="one_to_one"
    )
    observer = observer_at(np.atleast_1d(mjd_of(epoch))).position[0]
    factors = parallax_factors(rows["ra"].to_numpy(), rows["dec"].to_numpy(), observer)
    at_start = offsets_mas(rows["ra"], rows["dec"], rows["ra_true"], rows["dec_true"])
    parallax = rows["parallax"] - rows["parallax_true"]
    years, true_years = epoch - rows["ref_epoch"], epoch - rows["ref_epoch_true"]
    square, variance = 0.0, 0.0
    for k, (place, motion) in enumerate(_PARAMETERS):
        moved = years * rows[motion] - true_years * rows[f"{motion}_true"]
        square = square + (at_start[k] + moved + factors[k] * parallax) ** 2
        variance = variance + _variance(rows, place, motion, factors[k], years)
    return pd.DataFrame(
        {
            "id": id_strings(rows["source_id"]),
            "group": np.where(rows["is_reference"], *GROUPS),
            "is_artificial": rows["is_artificial"],
            "separation_mas": np.sqrt(square),
            "sigma_mas": np.sqrt(0.5 * variance),
        }
    )[_COLUMNS]


def prior_separation_histogram(
    table: pd.DataFrame, *, bins: int = 50, share: float = 0.998
) -> pd.DataFrame:
    """Return the histogram of `prior_separation` for each group in it.

    Parameters
    ----------
    table : not empty
    bins : number of bins, starting at zero
    share : quantile of the separations where the bins end; values beyond are only counted

    Returns
    -------
    A row per group and bin: `group`, `left`, `right`, mas, `count`, and `expected`, the
    number predicted by the catalogue's uncertainties, taken equal in both coordinates;
    repeated along the group `n`, `n_artificial`, `outside` and `median_mas`
    """
    frames = []
    for group in (name for name in GROUPS if (table["group"] == name).any()):
        rows = table[table["group"] == group]
        edges = np.linspace(0.0, float(rows["separation_mas"].quantile(share)) or 1.0, bins + 1)
        counts, _ = np.histogram(rows["separation_mas"], edges)
        frames.append(
            pd.DataFrame(
                {
                    "group": group,
                    "left": edges[:-1],
                    "right": edges[1:],
                    "count": counts,
                    "expected": -np.diff(_beyond(edges, rows["sigma_mas"].to_numpy())),
                    "n": len(rows),
                    "n_artificial": int(rows["is_artificial"].sum()),
                    "outside": len(rows) - int(counts.sum()),
                    "median_mas": float(rows["separation_mas"].median()),
                }
            )
        )
    return pd.concat(frames, ignore_index=True)


def _variance(
    rows: pd.DataFrame, place: str, motion: str, factor: np.ndarray, years: pd.Series
) -> pd.Series:
    """Return the variance of one coordinate at the epoch, with the catalogue's correlations."""
    terms = {
        place: rows[f"{place}_error"],
        "parallax": factor * rows["parallax_error"],
        motion: years * rows[f"{motion}_error"],
    }
    total = sum(term**2 for term in terms.values())
    for pair in ((place, "parallax"), (place, motion), ("parallax", motion)):
        first, second = pair
        total = total + 2.0 * rows[f"{first}_{second}_corr"] * terms[first] * terms[second]
    return total


def _beyond(edges: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return the number of sources expected beyond each separation (Rayleigh distribution)."""
    return np.array([np.exp(-0.5 * (edge / sigma) ** 2).sum() for edge in edges])
