"""The source whose motion differs most significantly from its catalogue."""

import numpy as np
import pandas as pd

from plateviz.tables.notable_source import notable_source

MOTIONS = pd.DataFrame(
    {
        "source_id": [11, 12, 13, 14],
        "n_orbits": [30, 40, 2, 50],
        "dof": [55, 75, -1, 95],
        "fit_parallax": [0.1, -0.9, 9.0, 5.0],
        "fit_pmra": [3.0, 0.3, 9.0, 0.0],
        "fit_pmdec": [4.0, 0.4, 9.0, np.nan],
        **{f"sigma_{name}": [1.0, 0.01, 0.001, 1.0] for name in ("parallax", "pmra", "pmdec")},
    }
)


def test_notable_source_is_the_most_significant_not_the_fastest():
    found = notable_source(MOTIONS)
    assert (found.source_id, found.n_orbits) == (12, 40)
    assert found.proper_motion == np.hypot(0.3, 0.4)
    assert found.text == "0.50 mas/yr and −0.90 mas parallax off its catalogue, in 40 orbits"


def test_run_without_fitted_motions_has_no_notable_source():
    assert notable_source(MOTIONS[MOTIONS["dof"] < 0]) is None
    assert notable_source(MOTIONS.iloc[:0]) is None
    assert notable_source(MOTIONS.iloc[[3]]) is None
