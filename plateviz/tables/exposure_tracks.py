"""Table of the parameters of each exposure against time."""

import numpy as np
import pandas as pd

from plateviz.tables.exposures import minutes_since_first
from plateviz.tables.labels import exposure_labels, unit_text
from solver.data.result import FitResult
from solver.units import MAS_PER_ARCSEC

_IN_UNIT = ["offset", "sigma_conditional", "sigma_marginal", "prior_sigma"]


def exposure_tracks(result: FitResult) -> pd.DataFrame:
    """Return every parameter of the exposures, fitted minus prior centre, against time.

    The offsets of the pointing are those in the plane tangent to the sky at the prior centre,
    towards East and North.

    Parameters
    ----------
    result : the fit

    Returns
    -------
    A row per parameter group on the exposures and per exposure: `group` (label), `unit` (mas
    for angles), `exposure` (text), `field_id`, `number` (of the exposure, from 1), `minutes`
    (since the first exposure; NaN if the exposures have no times), in `unit`: `offset`,
    `sigma_conditional`, `sigma_marginal`, `prior_sigma` (inf where flat), and `value`,
    `prior_centre` in `value_unit`
    """
    times = _times(result.exposures).reset_index(drop=True)
    tables = []
    for group in result.groups_on("exp"):
        rows = result.calibration[result.calibration["group"] == group.name]
        found = rows.assign(group=group.label).merge(times, left_on="element", right_index=True)
        if len(found):
            tables.append(_in_readable_unit(found))
    columns = [
        *("group", "unit", "exposure", "field_id", "number", "minutes"),
        *(*_IN_UNIT, "value", "prior_centre", "value_unit"),
    ]
    if not tables:
        return pd.DataFrame(columns=columns)
    return pd.concat(tables, ignore_index=True)[columns]


def _times(exposures: pd.DataFrame) -> pd.DataFrame:
    minutes = minutes_since_first(exposures)
    # Exposures at one and the same time have times that mean nothing.
    is_known = bool(np.isfinite(minutes).all() and (minutes > 0.0).any())
    return pd.DataFrame(
        {
            "exposure": exposure_labels(exposures),
            "field_id": exposures["field_id"],
            "number": np.arange(1, len(exposures) + 1),
            "minutes": minutes if is_known else np.nan,
        }
    )


def _in_readable_unit(rows: pd.DataFrame) -> pd.DataFrame:
    """Return angles in mas, and "um" as "µm"."""
    units = {name: unit_text(rows[name].iloc[0]) for name in ("unit", "value_unit")}
    if units["unit"] != "arcsec":
        return rows.assign(**units)
    scaled = {name: MAS_PER_ARCSEC * rows[name] for name in _IN_UNIT}
    return rows.assign(**scaled, **{**units, "unit": "mas"})
