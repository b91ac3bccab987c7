"""A small orbit with known truth, from an independent observation model in NumPy and ERFA.

It follows the paper's section "Observation model" and shares no code with
`solver.model.forward`: spherical trigonometry instead of unit vectors,
`numpy.polynomial.legendre` instead of a recursion, and ERFA's aberration.
"""

from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import erfa
import numpy as np
import pandas as pd
from numpy.polynomial.legendre import legval, legval2d

from solver.data.instrument import MINI_MOCK, Instrument
from solver.data.orbit import OrbitData

FIRST_ID = 4_057_482_027_171_038_209
ORBIT_ID = 7
MJD = 61_822.0
MAS = np.radians(1.0 / 3.6e6)
ARCSEC = np.radians(1.0 / 3600.0)
ASTROMETRY = ["ra", "dec", "parallax", "pmra", "pmdec"]
# Widths of the default priors: um, um, deg, fractions.
PRIOR = {"distortion": 1.0, "place": 100.0, "rotation": 0.1, "pitch": 0.01}
PRIOR_FOCAL_LENGTH = 100.0 * np.degrees(1.0)


@dataclass(frozen=True)
class Design:
    """Design of a small orbit.

    `scatter` is the scatter of the true calibration about its nominal values, in units of the
    default prior widths; `pointing_error` the scatter of the pointings, arcsec; `focal_error` a
    common relative error of the estimated focal lengths; `velocity` the largest velocity of
    the satellite, km/s.
    """

    seed: int = 0
    n_sources: int = 80
    n_reference: int = 30
    n_plates: int = 4
    ra: float = 266.1
    dec: float = -29.1
    noise_pix: float = 0.00942
    max_degree: int = 5
    aberration: bool = True
    motion: bool = True
    velocity: float = 0.0
    scatter: float = 0.3
    pointing_error: float = 2.0
    focal_error: float = 0.0
    instrument: Instrument = MINI_MOCK

    def with_(self, **changes):
        return replace(self, **changes)


class Truth(NamedTuple):
    """True values in deg and um, as used by `predict_pixels`; directions at the mean epoch."""

    ra: np.ndarray
    dec: np.ndarray
    pointing_ra: np.ndarray
    pointing_dec: np.ndarray
    position_angle: np.ndarray
    focal_length: np.ndarray
    distortion_x: dict
    distortion_y: dict
    detector_x: np.ndarray
    detector_y: np.ndarray
    detector_rotation: np.ndarray
    pitch_x: np.ndarray
    pitch_y: np.ndarray


class SmallOrbit(NamedTuple):
    """Tables and truth of an orbit, and the source, exposure and detector index of its rows."""

    data: OrbitData
    truth: Truth
    instrument: Instrument
    source: np.ndarray
    exposure: np.ndarray
    detector: np.ndarray
    pixels: np.ndarray


def standard_coordinates(ra, dec, ra_tel, dec_tel):
    """Eqs. (method:cosr, method:projection), all angles in rad."""
    cos_r = np.sin(dec_tel) * np.sin(dec) + np.cos(dec_tel) * np.cos(dec) * np.cos(ra - ra_tel)
    xi = np.cos(dec) * np.sin(ra - ra_tel) / cos_r
    north = np.sin(dec) * np.cos(dec_tel) - np.sin(dec_tel) * np.cos(dec) * np.cos(ra - ra_tel)
    return xi, north / cos_r


def ideal_plane(xi, eta, angle, focal_length):
    """Eq. (method:ideal)."""
    x = np.cos(angle) * -xi + np.sin(angle) * eta
    y = -np.sin(angle) * -xi + np.cos(angle) * eta
    return focal_length * x, focal_length * y


def displacement(x, y, coefficients, scale):
    """Eqs. (model:Lx, model:A0) for one direction, without displacement at the centre."""
    degree = max((k + j for k, j in coefficients), default=0)
    matrix = np.zeros((degree + 1, degree + 1))
    for (k, j), value in coefficients.items():
        matrix[k, j] = value
    matrix[0, 0] = -legval2d(0.0, 0.0, matrix)
    return legval2d(x / scale, y / scale, matrix)


def detector_pixels(x, y, centre_x, centre_y, angle, pitch_x, pitch_y):
    """Eq. (exp:model:nxny)."""
    dx, dy = x - centre_x, y - centre_y
    along = np.cos(angle) * dx - np.sin(angle) * dy
    across = np.sin(angle) * dx + np.cos(angle) * dy
    return np.stack([along / pitch_x, across / pitch_y], axis=-1)


