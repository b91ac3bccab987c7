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
from solver.data.schema import MEASUREMENT
from solver.model.astrometry import frames_at, sky_position
from solver.model.directions import tangent_frame
from solver.model.ephemeris import observer_at
from solver.model.forward import Geometry, Index, predict
from solver.simulate.defective import Exposed, with_defects
from solver.simulate.defects.stages import recorded_exposures
from solver.simulate.geometry import CHUNK, padded, true_geometry, zero_offsets
from solver.simulate.magnitudes import noise_factor
from solver.simulate.placement import place_detectors
from solver.simulate.schedule import environment, orbit_attitude
from solver.simulate.settings import SurveySettings
from solver.simulate.streams import Stream
from solver.units import DAYS_PER_JULIAN_YEAR, MJD_J2000, RAD_PER_ARCSEC, RAD_PER_MAS

# Sources this far outside the detectors are also considered: aberration is up to 21 arcsec.
_MARGIN_ARCSEC = 30.0


class MeasuredOrbit(NamedTuple):
    """Simulated data of one orbit.

    `measurements` is `schema.MEASUREMENT` in random order and `exposures` is
    `schema.ENVIRONMENT`; `attitude` also has the true pointings and focal lengths, as from
    `solver.simulate.schedule.attitude`. `affected` is `defect_schema.AFFECTED`.
    """

    measurements: pd.DataFrame
    exposures: pd.DataFrame
    attitude: pd.DataFrame
    affected: pd.DataFrame


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
    geometry = true_geometry(padded(frame), attitude, instrument, settings)
    source, exposure = _candidates(frame[:, 0], attitude, instrument, settings)
    row, detector, pixel = _on_detectors(geometry, source, exposure, instrument)
    index = Index(source[row], exposure[row], detector)
    magnitude = near["magnitude"].to_numpy()[index.source]
    sigma = measurement_sigma(instrument, settings)[detector]
    if settings.noise_by_magnitude:
        sigma = sigma * noise_factor(magnitude)[:, None]
    noise = sigma * rng.standard_normal(sigma.shape)
    taken = attitude.iloc[index.exposure]
    table = pd.DataFrame(
        {
            "orbit_id": taken["orbit_id"].to_numpy(),
            "field_id": taken["field_id"].to_numpy(),
            "plate_id": taken["plate_id"].to_numpy(),
            "detector_id": np.array(instrument.detector_ids)[detector],
            "source_id": near["source_id"].to_numpy()[index.source],
            "nx": pixel[:, 0] + noise[:, 0],
            "ny": pixel[:, 1] + noise[:, 1],
            "sx": sigma[:, 0],
            "sy": sigma[:, 1],
            "magnitude": magnitude,
        }
    )[MEASUREMENT.names]
    order = rng.permutation(len(table))
    exposed = Exposed(index, pixel, noise, frame, attitude)
    table, affected = with_defects(table, exposed, instrument, settings, orbit_id)
    # Defects may have removed rows.
    shuffled = table.reindex(order[np.isin(order, table.index)]).reset_index(drop=True)
    exposures = recorded_exposures(environment(attitude), settings, orbit_id)
    return MeasuredOrbit(shuffled, exposures, attitude, affected)


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
    for start in range(0, len(source), CHUNK):
        part = slice(start, start + CHUNK)
        missing = (0, CHUNK - len(source[part]))
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


@jax.jit
def _pixels(
    geometry: Geometry, source: Int[Array, " cand"], exposure: Int[Array, " cand"]
) -> Float[Array, "det cand 2"]:
    """Return the positions of the candidates in the pixels of every detector."""
    offsets = zero_offsets(geometry)

    def on(detector: Int[Array, ""]) -> Float[Array, "cand 2"]:
        index = Index(source, exposure, jnp.full_like(source, detector))
        return jnp.stack(predict(offsets, geometry, index).pixel, axis=-1)

    # Only the detector is mapped, so that the focal-plane position is computed once.
    return jax.vmap(on)(jnp.arange(len(geometry.origin["detector_x"])))
