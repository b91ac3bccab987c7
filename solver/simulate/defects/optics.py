"""Defects on the focal plane: distortion that changes or is of higher order, axes, jitter.

Each function returns a displacement in um; see `DefectStage.FOCAL_PLANE`.
"""

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import legendre

from solver.simulate.defects.defect import AppliedDefect, TrueRows, survey_time
from solver.simulate.defects.distortion_terms import (
    AddedTerms,
    changing_with_orbits,
    drifting,
    of_higher_order,
    oscillating,
    stepping,
)
from solver.units import RAD_PER_MAS

# One exposure of so many jitters, three of the mini-mock's 96.
EXPOSURES_PER_JITTER = 32
# The telescope swings once to so many times while the detectors are read.
_JITTER_HARMONICS = 4


def distortion_drift(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Change the quadratic terms linearly with time; zero in the middle of the orbit."""
    return _distorted(rows, drifting(applied, rows.attitude))


def distortion_orbital(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Change the quadratic terms with the phase of the satellite's orbit."""
    return _distorted(rows, oscillating(applied, rows.attitude))


def distortion_step(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Change the cubic terms between the two halves of the fields."""
    return _distorted(rows, stepping(applied, rows.attitude))


def distortion_trend(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Change the quadratic terms from orbit to orbit; zero in the middle of the survey."""
    return _distorted(rows, changing_with_orbits(applied, rows.attitude))


def focal_trend(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Change the focal length from orbit to orbit; zero in the middle of the survey."""
    return applied.amplitude * (survey_time(applied) - 0.5) * rows.ideal


def distortion_order(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Add terms of degree 6 and 7, above the fit's default order."""
    return _distorted(rows, of_higher_order(applied, rows.attitude))


def focal_anisotropy(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Let the focal length along y differ from that along x, anew in each exposure."""
    ratio = applied.amplitude * applied.orbit_rng().standard_normal(len(rows.attitude))
    return 0.5 * ratio[rows.exposure, None] * np.array([-1.0, 1.0]) * rows.ideal


def pointing_jitter(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, "obs 2"]:
    """Let the telescope swing while the detectors of some exposures are read row by row."""
    exposures, swings = jitter(applied, len(rows.attitude))
    number = np.full(len(rows.attitude), -1)
    number[exposures] = np.arange(len(exposures))
    moving = np.flatnonzero(number[rows.exposure] >= 0)
    # Each detector is read along its own y axis, and all of them at the same time.
    read = rows.pixel[moving, 1] / rows.of_detector("n_y")[moving, 0] + 0.5
    angle = 2.0 * np.pi * read[:, None] * np.arange(1, _JITTER_HARMONICS + 1)
    waves = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    swing = np.einsum("nhk,nahk->na", waves, swings[number[rows.exposure[moving]]])
    focal_length = rows.attitude["true_focal_length"].to_numpy()[rows.exposure[moving], None]
    displacement = np.zeros_like(rows.ideal)
    displacement[moving] = applied.amplitude * RAD_PER_MAS * focal_length * swing
    return displacement


def jitter(
    applied: AppliedDefect, n_exposures: int
) -> tuple[Int[np.ndarray, " jitter"], Float[np.ndarray, "jitter 2 2 harmonic"]]:
    """Return the indices of the exposures that jitter, and how.

    The coefficients are those of cosines and sines along x and y; the rms of each axis over the
    time of the reading is one.
    """
    rng = applied.orbit_rng()
    number = max(round(n_exposures / EXPOSURES_PER_JITTER), 1)
    exposures = np.sort(rng.permutation(n_exposures)[:number])
    swings = rng.standard_normal((number, 2, 2, _JITTER_HARMONICS))
    # The mean square of a sine is one half.
    return exposures, swings / np.sqrt(0.5 * np.sum(swings**2, axis=(2, 3), keepdims=True))


def _distorted(rows: TrueRows, added: AddedTerms) -> Float[np.ndarray, "obs 2"]:
    """Return the displacement by terms that are added to those of the distortion."""
    at = rows.ideal / rows.instrument.distortion_scale_um
    highest = max(map(max, added.degrees))
    in_x, in_y = (legendre.legvander(at[:, axis], highest) for axis in (0, 1))
    at_zero = legendre.legvander(np.zeros(1), highest)[0]
    displacement = np.zeros_like(rows.ideal)
    for (k, j), pair in zip(added.degrees, added.coefficients, strict=True):
        # As in the model, the optical centre is not displaced.
        displacement += (in_x[:, k] * in_y[:, j] - at_zero[k] * at_zero[j])[:, None] * pair
    return added.change[rows.exposure, None] * displacement
