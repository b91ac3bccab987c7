"""The selected sources, as a list with their values in a solution or in a run."""

from collections.abc import Set as AbstractSet

import numpy as np
import pandas as pd

from plateviz.tables.headings import SELECTED_SOURCES
from plateviz.tables.labels import id_strings
from plateviz.tables.sources import chi2_per_dof, ordered_by_class
from solver.data.result import FitResult


def selected_sources(
    selected: AbstractSet[int], result: FitResult | None, counts: pd.DataFrame | None
) -> pd.DataFrame:
    """Return a row per selected source that the solution or the run has, in the order of ids.

    Parameters
    ----------
    selected : ids
    result : the solution on the screen, or None
    counts : `source_id`, `is_reference`, `is_artificial`, `n_orbits` and others of each source of
        the run, or None

    Returns
    -------
    `id` as text, `source_class`, `n_orbits`, `n_obs`, `ra` and `dec` (deg), the marginal
    `sigma_ra_marginal` and `sigma_dec_marginal` (mas), `offset_ra`, `offset_dec` from the prior
    (mas) and `chi2_per_dof`; NaN for what the solution or the run does not have
    """
    of_orbit = _of(selected, None if result is None else result.sources)
    of_run = _of(selected, counts)
    classes = pd.concat([t[["source_id", "source_class"]] for t in (of_orbit, of_run)])
    table = classes.drop_duplicates("source_id")
    if "ra" in of_orbit:
        values = of_orbit.assign(chi2_per_dof=chi2_per_dof(of_orbit)).drop(columns="source_class")
        table = table.merge(values, on="source_id", how="left")
    if "n_orbits" in of_run:
        table = table.merge(of_run[["source_id", "n_orbits"]], on="source_id", how="left")
    table = table.sort_values("source_id", ignore_index=True)
    return table.assign(id=id_strings(table["source_id"])).reindex(columns=list(SELECTED_SOURCES))


def _of(selected: AbstractSet[int], table: pd.DataFrame | None) -> pd.DataFrame:
    if table is None:
        return pd.DataFrame({"source_id": np.array([], dtype=np.int64), "source_class": []})
    return ordered_by_class(table[table["source_id"].isin(selected)])
