"""Defects of the reference catalogue: larger errors, binaries, and smooth zonal errors."""

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.defect_schema import AFFECTED, NO_MEASUREMENT
from solver.errors import InputError
from solver.simulate.defects.defect import Altered, AppliedDefect
from solver.simulate.sky import icrs_to_galactic
from solver.units import MAS_PER_DEG

_ASTROMETRY = ["ra", "dec", "pmra", "pmdec", "parallax"]

# Error of a binary's proper motion: the motion of its photocentre during Gaia's three years is
# not that of its barycentre. It is 6.5 mas 13 years after the catalogue's epoch.
BINARY_MOTION_MAS_YR = 0.5

# Zonal errors are a sum of plane waves; a field is 0.48 deg wide.
_WAVES = 8
_WAVELENGTHS_DEG = (1.5, 3.0)


def reference_errors(
    applied: AppliedDefect, catalogue: pd.DataFrame, truth: pd.DataFrame
) -> Altered:
    """Enlarge the errors of the reference stars; the stated uncertainties remain."""
    chosen = catalogue["is_reference"].to_numpy()
    result = catalogue.copy()
    error = catalogue.loc[chosen, _ASTROMETRY].to_numpy() - truth.loc[chosen, _ASTROMETRY]
    result.loc[chosen, _ASTROMETRY] += applied.amplitude * error.to_numpy()
    return Altered(result, _sources(catalogue.iloc[:0]))


def binaries(applied: AppliedDefect, catalogue: pd.DataFrame, truth: pd.DataFrame) -> Altered:
    """Give wrong proper motions to reference stars around the target, which most orbits see.

    Raises
    ------
    InputError
        If there are fewer reference stars around the target.
    """
    del truth
    settings, number = applied.settings, round(applied.amplitude)
    l_deg, b_deg = icrs_to_galactic(catalogue["ra"].to_numpy(), catalogue["dec"].to_numpy())
    near = catalogue["is_reference"].to_numpy().copy()
    for value, centre in zip((l_deg, b_deg), settings.target_deg, strict=True):
        near &= np.abs(value - centre) <= settings.pair_spread_deg
    rows = np.flatnonzero(near)
    if len(rows) < number:
        raise InputError(
            f"defect {applied.name}: expected at most {len(rows)}, the number of reference stars "
            f"within {settings.pair_spread_deg:g} deg of the target, found {number}"
        )
    rng = applied.survey_rng()
    rows = np.sort(rng.permutation(rows)[:number])
    angle = rng.uniform(0.0, 2.0 * np.pi, number)
    result = catalogue.copy()
    for name, along in (("pmra", np.cos(angle)), ("pmdec", np.sin(angle))):
        values = result[name].to_numpy().copy()
        values[rows] += BINARY_MOTION_MAS_YR * along
        result[name] = values
    return Altered(result, _sources(catalogue.iloc[rows]))


def zonal_errors(applied: AppliedDefect, catalogue: pd.DataFrame, truth: pd.DataFrame) -> Altered:
    """Displace all sources by a smooth field; its rms at the reference stars is the amplitude."""
    l_deg, b_deg = icrs_to_galactic(truth["ra"].to_numpy(), truth["dec"].to_numpy())
    at, rng = np.stack([l_deg, b_deg], axis=1), applied.survey_rng()
    east, north = (_smooth(at, rng) for _ in range(2))
    references = catalogue["is_reference"].to_numpy()
    east, north = (
        applied.amplitude / MAS_PER_DEG * wave / np.sqrt(np.mean(wave[references] ** 2))
        for wave in (east, north)
    )
    east = east / np.cos(np.radians(truth["dec"].to_numpy()))
    moved = catalogue.assign(ra=catalogue["ra"] + east, dec=catalogue["dec"] + north)
    return Altered(moved, _sources(catalogue.iloc[:0]))


def _smooth(at: Float[np.ndarray, "n 2"], rng: np.random.Generator) -> Float[np.ndarray, " n"]:
    """Return a random smooth function of the position, deg."""
    wavelength = rng.uniform(*_WAVELENGTHS_DEG, _WAVES)
    angle, phase = rng.uniform(0.0, 2.0 * np.pi, (2, _WAVES))
    wave = 2.0 * np.pi / wavelength * np.stack([np.cos(angle), np.sin(angle)])
    return np.cos(at @ wave + phase).sum(axis=1)


def _sources(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows of the catalogue as rows of `AFFECTED`."""
    ids = pd.DataFrame({"source_id": rows["source_id"], "true_source_id": rows["source_id"]})
    ids = ids.assign(**NO_MEASUREMENT, shift_x=np.nan, shift_y=np.nan)
    return ids[[name for name in AFFECTED.names if name != "defect"]]