def apparent_places(ra, dec, velocity, sun_distance):
    """Return apparent right ascension and declination, rad; zero velocity has no effect."""
    lorentz = np.sqrt(1.0 - np.sum(velocity**2, axis=-1))
    natural = erfa.s2c(np.radians(ra), np.radians(dec))
    return erfa.c2s(erfa.ab(natural, velocity, sun_distance, lorentz))


def focal_plane(truth, source, exposure, observer, scale):
    """Return the distorted positions, um."""
    velocity, sun_distance = observer
    ra, dec = apparent_places(
        truth.ra[source], truth.dec[source], velocity[exposure], sun_distance[exposure]
    )
    xi, eta = standard_coordinates(
        ra,
        dec,
        np.radians(truth.pointing_ra[exposure]),
        np.radians(truth.pointing_dec[exposure]),
    )
    angle = np.radians(truth.position_angle[exposure])
    x, y = ideal_plane(xi, eta, angle, truth.focal_length[exposure])
    return (
        x + displacement(x, y, truth.distortion_x, scale),
        y + displacement(x, y, truth.distortion_y, scale),
    )


def predict_pixels(truth, source, exposure, detector, observer, scale):
    """Return the noise-free measurements, shape (obs, 2)."""
    n = detector
    return detector_pixels(
        *focal_plane(truth, source, exposure, observer, scale),
        truth.detector_x[n],
        truth.detector_y[n],
        np.radians(truth.detector_rotation[n]),
        truth.pitch_x[n],
        truth.pitch_y[n],
    )


def earth(mjd_tcb):
    """Return barycentric position (au) and velocity (c), and the distance of the Sun (au)."""
    heliocentric, barycentric = erfa.epv00(*erfa.tcbtdb(2400000.5, mjd_tcb))
    per_c = erfa.DAU / 86400.0 / 299_792_458.0
    return barycentric["p"], barycentric["v"] * per_c, np.linalg.norm(heliocentric["p"], axis=-1)


def observer_of(exposures, aberration):
    """Return velocities (c) and distances of the Sun (au) at the exposures."""
    _, velocity, sun_distance = earth(exposures["obstime"].to_numpy())
    satellite = exposures[["satellite_vx", "satellite_vy", "satellite_vz"]].to_numpy()
    return (velocity + satellite / 299_792.458) * aberration, sun_distance


def epoch_places(catalogue, mjd_tcb):
    """Return right ascension and declination, deg, at an epoch by ERFA's `pmpx`.

    ERFA adds the light travel time to the barycentre to the proper motion, up to 0.016 uas per
    mas/yr; the time passed to it compensates for this.
    """
    ra, dec = np.radians(catalogue["ra"].to_numpy()), np.radians(catalogue["dec"].to_numpy())
    position = earth(mjd_tcb)[0]
    years = 2000.0 + (mjd_tcb - 51544.5) / 365.25 - catalogue["ref_epoch"].to_numpy()
    light_years = erfa.s2c(ra, dec) @ position * erfa.AULT / erfa.DAYSEC / erfa.DJY
    direction = erfa.pmpx(
        ra,
        dec,
        catalogue["pmra"].to_numpy() * MAS / np.cos(dec),
        catalogue["pmdec"].to_numpy() * MAS,
        catalogue["parallax"].to_numpy() / 1000.0,
        0.0,
        years - light_years,
        position,
    )
    ra, dec = erfa.c2s(direction)
    return np.degrees(ra) % 360.0, np.degrees(dec)


def _true_catalogue(design, rng):
    n = design.n_sources
    # The layout does not depend on the seed, so all orbits have nearly the same measurements.
    x, y = np.random.default_rng(1234).uniform(-1.0, 1.0, (2, n))
    ra = design.ra + 0.3 * x / np.cos(np.radians(design.dec))
    is_reference = np.arange(n) < design.n_reference
    motion = design.motion * 1.0
    table = pd.DataFrame(
        {
            "source_id": FIRST_ID + 11 * np.arange(n)[::-1],
            "ra": ra % 360.0,
            "dec": design.dec + 0.24 * y,
            "parallax": motion * rng.uniform(0.1, 2.0, n),
            "pmra": motion * rng.normal(-2.0, 3.0, n),
            "pmdec": motion * rng.normal(-4.0, 3.0, n),
            "ref_epoch": 2016.0,
            "is_reference": is_reference,
            "is_artificial": np.arange(n) >= n - 10,
        }
    )
    errors = {"ra": 0.05, "dec": 0.05, "parallax": 0.02, "pmra": 0.03, "pmdec": 0.02}
    for name, value in errors.items():
        wide = 1.0 if name.startswith("pm") or name == "parallax" else 1000.0
        table[f"{name}_error"] = np.where(is_reference, value, wide)
    for first, second in combinations(ASTROMETRY, 2):
        table[f"{first}_{second}_corr"] = 0.0
    table["ra_pmra_corr"] = 0.3
    return table


