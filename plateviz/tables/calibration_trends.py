"""Table of the calibration of all orbits against time, with its trends."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from plateviz.tables.labels import unit_text
from plateviz.tables.run_diagnosis import RunTests
from solver.model.apparent_motion import julian_year
from solver.results.diagnosis.survey.trends import Series, Trend

_COLUMNS = [
    *("group", "label", "unit", "orbit_id", "year", "season", "offset", "trend"),
    *("change", "sigma", "scatter"),
]


def calibration_trends(tests: RunTests) -> pd.DataFrame:
    """Return the parameter of each group that changes most from orbit to orbit.

    Parameters
    ----------
    tests : of the run

    Returns
    -------
    A row per group and orbit: `group`, `label` (of the parameter), `unit`, `orbit_id`, `year`
    (Julian), `season` (1 at the position angle of the first orbit, -1 at another, 0 if all are
    alike), in `unit`: `offset` (value minus mean), `trend` (the fitted line), `change` (from the
    first orbit to the last) and `scatter` (about the line), and `sigma` (of the group's trend); no
    rows with too few orbits
    """
    if tests.calibrations.empty:
        return pd.DataFrame(columns=_COLUMNS)
    epochs = tests.calibrations.drop_duplicates("orbit_id").set_index("orbit_id")["epoch"]
    parts = [_of_group(series, trends, epochs) for series, trends in tests.trends]
    found = [part for part in parts if len(part)]
    return pd.concat(found, ignore_index=True) if found else pd.DataFrame(columns=_COLUMNS)


def _of_group(series: Series, trends: Sequence[Trend], epochs: pd.Series) -> pd.DataFrame:
    lines = [one for one in trends if one.test.subject == "trend"]
    if not lines:
        return pd.DataFrame(columns=_COLUMNS)
    (trend,) = lines
    values = series.values[:, series.labels.index(trend.label)]
    line = 0.5 * trend.change * (series.time - series.time.mean())
    offset = values - values.mean()
    return pd.DataFrame(
        {
            "group": series.group,
            "label": trend.label,
            "unit": unit_text(trend.unit),
            "orbit_id": series.orbits,
            "year": julian_year(epochs.loc[list(series.orbits)].to_numpy()),
            "season": series.season.astype(int),
            "offset": offset,
            "trend": line,
            "change": trend.change,
            "sigma": trend.test.sigma,
            "scatter": float(np.std(offset - line)),
        }
    )[_COLUMNS]
