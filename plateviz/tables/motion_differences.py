"""Table of the differences between the motions that two runs fitted to the same sources."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.sources import ordered_by_class
from solver.data.survey_schema import MOTION_PARAMETERS

PARAMETER_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "parallax": "parallax",
        "pmra": "proper motion in α cos δ",
        "pmdec": "proper motion in δ",
        "ra": "position in α cos δ",
        "dec": "position in δ",
    }
)
"""Parameters of the motion in the order in which they are shown, and their names."""
# Proper motion that moves a position from one epoch to another.
_MOVING = {"ra": "pmra", "dec": "pmdec"}


class Shared(NamedTuple):
    """The sources with a fitted motion of two runs.

    Attributes
    ----------
    a, b : rows of `survey_schema.MOTIONS` of the sources in both, by class and `source_id`
    only_a, only_b : number of sources in one of the runs only
    """

    a: pd.DataFrame
    b: pd.DataFrame
    only_a: int
    only_b: int


def shared_motions(motions_a: pd.DataFrame, motions_b: pd.DataFrame) -> Shared:
    """Return the sources that have a fitted motion in both runs, matched by `source_id`.

    Parameters
    ----------
    motions_a, motions_b : `survey_schema.MOTIONS`; no rows while a run is not gathered
    """
    a, b = (one[one["fit_pmra"].notna()] for one in (motions_a, motions_b))
    ids = (one["source_id"].to_numpy(np.int64) for one in (a, b))
    _, in_a, in_b = np.intersect1d(*ids, assume_unique=True, return_indices=True)
    of_b = ordered_by_class(b.iloc[in_b].assign(row_of_a=in_a))
    of_a = a.iloc[of_b.pop("row_of_a")].reset_index(drop=True)
    return Shared(of_a, of_b, len(a) - len(in_a), len(b) - len(in_b))


def motion_differences(shared: Shared) -> pd.DataFrame:
    """Return motion B minus motion A of every source that has one in both runs.

    A position of A is moved to the epoch of B by the motion of A. The two fits use the same
    measurements, as a rule: their errors are nearly the same, and the sigma of their difference
    is known from neither. The difference is therefore divided by the larger of the two sigmas.
    It is not distributed as a unit normal; far below one, the choice between the runs matters
    less than the uncertainty of either.

    Parameters
    ----------
    shared : of `shared_motions`

    Returns
    -------
    A row per source: `source_id`, `id`, `source_class`, `n_orbits` (of the run with fewer), and
    for each of `survey_schema.MOTION_PARAMETERS` `difference_*` (mas, mas/yr; ra cos(dec)),
    `over_sigma_*` and `sigma_ratio_*` (sigma of B over sigma of A)
    """
    a, b = shared.a, shared.b
    years = (b["epoch"] - a["epoch"]).to_numpy(dtype=float)
    columns: dict[str, object] = {
        "source_id": b["source_id"],
        "id": id_strings(b["source_id"]),
        "source_class": b["source_class"],
        "n_orbits": np.minimum(a["n_orbits"], b["n_orbits"]),
    }
    for name in MOTION_PARAMETERS:
        fit, sigma = (a[f"{kind}_{name}"].to_numpy(dtype=float) for kind in ("fit", "sigma"))
        if name in _MOVING:
            # Near its mean epoch, position and proper motion of a source are hardly correlated.
            fit = fit + years * a[f"fit_{_MOVING[name]}"].to_numpy(dtype=float)
            sigma = np.hypot(sigma, years * a[f"sigma_{_MOVING[name]}"].to_numpy(dtype=float))
        difference = b[f"fit_{name}"].to_numpy(dtype=float) - fit
        of_b = b[f"sigma_{name}"].to_numpy(dtype=float)
        columns[f"difference_{name}"] = difference
        columns[f"over_sigma_{name}"] = difference / np.maximum(sigma, of_b)
        columns[f"sigma_ratio_{name}"] = of_b / sigma
    return pd.DataFrame(columns)
