"""Table of the difference between two calibrations of the focal plane, as a vector field."""

import math

import numpy as np
import pandas as pd

from plateviz.tables.mean_calibration import (
    MeanCalibration,
    fitted_calibration,
    simulated_calibration,
)
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.simulate.true_calibration import TrueCalibration
from solver.units import PPM, RAD_PER_ARCSEC, RAD_PER_MAS, UM_PER_MM

ALONE, TOGETHER = "distortion alone", "distortion and detectors"
_POINTS = 256
_LEAST_PER_SIDE = 3


def distortion_comparison(
    result_a: FitResult, result_b: FitResult, instrument: Instrument
) -> pd.DataFrame:
    """Return calibration B minus calibration A on a grid of pixels of every detector.

    A star at the same place of the sky lies elsewhere on the detectors in B than in A. The
    pointing, the roll and the focal length of the exposures absorb a common shift, rotation
    and scale of the field; the ones that fit the grid best are removed. A shift includes its
    projection: away from the centre it is longer, as on a tangent plane.

    Of what changes from exposure to exposure it is the mean. Each detector's own distortion is one
    of the detectors.

    The distortion alone is not determined as well as the distortion and the detectors together:
    if all detectors move against the optical axis, the distortion about the new axis has other
    coefficients, but every star stays where it was.

    What a fit includes that shifts stars by their magnitude or by their place within a pixel is
    not compared, and named in the column `left_out`.

    A detector without measurements in a fit, which is where its prior has it, has no points.

    Parameters
    ----------
    result_a : the fit taken as reference
    result_b : the fit compared with it
    instrument : of both fits; gives the pixels and the scale s of the polynomials

    Returns
    -------
    A row per part ("distortion alone", "distortion and detectors") and point: `part`,
    `detector_id`, the tail `x`, `y` (ideal position in A) and the difference `u`, `v` in mm,
    `mas_per_unit` (mas per mm), the difference as `dx_um`, `dy_um`, `dx_mas`, `dy_mas`, and
    what was removed: `shift_um`, `roll_arcsec`, `scale_ppm`; `left_out`: what was not compared,
    as text, empty where the fits have no more than this
    """
    a, b = (fitted_calibration(one, instrument) for one in (result_a, result_b))
    is_measured = _measured(result_a, instrument) & _measured(result_b, instrument)
    return _difference(a, b, instrument, is_measured)


def distortion_truth(
    result: FitResult, truth: TrueCalibration, instrument: Instrument
) -> pd.DataFrame:
    """Return a fitted calibration minus the true one.

    The true focal length is not used: what a wrong one would change is removed as a scale.

    Parameters
    ----------
    result : the fit
    truth : of its orbit
    instrument : the nominal one; gives the pixels and the scale s of the polynomials

    Returns
    -------
    As from `distortion_comparison`, and `source_mas`: the median marginal sigma of a coordinate of
    a source, of which the calibration is a part
    """
    found = fitted_calibration(result, instrument)
    simulated = simulated_calibration(truth, instrument)
    table = _difference(simulated, found, instrument, _measured(result, instrument))
    sigma = result.sources[["sigma_ra_marginal", "sigma_dec_marginal"]].to_numpy()
    return table.assign(source_mas=np.median(sigma))


def _measured(result: FitResult, instrument: Instrument) -> np.ndarray:
    """Return which detectors a fit has measurements of."""
    return np.isin(instrument.detector_ids, result.residuals["detector_id"].unique())


def _difference(
    a: MeanCalibration, b: MeanCalibration, instrument: Instrument, is_measured: np.ndarray
) -> pd.DataFrame:
    numbers, pixels = _grid(instrument)
    numbers, pixels = numbers[is_measured[numbers]], pixels[is_measured[numbers]]
    focal, scale = a.focal_length, instrument.distortion_scale_um
    places_a, places_b = (one.ideal(scale, numbers, pixels) for one in (a, b))
    moved = focal * (places_a / focal - places_b / b.focal_length)
    by_optics = b.displaced(places_a, scale) - a.displaced(places_a, scale)
    ids = np.array(instrument.detector_ids)[numbers]
    parts = [
        _part(name, ids, places_a, difference, focal)
        for name, difference in ((ALONE, by_optics), (TOGETHER, moved))
    ]
    return pd.concat(parts, ignore_index=True).assign(left_out=_left_out(a, b))


def _left_out(a: MeanCalibration, b: MeanCalibration) -> str:
    """Return what either calibration leaves out, in lower case and separated by commas."""
    return ", ".join(dict.fromkeys(one.lower() for one in (*a.left_out, *b.left_out)))


def _part(
    name: str, ids: np.ndarray, places: np.ndarray, difference: np.ndarray, focal: float
) -> pd.DataFrame:
    rest, (shift_x, shift_y, roll, scale) = _without_common(places, difference, focal)
    mas_per_um = 1.0 / focal / RAD_PER_MAS
    return pd.DataFrame(
        {
            "part": name,
            "detector_id": ids,
            "x": places[:, 0] / UM_PER_MM,
            "y": places[:, 1] / UM_PER_MM,
            "u": rest[:, 0] / UM_PER_MM,
            "v": rest[:, 1] / UM_PER_MM,
            "mas_per_unit": mas_per_um * UM_PER_MM,
            "dx_um": rest[:, 0],
            "dy_um": rest[:, 1],
            "dx_mas": rest[:, 0] * mas_per_um,
            "dy_mas": rest[:, 1] * mas_per_um,
            "shift_um": math.hypot(shift_x, shift_y),
            "roll_arcsec": roll / RAD_PER_ARCSEC,
            "scale_ppm": scale / PPM,
        }
    )


def _without_common(
    places: np.ndarray, difference: np.ndarray, focal: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the differences without the common shift, roll and scale, and these (um, rad, 1)."""
    x, y = places.T
    zero = np.zeros_like(x)
    # A small rotation of the sphere about each of three axes, on the tangent plane, and a scale.
    terms = np.array(
        [
            (1.0 + (x / focal) ** 2, x * y / focal**2),
            (x * y / focal**2, 1.0 + (y / focal) ** 2),
            (zero - y, zero + x),
            (x, y),
        ]
    ).reshape(4, -1)
    # Columns of one size, so that none is lost by rounding.
    size = np.maximum(np.linalg.norm(terms, axis=1), np.finfo(float).tiny)
    found, *_ = np.linalg.lstsq((terms.T / size), difference.T.ravel(), rcond=None)
    common = (terms.T @ (found / size)).reshape(2, -1).T
    return difference - common, found / size


def _grid(instrument: Instrument) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the detector and the pixel coordinates of each point of the grid."""
    detectors = instrument.detectors
    side = max(_LEAST_PER_SIDE, math.isqrt(_POINTS // len(detectors)))
    unit = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, side)] * 2), axis=-1).reshape(-1, 2)
    pixels = np.concatenate([unit * (d.n_x, d.n_y) for d in detectors])
    return np.repeat(np.arange(len(detectors)), len(unit)), pixels
