"""Orbits whose parameters are all drawn from the priors of the fit, on the mini-mock's sky.

The simulated model is the one that the fit assumes: every calibration group has the family and the
width of its prior in `solver.data.parameters`, the reference catalogue scatters about the truth by
its full covariance, and the noise is that stated in the measurement table.

Of the detectors and the distortion the fit is given the centre, and the truth is drawn about it. Of
the exposures and the sources the truth is that of the schedule and the sky, so that exposures
overlap as in the survey, and what the fit is given is drawn about it. Both have the same joint
distribution, up to the curvature of the sky over the width of the prior, because the densities are
symmetric. The position angle's prior is flat: the fit is given any angle.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.distortion_terms import terms
from solver.data.instrument import MINI_MOCK, Instrument
from solver.data.orbit import OrbitData
from solver.data.parameters import BY_NAME
from solver.data.settings import FitSettings
from solver.model.correlation import ASTROMETRY
from solver.model.directions import tangent_frame
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.measure import measure_orbit
from solver.simulate.placement import place_detectors
from solver.simulate.schedule import environment
from solver.simulate.settings import SurveySettings
from solver.units import ARCSEC_PER_DEG, RAD_PER_ARCSEC

ORBITS = 100
# Stars of the survey's field for each that an orbit measures: fewer than there are, so that an
# orbit always has as many as wanted.
_FIELD_PER_ORBIT = 45
_ARTIFICIAL = 20
# Of the iteration that finds where a position is seen at a given offset.
_STEPS = 40


@dataclass(frozen=True)
class Size:
    """Numbers of measured stars with and without a reference position, and of exposures."""

    references: int
    others: int
    exposures_per_field: int


class DrawnOrbit(NamedTuple):
    """The tables of an orbit, and its true calibration as offsets from the prior centres.

    `truth` has the values of each calibration group in its unit, in the order of its axis.
    """

    data: OrbitData
    instrument: Instrument
    truth: dict[str, np.ndarray]


def draw_orbit(seed: int, size: Size) -> DrawnOrbit:
    """Draw an orbit; the same seed and size give the same numbers."""
    rng = np.random.default_rng([seed, 2])
    rows = [(k, j, *rng.normal(size=2).tolist()) for k, j in terms(FitSettings().order)]
    widths = {name: group.width for name, group in BY_NAME.items()}
    survey = SurveySettings(
        orbits=ORBITS,
        seed=seed,
        n_stars=_FIELD_PER_ORBIT * (size.references + size.others),
        n_reference=_FIELD_PER_ORBIT * size.references,
        n_artificial=_ARTIFICIAL,
        exposures_per_field=size.exposures_per_field,
        distortion_um=tuple(
            (k, j, a * widths["distortion_x"], b * widths["distortion_y"]) for k, j, a, b in rows
        ),
        detector_offset_um=widths["detector_x"],
        detector_rotation_deg=widths["detector_rotation"] / ARCSEC_PER_DEG,
        pitch_relative=widths["pitch_x"],
    )
    true_catalogue = _correlated(truth_catalogue(survey), rng)
    measured = measure_orbit(seed % ORBITS, true_catalogue, survey, MINI_MOCK)
    chosen = _chosen(measured.measurements, true_catalogue, size, rng)
    true_catalogue = true_catalogue[true_catalogue["source_id"].isin(chosen)]
    measurements = measured.measurements[measured.measurements["source_id"].isin(chosen)]
    keys = ["field_id", "plate_id"]
    attitude = measured.attitude.merge(measurements[keys].drop_duplicates()).sort_values(
        keys, ignore_index=True
    )
    exposures, of_exposures = _estimates(attitude, rng)
    data = OrbitData(
        measurements.reset_index(drop=True),
        exposures,
        reference_catalogue(true_catalogue, survey),
        true_catalogue.reset_index(drop=True),
    )
    placed = _displacements(place_detectors(MINI_MOCK, survey))
    distortion = {"distortion_x": 2, "distortion_y": 3}
    of_optics = {
        n: np.array([row[i] for row in survey.distortion_um]) for n, i in distortion.items()
    }
    return DrawnOrbit(data, MINI_MOCK, {**of_exposures, **of_optics, **placed})


def _correlated(truth: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Give each source random correlations of its five parameters in the reference catalogue."""
    factor = rng.normal(size=(len(truth), 5, 8))
    covariance = factor @ factor.swapaxes(1, 2)
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    names = combinations(enumerate(ASTROMETRY), 2)
    return truth.assign(
        **{
            f"{first}_{second}_corr": covariance[:, i, j] / (sigma[:, i] * sigma[:, j])
            for (i, first), (j, second) in names
        }
    )


