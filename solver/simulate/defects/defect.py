"""Defect: an entry of the table of defects, and what its function gets."""

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float, Int

from solver.data.instrument import Instrument
from solver.simulate.streams import Stream, generator


class DefectStage(Enum):
    """Where a defect acts, in the order of application; the value is the text in the documents.

    The function of a defect gets its `AppliedDefect` and, for each stage:

    | stage        | further arguments                   | returns                              |
    |--------------|-------------------------------------|--------------------------------------|
    | CATALOGUE    | `CATALOGUE` and `TRUTH` tables      | `Altered` catalogue                  |
    | OBSERVER     | attitude, as from `orbit_attitude`  | attitude                             |
    | FOCAL_PLANE  | `TrueRows`                          | displacement, um, shape (obs, 2)     |
    | DETECTOR     | `TrueRows`                          | displacement, pixels, shape (obs, 2) |
    | NOISE        | `TrueRows`                          | noise over stated sigma, shape (obs,)|
    | MEASUREMENTS | `MEASUREMENT` table                 | `Altered` table                      |
    | EXPOSURES    | `ENVIRONMENT` table                 | table                                |
    """

    CATALOGUE = "the reference catalogue"
    OBSERVER = "the observer"
    FOCAL_PLANE = "the focal plane"
    DETECTOR = "the detectors"
    NOISE = "the noise"
    MEASUREMENTS = "the table of measurements"
    EXPOSURES = "the table of exposures"


@dataclass(frozen=True, kw_only=True)
class Defect:
    """One defect.

    Attributes
    ----------
    name : name in `--defect NAME=AMPLITUDE`
    label : what is wrong, in words
    unit : unit of the amplitude as astropy knows it; "" for a number
    example : an amplitude that can be seen in an orbit, as text
    does : what the defect does to the data, and what its amplitude is
    stands_for : the real effect for which it stands
    reference : literature
    stage : where it acts
    apply : the function that makes it; arguments and result as in `DefectStage`
    low, high : limits of the amplitude, in `unit`
    is_count : whether the amplitude is a whole number
    needs_magnitudes : whether it depends on the magnitudes of the stars
    """

    name: str
    label: str
    unit: str
    example: str
    does: str
    stands_for: str
    reference: str
    stage: DefectStage
    apply: Callable[..., Any]
    low: float = 0.0
    high: float = 1e6
    is_count: bool = False
    needs_magnitudes: bool = False

    @property
    def computed_in(self) -> str:
        """Unit of the amplitude in computations: fractions and pixels without their prefixes."""
        return {"%": "", "ppm": "", "mpix": "pix"}.get(self.unit, self.unit)


@dataclass(frozen=True)
class AppliedDefect:
    """A defect with its amplitude in one survey, and its random numbers.

    Attributes
    ----------
    name : of the defect
    amplitude : in `Defect.computed_in`
    settings : of the survey
    orbit_id : not used where the whole survey is concerned
    """

    name: str
    amplitude: float
    # `SurveySettings`, which imports the table of defects and so cannot be imported here.
    settings: Any
    orbit_id: int = 0

    def survey_rng(self) -> np.random.Generator:
        """Return the defect's generator that is the same in every orbit."""
        return generator(self.settings.seed, Stream.DEFECTS, self._number)

    def orbit_rng(self) -> np.random.Generator:
        """Return the defect's generator of the orbit."""
        return generator(self.settings.seed, Stream.DEFECTS, self._number, self.orbit_id)

    @property
    def _number(self) -> int:
        # Not the place in the table, so that a new defect leaves the numbers of the others.
        return zlib.crc32(self.name.encode())


@dataclass(frozen=True)
class TrueRows:
    """The measurements of one orbit before noise.

    Attributes
    ----------
    exposure, detector : indices into `attitude` and the detectors
    ideal : undistorted position on the focal plane, um
    pixel : position from the detector's centre, pixels
    magnitude : NaN where the survey has none
    attitude : the exposures, as from `solver.simulate.schedule.attitude`
    instrument : the true instrument
    """

    exposure: Int[np.ndarray, " obs"]
    detector: Int[np.ndarray, " obs"]
    ideal: Float[np.ndarray, "obs 2"]
    pixel: Float[np.ndarray, "obs 2"]
    magnitude: Float[np.ndarray, " obs"]
    attitude: pd.DataFrame
    instrument: Instrument

    def moved(
        self, ideal: Float[np.ndarray, "obs 2"], pixel: Float[np.ndarray, "obs 2"]
    ) -> "TrueRows":
        """Return the same measurements at other places."""
        return replace(self, ideal=ideal, pixel=pixel)

    def of_detector(self, *names: str) -> Float[np.ndarray, "obs _"]:
        """Return attributes of the detector of each measurement."""
        values = [[getattr(d, name) for name in names] for d in self.instrument.detectors]
        return np.array(values, dtype=float)[self.detector]


class Altered(NamedTuple):
    """A table with a defect, and `defect_schema.AFFECTED` without the defect's name."""

    table: pd.DataFrame
    affected: pd.DataFrame


def elapsed(attitude: pd.DataFrame) -> Float[np.ndarray, " exp"]:
    """Return the time of each exposure as a fraction, 0 for the first and 1 for the last."""
    time = attitude["obstime"].to_numpy()
    return (time - time.min()) / max(float(np.ptp(time)), 1e-9)


def survey_time(applied: AppliedDefect) -> float:
    """Return the number of the orbit as a fraction: 0 for the survey's first, 1 for its last."""
    return applied.orbit_id / max(applied.settings.orbits - 1, 1)
