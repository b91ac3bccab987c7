"""What defects add to the coefficients of the distortion, as a function of the exposure."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.simulate.defects.defect import AppliedDefect, elapsed, survey_time
from solver.units import SECONDS_PER_DAY

# Period of a circular orbit 600 km above the Earth, the paper's section "Discussion".
ORBITAL_PERIOD_S = 5_801.0

_QUADRATIC, _CUBIC, _ABOVE_FIFTH = (2,), (3,), (6, 7)


class AddedTerms(NamedTuple):
    """Coefficients that are added to those of the distortion in each exposure.

    Attributes
    ----------
    degrees : degree k in x and l in y of each term
    coefficients : those of x and y, um
    change : factor of the coefficients in each exposure
    """

    degrees: list[tuple[int, int]]
    coefficients: Float[np.ndarray, "term 2"]
    change: Float[np.ndarray, " exp"]


def drifting(applied: AppliedDefect, attitude: pd.DataFrame) -> AddedTerms:
    """Return quadratic terms that change linearly with time; zero in the middle of the orbit."""
    return _added(applied, _QUADRATIC, elapsed(attitude) - 0.5)


def oscillating(applied: AppliedDefect, attitude: pd.DataFrame) -> AddedTerms:
    """Return quadratic terms that change with the phase of the satellite's orbit."""
    seconds = SECONDS_PER_DAY * (attitude["obstime"] - attitude["obstime"].min())
    phase = applied.orbit_rng().uniform(0.0, 2.0 * np.pi)
    angle = 2.0 * np.pi * seconds.to_numpy() / ORBITAL_PERIOD_S + phase
    return _added(applied, _QUADRATIC, np.cos(angle))


def stepping(applied: AppliedDefect, attitude: pd.DataFrame) -> AddedTerms:
    """Return cubic terms that the second half of the fields has."""
    fields = attitude["field_id"].to_numpy()
    later = fields >= np.unique(fields)[len(np.unique(fields)) // 2]
    return _added(applied, _CUBIC, later.astype(float))


def changing_with_orbits(applied: AppliedDefect, attitude: pd.DataFrame) -> AddedTerms:
    """Return quadratic terms that change linearly from orbit to orbit; zero in mid-survey."""
    return _added(applied, _QUADRATIC, np.full(len(attitude), survey_time(applied) - 0.5))


def of_higher_order(applied: AppliedDefect, attitude: pd.DataFrame) -> AddedTerms:
    """Return constant terms of degree 6 and 7, above the fit's default order."""
    return _added(applied, _ABOVE_FIFTH, np.ones(len(attitude)))


ADDED_TERMS: Mapping[str, Callable[[AppliedDefect, pd.DataFrame], AddedTerms]] = MappingProxyType(
    {
        "distortion-drift": drifting,
        "distortion-orbital": oscillating,
        "distortion-step": stepping,
        "distortion-trend": changing_with_orbits,
        "distortion-order": of_higher_order,
    }
)
"""Name of a defect of the distortion -> what it adds, for the exposures of an orbit."""


def _added(
    applied: AppliedDefect, degrees: tuple[int, ...], change: Float[np.ndarray, " exp"]
) -> AddedTerms:
    """Return terms of some degrees.

    The coefficients, those of x and y together, are a random direction of the survey with the
    amplitude as length (root of the sum of squares, um).
    """
    terms = [(degree - j, j) for degree in degrees for j in range(degree + 1)]
    coefficients = applied.survey_rng().standard_normal((len(terms), 2))
    coefficients *= applied.amplitude / np.linalg.norm(coefficients)
    return AddedTerms(terms, coefficients, change)
