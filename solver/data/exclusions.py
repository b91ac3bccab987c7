"""Exclusions: measurements of an orbit that a fit does not use."""

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pandas as pd

from solver.data.ids import ID, is_id
from solver.data.orbit import OrbitData
from solver.data.subset import Subset, id_text
from solver.errors import InputError

_EXCLUSION = re.compile(rf"(source|detector)=({ID})|(exposure)=({ID})/({ID})")
# Columns that identify an exposure.
_EXPOSURE = ["field_id", "plate_id"]


def without_excluded(data: OrbitData, excluded: Subset) -> OrbitData:
    """Return the orbit without the excluded measurements; row labels stay those of `data`.

    Raises
    ------
    InputError
        If an excluded item has no measurements, or no measurement would remain.
    """
    if not excluded:
        return data
    rows = data.measurements
    for kind, ids, keys in excluded.beside(rows):
        missing = ids.difference(keys[keys.isin(list(ids))].tolist())
        if missing:
            raise InputError(
                f"excluded {kind} {id_text(min(missing))}: expected one with measurements in "
                f"orbit {data.orbit_id}, found none"
            )
    is_excluded = excluded.holds(rows)
    if is_excluded.all():
        raise InputError(
            f"exclusions: expected some measurements of orbit {data.orbit_id} to remain, "
            f"found that all {len(rows)} are excluded"
        )
    return orbit_of_rows(data, ~is_excluded)


def thinned_orbit(data: OrbitData, whole: OrbitData, every: int) -> OrbitData:
    """Return the orbit with every n-th reference source and every n-th other source.

    Parameters
    ----------
    data : the orbit after exclusions
    whole : the orbit before exclusions; the sources are chosen from it, so that the choice
        does not depend on the exclusions
    every : n
    """
    if every == 1:
        return data
    measured = np.unique(whole.measurements["source_id"].to_numpy())
    reference = whole.catalogue.set_index("source_id").loc[measured, "is_reference"].to_numpy(bool)
    kept = np.concatenate([measured[reference][::every], measured[~reference][::every]])
    return orbit_of_rows(data, data.measurements["source_id"].isin(kept).to_numpy())


def orbit_of_rows(data: OrbitData, chosen: np.ndarray) -> OrbitData:
    """Return the orbit with the chosen measurements and their exposures.

    Parameters
    ----------
    chosen : boolean, one per measurement
    """
    rows = data.measurements[chosen]
    measured = pd.MultiIndex.from_frame(rows[_EXPOSURE].drop_duplicates())
    used = pd.MultiIndex.from_frame(data.exposures[_EXPOSURE]).isin(measured)
    exposures = data.exposures[used].reset_index(drop=True)
    return replace(data, measurements=rows, exposures=exposures)


def parse_exclusions(texts: Iterable[str]) -> Subset:
    """Return what texts exclude.

    Parameters
    ----------
    texts : each "source=ID", "detector=ID" or "exposure=FIELD/PLATE"

    Raises
    ------
    InputError
        If a text has another form.
    """
    sources, exposures, detectors = set(), set(), set()
    for text in texts:
        match = _EXCLUSION.fullmatch(text.strip())
        if match is None:
            raise InputError(
                "what to leave out: expected source=ID, exposure=FIELD/PLATE or detector=ID, such "
                f"as source=12 or exposure=0/3, found {text!r}"
            )
        if not all(is_id(int(number)) for number in match.group(2, 4, 5) if number):
            raise InputError(f"what to leave out: expected an id of 64 bits, found {text!r}")
        if match[3]:
            exposures.add((int(match[4]), int(match[5])))
        else:
            (sources if match[1] == "source" else detectors).add(int(match[2]))
    return Subset(frozenset(sources), frozenset(exposures), frozenset(detectors))
