"""True values of the parameters of causes, for defects that a fit can model."""

import numpy as np
import pandas as pd

from solver.data.result import FitResult
from solver.results.diagnosis.rows import detector_spans
from solver.simulate.defects.defect import AppliedDefect
from solver.simulate.defects.detectors import motion
from solver.simulate.defects.distortion_terms import ORBITAL_PERIOD_S, of_higher_order
from solver.units import SECONDS_PER_DAY

_PERCENT = 0.01


def true_terms(case: AppliedDefect, degree: int) -> np.ndarray:
    """Return the coefficients of a defect of the distortion, x and y in rows, um."""
    found = case.survey_rng().standard_normal((degree + 1, 2))
    return (case.amplitude * found / np.linalg.norm(found)).T


def all_deviations(case: AppliedDefect, result: FitResult) -> dict[str, np.ndarray]:
    """Return the deviations from the truth of the parameters that a fit with a cause adds, sigmas.

    Parameters
    ----------
    case : with the amplitude in the unit of its table

    Returns
    -------
    By group; empty if the parameters have no true values, as those of a polynomial that stands for
    another function
    """
    truth = true_places(case, result) or truth_of(case, result.exposures)
    of_groups = {group: deviations(result, group, values) for group, values in truth.items()}
    return of_groups | _of_noise(case, result)


def true_places(case: AppliedDefect, result: FitResult) -> dict[str, np.ndarray]:
    """Return group -> true values of a detector that moves, by detectors and spans."""
    if case.name not in ("detector-shift", "detector-turn"):
        return {}
    n_detectors = int((result.calibration["group"] == "detector_x").sum())
    moves = motion(case, n_detectors, len(result.exposures))
    spans, after = detector_spans(result), np.arange(len(result.exposures)) >= moves.exposure
    # Of a span with exposures before and after, the mean.
    share = np.zeros((n_detectors, spans.max()))
    share[moves.detector] = (np.bincount(spans, after) / np.bincount(spans))[1:]
    is_turn = case.name == "detector-turn"
    size = case.amplitude * share.ravel()
    return {
        "detector_motion_x": (not is_turn) * np.cos(moves.angle) * size,
        "detector_motion_y": (not is_turn) * np.sin(moves.angle) * size,
        "detector_turn": is_turn * size,
    }


def _of_noise(case: AppliedDefect, result: FitResult) -> dict[str, np.ndarray]:
    """Return the deviations of the logarithms of the factors on the uncertainties."""
    if "noise" not in result.summary:
        return {}
    found = result.summary["noise"]
    names, truth = list(found["log_factor"]), np.log1p(_PERCENT * case.amplitude)
    if case.name == "noise-exposure":
        truth = _PERCENT * case.amplitude * case.orbit_rng().standard_normal(len(names))
    elif case.name not in ("noise", "reference-errors"):
        return {}
    values, sigmas = (
        np.array([found[key][name] for name in names]) for key in ("log_factor", "sigma")
    )
    return {"noise": (values - truth) / sigmas}


def truth_of(case: AppliedDefect, exposures: pd.DataFrame) -> dict[str, np.ndarray | float]:
    """Return group -> true values; empty if the simulator has no such parameters.

    Parameters
    ----------
    case : with the amplitude in the unit of the parameters
    exposures : of the fit
    """
    if case.name == "focal-anisotropy":
        deviates = case.orbit_rng().standard_normal(len(exposures))
        return {"focal_anisotropy": case.amplitude * deviates}
    if case.name == "distortion-drift":
        # From -1/2 to 1/2 over the orbit; the polynomial of first degree goes from -1 to 1.
        x, y = 0.5 * true_terms(case, 2)
        return {"drift_x": x, "drift_y": y}
    if case.name == "distortion-orbital":
        # The phase of the fit is zero halfway between the first and the last exposure.
        half = 0.5 * SECONDS_PER_DAY * float(np.ptp(exposures["obstime"]))
        phase = case.orbit_rng().uniform(0.0, 2.0 * np.pi)
        phase += 2.0 * np.pi * half / ORBITAL_PERIOD_S
        x, y = (
            np.outer([np.cos(phase), -np.sin(phase)], one).ravel() for one in true_terms(case, 2)
        )
        return {"breathing_x": x, "breathing_y": y}
    if case.name == "distortion-order":
        x, y = of_higher_order(case, exposures).coefficients.T
        return {"distortion_x": x, "distortion_y": y}
    if case.name == "distortion-step":
        # Degree two does not change, nor does the second of the four fields.
        still = np.zeros(3)
        x, y = (
            np.concatenate([np.zeros(7), *[np.r_[still, cubic]] * 2])
            for cubic in true_terms(case, 3)
        )
        return {"field_distortion_x": x, "field_distortion_y": y}
    if case.name == "charge-transfer":
        return {"charge_transfer_x": 0.0, "charge_transfer_y": case.amplitude}
    if case.name == "pixel-phase":
        sines = {f"phase_sine_{axis}": case.amplitude for axis in "xy"}
        return {**sines, **{f"phase_cosine_{axis}": 0.0 for axis in "xy"}}
    return {}


def deviations(result: FitResult, group: str, truth: np.ndarray | float) -> np.ndarray:
    """Return the deviations of a group from the truth in marginal sigmas.

    Parameters
    ----------
    truth : of all parameters of the group, or of the last ones
    """
    rows = result.calibration[result.calibration["group"] == group]
    rows = rows.iloc[-np.size(truth) :] if np.ndim(truth) else rows
    return (rows["offset"].to_numpy() - truth) / rows["sigma_marginal"].to_numpy()
