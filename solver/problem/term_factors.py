"""Factors of the exposures on the coefficients of distortion terms that change with them."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float
from numpy.polynomial import legendre

from solver.data.instrument import Instrument
from solver.data.parameter_group import Axis
from solver.data.settings import FitSettings
from solver.problem.elements import field_numbers
from solver.problem.optional_terms import OptionalTerms, optional_terms
from solver.units import MINUTES_PER_DAY


class ChangingTerms(NamedTuple):
    """Distortion terms whose coefficients are multiplied by functions of the exposure.

    Attributes
    ----------
    terms : the groups, and the degree of the terms; those of a function are adjacent
    factor : one row per function
    """

    terms: OptionalTerms
    factor: Float[np.ndarray, "function exp"]


def changing_terms(exposures: pd.DataFrame, settings: FitSettings) -> list[ChangingTerms]:
    """Return the terms that a fit includes, in the order of `parameter_group.TERM_AXES`.

    Parameters
    ----------
    exposures : `field_id` and `obstime` (MJD) of each
    """
    field, time = field_numbers(exposures), exposures["obstime"].to_numpy()
    phase = orbital_phase(time, settings.breathing_period)
    later = np.arange(1, field.max() + 1)[:, None]
    factors: dict[Axis, np.ndarray] = {
        "drift": _polynomials(time, settings.drift_in_time),
        "breathing": np.array([np.cos(phase), np.sin(phase)]),
        "field": (field == later).astype(float),
    }
    return [
        ChangingTerms(terms, factors[terms.axis])
        for terms in optional_terms(settings)
        if terms.axis in factors
    ]


def orbital_phase(time: Float[np.ndarray, " exp"], period: float) -> Float[np.ndarray, " exp"]:
    """Return the phase of the breathing, rad: zero halfway from the first exposure to the last.

    Parameters
    ----------
    time : of the exposures, MJD
    period : of the breathing, min
    """
    return 2.0 * np.pi * MINUTES_PER_DAY * (time - _middle(time)) / period


def own_frames(
    instrument: Instrument,
) -> tuple[Float[np.ndarray, "det 2"], Float[np.ndarray, " det"]]:
    """Return origin and unit of each detector's own distortion terms, um."""
    detectors = instrument.detectors
    half = [0.5 * max(d.n_x * d.pitch_x_um, d.n_y * d.pitch_y_um) for d in detectors]
    return np.array([(d.x_um, d.y_um) for d in detectors], dtype=float), np.array(half, dtype=float)


def _polynomials(time: Float[np.ndarray, " exp"], degree: int) -> Float[np.ndarray, "degree exp"]:
    """Return the Legendre polynomials of degree one and more in the time since the middle.

    The time is scaled to -1 at the first exposure and 1 at the last.
    """
    half = max(0.5 * float(np.ptp(time)), 1e-9)
    scaled = (time - _middle(time)) / half
    return legendre.legvander(scaled, degree)[:, 1:].T.copy()


def _middle(time: Float[np.ndarray, " exp"]) -> float:
    """Return the time halfway between the first and the last exposure."""
    return 0.5 * float(time.min() + time.max())
