"""True geometry of an orbit: the observation model's origins at the true values."""

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
from jaxtyping import Array, Float

from solver.data.distortion_terms import terms
from solver.data.instrument import Instrument
from solver.data.parameters import CALIBRATION_GROUPS, FRAME_GROUPS, SOURCES
from solver.data.settings import FitSettings
from solver.model.directions import tangent_frame
from solver.model.ephemeris import observer_at
from solver.model.forward import Geometry
from solver.problem.elements import elements
from solver.problem.parameter_vector import VectorLayout
from solver.problem.prior_centres import calibration_centres
from solver.simulate.placement import place_detectors
from solver.simulate.settings import SurveySettings

# Measurements that are predicted at once; each length is compiled.
CHUNK = 65_536
_MIN_PADDED_SOURCES = 4_096
_VELOCITY = ["satellite_vx", "satellite_vy", "satellite_vz"]


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
    nominal = FitSettings(order=order)
    axes = elements(true_exposures, placed, nominal)
    origin = calibration_centres(true_exposures, placed, layout, nominal, axes)
    for k, j, a, b in settings.distortion_um:
        origin["distortion_x"][terms(order).index((k, j))] = a
        origin["distortion_y"][terms(order).index((k, j))] = b
    observer = observer_at(attitude["obstime"].to_numpy(), attitude[_VELOCITY].to_numpy())
    arrays = {
        "source_frame": source_frame,
        "pointing_frame": tangent_frame(attitude["ra"].to_numpy(), attitude["dec"].to_numpy()),
        "origin": {
            g.name: origin[g.name] for g in CALIBRATION_GROUPS if g.name not in FRAME_GROUPS
        },
        "velocity": observer.velocity,
        "sun_distance": observer.sun_distance,
        "distortion_scale": instrument.distortion_scale_um,
    }
    return Geometry(**jax.tree.map(jnp.asarray, arrays), order=order)


def zero_offsets(geometry: Geometry) -> dict[str, Float[Array, "..."]]:
    """Return offsets of zero for all parameter groups."""
    offsets = {name: jnp.zeros_like(values) for name, values in geometry.origin.items()}
    number = {"src": (len(geometry.source_frame), 2), "exp": (len(geometry.pointing_frame),)}
    for group in (SOURCES, *CALIBRATION_GROUPS):
        if group.name not in offsets:
            offsets[group.name] = jnp.zeros(number[group.axis])
    return offsets


def padded(frame: Float[np.ndarray, "src 3 3"]) -> Float[np.ndarray, "padded 3 3"]:
    """Repeat the sources up to a power of two, because each new shape is compiled anew."""
    length = max(1 << (len(frame) - 1).bit_length(), _MIN_PADDED_SOURCES)
    return np.resize(frame, (length, 3, 3))
