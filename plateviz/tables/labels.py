"""Words for exposures and ids, the same in every plot and table."""

import pandas as pd


def exposure_labels(table: pd.DataFrame) -> pd.Series:
    """Return "field 0, exposure 3" for each row, from `field_id` and `plate_id`."""
    field, plate = table["field_id"].astype(str), table["plate_id"].astype(str)
    return "field " + field + ", exposure " + plate


def id_strings(ids: pd.Series) -> pd.Series:
    """Return the ids as text: a browser keeps numbers exact up to 2**53 only."""
    return ids.astype("int64").astype(str)