def _resampled(truth, design, rng):
    """Draw the reference catalogue from its covariance about the true one."""
    catalogue = truth.copy()
    draws = {name: rng.normal(size=len(truth)) for name in ASTROMETRY}
    rho = truth["ra_pmra_corr"].to_numpy()
    draws["pmra"] = rho * draws["ra"] + np.sqrt(1.0 - rho**2) * draws["pmra"]
    for name in ASTROMETRY:
        error = draws[name] * truth[f"{name}_error"].to_numpy()
        if name == "ra":
            error /= np.cos(np.radians(truth["dec"].to_numpy()))
        catalogue[name] = truth[name] + (error / 3.6e6 if name in ("ra", "dec") else error)
    catalogue["ra"] %= 360.0
    return catalogue


def _exposures(design):
    n = 2 * design.n_plates
    plate, field = np.arange(n) % design.n_plates, np.arange(n) // design.n_plates
    phase = np.linspace(0.0, 2.0 * np.pi, n)
    return pd.DataFrame(
        {
            "orbit_id": ORBIT_ID,
            "field_id": field,
            "plate_id": plate,
            "obstime": MJD + (20.0 * np.arange(n) + 90.0 * field) / 86400.0,
            "ra_est": design.ra + np.where(field == 0, -0.12, 0.12),
            "dec_est": design.dec + np.where(field == 0, -0.01, 0.015),
            "pa_est": 301.0 + 0.5 * field,
            "focal_length": design.instrument.focal_length_um,
            "satellite_vx": design.velocity * np.cos(phase),
            "satellite_vy": design.velocity * np.sin(phase),
            "satellite_vz": -0.3 * design.velocity * np.sin(phase),
        }
    )


def _drawn_coefficients(design, rng):
    degrees = [(n - j, j) for n in range(2, design.max_degree + 1) for j in range(n + 1)]
    return {d: float(PRIOR["distortion"] * rng.normal()) for d in degrees}


def _truth(design, true_catalogue, exposures, rng):
    detectors, n_exp = design.instrument.detectors, len(exposures)
    jitter = design.pointing_error * rng.normal(size=(3, n_exp)) / 3600.0
    ra, dec = epoch_places(true_catalogue, exposures["obstime"].mean())
    dec_est = exposures["dec_est"].to_numpy()
    pointing_ra = exposures["ra_est"].to_numpy() + jitter[0] / np.cos(np.radians(dec_est))
    focal_length = design.instrument.focal_length_um / (1.0 + design.focal_error)

    def scattered(nominal, width):
        return nominal + design.scatter * width * rng.normal(size=np.shape(nominal))

    def placed(column, width):
        return scattered(np.array([getattr(d, column) for d in detectors]), width)

    return Truth(
        ra=ra,
        dec=dec,
        pointing_ra=pointing_ra % 360.0,
        pointing_dec=dec_est + jitter[1],
        position_angle=exposures["pa_est"].to_numpy() + jitter[2],
        focal_length=scattered(np.full(n_exp, focal_length), PRIOR_FOCAL_LENGTH),
        distortion_x=_drawn_coefficients(design, rng),
        distortion_y=_drawn_coefficients(design, rng),
        detector_x=placed("x_um", PRIOR["place"]),
        detector_y=placed("y_um", PRIOR["place"]),
        detector_rotation=placed("rotation_deg", PRIOR["rotation"]),
        pitch_x=placed("pitch_x_um", 10.0 * PRIOR["pitch"]),
        pitch_y=placed("pitch_y_um", 10.0 * PRIOR["pitch"]),
    )


