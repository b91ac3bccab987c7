"""What a fit that estimates the noise has found, in words."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from plateviz.tables.rounded import rounded
from solver.data.result import FitResult
from solver.units import PIX_PER_MPIX

# Names in the entry of a noise model.
_ALL, _REFERENCES, _EXPOSURE = "all", "references", "exposure "


def noise_sentences(result: FitResult) -> list[str]:
    """Return sentences on the noise that a fit has estimated; none if it had not to."""
    if not result.settings.has_noise_model:
        return []
    entry = result.summary.get("noise")
    if entry is None:
        return ["The noise could not be estimated: the stated uncertainties are used."]
    parts = _parts(entry)
    words = f"The fit estimates {', '.join(parts[:-1])}{' and ' if parts[1:] else ''}{parts[-1]}."
    if not entry["converged"]:
        words += f" The estimate had not settled after {entry['rounds']} rounds."
    return [words]


def reference_factor(result: FitResult) -> tuple[float, float] | None:
    """Return the estimated factor on the errors of the reference stars, and its distance from 1.

    The distance is in sigmas, of the factor's logarithm. None if it was not estimated.
    """
    entry = result.summary.get("noise") or {}
    log_factor = entry.get("log_factor", {}).get(_REFERENCES)
    if log_factor is None:
        return None
    sigma = float(entry["sigma"][_REFERENCES])
    return float(np.exp(log_factor)), float(log_factor) / sigma if sigma > 0.0 else 0.0


def _parts(entry: Mapping[str, Any]) -> list[str]:
    log_factor, sigma = entry["log_factor"], entry["sigma"]
    of_exposures = [value for name, value in log_factor.items() if name.startswith(_EXPOSURE)]
    parts = []
    if _ALL in log_factor:
        where = " at the mean magnitude" if any("magnitude" in name for name in log_factor) else ""
        factor = _with_error(log_factor[_ALL], sigma[_ALL])
        parts.append(f"the noise{where} as {factor} times the stated uncertainties")
    if of_exposures:
        low, high = np.exp(min(of_exposures)), np.exp(max(of_exposures))
        parts.append(
            f"the noise of each exposure as {low:.3f} to {high:.3f} times the stated uncertainties"
        )
    if "floor_pix" in entry:
        floor, error = (float(entry[name]) for name in ("floor_pix", "floor_sigma_pix"))
        parts.append(
            f"a floor of {rounded(floor / PIX_PER_MPIX, 3)} ± "
            f"{rounded(error / PIX_PER_MPIX, 1)} mpix that adds to "
            "the uncertainties in quadrature"
        )
    if _REFERENCES in log_factor:
        factor = _with_error(log_factor[_REFERENCES], sigma[_REFERENCES])
        parts.append(f"the errors of the reference stars as {factor} times those stated")
    return parts


def _with_error(log_factor: float, sigma: float) -> str:
    factor = float(np.exp(log_factor))
    error = rounded(factor * sigma)
    return f"{factor:.{len(error.partition('.')[2])}f} ± {error}"
