"""Smooth errors of the catalogue in words, which only many orbits show."""

import numpy as np
import pandas as pd

from plateviz.tables.rounded import rounded
from plateviz.verdict.causes import Cause
from plateviz.verdict.run_case import RunCase

# Zonal errors larger than this share of the positions' uncertainty make it wrong by a tenth.
_LARGE_SHARE = 0.5
# Orbits of a source whose uncertainty is typical.
_MIN_ORBITS = 4


def zonal_cause(case: RunCase) -> Cause:
    """Return in words that the reference stars of neighbouring places deviate together."""
    row = case.tables.zonal.iloc[0]
    rms = float(row["rms"])
    typical = _typical_sigma(case.motions)
    spoils = (
        f"It spoils all positions, by about {rounded(rms)} mas, which more orbits do not reduce"
    )
    if np.isfinite(typical):
        spoils += (
            f"; the motions fitted to all orbits have a typical uncertainty of {rounded(typical)} "
            "mas"
        )
    words = (
        "The reference stars of neighbouring places deviate together, and the frames of the "
        "orbits and their distortion follow as they would the catalogue, not the focal plane: "
        f"χ² {case.test.statistic:.1f}, expected {case.test.expected:.0f} ± "
        f"{case.test.scatter:.1f}. The field has an rms of about {rounded(rms)} mas along "
        "each axis."
    )
    return Cause(
        "zonal-errors",
        "the reference catalogue has smooth errors, which neighbouring stars share",
        words,
        float(case.test.sigma),
        f"{spoils}.",
        "state larger errors of the reference stars, or use another catalogue",
        (f"--prior sources={max(_widened(case, rms), 1.1):.2f}",),
        rms > _LARGE_SHARE * typical,
    )


def _typical_sigma(motions: pd.DataFrame) -> float:
    """Return the median uncertainty of the fitted positions, mas; NaN if none is fitted."""
    many = ~motions["is_reference"].astype(bool) & (motions["n_orbits"] >= _MIN_ORBITS)
    rows = motions[many] if many.any() else motions
    return _median(rows[["sigma_ra", "sigma_dec"]])


def _widened(case: RunCase, rms: float) -> float:
    """Return the factor on the errors of the reference stars that has room for the field."""
    rows = case.motions[case.motions["is_reference"].astype(bool)]
    stated = _median(rows[["sigma_catalogue_ra", "sigma_catalogue_dec"]])
    return float(np.hypot(1.0, rms / stated)) if stated > 0.0 else 1.1


def _median(table: pd.DataFrame) -> float:
    """Return the median of the known values of a table; NaN if there is none."""
    values = table.to_numpy(dtype=float)
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")
