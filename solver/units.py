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

RAD_PER_DEG = math.pi / 180.0
RAD_PER_ARCSEC = RAD_PER_DEG / 3600.0
RAD_PER_MAS = RAD_PER_ARCSEC / 1000.0
MAS_PER_DEG = 3.6e6
ARCSEC_PER_DEG = 3600.0
UAS_PER_MAS = 1000.0
DAYS_PER_JULIAN_YEAR = 365.25
MJD_J2000 = 51544.5
KM_PER_S_IN_C = 1.0 / 299_792.458
