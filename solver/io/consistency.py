"""Consistency of the tables of an observation with each other and with the catalogue."""

import numpy as np
import pandas as pd

_MOST_NAMED = 5
_EXPOSURE = ["orbit_id", "field_id", "plate_id"]


def exposure_problems(
    measurements: pd.DataFrame, exposures: pd.DataFrame, where: str, where_exposures: str
) -> list[str]:
    """Return a message if a measured exposure has no row in the environment table."""
    lacking = sorted(exposures_of(measurements) - exposures_of(exposures))
    if not lacking:
        return []
    return [
        f"{where}: expected a row in {where_exposures} for every measured exposure "
        f"(orbit_id, field_id, plate_id), found none for {_some(lacking)}"
    ]


def catalogue_problems(
    measurements: pd.DataFrame, catalogue: pd.DataFrame, where: str, where_catalogue: str
) -> list[str]:
    """Return messages for measured sources not in the catalogue, or no reference among them."""
    measured = np.unique(measurements["source_id"])
    known = catalogue["source_id"].to_numpy()
    lacking = measured[~np.isin(measured, known)]
    found = []
    if lacking.size:
        found.append(
            f"{where}, column source_id: expected every measured source in {where_catalogue}, "
            f"found {lacking.size} of {measured.size} that are not: {_some(lacking.tolist())}"
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
    """Return a message if the truth knows none of the measured sources; some is enough."""
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


def _some(items: list) -> str:
    told = ", ".join(str(item) for item in items[:_MOST_NAMED])
    return told + (f" and {len(items) - _MOST_NAMED} more" if len(items) > _MOST_NAMED else "")
