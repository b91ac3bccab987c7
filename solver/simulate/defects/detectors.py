"""Defects of the detectors: motion during the orbit, charge transfer, pixel phase.

Each function returns a displacement in pixels; see `DefectStage.DETECTOR`.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.simulate.defects.defect import AppliedDefect, TrueRows
from solver.simulate.magnitudes import NOISE_MAGNITUDE
from solver.units import RAD_PER_ARCSEC, RAD_PER_DEG

# A detector moves in this part of the exposures.
_MOTION = (0.25, 0.75)


class Motion(NamedTuple):
    """A detector that moves: its index, that of the first exposure after, a direction in rad."""

    detector: int
    exposure: int
    angle: float


def motion(applied: AppliedDefect, n_detectors: int, n_exposures: int) -> Motion:
    """Return which detector of the orbit moves, and when."""
    rng = applied.orbit_rng()
    detector = int(rng.integers(n_detectors))
    exposure = int(np.ceil(rng.uniform(*_MOTION) * n_exposures))
    return Motion(detector, exposure, float(rng.uniform(0.0, 2.0 * np.pi)))


def detector_shift(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Shift one detector on the focal plane, at a random time in mid-orbit."""
    moves = _motion(applied, rows)
    # The star stays where it is on the focal plane, and so moves back on the detector.
    shift = -applied.amplitude * np.array([np.cos(moves.angle), np.sin(moves.angle)])
    detector = rows.instrument.detectors[moves.detector]
    pitch = np.array([detector.pitch_x_um, detector.pitch_y_um])
    return (
        _after(moves, rows)[:, None]
        * (_rotation(RAD_PER_DEG * detector.rotation_deg) @ shift)
        / pitch
    )


def detector_turn(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Turn one detector about its centre, at a random time in mid-orbit."""
    moves = _motion(applied, rows)
    pitch = rows.of_detector("pitch_x_um", "pitch_y_um")
    turned = (pitch * rows.pixel) @ _rotation(RAD_PER_ARCSEC * applied.amplitude).T / pitch
    return _after(moves, rows)[:, None] * (turned - rows.pixel)


def charge_transfer(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Shift stars along y, in proportion to the rows that their charge crosses and to flux^-1/2."""
    crossed = rows.pixel[:, 1] / rows.of_detector("n_y")[:, 0] + 0.5
    faintness = 10.0 ** (0.2 * (rows.magnitude - NOISE_MAGNITUDE))
    return np.stack([np.zeros_like(crossed), applied.amplitude * crossed * faintness], axis=1)


def pixel_phase(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Shift stars by a sine of their position within the pixel, along both axes."""
    return applied.amplitude * np.sin(2.0 * np.pi * rows.pixel)


def _motion(applied: AppliedDefect, rows: TrueRows) -> Motion:
    return motion(applied, len(rows.instrument.detectors), len(rows.attitude))


def _after(moves: Motion, rows: TrueRows) -> Bool[np.ndarray, " obs"]:
    """Return which measurements the moved detector took."""
    return (rows.detector == moves.detector) & (rows.exposure >= moves.exposure)


def _rotation(angle: float) -> Float[np.ndarray, "2 2"]:
    """Return the rotation of `solver.model.detector.to_pixel`."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
