"""Tables of one source over the orbits: estimates, catalogue, truth and the fitted motion."""

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.sources import ordered_by_class
from solver.data.survey_schema import MOTION_PARAMETERS
from solver.model.apparent_motion import N_PARAMETERS, julian_year, mjd_of, motion_design
from solver.model.directions import offsets_mas
from solver.units import MAS_PER_DEG

SERIES = ("catalogue", "true", "fit")
_AXES = ("ra", "dec")
_CURVE_POINTS = 361
_TRACK_COLUMNS = [
    *("id", "source_class", "orbit_id", "n_obs", "year", "origin_year"),
    *(f"{name}{axis}_mas" for name in ("", "sigma_", "noise_") for axis in _AXES),
    *(f"{name}_{axis}_mas" for name in SERIES for axis in _AXES),
]


class _Frame(NamedTuple):
    """Origin of the offsets of a source, and the motion of its catalogue entry.

    `catalogue` has the five parameters about (ra, dec) at `origin_year`; `origin` is its position
    at that time, mas; `is_determined` is whether the orbits determine the parameters.
    """

    ra: float
    dec: float
    origin_year: float
    catalogue: np.ndarray
    origin: np.ndarray
    is_determined: bool


def source_track(history: pd.DataFrame, motion: pd.Series | None) -> pd.DataFrame:
    """Return the positions of one source at the epochs of its orbits.

    Parameters
    ----------
    history : rows of `survey_schema.HISTORY` of the source
    motion : its row of `survey_schema.MOTIONS`, or None

    Returns
    -------
    A row per orbit in order of epoch: `id`, `source_class`, `orbit_id`, `n_obs`, `year`
    (Julian), and in ra cos(dec) and dec, mas: the estimate `ra_mas`, `dec_mas`, its marginal
    `sigma_ra_mas`, `sigma_dec_mas` and `noise_ra_mas`, `noise_dec_mas` (the part that scatters
    between orbits), `catalogue_*_mas`, `true_*_mas` and `fit_*_mas` (NaN where there is none);
    the origin is the catalogue's position at `origin_year`, the epoch of the fitted motion, or
    the mean one of the orbits where they do not reach it
    """
    rows = history.sort_values(["epoch", "orbit_id"], kind="stable").reset_index(drop=True)
    if rows.empty:
        return pd.DataFrame(columns=_TRACK_COLUMNS)
    frame = _frame(rows, motion)
    catalogue = _catalogue_places(rows, frame.ra, frame.dec) - frame.origin
    fit = catalogue + _fitted(frame, rows["epoch"].to_numpy(dtype=float), motion)
    table = pd.DataFrame(
        {
            "id": id_strings(rows["source_id"]),
            "source_class": ordered_by_class(rows.head(1))["source_class"].iloc[0],
            "orbit_id": rows["orbit_id"],
            "n_obs": rows["n_obs"],
            "year": julian_year(rows["epoch"]),
            "origin_year": frame.origin_year,
        }
    )
    for k, axis in enumerate(_AXES):
        table[f"{axis}_mas"] = catalogue[:, k] + rows[f"offset_{axis}"]
        table[f"sigma_{axis}_mas"] = rows[f"sigma_{axis}_marginal"]
        table[f"noise_{axis}_mas"] = rows[f"sigma_{axis}_noise"]
        table[f"catalogue_{axis}_mas"] = catalogue[:, k]
        table[f"true_{axis}_mas"] = catalogue[:, k] + rows[f"true_offset_{axis}"]
        table[f"fit_{axis}_mas"] = fit[:, k]
    return table[_TRACK_COLUMNS]


def source_curves(history: pd.DataFrame, motion: pd.Series | None) -> pd.DataFrame:
    """Return the motion of one source between its orbits, with the origin of `source_track`.

    Returns
    -------
    `year` and, mas, `catalogue_*_mas`, `true_*_mas`, `fit_*_mas` and the uncertainty of the
    fit `fit_sigma_ra_mas`, `fit_sigma_dec_mas`; no rows if the orbits are too few, or too
    close in time, to determine the motion
    """
    rows = history.sort_values(["epoch", "orbit_id"], kind="stable").reset_index(drop=True)
    names = [f"{series}_{axis}_mas" for series in (*SERIES, "fit_sigma") for axis in _AXES]
    frame = _frame(rows, motion) if len(rows) else None
    if frame is None or not frame.is_determined:
        return pd.DataFrame(columns=["year", *names], dtype=float)
    mjd = np.linspace(rows["epoch"].min(), rows["epoch"].max(), _CURVE_POINTS)
    design = motion_design(frame.ra, frame.dec, mjd, frame.origin_year)
    at_orbits = motion_design(frame.ra, frame.dec, rows["epoch"].to_numpy(), frame.origin_year)
    catalogue = design @ frame.catalogue - frame.origin
    true_offset = _solve(at_orbits, rows[["true_offset_ra", "true_offset_dec"]].to_numpy())
    series = {
        "catalogue": catalogue,
        "true": catalogue + design @ true_offset,
        "fit": catalogue + _fitted(frame, mjd, motion),
        "fit_sigma": _fit_sigma(rows, at_orbits, design),
    }
    table = pd.DataFrame({"year": julian_year(mjd)})
    for name, values in series.items():
        for k, axis in enumerate(_AXES):
            table[f"{name}_{axis}_mas"] = values[:, k]
    return table


