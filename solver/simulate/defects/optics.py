"""Defects on the focal plane: distortion that changes or is of higher order, axes, jitter."""

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import legendre

from solver.simulate.defects.defect import Case, Rows, elapsed
from solver.units import RAD_PER_MAS

# Period of a circular orbit 600 km above the Earth, the paper's section "Discussion".
ORBITAL_PERIOD_S = 5_801.0
_SECONDS_PER_DAY = 86_400.0

_QUADRATIC, _CUBIC, _ABOVE_FIFTH = (2,), (3,), (6, 7)
# One exposure of so many jitters, three of the mini-mock's 96.
EXPOSURES_PER_JITTER = 32
# The telescope swings once to so many times while the detectors are read.
_JITTER_HARMONICS = 4


def distortion_drift(case: Case, rows: Rows) -> Float[np.ndarray, "obs 2"]:
    """Change the quadratic terms linearly with time; zero in the middle of the orbit."""
    return _distorted(case, rows, _QUADRATIC, elapsed(rows.attitude) - 0.5)


def distortion_orbital(case: Case, rows: Rows) -> Float[np.ndarray, "obs 2"]:
    """Change the quadratic terms with the phase of the satellite's orbit."""
    seconds = _SECONDS_PER_DAY * (rows.attitude["obstime"] - rows.attitude["obstime"].min())
    phase = case.orbit_rng().uniform(0.0, 2.0 * np.pi)
    angle = 2.0 * np.pi * seconds.to_numpy() / ORBITAL_PERIOD_S + phase
    return _distorted(case, rows, _QUADRATIC, np.cos(angle))


def distortion_step(case: Case, rows: Rows) -> Float[np.ndarray, "obs 2"]:
    """Change the cubic terms between the two halves of the fields."""
    fields = rows.attitude["field_id"].to_numpy()
    later = fields >= np.unique(fields)[len(np.unique(fields)) // 2]
    return _distorted(case, rows, _CUBIC, later.astype(float))


def distortion_order(case: Case, rows: Rows) -> Float[np.ndarray, "obs 2"]:
    """Add terms of degree 6 and 7, above the fit's default order."""
    return _distorted(case, rows, _ABOVE_FIFTH, np.ones(len(rows.attitude)))


def focal_anisotropy(case: Case, rows: Rows) -> Float[np.ndarray, "obs 2"]:
    """Let the focal length along y differ from that along x, anew in each exposure."""
    ratio = case.amplitude * case.orbit_rng().standard_normal(len(rows.attitude))
    return 0.5 * ratio[rows.exposure, None] * np.array([-1.0, 1.0]) * rows.ideal


def pointing_jitter(case: Case, rows: Rows) -> Float[np.ndarray, "obs 2"]:
    """Let the telescope swing while the detectors of some exposures are read row by row."""
    exposures, swings = jitter(case, len(rows.attitude))
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
    displacement[moving] = case.amplitude * RAD_PER_MAS * focal_length * swing
    return displacement


def jitter(
    case: Case, n_exposures: int
) -> tuple[Int[np.ndarray, " jitter"], Float[np.ndarray, "jitter 2 2 harmonic"]]:
    """Return the indices of the exposures that jitter, and how.

    The coefficients are those of cosines and sines along x and y; the rms of each axis over the
    time of the reading is one.
    """
    rng = case.orbit_rng()
    number = max(round(n_exposures / EXPOSURES_PER_JITTER), 1)
    exposures = np.sort(rng.permutation(n_exposures)[:number])
    swings = rng.standard_normal((number, 2, 2, _JITTER_HARMONICS))
    # The mean square of a sine is one half.
    return exposures, swings / np.sqrt(0.5 * np.sum(swings**2, axis=(2, 3), keepdims=True))


def _distorted(
    case: Case, rows: Rows, degrees: tuple[int, ...], change: Float[np.ndarray, " exp"]
) -> Float[np.ndarray, "obs 2"]:
    """Return the displacement by terms of some degrees, times a factor of each exposure.

    The coefficients, those of x and y together, are a random direction of the survey with the
    amplitude as length (root of the sum of squares, um).
    """
    terms = [(degree - j, j) for degree in degrees for j in range(degree + 1)]
    coefficients = case.survey_rng().standard_normal((len(terms), 2))
    coefficients *= case.amplitude / np.linalg.norm(coefficients)
    at = rows.ideal / rows.instrument.distortion_scale_um
    in_x, in_y = (legendre.legvander(at[:, axis], max(degrees)) for axis in (0, 1))
    at_zero = legendre.legvander(np.zeros(1), max(degrees))[0]
    displacement = np.zeros_like(rows.ideal)
    for (k, j), pair in zip(terms, coefficients, strict=True):
        # As in the model, the optical centre is not displaced.
        displacement += (in_x[:, k] * in_y[:, j] - at_zero[k] * at_zero[j])[:, None] * pair
    return change[rows.exposure, None] * displacement
