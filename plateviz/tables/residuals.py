"""Tables of residuals on the detectors: vectors, scatter, and means in bins."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.exposures import ExposureKey, is_shown
from plateviz.tables.labels import exposure_labels, id_strings
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.results.diagnosis.rows import onto_focal_plane
from solver.units import MPIX_PER_PIX, RAD_PER_MAS, UM_PER_MM

# Columns of the residuals from which vectors are made.
_OF_VECTORS = [
    *("source_id", "detector_id", "focal_x", "focal_y", "nx", "ny"),
    *("residual_x", "residual_y"),
]


def residual_map(
    result: FitResult,
    instrument: Instrument,
    *,
    exposures: Iterable[ExposureKey] | None = None,
    detector_id: int | None = None,
) -> pd.DataFrame:
    """Return the residual vectors of the shown exposures, on one detector or on all.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the order of the detectors
    exposures : (field_id, plate_id) of each shown exposure; None for all
    detector_id : the detector, or None for all detectors on the focal plane

    Returns
    -------
    `source_id`, `id`, `exposure`, `detector_id`, the tail `x`, `y` and the vector `u`, `v`
    (pix on one detector, mm on the focal plane: the residual rotated by the detector's
    fitted rotation), `mas_per_unit` (mas on the sky per unit of u and v), and the residual
    on the detector in `residual_x_mpix`, `residual_y_mpix`, `residual_x_mas`,
    `residual_y_mas`
    """
    # Several times as fast as a mask, for the few rows of an exposure.
    kept = np.flatnonzero(is_shown(result, exposures, detector_id))
    exposure = result.exposure_index[kept]
    rows = {name: result.residuals[name].to_numpy()[kept] for name in _OF_VECTORS}
    calibration = result.values_on("det")
    detector = instrument.index_of(rows["detector_id"])
    pitch_x, pitch_y = (
        calibration[name].loc[detector].to_numpy() for name in ("pitch_x", "pitch_y")
    )
    # Arrays, because each operation with a column takes as long as with thousands of numbers.
    residual_x, residual_y = rows["residual_x"], rows["residual_y"]
    d_x_um, d_y_um = residual_x * pitch_x, residual_y * pitch_y
    mas_per_um = 1.0 / result.values_on("exp")["focal_length"].to_numpy()[exposure] / RAD_PER_MAS
    if detector_id is None:
        turn = np.radians(calibration["detector_rotation"].to_numpy())
        u, v = onto_focal_plane(np.stack([d_x_um, d_y_um], axis=-1), turn, detector).T / UM_PER_MM
        x, y = rows["focal_x"] / UM_PER_MM, rows["focal_y"] / UM_PER_MM
        mas_per_unit = mas_per_um * UM_PER_MM
    else:
        x, y, u, v = rows["nx"], rows["ny"], residual_x, residual_y
        mas_per_unit = mas_per_um * pitch_x
    return pd.DataFrame(
        {
            "source_id": rows["source_id"],
            "id": id_strings(pd.Series(rows["source_id"])),
            "exposure": exposure_labels(result.exposures).take(exposure).array,
            "detector_id": rows["detector_id"],
            "x": x,
            "y": y,
            "u": u,
            "v": v,
            "mas_per_unit": mas_per_unit,
            "residual_x_mpix": residual_x * MPIX_PER_PIX,
            "residual_y_mpix": residual_y * MPIX_PER_PIX,
            "residual_x_mas": d_x_um * mas_per_um,
            "residual_y_mas": d_y_um * mas_per_um,
        }
    )


def residual_scatter(
    result: FitResult,
    *,
    exposures: Iterable[ExposureKey] | None = None,
    detector_id: int | None = None,
) -> pd.DataFrame:
    """Return residual x against y of the shown exposures, with the expected scatter.

    Parameters
    ----------
    result : the fit
    exposures : (field_id, plate_id) of each shown exposure; None for all
    detector_id : the detector, or None for all

    Returns
    -------
    `source_id`, `id`, `exposure`, `detector_id`, `residual_x_mpix`, `residual_y_mpix`,
    and `expected_x_mpix`, `expected_y_mpix`: the measurement uncertainty reduced by what the
    fit absorbs (half the leverage in each axis)
    """
    rows = result.residuals[is_shown(result, exposures, detector_id)]
    kept = np.sqrt(np.clip(1.0 - 0.5 * rows["leverage"], 0.0, None))
    return pd.DataFrame(
        {
            "source_id": rows["source_id"],
            "id": id_strings(rows["source_id"]),
            "exposure": exposure_labels(rows),
            "detector_id": rows["detector_id"],
            "residual_x_mpix": rows["residual_x"] * MPIX_PER_PIX,
            "residual_y_mpix": rows["residual_y"] * MPIX_PER_PIX,
            "expected_x_mpix": rows["sx"] * kept * MPIX_PER_PIX,
            "expected_y_mpix": rows["sy"] * kept * MPIX_PER_PIX,
        }
    ).reset_index(drop=True)


class ScatterStatistics(NamedTuple):
    """Summary of a table of `residual_scatter`; rms about zero, in mpix."""

    n: int
    n_exposures: int
    rms_x: float
    rms_y: float
    expected_x: float
    expected_y: float


def scatter_statistics(table: pd.DataFrame) -> ScatterStatistics:
    """Return the summary of a table of `residual_scatter` that is not empty."""
    names = ("residual_x_mpix", "residual_y_mpix", "expected_x_mpix", "expected_y_mpix")
    rms = (float(np.sqrt(np.mean(table[name].to_numpy(dtype=float) ** 2))) for name in names)
    return ScatterStatistics(len(table), table["exposure"].nunique(), *rms)


def binned_vectors(
    table: pd.DataFrame,
    *,
    x_range: tuple[float, float],
    y_range: tuple[float, float],
    bins: int,
    least_share: float = 0.0,
) -> pd.DataFrame:
    """Return the mean vector in each bin of a regular grid; empty bins have no row.

    A bin cut by a detector's edge contains few vectors, and their mean is long by chance:
    `least_share` leaves such bins out.

    Parameters
    ----------
    table : tails `x`, `y`, vectors `u`, `v`; other numeric columns are averaged too
    x_range, y_range : limits of the grid; points outside are counted in the edge bins
    bins : number of bins along each axis
    least_share : bins with less than this share of the mean number per bin have no row

    Returns
    -------
    The numeric columns of `table` averaged, including `x` and `y`, and the number of
    vectors `n`
    """
    column = _bin_index(table["x"], x_range, bins)
    row = _bin_index(table["y"], y_range, bins)
    numeric = table.select_dtypes("number").drop(
        columns=["source_id", "detector_id"], errors="ignore"
    )
    groups = numeric.groupby([row, column])
    means = groups.mean()
    means["n"] = groups.size()
    return means[means["n"] >= least_share * means["n"].mean()].reset_index(drop=True)


def _bin_index(values: pd.Series, limits: tuple[float, float], bins: int) -> np.ndarray:
    scaled = (values.to_numpy(dtype=float) - limits[0]) / (limits[1] - limits[0]) * bins
    return np.clip(np.floor(scaled), 0, bins - 1).astype(np.int64)
