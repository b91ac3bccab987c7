"""MeanCalibration: where the stars of an orbit fall on the focal plane, mean of its exposures."""

from typing import NamedTuple

import numpy as np

from plateviz.tables.calibration import displacement_um
from solver.data.detector_spans import motion_elements
from solver.data.instrument import Instrument
from solver.data.parameters import Axis
from solver.data.result import FitResult
from solver.problem.term_factors import changing_terms, own_frames
from solver.results.diagnosis.rows import detector_spans, onto_focal_plane
from solver.simulate.true_calibration import TrueCalibration
from solver.units import PPM, RAD_PER_ARCSEC

# The distortion changes by less than a hundredth of the distance: each step of the inversion
# gains two digits or more.
_INVERSION_STEPS = 10


class MeanCalibration(NamedTuple):
    """Calibration of the focal plane, with all that does not depend on the star.

    Attributes
    ----------
    coefficients : of the distortion along x and y, um, shape (n, 2)
    centre, rotation, pitch, skew : of each detector, um, rad, um and rad
    own : coefficients of each detector's own distortion, um, shape (detector, m, 2)
    own_centre, own_scale : origin and unit of its terms, um
    anisotropy : difference of the focal lengths along y and x over their mean
    focal_length : um
    """

    coefficients: np.ndarray
    centre: np.ndarray
    rotation: np.ndarray
    pitch: np.ndarray
    skew: np.ndarray
    own: np.ndarray
    own_centre: np.ndarray
    own_scale: np.ndarray
    anisotropy: float
    focal_length: float

    def ideal(self, scale_um: float, numbers: np.ndarray, pixels: np.ndarray) -> np.ndarray:
        """Return undistorted positions, um: the inverse of Eq. (exp:model:nxny).

        Parameters
        ----------
        scale_um : of the polynomials
        numbers, pixels : number of the detector, and place on it from its centre
        """
        x, y = pixels.T
        vector = np.stack([x - self.skew[numbers] * y, y], axis=-1) * self.pitch[numbers]
        turned = onto_focal_plane(vector, self.rotation, numbers)
        focal_plane = self.centre[numbers] + turned
        ideal = focal_plane
        for _ in range(_INVERSION_STEPS):
            moved = self.displaced(ideal, scale_um) + self._displaced_alone(ideal, numbers)
            ideal = focal_plane - moved
        return ideal / (1.0 + 0.5 * self.anisotropy * np.array([-1.0, 1.0]))

    def displaced(self, places: np.ndarray, scale_um: float) -> np.ndarray:
        """Return the displacement by the distortion of all detectors, um."""
        return _displacement(self.coefficients, places / scale_um)

    def _displaced_alone(self, places: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Return the displacement by the own distortion of each detector, um."""
        moved = np.zeros_like(places)
        for number, coefficients in enumerate(self.own):
            on_it = numbers == number
            scaled = (places[on_it] - self.own_centre[number]) / self.own_scale[number]
            moved[on_it] = _displacement(coefficients, scaled)
        return moved


def fitted_calibration(result: FitResult, instrument: Instrument) -> MeanCalibration:
    """Return the calibration of a fit."""
    detectors, n_det = result.values_on("det"), len(instrument.detectors)
    settings, skew = result.settings, np.zeros(n_det)
    own = np.empty((n_det, 0, 2))
    if settings.detector_distortion:
        own = _pairs(result, "own", "own_distortion").reshape(n_det, -1, 2)
        skew = np.radians(detectors["detector_skew"].to_numpy())
    moved = _mean_motion(result, n_det)
    exposures = result.values_on("exp")
    anisotropy = float(exposures["focal_anisotropy"].mean()) if settings.focal_anisotropy else 0.0
    return MeanCalibration(
        _mean_coefficients(result),
        detectors[["detector_x", "detector_y"]].to_numpy() + moved[:, :2],
        np.radians(detectors["detector_rotation"].to_numpy()) + RAD_PER_ARCSEC * moved[:, 2],
        detectors[["pitch_x", "pitch_y"]].to_numpy(),
        skew,
        own,
        *own_frames(instrument),
        PPM * anisotropy,
        float(exposures["focal_length"].mean()),
    )


def simulated_calibration(truth: TrueCalibration, instrument: Instrument) -> MeanCalibration:
    """Return the calibration of a simulation; `instrument` is the nominal one."""
    detectors = truth.instrument.detectors
    return MeanCalibration(
        truth.coefficients,
        np.array([(d.x_um, d.y_um) for d in detectors]),
        np.radians([d.rotation_deg for d in detectors]),
        np.array([(d.pitch_x_um, d.pitch_y_um) for d in detectors]),
        np.zeros(len(detectors)),
        np.empty((len(detectors), 0, 2)),
        *own_frames(instrument),
        0.0,
        truth.instrument.focal_length_um,
    )


def _mean_coefficients(result: FitResult) -> np.ndarray:
    """Return the coefficients of the distortion, those of its changes among them."""
    found = [_pairs(result, "coef", "distortion")]
    for terms, factor in changing_terms(result.exposures, result.settings):
        of_functions = _pairs(result, terms.axis, terms.name).reshape(len(factor), -1, 2)
        found.append(np.einsum("f,fkd->kd", factor.mean(axis=1), of_functions))
    if result.settings.drift_walk:
        walk = _pairs(result, "walk", "drift_walk").reshape(len(result.exposures), -1, 2)
        found.append(walk.mean(axis=0))
    total = np.zeros((max(map(len, found)), 2))
    for one in found:
        total[: len(one)] += one
    return total


def _mean_motion(result: FitResult, n_det: int) -> np.ndarray:
    """Return the mean motion of each detector, um and um, and its mean turn, arcsec."""
    if not result.settings.detector_motion:
        return np.zeros((n_det, 3))
    span = detector_spans(result)
    names = ["detector_motion_x", "detector_motion_y", "detector_turn"]
    element = motion_elements(span, np.arange(len(span)), np.arange(n_det)[:, None])
    moved = result.values_on("motion")[names].to_numpy()[element] * (span > 0)[:, None]
    return moved.mean(axis=1)


def _pairs(result: FitResult, axis: Axis, name: str) -> np.ndarray:
    """Return the values of the groups of x and y on an axis, shape (n, 2)."""
    return result.values_on(axis)[[f"{name}_x", f"{name}_y"]].to_numpy()


def _displacement(coefficients: np.ndarray, scaled: np.ndarray) -> np.ndarray:
    x, y = scaled.T
    return np.stack([displacement_um(one, x, y) for one in coefficients.T], axis=-1)
