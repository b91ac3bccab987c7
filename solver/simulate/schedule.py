"""Schedule of the exposures, and the true attitude of the telescope.

Paper, section "Survey Design", Table (exp:schedule) and Eqs. (exp:pointing,
exp:pointing:succeed, exp:efl).
"""

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.schema import ENVIRONMENT
from solver.simulate.seasons import Season
from solver.simulate.settings import SurveySettings
from solver.simulate.sky import galactic_to_icrs, position_angle_to_icrs
from solver.simulate.streams import Stream
from solver.units import ARCSEC_PER_DEG, SECONDS_PER_DAY


def schedule(settings: SurveySettings) -> pd.DataFrame:
    """Return the schedule of all orbits; columns as from `orbit_schedule`."""
    return pd.concat(
        [orbit_schedule(orbit_id, settings) for orbit_id in range(settings.orbits)],
        ignore_index=True,
    )


def orbit_schedule(orbit_id: int, settings: SurveySettings) -> pd.DataFrame:
    """Return the scheduled exposures of one orbit, in order of time.

    Orbits start at equal time steps, counted over the seasons without the breaks between them,
    so times depend on the number of orbits. The fields of an orbit depend on its id alone.

    Returns
    -------
    orbit_id, field_id, plate_id, obstime (middle of the exposure, MJD in TCB), glon, glat
    and pa (Galactic, deg)
    """
    season, start = _start(orbit_id, settings)
    count = settings.exposures_per_field
    fields = np.repeat(np.arange(settings.n_fields), count)
    plates = np.tile(np.arange(count), settings.n_fields)
    per_field = count * settings.exposure_s + settings.field_change_s
    seconds = fields * per_field + (plates + 0.5) * settings.exposure_s
    glon, glat = _field_centres(orbit_id, settings)
    return pd.DataFrame(
        {
            "orbit_id": np.full(len(fields), orbit_id, dtype=np.int64),
            "field_id": fields,
            "plate_id": plates,
            "obstime": start + seconds / SECONDS_PER_DAY,
            "glon": glon[fields],
            "glat": glat[fields],
            "pa": float(season.position_angle_deg),
        }
    )


def attitude(
    exposures: pd.DataFrame,
    settings: SurveySettings,
    focal_length_um: float,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """Return the true pointings and focal lengths of one orbit, with their estimates.

    The pointing error is drawn anew for each field, Eq. (exp:pointing), and follows a random
    walk from exposure to exposure, Eq. (exp:pointing:succeed). The focal length follows a
    random walk over the whole orbit, Eq. (exp:efl).

    Parameters
    ----------
    exposures : as from `orbit_schedule`
    focal_length_um : nominal focal length

    Returns
    -------
    `exposures` with the true pointing `ra`, `dec` and `position_angle` (ICRS, apparent,
    deg) and `true_focal_length` (um), and all columns of `schema.ENVIRONMENT`
    """
    offsets = _pointing_offsets(exposures["field_id"].to_numpy(), settings, rng) / ARCSEC_PER_DEG
    glat = exposures["glat"].to_numpy()
    true_l = exposures["glon"].to_numpy() + offsets[:, 0] / np.cos(np.radians(glat))
    true_b = glat + offsets[:, 1]
    ra, dec = galactic_to_icrs(true_l, true_b)
    angle = position_angle_to_icrs(true_l, true_b, exposures["pa"].to_numpy() + offsets[:, 2])
    scale = _focal_length_factors(len(exposures), settings, rng)
    error = settings.estimate_arcsec / ARCSEC_PER_DEG * rng.standard_normal((3, len(exposures)))
    return exposures.assign(
        ra=ra,
        dec=dec,
        position_angle=angle,
        true_focal_length=focal_length_um * scale,
        ra_est=ra + error[0] / np.cos(np.radians(dec)),
        dec_est=dec + error[1],
        pa_est=angle + error[2],
        focal_length=float(focal_length_um),
        satellite_vx=0.0,
        satellite_vy=0.0,
        satellite_vz=0.0,
    )


def orbit_attitude(orbit_id: int, settings: SurveySettings, focal_length_um: float) -> pd.DataFrame:
    """Return schedule and attitude of one orbit, with the random numbers of that orbit."""
    return attitude(
        orbit_schedule(orbit_id, settings),
        settings,
        focal_length_um,
        settings.rng(Stream.ATTITUDE, orbit_id),
    )


def environment(attitudes: pd.DataFrame) -> pd.DataFrame:
    """Return the columns known to the observer: `schema.ENVIRONMENT`."""
    return attitudes[ENVIRONMENT.names]


def _start(orbit_id: int, settings: SurveySettings) -> tuple[Season, float]:
    """Return the season of an orbit and its start, MJD."""
    elapsed = orbit_id * settings.season_days / settings.orbits
    for season in settings.seasons:
        length = season.end_mjd - season.start_mjd
        if elapsed < length or season is settings.seasons[-1]:
            break
        elapsed -= length
    return season, season.start_mjd + elapsed


def _field_centres(
    orbit_id: int, settings: SurveySettings
) -> tuple[Float[np.ndarray, " field"], Float[np.ndarray, " field"]]:
    """Return the field centres (l, b) of an orbit, deg, in pairs of fields that overlap by half."""
    spread = settings.pair_spread_deg
    shifts = settings.rng(Stream.FIELDS, orbit_id).uniform(
        -spread, spread, (len(settings.pair_axes), 2)
    )
    along = {"l": np.array([1.0, 0.0]), "b": np.array([0.0, 1.0])}
    quarter = 0.25 * settings.field_width_deg
    offsets = np.array(
        [
            shift + side * quarter * along[axis]
            for shift, axis in zip(shifts, settings.pair_axes, strict=True)
            for side in (-1.0, 1.0)
        ]
    )
    glat = settings.target_deg[1] + offsets[:, 1]
    return settings.target_deg[0] + offsets[:, 0] / np.cos(np.radians(glat)), glat


def _pointing_offsets(
    fields: np.ndarray, settings: SurveySettings, rng: np.random.Generator
) -> Float[np.ndarray, "exp 3"]:
    """Return offsets of l cos(b), b and position angle from the schedule, arcsec."""
    steps = rng.standard_normal((len(fields), 3))
    starts = np.flatnonzero(np.diff(fields, prepend=-1))
    sigma = np.full((len(fields), 1), settings.pointing_walk_arcsec)
    sigma[starts] = settings.pointing_start_arcsec
    return np.concatenate([np.cumsum(part, axis=0) for part in np.split(sigma * steps, starts[1:])])


def _focal_length_factors(
    number: int, settings: SurveySettings, rng: np.random.Generator
) -> Float[np.ndarray, " exp"]:
    sigma = np.full(number, settings.focal_length_walk)
    sigma[0] = settings.focal_length_start
    return np.cumprod(1.0 + sigma * rng.standard_normal(number))
