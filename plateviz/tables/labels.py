"""Text for exposures, ids, units and dates, the same in every plot and table."""

import re

import pandas as pd

_EXPOSURE = re.compile(r"field (-?\d+), exposure (-?\d+)")
_IN_A_RESULT = re.compile(r"field (-?\d+) plate (-?\d+)")
_MJD_UNIX_EPOCH = 40587.0
_LONG_ID, _SHORT_ID = 10, 6
_MINUTE = "%Y-%m-%d %H:%M"


def exposure_labels(table: pd.DataFrame) -> pd.Series:
    """Return "field 0, exposure 3" for each row, from `field_id` and `plate_id`."""
    field, plate = table["field_id"].astype(str), table["plate_id"].astype(str)
    return "field " + field + ", exposure " + plate


def exposure_label(field_id: int, plate_id: int) -> str:
    """Return the label of one exposure."""
    return f"field {field_id}, exposure {plate_id}"


def labelled_exposure(label: str) -> tuple[int, int] | None:
    """Return `field_id` and `plate_id` of an exposure's label; None if it is none."""
    match = _EXPOSURE.fullmatch(label)
    return (int(match[1]), int(match[2])) if match else None


def element_labels(labels: pd.Series) -> pd.Series:
    """Return names of parameters' elements with the exposures named as everywhere else.

    Parameters
    ----------
    labels : of a result, whose files say "field 0 plate 3"
    """
    return labels.str.replace(_IN_A_RESULT, r"field \1, exposure \2", regex=True)


def id_strings(ids: pd.Series) -> pd.Series:
    """Return the ids as text, because a browser represents integers exactly up to 2**53 only."""
    return ids.astype("int64").astype(str)


def short_id(source: str) -> str:
    """Return the end of a long id, for a title beside which the whole id stands."""
    return source if len(source) <= _LONG_ID else f"…{source[-_SHORT_ID:]}"


def unit_text(unit: str) -> str:
    """Return a unit as it is shown: "µm" for astropy's "um"."""
    return unit.replace("um", "µm")


def dates(epochs: pd.Series) -> pd.Series:
    """Return MJDs as text that sorts in time ("2028-03-01 12:40"); empty where there is none."""
    text = pd.to_datetime(epochs - _MJD_UNIX_EPOCH, unit="D", errors="coerce").dt.strftime(_MINUTE)
    return text.fillna("").astype(object)
