"""Measurements of one orbit: true sources projected by `solver.model.forward`, plus noise.

Paper, section "Mock measurements". Aberration by the Earth's motion is included, other effects
on the light path are not. Sources do not move during an orbit.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
from jaxtyping import Array, Bool, Float, Int

from solver.data.instrument import MINI_MOCK, Instrument
from solver.data.parameters import CALIBRATION_GROUPS, PARAMETERS
from solver.data.schema import MEASUREMENT
from solver.data.settings import FitSettings
from solver.model.astrometry import frames_at, sky_position
from solver.model.directions import tangent_frame
from solver.model.distortion import terms
from solver.model.ephemeris import observer_at
from solver.model.forward import Geometry, Index, predict
from solver.problem.parameter_vector import VectorLayout
from solver.problem.prior_centres import calibration_centres
from solver.simulate.placement import place_detectors
from solver.simulate.schedule import environment, orbit_attitude
from solver.simulate.settings import Stream, SurveySettings
from solver.units import DAYS_PER_JULIAN_YEAR, MJD_J2000, RAD_PER_ARCSEC, RAD_PER_MAS

# Sources this far outside the detectors are also considered: aberration is up to 21 arcsec.
_MARGIN_ARCSEC = 30.0
_CHUNK = 65_536
_MIN_PADDED_SOURCES = 4_096


class MeasuredOrbit(NamedTuple):
    """Simulated data of one orbit.

    `measurements` is `schema.MEASUREMENT` in random order and `exposures` is
    `schema.ENVIRONMENT`; `attitude` also has the true pointings and focal lengths, as from
    `solver.simulate.schedule.attitude`.
    """

    measurements: pd.DataFrame
    exposures: pd.DataFrame
    attitude: pd.DataFrame


def measure_orbit(
    orbit_id: int,
    truth: pd.DataFrame,
    settings: SurveySettings,
    instrument: Instrument = MINI_MOCK,
) -> MeasuredOrbit:
    """Measure every source of `truth` that falls on a detector, Eq. (exp:mock).

    Each orbit has its own random numbers.

    Parameters
    ----------
    truth : `schema.TRUTH`
    instrument : the nominal instrument
    """
    attitude = orbit_attitude(orbit_id, settings, instrument.focal_length_um)
    rng = settings.rng(Stream.MEASUREMENTS, orbit_id)
    near = truth[_near(truth, attitude, instrument, settings)]
    frame = _places(near, float(attitude["obstime"].mean()))
    geometry = true_geometry(_padded(frame), attitude, instrument, settings)
    source, exposure = _candidates(frame[:, 0], attitude, instrument, settings)
    row, detector, pixel = _on_detectors(geometry, source, exposure, instrument)
    sigma = measurement_sigma(instrument, settings)[detector]
    measured = pixel + sigma * rng.standard_normal(sigma.shape)
    exposures = environment(attitude)
    taken = attitude.iloc[exposure[row]]
    table = pd.DataFrame(
        {
            "orbit_id": taken["orbit_id"].to_numpy(),
            "field_id": taken["field_id"].to_numpy(),
            "plate_id": taken["plate_id"].to_numpy(),
            "detector_id": np.array(instrument.detector_ids)[detector],
            "source_id": near["source_id"].to_numpy()[source[row]],
            "nx": measured[:, 0],
            "ny": measured[:, 1],
            "sx": sigma[:, 0],
            "sy": sigma[:, 1],
        }
    )[MEASUREMENT.names]
    shuffled = table.iloc[rng.permutation(len(table))].reset_index(drop=True)
    return MeasuredOrbit(shuffled, exposures, attitude)


def true_places(truth: pd.DataFrame, mjd_tcb: float) -> pd.DataFrame:
    """Return the true directions at an epoch, with parallax and without aberration.

    Parameters
    ----------
    truth : `schema.TRUTH`
    mjd_tcb : MJD in TCB

    Returns
    -------
    source_id, ra and dec (deg), in the order of `truth`
    """
    ra, dec = sky_position(_places(truth, mjd_tcb)[:, 0])
    return pd.DataFrame({"source_id": truth["source_id"].to_numpy(), "ra": ra, "dec": dec})


def measurement_sigma(
    instrument: Instrument, settings: SurveySettings
) -> Float[np.ndarray, "det 2"]:
    """Return the uncertainty of a measurement on each detector, pixels.

    It is the same angle on the sky for all detectors, converted to pixels with the nominal
    instrument, because the true one is unknown to the observer.
    """
    pitch = np.array([(d.pitch_x_um, d.pitch_y_um) for d in instrument.detectors])
    return settings.measurement_mas * RAD_PER_MAS * instrument.focal_length_um / pitch


def true_geometry(
    source_frame: Float[np.ndarray, "src 3 3"],
    attitude: pd.DataFrame,
    instrument: Instrument,
    settings: SurveySettings,
) -> Geometry:
    """Return the geometry with the true values as origins, so that all offsets are zero.

    Parameters
    ----------
    source_frame : frames at the true positions
    attitude : as from `solver.simulate.schedule.attitude`
    instrument : the nominal instrument
    """
    order = max((k + j for k, j, _, _ in settings.distortion_um), default=0)
    layout = VectorLayout(len(attitude), len(terms(order)), len(instrument.detectors))
    true_exposures = attitude.assign(
        ra_est=attitude["ra"],
        dec_est=attitude["dec"],
        pa_est=attitude["position_angle"],
        focal_length=attitude["true_focal_length"],
    )
    placed = place_detectors(instrument, settings)
    origin = calibration_centres(true_exposures, placed, layout, FitSettings(order=order))
    for k, j, a, b in settings.distortion_um:
        origin["distortion_x"][terms(order).index((k, j))] = a
        origin["distortion_y"][terms(order).index((k, j))] = b
    observer = observer_at(attitude["obstime"].to_numpy())
    arrays = {
        "source_frame": source_frame,
        "pointing_frame": tangent_frame(attitude["ra"].to_numpy(), attitude["dec"].to_numpy()),
        "origin": {g.name: origin[g.name] for g in CALIBRATION_GROUPS if "pointing" not in g.name},
        "velocity": observer.velocity,
        "sun_distance": observer.sun_distance,
        "distortion_scale": instrument.distortion_scale_um,
    }
    return Geometry(**jax.tree.map(jnp.asarray, arrays), order=order)


def _places(truth: pd.DataFrame, mjd_tcb: float) -> Float[np.ndarray, "src 3 3"]:
    """Return direction, east and north of the sources as seen from the Earth."""
    return frames_at(truth, mjd_tcb, observer_at(np.array([mjd_tcb])).position[0])


def _near(
    truth: pd.DataFrame, attitude: pd.DataFrame, instrument: Instrument, settings: SurveySettings
) -> Bool[np.ndarray, " src"]:
    """Return which sources may fall on a detector, whatever their motion and the pointing."""
    years = 2000.0 + (attitude["obstime"].max() - MJD_J2000) / DAYS_PER_JULIAN_YEAR
    motion = np.hypot(truth["pmra"], truth["pmdec"]) * np.abs(years - truth["ref_epoch"])
    moved = RAD_PER_MAS * float((motion + truth["parallax"].abs()).max())
    wander = (
        10.0
        * RAD_PER_ARCSEC
        * (
            settings.pointing_start_arcsec
            + settings.pointing_walk_arcsec * np.sqrt(settings.exposures_per_field)
        )
    )
    firsts = attitude.drop_duplicates("field_id")
    direction = tangent_frame(truth["ra"].to_numpy(), truth["dec"].to_numpy())[:, 0]
    radius = _radius(attitude, instrument, settings)
    return np.any(_within(direction, firsts, radius + moved + wander), axis=1)


def _candidates(
    direction: Float[np.ndarray, "src 3"],
    attitude: pd.DataFrame,
    instrument: Instrument,
    settings: SurveySettings,
) -> tuple[Int[np.ndarray, " cand"], Int[np.ndarray, " cand"]]:
    """Return the indices of sources and exposures that are close to each other, in pairs."""
    close = _within(direction, attitude, _radius(attitude, instrument, settings))
    exposure, source = np.nonzero(close.T)
    return source, exposure


def _within(
    direction: Float[np.ndarray, "src 3"], attitude: pd.DataFrame, radius: float
) -> Bool[np.ndarray, "src exp"]:
    centre = tangent_frame(attitude["ra"].to_numpy(), attitude["dec"].to_numpy())[:, 0]
    return direction @ centre.T > np.cos(radius)


def _radius(attitude: pd.DataFrame, instrument: Instrument, settings: SurveySettings) -> float:
    """Return the largest angle from the pointing at which a source can be observed, rad."""
    placed = place_detectors(instrument, settings)
    corners = np.concatenate([detector.corners_um() for detector in placed.detectors])
    # Within the field a distortion term is at most twice its coefficient.
    distortion = 2.0 * sum(abs(a) + abs(b) for _, _, a, b in settings.distortion_um)
    farthest = np.hypot(*corners.T).max() + distortion
    angle = np.arctan(farthest / attitude["true_focal_length"].min())
    return float(angle + _MARGIN_ARCSEC * RAD_PER_ARCSEC)


def _on_detectors(
    geometry: Geometry,
    source: Int[np.ndarray, " cand"],
    exposure: Int[np.ndarray, " cand"],
    instrument: Instrument,
) -> tuple[Int[np.ndarray, " obs"], Int[np.ndarray, " obs"], Float[np.ndarray, "obs 2"]]:
    """Return candidates that fall on a detector, with detector index and position in pixels."""
    half = 0.5 * np.array([(d.n_x, d.n_y) for d in instrument.detectors])
    rows, detectors, pixels = [], [], []
    for start in range(0, len(source), _CHUNK):
        part = slice(start, start + _CHUNK)
        missing = (0, _CHUNK - len(source[part]))
        pairs = (np.pad(indices[part], missing) for indices in (source, exposure))
        pixel = np.asarray(_pixels(geometry, *pairs))[:, : len(source[part])]
        inside = np.all(np.abs(pixel) < half[:, None, :], axis=-1)
        row = np.flatnonzero(np.any(inside, axis=0))
        detector = inside[:, row].argmax(axis=0)
        rows.append(start + row)
        detectors.append(detector)
        pixels.append(pixel[detector, row])
    if not rows:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 2))
    return np.concatenate(rows), np.concatenate(detectors), np.concatenate(pixels)


def _padded(frame: Float[np.ndarray, "src 3 3"]) -> Float[np.ndarray, "padded 3 3"]:
    """Repeat the sources up to a power of two, because each new shape is compiled anew."""
    length = max(1 << (len(frame) - 1).bit_length(), _MIN_PADDED_SOURCES)
    return np.resize(frame, (length, 3, 3))


@jax.jit
def _pixels(
    geometry: Geometry, source: Int[Array, " cand"], exposure: Int[Array, " cand"]
) -> Float[Array, "det cand 2"]:
    """Return the positions of the candidates in the pixels of every detector."""
    offsets = {name: jnp.zeros_like(values) for name, values in geometry.origin.items()}
    number = {"src": (len(geometry.source_frame), 2), "exp": (len(geometry.pointing_frame),)}
    for group in PARAMETERS:
        if group.name not in offsets:
            offsets[group.name] = jnp.zeros(number[group.axis])

    def on(detector: Int[Array, ""]) -> Float[Array, "cand 2"]:
        index = Index(source, exposure, jnp.full_like(source, detector))
        return jnp.stack(predict(offsets, geometry, index).pixel, axis=-1)

    # Only the detector is mapped, so that the focal-plane position is computed once.
    return jax.vmap(on)(jnp.arange(len(geometry.origin["detector_x"])))
