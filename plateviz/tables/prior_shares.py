"""Table of the prior share of each calibration parameter."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import element_labels, unit_text
from solver.data.parameters import BY_NAME
from solver.data.result import FitResult

_HALF_BAND = 0.36


def prior_shares(result: FitResult) -> pd.DataFrame:
    """Return the prior share of every calibration parameter, by group.

    The prior share is the marginal variance over the prior variance: 0 if the parameter is
    determined by the measurements, 1 if by its prior alone.

    Parameters
    ----------
    result : the fit

    Returns
    -------
    `group` (label), `row` (of the group, from 0), `label` (of the element), `height`
    (within the row, the elements in order), `prior_share`, `value`, `value_unit`,
    `sigma_marginal`, `prior_sigma`, `unit`
    """
    rows = result.calibration
    order = {name: row for row, name in enumerate(rows["group"].unique())}
    size = rows.groupby("group")["element"].transform("size")
    within = (rows["element"] + 0.5) / size * 2.0 - 1.0
    row = rows["group"].map(order).astype(float)
    return pd.DataFrame(
        {
            "group": [BY_NAME[name].label for name in rows["group"]],
            "row": row.astype(np.int64),
            "label": element_labels(rows["label"]),
            "height": row + _HALF_BAND * within,
            "prior_share": rows["prior_share"],
            "value": rows["value"],
            "value_unit": rows["value_unit"].map(unit_text),
            "sigma_marginal": rows["sigma_marginal"],
            "prior_sigma": rows["prior_sigma"],
            "unit": rows["unit"].map(unit_text),
        }
    )
