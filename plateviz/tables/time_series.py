"""Table of one source's offsets in each coordinate against time."""

import numpy as np
import pandas as pd

from plateviz.tables.source_track import SERIES, source_curves, source_track

_AXES = ("ra", "dec")
_COLUMNS = [
    *("coordinate", "kind", "id", "source_class", "orbit_id", "n_obs", "year", "zero"),
    *("offset_mas", "sigma_mas", "catalogue_mas", "true_mas", "fit_mas", "fit_sigma_mas"),
    *("residual_mas", "noise_mas", "pull"),
]
# The origin of the offsets: the first of these that exists.
_ZEROS = ("true", "fit", "catalogue")
# The catalogue is left out if it is further away than this multiple of the largest offset.
_CATALOGUE_REACH = 3.0
# If the mean offset from the catalogue exceeds this many sigmas, it is the origin instead.
_CATALOGUE_SIGMAS = 20.0


def time_series(history: pd.DataFrame, motion: pd.Series | None) -> pd.DataFrame:
    """Return the offsets of one source in each coordinate at its orbits and between them.

    The origin is the truth, else the fitted motion, else the catalogue; if the estimates lie
    far from the catalogue, it is the catalogue's motion shifted to their mean.

    Parameters
    ----------
    history : rows of `survey_schema.HISTORY` of the source
    motion : its row of `survey_schema.MOTIONS`, or None

    Returns
    -------
    A row per coordinate ("ra", "dec") and time, of the `kind` "orbit" or "curve", with `year`
    (Julian) and, mas, `catalogue_mas`, `true_mas`, `fit_mas` (NaN where there is none, or
    where the catalogue is far away); `zero` is the origin ("true", "fit", "catalogue",
    "mean"). Rows of orbits have `id`, `source_class`, `orbit_id`, `n_obs`, the estimate
    `offset_mas` and its marginal `sigma_mas`, `residual_mas` (estimate minus fitted motion),
    `noise_mas` (sigma of the part that scatters between orbits) and `pull` (residual_mas over
    noise_mas); rows of the curve have `fit_sigma_mas`. No rows without an orbit
    """
    return series_of(source_track(history, motion), source_curves(history, motion))


def series_of(track: pd.DataFrame, curves: pd.DataFrame) -> pd.DataFrame:
    """Return `time_series` from `source_track` and `source_curves`."""
    if track.empty:
        return pd.DataFrame(columns=_COLUMNS)
    parts = [("orbit", track), ("curve", curves)]
    zero = _zero(track)
    shift = {axis: _mean_offset(track, axis) if zero == "mean" else 0.0 for axis in _AXES}
    table = pd.concat(
        [
            _coordinate(rows, axis, zero, shift[axis]).assign(kind=kind)
            for axis in _AXES
            for kind, rows in parts
            if len(rows)
        ],
        ignore_index=True,
    )
    if zero == "mean" or (zero != "catalogue" and _is_far(table)):
        table["catalogue_mas"] = np.nan
    return table.reindex(columns=_COLUMNS)


def _zero(track: pd.DataFrame) -> str:
    zero = next(name for name in _ZEROS if track[f"{name}_ra_mas"].notna().all())
    far = (
        abs(_mean_offset(track, axis)) > _CATALOGUE_SIGMAS * track[f"sigma_{axis}_mas"].median()
        for axis in _AXES
    )
    return "mean" if zero == "catalogue" and any(far) else zero


def _mean_offset(track: pd.DataFrame, axis: str) -> float:
    return float((track[f"{axis}_mas"] - track[f"catalogue_{axis}_mas"]).mean())


def _coordinate(rows: pd.DataFrame, axis: str, zero: str, shift: float) -> pd.DataFrame:
    origin = rows[f"{'catalogue' if zero == 'mean' else zero}_{axis}_mas"] + shift
    table = pd.DataFrame({f"{name}_mas": rows[f"{name}_{axis}_mas"] - origin for name in SERIES})
    table = table.assign(coordinate=axis, zero=zero, year=rows["year"])
    if "orbit_id" not in rows:
        return table.assign(fit_sigma_mas=rows[f"fit_sigma_{axis}_mas"])
    residual = rows[f"{axis}_mas"] - rows[f"fit_{axis}_mas"]
    noise = rows[f"noise_{axis}_mas"]
    return table.assign(
        **{name: rows[name] for name in ("id", "source_class", "orbit_id", "n_obs")},
        offset_mas=rows[f"{axis}_mas"] - origin,
        sigma_mas=rows[f"sigma_{axis}_mas"],
        residual_mas=residual,
        noise_mas=noise,
        pull=residual / noise,
    )


def _is_far(table: pd.DataFrame) -> bool:
    orbits = table[table["kind"] == "orbit"]
    reach = float((orbits["offset_mas"].abs() + orbits["sigma_mas"]).max())
    return float(orbits["catalogue_mas"].abs().max()) > _CATALOGUE_REACH * reach
