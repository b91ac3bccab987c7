"""A synthetic history of sources in many orbits, with known motions and noise."""

import numpy as np
import pandas as pd

from solver.data.survey_schema import HISTORY, N_DRAWS, SHARED_ERRORS
from solver.model.apparent_motion import julian_year
from solver.model.astrometry import jacobian_at
from solver.model.directions import tangent_frame
from solver.model.ephemeris import observer_at

EPOCH = 2029.0
FIRST_ID = 4_057_482_027_171_038_209
RA, DEC = 266.0, -29.0
PIXELS_MAS = 0.6


def epochs_of(n_orbits):
    """Return `n_orbits` epochs in spring and autumn of three years, MJD."""
    start = 61_800.0 + 182.6 * np.arange(6)
    return np.sort(np.concatenate([start + 7.0 * k for k in range(-(-n_orbits // 6))]))[:n_orbits]


def design_at(epoch):
    """Return the design matrix of the five parameters of one source at some epochs."""
    frame = np.broadcast_to(tangent_frame(np.array([RA]), np.array([DEC])), (len(epoch), 3, 3))
    return jacobian_at(frame, julian_year(epoch) - EPOCH, observer_at(epoch).position)


def make_history(motions, n_orbits, *, noise=PIXELS_MAS, draws=None, seed=0, artificial=False):
    """Return HISTORY and SHARED_ERRORS of sources with the parameters `motions` (source, 5).

    `draws` are errors of the five parameters in each draw, shape (source, draw, 5), which
    affect the position in every orbit. The truth differs from the catalogue by the motion.
    """
    rng = np.random.default_rng(seed)
    epoch = epochs_of(n_orbits)
    design = design_at(epoch)
    rows = []
    for number, motion in enumerate(motions):
        true = design @ motion
        found = true + noise * rng.standard_normal(true.shape)
        shifts = np.zeros((n_orbits, 2, N_DRAWS))
        if draws is not None:
            shifts = np.einsum("kip,dp->kid", design, draws[number])
        rows.append(
            pd.DataFrame(
                {
                    "source_id": FIRST_ID + number,
                    "orbit_id": np.arange(n_orbits),
                    "epoch": epoch,
                    "is_reference": False,
                    "is_artificial": artificial,
                    "n_obs": 36,
                    "ra": RA,
                    "dec": DEC,
                    "offset_ra": found[:, 0],
                    "offset_dec": found[:, 1],
                    "true_offset_ra": true[:, 0],
                    "true_offset_dec": true[:, 1],
                    "sigma_ra_noise": noise,
                    "sigma_dec_noise": noise,
                    **dict(
                        zip(
                            SHARED_ERRORS.names[1:],
                            shifts.reshape(n_orbits, -1).T,
                            strict=True,
                        )
                    ),
                }
            )
        )
    table = pd.concat(rows, ignore_index=True)
    absent = {name: 0.0 for name in HISTORY.names if name not in table}
    return table.assign(**absent)
