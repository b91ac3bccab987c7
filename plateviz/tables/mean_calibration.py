"""MeanCalibration: where the stars of an orbit fall on the focal plane, mean of its exposures."""

from typing import NamedTuple

import numpy as np

from plateviz.tables.calibration import displacement_um
from solver.data.detector_spans import motion_elements
from solver.data.instrument import Instrument
from solver.data.parameters import FRAME_GROUPS, PARAMETERS, Axis
from solver.data.result import FitResult
from solver.data.settings import SETTINGS
from solver.problem.term_factors import changing_terms, own_frames
from solver.results.diagnosis.rows import detector_spans, onto_focal_plane
from solver.simulate.true_calibration import TrueCalibration
from solver.units import PPM, RAD_PER_ARCSEC

# The distortion changes by less than a hundredth of the distance: each step of the inversion
# gains two digits or more.
_INVERSION_STEPS = 10


class MeanCalibration(NamedTuple):
    """Calibration of the focal plane, with all that does not depend on the star.

    A parameter group that it does not have is named in `left_out`.

    Attributes
    ----------
    coefficients : of the distortion along x and y, um, shape (n, 2)
    centre, rotation, pitch, skew : of each detector, um, rad, um and rad
    own : coefficients of each detector's own distortion, um, shape (detector, m, 2)
    own_centre, own_scale : origin and unit of its terms, um
    anisotropy : difference of the focal lengths along y and x over their mean
    focal_length : um
    left_out : labels of the parameters of the fit that are not part of it: their displacements
        depend on the star, or nothing here computes them yet
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
    left_out: tuple[str, ...] = ()

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
    values, n_det = _Values(result), len(instrument.detectors)
    moved = _mean_motion(values, n_det)
    anisotropy = values.on("exp", "focal_anisotropy")
    return MeanCalibration(
        _mean_coefficients(values),
        values.pairs("det", "detector") + moved[:, :2],
        np.radians(values.on("det", "detector_rotation")) + RAD_PER_ARCSEC * moved[:, 2],
        np.stack([values.on("det", name) for name in ("pitch_x", "pitch_y")], axis=-1),
        np.radians(_or_zeros(values.on("det", "detector_skew"), n_det)),
        values.pairs("own", "own_distortion").reshape(n_det, -1, 2),
        *own_frames(instrument),
        PPM * float(_or_zeros(anisotropy, 1).mean()),
        float(values.on("exp", "focal_length").mean()),
        values.left_out(),
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


class _Values:
    """The values of a fit by parameter group, and what was not asked for.

    A group that is added to the table of parameters is thereby named as left out, until it is
    part of the mean.
    """

    def __init__(self, result: FitResult) -> None:
        self.result = result
        # A shift and a roll of the exposures are removed from every difference.
        self._used = {*FRAME_GROUPS, "position_angle"}

    def on(self, axis: Axis, name: str) -> np.ndarray:
        """Return the values of a group, shape (n,); none if the fit does not have the group."""
        self._used.add(name)
        values = self.result.values_on(axis)
        return values[name].to_numpy() if name in values else np.empty(0)

    def pairs(self, axis: Axis, name: str) -> np.ndarray:
        """Return the values of the groups of x and y, shape (n, 2)."""
        return np.stack([self.on(axis, f"{name}_{direction}") for direction in "xy"], axis=-1)

    def left_out(self) -> tuple[str, ...]:
        """Return what the groups of the fit that were not asked for are called, each once."""
        unused = set(self.result.calibration["group"]) - self._used
        left = [group for group in PARAMETERS if group.name in unused]
        # Those of a setting go by its label: of both directions, say.
        labels = [SETTINGS[one.setting].label if one.setting else one.label for one in left]
        return tuple(dict.fromkeys(labels))


def _or_zeros(values: np.ndarray, n: int) -> np.ndarray:
    return values if len(values) else np.zeros(n)


def _mean_coefficients(values: _Values) -> np.ndarray:
    """Return the coefficients of the distortion, those of its changes among them."""
    result = values.result
    found = [values.pairs("coef", "distortion")]
    for terms, factor in changing_terms(result.exposures, result.settings):
        of_functions = values.pairs(terms.axis, terms.name).reshape(len(factor), -1, 2)
        found.append(np.einsum("f,fkd->kd", factor.mean(axis=1), of_functions))
    if result.settings.drift_walk:
        walk = values.pairs("walk", "drift_walk").reshape(len(result.exposures), -1, 2)
        found.append(walk.mean(axis=0))
    total = np.zeros((max(map(len, found)), 2))
    for one in found:
        total[: len(one)] += one
    return total


def _mean_motion(values: _Values, n_det: int) -> np.ndarray:
    """Return the mean motion of each detector, um and um, and its mean turn, arcsec."""
    if not values.result.settings.detector_motion:
        return np.zeros((n_det, 3))
    span = detector_spans(values.result)
    names = ["detector_motion_x", "detector_motion_y", "detector_turn"]
    found = np.stack([values.on("motion", name) for name in names], axis=-1)
    element = motion_elements(span, np.arange(len(span)), np.arange(n_det)[:, None])
    moved = found[element] * (span > 0)[:, None]
    return moved.mean(axis=1)


def _displacement(coefficients: np.ndarray, scaled: np.ndarray) -> np.ndarray:
    x, y = scaled.T
    return np.stack([displacement_um(one, x, y) for one in coefficients.T], axis=-1)
