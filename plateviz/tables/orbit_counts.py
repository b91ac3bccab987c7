"""Table of the number of orbits that measured each source."""

import numpy as np
import pandas as pd

from plateviz.tables.sources import CLASSES, ordered_by_class

_MOST_BINS = 50


def orbit_counts(motions: pd.DataFrame) -> pd.DataFrame:
    """Return the histogram of the number of orbits that measured a source, by class.

    Parameters
    ----------
    motions : `source_id`, `is_reference`, `is_artificial` and `n_orbits` of each source, as in
        `survey_schema.MOTIONS`

    Returns
    -------
    A row per class and bin: `source_class`, `left`, `right` (orbits, half-integers), `count`,
    and repeated along the class `n` (sources), `median` (orbits); no rows without a source
    """
    columns = ["source_class", "left", "right", "count", "n", "median"]
    if motions.empty:
        return pd.DataFrame(columns=columns)
    sources = ordered_by_class(motions)
    most = int(sources["n_orbits"].max())
    step = -(-most // _MOST_BINS)
    edges = np.arange(0.5, most + step + 0.5, step)
    groups = sources.groupby("source_class", sort=False)["n_orbits"]
    frames = [
        pd.DataFrame(
            {
                "source_class": name,
                "left": edges[:-1],
                "right": edges[1:],
                "count": np.histogram(counts, edges)[0],
                "n": len(counts),
                "median": float(counts.median()),
            }
        )
        for name, counts in sorted(groups, key=lambda group: CLASSES.index(str(group[0])))
    ]
    return pd.concat(frames, ignore_index=True)
