"""The calibration with which an orbit was simulated, as one calibration of all its exposures."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float

from solver.data.distortion_terms import terms
from solver.data.instrument import Detector, Instrument
from solver.simulate.defects.defect import AppliedDefect, Defect, DefectStage
from solver.simulate.defects.detectors import motion
from solver.simulate.defects.distortion_terms import ADDED_TERMS
from solver.simulate.defects.stages import applied_defects
from solver.simulate.placement import place_detectors
from solver.simulate.schedule import orbit_schedule
from solver.simulate.settings import SurveySettings
from solver.units import ARCSEC_PER_DEG

_SHIFT, _TURN = "detector-shift", "detector-turn"
_VARYING = ("distortion-drift", "distortion-orbital", "distortion-step", _SHIFT, _TURN)


class TrueCalibration(NamedTuple):
    """The true distortion and detectors of one orbit, each the mean over its exposures.

    Attributes
    ----------
    instrument : with the true places, rotations and pitches of the detectors
    coefficients : of the distortion along x and y, um; all from degree 2 to the highest one, sorted
        by total degree, then by falling degree in x
    averaged : defects that change them during the orbit, in words; their mean is part of them
    left_out : other defects of the focal plane and the detectors, in words; no part of them
    """

    instrument: Instrument
    coefficients: Float[np.ndarray, "term 2"]
    averaged: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()


def true_calibration(
    settings: SurveySettings, instrument: Instrument, exposures: pd.DataFrame
) -> TrueCalibration | None:
    """Return the true calibration of an orbit; None for an orbit that was not simulated.

    Parameters
    ----------
    settings : of the survey
    instrument : the nominal instrument
    exposures : `orbit_id`, `field_id` and `plate_id` of the exposures of the mean
    """
    orbit_id = int(exposures["orbit_id"].iloc[0])
    if not 0 <= orbit_id < settings.orbits:
        return None
    schedule = orbit_schedule(orbit_id, settings)
    pairs = ["field_id", "plate_id"]
    is_used = pd.MultiIndex.from_frame(schedule[pairs]).isin(
        pd.MultiIndex.from_frame(exposures[pairs])
    )
    found = list(_moving(settings, orbit_id))
    by_degrees = {(k, j): np.array([a, b]) for k, j, a, b in settings.distortion_um}
    for _, applied in found:
        if applied.name in ADDED_TERMS:
            added = ADDED_TERMS[applied.name](applied, schedule)
            mean = added.coefficients * _mean(added.change, is_used)
            for degrees, pair in zip(added.degrees, mean, strict=True):
                by_degrees[degrees] = by_degrees.get(degrees, np.zeros(2)) + pair
    detectors = list(place_detectors(instrument, settings).detectors)
    for _, applied in found:
        if applied.name in (_SHIFT, _TURN):
            moves = motion(applied, len(detectors), len(schedule))
            after = np.arange(len(schedule)) >= moves.exposure
            moved = _moved(detectors[moves.detector], applied, moves.angle, _mean(after, is_used))
            detectors[moves.detector] = moved
    known = (*ADDED_TERMS, _SHIFT, _TURN)
    return TrueCalibration(
        replace(instrument, detectors=tuple(detectors)),
        _all(by_degrees),
        tuple(defect.label for defect, _ in found if defect.name in _VARYING),
        tuple(defect.label for defect, _ in found if defect.name not in known),
    )


def _moving(settings: SurveySettings, orbit_id: int) -> Iterator[tuple[Defect, AppliedDefect]]:
    for stage in (DefectStage.FOCAL_PLANE, DefectStage.DETECTOR):
        yield from applied_defects(settings, stage, orbit_id)


def _all(by_degrees: dict[tuple[int, int], np.ndarray]) -> Float[np.ndarray, "term 2"]:
    """Return the coefficients of all terms up to the highest degree."""
    every = terms(max(map(sum, by_degrees), default=0))
    return np.array([by_degrees.get(one, np.zeros(2)) for one in every]).reshape(-1, 2)


def _mean(change: np.ndarray, is_used: Bool[np.ndarray, " exp"]) -> float:
    return float(change[is_used].mean()) if is_used.any() else 0.0


def _moved(detector: Detector, applied: AppliedDefect, angle: float, share: float) -> Detector:
    """Return a detector at its mean place; it has moved for a share of the exposures."""
    size = share * applied.amplitude
    if applied.name == _TURN:
        return replace(detector, rotation_deg=detector.rotation_deg + size / ARCSEC_PER_DEG)
    return replace(
        detector,
        x_um=detector.x_um + size * math.cos(angle),
        y_um=detector.y_um + size * math.sin(angle),
    )
