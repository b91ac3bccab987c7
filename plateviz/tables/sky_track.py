"""Table of one source's motion on the sky, as offsets from a fixed point."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.source_track import SERIES, source_curves, source_track

_AXES = ("ra", "dec")
# The origin if the catalogue is far away: the first series that exists.
_ZEROS = ("true", "fit")
# Minimum distance in sigmas up to which the catalogue is drawn, for tracks shorter than that.
_LEAST_EXTENT_SIGMAS = 10.0


class TrackStatistics(NamedTuple):
    """Number of orbits, and rms separation from the truth in each coordinate and in 2-D.

    The separations are in mas, NaN without a truth.
    """

    n: int
    rms_ra: float
    rms_dec: float
    rms_2d: float


def sky_track(history: pd.DataFrame, motion: pd.Series | None) -> pd.DataFrame:
    """Return the positions of one source at its orbits and between them, in the tangent plane.

    The origin is the catalogue's position at `origin_year`. If the catalogue lies further
    away than the source itself moves, it is left out (NaN), and the origin is the true position
    at that time, else the fitted one, else the mean of the estimates.

    Parameters
    ----------
    history : rows of `survey_schema.HISTORY` of the source
    motion : its row of `survey_schema.MOTIONS`, or None

    Returns
    -------
    Rows of the `kind` "orbit" with all columns of `tables.source_track`, and of the kind
    "curve" with those of `tables.source_curves`; repeated along the table `zero` (the origin:
    "catalogue", "true", "fit" or "mean"), `origin_year` and `rms_catalogue_mas`, the rms
    separation from the catalogue (2-D). No rows without an orbit
    """
    return sky_track_of(source_track(history, motion), source_curves(history, motion))


def sky_track_of(track: pd.DataFrame, curves: pd.DataFrame) -> pd.DataFrame:
    """Return `sky_track` from `source_track` and `source_curves`."""
    if track.empty:
        return track.assign(kind="", zero="", rms_catalogue_mas=np.nan)
    distance = [track[f"{axis}_mas"] - track[f"catalogue_{axis}_mas"] for axis in _AXES]
    zero = "catalogue" if _is_near(track, distance) else _zero(track)
    summary = {
        "zero": zero,
        "origin_year": track["origin_year"].iloc[0],
        "rms_catalogue_mas": float(np.sqrt(np.mean(distance[0] ** 2 + distance[1] ** 2))),
    }
    origin = [_origin(track, curves, zero, axis) for axis in _AXES]
    kinds = (("orbit", track), ("curve", curves))
    table = pd.concat(
        [rows.assign(kind=kind) for kind, rows in kinds if len(rows)], ignore_index=True
    )
    for axis, shift in zip(_AXES, origin, strict=True):
        for name in ("", *(f"{series}_" for series in SERIES)):
            table[f"{name}{axis}_mas"] -= shift
        if zero != "catalogue":
            table[f"catalogue_{axis}_mas"] = np.nan
    return table.assign(**summary)


def track_statistics(table: pd.DataFrame) -> TrackStatistics:
    """Return the summary of a `sky_track` that is not empty."""
    rows = table[table["kind"] == "orbit"]
    squares = [float(((rows[f"{a}_mas"] - rows[f"true_{a}_mas"]) ** 2).mean()) for a in _AXES]
    return TrackStatistics(len(rows), squares[0] ** 0.5, squares[1] ** 0.5, sum(squares) ** 0.5)


def _is_near(track: pd.DataFrame, distance: list[pd.Series]) -> bool:
    """Return whether the catalogue is no further away than the source itself moves."""
    extents = [float(np.ptp(track[f"{axis}_mas"])) for axis in _AXES]
    sigmas = [float(track[f"sigma_{axis}_mas"].median()) for axis in _AXES]
    furthest = max(float(difference.abs().max()) for difference in distance)
    return furthest <= max(*extents, *(_LEAST_EXTENT_SIGMAS * sigma for sigma in sigmas))


def _zero(track: pd.DataFrame) -> str:
    found = (name for name in _ZEROS if track[f"{name}_ra_mas"].notna().all())
    return next(found, "mean")


def _origin(track: pd.DataFrame, curves: pd.DataFrame, zero: str, axis: str) -> float:
    """Return the origin in one coordinate, mas from the catalogue's position at its epoch."""
    if zero == "catalogue":
        return 0.0
    if zero == "mean":
        return float(track[f"{axis}_mas"].mean())
    if curves.empty:
        return float(track[f"{zero}_{axis}_mas"].mean())
    at = float(track["origin_year"].iloc[0])
    return float(np.interp(at, curves["year"], curves[f"{zero}_{axis}_mas"]))
