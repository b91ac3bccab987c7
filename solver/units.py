"""Units used in the project, and conversion constants.

| where                        | unit                                                  |
|------------------------------|-------------------------------------------------------|
| files and tables             | as in `schema.py`: deg, mas, um, pix, MJD (TCB)       |
| parameters inside the solver | offsets from an origin, in the unit of their group    |
| directions                   | unit vectors, BCRS axes                               |
| velocities                   | in units of the speed of light, BCRS axes             |
| positions of the observer    | au, BCRS axes                                         |

Computations that need microarcseconds do not use angles in degrees: 1 uas is 2.8e-10 deg
and a float64 near 266 deg resolves 5.7e-14 deg, which is precise enough to store a value,
but not to subtract, scale and exponentiate it.
"""

import math
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from astropy.units import UnitBase

RAD_PER_DEG = math.pi / 180.0
RAD_PER_ARCMIN = RAD_PER_DEG / 60.0
RAD_PER_ARCSEC = RAD_PER_DEG / 3600.0
RAD_PER_MAS = RAD_PER_ARCSEC / 1000.0
MAS_PER_DEG = 3.6e6
ARCMIN_PER_DEG = 60.0
MAS_PER_ARCMIN = 60_000.0
MAS_PER_ARCSEC = 1000.0
ARCSEC_PER_DEG = 3600.0
SECONDS_PER_DAY = 86_400.0
SECONDS_PER_MINUTE = 60.0
MINUTES_PER_DAY = 1440.0
UAS_PER_MAS = 1000.0
UM_PER_MM = 1000.0
NM_PER_UM = 1000.0
MPIX_PER_PIX = 1000.0
# Not the inverse in floating point: a thousandth is rounded.
PIX_PER_MPIX = 1e-3
# One part per million.
PPM = 1e-6
DAYS_PER_JULIAN_YEAR = 365.25
MJD_J2000 = 51544.5
KM_PER_S_IN_C = 1.0 / 299_792.458

# Names that astropy does not know, with their value.
_MORE_UNITS = {"ppm": PPM}


@cache
def unit_named(text: str) -> "UnitBase":
    """Return the astropy unit of a name; "" is dimensionless, and "ppm" a millionth.

    Raises
    ------
    ValueError
        If there is no such unit.
    """
    # Readers of results need no units, and astropy takes tenths of a second to import.
    from astropy import units as u

    if text in _MORE_UNITS:
        return u.Unit(_MORE_UNITS[text] * u.dimensionless_unscaled)
    return u.Unit(text.replace("µ", "u"))


@cache
def factor_between(unit: str, other: str) -> float:
    """Return how many of `other` make one of `unit`.

    Raises
    ------
    ValueError
        If either is no unit, or they are of different kinds.
    """
    # Rounded, since astropy's factors between degrees and their parts end in rounding errors.
    return float(f"{unit_named(unit).to(unit_named(other)):.12g}")
