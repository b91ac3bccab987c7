"""Consistency checks between the tables of an observation, the catalogue and the truth."""

import numpy as np
import pandas as pd

_MAX_LISTED = 5
_EXPOSURE = ["orbit_id", "field_id", "plate_id"]


def exposure_problems(
    measurements: pd.DataFrame, exposures: pd.DataFrame, where: str, where_exposures: str
) -> list[str]:
    """Return a message if a measured exposure has no row in the environment table."""
    missing = sorted(exposures_of(measurements) - exposures_of(exposures))
    if not missing:
        return []
    return [
        f"{where}: expected a row in {where_exposures} for every measured exposure "
        f"(orbit_id, field_id, plate_id), found none for {_listed(missing)}"
    ]


def catalogue_problems(
    measurements: pd.DataFrame, catalogue: pd.DataFrame, where: str, where_catalogue: str
) -> list[str]:
    """Return messages if measured sources are missing from the catalogue or none is a reference."""
    measured = np.unique(measurements["source_id"])
    known = catalogue["source_id"].to_numpy()
    missing = measured[~np.isin(measured, known)]
    found = []
    if missing.size:
        found.append(
            f"{where}, column source_id: expected every measured source in {where_catalogue}, "
            f"found {missing.size} of {measured.size} that are not: {_listed(missing.tolist())}"
        )
    references = known[catalogue["is_reference"].to_numpy(dtype=bool)]
    if not np.isin(measured, references).any():
        found.append(
            f"{where_catalogue}, column is_reference: expected at least one reference source "
            f"among the {measured.size} measured in {where}, found none"
        )
    return found


def truth_problems(
    measurements: pd.DataFrame, truth: pd.DataFrame, where: str, where_truth: str
) -> list[str]:
    """Return a message if no measured source is in the truth; some missing ones are allowed."""
    measured = np.unique(measurements["source_id"])
    if np.isin(measured, truth["source_id"]).any():
        return []
    return [
        f"{where_truth}, column source_id: expected some of the {measured.size} sources "
        f"measured in {where}, found none of them"
    ]


def exposures_of(table: pd.DataFrame) -> set[tuple[int, int, int]]:
    """Return the exposures (orbit_id, field_id, plate_id) that have a row in `table`."""
    return set(table[_EXPOSURE].drop_duplicates().itertuples(index=False, name=None))


def _listed(items: list) -> str:
    text = ", ".join(str(item) for item in items[:_MAX_LISTED])
    return text + (f" and {len(items) - _MAX_LISTED} more" if len(items) > _MAX_LISTED else "")
