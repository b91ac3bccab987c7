"""Sky positions of points on the focal plane."""

import numpy as np
import pandas as pd

from solver.model.astrometry import sky_position
from solver.model.directions import mean_direction, places_about, tangent_frame, unproject
from solver.units import ARCMIN_PER_DEG


def sky_of_focal_plane(ideal_um: np.ndarray, pointing: pd.Series) -> tuple[np.ndarray, np.ndarray]:
    """Return the sky positions of points on the ideal focal plane of one exposure.

    Parameters
    ----------
    ideal_um : undistorted focal-plane x and y, um, shape (n, 2)
    pointing : `pointing_ra`, `pointing_dec`, `position_angle` in deg, `focal_length` in um

    Returns
    -------
    ra, dec : deg, shape (n,)
    """
    place = [np.array([pointing[f"pointing_{axis}"]]) for axis in ("ra", "dec")]
    angle, focal_length = np.radians(pointing["position_angle"]), pointing["focal_length"]
    return sky_position(unproject(ideal_um, tangent_frame(*place)[0], angle, focal_length))


def centre_of(sources: pd.DataFrame) -> tuple[float, float]:
    """Return right ascension and declination of the mean direction of sources, deg."""
    return mean_direction(sources["ra"].to_numpy(), sources["dec"].to_numpy())


def places_arcmin(rows: pd.DataFrame, centre: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of rows with `ra` and `dec` in the plane tangent at `centre`, arcmin.

    Returns
    -------
    to East and to North, shape (n,)
    """
    places = ARCMIN_PER_DEG * places_about(centre, rows["ra"].to_numpy(), rows["dec"].to_numpy())
    return places[:, 0], places[:, 1]
