"""True values of the parameters of causes, for defects that a fit can model."""

import numpy as np
import pandas as pd

from solver.data.result import FitResult
from solver.simulate.defects.defect import Case


def true_terms(case: Case, degree: int) -> np.ndarray:
    """Return the coefficients of a defect of the distortion, x and y in rows, um."""
    found = case.survey_rng().standard_normal((degree + 1, 2))
    return (case.amplitude * found / np.linalg.norm(found)).T


def truth_of(case: Case, exposures: pd.DataFrame) -> dict[str, np.ndarray | float]:
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
    """Return the deviations of a group from the truth in marginal sigmas."""
    rows = result.calibration[result.calibration["group"] == group]
    return (rows["offset"].to_numpy() - truth) / rows["sigma_marginal"].to_numpy()
