"""Consistency checks between the tables of an observation, the catalogue and the truth."""

import pandas as pd

from solver.data.plural import plural

_MAX_LISTED = 5
# An orbit about the Earth takes hours; one about L2 may be cut into days.
_LONGEST_ORBIT_D = 2.0
_EXPOSURE = ["orbit_id", "field_id", "plate_id"]
_PIXELS = ["nx", "ny"]
# No two exposures of a telescope have all of these in common.
_ATTITUDE = ["obstime", "ra_est", "dec_est", "pa_est"]


def place_problems(measurements: pd.DataFrame, where: str) -> list[str]:
    """Return a message for each orbit whose measurements have one and the same position."""
    if not {"orbit_id", *_PIXELS} <= set(measurements):
        return []
    by_orbit = measurements.groupby("orbit_id")[_PIXELS]
    least, most, count = by_orbit.min(), by_orbit.max(), by_orbit.size()
    same = least[(least == most).all(axis=1) & (count > 1)]
    return [
        f"{where}, columns nx and ny: expected measurements at different places of a detector, "
        f"found all {count[orbit]:,} of orbit {orbit} at ({x:g}, {y:g}) pix"
        for orbit, x, y in same.itertuples(name=None)
    ]


def exposure_problems(
    measurements: pd.DataFrame, exposures: pd.DataFrame, where: str, where_exposures: str
) -> list[str]:
    """Return a message if measured exposures have no row, or their times cannot be of one orbit."""
    measured = exposures_of(measurements)
    missing = sorted(measured - exposures_of(exposures))
    if missing:
        return [
            f"{where}: expected a row in {where_exposures} for every measured exposure "
            f"(orbit_id, field_id, plate_id), found none for {_listed(missing)}"
        ]
    if "obstime" not in exposures:
        return []
    is_measured = pd.MultiIndex.from_frame(exposures[_EXPOSURE]).isin(measured)
    return _time_problems(exposures[is_measured], where_exposures)


def repeated_orbit_problems(exposures: pd.DataFrame, where: str) -> list[str]:
    """Return a message if orbits have the same exposures; parameters as of `repeated_orbits`."""
    copies = repeated_orbits(exposures)
    if not copies:
        return []
    return [
        f"{where}: expected no exposure in two orbits, found the same times and pointings in "
        f"{_listed(copies)}; a copied orbit would count as an independent one"
    ]


def repeated_orbits(exposures: pd.DataFrame) -> list[tuple[int, ...]]:
    """Return the groups of orbits with exposures of the same time and attitude.

    Parameters
    ----------
    exposures : of a survey; columns may be missing, and rows without values
    """
    if not {"orbit_id", *_ATTITUDE} <= set(exposures):
        return []
    distinct = exposures.drop_duplicates(["orbit_id", *_ATTITUDE]).dropna(subset=_ATTITUDE)
    shared = distinct[distinct.duplicated(_ATTITUDE, keep=False)]
    groups = shared.groupby(_ATTITUDE)["orbit_id"]
    return sorted({tuple(sorted(set(orbits))) for _, orbits in groups})


def _time_problems(exposures: pd.DataFrame, where: str) -> list[str]:
    middle = exposures.groupby("orbit_id")["obstime"].transform("median")
    far = exposures[(exposures["obstime"] - middle).abs() > _LONGEST_ORBIT_D / 2.0]
    if far.empty:
        return []
    keys = far[_EXPOSURE].itertuples(index=False, name=None)
    return [
        f"{where}, column obstime: expected the exposures of an orbit within "
        f"{_LONGEST_ORBIT_D:g} d, found {len(far)} of {len(exposures)} far from the others "
        f"(orbit_id, field_id, plate_id): {_listed(list(keys))}"
    ]


def catalogue_problems(
    measurements: pd.DataFrame, catalogue: pd.DataFrame, where: str, where_catalogue: str
) -> list[str]:
    """Return messages if measured sources are missing from the catalogue or none is a reference."""
    measured, known = _measured(measurements), catalogue["source_id"].to_numpy()
    missing = measured[~measured.isin(known)]
    found = []
    if missing.size:
        found.append(
            f"{where}, column source_id: expected every measured source in {where_catalogue}, "
            f"found {missing.size} of {measured.size} that are not: {_listed(missing.tolist())}"
        )
    references = known[catalogue["is_reference"].to_numpy(dtype=bool)]
    if not measured.isin(references).any():
        found.append(
            f"{where_catalogue}, column is_reference: expected at least one reference source "
            f"among the {measured.size} measured in {where}, found none"
        )
    return found


def truth_problems(
    measurements: pd.DataFrame, truth: pd.DataFrame, where: str, where_truth: str
) -> list[str]:
    """Return a message if no measured source is in the truth; some missing ones are allowed."""
    measured = _measured(measurements)
    if measured.isin(truth["source_id"]).any():
        return []
    return [
        f"{where_truth}, column source_id: expected some of the {measured.size} "
        f"{plural(measured.size, 'source')} measured in {where}, found none of them"
    ]


def exposures_of(table: pd.DataFrame) -> set[tuple[int, int, int]]:
    """Return the exposures (orbit_id, field_id, plate_id) that have a row in `table`."""
    return set(table[_EXPOSURE].drop_duplicates().itertuples(index=False, name=None))


def _measured(measurements: pd.DataFrame) -> pd.Index:
    """Return the ids of the measured sources, ascending."""
    return pd.Index(measurements["source_id"].unique()).sort_values()


def _listed(items: list) -> str:
    text = ", ".join(str(item) for item in items[:_MAX_LISTED])
    return text + (f" and {len(items) - _MAX_LISTED} more" if len(items) > _MAX_LISTED else "")
