"""Tables of the tests of a run of forty good orbits, with flaws where asked for."""

import numpy as np
import pandas as pd

from solver.data.run_schema import FIELD_DEGREES, ORBIT_CAUSES, ZONAL_FIELD

N_ORBITS = 40
GOOD = {
    **dict.fromkeys(("name", "title", "words", "spoils", "action"), ""),
    "state": "good",
    "significance": 0.0,
}
DRIFTS = {
    "state": "bad",
    "name": "distortion-drifts",
    "title": "the distortion drifts",
    "significance": 6.0,
    "words": "The terms of the second degree change steadily.",
    "spoils": "It spoils the positions, by up to 0.3 mas rms.",
    "action": "let the distortion drift in the fit",
}


def causes(n_drifting=0):
    rows = [
        {
            **(DRIFTS if orbit < n_drifting else GOOD),
            "orbit_id": orbit,
            "options": "--drift 2" if orbit < n_drifting else "",
            "is_large": orbit < n_drifting,
        }
        for orbit in range(N_ORBITS)
    ]
    return pd.DataFrame(rows)[ORBIT_CAUSES.names]


def orbit_tests(shift=0.0, seed=1):
    """Chances of five tests in all orbits, of which one is more significant by `shift`."""
    random = np.random.default_rng(seed)
    sigma = np.abs(random.standard_normal((N_ORBITS, 5)) + [shift, 0, 0, 0, 0])
    names = ["noise", "exposures", "sources", "shift of a detector, 1", "reference stars, all, α"]
    return pd.DataFrame(
        {
            "orbit_id": np.repeat(np.arange(N_ORBITS), 5),
            "name": names * N_ORBITS,
            "sigma": sigma.ravel(),
        }
    )


def calibrations(slope=0.0):
    random = np.random.default_rng(2)
    orbits = np.arange(N_ORBITS)
    values = random.standard_normal((N_ORBITS, 3)) + slope * orbits[:, None] * [0.0, 1.0, 0.0]
    table = pd.DataFrame(
        {
            "orbit_id": np.repeat(orbits, 3),
            "epoch": np.repeat(61_800.0 + 10.0 * orbits, 3),
            "position_angle": np.repeat(np.where(orbits % 10 < 5, 58.0, 238.0), 3),
            "label": ["A 2 0", "A 1 1", "A 0 2"] * N_ORBITS,
            "value": values.ravel(),
        }
    )
    return table.assign(group="distortion, degree 2", unit="um")


def zonal(chi2):
    """A field of 12 tested directions."""
    degrees = np.array(FIELD_DEGREES * 2)
    columns = {"axis": ["ra"] * 10 + ["dec"] * 10, "coefficient": 0.1}
    columns |= {"degree_ra": degrees[:, 0], "degree_dec": degrees[:, 1]}
    columns |= {f"scatter_{number:02d}": 0.01 for number in range(20)}
    columns |= {"centre_ra": 266.0, "centre_dec": -29.0, "half_ra": 0.5, "half_dec": 0.5}
    columns |= {"chi2": chi2, "dof": 12.0, "rms": 0.4, "typical": 0.15}
    return pd.DataFrame(columns)[ZONAL_FIELD.names]