def _chosen(
    measurements: pd.DataFrame, truth: pd.DataFrame, size: Size, rng: np.random.Generator
) -> np.ndarray:
    """Return the ids of as many measured sources of each kind as the size says."""
    measured = truth[truth["source_id"].isin(measurements["source_id"])]
    chosen = []
    for is_reference, number in ((True, size.references), (False, size.others)):
        ids = measured["source_id"].to_numpy()[measured["is_reference"] == is_reference]
        chosen.append(rng.permutation(ids)[:number])
    return np.concatenate(chosen)


def _estimates(
    attitude: pd.DataFrame, rng: np.random.Generator
) -> tuple[pd.DataFrame, dict[str, np.ndarray]]:
    """Return the exposure table with drawn estimates, and the true offsets from them."""
    n = len(attitude)
    width = BY_NAME["pointing_ra"].width, BY_NAME["pointing_dec"].width
    offset = rng.normal(size=(n, 2)) * width
    ra, dec = attitude["ra"].to_numpy(), attitude["dec"].to_numpy()
    centre = centre_seen_at(ra, dec, offset)
    # The prior of the focal length is a gamma distribution; its shape is the squared ratio of
    # centre and width.
    length = attitude["true_focal_length"].to_numpy()
    shape = (length / BY_NAME["focal_length"].width) ** 2
    focal_length = length * shape / rng.gamma(shape)
    angle = attitude["position_angle"].to_numpy()
    turn = rng.uniform(-180.0, 180.0, n)
    estimates = attitude.assign(
        ra_est=centre[0] % 360.0,
        dec_est=centre[1],
        pa_est=(angle - turn) % 360.0,
        focal_length=focal_length,
    )
    return environment(estimates), {
        "pointing_ra": offset[:, 0],
        "pointing_dec": offset[:, 1],
        "position_angle": turn * ARCSEC_PER_DEG,
        "focal_length": length - focal_length,
    }


def centre_seen_at(
    ra: np.ndarray, dec: np.ndarray, offset: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions, deg, from which others are seen at given tangent-plane offsets, arcsec.

    Parameters
    ----------
    ra, dec : of the others, deg
    """
    centre_ra, centre_dec = ra, dec
    for _ in range(_STEPS):
        missing = tangent_offset(ra, dec, centre_ra, centre_dec) - offset
        centre_dec = centre_dec + missing[:, 1] / ARCSEC_PER_DEG
        centre_ra = centre_ra + missing[:, 0] / ARCSEC_PER_DEG / np.cos(np.radians(centre_dec))
    return centre_ra, centre_dec


def tangent_offset(
    ra: np.ndarray, dec: np.ndarray, centre_ra: np.ndarray, centre_dec: np.ndarray
) -> np.ndarray:
    """Return the offsets east and north of positions in the tangent planes of others, arcsec.

    Parameters
    ----------
    ra, dec, centre_ra, centre_dec : deg
    """
    direction = tangent_frame(ra, dec)[:, 0]
    along = np.einsum("nij,nj->ni", tangent_frame(centre_ra, centre_dec), direction)
    return along[:, 1:] / along[:, :1] / RAD_PER_ARCSEC


def _displacements(placed: Instrument) -> dict[str, np.ndarray]:
    """Return the offsets of the true detectors from the nominal ones."""
    columns = {
        name: group.column for name, group in BY_NAME.items() if group.centre_from == "instrument"
    }
    pairs = list(zip(placed.detectors, MINI_MOCK.detectors, strict=True))
    return {
        name: BY_NAME[name].per_value_unit
        * np.array([getattr(true, column) - getattr(nominal, column) for true, nominal in pairs])
        for name, column in columns.items()
    }
