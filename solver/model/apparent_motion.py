"""Apparent motion of a source: proper motion and parallax, as offsets on the sky."""

from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd

from solver.model.ephemeris import observer_at
from solver.units import DAYS_PER_JULIAN_YEAR, MJD_J2000

N_PARAMETERS = 5
# Sets of times whose ephemeris is kept, and most times of one of them.
_KEPT, _MOST_KEPT = 32, 1000

# An array for array input, a scalar for scalar input.
AnyFloat = Any


def julian_year(mjd: np.ndarray | pd.Series | float) -> AnyFloat:
    """Return the Julian years of MJDs, both in TCB."""
    return 2000.0 + (np.asarray(mjd, dtype=float) - MJD_J2000) / DAYS_PER_JULIAN_YEAR


def mjd_of(year: np.ndarray | float) -> AnyFloat:
    """Return the MJDs of Julian years, both in TCB."""
    return MJD_J2000 + (np.asarray(year, dtype=float) - 2000.0) * DAYS_PER_JULIAN_YEAR


def parallax_factors(
    ra: np.ndarray | float, dec: np.ndarray | float, observer: np.ndarray
) -> tuple[AnyFloat, AnyFloat]:
    """Return the parallax factors in ra cos(dec) and dec, mas per mas of parallax.

    The columns of Eqs. (exp:survey:alpha_p) and (exp:survey:delta_p) that the parallax
    multiplies: minus east and north, times the observer's position.

    Parameters
    ----------
    ra, dec : deg, scalar or shape (n,)
    observer : barycentric position, au, shape (3,) or (n, 3)
    """
    a, d = np.radians(ra), np.radians(dec)
    x, y, z = np.moveaxis(np.asarray(observer), -1, 0)
    east = -np.sin(a) * x + np.cos(a) * y
    north = np.cos(d) * z - np.sin(d) * (np.cos(a) * x + np.sin(a) * y)
    return -east, -north


def motion_design(
    ra: np.ndarray | float, dec: np.ndarray | float, mjd: np.ndarray, epoch: float
) -> np.ndarray:
    """Return the design matrix of a source's motion for its five astrometric parameters.

    Parameters
    ----------
    ra, dec : position of the source, one for all times or one per time, deg
    mjd : times, MJD in TCB, shape (n,)
    epoch : epoch of the parameters, Julian year

    Returns
    -------
    Shape (n, 2, 5): offsets in ra cos(dec) and dec, mas, per unit of each of
    `survey_schema.MOTION_PARAMETERS`
    """
    # The ephemeris is computed once per distinct time: many sources share those of an orbit.
    times, inverse = np.unique(mjd, return_inverse=True)
    observer = _positions_at(times)[inverse]
    years = julian_year(mjd) - epoch
    design = np.zeros((len(years), 2, N_PARAMETERS))
    design[:, 0, 0] = design[:, 1, 1] = 1.0
    design[:, :, 2] = np.stack(parallax_factors(ra, dec, observer), axis=-1)
    design[:, 0, 3] = design[:, 1, 4] = years
    return design


def _positions_at(mjd: np.ndarray) -> np.ndarray:
    """Return the Earth's position, au, shape (n, 3); that at few times is computed once."""
    if len(mjd) > _MOST_KEPT:
        return observer_at(mjd).position
    return _kept_positions(np.asarray(mjd, dtype=float).tobytes())


@lru_cache(maxsize=_KEPT)
def _kept_positions(mjd: bytes) -> np.ndarray:
    positions = observer_at(np.frombuffer(mjd)).position
    positions.flags.writeable = False
    return positions
