"""Table of what differs between two solutions: their settings and their figures of merit."""

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from plateviz.tables.comparison import comparison
from plateviz.verdict.changes import COLUMNS, Row, merit, setting_changes
from plateviz.verdict.verdict import orbit_verdict
from solver.data.result import FitResult
from solver.data.schema import MEASURED

_EVIDENCE = "log_evidence"
# Key of the summary -> label and number of decimals.
_FIGURES: Mapping[str, tuple[str, int]] = {
    "n_measurements": ("Measurements", 0),
    "n_sources": ("Sources", 0),
    "n_reference": ("Reference sources", 0),
    "effective_parameters": ("Effective parameters", 1),
    "chi2_per_dof": ("χ² per degree of freedom", 4),
    "residual_rms_x": ("Rms residual in x (pixel)", 5),
    "residual_rms_y": ("Rms residual in y (pixel)", 5),
    "normalised_deviation_ra": ("Reference sources, rms deviation / σ in α", 3),
    "normalised_deviation_dec": ("Reference sources, rms deviation / σ in δ", 3),
    "mean_error_ra": ("Common error in α cos δ (mas)", 4),
    "mean_error_dec": ("Common error in δ (mas)", 4),
    _EVIDENCE: ("Log evidence", 1),
}
# Whose equality makes the data of two fits the same.
_DATA = [*(column.name for column in MEASURED), "nx", "ny", "sx", "sy"]
_MARGINAL = {"sigma_ra_marginal": "α cos δ", "sigma_dec_marginal": "δ"}


def solution_changes(result_a: FitResult, result_b: FitResult) -> pd.DataFrame:
    """Return what differs between two solutions, as text.

    Parameters
    ----------
    result_a : the solution taken as reference
    result_b : the solution compared with it; may be of another orbit

    Returns
    -------
    A row per setting that differs, and per figure of merit: `what`, `a`, `b`, and `change`, which
    is B minus A for numbers and empty for texts
    """
    rows = [*setting_changes(result_a.settings, result_b.settings), *_merits(result_a, result_b)]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _merits(a: FitResult, b: FitResult) -> list[Row]:
    rows = [("Verdict", orbit_verdict(a).headline, orbit_verdict(b).headline, "")]
    # Older results lack it.
    orbits = tuple(str(one.summary.get("orbit", "")) for one in (a, b))
    if orbits[0] != orbits[1]:
        rows.insert(0, ("Orbit", orbits[0], orbits[1], ""))
    elif changed := _changed_files(a, b):
        rows.insert(0, ("Input files with other contents", "", "", ", ".join(changed)))
    for key, (label, decimals) in _FIGURES.items():
        row = merit(label, a.summary.get(key), b.summary.get(key), decimals)
        rows.append(row if key != _EVIDENCE or _has_one_evidence(a, b) else (*row[:3], ""))
    for column, symbol in _MARGINAL.items():
        of_a, of_b = (float(one.sources[column].median()) for one in (a, b))
        rows.append(merit(f"Median marginal σ in {symbol} (mas)", of_a, of_b, 4))
    return [*rows, *_from_truth(a, b), *_positions(a, b)]


def _changed_files(a: FitResult, b: FitResult) -> list[str]:
    """Return the input files that two fits of an orbit have found with different contents."""
    common = [name for name in a.provenance if name in b.provenance]
    return [name for name in common if a.provenance[name] != b.provenance[name]]


def _has_one_evidence(a: FitResult, b: FitResult) -> bool:
    """Return whether the evidences of two solutions can be compared.

    That of other data says nothing, and a flat prior has no density: each more of them changes
    the evidence by an amount that depends on the unit.
    """
    flat_a, flat_b = (
        one.calibration.loc[np.isinf(one.calibration["prior_sigma"]), ["group", "element"]]
        for one in (a, b)
    )
    is_same_data = a.residuals[_DATA].equals(b.residuals[_DATA])
    return is_same_data and flat_a.reset_index(drop=True).equals(flat_b.reset_index(drop=True))


def _from_truth(a: FitResult, b: FitResult) -> list[Row]:
    of_a, of_b = (one.summary.get("truth", {}) for one in (a, b))
    return [
        merit(f"{kind} against truth in {symbol}, {name}", of_a[name][key], of_b[name][key], 3)
        for name in of_a
        if name in of_b
        for kind, figure in (("Pulls", "pull_rms"), ("Scatter of the pulls", "pull_sd"))
        for axis, symbol in (("ra", "α"), ("dec", "δ"))
        if (key := f"{figure}_{axis}") in of_a[name] and key in of_b[name]
    ]


def _positions(a: FitResult, b: FitResult) -> list[Row]:
    """Return the rms difference of the positions of the sources that both have."""
    shared = comparison(a, b)
    if shared.empty:
        return [("Sources in both", "", "", "0")]
    found = [("Sources in both", "", "", f"{len(shared):,}")]
    for column, symbol in (("difference_ra_mas", "α cos δ"), ("difference_dec_mas", "δ")):
        rms = math.sqrt(float((shared[column] ** 2).mean()))
        found.append((f"Rms difference of positions in {symbol} (mas)", "", "", f"{rms:.4f}"))
    return found