def make_orbit(design=None, **changes):
    """Return the `SmallOrbit` of a design; the same design gives the same numbers."""
    design = (design or Design()).with_(**changes)
    rng = np.random.default_rng(design.seed)
    true_catalogue, exposures = _true_catalogue(design, rng), _exposures(design)
    truth = _truth(design, true_catalogue, exposures, rng)
    exposures["ra_est"] %= 360.0
    n_det = len(design.instrument.detectors)
    source, exposure, detector = (
        axis.ravel()
        for axis in np.meshgrid(
            np.arange(design.n_sources), np.arange(len(exposures)), np.arange(n_det), indexing="ij"
        )
    )
    observer = observer_of(exposures, design.aberration)
    scale = design.instrument.distortion_scale_um
    pixels = predict_pixels(truth, source, exposure, detector, observer, scale)
    half = 0.5 * np.array([(d.n_x, d.n_y) for d in design.instrument.detectors])[detector]
    seen = rng.permutation(np.flatnonzero((np.abs(pixels) <= half).all(axis=1)))
    source, exposure, detector, pixels = (
        values[seen] for values in (source, exposure, detector, pixels)
    )
    sigma = design.noise_pix * rng.uniform(0.8, 1.25, (len(seen), 2))
    noisy = pixels + sigma * rng.normal(size=pixels.shape)
    measurements = pd.DataFrame(
        {
            "orbit_id": ORBIT_ID,
            "field_id": exposures["field_id"].to_numpy()[exposure],
            "plate_id": exposures["plate_id"].to_numpy()[exposure],
            "detector_id": np.array([d.detector_id for d in design.instrument.detectors])[detector],
            "source_id": true_catalogue["source_id"].to_numpy()[source],
            "nx": noisy[:, 0],
            "ny": noisy[:, 1],
            "sx": sigma[:, 0],
            "sy": sigma[:, 1],
        }
    )
    catalogue = _resampled(true_catalogue, design, rng)
    correlations = [c for c in true_catalogue if c.endswith("_corr")]
    data = OrbitData(measurements, exposures, catalogue, true_catalogue.drop(columns=correlations))
    return SmallOrbit(data, truth, design.instrument, source, exposure, detector, pixels)


def at_centre(k, j):
    """Return L_k(0) L_j(0)."""
    unit = np.eye(max(k, j) + 1)
    return legval(0.0, unit[k]) * legval(0.0, unit[j])


def tangent_offsets(ra, dec, ra_0, dec_0, unit):
    """Return offsets in the tangent planes at (ra_0, dec_0), all in deg, in `unit` rad."""
    xi, eta = standard_coordinates(*(np.radians(v) for v in (ra, dec, ra_0, dec_0)))
    return np.stack([xi, eta], axis=-1) / unit


def true_offsets(orbit, problem):
    """Return the true calibration and sources as the offsets of a problem."""
    truth, exposures, detectors = orbit.truth, problem.exposures, orbit.instrument.detectors
    pointing = tangent_offsets(
        truth.pointing_ra,
        truth.pointing_dec,
        exposures["ra_est"].to_numpy(),
        exposures["dec_est"].to_numpy(),
        ARCSEC,
    )
    degrees = [(n - j, j) for n in range(2, problem.order + 1) for j in range(n + 1)]

    def moved(name, column):
        return getattr(truth, name) - np.array([getattr(d, column) for d in detectors])

    values = {
        "pointing_ra": pointing[:, 0],
        "pointing_dec": pointing[:, 1],
        "position_angle": 3600.0 * (truth.position_angle - exposures["pa_est"].to_numpy()),
        "focal_length": truth.focal_length - exposures["focal_length"].to_numpy(),
        "distortion_x": np.array([truth.distortion_x.get(d, 0.0) for d in degrees]),
        "distortion_y": np.array([truth.distortion_y.get(d, 0.0) for d in degrees]),
        "detector_x": moved("detector_x", "x_um"),
        "detector_y": moved("detector_y", "y_um"),
        "detector_rotation": 3600.0 * moved("detector_rotation", "rotation_deg"),
        "pitch_x": moved("pitch_x", "pitch_x_um"),
        "pitch_y": moved("pitch_y", "pitch_y_um"),
    }
    prior = epoch_places(problem.sources, problem.epoch)
    order = pd.Index(orbit.data.catalogue["source_id"]).get_indexer(problem.sources["source_id"])
    sources = tangent_offsets(truth.ra[order], truth.dec[order], *prior, MAS)
    # A group that the truth has nothing of is true where its prior is centred.
    layout = problem.layout
    zero = {group.name: np.zeros(len(layout.columns(group))) for group in layout.groups}
    return problem.layout.gather({**zero, **values}), sources