def catalogue_motion(history: pd.DataFrame) -> tuple[float, float, float]:
    """Return parallax (mas) and proper motion (mas/yr) of the catalogue, from its positions.

    Parameters
    ----------
    history : rows of `survey_schema.HISTORY` of the source, at least one

    Returns
    -------
    NaN if the orbits are too few, or too close in time, to determine the motion
    """
    frame = _frame(history.reset_index(drop=True), None)
    if not frame.is_determined:
        return math.nan, math.nan, math.nan
    _, _, parallax, pmra, pmdec = frame.catalogue.tolist()
    return parallax, pmra, pmdec


def _frame(rows: pd.DataFrame, motion: pd.Series | None) -> _Frame:
    """Return the origin and the catalogue's motion, fitted to its positions at the orbits."""
    dec = float(rows["dec"].iloc[0] - rows["offset_dec"].iloc[0] / MAS_PER_DEG)
    east = float(rows["offset_ra"].iloc[0] / np.cos(np.radians(rows["dec"].iloc[0])))
    ra = float(rows["ra"].iloc[0] - east / MAS_PER_DEG)
    mjd = rows["epoch"].to_numpy(dtype=float)
    origin_year = _origin_year(mjd, motion)
    design = motion_design(ra, dec, mjd, origin_year)
    parameters = _solve(design, _catalogue_places(rows, ra, dec))
    at_mean = motion_design(ra, dec, mjd_of(np.array([origin_year])), origin_year)[0]
    rank = int(np.linalg.matrix_rank(design.reshape(-1, N_PARAMETERS)))
    return _Frame(ra, dec, origin_year, parameters, at_mean @ parameters, rank == N_PARAMETERS)


def _origin_year(mjd: np.ndarray, motion: pd.Series | None) -> float:
    if motion is not None:
        first, last = julian_year(np.array([mjd.min(), mjd.max()]))
        if first <= motion["epoch"] <= last:
            return float(motion["epoch"])
    return float(julian_year(mjd.mean()))


def _catalogue_places(rows: pd.DataFrame, ra: float, dec: float) -> np.ndarray:
    """Return the catalogue's position of the source at each orbit, mas from (ra, dec)."""
    d_ra, d_dec = offsets_mas(rows["ra"].to_numpy(), rows["dec"].to_numpy(), ra, dec)
    return np.stack([d_ra, d_dec], axis=-1) - rows[["offset_ra", "offset_dec"]].to_numpy()


def _solve(design: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the five parameters fitted to positions, shape (n, 2); NaN if a position is NaN."""
    if not np.isfinite(places).all():
        return np.full(N_PARAMETERS, np.nan)
    return np.linalg.lstsq(design.reshape(-1, N_PARAMETERS), places.reshape(-1), rcond=None)[0]


def _fitted(frame: _Frame, mjd: np.ndarray, motion: pd.Series | None) -> np.ndarray:
    """Return fitted minus catalogue position, mas, shape (n, 2); NaN where there is no fit."""
    if motion is None:
        return np.full((len(mjd), 2), np.nan)
    fit = motion[[f"fit_{name}" for name in MOTION_PARAMETERS]].to_numpy(dtype=float)
    return motion_design(frame.ra, frame.dec, mjd, float(motion["epoch"])) @ fit


def _fit_sigma(rows: pd.DataFrame, at_orbits: np.ndarray, design: np.ndarray) -> np.ndarray:
    """Return the uncertainty of the fitted position at the rows of `design`, mas, shape (n, 2).

    The noise part follows from the weights of the orbits. The variance from the catalogue's
    errors, which are shared by all orbits, is quadratic in time, as that of a position with a
    proper motion.
    """
    sigma = rows[["sigma_ra_noise", "sigma_dec_noise"]].to_numpy(dtype=float)
    covariance = sigma[:, :, None] * sigma[:, None, :]
    covariance[:, 0, 1] *= rows["corr_noise"]
    covariance[:, 1, 0] *= rows["corr_noise"]
    weighted = np.linalg.solve(covariance, at_orbits)
    of_motion = np.linalg.pinv(np.einsum("nai,naj->ij", at_orbits, weighted), hermitian=True)
    noise = np.einsum("nai,ij,naj->na", design, of_motion, design)
    shared = rows[["sigma_ra_catalogue", "sigma_dec_catalogue"]].to_numpy(dtype=float) ** 2
    # Column 3 of the design is the time in RA; it is the same for both coordinates.
    powers, wanted = (np.vander(d[:, 0, 3], 3) for d in (at_orbits, design))
    catalogue = wanted @ np.linalg.lstsq(powers, shared, rcond=None)[0]
    return np.sqrt(noise + np.clip(catalogue, 0.0, None))
